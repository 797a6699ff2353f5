//! Room for a mesh in the pages: free room, or by taking other meshes off the device.

use super::mesh_pages::{INDEX, MeshBytes, MeshLocation, MeshPages, PageSizes, index_count};
use super::page_set::PageRange;
use super::residents::AssetMemory;
use crate::scene::Mesh;

/// Room that was found.
pub(super) struct MeshRoom {
    pub(super) location: MeshLocation,
    /// Those of the candidates that make room, by slot.
    pub(super) evicted: Vec<u32>,
    /// Whether pages were released for it.
    pub(super) releases_pages: bool,
}

impl MeshPages {
    /// Finds room for a mesh in the pages, or adds pages as long as all of them take no more than `budget` bytes. Where
    /// there is none, the candidates make room, the first ones first: only those that lie where the mesh will, or in
    /// pages that are released for it. Nothing changes if that is not enough.
    ///
    /// Those that make room are vacated; the caller retires them.
    pub(super) fn find_room(
        &mut self,
        mesh: &Mesh,
        (sizes, budget): (PageSizes, u64),
        candidates: impl Iterator<Item = (u32, MeshLocation)>,
    ) -> Option<MeshRoom> {
        let mut search = Search::new(mesh, budget);
        let mut vacated = Vec::new();
        let mut has_room = search.advance(self);
        for (slot, location) in candidates {
            if has_room {
                break;
            }
            self.vacate(location);
            vacated.push((slot, location));
            has_room = search.advance(self);
        }
        if !has_room {
            search.abandon(self);
            vacated.iter().for_each(|(_, location)| self.occupy(*location));
            return None;
        }
        let (location, released) = search.finish(self, sizes);
        let makes_room = |other: &MeshLocation| {
            other.overlaps(location)
                || released.vertices.contains(&other.vertices.page)
                || released.indices.contains(&other.indices.page)
        };
        let (needed, spared): (Vec<_>, Vec<_>) = vacated.into_iter().partition(|(_, other)| makes_room(other));
        spared.iter().for_each(|(_, location)| self.occupy(*location));
        let evicted = needed.iter().map(|(slot, _)| *slot).collect();
        let releases_pages = !released.vertices.is_empty() || !released.indices.is_empty();
        Some(MeshRoom { location, evicted, releases_pages })
    }

    /// The size of all pages in which something is, in bytes.
    fn occupied_bytes(&self) -> u64 {
        self.vertices.occupied_length() * self.bytes_per_vertex() + self.indices.occupied_length() * INDEX
    }
}

/// A search for room. It takes what it finds at once, so that what is vacated later is not used in vain.
struct Search {
    vertex_count: u32,
    /// Of all levels.
    index_count: u32,
    /// The indices of level 0.
    first_level: u32,
    vertices: Option<PageRange>,
    indices: Option<PageRange>,
    budget: u64,
}

/// The pages that were released.
#[derive(Default)]
struct Released {
    vertices: Vec<u32>,
    indices: Vec<u32>,
}

impl Search {
    fn new(mesh: &Mesh, budget: u64) -> Self {
        let (vertex_count, index_count) = (mesh.vertices().len() as u32, index_count(mesh) as u32);
        let first_level = mesh.indices().len() as u32;
        Self { vertex_count, index_count, first_level, vertices: None, indices: None, budget }
    }

    /// Looks again. Returns whether there is room for everything, be it in pages that are yet to be added.
    fn advance(&mut self, pages: &mut MeshPages) -> bool {
        self.vertices = self.vertices.or_else(|| pages.vertices.allocate_in_pages(self.vertex_count));
        self.indices = self.indices.or_else(|| pages.indices.allocate_in_pages(self.index_count));
        let missing = self.missing(pages).total();
        missing == 0 || pages.occupied_bytes() + missing <= self.budget
    }

    /// What has no room in pages that exist.
    fn missing(&self, pages: &MeshPages) -> MeshBytes {
        let vertices = u64::from(self.vertex_count) * pages.bytes_per_vertex();
        let indices = u64::from(self.index_count) * INDEX;
        MeshBytes {
            vertices: if self.vertices.is_none() { vertices } else { 0 },
            indices: if self.indices.is_none() { indices } else { 0 },
        }
    }

    /// Gives up what it has taken.
    fn abandon(self, pages: &mut MeshPages) {
        self.vertices.into_iter().for_each(|range| pages.vertices.vacate(range));
        self.indices.into_iter().for_each(|range| pages.indices.vacate(range));
    }

