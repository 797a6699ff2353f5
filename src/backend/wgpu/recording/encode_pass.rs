//! Encoding of passes: from batches and recorded parts to command encoders.

use super::pass_encoder::PassEncoder;
use crate::backend::wgpu::frame::{RecordedPart, WgpuFrame, WgpuPart, WgpuPassState};
use crate::backend::wgpu::strategy::{PassSegment, RecordingStrategy};
use crate::backend::{BackendError, PassRequest};
use crate::process::Draws;

/// Encodes a whole pass in one encoder: replays its bundles, or records it without bundles. Then it generates the mip
/// levels that the pass leaves out of date.
///
/// # Errors
/// If a resource of the pass is missing, or a raw pass fails.
pub(crate) fn encode_pass(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: &PassRequest<'_>,
    parts: &[WgpuPart],
) -> Result<wgpu::CommandEncoder, BackendError> {
    let pass = PassEncoder::new(device, frame, pass);
    pass.encode(|encoder| pass.record(encoder, parts))
}

/// Encodes whole passes in one encoder, one after the other, each as [`encode_pass`] does. It is labelled as the first.
///
/// # Errors
/// As [`encode_pass`].
pub(crate) fn encode_passes(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    passes: &[PassRequest<'_>],
    parts: &[Vec<WgpuPart>],
) -> Result<wgpu::CommandEncoder, BackendError> {
    let encoder_of = |pass| PassEncoder::new(device, frame, pass);
    encoder_of(&passes[0]).encode(|encoder| {
        passes.iter().zip(parts).try_for_each(|(pass, parts)| encoder_of(pass).record(encoder, parts))
    })
}

/// Encodes what follows the segments of a pass that is split over several encoders: the mip levels that it leaves out
/// of date.
///
/// # Errors
/// As [`encode_pass`].
pub(crate) fn encode_after_segments(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: &PassRequest<'_>,
) -> Result<RecordedPart, BackendError> {
    let pass = PassEncoder::new(device, frame, pass);
    let encoder = pass.encode(|encoder| frame.generate_mip_levels(encoder, pass.index))?;
    Ok(RecordedPart::Encoder(encoder.finish()))
}

impl PassEncoder<'_> {
    /// Records the whole pass, and generates the mip levels that it leaves out of date.
    fn record(&self, encoder: &mut wgpu::CommandEncoder, parts: &[WgpuPart]) -> Result<(), BackendError> {
        use RecordingStrategy::{Bundles, CachedBundles, Direct};
        let WgpuPassState { strategy, timed_pass_index, .. } = *self.state;
        let accesses = &self.planned.declaration.accesses;
        let clears = accesses.iter().any(|(_, access)| access.writes() && !access.reads());
        match (self.draws, strategy.recording) {
            (Draws::Raw(raw), _) => self.encode_raw(encoder, *raw)?,
            // A pass that would only load and store its targets.
            (Draws::Commands(_), _) if self.list.batches.is_empty() && timed_pass_index.is_none() && !clears => {}
            (Draws::Compute(dispatch), _) => self.encode_compute(encoder, dispatch)?,
            (Draws::Commands(_), Direct) => {
                self.record_batches(encoder, PassSegment::WHOLE, 0..self.list.bundle_count())?;
            }
            (Draws::Commands(_), Bundles | CachedBundles) => {
                let bundles = parts.iter().filter_map(|part| match &part.0 {
                    RecordedPart::Bundle(bundle) => Some(bundle),
                    RecordedPart::Encoder(_) => None,
                });
                self.replay_bundles(encoder, PassSegment::WHOLE, bundles)?;
            }
            _ => self.record_without_commands(encoder)?,
        }
        self.frame.generate_mip_levels(encoder, self.index)
    }

    /// Encodes one segment of a pass that is split over several encoders.
    ///
    /// # Errors
    /// If a resource of the pass is missing. This is a bug in Drawloom.
    pub(crate) fn encode_segment(&self, segment: usize) -> Result<RecordedPart, BackendError> {
        use RecordingStrategy::{Bundles, CachedBundles, Direct};
        let strategy = self.state.strategy;
        let bundles = strategy.bundles_of_encoder(self.list, segment);
        let segment = strategy.segment_of_encoder(self.list, segment);
        let encoder = match strategy.recording {
            Direct => self.encode(|encoder| self.record_batches(encoder, segment, bundles)),
            Bundles | CachedBundles => {
                let recorded = bundles.map(|bundle| self.record_bundle(bundle));
                let recorded = recorded.collect::<Result<Vec<_>, _>>()?;
                self.encode(|encoder| self.replay_bundles(encoder, segment, &recorded))
            }
        };
        Ok(RecordedPart::Encoder(encoder?.finish()))
    }

    /// Calls `record` with a new encoder, labelled as the pass.
    fn encode(
        &self,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<(), BackendError>,
    ) -> Result<wgpu::CommandEncoder, BackendError> {
        let label = Some(self.state.label.as_str());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        record(&mut encoder)?;
        Ok(encoder)
    }
}
