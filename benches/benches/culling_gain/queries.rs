//! Occlusion queries on the device, as Coherent Hierarchical Culling uses them (Bittner et al. 2004, Mattausch et al.
//! 2008).
//!
//! A frame draws the objects that are not known to be hidden, and then tests bounding boxes against the depths that
//! they left. Objects that are hidden are tested in every frame, several by one query, since most of them stay hidden.
//! Those that are drawn are tested once in some frames. Results are read where they cost no wait: [`FRAMES_LATE`]
//! frames later.

use std::collections::VecDeque;
use std::error::Error;
use std::ops::Range;
use std::sync::mpsc::{self, Receiver};

use drawloom::wgpu;

/// The frames between a query and the first frame that uses its result. The device draws a frame while the CPU records
/// the next, so a result of the frame before is not there yet. The benchmark waits for each frame, and still takes no
/// result sooner.
pub const FRAMES_LATE: u64 = 2;

/// The frames between two tests of an object that is drawn.
pub const RETEST_FRAMES: u64 = 8;

/// The hidden objects of a query at most, neighbours in the scene.
const GROUP: usize = 16;

/// The number of buffers that results are read from: of this frame, and of those whose results are late.
const READBACKS: usize = FRAMES_LATE as usize + 1;

/// What is known of an object.
#[derive(Clone, Copy, Default)]
struct Knowledge {
    is_hidden: bool,
    /// The latest frame that had it in the frustum.
    seen: u64,
}

/// The queries of a frame.
#[derive(Default)]
pub struct QueryBatch {
    frame: u64,
    /// Tested objects.
    pub tested: Vec<u32>,
    /// The part of `tested` that each query draws.
    pub queries: Vec<Range<u32>>,
    /// Whether each query's boxes are visible, where the device does not answer.
    answers: Option<Vec<bool>>,
}

/// Knows which objects are hidden, and chooses those to test.
pub struct QueryScheduler {
    /// The latest frame. The first is 2, so that no object was in the frustum of the one before.
    frame: u64,
    objects: Vec<Knowledge>,
    /// Memory for the drawn objects that a frame tests.
    retested: Vec<u32>,
}

impl QueryScheduler {
    pub fn new(objects: usize) -> Self {
        Self { frame: 1, objects: vec![Knowledge::default(); objects], retested: Vec::new() }
    }

    /// Begins a frame: divides the objects in the frustum into those to draw and those to test. `is_near` says of an
    /// object whose box the near plane may cut that it is always drawn.
    pub fn begin_frame(
        &mut self,
        in_frustum: &[u32],
        is_near: impl Fn(u32) -> bool,
        drawn: &mut Vec<u32>,
        batch: &mut QueryBatch,
    ) {
        self.frame += 1;
        batch.frame = self.frame;
        batch.answers = None;
        batch.tested.clear();
        batch.queries.clear();
        let Self { objects, retested, .. } = self;
        retested.clear();
        for &object in in_frustum {
            let known = &mut objects[object as usize];
            let is_new = known.seen != self.frame - 1;
            known.seen = self.frame;
            // What was known of an object that was out of the frustum holds no more.
            known.is_hidden = known.is_hidden && !is_new && !is_near(object);
            if known.is_hidden {
                batch.tested.push(object);
                continue;
            }
            drawn.push(object);
            let is_due = (self.frame + u64::from(object)).is_multiple_of(RETEST_FRAMES);
            if (is_new || is_due) && !is_near(object) {
                retested.push(object);
            }
        }
        let hidden = batch.tested.len() as u32;
        let groups = (0..hidden).step_by(GROUP).map(|first| first..hidden.min(first + GROUP as u32));
        batch.queries.extend(groups.chain((0..retested.len() as u32).map(|index| hidden + index..hidden + index + 1)));
        batch.tested.extend_from_slice(retested);
    }

    /// Takes over the results of a batch.
    fn receive(&mut self, batch: &QueryBatch, is_visible: impl Fn(usize) -> bool) {
        for (index, query) in batch.queries.iter().enumerate() {
            let is_visible = is_visible(index);
            for &object in &batch.tested[query.start as usize..query.end as usize] {
                self.objects[object as usize].is_hidden = !is_visible;
            }
        }
    }
}

impl QueryBatch {
    /// Answers the queries in the device's place.
    pub fn answer(&mut self, is_visible: impl Fn(u32) -> bool) {
        let any_visible = |query: &Range<u32>| {
            self.tested[query.start as usize..query.end as usize].iter().any(|&object| is_visible(object))
        };
        self.answers = Some(self.queries.iter().map(any_visible).collect());
    }
}

/// Query sets, and the buffers that results are read from.
pub struct QueryDevice {
    device: wgpu::Device,
    sets: Vec<wgpu::QuerySet>,
    resolved: wgpu::Buffer,
    free: Vec<wgpu::Buffer>,
    in_flight: VecDeque<InFlight>,
    /// Of batches that were received.
    spare: Vec<QueryBatch>,
}