    /// Adds the pages that are missing, and releases empty ones as far as the budget demands it.
    fn finish(self, pages: &mut MeshPages, sizes: PageSizes) -> (MeshLocation, Released) {
        let (missing, stride) = (self.missing(pages), pages.bytes_per_vertex());
        let mut released = Released::default();
        while missing.total() > 0 && pages.bytes() + missing.total() > self.budget {
            let (vertices, indices) = (pages.vertices.longest_empty_page(), pages.indices.longest_empty_page());
            let bytes = |page: Option<(u32, u32)>, stride| page.map_or(0, |(_, length)| u64::from(length) * stride);
            let is_of_vertices = bytes(vertices, stride) >= bytes(indices, INDEX);
            let Some((page, _)) = (if is_of_vertices { vertices } else { indices }) else { break };
            if is_of_vertices {
                pages.vertices.release_if_empty(page, || false);
                released.vertices.push(page);
            } else {
                pages.indices.release_if_empty(page, || false);
                released.indices.push(page);
            }
        }
        // Pages of vertices and pages of indices share what is left of the budget as this mesh does, so that neither
        // takes what the other one will need.
        let rest = self.budget.saturating_sub(pages.bytes());
        let whole =
            MeshBytes { vertices: u64::from(self.vertex_count) * stride, indices: u64::from(self.index_count) * INDEX };
        let page_bytes = |part: u64, max: u64, other_missing: u64| {
            let share = (u128::from(rest) * u128::from(part) / u128::from(whole.total().max(1))) as u64;
            share.max(sizes.min).min(max).min(rest.saturating_sub(other_missing)).max(part)
        };
        let vertex_page = page_bytes(whole.vertices, sizes.max.vertices, missing.indices) / stride;
        let index_page = page_bytes(whole.indices, sizes.max.indices, missing.vertices) / INDEX;
        let vertices =
            self.vertices.unwrap_or_else(|| pages.vertices.allocate_in_new_page(self.vertex_count, vertex_page as u32));
        let rest = self.budget.saturating_sub(pages.bytes()) / INDEX;
        let indices = self
            .indices
            .unwrap_or_else(|| pages.indices.allocate_in_new_page(self.index_count, index_page.min(rest) as u32));
        (MeshLocation { vertices, indices, index_count: self.first_level }, released)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::resources::snapshot_lifetimes::SnapshotLifetimes;
    use crate::scene::{Topology, Vertex};

    const SIZES: PageSizes = PageSizes { min: 1 << 12, max: MeshBytes { vertices: 1 << 13, indices: 1 << 13 } };
    const BUDGET: u64 = 1 << 17;

    fn mesh(vertices: usize, triangles: usize) -> Mesh {
        let indices = [0, 1, 2].repeat(triangles);
        let vertex =
            |index: usize| Vertex { position: [(index % 2) as f32, (index % 3) as f32, 0.0], ..Vertex::default() };
        Mesh::new("mesh", Topology::TriangleList, (0..vertices).map(vertex).collect(), indices).unwrap()
    }

    fn free(pages: &mut MeshPages, location: MeshLocation) {
        pages.vacate(location);
        pages.release_empty(location, &SnapshotLifetimes::default());
    }

    /// Which ranges are taken, in a form that two states can be compared by.
    fn state(pages: &MeshPages, live: &[(u32, MeshLocation)]) -> String {
        let longest = |length: u64, occupied: u64| format!("{length}, {occupied}");
        let vertices = longest(pages.vertices.length(), pages.vertices.occupied_length());
        let indices = longest(pages.indices.length(), pages.indices.occupied_length());
        format!("{vertices}; {indices}; {live:?}")
    }

    #[test]
    fn meshes_never_overlap_stay_within_the_budget_and_only_those_in_the_way_are_evicted() {
        let mut random = fastrand::Rng::with_seed(5);
        let (mut pages, mut live) = (MeshPages::default(), Vec::<(u32, MeshLocation)>::new());
        let (mut refused, mut evictions) = (0, 0);
        for slot in 0..3000 {
            // Most are small, some are larger than a page, some have many indices, a few are larger than the budget.
            let vertices = if random.u8(..12) == 0 { random.usize(300..4500) } else { random.usize(3..120) };
            let triangles = if random.u8(..8) == 0 { random.usize(1..2000) } else { random.usize(1..60) };
            let mesh = mesh(vertices, triangles);
            // Some of them stay in any case.
            let candidates: Vec<_> = live.iter().copied().filter(|(slot, _)| slot % 5 != 0).collect();
            let before = state(&pages, &live);
            let Some(room) = pages.find_room(&mesh, (SIZES, BUDGET), candidates.iter().copied()) else {
                refused += 1;
                assert_eq!(state(&pages, &live), before, "nothing changes");
                continue;
            };
            evictions += room.evicted.len();
            assert!(room.evicted.iter().all(|slot| candidates.iter().any(|(candidate, _)| candidate == slot)));
            let is_evicted = |(slot, _): &mut (u32, MeshLocation)| room.evicted.contains(slot);
            let evicted: Vec<_> = live.extract_if(.., is_evicted).map(|(_, location)| location).collect();
            let is_in_the_way = |other: &MeshLocation| other.overlaps(room.location);
            assert!(room.releases_pages || evicted.iter().all(is_in_the_way));
            assert!(!live.iter().any(|(_, other)| is_in_the_way(other)));
            assert!(pages.bytes() <= BUDGET);
            let MeshLocation { vertices: in_vertices, indices: in_indices, .. } = room.location;
            assert_eq!((in_vertices.length as usize, in_indices.length as usize), (vertices, triangles * 3));
            pages.target(room.location).unwrap();
            live.push((slot, room.location));
            if random.u8(..4) == 0 {
                free(&mut pages, live.swap_remove(random.usize(..live.len())).1);
            }
        }
        assert!(refused > 100 && evictions > 500, "{refused} refused, {evictions} evictions");
        live.drain(..).for_each(|(_, location)| free(&mut pages, location));
        assert_eq!(pages.bytes(), 0);
    }

    #[test]
    fn neither_vertices_nor_indices_take_what_the_other_ones_need() {
        // A page of vertices could take all of the budget.
        let sizes = PageSizes { min: 1 << 10, max: MeshBytes { vertices: 1 << 20, indices: 1 << 20 } };
        let mut pages = MeshPages::default();
        let mesh = mesh(100, 300);
        let bytes = pages.bytes_of(&mesh).total();
        let count = (0..).take_while(|_| pages.find_room(&mesh, (sizes, BUDGET), std::iter::empty()).is_some()).count();
        assert!(count as u64 * bytes > BUDGET * 8 / 10, "{count} meshes of {bytes} bytes");
    }
}
