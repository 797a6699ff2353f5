//! What the shaders of several processes share: surfaces, normals, illumination and shadows. In WGSL, and the same in
//! Rust in `cpu_shader`.

#[cfg(feature = "software")]
pub(super) mod cpu_shader;
mod normal_encoding;
mod shadow;

pub(super) use shadow::shadow_shader;

#[cfg(doc)]
use crate::process::Declare;
use crate::view::ShadowMaps;

/// The WGSL with which the geometry buffer and transparency draw objects, for processes that replace them. It follows
/// [`SHADER_PRELUDE`](crate::process::SHADER_PRELUDE), and has the entry point `vertex`.
///
/// Fragment shaders get a `Surface`: the position `relative` to the camera along the world's axes, the interpolated
/// `normal`, `uv`, and the indices of the `material` and the `object`. `shading_normal(surface, material)` is the
/// normal of the visible side; `surface_diffuse(surface, material)` is the diffuse colour with the material's texture,
/// and the opacity. Both need uniform control flow. The prelude's `is_cut_out(material, uv)` says where a mask has a
/// hole; see [`CommandDraws::masked`](crate::process::CommandDraws::masked).
pub const SURFACE_SHADER: &str = concat!(include_str!("uncolored_surface.wgsl"), "\n", include_str!("surface.wgsl"));

/// [`SURFACE_SHADER`] for processes that [read](crate::process::Declare::reads_attribute)
/// [`VERTEX_COLOR`](crate::scene::VERTEX_COLOR): the diffuse colour is multiplied by it.
pub const COLORED_SURFACE_SHADER: &str =
    concat!(include_str!("colored_surface.wgsl"), "\n", include_str!("surface.wgsl"));

/// The WGSL by which lights illuminate: `illuminance_from(light, position, normal)` is the illuminance of a surface at
/// a position relative to the camera, without shadows.
pub const ILLUMINATION_SHADER: &str = include_str!("illumination.wgsl");

/// The WGSL by which surfaces of an engine's own are lit as the shipped ones are, for processes that draw them in one
/// pass. It follows [`SHADER_PRELUDE`](crate::process::SHADER_PRELUDE), and begins with [`ILLUMINATION_SHADER`].
///
/// - `illuminance_at(position, normal)` is the illuminance of a surface by all lights that reach the view, with their
///   shadows. The ambient light's is `view.ambient * PI`. Where there are many lights,
///   [`LightTiles`](crate::process::LightTiles) has a loop over those that reach a tile of the picture.
/// - `visible_illuminance_from(light, position, normal)` is that of one of the `lights`, for loops of an engine's own.
/// - `light_visibility(light, position, normal)` is the fraction of one of the `lights` that reaches a position, from 0
///   to 1, by the filter and the bias of the maps. It needs no uniform control flow.
///
/// Positions are relative to the camera along the world's axes; normals are of unit length, on the visible side.
///
/// `maps` are those that the pipeline [draws](crate::process::ShadowCasters), with the number of their binding: the
/// process [samples their layers](Declare::samples_layers), and the binding is 1 if it samples nothing before them.
/// `None` is light without shadows.
///
/// ```
/// use drawloom::process::{Declare, Draws, CommandDraws, InjectionPoint, RenderProcess, lighting_shader, targets};
/// use drawloom::scene::ViewKind;
/// use drawloom::view::ShadowMaps;
///
/// struct Clay {
///     shader: String,
/// }
///
/// impl Clay {
///     fn new(maps: &ShadowMaps) -> Self {
///         Self { shader: [&lighting_shader(Some((1, maps))), CLAY].concat() }
///     }
/// }
///
/// const CLAY: &str = "
///     struct Corner {
///         @builtin(position) clip: vec4<f32>,
///         @location(0) relative: vec3<f32>,
///         @location(1) normal: vec3<f32>,
///     }
///
///     @vertex
///     fn vertex(in: VertexInput) -> Corner {
///         let object = drawn_object(in.instance);
///         let relative = relative_position(object, in.position);
///         return Corner(clip_position(relative), relative, world_normal(object, in.normal));
///     }
///
///     @fragment
///     fn fragment(in: Corner) -> @location(0) vec4<f32> {
///         let illuminance = view.ambient * PI + illuminance_at(in.relative, normalize(in.normal));
///         return vec4<f32>(vec3<f32>(0.6, 0.4, 0.3) / PI * illuminance, 1.0);
///     }
/// ";
///
/// impl RenderProcess for Clay {
///     fn name(&self) -> &str {
///         "clay"
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.at(InjectionPoint::AfterLighting);
///         declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
///         declare.draws_over(targets::RADIANCE);
///         declare.draws_depth(targets::DEPTH);
///     }
///
///     fn draws(&self) -> Draws<'_> {
///         Draws::Commands(CommandDraws { shader: &self.shader, ..CommandDraws::default() })
///     }
/// }
/// # assert!(Clay::new(&ShadowMaps::default()).shader.contains("illuminance_at"));
/// ```
pub fn lighting_shader(maps: Option<(u32, &ShadowMaps)>) -> String {
    [ILLUMINATION_SHADER, &shadow_shader(maps), include_str!("light_loop.wgsl")].join("\n")
}

/// WGSL that sums light in batches.
pub(super) const LIGHT_BATCHES_SHADER: &str = include_str!("light_batches.wgsl");
