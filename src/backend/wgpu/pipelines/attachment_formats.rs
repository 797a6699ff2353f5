//! The attachments of a process's passes, as its pipelines and bundles see them.

use crate::backend::wgpu::resources::{SampledTarget, sample_count, shape_dimension, texture_format};
use crate::process::{
    Access, BlendComponent, BlendEquation, BlendFactor, ColorMask, Comparison, DepthBias, Format, FramePlan,
    PlannedProcess, PlannedTarget, Stencil, StencilOperation,
};

/// The formats of the targets that a process draws into and samples, and how it uses buffers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AttachmentFormats {
    pub(super) colors: Vec<Option<wgpu::TextureFormat>>,
    /// Whether each of the colours can be blended.
    pub(super) can_be_blended: Vec<bool>,
    pub(super) depth: Option<DepthAttachmentFormat>,
    /// The number of samples of a pixel that is drawn.
    pub(super) samples: u32,
    pub(super) sampled: Vec<SampledTarget>,
    /// Whether the shader writes each of the process's buffers.
    pub(super) writes_buffers: Vec<bool>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DepthAttachmentFormat {
    pub(super) format: Format,
    /// Whether the pass may write depth; a draw state may still switch that off.
    pub(super) writes_depth: bool,
    /// Whether it may write the stencil.
    pub(super) writes_stencil: bool,
    /// How it is tested.
    pub(super) access: Access,
}

impl AttachmentFormats {
    pub(super) fn new(plan: &FramePlan, process: &PlannedProcess) -> Self {
        let PlannedProcess { declaration, targets, .. } = process;
        let planned = |index: usize| &plan.targets()[index];
        let colors = targets.colors.iter().map(|color| planned(color.index).format);
        let (colors, can_be_blended) =
            colors.map(|format| (Some(texture_format(format)), format.can_be_blended())).unzip();
        let depth = targets.depth.map(|(target, access)| DepthAttachmentFormat {
            format: planned(target).format,
            writes_depth: access.writes_depth(),
            writes_stencil: access.writes(),
            access,
        });
        let sampled = targets.accesses.iter().filter_map(|&(target, access)| {
            let dimension = match access {
                Access::Sample | Access::SamplePrevious => wgpu::TextureViewDimension::D2,
                Access::SampleView(_, index) | Access::SampleViewPrevious(_, index) => {
                    shape_dimension(declaration.sampled_views[index].shape)
                }
                Access::SampleLayers(_) => wgpu::TextureViewDimension::D2Array,
                _ => return None,
            };
            let &PlannedTarget { format, multisampled, .. } = planned(target);
            Some(SampledTarget { format, dimension, multisampled })
        });
        let writes_buffers = declaration.bound_buffers().map(|(_, writes)| writes);
        let (sampled, writes_buffers) = (sampled.collect(), writes_buffers.collect());
        let mut drawn = targets.colors.iter().map(|color| color.index).chain(targets.depth.map(|(target, _)| target));
        let samples = drawn.next().map_or(1, |target| sample_count(planned(target).multisampled));
        Self { colors, can_be_blended, depth, samples, sampled, writes_buffers }
    }
}

impl DepthAttachmentFormat {
    /// The same for bundles.
    pub(super) fn bundle_state(self) -> wgpu::RenderBundleDepthStencil {
        wgpu::RenderBundleDepthStencil {
            format: texture_format(self.format),
            depth_read_only: !(self.format.has_depth() && self.writes_depth),
            stencil_read_only: !(self.format.has_stencil() && self.writes_stencil),
        }
    }

    /// The same for a pipeline.
    pub(super) fn pipeline_state_of(
        self,
        writes_depth: bool,
        depth_compare: wgpu::CompareFunction,
        bias: DepthBias,
        stencil: Option<Stencil>,
    ) -> wgpu::DepthStencilState {
        wgpu::DepthStencilState {
            format: texture_format(self.format),
            depth_write_enabled: self.format.has_depth().then_some(self.writes_depth && writes_depth),
            depth_compare: self.format.has_depth().then_some(depth_compare),
            stencil: stencil.map_or_else(wgpu::StencilState::default, stencil_state),
            bias: wgpu::DepthBiasState { constant: bias.constant, slope_scale: bias.slope, clamp: bias.clamp },
        }
    }
}

