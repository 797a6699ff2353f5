//! A backend without a device: it checks the rules between frame and backend, and counts.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::Arc;

use parking_lot::Mutex;

use super::backend_trait::{Backend, BackendExtras, FrameRecorder, ReadBack};
use super::error::BackendError;
use super::requests::{FrameFence, FrameRequest, PassRequest, SceneLimits, TargetMemory, ViewQueue};
use crate::command::{DrawList, DrawState, ItemList};
use crate::process::{Draws, FramePlan, ItemOrder, Pass};
use crate::quality::{Quality, VertexFormat};
use crate::scene::{Assets, Mesh};
use crate::timeline::{Labels, TuningChoice};

/// Draws nothing. It returns an error if the frame breaks one of the rules between frame and backend:
///
/// - each object of the scene is uploaded once, and no others;
/// - each pass of commands is prepared once at most, with a sorted list that has one object per command, all of them in
///   the scene;
/// - each bundle is recorded once, and has 1 to [`DrawList::BATCHES_PER_BUNDLE`] batches;
/// - batches are not empty, draw existing meshes, and follow each other without overlaps and, except between those of
///   static groups, without gaps;
/// - a partial batch draws one object, and fewer triangles than its mesh has;
/// - each pass is finished once, with its bundles in order, when all objects it was prepared with are recorded;
/// - a pass of items has those that are lent, each once at most, in order of their keys if its process says so; its
///   bundles are not empty;
/// - a pass without commands and items has neither batches nor bundles;
/// - the camera of a view is replaced only if it may be;
/// - passes are submitted in the planned order;
/// - fences have places within the frame, in order.
#[derive(Debug, Default)]
pub struct NullBackend;

/// A submitted frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NullSubmission {
    /// In submission order.
    pub passes: Vec<NullPass>,
}

/// A submitted pass: one render process in one view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NullPass {
    /// The render process's name.
    pub process: String,
    /// The view's index.
    pub view: usize,
    /// The number of bundles.
    pub bundles: usize,
    /// The number of items of the engine's own in all bundles.
    pub items: usize,
    /// The number of batches in all bundles.
    pub batches: usize,
    /// The number of objects.
    pub objects: usize,
    /// The number of triangles.
    pub triangles: usize,
    /// The number of lights, for a render process that draws lights.
    pub lights: usize,
}

/// A frame in flight.
#[derive(Debug)]
pub struct NullFrame {
    passes: Vec<Pass>,
    object_count: usize,
    uploaded: Mutex<BTreeSet<usize>>,
    /// The number of objects that each pass was prepared for.
    prepared: Mutex<BTreeMap<Pass, usize>>,
    recorded: Mutex<BTreeSet<(Pass, usize)>>,
    finished: Mutex<BTreeSet<Pass>>,
}

/// A recorded bundle.
#[derive(Debug)]
pub struct NullBundle {
    items: usize,
    batches: usize,
    first_object: usize,
    objects: usize,
    triangles: usize,
}

impl Backend for NullBackend {
    type Submission = NullSubmission;

    fn adapter_name(&self) -> String {
        String::from("none (null backend)")
    }

    fn limits(&self) -> SceneLimits {
        SceneLimits::NONE
    }

    fn check_mesh(&self, _mesh: &Mesh, _vertices: VertexFormat) -> Result<(), BackendError> {
        Ok(())
    }

    fn prepare_pipelines(
        &self,
        _plan: &FramePlan,
        _draws: &[Draws<'_>],
        _states: &[Vec<DrawState>],
        _quality: &Quality,
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<NullFrame, BackendError> {
        request.check_reach()?;
        Ok(NullFrame {
            passes: request.passes.to_vec(),
            object_count: request.objects.len(),
            uploaded: Mutex::default(),
            prepared: Mutex::default(),
            recorded: Mutex::default(),
            finished: Mutex::default(),
        })
    }

    fn target_memory(&self, _frame: &NullFrame) -> TargetMemory {
        TargetMemory::default()
    }

    fn recording_choice(&self, _frame: &NullFrame, _pass: usize, _labels: &Arc<Labels>) -> Option<TuningChoice> {
        None
    }

    fn read_back(&self, _: &mut NullFrame, _view: usize, _target: &str) -> Result<Box<dyn ReadBack>, BackendError> {
        Err(BackendError::CannotReadBack)
    }

    fn submit(
        &self,
        frame: NullFrame,
        queues: Vec<ViewQueue<NullPass>>,
        mut fences: Vec<FrameFence>,
    ) -> Result<NullSubmission, BackendError> {
        let uploaded = frame.uploaded.lock().len();
        ensure(uploaded == frame.object_count, || {
            format!("all objects are uploaded, but {uploaded} of {} are", frame.object_count)
        })?;
        let passes = || queues.iter().flat_map(|queue| &queue.passes);
        let in_order = passes().map(|(pass, _)| pass).eq(&frame.passes);
        ensure(in_order, || "passes are submitted in the planned order".to_owned())?;
        ensure(fences.is_sorted_by_key(|fence| fence.passes), || "fences are in the order of their places".to_owned())?;
        let within = fences.iter().all(|fence| fence.passes <= frame.passes.len());
        ensure(within, || "fences have their places within the frame".to_owned())?;
        FrameFence::set_up_to(frame.passes.len(), &mut fences);
        let passes = queues.into_iter().flat_map(|queue| queue.passes);
        Ok(NullSubmission { passes: passes.map(|(_, pass)| pass).collect() })
    }

    fn extras(&self) -> &dyn BackendExtras {
        self
    }
}

impl BackendExtras for NullBackend {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        None
    }

    fn can_blend_floats(&self) -> bool {
        true
    }
}

impl FrameRecorder for NullBackend {
    type Frame = NullFrame;
    type Part = NullBundle;
    type Commands = NullPass;

