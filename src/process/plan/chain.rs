//! Processes whose order is known.

use std::sync::Arc;

use crate::process::RenderProcess;

/// A slot of a chain: a list of processes whose order is known.
#[derive(Clone)]
pub(crate) struct ChainSlot {
    /// The name of the process that comes with the crate for this slot, also if another replaces it.
    pub name: String,
    /// The process in the slot; `None` if the frame has none there.
    pub process: Option<Arc<dyn RenderProcess>>,
    /// Whether the process stays although no output depends on it.
    pub keep: bool,
}
