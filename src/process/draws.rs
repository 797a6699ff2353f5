//! What a process draws.

use std::borrow::Cow;

#[cfg(feature = "wgpu")]
use super::RawPass;
use super::{
    BlendEquation, BufferOffset, ComputeDispatch, DrawCount, FaceCulling, ItemDraws, PipelineState, ProceduralDraws,
    ShaderResource, Stencil, StencilOperation, Workgroups,
};
use crate::command::{DrawOrder, Selection};
use crate::scene::{Blend, ColumnLayout};
use crate::view::LightClass;

/// What a process draws in each of its views.
#[derive(Clone)]
#[non_exhaustive]
pub enum Draws<'a> {
    /// The objects that the view sees, all with one shader.
    Commands(CommandDraws<'a>),
    /// Every pixel, once.
    FullScreen(FullScreen<'a>),
    /// The pixels that the lights of a class reach.
    Lights(LightDraws<'a>),
    /// Vertices that the shader makes itself.
    Procedural(ProceduralDraws<'a>),
    /// A compute shader runs; nothing is drawn.
    Compute(ComputeDispatch<'a>),
    /// What the engine lends and records itself: culled, sorted and divided by the frame.
    Items(ItemDraws),
    /// Commands that the process encodes itself: compute, copies, render passes.
    #[cfg(feature = "wgpu")]
    Raw(&'a dyn RawPass),
}

/// The objects that a view sees: culled, sorted, merged into instanced batches and recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandDraws<'a> {
    /// WGSL, appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `vertex`.
    pub shader: &'a str,
    /// The fragment entry point; `None` draws only depth.
    pub fragment: Option<&'a str>,
    /// The fragment entry point that takes the place of `fragment` in the maps of directional lights on devices without
    /// [`DEPTH_CLIP_FEATURES`](crate::backend::WgpuBackend::DEPTH_CLIP_FEATURES). There `clip_position` clamps corners
    /// in front of the near plane onto it, and this entry point writes each pixel's own depth, at most 1. With `None`,
    /// a triangle that crosses the plane has wrong depths.
    pub clamped_fragment: Option<&'a str>,
    /// The entry points for objects whose material [is a mask](crate::scene::Material::is_masked), in place of `vertex`
    /// and `fragment`; `None` draws these objects like others.
    pub masked: Option<MaskedEntryPoints<'a>>,
    /// What `clamped_fragment` is for `fragment`, for the fragment entry point of `masked`.
    pub clamped_masked_fragment: Option<&'a str>,
    /// Whether `fragment` discards pixels, or returns a depth of its own: then no object that the process draws hides
    /// what is behind it from culling. [Masked](crate::scene::Material::is_masked) objects never do. A warning
    /// names a process whose shader does so, and which does not set this.
    pub discards: bool,
    /// The process's own WGSL function `fn deform(in: VertexInput, object: Object) -> VertexInput`: the vertex in the
    /// object's shape of this frame, for skinning, morph targets or wind. It replaces the prelude's, which returns
    /// `in`, and which the shipped processes and [`SURFACE_SHADER`](super::SURFACE_SHADER) call.
    /// [`Deferred::deformation`](super::Deferred::deformation) sets it for all processes of the pipeline.
    ///
    /// The objects' bounds contain what it returns. Deformed objects hide nothing behind them from culling, and their
    /// triangles are not culled on the CPU.
    pub deformation: Option<&'a str>,
    /// Which objects are drawn.
    pub selection: Selection,
    /// Which faces of the objects are drawn.
    pub face_culling: FaceCulling,
    /// The blend equation of each colour target, in the order declared; if empty, each object's material decides.
    /// Another number of equations is an [error](super::PlanError::BlendEquationCount). Objects that are drawn by
    /// equations hide nothing from culling.
    pub blend_equations: Vec<BlendEquation>,
    /// Whether depth is written. Objects with a blending material write none, unless there are `blend_equations`.
    pub writes_depth: bool,
    /// The stencil test; `None` for none.
    pub stencil: Option<Stencil>,
    /// How depth is compared and moved, and which channels are written.
    pub pipeline_state: PipelineState,
    /// The bytes of the uniform at `@group(2) @binding(0)`; if empty, there is no such binding.
    pub parameters: Cow<'a, [u8]>,
    /// The engine's own resources that the shader reads.
    pub resources: Vec<ShaderResource<'a>>,
}

impl Default for CommandDraws<'_> {
    fn default() -> Self {
        Self {
            shader: "",
            fragment: Some("fragment"),
            clamped_fragment: None,
            masked: None,
            clamped_masked_fragment: None,
            discards: false,
            deformation: None,
            selection: Selection::OPAQUE,
            face_culling: FaceCulling::ByMaterial,
            blend_equations: Vec::new(),
            writes_depth: true,
            stencil: None,
            pipeline_state: PipelineState::default(),
            parameters: Cow::Borrowed(&[]),
            resources: Vec::new(),
        }
    }
}

/// The entry points of a process's shader for masked objects.
///
/// ```
/// use drawloom::process::{CommandDraws, MaskedEntryPoints};
///
/// // Draws depth alone: opaque objects without a fragment shader, masked ones with their holes.
/// let draws = CommandDraws {
///     shader: "
///         @vertex
///         fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
///             return clip_position(relative_position(drawn_object(in.instance), in.position));
///         }
///
///         struct Corner {
///             @invariant @builtin(position) position: vec4<f32>,
///             @location(0) uv: vec2<f32>,
///             @location(1) @interpolate(flat) material: u32,
///         }
///
///         @vertex
///         fn masked_vertex(in: VertexInput) -> Corner {
///             let object = drawn_object(in.instance);
///             let position = clip_position(relative_position(object, in.position));
///             return Corner(position, bounded_uv(in.uv), object.material);
///         }
///
///         @fragment
///         fn masked_fragment(in: Corner) {
///             if is_cut_out(materials[in.material], in.uv) {
///                 discard;
///             }
///         }
///     ",
///     fragment: None,
///     masked: Some(MaskedEntryPoints { vertex: "masked_vertex", fragment: "masked_fragment" }),
///     ..CommandDraws::default()
/// };
/// # assert!(!draws.discards);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskedEntryPoints<'a> {
    /// The vertex entry point, which hands on the texture coordinates and the material.
    pub vertex: &'a str,
    /// The fragment entry point, which discards pixels where the prelude's `is_cut_out` says so.
    pub fragment: &'a str,
}

/// Every pixel of the view, once, by one triangle infinitely far away: if the process tests depth, only pixels where
/// nothing was drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FullScreen<'a> {
    /// WGSL, appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `fragment`, whose input is
    /// the prelude's `FullScreenPixel`.
    pub shader: &'a str,
    /// How it blends with the targets' content.
    pub blend: Blend,
    /// The blend equation of each colour target, in the order declared; if empty, `blend` decides.
    pub blend_equations: Vec<BlendEquation>,
    /// The stencil test; `None` for none.
    pub stencil: Option<Stencil>,
    /// The bytes of the uniform at `@group(2) @binding(0)`; if empty, there is no such binding.
    pub parameters: Cow<'a, [u8]>,
    /// The engine's own resources that the shader reads.
    pub resources: Vec<ShaderResource<'a>>,
}

/// The pixels that lights reach. Each light is drawn as a light volume (L 4.2.1), all lights of a class in one
/// instanced draw, with additive blending. A process that draws lights tests depth, so that pixels whose surface is
/// behind the light volume are rejected before they are shaded.
#[derive(Clone, Debug, PartialEq)]
pub struct LightDraws<'a> {
    /// WGSL, appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `fragment`, whose input is
    /// the prelude's `LightPixel`.
    pub shader: &'a str,
    /// Which lights are drawn.
    pub class: LightClass,
    /// The bytes of the uniform at `@group(2) @binding(0)`; if empty, there is no such binding.
    pub parameters: Cow<'a, [u8]>,
    /// The engine's own resources that the shader reads.
    pub resources: Vec<ShaderResource<'a>>,
}

