//! Fill: a command for each object that a view sees (M 10.3, "Filling a RenderCommand Structure").

use std::ops::Range;

use glam::DVec3;

use super::halvings::halvings;
use crate::blocks::Blocks;
use crate::command::{DrawState, RenderCommand, SortKey};
use crate::quality::{DepthCodes, Quality};
use crate::scene::{Blend, Projection, SceneRef};
use crate::view::{ObjectBlock, ObjectTable, RejectionReason, RenderView, VisibleSet, places};

/// Which objects a process draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Selection {
    /// By how they mix with what is behind them.
    pub blending: Blending,
    /// By their material.
    pub materials: MaterialShare,
}

impl Selection {
    /// All that hide what is behind them.
    pub const OPAQUE: Self = Self { blending: Blending::Opaque, materials: MaterialShare::ALL };
    /// All that mix with what is behind them.
    pub const BLENDED: Self = Self { blending: Blending::Blended, materials: MaterialShare::ALL };
    /// Every object: first the opaque ones, then the others.
    pub const ALL: Self = Self { blending: Blending::Both, materials: MaterialShare::ALL };

    /// Whether it takes what mixes like that and is of the material in this slot.
    pub fn takes(self, blend: Blend, material: u32) -> bool {
        let blends = match self.blending {
            Blending::Opaque => blend == Blend::None,
            Blending::Blended => blend != Blend::None,
            Blending::Both => true,
        };
        // A division would cost as much as all the rest of a command.
        blends && (self.materials == MaterialShare::ALL || material % self.materials.of.max(1) == self.materials.index)
    }
}

/// Objects by how they mix with what is behind them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Blending {
    /// Those that hide it.
    #[default]
    Opaque,
    /// Those that mix with it.
    Blended,
    /// Both.
    Both,
}

/// A share of the materials: of every `of` slots, the one at `index`. Shares 0, 1 ... `of` − 1 together are all materials, and
/// no material is in two: a process that is added once for each share splits its work by material (L 5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialShare {
    /// Which share, from 0.
    pub index: u32,
    /// Of how many; 0 counts as 1.
    pub of: u32,
}

impl MaterialShare {
    /// Every material.
    pub const ALL: Self = Self { index: 0, of: 1 };
}

impl Default for MaterialShare {
    fn default() -> Self {
        Self::ALL
    }
}

/// Fills the commands of one process in one view. It computes no new state: it copies what the object table holds, which
/// leaves nothing to contend for.
#[derive(Clone, Copy, Debug)]
pub struct Fill<'a> {
    /// The frame's objects.
    pub table: &'a ObjectTable,
    /// The view.
    pub view: &'a RenderView,
    /// What it sees.
    pub visible: &'a VisibleSet,
    /// What of that the process draws.
    pub selection: Selection,
    /// The scene, for what only few views need to know of an object.
    pub scene: &'a SceneRef<'a>,
    /// How precisely commands are ordered, and how finely meshes are subdivided for paraboloids.
    pub quality: &'a Quality,
}

/// What orders a view's commands by depth.
struct DepthOrder {
    forward: DVec3,
    opaque: DepthCodes,
    blended: DepthCodes,
}

impl Fill<'_> {
    /// Writes one slot of `commands` for each visible object whose rank is in `ranks`; what the process does not draw
    /// becomes [`RenderCommand::NOTHING`].
    pub fn run(&self, ranks: Range<usize>, commands: &Blocks<RenderCommand>) {
        let camera = &self.view.camera;
        let order = DepthOrder {
            forward: camera.orientation.as_dquat().normalize() * DVec3::NEG_Z,
            opaque: self.quality.opaque_order.codes(camera.near, camera.far),
            blended: self.quality.blended_order.codes(camera.near, camera.far),
        };
        for (block, part) in Blocks::<RenderCommand>::parts(ranks) {
            let mut slots = commands.write(block);
            // Visible objects come in order, so the table's blocks are changed seldom.
            let mut open = None;
            self.visible.visit(part, |rank, word, bits| {
                let first = word * VisibleSet::WORD;
                let index = first / ObjectTable::BLOCK;
                let (_, objects) = match open.take() {
                    Some((current, guard)) if current == index => open.insert((current, guard)),
                    _ => open.insert((index, self.table.block(index))),
                };
                let start = rank % Blocks::<RenderCommand>::SIZE;
                for (slot, place) in slots[start..].iter_mut().zip(places(bits)) {
                    *slot = self.command(first + place, objects, &order);
                }
            });
        }
    }

    #[inline]
    fn command(&self, object: usize, objects: &ObjectBlock, order: &DepthOrder) -> RenderCommand {
        let entry = object % ObjectTable::BLOCK;
        let draw = objects.draws[entry];
        let blend = draw.state.blend();
        if !self.selection.takes(blend, draw.material) {
            return RenderCommand::NOTHING;
        }
        let mut state = draw.state;
        if self.view.camera.projection == Projection::Paraboloid {
            let widest_angle = f64::from(self.quality.shadows.widest_edge).to_radians();
            let Some(halvings) = halvings(self.view, self.scene, object, widest_angle) else {
                return RenderCommand::NOTHING;
            };
            state = state.subdivided(halvings);
            if halvings > DrawState::FINEST {
                self.table.rejections().count_once(RejectionReason::CoarseEdges, object);
            }
        }
        let center = objects.spheres.get(entry).center;
        // In f64, and rounded once: then no two are in the wrong order that f32 can tell apart, however far aside they are.
        let depth = order.forward.dot(center - self.view.camera.position) as f32;
        let key = match blend {
            Blend::None => SortKey::opaque(state, draw.mesh, order.opaque.of(depth)),
            _ => SortKey::blended(order.blended.of(depth)),
        };
        RenderCommand { key, object: object as u32, mesh: draw.mesh, material: draw.material, state }
    }
}
