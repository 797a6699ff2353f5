//! The key of a process's pipelines: what they are made from.

use std::borrow::Cow;

use crate::command::{Cull, DrawState};
use crate::process::{BlendEquation, Draws, FaceCulling, PipelineState, Primitive, Stencil, prelude_with};
use crate::quality::{Quality, TransformPrecision, VertexFormat};
use crate::scene::{AttributeLayout, Blend, LightVolume, Topology};

/// The inputs of pipelines that a process, or the quality, may change from frame to frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PipelineKey<'a> {
    shader: Cow<'a, str>,
    deformation: Option<Cow<'a, str>>,
    pub(crate) vertices: VertexSource,
    pub(crate) fragment: Option<Cow<'a, str>>,
    /// The vertex and the fragment entry point of masked objects, if they have their own.
    pub(crate) masked: Option<[Cow<'a, str>; 2]>,
    /// Those of the fragments of unmasked and of masked objects where corners are clamped.
    pub(crate) clamped_fragments: [Option<Cow<'a, str>>; 2],
    pub(crate) parameter_bytes: usize,
    pub(crate) writes_depth: bool,
    pub(crate) face_culling: FaceCulling,
    /// Of each colour target; empty if the state decides.
    pub(crate) blend_equations: Cow<'a, [BlendEquation]>,
    pub(crate) stencil: Option<Stencil>,
    /// `None` for what has none of its own.
    pub(crate) pipeline_state: Option<Cow<'a, PipelineState>>,
    /// The only draw state of a process without commands.
    pub(crate) state: Option<DrawState>,
    transforms: TransformPrecision,
}

/// Where a process's vertices come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum VertexSource {
    Meshes(VertexFormat),
    /// One triangle at infinite distance.
    FullScreen,
    LightVolumes,
    /// The shader makes them, and they form these.
    Procedural(Primitive),
    /// There are none: a compute shader runs.
    Compute,
    /// A raw pass encodes itself.
    None,
}

impl<'a> PipelineKey<'a> {
    /// Borrows the shader, because every frame compares this key with the pipelines' own.
    pub(crate) fn new(draws: &'a Draws<'a>, quality: &Quality) -> Self {
        let (transforms, format) = (quality.transforms, quality.vertices);
        let parameter_bytes = draws.parameters().len();
        let state = fixed_state(draws);
        let with = |shader: &'a str, vertices, fragment: Option<&'a str>, writes_depth| {
            let (shader, fragment) = (Cow::Borrowed(shader), fragment.map(Cow::Borrowed));
            // The reference is state of the pass.
            let (deformation, stencil) = (None, draws.stencil().map(|stencil| Stencil { reference: 0, ..stencil }));
            let (face_culling, blend_equations) = (FaceCulling::ByMaterial, Cow::Borrowed(draws.blend_equations()));
            Self {
                shader,
                deformation,
                vertices,
                fragment,
                masked: None,
                clamped_fragments: [None, None],
                parameter_bytes,
                writes_depth,
                face_culling,
                blend_equations,
                stencil,
                pipeline_state: draws.pipeline_state().map(Cow::Borrowed),
                state,
                transforms,
            }
        };
        match draws {
            Draws::Commands(draws) => {
                let key = with(draws.shader, VertexSource::Meshes(format), draws.fragment, draws.writes_depth);
                let masked = draws.masked.map(|masked| [masked.vertex, masked.fragment].map(Cow::Borrowed));
                let clamped_fragments = [draws.clamped_fragment, draws.clamped_masked_fragment];
                let clamped_fragments = clamped_fragments.map(|entry_point| entry_point.map(Cow::Borrowed));
                let deformation = draws.deformation.map(Cow::Borrowed);
                Self { deformation, masked, clamped_fragments, face_culling: draws.face_culling, ..key }
            }
            Draws::FullScreen(draws) => with(draws.shader, VertexSource::FullScreen, Some("fragment"), false),
            Draws::Lights(draws) => with(draws.shader, VertexSource::LightVolumes, Some("fragment"), false),
            Draws::Procedural(draws) => {
                with(draws.shader, VertexSource::Procedural(draws.primitive), draws.fragment, draws.writes_depth)
            }
            Draws::Compute(dispatch) => with(dispatch.shader, VertexSource::Compute, None, false),
            Draws::Items(_) | Draws::Raw(_) => with("", VertexSource::None, None, false),
        }
    }

    /// The same with another key's WGSL.
    pub(crate) fn with_text_of(self, other: &'a PipelineKey<'_>) -> Self {
        let deformation = other.deformation.as_deref().map(Cow::Borrowed);
        Self { shader: Cow::Borrowed(&other.shader), deformation, ..self }
    }

    pub(crate) fn into_owned(self) -> PipelineKey<'static> {
        let owned = |text: Cow<'a, str>| Cow::Owned(text.into_owned());
        let [deformation, fragment] = [self.deformation, self.fragment].map(|text| text.map(owned));
        let masked = self.masked.map(|entry_points| entry_points.map(owned));
        let clamped_fragments = self.clamped_fragments.map(|text| text.map(owned));
        let blend_equations = Cow::Owned(self.blend_equations.into_owned());
        let shader = owned(self.shader);
        let pipeline_state = self.pipeline_state.map(|state| Cow::Owned(state.into_owned()));
        PipelineKey {
            shader,
            deformation,
            fragment,
            masked,
            clamped_fragments,
            blend_equations,
            pipeline_state,
            ..self
        }
    }

    /// What goes before the process's own WGSL, which reads these attributes, has its resources from a binding on, and
    /// may [clamp corners](prelude_with).
    pub(crate) fn prelude(
        &self,
        attributes: impl Iterator<Item = AttributeLayout>,
        first_resource: usize,
        clamps_corners: bool,
    ) -> String {
        let is_absolute = self.transforms == TransformPrecision::Absolute;
        let prelude = prelude_with(&attributes.collect::<Vec<_>>(), self.deformation.is_some(), clamps_corners);
        let constants = format!(
            "const ABSOLUTE_TRANSFORMS: bool = {is_absolute};\nconst FIRST_RESOURCE: u32 = {first_resource}u;\n"
        );
        constants + &prelude + "\n"
    }

    /// The process's own texts of WGSL, each with what it is.
    pub(crate) fn own_shaders(&self) -> [(&'static str, &str); 2] {
        [("deformation", self.deformation.as_deref().unwrap_or_default()), ("shader", &self.shader)]
    }
}

/// The draw state of a process that draws no commands; `None` for commands, which have one each, for compute shaders
/// and for raw passes.
pub(crate) fn fixed_state(draws: &Draws<'_>) -> Option<DrawState> {
    match draws {
        Draws::FullScreen(full_screen) => {
            Some(DrawState::new(Topology::TriangleList, Cull::Nothing, full_screen.blend))
        }
        Draws::Procedural(procedural) => {
            Some(DrawState::new(Topology::TriangleList, procedural.cull, procedural.blend))
        }
        Draws::Lights(lights) => {
            // Only far sides, which the camera also sees from inside a volume.
            let cull = match lights.class.kind.rules().volume {
                LightVolume::Screen => Cull::Nothing,
                LightVolume::Sphere | LightVolume::Cone => Cull::Front,
            };
            Some(DrawState::new(Topology::TriangleList, cull, Blend::Additive))
        }
        _ => None,
    }
}
