//! A recorded pass.

use std::ops::Range;
use std::sync::Arc;

use crate::command::{Batch, DrawList};

/// A batch, and the range of the remaining indices that it draws if it does not draw its whole mesh.
pub(super) type BatchDraw = (Batch, Option<Range<u32>>);

/// A recorded pass: a copy of its draw list.
#[derive(Debug)]
pub struct SoftwareCommands {
    pub(super) draws: Vec<BatchDraw>,
    /// The objects of all batches.
    pub(super) objects: Vec<u32>,
    /// The remaining indices of the batches that do not draw their whole mesh.
    pub(super) indices: Arc<[u32]>,
}

impl SoftwareCommands {
    pub(super) fn new(list: &DrawList) -> Self {
        let draws = list.batches.iter().enumerate();
        Self {
            draws: draws.map(|(index, &batch)| (batch, list.remaining(index))).collect(),
            objects: list.objects.clone(),
            indices: list.remaining_indices().into(),
        }
    }
}
