//! The warnings of an import: all are counted, and those of each kind are listed up to a limit.

use std::collections::BTreeMap;

use crate::error::ObjWarning;

#[derive(Debug, Default)]
pub(crate) struct Warnings {
    pub listed: Vec<ObjWarning>,
    /// By the name of their kind.
    pub counts: BTreeMap<&'static str, usize>,
    /// The most of each kind that are listed.
    limit: usize,
}

impl Warnings {
    pub(crate) fn new(limit: usize) -> Self {
        Self { limit, ..Self::default() }
    }

    pub(crate) fn push(&mut self, warning: ObjWarning) {
        let count = self.counts.entry(warning.kind()).or_default();
        *count += 1;
        if *count <= self.limit {
            self.listed.push(warning);
        }
    }
}