struct InFlight {
    batch: QueryBatch,
    results: wgpu::Buffer,
    mapped: Receiver<Result<(), wgpu::BufferAsyncError>>,
}

/// The bytes of a result.
const RESULT_BYTES: usize = wgpu::QUERY_SIZE as usize;

impl QueryDevice {
    /// For this many objects.
    pub fn new(device: &wgpu::Device, objects: usize) -> Self {
        let set = |_| {
            device.create_query_set(&wgpu::QuerySetDescriptor {
                label: None,
                ty: wgpu::QueryType::Occlusion,
                count: wgpu::QUERY_SET_MAX_QUERIES,
            })
        };
        let buffer = |usage| {
            let size = (objects * RESULT_BYTES) as u64;
            device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
        };
        Self {
            device: device.clone(),
            sets: (0..objects.div_ceil(wgpu::QUERY_SET_MAX_QUERIES as usize)).map(set).collect(),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            free: (0..READBACKS).map(|_| buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST)).collect(),
            in_flight: VecDeque::new(),
            spare: Vec::new(),
        }
    }

    /// Hands over all results that have arrived and are late enough for the frame that `scheduler` begins next. Does
    /// not wait.
    ///
    /// # Errors
    /// Returns an error if the device is lost.
    pub fn receive(&mut self, scheduler: &mut QueryScheduler) -> Result<(), Box<dyn Error>> {
        self.device.poll(wgpu::PollType::Poll)?;
        while let Some(oldest) = self.in_flight.front()
            && scheduler.frame + 1 >= oldest.batch.frame + FRAMES_LATE
            && let Ok(mapped) = oldest.mapped.try_recv()
        {
            mapped?;
            let Some(InFlight { batch, results, .. }) = self.in_flight.pop_front() else { break };
            {
                let bytes = results.slice(..batch_bytes(&batch)).get_mapped_range()?;
                let counts: &[u64] = bytemuck::cast_slice(&bytes);
                scheduler.receive(&batch, |query| batch.answers.as_ref().map_or(counts[query] > 0, |all| all[query]));
            }
            results.unmap();
            self.free.push(results);
            self.spare.push(batch);
        }
        Ok(())
    }

    /// Memory for the next batch.
    pub fn new_batch(&mut self) -> QueryBatch {
        self.spare.pop().unwrap_or_default()
    }

    /// Encodes the queries of a batch: `begin` begins a pass with a query set, and `draw` draws the boxes of some of
    /// the tested objects.
    pub fn encode<'a>(
        &'a self,
        encoder: &mut wgpu::CommandEncoder,
        batch: &QueryBatch,
        begin: impl for<'e> Fn(&'e mut wgpu::CommandEncoder, &'a wgpu::QuerySet) -> wgpu::RenderPass<'e>,
        draw: impl Fn(&mut wgpu::RenderPass<'_>, Range<u32>),
    ) {
        // Without a free buffer, results could not be read.
        let Some(results) = self.free.last().filter(|_| !batch.queries.is_empty()) else { return };
        let parts = batch.queries.chunks(wgpu::QUERY_SET_MAX_QUERIES as usize);
        for (part, (queries, set)) in parts.zip(&self.sets).enumerate() {
            let mut pass = begin(encoder, set);
            for (index, query) in (0..).zip(queries) {
                pass.begin_occlusion_query(index);
                draw(&mut pass, query.clone());
                pass.end_occlusion_query();
            }
            drop(pass);
            let offset = (part * wgpu::QUERY_SET_MAX_QUERIES as usize * RESULT_BYTES) as u64;
            encoder.resolve_query_set(set, 0..queries.len() as u32, &self.resolved, offset);
        }
        encoder.copy_buffer_to_buffer(&self.resolved, 0, results, 0, batch_bytes(batch));
    }

    /// Requests the results of a batch whose commands have been submitted.
    pub fn request(&mut self, batch: QueryBatch) {
        let is_encoded = !batch.queries.is_empty();
        let Some(results) = self.free.pop_if(|_| is_encoded) else {
            self.spare.push(batch);
            return;
        };
        let (sender, mapped) = mpsc::channel();
        results.slice(..batch_bytes(&batch)).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver is gone with its renderer.
            let _ = sender.send(result);
        });
        self.in_flight.push_back(InFlight { batch, results, mapped });
    }

    /// The batch that was requested last.
    pub fn latest(&mut self) -> Option<&mut QueryBatch> {
        self.in_flight.back_mut().map(|in_flight| &mut in_flight.batch)
    }
}

fn batch_bytes(batch: &QueryBatch) -> u64 {
    (batch.queries.len() * RESULT_BYTES) as u64
}
