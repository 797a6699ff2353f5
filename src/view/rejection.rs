//! Counts what a frame leaves out or does not draw as requested.

use std::collections::HashSet;
use std::sync::atomic::{AtomicU32, Ordering};

use parking_lot::Mutex;

/// Counts what a frame leaves out or does not draw as requested. Any number of jobs may count at the same time.
#[derive(Debug, Default)]
pub struct Rejections {
    by_reason: [RejectionCount; RejectionReason::ALL.len()],
    /// What [`Rejections::count_once`] has counted.
    counted_once: Mutex<HashSet<(RejectionReason, usize)>>,
}

impl Rejections {
    /// Counts an object, light or material once, however often a frame rejects it for this reason.
    pub fn count_once(&self, reason: RejectionReason, index: usize) {
        if self.counted_once.lock().insert((reason, index)) {
            self.count(reason, index);
        }
    }

    /// Does the same for several of them.
    pub fn count_all_once(&self, reason: RejectionReason, indices: impl Iterator<Item = usize>) {
        let mut counted = self.counted_once.lock();
        indices.filter(|index| counted.insert((reason, *index))).for_each(|index| self.count(reason, index));
    }

    /// Counts an object, light or material.
    pub fn count(&self, reason: RejectionReason, index: usize) {
        self.by_reason[reason as usize].count(index);
    }

    /// The rejections, one for each reason that occurred.
    pub fn list(&self) -> Vec<Rejection> {
        let rejections = RejectionReason::ALL.into_iter().zip(&self.by_reason).map(|(reason, counts)| Rejection {
            reason,
            count: counts.count.load(Ordering::Relaxed) as usize,
            first: counts.first.load(Ordering::Relaxed) as usize,
        });
        rejections.filter(|rejection| rejection.count > 0).collect()
    }
}

/// Objects, lights or materials that a frame rejected for one reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rejection {
    /// The reason.
    pub reason: RejectionReason,
    /// The number of them.
    pub count: usize,
    /// The lowest of their indices.
    pub first: usize,
}

/// Why a frame leaves something out, or does not draw it as requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RejectionReason {
    /// An object's position, orientation or scale is not finite, or its orientation is not a unit quaternion.
    InvalidTransform,
    /// An object's bounds are not finite, have a negative radius, or are too large once scaled.
    InvalidBounds,
    /// An object is farther from the world's origin than
    /// [`FixedPosition::MAX_COORDINATE`](super::FixedPosition::MAX_COORDINATE).
    OutOfReach,
    /// An object's mesh was removed.
    StaleMesh,
    /// An object's material was removed.
    StaleMaterial,
    /// An object's edges are too long for the paraboloid shadow map that sees it: longer than
    /// [`ShadowQuality::widest_edge`](crate::quality::ShadowQuality::widest_edge) allows, even at the highest
    /// subdivision level. It is drawn nevertheless.
    CoarseEdges,
    /// A light's intensity is 0.
    DarkLight,
    /// A light is farther from the world's origin than
    /// [`FixedPosition::MAX_COORDINATE`](super::FixedPosition::MAX_COORDINATE).
    LightOutOfReach,
    /// A light's intensity, position, direction, range or angles are invalid.
    InvalidLight,
    /// A material's texture was removed; the material's plain colour is used.
    StaleTexture,
    /// A texture exceeds the device's limits; the material's plain colour is used.
    TextureLimit,
    /// An object's mesh is not on the device yet, because it is streamed, or its mesh or
    /// material is not [loaded](crate::scene::AssetLoader) yet. The object is not drawn.
    NotResident,
    /// A material's texture is not on the device yet, or not loaded yet; the material's plain colour is used.
    TextureNotResident,
    /// The [filter](crate::scene::Camera::filter) of a camera lists the index of an object that the scene does not have. The other
    /// objects are drawn as it says.
    UnknownObject,
    /// A blended object is added in half floats, because the device does not blend floats, although
    /// [`Quality::radiance_sum`](crate::quality::Quality::radiance_sum) asks for them. It is drawn nevertheless, with the error of
    /// [`RadianceSum::HalfFloat`](crate::quality::RadianceSum::HalfFloat). One object counts for all.
    HalfFloatBlending,
}

impl RejectionReason {
    const ALL: [Self; 15] = [
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
        Self::NotResident,
        Self::TextureNotResident,
        Self::UnknownObject,
        Self::HalfFloatBlending,
    ];

    /// The description that reports print.
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
            Self::NotResident => "object with a mesh or material that is yet to arrive",
            Self::TextureNotResident => "material with a texture that is yet to arrive",
            Self::UnknownObject => "object that a filter lists and the scene does not have",
            Self::HalfFloatBlending => "blended object in half floats, because the device does not blend floats",
        }
    }
}

/// A count and the lowest index counted: independent of the order in which workers count.
#[derive(Debug)]
struct RejectionCount {
    count: AtomicU32,
    first: AtomicU32,
}

impl Default for RejectionCount {
    fn default() -> Self {
        Self { count: AtomicU32::new(0), first: AtomicU32::new(u32::MAX) }
    }
}

impl RejectionCount {
    fn count(&self, index: usize) {
        // Relaxed: the counts are read after the frame's jobs have ended.
        self.count.fetch_add(1, Ordering::Relaxed);
        self.first.fetch_min(u32::try_from(index).unwrap_or(u32::MAX), Ordering::Relaxed);
    }
}
