//! The depth pre-pass (L 4.1 advises it).

use super::depth_pre_pass_twin::DepthPrePassTwin;
use super::{CommandDraws, Declare, Draws, Format, RenderProcess, Twin};

/// Draws the depth of every opaque object into `depth` before the geometry buffer, which then stores each pixel once instead
/// of once for each surface that is nearer than those drawn before it. It pays where pixels cost more than vertices.
///
/// Where two surfaces lie at exactly one depth, the one drawn last is seen, rather than the one drawn first.
#[derive(Clone, Copy, Debug, Default)]
pub struct DepthPrePass;

impl RenderProcess for DepthPrePass {
    fn name(&self) -> &str {
        "depth pre-pass"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = include_str!("depth_pre_pass.wgsl");
        Draws::Commands(CommandDraws { shader, fragment: None, ..CommandDraws::default() })
    }

    fn twin(&self) -> Option<Twin> {
        Some(Twin::objects(DepthPrePassTwin))
    }
}
