//! Recording: batches into bundles or passes, bundles into passes.

use std::collections::HashMap;
use std::mem;
use std::ops::Range;

use wgpu::util::RenderEncoder;

use super::arguments::Arguments;
use super::assets::{AssetSnapshot, MeshRange};
use super::frame::{Part, WgpuFrame, WgpuPart};
use super::frame_pass::FramePass;
use super::pipelines::fixed_state;
use super::subdivided_mesh::SubdividedMesh;
use super::ways::{Record, Share};
use crate::backend::subdivisions::{SubdividedMeshes, no_such_mesh};
use crate::backend::{BackendError, FrameRequest};
use crate::command::DrawState;
use crate::command::{Batch, DrawList};
use crate::process::{Access, ClearColor, Draws, Pass, RawPass, RawPassResources};

/// An earlier frame's bundle at a place of a pass that has one encoder, if that way is taken and there is one.
pub(super) fn kept(frame: &WgpuFrame, index: usize, list: &DrawList, place: usize) -> Option<WgpuPart> {
    let pass = frame.pass(index);
    if !keeps_bundle(pass, list, place) || pass.way.encoders(list.bundle_count()) > 1 {
        return None;
    }
    let bundle = pass.kept.find(place, list.bundle(place), &frame.buffers.subdivided().read())?;
    pass.spent.count_bundle(true);
    Some(WgpuPart(Part::Bundle(bundle)))
}

/// One bundle of a pass: an earlier frame's if that way is taken and there is one, or a new one.
///
/// # Errors
/// If what a batch needs was not made before: an error of Drawloom's own.
pub(super) fn bundle(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    index: usize,
    list: &DrawList,
    place: usize,
) -> Result<wgpu::RenderBundle, BackendError> {
    let (pass, batches) = (frame.pass(index), list.bundle(place));
    let subdivided = frame.buffers.subdivided().read();
    if !keeps_bundle(pass, list, place) {
        pass.spent.count_bundle(false);
        return new_bundle(device, frame, pass, list, place, &subdivided);
    }
    let kept = pass.kept.find(place, batches, &subdivided);
    pass.spent.count_bundle(kept.is_some());
    if let Some(kept) = kept {
        return Ok(kept);
    }
    let bundle = new_bundle(device, frame, pass, list, place, &subdivided)?;
    pass.kept.keep(place, batches, &subdivided, bundle.clone());
    Ok(bundle)
}

/// Whether the bundle at a place is one to be kept for later frames: in those, what remains of a partial batch may be something else.
fn keeps_bundle(pass: &FramePass, list: &DrawList, place: usize) -> bool {
    pass.way.record == Record::Kept && list.bundle_is_whole(place)
}

fn new_bundle(
    device: &wgpu::Device,
    frame: &WgpuFrame,
    pass: &FramePass,
    list: &DrawList,
    place: usize,
    subdivided: &SubdividedMeshes<SubdividedMesh>,
) -> Result<wgpu::RenderBundle, BackendError> {
    let pipelines = frame.pipelines(pass.pass);
    let by_state = pipelines.prepared();
    let mut encoder = device.create_render_bundle_encoder(&pipelines.bundle_descriptor(&pass.label));
    let indices = pass.indices.read();
    let prepared = Prepared { frame, pass, list, by_state: &by_state, subdivided, indices: indices.buffer() };
    let first = place * DrawList::BATCHES_PER_BUNDLE;
    let batches = first..first + list.bundle(place).len();
    prepared.draw(&mut encoder, batches, |encoder, run| prepared.draw_each(encoder, &list.batches[run]))?;
    Ok(encoder.finish(&wgpu::RenderBundleDescriptor { label: Some(&pass.label) }))
}

/// What batches are drawn with.
struct Prepared<'a> {
    frame: &'a WgpuFrame,
    pass: &'a FramePass,
    list: &'a DrawList,
    by_state: &'a HashMap<DrawState, wgpu::RenderPipeline>,
    subdivided: &'a SubdividedMeshes<SubdividedMesh>,
    /// Of the triangles that remain of partial batches.
    indices: Option<&'a wgpu::Buffer>,
}

