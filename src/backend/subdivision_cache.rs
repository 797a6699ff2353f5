//! The cache of subdivided meshes, for views whose projection bends straight edges.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use parking_lot::Mutex;

use super::error::BackendError;
use super::requests::FrameRequest;
use crate::command::{Batch, DrawList};
use crate::quality::VertexFormat;
use crate::scene::{Assets, Mesh};
use crate::view::IssueReason;

/// Keeps subdivided meshes, as a backend's geometry `T`. A view that comes back finds those that it drew before,
/// because to subdivide takes longer than the rest of a frame; so unused ones are dropped only where they take much
/// memory.
pub(super) struct SubdivisionCache<T> {
    meshes: Mutex<HashMap<Key, Arc<CachedSubdivision<T>>>>,
    /// The identity of the assets that the meshes belong to.
    assets: AtomicU64,
    frame: AtomicU64,
}

/// A subdivided mesh.
pub(crate) struct CachedSubdivision<T> {
    /// The backend's geometry; `None` if the mesh, once subdivided, exceeds the backend's limits, and nothing is drawn.
    pub(super) geometry: Option<T>,
    /// Whether its edges are too long, because shorter ones would take too many triangles.
    pub(super) is_coarse: bool,
    triangles: usize,
    used_in: AtomicU64,
}

#[cfg(all(test, feature = "wgpu"))]
impl<T> CachedSubdivision<T> {
    /// One of which nothing is drawn.
    pub(crate) fn without_geometry() -> Self {
        Self { geometry: None, is_coarse: false, triangles: 0, used_in: AtomicU64::new(0) }
    }
}

/// The subdivided meshes of a frame, by what [`subdivision_of`] a batch is drawn.
pub(crate) type SubdividedMeshes<T> = HashMap<Subdivision, Arc<CachedSubdivision<T>>>;

/// Mesh slot, level of detail, and subdivision level.
pub(crate) type Subdivision = (u32, u32, u32);

/// A subdivision, the mesh's revision, and vertex format.
type Key = (Subdivision, u64, VertexFormat);

/// The maximum number of triangles of a subdivided mesh.
const MAX_TRIANGLES: usize = 1 << 18;

impl<T> Default for SubdivisionCache<T> {
    fn default() -> Self {
        Self { meshes: Mutex::default(), assets: AtomicU64::new(0), frame: AtomicU64::new(0) }
    }
}

impl<T> SubdivisionCache<T> {
    /// Meshes that were not drawn for this many frames are unused.
    const MAX_UNUSED_FRAMES: u64 = 120;
    /// The maximum number of triangles of unused meshes: some 24 MB.
    const MAX_UNUSED_TRIANGLES: usize = 1 << 20;

    /// Begins a frame: drops meshes of other assets, those whose source is gone, and, where unused ones have too many
    /// triangles, the longest unused ones.
    pub(super) fn begin_frame(&self, assets: &Assets) {
        // Relaxed, here and below: frames begin one after the other, and the end of a frame's run orders its jobs'
        // stores.
        let frame = self.frame.fetch_add(1, Ordering::Relaxed) + 1;
        let identity = assets.meshes.identity();
        let same_assets = self.assets.swap(identity, Ordering::Relaxed) == identity;
        let mut meshes = self.meshes.lock();
        let has_source = |((slot, ..), revision, _): &Key| {
            assets.meshes.get_with_revision(*slot).is_some_and(|(current, _)| current == *revision)
        };
        meshes.retain(|key, _| same_assets && has_source(key));
        let last_used = |mesh: &CachedSubdivision<T>| mesh.used_in.load(Ordering::Relaxed);
        let is_unused = |mesh: &CachedSubdivision<T>| last_used(mesh) + Self::MAX_UNUSED_FRAMES < frame;
        let unused = || meshes.iter().filter(|(_, mesh)| is_unused(mesh));
        let mut unused_triangles: usize = unused().map(|(_, mesh)| mesh.triangles).sum();
        if unused_triangles > Self::MAX_UNUSED_TRIANGLES {
            let mut oldest_first: Vec<_> = unused().map(|(key, mesh)| (last_used(mesh), *key)).collect();
            oldest_first.sort_unstable_by_key(|(last_used, _)| *last_used);
            for (_, key) in oldest_first {
                if unused_triangles <= Self::MAX_UNUSED_TRIANGLES {
                    break;
                }
                unused_triangles -= meshes.remove(&key).map_or(0, |dropped| dropped.triangles);
            }
        }
    }

    /// Drops everything.
    #[cfg(feature = "wgpu")]
    pub(super) fn clear(&self) {
        self.meshes.lock().clear();
    }

    /// Calls `emit` with each subdivided mesh that a list draws. `create` makes the geometry of missing ones, or `None`
    /// if it exceeds the backend's limits. Counts objects without geometry, and those whose edges stay too long.
    ///
    /// # Errors
    /// If there is no such mesh, or `create` fails.
    pub(super) fn collect(
        &self,
        request: &FrameRequest<'_>,
        list: &DrawList,
        vertices: VertexFormat,
        mut create: impl FnMut(Mesh) -> Result<Option<T>, BackendError>,
        mut emit: impl FnMut(Subdivision, Arc<CachedSubdivision<T>>),
    ) -> Result<(), BackendError> {
        for batch in list.batches.iter().filter(|batch| batch.state.subdivision_level() > 0) {
            let &Batch { first, count, .. } = batch;
            let found = self.get_or_create(request.scene.assets, subdivision_of(batch), vertices, &mut create)?;
            let reason = match &found.geometry {
                None => Some(IssueReason::UndrawableMesh),
                Some(_) => found.is_coarse.then_some(IssueReason::CoarseEdges),
            };
            if let Some(reason) = reason {
                let objects = &list.objects[first as usize..][..count as usize];
                request.scene_issues.count_all_once(reason, objects.iter().map(|object| *object as usize));
            }
            emit(subdivision_of(batch), found);
        }
        Ok(())
    }