pub(super) fn color_writes(mask: ColorMask) -> wgpu::ColorWrites {
    let ColorMask { red, green, blue, alpha } = mask;
    let channels = [
        (red, wgpu::ColorWrites::RED),
        (green, wgpu::ColorWrites::GREEN),
        (blue, wgpu::ColorWrites::BLUE),
        (alpha, wgpu::ColorWrites::ALPHA),
    ];
    channels.into_iter().filter(|(is_written, _)| *is_written).map(|(_, channel)| channel).collect()
}

/// `None` where nothing is mixed.
pub(super) fn blend_state(equation: BlendEquation) -> Option<wgpu::BlendState> {
    let [color, alpha] = [equation.color, equation.alpha].map(blend_component);
    (equation != BlendEquation::REPLACE).then_some(wgpu::BlendState { color, alpha })
}

fn blend_component(component: BlendComponent) -> wgpu::BlendComponent {
    use wgpu::BlendOperation;
    let one = BlendFactor::One;
    let (source, destination, operation) = match component {
        BlendComponent::Add { source, destination } => (source, destination, BlendOperation::Add),
        BlendComponent::Subtract { source, destination } => (source, destination, BlendOperation::Subtract),
        BlendComponent::ReverseSubtract { source, destination } => {
            (source, destination, BlendOperation::ReverseSubtract)
        }
        BlendComponent::Min => (one, one, BlendOperation::Min),
        BlendComponent::Max => (one, one, BlendOperation::Max),
    };
    let [src_factor, dst_factor] = [source, destination].map(blend_factor);
    wgpu::BlendComponent { src_factor, dst_factor, operation }
}

fn blend_factor(factor: BlendFactor) -> wgpu::BlendFactor {
    match factor {
        BlendFactor::Zero => wgpu::BlendFactor::Zero,
        BlendFactor::One => wgpu::BlendFactor::One,
        BlendFactor::Source => wgpu::BlendFactor::Src,
        BlendFactor::OneMinusSource => wgpu::BlendFactor::OneMinusSrc,
        BlendFactor::SourceAlpha => wgpu::BlendFactor::SrcAlpha,
        BlendFactor::OneMinusSourceAlpha => wgpu::BlendFactor::OneMinusSrcAlpha,
        BlendFactor::Destination => wgpu::BlendFactor::Dst,
        BlendFactor::OneMinusDestination => wgpu::BlendFactor::OneMinusDst,
        BlendFactor::DestinationAlpha => wgpu::BlendFactor::DstAlpha,
        BlendFactor::OneMinusDestinationAlpha => wgpu::BlendFactor::OneMinusDstAlpha,
    }
}

fn stencil_state(stencil: Stencil) -> wgpu::StencilState {
    let face = wgpu::StencilFaceState {
        compare: compare_function(stencil.comparison),
        fail_op: stencil_operation(stencil.on_fail),
        depth_fail_op: stencil_operation(stencil.on_depth_fail),
        pass_op: stencil_operation(stencil.on_pass),
    };
    let [read_mask, write_mask] = [stencil.read_mask, stencil.write_mask].map(u32::from);
    wgpu::StencilState { front: face, back: face, read_mask, write_mask }
}

pub(super) fn compare_function(comparison: Comparison) -> wgpu::CompareFunction {
    match comparison {
        Comparison::Never => wgpu::CompareFunction::Never,
        Comparison::Less => wgpu::CompareFunction::Less,
        Comparison::Equal => wgpu::CompareFunction::Equal,
        Comparison::LessEqual => wgpu::CompareFunction::LessEqual,
        Comparison::Greater => wgpu::CompareFunction::Greater,
        Comparison::NotEqual => wgpu::CompareFunction::NotEqual,
        Comparison::GreaterEqual => wgpu::CompareFunction::GreaterEqual,
        Comparison::Always => wgpu::CompareFunction::Always,
    }
}

fn stencil_operation(operation: StencilOperation) -> wgpu::StencilOperation {
    match operation {
        StencilOperation::Keep => wgpu::StencilOperation::Keep,
        StencilOperation::Zero => wgpu::StencilOperation::Zero,
        StencilOperation::Replace => wgpu::StencilOperation::Replace,
        StencilOperation::Invert => wgpu::StencilOperation::Invert,
        StencilOperation::IncrementClamp => wgpu::StencilOperation::IncrementClamp,
        StencilOperation::DecrementClamp => wgpu::StencilOperation::DecrementClamp,
        StencilOperation::IncrementWrap => wgpu::StencilOperation::IncrementWrap,
        StencilOperation::DecrementWrap => wgpu::StencilOperation::DecrementWrap,
    }
}
