//! From batches to commands of the device.

mod batch_recorder;
mod begin_pass;
mod bundles;
mod compute;
mod encode_pass;
mod record_pass;

pub(crate) use bundles::{cached_bundle, record_bundle};
pub(crate) use encode_pass::{encode_after_segments, encode_pass, encode_passes, encode_segment};
