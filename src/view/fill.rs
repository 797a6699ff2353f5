//! Fill: a command for each object that a view sees (M 10.3, "Filling a RenderCommand Structure").

use std::ops::Range;

use drawloom_jobs::internal::ChunkedArray;
use glam::DVec3;

use super::block_reader::BlockReader;
use super::subdivision_level::subdivision_level;
use super::{DrawFilter, IssueReason, ObjectBlock, ObjectLevels, ObjectTable, RenderView, VisibleSet};
use crate::bit_set::{BITS_PER_WORD, set_bits};
use crate::command::{DrawOrder, DrawState, RenderCommand, Selection, SortKey};
use crate::quality::{DepthQuantizer, Quality};
use crate::scene::{Blend, ColumnValues, Projection, SceneRef};

/// Fills the commands of one pass. Mesh, material and draw state are copied from the object table, which workers only
/// read. The depth is computed for each view, and so are the state's level of detail and, if the view is a paraboloid,
/// its subdivision level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fill<'a> {
    /// The frame's objects.
    pub(crate) table: &'a ObjectTable,
    /// The view.
    pub(crate) view: &'a RenderView,
    /// The view's visible set.
    pub(crate) visible: &'a VisibleSet,
    /// The objects that the render process draws.
    pub(crate) selection: Selection,
    pub(crate) filter: DrawFilter<'a>,
    /// The levels of detail in the view; `None` if all are 0.
    pub(crate) levels: Option<&'a ObjectLevels>,
    /// The scene, for the subdivision level.
    pub(crate) scene: &'a SceneRef<'a>,
    /// The precision of the depth order, and of the subdivision for paraboloids.
    pub(crate) quality: &'a Quality,
}

/// How a pass orders commands.
struct OrderKeys<'a> {
    forward: DVec3,
    opaque: DepthQuantizer,
    blended: DepthQuantizer,
    /// The engine's own numbers, if these are the order.
    numbers: Option<ColumnValues<'a>>,
}

impl OrderKeys<'_> {
    /// The engine's own number of an object.
    fn number(&self, object: usize) -> u32 {
        // A frame whose scene lacks the column has failed before.
        let value =
            self.numbers.and_then(|values| values.bytes().get(object * values.layout().stride..)?.first_chunk());
        value.map_or(0, |bytes| u32::from_ne_bytes(*bytes))
    }
}

impl Fill<'_> {
    /// Writes one command for each visible object whose rank is in `ranks`, at the index that is its rank: its index
    /// among the visible objects. Objects that the process does not draw become [`RenderCommand::EMPTY`].
    pub(crate) fn run(&self, ranks: Range<usize>, commands: &ChunkedArray<RenderCommand>) {
        let camera = &self.view.camera;
        let numbers = match self.selection.order {
            DrawOrder::ByColumn(column) => self.scene.column(column),
            _ => None,
        };
        let order = OrderKeys {
            forward: camera.orientation.as_dquat().normalize() * DVec3::NEG_Z,
            opaque: self.quality.opaque_order.quantizer(camera.near, camera.far),
            blended: self.quality.blended_order.quantizer(camera.near, camera.far),
            numbers,
        };
        for (block, part) in ChunkedArray::<RenderCommand>::block_ranges(ranks) {
            let mut slots = commands.write(block);
            let mut reader = BlockReader::new(self.table);
            self.visible.visit(part, |rank, word, bits| {
                let (first, objects) = (word * BITS_PER_WORD, reader.block_of_word(word));
                let start = rank % ChunkedArray::<RenderCommand>::BLOCK_SIZE;
                for (slot, bit) in slots[start..].iter_mut().zip(set_bits(bits)) {
                    *slot = self.command(first + bit, objects, &order);
                }
            });
        }
    }

    #[inline]
    fn command(&self, object: usize, objects: &ObjectBlock, order: &OrderKeys<'_>) -> RenderCommand {
        let entry = object % ObjectTable::BLOCK_SIZE;
        let draw = objects.draws[entry];
        let blend = draw.state.blend();
        if !self.selection.contains(blend, draw.material) || !self.filter.passes(object) {
            return RenderCommand::EMPTY;
        }
        let level_of_detail = self.levels.map_or(0, |levels| levels.get(object));
        let mut state = draw.state.with_level_of_detail(level_of_detail);
        if self.view.camera.projection == Projection::Paraboloid {
            let widest_angle = f64::from(self.quality.shadows.widest_edge).to_radians();
            let Some(level) = subdivision_level(self.view, self.scene, (object, level_of_detail), widest_angle) else {
                return RenderCommand::EMPTY;
            };
            state = state.with_subdivision_level(level);
            if level > DrawState::MAX_SUBDIVISION_LEVEL {
                self.table.scene_issues().count_once(IssueReason::CoarseEdges, object);
            }
        }
        let center = objects.spheres.get(entry).center;
        // In f64, rounded once: two depths that differ in f32 are in the right order, however far the objects are to
        // the side.
        let depth = order.forward.dot(center - self.view.camera.position) as f32;
        let key = match (self.selection.order, blend) {
            (DrawOrder::ByState, Blend::None) => SortKey::opaque(state, draw.mesh, order.opaque.quantize(depth)),
            (DrawOrder::ByState | DrawOrder::BackToFront, _) => SortKey::blended(order.blended.quantize(depth)),
            (DrawOrder::FrontToBack, _) => SortKey::ordered(order.blended.quantize(depth)),
            (DrawOrder::ByColumn(_), _) => SortKey::ordered(order.number(object)),
        };
        RenderCommand { key, object: object as u32, mesh: draw.mesh, material: draw.material, state }
    }
}
