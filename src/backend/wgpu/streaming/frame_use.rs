//! What a frame draws: marks by which streaming finds what was used last.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// By slot, the number of the latest frame that drew it; 0 if none did.
#[derive(Clone, Default)]
pub(crate) struct UseMarks {
    marks: Arc<[AtomicU64]>,
}

impl UseMarks {
    /// Makes room for this number of slots. Frames in flight go on marking where they began.
    pub(super) fn reserve(&mut self, slots: usize) {
        if slots > self.marks.len() {
            let marks = (0..slots.next_power_of_two()).map(|slot| AtomicU64::new(self.latest_use(slot as u32)));
            self.marks = marks.collect();
        }
    }

    /// Marks a slot as drawn by a frame.
    #[inline]
    fn mark(&self, slot: u32, frame: u64) {
        if let Some(mark) = self.marks.get(slot as usize) {
            // Relaxed, here and below: jobs of one frame write the same number, and the next frame reads it after the
            // run. They look first, so that a line of the cache does not travel between them for nothing.
            if mark.load(Ordering::Relaxed) != frame {
                mark.store(frame, Ordering::Relaxed);
            }
        }
    }

    /// The number of the latest frame that drew it; 0 if none did.
    pub(crate) fn latest_use(&self, slot: u32) -> u64 {
        self.marks.get(slot as usize).map_or(0, |mark| mark.load(Ordering::Relaxed))
    }
}

/// Where a frame marks what it draws.
#[derive(Clone, Default)]
pub(crate) struct FrameUse {
    /// The number of the frame, from 1.
    pub(super) frame: u64,
    pub(super) meshes: UseMarks,
    pub(super) materials: UseMarks,
    /// By material slot, whether one of its textures is not on the device.
    pub(super) lacks_texture: Arc<[bool]>,
}

impl FrameUse {
    /// Marks a mesh that has arrived as if it had been drawn just before the frames that decide what is in sight. So
    /// what was drawn earlier makes room first.
    pub(super) fn mark_arrival(&self, slot: u32, frames_in_sight: u64) {
        let before = self.frame.saturating_sub(frames_in_sight + 1);
        if self.meshes.latest_use(slot) < before {
            self.meshes.mark(slot, before);
        }
    }

    /// Marks the mesh in a slot.
    pub(crate) fn mark_mesh(&self, slot: u32) {
        self.meshes.mark(slot, self.frame);
    }

    /// Marks the material in a slot. Returns whether one of its textures is not on the device.
    #[inline]
    pub(crate) fn mark_material(&self, slot: u32) -> bool {
        self.materials.mark(slot, self.frame);
        self.lacks_texture.get(slot as usize) == Some(&true)
    }
}