    fn objects_epoch(&self, _frame: &NullFrame) -> u64 {
        0
    }

    fn upload_objects(
        &self,
        frame: &NullFrame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        let mut uploaded = frame.uploaded.lock();
        for block in blocks {
            let (first, records) = request.objects.gpu_objects(block);
            for object in first..first + records.len() {
                ensure(object < frame.object_count, || {
                    format!("uploaded objects are in the scene, but object {object} is not")
                })?;
                ensure(uploaded.insert(object), || {
                    format!("each object is uploaded once, but object {object} is uploaded again")
                })?;
            }
        }
        Ok(())
    }

    fn prepare(&self, frame: &NullFrame, request: &PassRequest<'_>) -> Result<(), BackendError> {
        let PassRequest { pass, list, .. } = *request;
        check_items(request)?;
        ensure(frame.passes.contains(&pass), || format!("prepared passes belong to the frame, but {pass:?} does not"))?;
        let before = frame.prepared.lock().insert(pass, list.drawn_count() + list.items.items().len());
        ensure(before.is_none(), || format!("each pass is prepared once, but {pass:?} is prepared again"))?;
        let commands = list.commands().count();
        ensure(commands == 0 || commands == list.objects.len(), || "a list has one object per command".to_owned())?;
        let ordered = list.commands().is_sorted_by_key(|command| (command.key, command.object));
        ensure(ordered, || "commands are sorted by key and object".to_owned())?;
        let drawn = list.batches.iter().flat_map(|batch| &list.objects[batch.first as usize..][..batch.count as usize]);
        let out_of_range = drawn.clone().find(|&&object| object as usize >= frame.object_count);
        ensure(out_of_range.is_none(), || format!("drawn objects are in the scene, but {out_of_range:?} is not"))
    }

    fn part_count(&self, _frame: &NullFrame, pass: &PassRequest<'_>) -> usize {
        pass.list.bundle_count()
    }

    fn record(
        &self,
        frame: &NullFrame,
        &PassRequest { frame: request, pass, list, .. }: &PassRequest<'_>,
        bundles: Range<usize>,
        emit: &mut dyn FnMut(NullBundle),
    ) -> Result<(), BackendError> {
        for bundle in bundles {
            let first_time = frame.recorded.lock().insert((pass, bundle));
            ensure(first_time, || {
                format!("each bundle is recorded once, but bundle {bundle} of {pass:?} is recorded again")
            })?;
            emit(match request.draws[pass.process_index] {
                Draws::Items(_) => record_items(list, bundle)?,
                _ => record_bundle(request.scene.assets, list, bundle)?,
            });
        }
        Ok(())
    }

    fn shares_encoder(&self, _frame: &NullFrame, _pass: usize) -> bool {
        false
    }

