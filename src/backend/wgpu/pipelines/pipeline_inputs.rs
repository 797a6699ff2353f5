//! What all pipelines of a process are made from.

use super::attachment_formats::AttachmentFormats;
use super::pipeline_key::{PipelineKey, VertexSource};
use crate::backend::wgpu::resources::binding_type;
use crate::process::{Access, Declaration, DeclaredAttribute, Draws, FramePlan, PlannedProcess};
use crate::quality::Quality;

/// What all pipelines of a process are made from: what it declares, and what it draws in frames of one quality.
/// Pipelines of equal inputs are equal on one device.
#[derive(Clone, PartialEq)]
pub(super) struct PipelineInputs {
    pub(super) name: String,
    pub(super) key: PipelineKey<'static>,
    pub(super) attachments: AttachmentFormats,
    /// The attributes of vertices that it reads.
    pub(super) attributes: Vec<DeclaredAttribute>,
    /// The number of columns and material types that it reads.
    pub(super) array_count: usize,
    /// What it says about its resources.
    pub(super) resources: Vec<wgpu::BindingType>,
    /// Whether it draws in views of a kind that may clamp depth.
    may_clamp: bool,
    features: wgpu::Features,
}

impl PipelineInputs {
    pub(super) fn new(
        features: wgpu::Features,
        plan: &FramePlan,
        planned: &PlannedProcess,
        draws: &Draws<'_>,
        quality: &Quality,
    ) -> Self {
        Self {
            name: planned.name.clone(),
            key: PipelineKey::new(draws, quality).into_owned(),
            attachments: AttachmentFormats::new(plan, planned),
            attributes: planned.declaration.attributes.clone(),
            array_count: array_count(&planned.declaration),
            resources: draws.resources().iter().map(|resource| binding_type(features, resource)).collect(),
            may_clamp: may_clamp(&planned.declaration),
            features,
        }
    }

    /// Whether there are pipelines of their own for views that [clamp depth](crate::view::RenderView::clamps_depth).
    pub(super) fn has_clamped_pipelines(&self) -> bool {
        let has_geometry = matches!(self.key.vertices, VertexSource::Meshes(_) | VertexSource::Procedural(_));
        // What is beyond the far plane is clamped too, to depth 0. A test for a greater depth leaves it out; without a
        // depth test it would be drawn. Processes that match depths or mark a stencil need the depths of a process that
        // clamps, so they clamp as well, and their declarations say what passes beyond the far plane.
        let tests_depth =
            self.attachments.depth.is_some_and(|depth| depth.format.has_depth() && depth.access != Access::TestStencil);
        let can_clamp = has_geometry && self.may_clamp && tests_depth;
        can_clamp && (self.clamps_pixels() || self.key.clamped_fragments[0].is_some())
    }

    /// Whether the device clamps the depth of pixels.
    pub(super) fn clamps_pixels(&self) -> bool {
        self.features.contains(wgpu::Features::DEPTH_CLIP_CONTROL)
    }

    /// Whether a process of this plan can use their pipelines for these draws, in frames of this quality.
    pub(super) fn fit(&self, plan: &FramePlan, planned: &PlannedProcess, draws: &Draws<'_>, quality: &Quality) -> bool {
        self.fit_draws(draws, quality) && self.fit_declaration(plan, planned)
    }

    /// Whether they still fit what a process of this plan declares.
    pub(super) fn fit_declaration(&self, plan: &FramePlan, planned: &PlannedProcess) -> bool {
        self.name == planned.name.as_str()
            && self.may_clamp == may_clamp(&planned.declaration)
            && self.array_count == array_count(&planned.declaration)
            && self.attributes == planned.declaration.attributes
            && self.attachments == AttachmentFormats::new(plan, planned)
    }

    /// Whether they still fit what their process draws.
    pub(super) fn fit_draws(&self, draws: &Draws<'_>, quality: &Quality) -> bool {
        self.key == PipelineKey::new(draws, quality) && self.fit_resources(draws)
    }

    /// Whether the inputs of a process of this plan for these draws would differ from these in the text of their shader
    /// only.
    pub(super) fn differ_in_text_only(
        &self,
        plan: &FramePlan,
        planned: &PlannedProcess,
        draws: &Draws<'_>,
        quality: &Quality,
    ) -> bool {
        PipelineKey::new(draws, quality).with_text_of(&self.key) == self.key
            && self.fit_resources(draws)
            && self.fit_declaration(plan, planned)
    }

    fn fit_resources(&self, draws: &Draws<'_>) -> bool {
        let resources = draws.resources().iter().map(|resource| binding_type(self.features, resource));
        resources.eq(self.resources.iter().copied())
    }
}

fn may_clamp(declaration: &Declaration) -> bool {
    declaration.views.rules().clamps_depth
}

fn array_count(declaration: &Declaration) -> usize {
    declaration.columns.len() + declaration.material_types.len()
}
