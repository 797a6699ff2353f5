//! What a node, a view or a pass is called.

use std::sync::Arc;

/// What a node belongs to, so that nodes can be grouped by render process, stage and view.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Labels {
    /// The render process: `geometry buffer`.
    pub process: Option<Arc<str>>,
    /// The stage of the frame: `visibility`, `record`.
    pub stage: Option<Arc<str>>,
    /// The view that it is for.
    pub view: Option<Arc<str>>,
}
