//! Fixed-function state that a process sets beside blending, culling and stencil.

use super::Comparison;

/// State of the pipelines that draw objects, or vertices that a shader makes. The default is that of the shipped
/// processes: nearer surfaces hide farther ones, and every channel is written.
///
/// The software backend has the default alone: a frame with another state returns an error that names the process.
///
/// ```
/// use drawloom::process::{ColorMask, CommandDraws, Comparison, DepthBias, PipelineState};
///
/// // Decals: a little nearer than the wall behind them; alpha stays.
/// let decals = PipelineState {
///     depth_bias: DepthBias { constant: 2, slope: 1.0, ..DepthBias::default() },
///     color_masks: vec![ColorMask::COLOR],
///     ..PipelineState::default()
/// };
/// // The outlines of what is behind a wall.
/// let hidden = PipelineState { depth_comparison: Some(Comparison::Less), ..PipelineState::default() };
/// let draws = CommandDraws { pipeline_state: hidden, writes_depth: false, ..CommandDraws::default() };
/// # assert_ne!(draws.pipeline_state, decals);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PipelineState {
    /// Where it is drawn, by how its depth compares with the depth target's: `depth < target` for [`Comparison::Less`].
    /// Depth is reversed, so a greater depth is nearer. `None` as the process [declares](super::Declare) its depth:
    /// where it is nearer, for most. Without a depth target it has no effect.
    pub depth_comparison: Option<Comparison>,
    /// Moves the depth of triangles.
    pub depth_bias: DepthBias,
    /// The channels of each colour target that are written, in the order declared; if empty, all. Another number of
    /// masks is an [error](super::PlanError::ColorMaskCount).
    pub color_masks: Vec<ColorMask>,
    /// Whether alpha decides how many samples of a pixel are covered. It has an effect on multisampled targets.
    pub alpha_to_coverage: bool,
}

/// How far depth is moved: nearer by positive numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthBias {
    /// In steps of the depth's last bit. For depth in floats, that is the last bit at the triangle's greatest depth.
    pub constant: i32,
    /// For each step of depth from pixel to pixel, finite.
    pub slope: f32,
    /// The most that the sum of both moves the depth, finite; 0 for any.
    pub clamp: f32,
}

/// Channels of a colour target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ColorMask {
    /// Whether red is written.
    pub red: bool,
    /// Whether green is written.
    pub green: bool,
    /// Whether blue is written.
    pub blue: bool,
    /// Whether alpha is written.
    pub alpha: bool,
}

impl ColorMask {
    /// All channels.
    pub const ALL: Self = Self { red: true, green: true, blue: true, alpha: true };
    /// Red, green and blue.
    pub const COLOR: Self = Self { alpha: false, ..Self::ALL };
    /// None: the target stays as it is.
    pub const NONE: Self = Self { red: false, green: false, blue: false, alpha: false };
}

impl DepthBias {
    pub(super) fn is_finite(&self) -> bool {
        self.slope.is_finite() && self.clamp.is_finite()
    }
}

impl PipelineState {
    /// Whether objects cover what is behind the shape of their meshes.
    pub(super) fn covers(&self) -> bool {
        let is_nearer = matches!(self.depth_comparison, None | Some(Comparison::Greater | Comparison::GreaterEqual));
        is_nearer && self.depth_bias == DepthBias::default() && !self.alpha_to_coverage
    }

    /// Whether objects may show where others are nearer.
    pub(super) fn shows_hidden(&self) -> bool {
        let needs_nearer = [Comparison::Greater, Comparison::GreaterEqual, Comparison::Equal, Comparison::Never];
        let may_be_farther = self.depth_comparison.is_some_and(|comparison| !needs_nearer.contains(&comparison));
        may_be_farther || self.depth_bias != DepthBias::default()
    }
}