impl<'a> Prepared<'a> {
    /// Draws the batches at some places of the list. Whatever stays the same from one batch to the next is set once. Those of one
    /// state whose meshes lie in the arenas, and are drawn whole, are left to `draw_run`.
    ///
    /// # Errors
    /// If what a batch needs was not made before: an error of Drawloom's own.
    fn draw<E: RenderEncoder<'a>>(
        &self,
        encoder: &mut E,
        places: Range<usize>,
        mut draw_run: impl FnMut(&mut E, Range<usize>) -> Result<(), BackendError>,
    ) -> Result<(), BackendError> {
        self.set_groups(encoder);
        self.set_arenas(encoder);
        let mut start = places.start;
        for run in self.list.batches[places].chunk_by(|one, next| one.state == next.state) {
            let state = run[0].state;
            let pipeline = self.by_state.get(&state.pipeline_state());
            encoder.set_pipeline(pipeline.ok_or_else(|| broken("a pipeline is made before it is used"))?);
            let end = start + run.len();
            if state.subdivision_level() > 0 {
                self.draw_subdivided(encoder, run)?;
                self.set_arenas(encoder);
            } else if self.list.is_whole() {
                draw_run(encoder, start..end)?;
            } else {
                self.draw_in_parts(encoder, start..end, &mut draw_run)?;
            }
            start = end;
        }
        Ok(())
    }

    /// Draws batches of one state: those whose meshes are drawn whole, run by run, by `draw_run`.
    fn draw_in_parts<E: RenderEncoder<'a>>(
        &self,
        encoder: &mut E,
        places: Range<usize>,
        draw_run: &mut impl FnMut(&mut E, Range<usize>) -> Result<(), BackendError>,
    ) -> Result<(), BackendError> {
        let mut whole = places.start..places.start;
        let mut has_own_indices = false;
        for place in places {
            let Some(remaining) = self.list.remaining(place) else {
                whole.end = place + 1;
                continue;
            };
            if !whole.is_empty() {
                if mem::take(&mut has_own_indices) {
                    self.set_arena_of_indices(encoder);
                }
                draw_run(encoder, whole)?;
            }
            whole = place + 1..place + 1;
            if remaining.is_empty() {
                continue;
            }
            if !mem::replace(&mut has_own_indices, true) {
                let indices = self.indices.ok_or_else(|| broken("indices are uploaded before they are drawn with"))?;
                encoder.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            }
            let batch = &self.list.batches[place];
            let base_vertex = mesh_of(&self.frame.assets, batch)?.base_vertex;
            encoder.draw_indexed(remaining, base_vertex, batch.first..batch.first + batch.count);
        }
        if has_own_indices {
            self.set_arena_of_indices(encoder);
        }
        if whole.is_empty() { Ok(()) } else { draw_run(encoder, whole) }
    }

    fn draw_each(&self, encoder: &mut impl RenderEncoder<'a>, run: &[Batch]) -> Result<(), BackendError> {
        for batch in run {
            let mesh = mesh_of(&self.frame.assets, batch)?;
            let indices = mesh.first_index..mesh.first_index + mesh.index_count;
            encoder.draw_indexed(indices, mesh.base_vertex, batch.first..batch.first + batch.count);
        }
        Ok(())
    }

    fn draw_subdivided(&self, encoder: &mut impl RenderEncoder<'a>, run: &[Batch]) -> Result<(), BackendError> {
        for batch in run {
            let mesh = self.subdivided.get(&(batch.mesh, batch.state.subdivision_level()));
            let mesh = mesh.ok_or_else(|| broken("a mesh is subdivided before it is drawn"))?;
            let mesh = &mesh.drawn;
            encoder.set_vertex_buffer(0, Some(mesh.vertices.slice(..)));
            encoder.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
            encoder.draw_indexed(0..mesh.index_count, 0, batch.first..batch.first + batch.count);
        }
        Ok(())
    }

    fn set_groups(&self, encoder: &mut impl RenderEncoder<'a>) {
        encoder.set_bind_group(0, self.pass.frame_group.as_ref(), &[]);
        encoder.set_bind_group(1, Some(&self.frame.assets.group), &[]);
        if let Some(kept) = &self.pass.process_group {
            encoder.set_bind_group(2, Some(&kept.group), &[]);
        }
    }

    fn set_arenas(&self, encoder: &mut impl RenderEncoder<'a>) {
        encoder.set_vertex_buffer(0, Some(self.frame.assets.vertices.slice(..)));
        self.set_arena_of_indices(encoder);
    }

    fn set_arena_of_indices(&self, encoder: &mut impl RenderEncoder<'a>) {
        encoder.set_index_buffer(self.frame.assets.indices.slice(..), wgpu::IndexFormat::Uint32);
    }
}

