//! The levels of detail of a mesh.

use std::sync::Arc;

use super::mesh::{check_corner_count, triangle_count};
use super::{LevelOfDetail, Mesh, SceneError};

impl Mesh {
    /// Replaces the mesh's coarser levels, the finest first. Views draw them where their errors are small enough in the
    /// picture: see [`Quality::level_of_detail`](crate::quality::Quality::level_of_detail).
    ///
    /// A level draws vertices of the mesh, with its topology and attributes. Only objects that are drawn at level 0
    /// hide others.
    ///
    /// ```
    /// use drawloom::scene::{LevelOfDetail, Mesh, Topology, Vertex};
    ///
    /// # fn main() -> Result<(), drawloom::scene::SceneError> {
    /// let corner = |x: f32, y: f32, z: f32| Vertex { position: [x, y, z], normal: [0.0, 0.0, 1.0], uv: [x, y] };
    /// // A square whose middle is a centimetre higher than its corners.
    /// let corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.5, 0.5, 0.01)];
    /// let corners = corners.map(|(x, y, z)| corner(x, y, z)).to_vec();
    /// let hill = Mesh::new("hill", Topology::TriangleList, corners, vec![0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4])?;
    /// let hill = hill.with_levels([LevelOfDetail::new(vec![0, 1, 2, 0, 2, 3], 0.01)])?;
    /// assert_eq!(hill.levels()[0].indices().len(), 6);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// If a level has no triangle, or not fewer than the level before it; if its error is not finite, or not above that
    /// of the level before it (0 of level 0); if an index is out of range, or a part of a triangle is left over; if
    /// there are more than [`LevelOfDetail::MAX_COUNT`]; or if the mesh is [in the engine's own
    /// buffers](Self::from_buffers), whose indices the CPU does not know.
    pub fn with_levels(mut self, levels: impl IntoIterator<Item = LevelOfDetail>) -> Result<Self, SceneError> {
        self.levels = Arc::default();
        let (mut triangles, mut error) = (self.triangle_count(), 0.0);
        for (index, mut level) in (0..).zip(levels) {
            if let Some(problem) = self.level_problem(index, &level, triangles, error) {
                return Err(SceneError::InvalidLevel { mesh: self.name().to_owned(), level: index + 1, problem });
            }
            (triangles, error) = (triangle_count(self.topology(), level.indices.len()), level.error());
            level.longest_edge = self.longest_edge_among(&level.indices);
            Arc::make_mut(&mut self.levels).push(level);
        }
        Ok(self)
    }

    /// The problem of a level, if any, after a level with these triangles and this error.
    fn level_problem(&self, index: usize, level: &LevelOfDetail, triangles: usize, error: f32) -> Option<String> {
        let (indices, vertices) = (level.indices(), self.vertices().len());
        let count = triangle_count(self.topology(), indices.len());
        if !self.has_triangles() {
            Some("has no vertices, because those of its mesh are in the engine's buffers".to_owned())
        } else if index >= LevelOfDetail::MAX_COUNT {
            Some(format!("is one too many: a mesh has {} at most beside level 0", LevelOfDetail::MAX_COUNT))
        } else if let Err(problem) = check_corner_count(self.name(), self.topology(), indices.len()) {
            Some(match problem {
                SceneError::PartialTriangle { corners, .. } => {
                    format!("has {corners} corners, which is not a multiple of 3")
                }
                _ => "has no triangle".to_owned(),
            })
        } else if let Some(index) = indices.iter().find(|&&index| index as usize >= vertices) {
            Some(format!("has the index {index}, which points past the {vertices} vertices"))
        } else if count >= triangles {
            Some(format!("has {count} triangles, not fewer than the {triangles} of the level before it"))
        } else if !(level.error() > error && level.error().is_finite()) {
            let found = level.error();
            Some(format!(
                "has an error of {found} m, which is not finite and above the {error} m of the level before it"
            ))
        } else {
            None
        }
    }

    /// The coarser levels, the finest first: the one at index 0 is level 1.
    pub fn levels(&self) -> &[LevelOfDetail] {
        &self.levels
    }

    /// The indices of a level; those of the coarsest one if there are fewer levels.
    pub(crate) fn indices_of(&self, level: u32) -> &[u32] {
        let coarser = (level as usize).min(self.levels.len()).checked_sub(1);
        coarser.map_or(self.indices(), |index| self.levels[index].indices())
    }

    /// The number of triangles of a level.
    pub(crate) fn triangle_count_of(&self, level: u32) -> usize {
        if level == 0 { self.triangle_count() } else { triangle_count(self.topology(), self.indices_of(level).len()) }
    }

    /// The length of the longest edge of a level, as [`Mesh::longest_edge`].
    pub(crate) fn longest_edge_of(&self, level: u32) -> f32 {
        let coarser = (level as usize).min(self.levels.len()).checked_sub(1);
        coarser.map_or(self.longest_edge(), |index| self.levels[index].longest_edge)
    }

