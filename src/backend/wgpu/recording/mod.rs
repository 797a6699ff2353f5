//! From batches to commands of the device.

mod batch_recorder;
mod command_digest;
mod item_recording;
mod pass_encoder;

pub(crate) use pass_encoder::{PassEncoder, encode_after_segments, encode_pass, encode_passes};
