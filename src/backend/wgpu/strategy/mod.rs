//! How a pass is recorded and encoded.

mod pass_segment;
mod pass_strategy;
mod strategy_set;

pub(crate) use pass_segment::PassSegment;
pub(crate) use pass_strategy::PassStrategy;
pub(crate) use strategy_set::StrategySet;

pub use pass_strategy::{EncodingStrategy, RecordingStrategy};
