//! What a frame left out or could not draw as asked, counted and told.

use std::collections::HashSet;
use std::sync::atomic::{AtomicU32, Ordering};

use parking_lot::Mutex;

/// Counts what a frame leaves out or cannot draw as asked. Any number of jobs may count at once.
#[derive(Debug, Default)]
pub struct Rejections {
    by_reason: [Rejected; RejectionReason::ALL.len()],
    /// What was counted by [`Rejections::count_once`].
    counted: Mutex<HashSet<(RejectionReason, usize)>>,
}

impl Rejections {
    /// Counts one object, light or material for a reason that may be found more than once in a frame.
    pub fn count_once(&self, reason: RejectionReason, index: usize) {
        if self.counted.lock().insert((reason, index)) {
            self.count(reason, index);
        }
    }

    /// Counts one object, light or material.
    pub fn count(&self, reason: RejectionReason, index: usize) {
        self.by_reason[reason as usize].count(index);
    }

    /// What was counted, one entry a reason.
    pub fn list(&self) -> Vec<Rejection> {
        let counted = RejectionReason::ALL.into_iter().zip(&self.by_reason).map(|(reason, rejected)| Rejection {
            reason,
            count: rejected.count.load(Ordering::Relaxed) as usize,
            first: rejected.first.load(Ordering::Relaxed) as usize,
        });
        counted.filter(|rejection| rejection.count > 0).collect()
    }
}

/// Objects or lights that a frame left out or could not draw as asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rejection {
    /// Why.
    pub reason: RejectionReason,
    /// How many.
    pub count: usize,
    /// The lowest index among them.
    pub first: usize,
}

/// Why something was left out of a frame, or is not drawn as asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RejectionReason {
    /// An object's position, orientation or scale is not finite, or its orientation is no rotation.
    InvalidTransform,
    /// An object's bounds are not finite or negative, or too large once scaled.
    InvalidBounds,
    /// An object is farther from the world's origin than [`FixedPosition::REACH`](super::FixedPosition::REACH).
    OutOfReach,
    /// An object's mesh was removed.
    StaleMesh,
    /// An object's material was removed.
    StaleMaterial,
    /// An object's edges are too long for the paraboloid shadow map that sees it: longer than
    /// [`ShadowQuality::widest_edge`](crate::quality::ShadowQuality::widest_edge) allows, as often as they are halved. It is drawn all
    /// the same.
    CoarseEdges,
    /// A light gives no light: its intensity is 0.
    DarkLight,
    /// A light is farther from the world's origin than [`FixedPosition::REACH`](super::FixedPosition::REACH).
    LightOutOfReach,
    /// A light has an intensity, a place, a direction, a range or angles that cannot be.
    InvalidLight,
    /// A material's texture was removed; the plain colour stands in.
    StaleTexture,
    /// The device has no room for a texture; the plain colour stands in.
    TextureLimit,
}

impl RejectionReason {
    const ALL: [Self; 11] = [
        Self::InvalidTransform,
        Self::InvalidBounds,
        Self::OutOfReach,
        Self::StaleMesh,
        Self::StaleMaterial,
        Self::CoarseEdges,
        Self::DarkLight,
        Self::LightOutOfReach,
        Self::InvalidLight,
        Self::StaleTexture,
        Self::TextureLimit,
    ];

    /// As reports print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::InvalidTransform => "object with an invalid transform",
            Self::InvalidBounds => "object with invalid bounds",
            Self::OutOfReach => "object too far from the origin",
            Self::StaleMesh => "object with a removed mesh",
            Self::StaleMaterial => "object with a removed material",
            Self::CoarseEdges => "object too near to a hemispherical light for its long edges",
            Self::DarkLight => "light without intensity",
            Self::LightOutOfReach => "light too far from the origin",
            Self::InvalidLight => "invalid light",
            Self::StaleTexture => "material with a removed texture",
            Self::TextureLimit => "texture beyond the device's limits",
        }
    }
}

/// A count, and the lowest index counted: the same whichever worker came first.
#[derive(Debug)]
struct Rejected {
    count: AtomicU32,
    first: AtomicU32,
}

impl Default for Rejected {
    fn default() -> Self {
        Self { count: AtomicU32::new(0), first: AtomicU32::new(u32::MAX) }
    }
}

impl Rejected {
    fn count(&self, index: usize) {
        // Read only when the frame's jobs have ended, which orders everything.
        self.count.fetch_add(1, Ordering::Relaxed);
        self.first.fetch_min(u32::try_from(index).unwrap_or(u32::MAX), Ordering::Relaxed);
    }
}