    fn get_or_create(
        &self,
        assets: &Assets,
        subdivision: Subdivision,
        vertices: VertexFormat,
        create: impl FnOnce(Mesh) -> Result<Option<T>, BackendError>,
    ) -> Result<Arc<CachedSubdivision<T>>, BackendError> {
        let (slot, level_of_detail, level) = subdivision;
        let (revision, mesh) = assets.meshes.get_with_revision(slot).ok_or_else(missing_mesh_error)?;
        let key = (subdivision, revision, vertices);
        let cached = self.meshes.lock().get(&key).cloned();
        let found = match cached {
            Some(cached) => cached,
            None => {
                // Two passes may do this at once. One result is discarded, which is cheaper than holding the lock
                // meanwhile.
                let (mesh, is_coarse) = match level_of_detail {
                    0 => subdivided(mesh, level),
                    coarser => subdivided(&mesh.at_level(coarser), level),
                };
                let (triangles, used_in) = (mesh.indices().len() / 3, AtomicU64::new(0));
                let created = Arc::new(CachedSubdivision { geometry: create(mesh)?, is_coarse, triangles, used_in });
                Arc::clone(self.meshes.lock().entry(key).or_insert(created))
            }
        };
        found.used_in.store(self.frame.load(Ordering::Relaxed), Ordering::Relaxed);
        Ok(found)
    }
}

/// The subdivision of its mesh that a batch draws.
pub(crate) fn subdivision_of(batch: &Batch) -> Subdivision {
    (batch.mesh, batch.state.level_of_detail(), batch.state.subdivision_level())
}

/// The mesh subdivided to a level, and whether its edges are still too long.
fn subdivided(mesh: &Mesh, level: u32) -> (Mesh, bool) {
    // A little longer, so that halves that were rounded up are not halved again.
    let max_edge = mesh.longest_edge() / (1_u64 << level) as f32 * 1.001;
    let subdivided = mesh.subdivided(max_edge, MAX_TRIANGLES);
    let is_coarse = subdivided.longest_edge() > max_edge;
    (subdivided, is_coarse)
}

/// The error for a batch without a mesh. This is a bug in Drawloom.
pub(crate) fn missing_mesh_error() -> BackendError {
    BackendError::BrokenRule { rule: "a batch draws an existing mesh".to_owned() }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    type Cache = SubdivisionCache<()>;

    /// Draws a level of the mesh in this slot. `made` counts the meshes that are made for it.
    fn draw(cache: &Cache, assets: &Assets, slot: u32, level: u32, made: &mut usize) {
        let create = |_| {
            *made += 1;
            Ok(Some(()))
        };
        cache.get_or_create(assets, (slot, 0, level), VertexFormat::Full, create).unwrap();
    }

    #[test]
    fn unused_meshes_are_kept_as_long_as_their_source_is_there() {
        let mut assets = Assets::default();
        let mesh = assets.add(Mesh::cuboid("box", Vec3::ONE).unwrap()).unwrap();
        let (cache, mut made) = (Cache::default(), 0);
        for frame in 0..=1_000 {
            cache.begin_frame(&assets);
            if frame % 500 == 0 {
                draw(&cache, &assets, mesh.index(), 3, &mut made);
            }
        }
        assert_eq!(made, 1);
        assets.remove(mesh).unwrap();
        cache.begin_frame(&assets);
        assert!(cache.meshes.lock().is_empty());
    }

    #[test]
    fn the_longest_unused_meshes_are_dropped_where_they_have_too_many_triangles() {
        let mut assets = Assets::default();
        let mut meshes = Vec::new();
        for _ in 0..8 {
            meshes.push(assets.add(Mesh::cuboid("box", Vec3::ONE).unwrap()).unwrap().index());
        }
        let (cache, mut made) = (Cache::default(), 0);
        for mesh in &meshes {
            cache.begin_frame(&assets);
            draw(&cache, &assets, *mesh, 7, &mut made);
        }
        let triangles = || cache.meshes.lock().values().map(|mesh| mesh.triangles).sum::<usize>();
        assert!(triangles() > Cache::MAX_UNUSED_TRIANGLES);
        for _ in 0..Cache::MAX_UNUSED_FRAMES + 10 {
            cache.begin_frame(&assets);
        }
        let left = triangles();
        let of_one = left / cache.meshes.lock().len();
        assert!(left <= Cache::MAX_UNUSED_TRIANGLES && left + of_one > Cache::MAX_UNUSED_TRIANGLES, "{left}, {of_one}");
        made = 0;
        draw(&cache, &assets, meshes[7], 7, &mut made);
        assert_eq!(made, 0, "the latest is kept");
        draw(&cache, &assets, meshes[0], 7, &mut made);
        assert_eq!(made, 1, "the oldest is not");
    }
}
