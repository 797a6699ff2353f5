//! From a plain wgpu renderer to Drawloom, in eight steps.
//!
//! The renderer that we begin with is the usual one: a device, a window, and a loop that writes the transforms of all
//! objects into a buffer, opens a render pass, and draws one object after the other. It spends its frame on one thread.
//! Each step below compiles and runs by itself, and leaves the rest of the engine unchanged.
//!
//! # 1. Give Drawloom the device
//!
//! The engine keeps its device and its queue: [`WgpuBackend`] gets handles to them, and uses them beside the engine. It
//! requires the features [`WgpuBackend::REQUIRED_FEATURES`], and gains from [`WgpuBackend::optional_features`]. The
//! [`Scheduler`] starts the threads. It runs the engine's own jobs too, so nobody starts a second set of threads that
//! compete with these.
//!
//! ```
//! use std::sync::Arc;
//!
//! use drawloom::Renderer;
//! use drawloom::backend::WgpuBackend;
//! use drawloom::process::Deferred;
//! use drawloom::task::Scheduler;
//!
//! # let (device, queue) = drawloom_testing::adapter::noop_device()?;
//! let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
//! // Handles of the engine's own device, or of the one that `WindowDevice::open` opens.
//! let backend = WgpuBackend::new(device.clone(), queue.clone())?;
//! let (mut renderer, submitter) =
//!     Renderer::builder(backend).pipeline(Deferred::to_picture()).build(Arc::clone(&scheduler))?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The renderer records, on all workers. The submitter submits, on one thread: it cannot be sent to another.
//!
//! # 2. Turn vertex buffers and bind groups into assets
//!
//! A mesh is vertices and indices; a material is what the shipped pipeline shades. Drawloom uploads them when a frame
//! first draws them, and objects name them by handles of 8 bytes.
//!
//! ```
//! use drawloom::glam::Vec3;
//! use drawloom::scene::{Assets, Material, Mesh, Topology, Vertex};
//!
//! let mut assets = Assets::default();
//! let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
//! let vertices = corners.map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0, 0.0] });
//! let triangle = Mesh::new("triangle", Topology::TriangleList, vertices.to_vec(), vec![0, 1, 2])?;
//! let bounds = triangle.bounds();
//! let triangle = assets.add(triangle)?;
//! let red = Material { name: "red".into(), diffuse: Vec3::new(0.8, 0.1, 0.1), ..Material::default() };
//! let red = assets.add(red)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Vertices that are in the engine's own buffers can stay there: see [`Mesh::from_buffers`]. Textures that are on the
//! device, buffers and samplers go to shaders of the engine's own, as a [`ShaderResource`].
//!
//! # 3. Lend the objects
//!
//! The loop over objects goes. In its place the engine lends its arrays, one for each property, as a [`SceneRef`]:
//! nothing is copied, and the loan ends when [`Renderer::record`] returns. A view, a draw list and a pass are made for
//! each camera.
//!
//! ```
//! # use std::sync::Arc;
//! # use drawloom::Renderer;
//! # use drawloom::backend::WgpuBackend;
//! # use drawloom::process::{Deferred, targets};
//! # use drawloom::scene::{Assets, Material, Mesh, Topology, Vertex};
//! # use drawloom::task::Scheduler;
//! use drawloom::glam::{DVec3, Quat, Vec3};
//! use drawloom::scene::{Camera, Light, SceneRef};
//!
//! # let (device, queue) = drawloom_testing::adapter::noop_device()?;
//! # let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
//! # let (mut renderer, submitter) = Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture()).build(scheduler)?;
//! # let mut assets = Assets::default();
//! # let vertices = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]].map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] });
//! # let triangle = Mesh::new("triangle", Topology::TriangleList, vertices.to_vec(), vec![0, 1, 2])?;
//! # let bounds = triangle.bounds();
//! # let (triangle, red) = (assets.add(triangle)?, assets.add(Material::default())?);
//! // Columns of the engine's world: a struct of arrays, or an archetype of its entity-component system.
//! let positions: Vec<_> = (0..1_000).map(|index| DVec3::new(f64::from(index), 0.0, -10.0)).collect();
//! let orientations = vec![Quat::IDENTITY; 1_000];
//! let scales = vec![Vec3::ONE; 1_000];
//! let (bounds, meshes, materials) = (vec![bounds; 1_000], vec![triangle; 1_000], vec![red; 1_000]);
//! let sun = Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: false };
//! let camera = Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO);
//!
//! let recorded = renderer.record(SceneRef {
//!     positions: &positions,
//!     orientations: &orientations,
//!     scales: &scales,
//!     bounds: &bounds,
//!     meshes: &meshes,
//!     materials: &materials,
//!     lights: &[sun],
//!     cameras: &[camera],
//!     ambient: Vec3::splat(0.1),
//!     // No layers, no columns of the engine's own, a black background, and nothing said of what changed.
//!     ..SceneRef::new(&assets)
//! })?;
//! println!("{} objects are visible", recorded.statistics().views[0].visible);
//! let submitted = submitter.submit(recorded)?;
//! let (texture, _layer) = submitted.submission.texture(0, targets::PICTURE)?;
//! println!("the picture is {} pixels wide", texture.width());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! An engine that has no such arrays begins with [`Scene`], which owns them. One that has some of them lends these, and
//! takes the others from a scene: `SceneRef { positions: &positions, ..scene.as_scene_ref() }`.
//!
//! # 4. Draw into the window
//!
//! The picture goes straight into the texture of the window's surface, in the place of a target of Drawloom's own. A
//! [`WindowSurface`] chooses formats, follows the window's size, and makes a lost surface anew; [`WindowDevice::open`]
//! opens the device too, and an engine that has one makes a [`WindowDevice`] of its handles. If the device is lost, it
//! opens another, and hands it to [`Renderer::replace_backend`].
//!
//! ```
//! # use std::sync::Arc;
//! # use drawloom::Renderer;
//! # use drawloom::backend::{WgpuBackend, WindowSurface};
//! # use drawloom::process::{Deferred, ToneMapping, targets};
//! # use drawloom::scene::Scene;
//! # use drawloom::task::Scheduler;
//! # fn run(
//! #     mut surface: WindowSurface, backend: WgpuBackend, scheduler: Arc<Scheduler>, mut world: Scene, window_size: [u32; 2],
//! # ) -> Result<(), Box<dyn std::error::Error>> {
//! // The last step of post-processing decides the picture's format.
//! let tone_mapping = ToneMapping { format: surface.picture_format(), ..ToneMapping::default() };
//! let (mut renderer, submitter) = Renderer::builder(backend).pipeline(Deferred::new().post(tone_mapping)).build(scheduler)?;
//!
//! // When the window asks to be drawn. There is no frame while it is minimised.
//! if let Some(frame) = surface.acquire(window_size)? {
//!     world.cameras[0].size = frame.size();
//!     // "main" is the name of the camera, and `PICTURE` the target that the last step draws.
//!     renderer.backend().import_target("main", targets::PICTURE, frame.target().clone());
//!     let recorded = renderer.record(world.as_scene_ref())?;
//!     submitter.submit(recorded)?;
//!     frame.present(|_texture| { /* egui draws over it here */ });
//! }
//! # Ok(())
//! # }
//! ```
//!
//! A window is drawn as often as the engine asks: a minimised one that asks for the next frame in each frame keeps a
//! core busy. `examples/window` asks its windows whether they are visible, and has several on one device;
//! `small_engine`, an example of `drawloom-egui`, has all of a small engine in one file.
//!
//! # 5. Bring the shaders
//!
//! A shader of the engine's becomes a [`RenderProcess`]: it declares what it reads and writes, and so where in the
//! frame it is. A process over objects draws Drawloom's commands, culled, sorted and merged; one over the screen needs
//! no geometry:
//!
//! ```
//! # use std::sync::Arc;
//! # use drawloom::Renderer;
//! # use drawloom::backend::WgpuBackend;
//! # use drawloom::glam::DVec3;
//! # use drawloom::scene::{Camera, Scene};
//! # use drawloom::task::Scheduler;
//! use drawloom::process::{Declare, Deferred, Draws, FullScreen, InjectionPoint, RenderProcess, targets};
//! use drawloom::scene::Blend;
//!
//! /// A glow at the horizon, added to what the lights leave.
//! struct Horizon;
//!
//! impl RenderProcess for Horizon {
//!     fn name(&self) -> &str {
//!         "horizon"
//!     }
//!
//!     fn declare(&self, declare: &mut Declare) {
//!         declare.at(InjectionPoint::AfterTransparency);
//!         declare.draws_over(targets::RADIANCE);
//!     }
//!
//!     fn draws(&self) -> Draws<'_> {
//!         let shader = "
//!             @fragment
//!             fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
//!                 return vec4<f32>(vec3<f32>(0.4, 0.2, 0.1) * exp(-8.0 * abs(in.clip.y)), 0.0);
//!             }
//!         ";
//!         Draws::FullScreen(FullScreen { shader, blend: Blend::Additive, ..FullScreen::default() })
//!     }
//! }
//!
//! # let (device, queue) = drawloom_testing::adapter::noop_device()?;
//! # let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
//! # let backend = WgpuBackend::new(device, queue)?;
//! let (mut renderer, submitter) =
//!     Renderer::builder(backend).pipeline(Deferred::to_picture()).process(Horizon).build(scheduler)?;
//! # let mut world = Scene::new();
//! # world.cameras.push(Camera::looking_at("main", DVec3::Z, DVec3::ZERO));
//! # submitter.submit(renderer.record(world.as_scene_ref())?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `examples/own_content` has shaders that read data of objects, vertices and materials, move vertices, compute, and
//! count.
//!
//! A shader that does not compile is an error of the first frame that needs it, with the process, the line and the
//! column; [`Renderer::prepare_pipelines`] finds it before, while the world is loaded.
//!
//! A process passes values to its shader as a uniform. [`Parameters`] is one that changes between frames, with an
//! example.
//!
//! # 6. Keep your draws
//!
//! Pipelines, bind groups and draw calls that you have need no new shader and no [`Scene`]. They become
//! [items](crate::process::Items): for each a bounding sphere, a key to sort by, and a version; and the code that records
//! a range of them. Drawloom finds what each view sees, sorts it, divides it among the workers, and replays the bundles
//! in which nothing changed.
//!
//! - The process says where the draws go: a [`RenderProcess`] with the targets that your pipelines draw into, and
//!   [`Draws::Items`](crate::process::Draws::Items). Depth targets are cleared to 0, as Drawloom's depth is reversed; for
//!   pipelines whose far plane is at depth 1, say [`clears_depth_to(1.0)`](crate::process::Declare::clears_depth_to).
//!   What only bind groups of your own read needs [`keep`](crate::process::Declare::keep): the frame does not see who
//!   reads it.
//! - The loop over what you draw becomes [`RecordItems`](crate::process::RecordItems). It gets its items in the order of
//!   their keys, and records into a [`RenderEncoder`](wgpu::util::RenderEncoder), which passes and bundles both are: a
//!   trait of yours for `wgpu::RenderPass<'a>` becomes one for `dyn RenderEncoder<'a> + '_`. Code that sets viewports or
//!   scissors is a [`RecordItemsInPass`](crate::process::RecordItemsInPass), which is recorded anew in every frame.
//! - Cameras that cull by your matrices come from [`Camera::from_matrices`](crate::scene::Camera::from_matrices).
//! - [`Renderer::record_with`] takes the items of a frame beside its scene, whose cameras they are culled for.
//!
//! [`Items`](crate::process::Items) has all of that as an example.
//!
//! # 7. Keep a pass of your own
//!
//! What Drawloom has no words for, as a library that encodes its own passes, gets the encoder in a [`RawPass`], at its
//! place in the frame, on a worker:
//!
//! ```
//! # use std::error::Error;
//! # use std::sync::Arc;
//! # use drawloom::{Renderer, wgpu};
//! # use drawloom::backend::WgpuBackend;
//! # use drawloom::glam::DVec3;
//! # use drawloom::scene::{Camera, Scene};
//! # use drawloom::task::Scheduler;
//! use drawloom::process::{Declare, Deferred, Draws, RawPass, RawPassResources, RenderProcess, targets};
//!
//! /// Copies the picture into a texture of the engine's: a thumbnail of a saved game, for example.
//! struct Thumbnail(wgpu::Texture);
//!
//! impl RenderProcess for Thumbnail {
//!     fn name(&self) -> &str {
//!         "thumbnail"
//!     }
//!
//!     fn declare(&self, declare: &mut Declare) {
//!         declare.reads(targets::PICTURE);
//!         // Nothing in the frame reads what it writes.
//!         declare.keep();
//!     }
//!
//!     fn draws(&self) -> Draws<'_> {
//!         Draws::Raw(self)
//!     }
//! }
//!
//! impl RawPass for Thumbnail {
//!     fn encode(
//!         &self,
//!         encoder: &mut wgpu::CommandEncoder,
//!         resources: &RawPassResources<'_>,
//!     ) -> Result<(), Box<dyn Error + Send + Sync>> {
//!         let picture = resources.target(targets::PICTURE)?;
//!         encoder.copy_texture_to_texture(picture.as_image_copy(), self.0.as_image_copy(), self.0.size());
//!         Ok(())
//!     }
//! }
//! # let (device, queue) = drawloom_testing::adapter::noop_device()?;
//! # let texture = device.create_texture(&wgpu::TextureDescriptor {
//! #     label: None, size: wgpu::Extent3d { width: 64, height: 64, depth_or_array_layers: 1 }, mip_level_count: 1, sample_count: 1,
//! #     dimension: wgpu::TextureDimension::D2, format: wgpu::TextureFormat::Rgba8UnormSrgb,
//! #     usage: wgpu::TextureUsages::COPY_DST, view_formats: &[],
//! # });
//! # let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
//! # let backend = WgpuBackend::new(device, queue)?;
//! # let (mut renderer, submitter) = Renderer::builder(backend).pipeline(Deferred::to_picture()).process(Thumbnail(texture)).build(scheduler)?;
//! # let mut world = Scene::new();
//! # world.cameras.push(Camera { size: [320, 200], ..Camera::looking_at("main", DVec3::Z, DVec3::ZERO) });
//! # submitter.submit(renderer.record(world.as_scene_ref())?)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # 8. Overlap, and look
//!
//! The world is free from the end of `record` on. So the next update runs on the workers while this thread submits; and
//! an engine that says what changed pays for that alone. The timeline shows whether it helps.
//!
//! ```
//! # use std::sync::Arc;
//! # use drawloom::Renderer;
//! # use drawloom::backend::WgpuBackend;
//! # use drawloom::glam::{DVec3, Quat, Vec3};
//! # use drawloom::process::Deferred;
//! # use drawloom::scene::{Assets, Camera, Changes, Material, Mesh, SceneRef, Topology, Vertex};
//! # use drawloom::task::Scheduler;
//! # let (device, queue) = drawloom_testing::adapter::noop_device()?;
//! # let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
//! # let (mut renderer, submitter) =
//! #     Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture()).build(Arc::clone(&scheduler))?;
//! # let mut assets = Assets::default();
//! # let vertices = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]].map(|position| Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] });
//! # let triangle = Mesh::new("triangle", Topology::TriangleList, vertices.to_vec(), vec![0, 1, 2])?;
//! # let bounds = triangle.bounds();
//! # let (triangle, red) = (assets.add(triangle)?, assets.add(Material::default())?);
//! # let mut positions: Vec<_> = (0..1_000).map(|index| DVec3::new(f64::from(index), 0.0, -10.0)).collect();
//! # let (orientations, scales) = (vec![Quat::IDENTITY; 1_000], vec![Vec3::ONE; 1_000]);
//! # let (bounds, meshes, materials) = (vec![bounds; 1_000], vec![triangle; 1_000], vec![red; 1_000]);
//! # let cameras = [Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO)];
//! scheduler.timeline().start();
//! for _frame in 0..10 {
//!     let recorded = renderer.record(SceneRef {
//!         positions: &positions,
//!         // The first 100 objects move in every frame, and the others never.
//!         changes: Changes::Ranges(&[0..100]),
//!         // ... as in step 3.
//! #         orientations: &orientations, scales: &scales, bounds: &bounds, meshes: &meshes, materials: &materials,
//! #         cameras: &cameras, ambient: Vec3::ONE, ..SceneRef::new(&assets)
//!     })?;
//!     let (mut updated, moving) = (Ok(()), &mut positions[..100]);
//!     let submitted = scheduler.scope(|scope| {
//!         scope.spawn(|_, _| {
//!             updated = scheduler.parallel_for_each(moving.chunks_mut(25), |chunk, _| {
//!                 chunk.iter_mut().for_each(|position| position.y += 0.01);
//!             });
//!         });
//!         submitter.submit(recorded)
//!     })?;
//!     submitted?;
//!     updated?;
//! }
//! let log = scheduler.timeline().take();
//! for frame in &log.frames {
//!     let work: std::time::Duration = log.runs_of(frame.number).map(|run| run.work()).sum();
//!     println!("frame {}: {work:?} of work in {:?}", frame.number, frame.ended - frame.began);
//! }
//! # assert_eq!(log.frames.len(), 10);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! To see it rather than read it, add the inspector, `drawloom-egui`, or write a page with `report::write_page`
//! (feature `report`).
//!
//! [`Mesh::from_buffers`]: crate::scene::Mesh::from_buffers
//! [`Parameters`]: crate::process::Parameters
//! [`RawPass`]: crate::process::RawPass
//! [`RenderProcess`]: crate::process::RenderProcess
//! [`Renderer::prepare_pipelines`]: crate::Renderer::prepare_pipelines
//! [`Renderer::record_with`]: crate::Renderer::record_with
//! [`Renderer::record`]: crate::Renderer::record
//! [`Renderer::replace_backend`]: crate::Renderer::replace_backend
//! [`Scene`]: crate::scene::Scene
//! [`SceneRef`]: crate::scene::SceneRef
//! [`Scheduler`]: crate::task::Scheduler
//! [`ShaderResource`]: crate::process::ShaderResource
//! [`WgpuBackend`]: crate::backend::WgpuBackend
//! [`WgpuBackend::REQUIRED_FEATURES`]: crate::backend::WgpuBackend::REQUIRED_FEATURES
//! [`WgpuBackend::optional_features`]: crate::backend::WgpuBackend::optional_features
//! [`WindowDevice`]: crate::backend::WindowDevice
//! [`WindowDevice::open`]: crate::backend::WindowDevice::open
//! [`WindowSurface`]: crate::backend::WindowSurface
