//! From the objects that a view sees to those that a pass draws: by bin, or as commands to sort.

use std::ops::Range;

use drawloom_jobs::internal::ChunkedArray;
use glam::DVec3;

use super::bounds4::Bounds4;
use super::object_table::BlockReader;
use super::subdivision_level::subdivision_level;
use super::{IssueReason, ObjectBlock, ObjectLevels, ObjectTable, RenderView, VisibleSet};
use crate::bit_set::{BITS_PER_WORD, BitWord, set_bits};
use crate::command::{
    BinnedSegment, DrawOrder, DrawState, MaterialShare, MaterialTypes, RenderCommand, Selection, SortKey,
};
use crate::handle::Handle;
use crate::quality::{DepthQuantizer, Quality};
use crate::scene::{Blend, ColumnValues, LayerMask, Material, MaterialLayout, ObjectSet, Projection, SceneRef};

/// Which objects a process draws by their layers and material types.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawFilter<'a> {
    /// Of each object; empty if all have the same answer.
    layers: &'a [LayerMask],
    drawn: LayerMask,
    excluded: LayerMask,
    visible: LayerMask,
    /// Of each object.
    materials: &'a [Handle<Material>],
    /// Of each material, by slot; empty if all have the same answer.
    types: &'a [Option<MaterialLayout>],
    drawn_types: MaterialTypes,
}

impl<'a> DrawFilter<'a> {
    pub(crate) fn new(table: &'a ObjectTable, scene: &SceneRef<'a>, selection: Selection) -> Self {
        let (drawn, excluded, visible) = (selection.layers, selection.excluded_layers, selection.visible_layers);
        let is_of_all = (drawn, excluded, visible) == (LayerMask::ALL, LayerMask::NONE, LayerMask::ALL);
        let drawn_types = selection.material_types;
        Self {
            layers: if is_of_all { &[] } else { scene.layers },
            drawn,
            excluded,
            visible,
            materials: scene.materials,
            types: if drawn_types == MaterialTypes::Any { &[] } else { table.material_type_of_slots() },
            drawn_types,
        }
    }

    /// Whether it lets all objects pass.
    pub(crate) fn passes_all(&self) -> bool {
        self.ignores_layers() && self.types.is_empty() && self.drawn_types.contains(None)
    }

    /// Whether layers do not decide.
    pub(crate) fn ignores_layers(&self) -> bool {
        self.layers.is_empty() && self.passes_object_in_all_layers()
    }

    /// Whether it lets an object pass.
    #[inline]
    pub(crate) fn passes(&self, object: usize) -> bool {
        self.passes_layers(object) && self.passes_type(object)
    }

    #[inline]
    fn passes_layers(&self, object: usize) -> bool {
        match self.layers.get(object) {
            Some(layers) => {
                let is_drawn = self.drawn == LayerMask::ALL || layers.intersects(self.drawn);
                let is_excluded = self.excluded == LayerMask::ALL || layers.intersects(self.excluded);
                let is_visible = self.visible == LayerMask::ALL || layers.intersects(self.visible);
                is_drawn && is_visible && !is_excluded
            }
            None => self.passes_object_in_all_layers(),
        }
    }

    #[inline]
    fn passes_type(&self, object: usize) -> bool {
        if self.types.is_empty() {
            return self.drawn_types.contains(None);
        }
        let material = self.materials[object].index() as usize;
        self.drawn_types.contains(self.types.get(material).copied().flatten())
    }

    /// Whether it lets an object that belongs to all layers pass.
    fn passes_object_in_all_layers(&self) -> bool {
        self.drawn != LayerMask::NONE && self.visible != LayerMask::NONE && self.excluded == LayerMask::NONE
    }

    /// Those of up to 64 objects that pass: bit 0 is object `first`.
    #[inline]
    pub(super) fn pass(&self, first: usize, objects: u64) -> u64 {
        if self.passes_all() {
            return objects;
        }
        set_bits(objects).filter(|bit| self.passes(first + bit)).fold(0, |passed, bit| passed | 1 << bit)
    }
}

/// A view that sees more than one in this many objects walks all objects in the order of their bins. Another one
/// collects and orders what it sees. An object that is passed by costs a quarter of one that is collected.
const WALK_THRESHOLD: usize = 4;

/// Whether a process that draws a selection may walk all objects in the order of their bins.
pub(crate) fn can_scan_bin_order(selection: Selection) -> bool {
    selection.materials == MaterialShare::ALL
}

/// Some of the objects that a view sees.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum VisibleRange {
    /// One of `count` parts that take about as long. All of them are all that the view sees.
    Share { index: usize, count: usize },
    /// Those whose rank, the index among the visible objects, is in this range.
    Ranks(Range<usize>),
}

