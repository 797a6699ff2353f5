//! How a frame begins: what is uploaded, kept or made, and which way each pass takes.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::error_scope::{caught, checked};
use super::kept::{ProcessGroup, Surroundings};
use super::subdivided_mesh::SubdividedMesh;
use super::{Record, WgpuBackend, WgpuFrame};
use crate::backend::{BackendError, FrameRequest};
use crate::command::DrawList;
use crate::process::{Access, Pass};
use crate::scene::Mesh;

impl WgpuBackend {
    /// Makes what all passes of a frame need.
    ///
    /// # Errors
    /// If the device cannot hold or make it.
    pub(super) fn start(&self, request: &FrameRequest<'_>) -> Result<WgpuFrame, BackendError> {
        let FrameRequest { plan, draws, views, scene, rejections, .. } = *request;
        let vertices = request.quality.vertices;
        self.check_device()?;
        let pipelines = self.pipelines(request)?;
        let light_meshes = self.light_meshes(draws)?;
        self.subdivisions.begin(scene.assets);
        let assets = checked(&self.device, "meshes, materials and textures", || {
            self.assets.lock().update(&self.device, &self.uploads, &self.layouts, scene.assets, vertices, rejections)
        })??;
        let targets = checked(&self.device, "targets", || self.targets.lock().update(&self.device, plan, views))??;
        checked(&self.device, "the frame's buffers", || {
            let mut buffers = self.buffers.take();
            buffers.begin(&self.device, &self.uploads, &self.layouts, request)?;
            if let Some(timing) = &self.timing {
                buffers.begin_timestamps(&self.device, request, timing.times_raw)?;
            }
            // Frames are counted, and nothing is ordered by it.
            let number = self.frames.fetch_add(1, Ordering::Relaxed);
            let background = scene.background.as_dvec3().to_array();
            let mut frame = WgpuFrame { number, pipelines, assets, light_meshes, targets, background, buffers };
            self.begin_passes(&mut frame, request);
            Ok(frame)
        })?
    }

    /// A lost device takes everything without a word, except to finish a bundle; and there may be none in the frame.
    ///
    /// # Errors
    /// If the device is lost.
    fn check_device(&self) -> Result<(), BackendError> {
        let finish = || {
            let descriptor = wgpu::RenderBundleEncoderDescriptor {
                color_formats: &[Some(wgpu::TextureFormat::Rgba8Unorm)],
                sample_count: 1,
                ..wgpu::RenderBundleEncoderDescriptor::default()
            };
            self.device.create_render_bundle_encoder(&descriptor).finish(&wgpu::RenderBundleDescriptor::default())
        };
        caught("the device", finish).map(|_| ())
    }

    /// Makes or finds the bindings of each pass, and chooses its way.
    fn begin_passes(&self, frame: &mut WgpuFrame, request: &FrameRequest<'_>) {
        let (offered, mut may_try) = (self.ways.offered(), true);
        let WgpuFrame { number, pipelines, assets, targets, buffers, .. } = frame;
        let (passes, parameters) = buffers.passes_mut();
        for pass in passes {
            let Pass { process, view } = pass.pass;
            let pipelines = &pipelines[process];
            let sampled = |(name, access): &(String, Access)| match access {
                Access::Sample => targets.find(view, name).map(|target| &target.view),
                Access::SampleLayers(views) => targets.find_layered(*views, name).map(|(_, array)| array),
                _ => None,
            };
            let sampled = request.plan.processes()[process].declaration.accesses.iter().filter_map(sampled);
            let parameters = pass.parameters.and_then(|(offset, length)| parameters.binding(offset, length));
            let before = pass.process_group.take();
            pass.process_group = ProcessGroup::follow(before, &self.device, pipelines, parameters, sampled);

            let mut choice = (0, false);
            if offered.len() > 1 && pass.drawn_place.is_some() {
                choice = pipelines.with_chooser(view, &self.ways, |one| one.choose(offered, *number, &mut may_try));
            }
            pass.take(offered[choice.0], choice.0, choice.1);
            let keeps = pass.drawn_place.is_some() && pass.way.record == Record::Kept;
            if let Some(frame_group) = pass.frame_group.as_ref().filter(|_| keeps) {
                pass.kept.begin(Surroundings {
                    frame_group: frame_group.clone(),
                    process_group: pass.process_group.as_ref().map(|kept| kept.group.clone()),
                    assets: Arc::clone(assets),
                    pipelines: Arc::clone(pipelines),
                });
            }
        }
    }

    /// Finds or makes the subdivided meshes that batches draw.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn subdivide(
        &self,
        frame: &WgpuFrame,
        request: &FrameRequest<'_>,
        list: &DrawList,
    ) -> Result<(), BackendError> {
        let vertices = request.quality.vertices;
        let make = |mesh: Mesh| SubdividedMesh::new(&self.device, &self.uploads, &mesh, vertices);
        self.subdivisions.collect(request, list, vertices, make, |key, mesh| {
            frame.buffers.subdivided().write().insert(key, mesh);
        })
    }
}
