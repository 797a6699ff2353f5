//! Encoding of passes: from batches and recorded parts to command encoders.

use super::bundles::record_bundle;
use super::compute::encode_compute;
use super::record_pass::{encode_raw, record_batches, record_without_commands, replay_bundles};
use crate::backend::wgpu::frame::{RecordedPart, WgpuFrame, WgpuPart, WgpuPassState};
use crate::backend::wgpu::strategy::{PassSegment, RecordingStrategy};
use crate::backend::{BackendError, FrameRequest, PassRequest};
use crate::command::DrawList;
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
    encode(device, frame, pass.index, |encoder| record_pass(device, encoder, frame, pass, parts))
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
    encode(device, frame, passes[0].index, |encoder| {
        passes.iter().zip(parts).try_for_each(|(pass, parts)| record_pass(device, encoder, frame, pass, parts))
    })
}

fn record_pass(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    &PassRequest { frame: request, index, list, .. }: &PassRequest<'_>,
    parts: &[WgpuPart],
) -> Result<(), BackendError> {
    use RecordingStrategy::{Bundles, CachedBundles, Direct};
    let WgpuPassState { pass, strategy, timed_pass_index, .. } = *frame.pass(index);
    let accesses = &request.plan.processes()[pass.process_index].declaration.accesses;
    let clears = accesses.iter().any(|(_, access)| access.writes() && !access.reads());
    match (&request.draws[pass.process_index], strategy.recording) {
        (Draws::Raw(raw), _) => encode_raw(device, encoder, frame, request, index, *raw)?,
        // A pass that would only load and store its targets.
        (Draws::Commands(_), _) if list.batches.is_empty() && timed_pass_index.is_none() && !clears => {}
        (Draws::Compute(dispatch), _) => encode_compute(encoder, frame, index, dispatch)?,
        (Draws::Commands(_), Direct) => {
            record_batches(encoder, frame, request, index, PassSegment::WHOLE, list, 0..list.bundle_count())?;
        }
        (Draws::Commands(_), Bundles | CachedBundles) => {
            let bundles = parts.iter().filter_map(|part| match &part.0 {
                RecordedPart::Bundle(bundle) => Some(bundle),
                RecordedPart::Encoder(_) => None,
            });
            replay_bundles(encoder, frame, request, index, PassSegment::WHOLE, bundles);
        }
        _ => record_without_commands(encoder, frame, request, index)?,
    }
    frame.generate_mip_levels(encoder, request, index);
    Ok(())
}

/// Encodes what follows the segments of a pass that is split over several encoders: the mip levels that it leaves out
/// of date.
///
/// # Errors
/// As [`encode_pass`].
pub(crate) fn encode_after_segments(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
) -> Result<RecordedPart, BackendError> {
    let encoder = encode(device, frame, index, |encoder| {
        frame.generate_mip_levels(encoder, request, index);
        Ok(())
    })?;
    Ok(RecordedPart::Encoder(encoder.finish()))
}

/// Encodes one segment of a pass that is split over several encoders.
///
/// # Errors
/// If a resource of a batch is missing.
pub(crate) fn encode_segment(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    list: &DrawList,
    segment: usize,
) -> Result<RecordedPart, BackendError> {
    use RecordingStrategy::{Bundles, CachedBundles, Direct};
    let strategy = frame.pass(index).strategy;
    let bundles = strategy.bundles_of_encoder(list, segment);
    let segment = strategy.segment_of_encoder(list, segment);
    let encoder = match strategy.recording {
        Direct => encode(device, frame, index, |encoder| {
            record_batches(encoder, frame, request, index, segment, list, bundles)
        }),
        Bundles | CachedBundles => {
            let recorded = bundles.map(|bundle| record_bundle(device, frame, index, list, bundle));
            let recorded = recorded.collect::<Result<Vec<_>, _>>()?;
            encode(device, frame, index, |encoder| {
                replay_bundles(encoder, frame, request, index, segment, &recorded);
                Ok(())
            })
        }
    };
    Ok(RecordedPart::Encoder(encoder?.finish()))
}

/// Calls `record` with a new encoder, labelled as the pass.
fn encode(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    index: usize,
    record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<(), BackendError>,
) -> Result<wgpu::CommandEncoder, BackendError> {
    let label = Some(frame.pass(index).label.as_str());
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
    record(&mut encoder)?;
    Ok(encoder)
}
