//! What drawing a pass needs.

use super::attachments::Attachments;
use super::executor::Executor;
use super::precision::Precision;
use super::view_state::ViewState;
use crate::process::{Materials, PassInputs, SampledTexture};
use crate::scene::ColumnLayout;

/// What drawing a pass needs, whatever it draws.
pub(super) struct PassContext<'a, R: Precision> {
    pub(super) executor: &'a Executor,
    pub(super) view: &'a ViewState<R>,
    pub(super) materials: &'a dyn Materials<R>,
    pub(super) attachments: &'a Attachments<R>,
    pub(super) columns: &'a [(ColumnLayout, Box<[u8]>)],
}

impl<R: Precision> PassContext<'_, R> {
    /// What the pass's CPU shader reads.
    pub(super) fn inputs<'a>(&'a self, sampled: &'a [&'a dyn SampledTexture<R>]) -> PassInputs<'a, R> {
        let ViewState { shader_view, lights, light_ends, lights_by_layer, .. } = self.view;
        PassInputs {
            view: shader_view,
            lights,
            light_ends,
            lights_by_layer,
            materials: self.materials,
            sampled,
            columns: self.columns,
        }
    }
}
