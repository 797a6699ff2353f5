//! Counts what a frame leaves out or does not draw as requested.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use parking_lot::Mutex;

use crate::handle::Slots;
use crate::scene::{Mesh, SceneRef};

/// Counts what a frame leaves out or does not draw as requested. Any number of jobs may count at the same time.
#[derive(Debug, Default)]
pub struct SceneIssues {
    by_reason: [RejectionCount; IssueReason::ALL.len()],
    /// What [`SceneIssues::count_once`] has counted.
    counted_once: Mutex<HashSet<(IssueReason, usize)>>,
}

impl SceneIssues {
    /// Counts an object, light or material once, however often a frame rejects it for this reason.
    pub fn count_once(&self, reason: IssueReason, index: usize) {
        if self.counted_once.lock().insert((reason, index)) {
            self.count(reason, index);
        }
    }

    /// Does the same for several of them.
    pub fn count_all_once(&self, reason: IssueReason, indices: impl Iterator<Item = usize>) {
        let mut counted = self.counted_once.lock();
        indices.filter(|index| counted.insert((reason, *index))).for_each(|index| self.count(reason, index));
    }

    /// Counts an object, light, material or texture.
    pub fn count(&self, reason: IssueReason, index: usize) {
        self.by_reason[reason as usize].count(index..index + 1);
    }

    /// Counts all of a range.
    pub(crate) fn count_range(&self, reason: IssueReason, indices: Range<usize>) {
        if !indices.is_empty() {
            self.by_reason[reason as usize].count(indices);
        }
    }

    /// The scene issues, one for each reason that occurred, without names.
    pub fn list(&self) -> Vec<SceneIssue> {
        self.list_with(|_, _| None)
    }

    /// The scene issues of a frame of this scene, with names. `process_of` names the process that draws an item.
    pub(crate) fn list_of<'a>(
        &self,
        scene: &SceneRef<'a>,
        process_of: impl Fn(usize) -> Option<&'a str>,
    ) -> Vec<SceneIssue> {
        self.list_with(|reason, first| match reason {
            IssueReason::InvalidItemBounds => process_of(first).map(Arc::from),
            _ => reason.name_of(first, scene).map(Arc::from),
        })
    }

    fn list_with(&self, name_of: impl Fn(IssueReason, usize) -> Option<Arc<str>>) -> Vec<SceneIssue> {
        let scene_issues = IssueReason::ALL.into_iter().zip(&self.by_reason).filter_map(|(reason, counts)| {
            let count = counts.count.load(Ordering::Relaxed) as usize;
            let first = counts.first.load(Ordering::Relaxed) as usize;
            (count > 0).then(|| SceneIssue { reason, count, first, name: name_of(reason, first) })
        });
        scene_issues.collect()
    }
}

/// Objects, lights, materials or textures that a frame rejected for one reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneIssue {
    /// The reason.
    pub reason: IssueReason,
    /// The number of them.
    pub count: usize,
    /// The lowest of their indices: among the scene's objects or lights; among all items that are lent, one set after
    /// the other; or the slot of a [handle](crate::handle::Handle::index) to a material or texture.
    pub first: usize,
    /// The name of the material or texture at that index; of an object that of its mesh, or of its material where that
    /// is the reason; of an item that of its process. `None` for a light, and for what was removed.
    pub name: Option<Arc<str>>,
}

/// Why a frame leaves something out, or does not draw it as requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum IssueReason {
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
    /// A light that casts shadows has no shadow map, or not for every main camera, because the frame has as many as the
    /// device's textures have layers. There it is drawn without a shadow: see [`ShadowMaps`](super::ShadowMaps).
    ShadowMapLimit,
    /// A light's intensity, position, direction, range or angles are invalid.
    InvalidLight,
    /// A material's texture was removed; the material's plain colour is used.
    StaleTexture,
    /// A texture is larger than the device allows, or has a format that it lacks; the material's plain colour is used.
    /// The software backend lacks the compressed formats.
    TextureLimit,
    /// An object's mesh is not on the device yet, because it is streamed, or its mesh or
    /// material is not [loaded](crate::scene::AssetLoader) yet. The object is not drawn.
    NotResident,
    /// A material's texture is not on the device yet, or not loaded yet; the material's plain colour is used.
    TextureNotResident,
    /// An object is beyond the number that the backend [can hold](crate::backend::SceneLimits::max_objects), or that a
    /// frame can name.
    ObjectLimit,
    /// An object's mesh [cannot be drawn](crate::backend::Backend::check_mesh) by the backend: as a rule, it is larger
    /// than the device's buffers. Or CPU nodes have filled a [generated](crate::scene::Mesh::generated) mesh with
    /// invalid data. The software backend finds that when it draws a frame, so only frames that begin later count the
    /// objects. A warning names each such mesh, with the reason.
    UndrawableMesh,
    /// An object's material, or its values of the engine's own, are beyond what the backend
    /// [can hold](crate::backend::SceneLimits::binding_bytes).
    MaterialLimit,
    /// A light reaches a view, and is beyond what the backend [can hold](crate::backend::SceneLimits::max_lights) for
    /// that view. Other views may have it.
    LightLimit,
    /// The [filter](crate::scene::Camera::filter) of a camera lists the index of an object that the scene does not
    /// have. The other objects are drawn as it says.
    UnknownObject,
    /// A blended object is added in half floats, because the device does not blend floats, although
    /// [`Quality::radiance_sum`](crate::quality::Quality::radiance_sum) asks for them. It is drawn nevertheless, with
    /// the error of [`RadianceSum::HalfFloat`](crate::quality::RadianceSum::HalfFloat). One object counts for all.
    HalfFloatBlending,
    /// The bounds of an [item](crate::process::Items) are not finite, or have a negative radius. It is not drawn.
    InvalidItemBounds,
}

