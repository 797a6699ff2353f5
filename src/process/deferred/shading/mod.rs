//! What the shaders of several processes share: surfaces, normals, illumination and shadows. In WGSL, and the same in
//! Rust in `cpu_shader`.

#[cfg(feature = "software")]
pub(super) mod cpu_shader;
mod normal_encoding;
mod shadow;

pub(super) use shadow::shadow_shader;

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

/// WGSL that sums light in batches.
pub(super) const LIGHT_BATCHES_SHADER: &str = include_str!("light_batches.wgsl");
