//! From the columns of archetypes to those of a scene: in place where there is one archetype, gathered where there are
//! several.

use std::iter;
use std::ops::Range;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, Mesh};

use crate::engine_world::{ArchetypeColumns, Moved};

/// The columns of the scene, and which of its objects changed since the frame before.
#[derive(Debug, Default)]
pub struct SceneColumns {
    /// The entities of the frame before, by object.
    numbers: Vec<u64>,
    gathered: GatheredColumns,
    changed: Vec<Range<u32>>,
    /// How many bytes the latest update copied.
    pub bytes_copied: usize,
}

#[derive(Debug, Default)]
struct GatheredColumns {
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

/// The columns of a scene: one entry for each object.
#[derive(Clone, Copy, Debug)]
pub struct LentScene<'a> {
    pub positions: &'a [DVec3],
    pub orientations: &'a [Quat],
    pub scales: &'a [Vec3],
    pub bounds: &'a [Bounds],
    pub meshes: &'a [Handle<Mesh>],
    pub materials: &'a [Handle<Material>],
    pub changed: &'a [Range<u32>],
}

impl SceneColumns {
    /// The scene of archetypes, one after the other. Copies what changed if there are several, and nothing but numbers
    /// otherwise.
    pub fn update<'a>(&'a mut self, archetypes: &'a [ArchetypeColumns<'a>]) -> LentScene<'a> {
        self.changed.clear();
        self.bytes_copied = 0;
        let mut first = 0;
        for archetype in archetypes {
            self.find_changes(archetype, first, archetypes.len() > 1);
            first += archetype.numbers.len();
        }
        self.numbers.truncate(first);
        match archetypes {
            [archetype] => {
                // What was gathered for more archetypes is outdated by the time there are several again.
                self.gathered = GatheredColumns::default();
                LentScene {
                    positions: archetype.positions,
                    orientations: archetype.orientations,
                    scales: archetype.scales,
                    bounds: archetype.bounds,
                    meshes: archetype.meshes,
                    materials: archetype.materials,
                    changed: &self.changed,
                }
            }
            _ => self.gathered.lend(first, &self.changed),
        }
    }

    /// Finds the changed entities of an archetype whose first entity is the `first`-th object.
    fn find_changes(&mut self, archetype: &ArchetypeColumns<'_>, first: usize, gathers: bool) {
        let rows = archetype.numbers.len();
        // An archetype that was lent before, or is new, has no copy yet.
        let is_copied = !gathers || self.gathered.positions.len() > first;
        let before = self.numbers.get(first..).unwrap_or_default();
        let is_replaced = |row: &usize| !is_copied || before.get(*row) != Some(&archetype.numbers[*row]);
        let replaced: Vec<_> = (0..rows).filter(is_replaced).collect();
        let changed: Vec<_> = match &archetype.moved {
            Moved::All => iter::once(0..rows).filter(|rows| !rows.is_empty()).collect(),
            Moved::None => runs(&replaced).collect(),
            Moved::Rows(moved) => {
                let mut changed: Vec<_> =
                    moved.iter().map(|&row| row as usize).chain(replaced.iter().copied()).collect();
                changed.sort_unstable();
                changed.dedup();
                runs(&changed).collect()
            }
        };
        self.numbers.resize(self.numbers.len().max(first + rows), 0);
        for rows in runs(&replaced) {
            let objects = first + rows.start..first + rows.end;
            self.numbers[objects.clone()].copy_from_slice(&archetype.numbers[rows.clone()]);
            self.bytes_copied += size_of_val(&archetype.numbers[rows.clone()]);
            if gathers {
                self.bytes_copied += self.gathered.copy_fixed(archetype, rows, objects);
            }
        }
        for rows in changed {
            let objects = first + rows.start..first + rows.end;
            self.changed.push(objects.start as u32..objects.end as u32);
            if gathers {
                self.bytes_copied += self.gathered.copy_moving(archetype, rows, objects);
            }
        }
    }
}

impl GatheredColumns {
    fn lend<'a>(&'a mut self, objects: usize, changed: &'a [Range<u32>]) -> LentScene<'a> {
        self.positions.truncate(objects);
        self.orientations.truncate(objects);
        self.scales.truncate(objects);
        self.bounds.truncate(objects);
        self.meshes.truncate(objects);
        self.materials.truncate(objects);
        LentScene {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            changed,
        }
    }

    /// Copies what only another entity changes. Returns the number of bytes.
    fn copy_fixed(&mut self, archetype: &ArchetypeColumns<'_>, rows: Range<usize>, objects: Range<usize>) -> usize {
        copy(&mut self.scales, &archetype.scales[rows.clone()], objects.start)
            + copy(&mut self.bounds, &archetype.bounds[rows.clone()], objects.start)
            + copy(&mut self.meshes, &archetype.meshes[rows.clone()], objects.start)
            + copy(&mut self.materials, &archetype.materials[rows], objects.start)
    }

    /// Copies what moves. Returns the number of bytes.
    fn copy_moving(&mut self, archetype: &ArchetypeColumns<'_>, rows: Range<usize>, objects: Range<usize>) -> usize {
        copy(&mut self.positions, &archetype.positions[rows.clone()], objects.start)
            + copy(&mut self.orientations, &archetype.orientations[rows], objects.start)
    }
}

/// Copies values to a position in a column, which grows with them. Returns the number of bytes.
fn copy<T: Copy>(column: &mut Vec<T>, values: &[T], first: usize) -> usize {
    let known = values.len().min(column.len() - first);
    column[first..first + known].copy_from_slice(&values[..known]);
    column.extend_from_slice(&values[known..]);
    size_of_val(values)
}

/// Ascending indices as ranges.
fn runs(indices: &[usize]) -> impl Iterator<Item = Range<usize>> {
    indices.chunk_by(|before, after| before + 1 == *after).map(|run| run[0]..run[run.len() - 1] + 1)
}