impl IssueReason {
    const ALL: [Self; 21] = [
        Self::InvalidTransform,
        Self::InvalidBounds,
        Self::OutOfReach,
        Self::StaleMesh,
        Self::StaleMaterial,
        Self::CoarseEdges,
        Self::DarkLight,
        Self::LightOutOfReach,
        Self::ShadowMapLimit,
        Self::InvalidLight,
        Self::StaleTexture,
        Self::TextureLimit,
        Self::NotResident,
        Self::TextureNotResident,
        Self::ObjectLimit,
        Self::UndrawableMesh,
        Self::MaterialLimit,
        Self::LightLimit,
        Self::UnknownObject,
        Self::HalfFloatBlending,
        Self::InvalidItemBounds,
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
            Self::ShadowMapLimit => "light without a shadow, as there are too many shadow maps",
            Self::InvalidLight => "invalid light",
            Self::StaleTexture => "material with a removed texture",
            Self::TextureLimit => "texture of a size or format that the device lacks",
            Self::NotResident => "object with a mesh or material that is yet to arrive",
            Self::TextureNotResident => "material with a texture that is yet to arrive",
            Self::ObjectLimit => "object beyond the capacity of the device's buffers",
            Self::UndrawableMesh => "object with a mesh that the backend cannot draw",
            Self::MaterialLimit => "object with a material beyond the capacity of the device's buffers",
            Self::LightLimit => "light beyond the capacity of the device's buffers",
            Self::UnknownObject => "object that a filter lists and the scene does not have",
            Self::HalfFloatBlending => "blended object in half floats, because the device does not blend floats",
            Self::InvalidItemBounds => "item with invalid bounds",
        }
    }

    /// The name of what has this index in the scene: see [`SceneIssue::name`].
    fn name_of<'a>(self, index: usize, scene: &SceneRef<'a>) -> Option<&'a str> {
        fn at<T>(slots: &Slots<T>, index: usize) -> Option<&T> {
            slots.get_with_revision(u32::try_from(index).ok()?).map(|(_, found)| found)
        }
        let assets = scene.assets;
        match self {
            Self::InvalidTransform
            | Self::InvalidBounds
            | Self::OutOfReach
            | Self::StaleMesh
            | Self::CoarseEdges
            | Self::NotResident
            | Self::ObjectLimit
            | Self::UndrawableMesh
            | Self::HalfFloatBlending => assets.get(*scene.meshes.get(index)?).ok().map(Mesh::name),
            Self::StaleMaterial | Self::MaterialLimit => {
                assets.get(*scene.materials.get(index)?).ok().map(|material| material.name.as_str())
            }
            Self::StaleTexture | Self::TextureNotResident => {
                at(&assets.materials, index).map(|material| material.name.as_str())
            }
            Self::TextureLimit => at(&assets.textures, index).map(|texture| texture.name()),
            Self::DarkLight
            | Self::LightOutOfReach
            | Self::InvalidLight
            | Self::LightLimit
            | Self::ShadowMapLimit
            | Self::UnknownObject
            | Self::InvalidItemBounds => None,
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
    fn count(&self, indices: Range<usize>) {
        let saturated = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        // Relaxed: the counts are read after the frame's jobs have ended.
        self.count.fetch_add(saturated(indices.len()), Ordering::Relaxed);
        self.first.fetch_min(saturated(indices.start), Ordering::Relaxed);
    }
}