/// Encodes a pass, or a part of it: clears its targets if it is the first, and draws some bundles' batches without a bundle.
///
/// # Errors
/// If what a batch needs was not made before: an error of Drawloom's own.
pub(super) fn batches(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    share: Share,
    list: &DrawList,
    bundles: Range<usize>,
) -> Result<(), BackendError> {
    let pass = frame.pass(index);
    let by_state = frame.pipelines(pass.pass).prepared();
    let subdivided = frame.buffers.subdivided().read();
    let arguments = pass.arguments.read();
    let indices = pass.indices.read();
    let prepared =
        Prepared { frame, pass, list, by_state: &by_state, subdivided: &subdivided, indices: indices.buffer() };
    let (first, end) = (bundles.start * DrawList::BATCHES_PER_BUNDLE, bundles.end * DrawList::BATCHES_PER_BUNDLE);
    let places = first..end.min(list.batches.len());
    let mut render_pass = begin_pass(encoder, frame, request, index, share);
    if places.is_empty() {
        return Ok(());
    }
    if pass.way.record != Record::Indirect {
        return prepared.draw(&mut render_pass, places, |encoder, run| prepared.draw_each(encoder, &list.batches[run]));
    }
    let buffer = arguments.as_ref().and_then(|arguments| arguments.on_device.buffer());
    let buffer = buffer.ok_or_else(|| broken("arguments are uploaded before they are drawn with"))?;
    prepared.draw(&mut render_pass, places, |render_pass, run| {
        for start in run.clone().step_by(MOST_INDIRECT) {
            let offset = start as u64 * Arguments::STRIDE;
            render_pass.multi_draw_indexed_indirect(buffer, offset, (run.end - start).min(MOST_INDIRECT) as u32);
        }
        Ok(())
    })
}

/// Draws of one indirect call: as many as every Vulkan device that has such calls allows.
const MOST_INDIRECT: usize = 65_535;

/// Encodes a pass, or a part of it: clears its targets if it is the first, and replays bundles.
pub(super) fn bundles<'a>(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    share: Share,
    bundles: impl IntoIterator<Item = &'a wgpu::RenderBundle>,
) {
    begin_pass(encoder, frame, request, index, share).execute_bundles(bundles);
}

/// Encodes a pass that draws lights, or a full-screen triangle.
///
/// # Errors
/// If what the pass needs was not made before: an error of Drawloom's own.
pub(super) fn fixed(
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
) -> Result<(), BackendError> {
    let pass = frame.pass(index);
    let Pass { process, view } = pass.pass;
    let draws = &request.draws[process];
    let by_state = frame.pipelines(pass.pass).prepared();
    let pipeline = fixed_state(draws).and_then(|state| by_state.get(&state));
    let pipeline = pipeline.ok_or_else(|| broken("a pipeline is made before it is used"))?;
    let (list, subdivided) = (DrawList::default(), SubdividedMeshes::new());
    let prepared = Prepared { frame, pass, list: &list, by_state: &by_state, subdivided: &subdivided, indices: None };
    let mut render_pass = begin_pass(encoder, frame, request, index, Share::WHOLE);
    render_pass.set_pipeline(pipeline);
    prepared.set_groups(&mut render_pass);
    match draws {
        Draws::Lights(draws) => {
            let meshes = frame.light_meshes.as_ref();
            let meshes = meshes.ok_or_else(|| broken("the geometry of lights is made before it is drawn"))?;
            let lights = request.lights[view].range(draws.class);
            if !lights.is_empty() {
                render_pass.set_vertex_buffer(0, meshes.corners.slice(..));
                render_pass.draw(meshes.range(draws.class.kind), lights);
            }
        }
        _ => render_pass.draw(0..3, 0..1),
    }
    Ok(())
}