    fn finish(
        &self,
        frame: &NullFrame,
        passes: &[PassRequest<'_>],
        bundles: &mut [Vec<NullBundle>],
        emit: &mut dyn FnMut(NullPass),
    ) -> Result<(), BackendError> {
        passes.iter().zip(bundles).try_for_each(|(pass, bundles)| finish_pass(frame, pass, bundles).map(&mut *emit))
    }
}

fn finish_pass(
    frame: &NullFrame,
    &PassRequest { frame: request, pass, list, .. }: &PassRequest<'_>,
    bundles: &[NullBundle],
) -> Result<NullPass, BackendError> {
    ensure(frame.finished.lock().insert(pass), || {
        format!("each pass is finished once, but {pass:?} is finished again")
    })?;
    let process = &request.plan.processes()[pass.process_index].name;
    let draws_items = matches!(request.draws[pass.process_index], Draws::Items(_));
    if !draws_items && !matches!(request.draws[pass.process_index], Draws::Commands(_)) {
        let has_none = bundles.is_empty() && list.draw_count() == 0;
        ensure(has_none, || format!("a pass without commands has no bundles, but one of {process:?} has"))?;
    }
    let first_objects = (0..list.bundle_count()).map(|bundle| match draws_items {
        true => list.items.bundle_range(bundle).start,
        false => list.bundle(bundle)[0].first as usize,
    });
    let in_order = bundles.iter().zip(first_objects).all(|(bundle, first)| bundle.first_object == first);
    ensure(in_order, || "bundles are finished in order".to_owned())?;
    let objects = bundles.iter().map(|bundle| bundle.objects).sum();
    let items = bundles.iter().map(|bundle| bundle.items).sum();
    let prepared = frame.prepared.lock().get(&pass).copied().unwrap_or(0);
    let recorded: usize = objects + items;
    ensure(recorded == prepared, || format!("all prepared objects are recorded, but {recorded} of {prepared} are"))?;
    Ok(NullPass {
        process: process.clone(),
        view: pass.view_index,
        bundles: bundles.len(),
        items,
        batches: bundles.iter().map(|bundle| bundle.batches).sum(),
        objects,
        triangles: bundles.iter().map(|bundle| bundle.triangles).sum(),
        lights: match &request.draws[pass.process_index] {
            Draws::Lights(lights) => request.light_tables[pass.view_index].range(lights.class).len(),
            _ => 0,
        },
    })
}

/// # Errors
/// If a pass has items that it cannot draw, or in another order than its process asks for.
fn check_items(request: &PassRequest<'_>) -> Result<(), BackendError> {
    let items = request.list.items.items();
    let Some(lent) = request.items() else {
        return ensure(items.is_empty(), || "only a pass whose process draws items has any".to_owned());
    };
    let in_range = items.iter().all(|item| (*item as usize) < lent.keys.len());
    ensure(in_range, || format!("items are among the {} of {:?} that are lent", lent.keys.len(), lent.process))?;
    let sorts = matches!(&request.frame.draws[request.pass.process_index], Draws::Items(draws) if draws.order == ItemOrder::ByKey);
    let rank = |item: &u32| (if sorts { lent.keys[*item as usize] } else { 0 }, *item);
    let in_order = items.is_sorted_by(|one, next| rank(one) < rank(next));
    ensure(in_order, || format!("items of {:?} are drawn in order, and each once", lent.process))
}

fn record_items(list: &DrawList, bundle: usize) -> Result<NullBundle, BackendError> {
    let range = list.items.bundle_range(bundle);
    let within = (1..=ItemList::ITEMS_PER_BUNDLE).contains(&range.len());
    ensure(within, || format!("a bundle has 1 to {} items, but one has {}", ItemList::ITEMS_PER_BUNDLE, range.len()))?;
    Ok(NullBundle { items: range.len(), batches: 0, first_object: range.start, objects: 0, triangles: 0 })
}

fn record_bundle(assets: &Assets, list: &DrawList, bundle: usize) -> Result<NullBundle, BackendError> {
    let batches = list.bundle(bundle);
    let within = (1..=DrawList::BATCHES_PER_BUNDLE).contains(&batches.len());
    ensure(within, || {
        format!("a bundle has 1 to {} batches, but one has {}", DrawList::BATCHES_PER_BUNDLE, batches.len())
    })?;
    // Objects of static groups that the view does not execute lie between those of others.
    let may_have_gaps = bundle < list.static_groups().bundle_count();
    let first_object = batches[0].first as usize;
    let (mut end, mut objects, mut triangles) = (batches[0].first, 0, 0);
    for (index, batch) in list.bundle_range(bundle).zip(batches) {
        let follows = batch.first == end || may_have_gaps && batch.first > end;
        ensure(follows && batch.count > 0, || {
            format!("batches have no gaps or overlaps, but there is one at object {end}")
        })?;
        let Some((_, mesh)) = assets.meshes.get_with_revision(batch.mesh) else {
            return Err(BackendError::BrokenRule {
                rule: format!("a batch draws an existing mesh, but slot {} is empty", batch.mesh),
            });
        };
        let mesh_triangles = mesh.triangle_count_of(batch.state.level_of_detail());
        triangles += match list.remaining(index) {
            None => mesh_triangles * batch.count as usize,
            Some(remaining) => {
                let holds = batch.count == 1 && remaining.len() < mesh_triangles * 3;
                ensure(holds, || {
                    format!("a partial batch draws some triangles of one object, but batch {index} does not")
                })?;
                remaining.len() / 3
            }
        };
        end = batch.first + batch.count;
        objects += batch.count as usize;
    }
    Ok(NullBundle { items: 0, batches: batches.len(), first_object, objects, triangles })
}

fn ensure(holds: bool, rule: impl FnOnce() -> String) -> Result<(), BackendError> {
    if holds { Ok(()) } else { Err(BackendError::BrokenRule { rule: rule() }) }
}
