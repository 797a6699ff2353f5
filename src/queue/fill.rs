//! Fill: a command for each object that a view sees (M 10.3, "Filling a RenderCommand Structure").

use std::ops::Range;

use glam::Vec3;

use crate::blocks::Blocks;
use crate::command::{RenderCommand, SortKey};
use crate::scene::Blend;
use crate::view::{ObjectDraw, ObjectTable, RenderView, VisibleSet, WorldBounds};

/// Which objects a process draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Selection {
    /// Those that hide what is behind them.
    #[default]
    Opaque,
    /// Those that mix with what is behind them.
    Blended,
    /// Both: first the opaque ones, then the others.
    All,
}

impl Selection {
    fn takes(self, blend: Blend) -> bool {
        match self {
            Self::Opaque => blend == Blend::None,
            Self::Blended => blend != Blend::None,
            Self::All => true,
        }
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
}

impl Fill<'_> {
    /// Writes one slot of `commands` for each visible object whose rank is in `ranks`; what the process does not draw
    /// becomes [`RenderCommand::NOTHING`].
    pub fn run(&self, ranks: Range<usize>, commands: &Blocks<RenderCommand>) {
        let forward = self.view.camera.orientation.normalize() * Vec3::NEG_Z;
        for (block, part) in Blocks::<RenderCommand>::parts(ranks) {
            let mut slots = commands.write(block);
            // Visible objects come in order, so the table's blocks are changed seldom.
            let mut open = None;
            self.visible.visit(part, |rank, object| {
                let table_block = object / Blocks::<ObjectDraw>::SIZE;
                if open.as_ref().is_none_or(|&(current, _, _)| current != table_block) {
                    open = Some((
                        table_block,
                        self.table.draws().read(table_block),
                        self.table.bounds().read(table_block),
                    ));
                }
                if let Some((_, draws, bounds)) = &open {
                    let entry = object % Blocks::<ObjectDraw>::SIZE;
                    slots[rank % Blocks::<RenderCommand>::SIZE] =
                        self.command(object, draws[entry], &bounds[entry], forward);
                }
            });
        }
    }

    fn command(&self, object: usize, draw: ObjectDraw, bounds: &WorldBounds, forward: Vec3) -> RenderCommand {
        let blend = draw.state.blend();
        if !self.selection.takes(blend) {
            return RenderCommand::NOTHING;
        }
        let depth = forward.dot((bounds.center - self.view.camera.position).as_vec3());
        let key = match blend {
            Blend::None => SortKey::opaque(draw.state, draw.material, draw.mesh, depth),
            _ => SortKey::blended(depth),
        };
        RenderCommand { key, object: object as u32, mesh: draw.mesh, material: draw.material, state: draw.state }
    }
}