/// Lets a raw pass encode itself.
///
/// # Errors
/// What the pass reports.
pub(super) fn raw(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    raw: &dyn RawPass,
) -> Result<(), BackendError> {
    let &FramePass { pass, timed_place, .. } = frame.pass(index);
    let textures = |name: &str| frame.targets.find(pass.view, name).map(|target| &target.texture);
    let layered = |kind, name: &str| frame.targets.find_layered(kind, name).map(|(texture, _)| texture);
    let size = request.views[pass.view].camera.size;
    let resources = RawPassResources { device, view: pass.view, size, textures: &textures, layered: &layered };
    let times = timed_place.and_then(|place| frame.buffers.timestamps()?.of_pass(place));
    if let Some((set, [began, _])) = times {
        encoder.write_timestamp(set, began);
    }
    raw.encode(encoder, &resources).map_err(BackendError::RawPass)?;
    if let Some((set, [_, ended])) = times {
        encoder.write_timestamp(set, ended);
    }
    Ok(())
}

/// Where the mesh of a batch lies in the arenas.
///
/// # Errors
/// If there is no such mesh: an error of Drawloom's own.
pub(super) fn mesh_of(assets: &AssetSnapshot, batch: &Batch) -> Result<MeshRange, BackendError> {
    let mesh = assets.meshes.get(batch.mesh as usize).copied().flatten();
    mesh.ok_or_else(no_such_mesh)
}

/// No device has more colour targets.
const MOST_COLORS: usize = 8;

/// Begins a pass. Only the first of several that draw into the same targets clears what is to be cleared.
fn begin_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    frame: &WgpuFrame,
    request: &FrameRequest<'_>,
    index: usize,
    share: Share,
) -> wgpu::RenderPass<'a> {
    let pass = frame.pass(index);
    let Pass { process, view } = pass.pass;
    let declaration = &request.plan.processes()[process].declaration;
    let mut colors = [const { None }; MOST_COLORS];
    let mut count = 0;
    for (color, (name, clear)) in colors.iter_mut().zip(declaration.colors()) {
        let clear = clear.filter(|_| share.is_first);
        *color = frame.targets.find(view, name).map(|target| wgpu::RenderPassColorAttachment {
            view: &target.view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: load(clear, frame.background), store: wgpu::StoreOp::Store },
        });
        count += 1;
    }
    let depth = declaration.depth().and_then(|(name, access)| {
        let target = frame.targets.find(view, name)?;
        let is_kept = access == Access::DrawDepth || !share.is_first;
        // Reversed: 0 is infinitely far away.
        let load = if is_kept { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(0.0) };
        Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target.view,
            depth_ops: access.writes().then_some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        })
    });
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(&pass.label),
        color_attachments: &colors[..count],
        depth_stencil_attachment: depth,
        timestamp_writes: pass.timed_place.and_then(|place| frame.buffers.timestamps()?.of_share(place, share)),
        ..wgpu::RenderPassDescriptor::default()
    })
}

fn broken(rule: &str) -> BackendError {
    BackendError::BrokenRule { rule: rule.to_owned() }
}

fn load(clear: Option<ClearColor>, background: [f64; 3]) -> wgpu::LoadOp<wgpu::Color> {
    let [r, g, b, a] = match clear {
        None => return wgpu::LoadOp::Load,
        Some(ClearColor::Value(value)) => value,
        // Past this a half float would be infinite.
        Some(ClearColor::Background) => {
            let [r, g, b] = background.map(|radiance| radiance.min(60_000.0));
            [r, g, b, 1.0]
        }
    };
    wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
}
