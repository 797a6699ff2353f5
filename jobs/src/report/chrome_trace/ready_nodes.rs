//! The counter of ready nodes.

use std::io;
use std::time::Duration;

use super::events::{EventWriter, Track};

/// Counts nodes that are ready but not opened, in runs that may overlap.
#[derive(Default)]
pub(super) struct ReadyNodes {
    /// When the number changes, and by how much.
    changes: Vec<(Duration, i64)>,
    /// The time of the last change.
    last: Duration,
}

impl ReadyNodes {
    pub(super) fn add(&mut self, changes: impl Iterator<Item = (Duration, i64)>) {
        self.changes.extend(changes.inspect(|&(at, _)| self.last = self.last.max(at)));
    }

    /// Writes all changes, unless one of them is after `end`: then a run that begins at `end` may overlap them.
    pub(super) fn write_until<W: io::Write>(
        &mut self,
        end: Duration,
        events: &mut EventWriter<W>,
        track: Track,
    ) -> io::Result<()> {
        if self.last > end {
            return Ok(());
        }
        self.changes.sort_unstable_by_key(|&(at, _)| at);
        let mut ready = 0;
        for at_once in self.changes.chunk_by(|one, next| one.0 == next.0) {
            let change: i64 = at_once.iter().map(|(_, change)| change).sum();
            ready += change;
            if change != 0 {
                events.counter("ready nodes", track, at_once[0].0, ready)?;
            }
        }
        self.changes.clear();
        Ok(())
    }
}
