//! What must hold of a scene as a whole, how much of it there may be, and whether all changes were reported. Single
//! objects and lights that are invalid are left out instead.

use std::cell::Cell;

use super::FrameError;
use crate::backend::{Backend, CallPanic, FrameRequest, GuardedBackend, SceneLimits};
use crate::bit_set::BitWord;
use crate::handle::Handle;
use crate::process::{Draws, FramePlan, Items, Pass, Requirements};
use crate::quality::VertexFormat;
use crate::scene::{Assets, ColumnLayout, LayerMask, Material, Mesh, ObjectColumn, SceneError, SceneRef};
use crate::unwind::emit;
use crate::view::{IssueReason, ObjectTable, RenderView, TableLimits};

/// # Errors
/// If no frame can be made of the scene.
pub(super) fn check_scene(scene: &SceneRef<'_>) -> Result<(), FrameError> {
    scene.check_lengths()?;
    if scene.cameras.is_empty() {
        return Err(FrameError::NoView);
    }
    for camera in scene.cameras {
        let [width, height] = camera.size;
        if width == 0 || height == 0 {
            return Err(FrameError::EmptyTarget { view: camera.name.clone(), width, height });
        }
        camera.check()?;
    }
    for (name, color) in [("ambient", scene.ambient), ("background", scene.background)] {
        if !color.is_finite() || color.min_element() < 0.0 {
            return Err(SceneError::InvalidColor { name }.into());
        }
    }
    Ok(())
}

