//! From batches to commands of the device.

mod batch_recorder;
mod bundles;
mod encode_pass;
mod pass_encoder;

pub(crate) use encode_pass::{encode_after_segments, encode_pass, encode_passes};
pub(crate) use pass_encoder::PassEncoder;
