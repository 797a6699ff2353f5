//! A renderer in plain wgpu, on one thread: what an engine writes by hand for a scene that stands still. It culls
//! objects by the frustum and for occlusion, and draws an instanced draw for each mesh.

use std::error::Error;
use std::time::Instant;

use drawloom::glam::DVec3;
use drawloom::scene::SceneRef;
use drawloom::view::RenderView;
use drawloom_benches::backends::BackendName;
use drawloom_benches::stopwatch::FrameTime;

use crate::coarse_depth::CoarseDepth;
use crate::device::Device;
use crate::queries::{QueryDevice, QueryScheduler};
use crate::walk::Walk;

/// How the renderer finds hidden objects.
pub enum Occlusion {
    None,
    /// This crate's coarse depth buffer.
    CoarseDepth(Box<CoarseDepth>),
    Queries(Box<Queries>),
}

/// Queries on a device.
pub struct Queries {
    scheduler: QueryScheduler,
    device: QueryDevice,
    /// Answers on noop, whose queries find nothing: a depth buffer whose tiles are pixels.
    answers: Option<CoarseDepth>,
}

pub struct ByHand {
    world: Walk,
    occlusion: Occlusion,
    device: Device,
    spheres: Vec<Sphere>,
    in_frustum: Vec<u32>,
    /// The objects that are drawn, and those of each mesh.
    drawn: Vec<u32>,
    by_mesh: Vec<Vec<u32>>,
    /// What is uploaded: drawn objects in the order of meshes, and those that queries test.
    listed: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Sphere {
    center: DVec3,
    radius: f32,
}

/// What a frame found.
pub struct Found<'a> {
    pub in_frustum: &'a [u32],
    pub drawn: &'a [u32],
}

impl ByHand {
    /// `tile_size` is that of the coarse depth buffer.
    ///
    /// # Errors
    /// Returns an error if there is no device.
    pub fn new(backend: BackendName, method: Method, world: Walk) -> Result<Self, Box<dyn Error>> {
        let scene = world.as_scene_ref();
        let count = scene.object_count();
        let device = Device::new(backend, &scene, world.camera().size)?;
        let occlusion = match method {
            Method::None => Occlusion::None,
            Method::CoarseDepth { tile_size } => Occlusion::CoarseDepth(Box::new(CoarseDepth::new(&scene, tile_size))),
            Method::Queries => Occlusion::Queries(Box::new(Queries {
                scheduler: QueryScheduler::new(count),
                device: QueryDevice::new(device.wgpu(), count),
                answers: (backend == BackendName::Noop).then(|| CoarseDepth::new(&scene, 1)),
            })),
        };
        let spheres = (0..count).map(|object| Sphere::new(&scene, object)).collect();
        let by_mesh = vec![Vec::new(); device.mesh_count()];
        Ok(Self {
            occlusion,
            device,
            spheres,
            in_frustum: Vec::new(),
            drawn: Vec::new(),
            by_mesh,
            listed: Vec::new(),
            world,
        })
    }

    /// Draws a frame of the walk, and waits until the device has drawn it. The camera stands still unless it `moves`.
    ///
    /// # Errors
    /// Returns an error if the device is lost.
    pub fn frame(&mut self, moves: bool) -> Result<FrameTime, Box<dyn Error>> {
        if moves {
            self.world.step();
        }
        let Self { world, occlusion, device, spheres, in_frustum, drawn, by_mesh, listed } = self;
        let scene = world.as_scene_ref();
        if let Occlusion::Queries(queries) = occlusion
            && let Some(answers) = &mut queries.answers
        {
            let view = RenderView::new(world.camera());
            find_in_frustum(&view, spheres, in_frustum);
            answers.cull(&scene, &view, in_frustum);
        }

        let start = Instant::now();
        let view = RenderView::new(world.camera());
        find_in_frustum(&view, spheres, in_frustum);
        drawn.clear();
        let mut batch = None;
        match occlusion {
            Occlusion::None => drawn.extend_from_slice(in_frustum),
            Occlusion::CoarseDepth(coarse) => {
                coarse.cull(&scene, &view, in_frustum);
                drawn.extend(in_frustum.iter().filter(|&&object| coarse.sees(object)));
            }
            Occlusion::Queries(queries) => {
                queries.device.receive(&mut queries.scheduler)?;
                let batch = batch.insert(queries.device.new_batch());
                let is_near = |object: u32| spheres[object as usize].is_near(&view);
                queries.scheduler.begin_frame(in_frustum, is_near, drawn, batch);
            }
        }
        by_mesh.iter_mut().for_each(Vec::clear);
        drawn.iter().for_each(|&object| by_mesh[device.mesh_of(object)].push(object));
        listed.clear();
        by_mesh.iter().for_each(|objects| listed.extend_from_slice(objects));
        let first_tested = listed.len() as u32;
        listed.extend(batch.iter().flat_map(|batch| &batch.tested));
        device.upload(&view, listed);
        let mut encoder = device.encoder();
        device.draw(&mut encoder, by_mesh.iter().map(Vec::len));
        if let (Occlusion::Queries(queries), Some(batch)) = (&*occlusion, &batch) {
            queries.device.encode(
                &mut encoder,
                batch,
                |encoder, set| device.begin_queries(encoder, set),
                |pass, tested| device.draw_boxes(pass, first_tested + tested.start..first_tested + tested.end),
            );
        }
        let commands = encoder.finish();
        let submit = Instant::now();
        device.submit(commands);
        if let (Occlusion::Queries(queries), Some(batch)) = (&mut *occlusion, batch) {
            queries.device.request(batch);
        }
        let cpu = start.elapsed();
        device.wait()?;
        let time = FrameTime { cpu, borrowed: submit - start, device: submit.elapsed() };

        if let Occlusion::Queries(queries) = occlusion
            && let (Some(answers), Some(batch)) = (&queries.answers, queries.device.latest())
        {
            batch.answer(|object| answers.sees(object));
        }
        Ok(time)
    }

    pub fn world(&self) -> &Walk {
        &self.world
    }

    /// What the last frame found.
    pub fn found(&self) -> Found<'_> {
        Found { in_frustum: &self.in_frustum, drawn: &self.drawn }
    }
}

/// A choice of [`Occlusion`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    None,
    CoarseDepth { tile_size: u32 },
    Queries,
}

impl Sphere {
    fn new(scene: &SceneRef<'_>, object: usize) -> Self {
        let (position, scale) = (scene.positions[object], scene.scales[object]);
        let bounds = scene.bounds[object];
        let center = position + (scene.orientations[object] * (scale * bounds.center)).as_dvec3();
        Self { center, radius: bounds.radius * scale.abs().max_element() }
    }

    /// Whether the near plane may cut the object's box, which is a little larger than the object.
    fn is_near(&self, view: &RenderView) -> bool {
        let distance = (self.center - view.camera.position).as_vec3().length();
        distance < self.radius * 1.1 + view.camera.near * 4.0
    }
}

fn find_in_frustum(view: &RenderView, spheres: &[Sphere], in_frustum: &mut Vec<u32>) {
    in_frustum.clear();
    let sees = |sphere: &Sphere| view.frustum.intersects_sphere(sphere.center, sphere.radius);
    in_frustum.extend((0..).zip(spheres).filter(|(_, sphere)| sees(sphere)).map(|(object, _)| object));
}