impl VisibleRange {
    /// The indices among `length` entries.
    fn among(&self, length: usize) -> Range<usize> {
        match *self {
            Self::Share { index, count } => index * length / count..(index + 1) * length / count,
            Self::Ranks(ref ranks) => ranks.clone(),
        }
    }
}

/// Makes a segment the opaque objects among some of those that a view sees that a process draws, ordered by bin.
pub(crate) fn bin_visible(
    table: &ObjectTable,
    visible: &VisibleSet,
    selection: Selection,
    filter: DrawFilter<'_>,
    range: &VisibleRange,
    segment: &mut BinnedSegment,
) {
    let bins = table.bins();
    if matches!(range, VisibleRange::Share { .. })
        && can_scan_bin_order(selection)
        && visible.count() * WALK_THRESHOLD > table.len()
        && let Some(all) = table.objects_by_bin()
    {
        let is_opaque = |bin| bins.get(bin).state.blend() == Blend::None;
        let is_visible = |object: u32| visible.contains(object as usize);
        if filter.passes_all() {
            segment.select(&all, range.among(all.len()), is_opaque, is_visible);
        } else {
            segment.select(&all, range.among(all.len()), is_opaque, |object| {
                is_visible(object) && filter.passes(object as usize)
            });
        }
    } else {
        let mut reader = BlockReader::new(table);
        segment.clear();
        visible.visit(range.among(visible.count()), |_, word, bits| {
            push_word(BitWord::new(word, bits), reader.block_of_word(word), selection, &filter, segment);
        });
        segment.order(&bins);
    }
}

/// Makes a segment the opaque ones of some drawable objects that a process draws, ordered by bin.
pub(crate) fn bin_objects(
    table: &ObjectTable,
    words: &[BitWord],
    selection: Selection,
    filter: DrawFilter<'_>,
    segment: &mut BinnedSegment,
) {
    let mut reader = BlockReader::new(table);
    segment.clear();
    for &word in words {
        push_word(word, reader.block_of_word(word.index()), selection, &filter, segment);
    }
    segment.order(&table.bins());
}

/// Appends the opaque objects of a word, which is in a block, that a process draws to a segment.
#[inline]
fn push_word(
    objects: BitWord,
    block: &ObjectBlock,
    selection: Selection,
    filter: &DrawFilter<'_>,
    segment: &mut BinnedSegment,
) {
    let mask = objects.mask & block.opaque[objects.index() % ObjectBlock::WORDS];
    let drawn = filter.pass(objects.index() * BITS_PER_WORD, mask);
    for object in BitWord::new(objects.index(), drawn).indices() {
        let entry = object % ObjectBlock::SIZE;
        let draw = &block.draws[entry];
        if selection.materials == MaterialShare::ALL || selection.contains(draw.state.blend(), draw.material) {
            segment.push(object as u32, block.bins[entry]);
        }
    }
}

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
    /// among the visible objects. Objects that the process does not draw become [`RenderCommand::EMPTY`]. Returns whether
    /// it counted one whose edges are too coarse.
    pub(crate) fn run(&self, ranks: Range<usize>, commands: &ChunkedArray<RenderCommand>) -> bool {
        let mut has_coarse_edges = false;
        let camera = &self.view.camera;
        let numbers = match self.selection.order {
            DrawOrder::ByColumn(column) => self.scene.column(column.layout()),
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
                    *slot = self.command(first + bit, objects, &order, &mut has_coarse_edges);
                }
            });
        }
        has_coarse_edges
    }

    #[inline]
    fn command(
        &self,
        object: usize,
        objects: &ObjectBlock,
        order: &OrderKeys<'_>,
        has_coarse_edges: &mut bool,
    ) -> RenderCommand {
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
                *has_coarse_edges = true;
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

/// Collects the objects of a set that need no order and look the same in every view: drawable opaque ones with meshes
/// that `is_recordable`. Returns their bounds, those of the first group.
pub(crate) fn recordable_objects(
    table: &ObjectTable,
    set: &ObjectSet,
    is_recordable: impl Fn(u32) -> bool,
    words: &mut Vec<BitWord>,
) -> Bounds4 {
    let (mut reader, mut bounds) = (BlockReader::new(table), Bounds4::default());
    words.clear();
    for word in set.words(0..table.len().div_ceil(BITS_PER_WORD)) {
        let block = reader.block_of_word(word.index());
        let word_in_block = word.index() % ObjectBlock::WORDS;
        let first = word_in_block * BITS_PER_WORD;
        let mut recorded = 0;
        for bit in set_bits(word.mask & block.drawable(word_in_block) & block.opaque[word_in_block]) {
            if is_recordable(block.draws[first + bit].mesh) {
                recorded |= 1 << bit;
                bounds.extend_word(0, block.spheres.get(first + bit));
            }
        }
        if recorded != 0 {
            words.push(BitWord { mask: recorded, ..word });
        }
    }
    bounds
}