impl Draws<'_> {
    /// Which objects are drawn; `None` if it draws no objects.
    pub fn selection(&self) -> Option<Selection> {
        match self {
            Self::Commands(commands) => Some(commands.selection),
            _ => None,
        }
    }

    /// Whether the engine encodes the pass itself.
    #[cfg(feature = "wgpu")]
    pub(crate) fn is_raw(&self) -> bool {
        matches!(self, Self::Raw(_))
    }

    /// Whether the engine encodes the pass itself, which it does with wgpu alone.
    #[cfg(not(feature = "wgpu"))]
    pub(crate) fn is_raw(&self) -> bool {
        false
    }

    /// The column by which it orders objects; `None` if it orders them in another way.
    pub(crate) fn order_column(&self) -> Option<ColumnLayout> {
        match self.selection()?.order {
            DrawOrder::ByColumn(column) => Some(column.layout()),
            _ => None,
        }
    }

    /// Whether it draws objects that write depth all over the shape of their meshes, and so hide what is behind them:
    /// opaque ones, neither deformed nor inside out, without discarding pixels, and whatever the stencil and where nearer
    /// things are. Those with a mask do not.
    pub fn hides(&self) -> bool {
        let Self::Commands(draws) = self else { return false };
        let writes_all = draws.writes_depth && draws.stencil.is_none_or(|stencil| stencil.always_passes());
        let shows_fronts = draws.face_culling != FaceCulling::Reversed;
        let covers = !draws.discards && shows_fronts && draws.pipeline_state.covers();
        writes_all && covers && draws.deformation.is_none() && draws.blend_equations.is_empty()
    }

    /// Whether objects that are hidden behind others show, or change the stencil, so that they must be drawn.
    pub fn draws_where_hidden(&self) -> bool {
        // The stencil test comes before the depth test.
        self.pipeline_state().is_some_and(PipelineState::shows_hidden)
            || self.stencil().is_some_and(|stencil| {
                let changes = |operation| stencil.write_mask != 0 && operation != StencilOperation::Keep;
                changes(stencil.on_depth_fail) || changes(stencil.on_fail) && !stencil.always_passes()
            })
    }

    /// Whether triangle culling is exact for it: it does not deform objects, and culls faces as materials say.
    #[cfg(feature = "occlusion")]
    pub fn allows_triangle_culling(&self) -> bool {
        matches!(self, Self::Commands(CommandDraws { deformation: None, face_culling: FaceCulling::ByMaterial, .. }))
    }

    /// The blend equation of each colour target; empty if materials, or the kind of draws, decide.
    pub fn blend_equations(&self) -> &[BlendEquation] {
        match self {
            Self::Commands(commands) => &commands.blend_equations,
            Self::FullScreen(full_screen) => &full_screen.blend_equations,
            Self::Procedural(procedural) => &procedural.blend_equations,
            _ => &[],
        }
    }

    /// The engine's own resources that the shader reads; none for a raw pass.
    pub fn resources(&self) -> &[ShaderResource<'_>] {
        match self {
            Self::Commands(commands) => &commands.resources,
            Self::FullScreen(full_screen) => &full_screen.resources,
            Self::Lights(lights) => &lights.resources,
            Self::Procedural(procedural) => &procedural.resources,
            Self::Compute(dispatch) => &dispatch.resources,
            Self::Items(_) => &[],
            #[cfg(feature = "wgpu")]
            Self::Raw(_) => &[],
        }
    }

    /// The stencil test, if there is one.
    pub fn stencil(&self) -> Option<Stencil> {
        match self {
            Self::Commands(commands) => commands.stencil,
            Self::FullScreen(full_screen) => full_screen.stencil,
            Self::Procedural(procedural) => procedural.stencil,
            _ => None,
        }
    }

    /// The state of its pipelines beside blending, culling and stencil; `None` for what has none of its own.
    pub fn pipeline_state(&self) -> Option<&PipelineState> {
        match self {
            Self::Commands(commands) => Some(&commands.pipeline_state),
            Self::Procedural(procedural) => Some(&procedural.pipeline_state),
            _ => None,
        }
    }

    /// Where the arguments of an indirect draw or dispatch are, and their size in bytes; `None` if it has none.
    pub fn arguments(&self) -> Option<(BufferOffset, u64)> {
        match self {
            Self::Procedural(ProceduralDraws { count: DrawCount::Indirect(offset), .. }) => {
                Some((*offset, DrawCount::ARGUMENT_BYTES))
            }
            Self::Compute(ComputeDispatch { workgroups: Workgroups::Indirect(offset), .. }) => {
                Some((*offset, Workgroups::ARGUMENT_BYTES))
            }
            _ => None,
        }
    }

    /// The bytes of the uniform at `@group(2) @binding(0)`; empty if there is none.
    pub fn parameters(&self) -> &[u8] {
        match self {
            Self::Commands(commands) => &commands.parameters,
            Self::FullScreen(full_screen) => &full_screen.parameters,
            Self::Lights(lights) => &lights.parameters,
            Self::Procedural(procedural) => &procedural.parameters,
            Self::Compute(dispatch) => &dispatch.parameters,
            Self::Items(_) => &[],
            #[cfg(feature = "wgpu")]
            Self::Raw(_) => &[],
        }
    }
}