    /// A level as a mesh of its own.
    #[cfg(any(feature = "wgpu", feature = "software"))]
    pub(crate) fn at_level(&self, level: u32) -> Self {
        let (vertices, indices) = (self.vertices().to_vec(), self.indices_of(level).to_vec());
        Self::from_valid_parts(self.name().to_owned(), self.topology(), vertices, indices).with_attributes_of(self, &[])
    }

    /// The mesh with the levels of another one that has the same positions.
    #[cfg(feature = "software")]
    pub(super) fn with_levels_of(mut self, other: &Self) -> Self {
        self.levels.clone_from(&other.levels);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Topology, Vertex};

    /// A fan of six triangles around a vertex, and a strip along its rim.
    fn fan(topology: Topology) -> Mesh {
        let corner = |index: u32| {
            let angle = f64::from(index) * std::f64::consts::FRAC_PI_3;
            let radius = if index == 6 { 0.0 } else { 1.0 };
            Vertex {
                position: [(radius * angle.cos()) as f32, (radius * angle.sin()) as f32, 0.0],
                ..Vertex::default()
            }
        };
        let indices = match topology {
            Topology::TriangleList => (0..6).flat_map(|index| [6, index, (index + 1) % 6]).collect(),
            Topology::TriangleStrip => vec![0, 1, 5, 2, 4, 3],
        };
        Mesh::new("fan", topology, (0..7).map(corner).collect(), indices).unwrap()
    }

    #[test]
    fn invalid_levels_are_errors_that_name_mesh_and_level() {
        let level = |indices: &[u32], error| LevelOfDetail::new(indices.to_vec(), error);
        let (hexagon, triangle) = ([0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5], [0, 2, 4]);
        let fine = level(&hexagon, 0.1);
        let short = level(&triangle, 0.5);
        let strip = Topology::TriangleStrip;
        let list = Topology::TriangleList;
        assert_eq!(fan(list).with_levels([fine.clone(), short.clone()]).unwrap().levels().len(), 2);
        for (topology, levels, number, problem) in [
            (
                list,
                vec![short.clone(), fine.clone()],
                2,
                "has 4 triangles, not fewer than the 1 of the level before it",
            ),
            (
                list,
                vec![fine.clone(), level(&triangle, 0.1)],
                2,
                "has an error of 0.1 m, which is not finite and above the 0.1 m",
            ),
            (list, vec![level(&hexagon, 0.0)], 1, "has an error of 0 m"),
            (list, vec![level(&hexagon, f32::NAN)], 1, "has an error of NaN m"),
            (list, vec![fine.clone(), level(&triangle, f32::INFINITY)], 2, "has an error of inf m"),
            (list, vec![level(&hexagon[..4], 0.1)], 1, "has 4 corners, which is not a multiple of 3"),
            (list, vec![level(&[], 0.1)], 1, "has no triangle"),
            (list, vec![level(&[0, 1, 7], 0.1)], 1, "has the index 7, which points past the 7 vertices"),
            (strip, vec![level(&[0, 1, 5, 2, 3, 4], 0.1)], 1, "has 4 triangles, not fewer than the 4"),
        ] {
            match fan(topology).with_levels(levels) {
                Err(SceneError::InvalidLevel { mesh, level, problem: found }) => {
                    assert!(found.starts_with(problem), "{found}");
                    assert_eq!((mesh.as_str(), level), ("fan", number), "{found}");
                }
                other => panic!("{problem}: {other:?}"),
            }
        }
        let row =
            (0..20).map(|index| Vertex { position: [index as f32, (index % 2) as f32, 0.0], ..Vertex::default() });
        let row = Mesh::new("row", strip, row.collect(), (0..20).collect()).unwrap();
        let levels = (1..=8).map(|number| level(&(0..20 - number).collect::<Vec<_>>(), number as f32));
        let error = row.clone().with_levels(levels.clone()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "mesh `row`: its level of detail 8 is one too many: a mesh has 7 at most beside level 0"
        );
        assert!(row.with_levels(levels.take(7)).is_ok());
    }

    #[test]
    fn a_level_is_the_mesh_of_its_indices() {
        for topology in [Topology::TriangleList, Topology::TriangleStrip] {
            let own = fan(topology);
            // Three of the triangles.
            let corners = if topology == Topology::TriangleList { 9 } else { 5 };
            let half = own.indices()[..corners].to_vec();
            let mesh = own.clone().with_levels([LevelOfDetail::new(half.clone(), 0.5)]).unwrap();
            let alone = Mesh::new("fan", topology, own.vertices().to_vec(), half).unwrap();
            for mesh in [mesh.clone(), mesh.clone().with_triangle_culling(true)] {
                let count = mesh.triangle_count_of(1);
                assert_eq!(count, alone.triangle_count());
                assert!(mesh.triangles_in(1, 0..count).eq(alone.triangles()));
                assert_eq!(mesh.longest_edge_of(1), alone.longest_edge());
                assert!(mesh.triangles().eq(own.triangles()));
                assert_eq!(mesh.longest_edge_of(0), own.longest_edge());
            }
            assert_eq!(mesh.at_level(1), alone);
            assert_eq!(mesh.with_levels([]).unwrap(), own);
        }
    }
}