/// Finds the items of each pass, by index among those that are lent. Items for a process or a view that the frame does not
/// have are left alone; `may_lack_items` says whether a pass may have none.
///
/// # Errors
/// If the items do not fit the passes, or a set of them is invalid as a whole.
pub(super) fn find_items(
    (items, may_lack_items): (&[Items<'_>], bool),
    (plan, draws): (&FramePlan, &[Draws<'_>]),
    (passes, views): (&[Pass], &[RenderView]),
    found: &mut Vec<Option<usize>>,
) -> Result<(), FrameError> {
    for lent in items {
        let process = plan.processes().iter().position(|planned| planned.name == lent.process);
        match process.map(|process| &draws[process]) {
            Some(Draws::Items(_)) => check_items(lent)?,
            Some(_) => return Err(FrameError::UnexpectedItems { process: lent.process.to_owned() }),
            None => {}
        }
    }
    found.clear();
    for pass in passes {
        if !matches!(draws[pass.process_index], Draws::Items(_)) {
            found.push(None);
            continue;
        }
        let (planned, view) = (&plan.processes()[pass.process_index], &views[pass.view_index]);
        let is_of_pass = |lent: &Items<'_>| lent.process == planned.name && lent.views.contains(view);
        let mut of_pass = items.iter().zip(0..).filter(|(lent, _)| is_of_pass(lent)).map(|(_, index)| index);
        let (first, names) = (of_pass.next(), || (planned.name.clone(), view.name().to_owned()));
        if of_pass.next().is_some() {
            let (process, view) = names();
            return Err(FrameError::RepeatedItems { process, view });
        }
        if first.is_none() && !may_lack_items {
            let (process, view) = names();
            return Err(FrameError::MissingItems { process, view });
        }
        found.push(first);
    }
    Ok(())
}

fn check_items(items: &Items<'_>) -> Result<(), FrameError> {
    let (process, keys) = (|| items.process.to_owned(), items.keys.len());
    if u32::try_from(keys).is_err() {
        return Err(FrameError::TooManyItems { process: process(), count: keys });
    }
    if !items.data.len().is_multiple_of(ITEM_DATA_ALIGNMENT) {
        return Err(FrameError::ItemDataSize { process: process(), bytes: items.data.len() });
    }
    let slices = [("bounds", items.bounds.len()), ("layers", items.layers.len()), ("versions", items.versions.len())];
    match slices.into_iter().find(|(_, count)| *count != 0 && *count != keys) {
        Some((slice, count)) => Err(FrameError::UnequalItems { process: process(), slice, count, keys }),
        None => Ok(()),
    }
}

/// wgpu copies as many bytes as are a multiple of this.
const ITEM_DATA_ALIGNMENT: usize = 4;

/// What a frame can hold of its scene, as the object table asks for it.
#[derive(Debug, Default)]
pub(super) struct SceneCapacity {
    /// The limits of the backend, and what else decides which meshes can be drawn; `None` before the first frame with a
    /// backend.
    conditions: Option<(SceneLimits, VertexFormat)>,
    /// Counts how often the conditions changed.
    revision: u64,
    /// The size of an element in the widest column that the latest plan reads.
    column_stride: usize,
}

impl SceneCapacity {
    /// Begins a frame of the object table within the limits of a backend, with vertices in this format.
    ///
    /// # Errors
    /// If the backend panics. The next frame asks it of all meshes again.
    pub(super) fn begin_frame<B: Backend>(
        &mut self,
        backend: &GuardedBackend<B>,
        limits: SceneLimits,
        scene: &SceneRef<'_>,
        objects: &mut ObjectTable,
        vertices: VertexFormat,
    ) -> Result<(), CallPanic> {
        if self.conditions.replace((limits, vertices)) != Some((limits, vertices)) {
            self.revision += 1;
        }
        let panic = Cell::new(None);
        let can_draw = |mesh: &Mesh| {
            can_draw(backend, mesh, vertices).unwrap_or_else(|failed| {
                panic.set(Some(failed));
                false
            })
        };
        objects.begin_frame_within(scene, &self.limits(&can_draw));
        panic.take().map_or(Ok(()), |panic| {
            self.forget_backend();
            Err(panic)
        })
    }

    /// The plan reads these columns. If they are wider than those of the plan before, fewer objects may have room; if
    /// they are narrower, more.
    pub(super) fn set_columns(&mut self, columns: &[ColumnLayout], scene: &SceneRef<'_>, objects: &mut ObjectTable) {
        self.column_stride = columns.iter().map(|column| column.stride).max().unwrap_or(0);
        // The table knows which meshes can be drawn.
        let limits = self.limits(&|_| true);
        if limits.objects.min(scene.object_count()) != objects.len() {
            objects.begin_frame_anew(scene, &limits);
        }
    }

    /// The next frame is one of another backend.
    pub(super) fn forget_backend(&mut self) {
        self.conditions = None;
    }

    fn limits<'a>(&self, can_draw: &'a dyn Fn(&Mesh) -> bool) -> TableLimits<'a> {
        let (limits, _) = self.conditions.unwrap_or_default();
        TableLimits {
            objects: limits.max_objects(self.column_stride).min(TableLimits::MAX_OBJECTS),
            material_bytes: limits.binding_bytes,
            texture_layers: limits.texture_layers,
            can_draw,
            revision: self.revision,
        }
    }
}

/// Whether a backend draws a mesh with vertices in this format. Warns by name of one that it does not draw.
///
/// # Errors
/// If the backend panics.
fn can_draw<B: Backend>(backend: &GuardedBackend<B>, mesh: &Mesh, vertices: VertexFormat) -> Result<bool, CallPanic> {
    let Err(problem) = backend.check_mesh(mesh, vertices)? else { return Ok(true) };
    let mesh = mesh.name();
    emit(|| tracing::warn!(target: "drawloom", mesh = ?mesh, %problem, "objects with this mesh are left out"));
    Ok(false)
}

/// Copies of the columns that the latest frame read, and of the objects' layers. Only builds with debug assertions have
/// any.
#[derive(Debug, Default)]
pub(super) struct ChangeCheck {
    copies: Vec<(ColumnLayout, Vec<u8>)>,
}

/// The layers of objects are compared as a column is.
const LAYERS: ObjectColumn<LayerMask> = ObjectColumn::new("layers of objects");

impl ChangeCheck {
    /// Compares what a frame read of its objects with the frame before.
    ///
    /// # Errors
    /// If something changed, and the scene does not report its object.
    pub(super) fn check(&mut self, request: &FrameRequest<'_>) -> Result<(), SceneError> {
        let FrameRequest { plan, draws, scene, objects, .. } = *request;
        let mut columns = plan.columns().to_vec();
        columns.extend(draws.iter().filter_map(Draws::order_column));
        let unreported = objects.unreported_change(scene).map(|object| SceneError::UnreportedChange { object });
        let in_columns = self.check_columns(scene, &columns, objects);
        unreported.map_or(in_columns, Err)
    }

    /// Compares the columns that a frame read with those of the frame before, and copies them.
    ///
    /// # Errors
    /// If a value changed, and the scene does not report its object.
    fn check_columns(
        &mut self,
        scene: &SceneRef<'_>,
        columns: &[ColumnLayout],
        objects: &ObjectTable,
    ) -> Result<(), SceneError> {
        let layers = (!scene.layers.is_empty()).then(|| LAYERS.values(scene.layers));
        let checked: Vec<_> = columns.iter().filter_map(|layout| scene.column(*layout)).chain(layers).collect();
        self.copies.retain(|(layout, _)| checked.iter().any(|values| values.layout() == *layout));
        let mut outcome = Ok(());
        for values in checked {
            let (layout, bytes) = (values.layout(), values.bytes());
            let Some((_, copy)) = self.copies.iter_mut().find(|(known, _)| *known == layout) else {
                self.copies.push((layout, bytes.to_vec()));
                continue;
            };
            let elements = copy.chunks_exact(layout.stride).zip(bytes.chunks_exact(layout.stride));
            let changed = elements.enumerate().filter(|(_, (before, now))| before != now).map(|(object, _)| object);
            if let Some(object) =
                changed.take_while(|object| *object < objects.len()).find(|object| !objects.is_reported(*object))
            {
                outcome = outcome.and(Err(match layout == LAYERS.layout() {
                    true => SceneError::UnreportedChange { object },
                    false => SceneError::UnreportedColumnChange { column: layout.name, object },
                }));
            }
            copy.clear();
            copy.extend_from_slice(bytes);
        }
        outcome
    }
}

/// One object whose material needs transparency: the witness that the scene has such objects. Which of them it is makes
/// no difference.
///
/// While the witness needs transparency, a frame looks at no other object; without a witness, at those that changed.
/// All objects are searched when the witness stops needing it, and without a witness when a material starts to need it.
///
/// An object counts by its material alone, also if it is rejected for another reason or no camera sees it: what is
/// visible changes with every step of a camera, and the processes of a frame should not. Objects beyond the device's
/// room count too: the room depends on the processes, which depend on the witness.
#[derive(Debug, Default)]
pub(super) struct BlendedTracker {
    materials: BlendedMaterials,
    witness: Option<Witness>,
}

#[derive(Clone, Copy, Debug)]
struct Witness {
    object: usize,
    material: Handle<Material>,
}

impl BlendedTracker {
    /// Whether an object of the scene needs transparency. The object table has begun the frame, so it knows which
    /// objects changed: after a failed frame all of them, so nothing has to be invalidated here.
    pub(super) fn update(&mut self, scene: &SceneRef<'_>, objects: &ObjectTable) -> bool {
        let has_started = self.materials.update(scene.assets);
        let materials = &self.materials;
        let count = scene.object_count();
        let witness_of = |object: usize| {
            let material = scene.materials[object];
            materials.contains(material).then_some(Witness { object, material })
        };
        // An object that is not reported is drawn as it was, so its material of that time counts. Those without room
        // are not drawn.
        let is_current = |object: usize| object >= objects.len() || objects.is_reported(object);
        let remains = |witness: Witness| match is_current(witness.object) {
            true => witness_of(witness.object),
            false => materials.contains(witness.material).then_some(witness),
        };
        self.witness = match self.witness {
            _ if materials.count == 0 => None,
            Some(witness) => {
                let next = witness.object.min(count);
                let kept = Some(witness).filter(|witness| witness.object < count).and_then(remains);
                // Objects often stop one after the other, so the search goes on where the last one ended.
                kept.or_else(|| (next..count).chain(0..next).find_map(witness_of))
            }
            None if has_started => (0..count).find_map(witness_of),
            None => {
                let words = (0..objects.changed_word_count()).map(|index| objects.changed_word(index));
                words.flat_map(BitWord::indices).chain(objects.len()..count).find_map(witness_of)
            }
        };
        self.witness.is_some()
    }

    /// Counts an object if the pipeline draws it in half floats because the backend cannot blend floats: the witness,
    /// or another one if that has no room in the table.
    pub(super) fn count_half_floats(&self, scene: &SceneRef<'_>, lacks_float_blending: bool, objects: &ObjectTable) {
        let witness = self.witness.filter(|_| lacks_float_blending);
        let drawn = witness.and_then(|Witness { object, .. }| match object < objects.len() {
            true => Some(object),
            false => (0..objects.len()).find(|object| self.materials.contains(scene.materials[*object])),
        });
        if let Some(object) = drawn {
            objects.scene_issues().count(IssueReason::HalfFloatBlending, object);
        }
    }
}

/// The materials that need transparency.
#[derive(Debug, Default)]
struct BlendedMaterials {
    /// The identity and revision of the materials; `None` before the first update.
    version: Option<(u64, u64)>,
    /// By slot: each material of the assets.
    materials: Vec<Option<Handle<Material>>>,
    /// By slot: whether there is a material that needs transparency. A search looks here for each object.
    is_blended: Vec<bool>,
    /// The number of those that need it.
    count: usize,
}

impl BlendedMaterials {
    /// Updates the materials. Returns whether one that was there before starts to need transparency: objects that have
    /// it need not be reported. No object that is not reported can have one that is new.
    fn update(&mut self, assets: &Assets) -> bool {
        let version = Some((assets.materials.identity(), assets.materials.revision()));
        if self.version == version {
            return false;
        }
        let mut starts = false;
        let mut materials = vec![None; assets.materials.slot_count()];
        let mut is_blended = vec![false; assets.materials.slot_count()];
        for (handle, material) in assets.iter::<Material>() {
            let slot = handle.index() as usize;
            materials[slot] = Some(handle);
            is_blended[slot] = Requirements::needs_transparency(material);
            let was_opaque = self.materials.get(slot) == Some(&Some(handle)) && !self.is_blended[slot];
            starts |= was_opaque && is_blended[slot];
        }
        self.count = is_blended.iter().filter(|is_blended| **is_blended).count();
        (self.version, self.materials, self.is_blended) = (version, materials, is_blended);
        starts
    }

    fn contains(&self, material: Handle<Material>) -> bool {
        let slot = material.index() as usize;
        self.is_blended.get(slot) == Some(&true) && self.materials[slot] == Some(material)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Blend, Camera, Changes, RenderObject, Scene, Topology, Vertex};
    use crate::view::TableLimits;

    /// A scene of one triangle, which this many objects have.
    fn triangles(objects: usize) -> Scene {
        let mut scene = Scene::new();
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let vertices = vertices.map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] });
        let mesh = crate::scene::Mesh::new("triangle", Topology::TriangleList, vertices.to_vec(), vec![0, 1, 2]);
        let mesh = scene.add(mesh.unwrap()).unwrap();
        let material = scene.add(Material::default()).unwrap();
        let object = RenderObject::new(mesh, material, DVec3::ZERO);
        for _ in 0..objects {
            scene.add_object(object).unwrap();
        }
        scene
    }

    #[test]
    fn a_picture_without_width_or_without_height_is_an_error() {
        let mut scene = triangles(1);
        scene.cameras.push(Camera::looking_at("main", DVec3::Z, DVec3::ZERO));
        for (size, is_empty) in [([4, 3], false), ([0, 3], true), ([4, 0], true), ([0, 0], true)] {
            scene.cameras[0].size = size;
            let error = check_scene(&scene.as_scene_ref()).err();
            assert_eq!(matches!(error, Some(FrameError::EmptyTarget { .. })), is_empty, "{size:?}");
        }
    }

    #[test]
    fn changes_that_are_not_reported_are_found_among_the_objects_with_room() {
        const NUMBER: ObjectColumn<u32> = ObjectColumn::new("number");
        let scene = triangles(4);
        let layers = [LayerMask::default(); 4];
        let other_layers = {
            let mut layers = layers;
            layers[0] = LayerMask::NONE;
            layers
        };
        // Two of the objects have room.
        let can_draw = |_: &crate::scene::Mesh| true;
        let within = TableLimits { objects: 2, can_draw: &can_draw, ..TableLimits::NONE };
        let mut table = ObjectTable::default();
        let mut found = |numbers: [u32; 4], layers: &[LayerMask; 4]| {
            let mut check = ChangeCheck::default();
            let mut outcome = |changes: Changes<'_>, numbers: &[u32; 4], layers: &[LayerMask]| {
                let columns = [NUMBER.values(numbers)];
                let frame = SceneRef { columns: &columns, layers, changes, ..scene.as_scene_ref() };
                table.begin_frame_within(&frame, &within);
                table.describe(&frame, 0..table.changed_block_count());
                table.finish();
                let outcome = check.check_columns(&frame, &[NUMBER.layout()], &table);
                table.end_frame();
                outcome
            };
            outcome(Changes::Unknown, &[0; 4], &[LayerMask::default(); 4]).unwrap();
            outcome(Changes::Objects(&[1]), &numbers, layers).err().map(|error| match error {
                SceneError::UnreportedColumnChange { object, .. } => ("a column", object),
                SceneError::UnreportedChange { object } => ("layers", object),
                error => panic!("{error}"),
            })
        };
        assert_eq!(found([0; 4], &layers), None);
        assert_eq!(found([1, 0, 0, 0], &layers), Some(("a column", 0)));
        assert_eq!(found([0, 1, 0, 0], &layers), None, "it is reported");
        assert_eq!(found([0, 0, 1, 1], &layers), None, "they have no room");
        assert_eq!(found([0; 4], &other_layers), Some(("layers", 0)));
    }

    /// The device's room for objects changes after the frame's processes are decided on, in both directions.
    #[test]
    fn a_blended_object_that_gets_room_within_a_frame_is_known() {
        let mut scene = Scene::new();
        let vertices = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let vertices = vertices.map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] });
        let mesh = crate::scene::Mesh::new("triangle", Topology::TriangleList, vertices.to_vec(), vec![0, 1, 2]);
        let mesh = scene.add(mesh.unwrap()).unwrap();
        let opaque = scene.add(Material::default()).unwrap();
        let blended = scene.add(Material { blend: Blend::Alpha, ..Material::default() }).unwrap();
        for object in 0..200 {
            let material = if object == 150 { blended } else { opaque };
            scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
        }
        let unchanged = SceneRef { changes: Changes::Objects(&[]), ..scene.as_scene_ref() };
        let can_draw = |_: &crate::scene::Mesh| true;
        let within = |objects| TableLimits { objects, can_draw: &can_draw, ..TableLimits::NONE };
        let (mut witness, mut table) = (BlendedTracker::default(), ObjectTable::default());
        // Before and after the processes are known: how many objects have room.
        for (before, after) in [(100, 200), (200, 200), (200, 100), (100, 100), (100, 200)] {
            table.begin_frame_within(&unchanged, &within(before));
            let found = witness.update(&unchanged, &table);
            if after != before {
                table.begin_frame_anew(&unchanged, &within(after));
            }
            table.describe(&unchanged, 0..table.changed_block_count());
            table.finish();
            table.end_frame();
            assert_eq!(found, Requirements::any_needs_transparency(&unchanged), "{before} {after}");
        }
        let fewer = SceneRef { materials: &unchanged.materials[..0], ..unchanged };
        let fewer = SceneRef { meshes: &[], orientations: &[], positions: &[], scales: &[], ..fewer };
        table.begin_frame_within(&fewer, &within(200));
        assert!(!witness.update(&fewer, &table), "the object is removed");
    }
}
