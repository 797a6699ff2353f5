//! How many threads, which views, how large a job, which quality.
//!
//! # Threads
//!
//! [`Scheduler::with_available_parallelism`] has a worker for each thread that the process can run at once; the thread
//! that calls it is one of them. That is right for an engine whose own jobs go through the same scheduler. An engine
//! with threads of its own that are busy during `record` takes fewer: a worker that has no core delays the frame that
//! waits for it. Audio and network threads sleep most of the time, and do not count.
//!
//! A frame that is too small to share runs on the calling thread alone: that is measured in each frame, and nothing to
//! choose.
//!
//! # Views
//!
//! Each camera is a view, and so is the shadow map of each light that casts shadows. A view costs its culling, some 2
//! ns for each object, and the draw lists of its processes. A view whose camera and objects do not change costs next to
//! nothing. So:
//!
//! - Several windows or split screens are cameras of one frame, not several renderers: meshes, materials and object
//!   data are shared.
//! - Renderers that are opened while the engine runs, for thumbnails say, have backends of one [`PipelineLibrary`]: the
//!   first frame of each compiles only what no other has compiled, which takes tenths of a second otherwise.
//! - A view that need not be new in every frame is left out of the cameras in the frames between, and its texture is
//!   kept.
//! - Each view has targets of its own, some 20 bytes a pixel beside its picture. With
//!   [`WgpuBackend::transient_targets`], views of the same size share them, and only outputs can be read back. Use it
//!   wherever there are several cameras, and always where there are hundreds: wgpu's bookkeeping grows with the number
//!   of views times the number of textures.
//! - `casts_shadow: false` on lights whose shadows nobody sees removes a view each. [`ShadowQuality::interval`] draws
//!   maps less often.
//!
//! # Granularity
//!
//! [`Granularity::Adaptive`] measures what an object, a draw or a batch costs in each stage, and makes jobs that are
//! worth their overhead. The others are for measuring the difference (`benches/`, `load_balance`), and for reproducing
//! a job structure in a bug report. What each chooses is in [`FrameStatistics::tuning`] and in the inspector.
//!
//! # Quality
//!
//! Begin with [`Quality::balanced`]. Then let the inspector measure the price of each setting in a scene of yours, and
//! change those that are worth it. As a rule:
//!
//! | the frame waits for | try |
//! | --- | --- |
//! | the CPU, in `objects` and `visibility` | [`Changes`](crate::scene::Changes) that name what changed; `culling: Sphere` |
//! | the CPU, in `record` | fewer meshes and materials that differ, so that more objects are one batch |
//! | the device, in vertices | `vertices: Packed`, meshes with [levels of detail]; with the feature `occlusion`, `occlusion: Some(8)` and meshes with triangle culling |
//! | the device, in pixels | `opaque_order` with 10 bits or `depth_pre_pass`, a `light_cut_off`, smaller shadow maps |
//! | memory bandwidth | `normals: Octahedral8`, `diffuse: Srgb8` |
//!
//! A scene with hundreds of lights, or of panes, at one pixel loses light in half floats: set
//! [`Quality::radiance_sum`].
//!
//! [`FrameStatistics::tuning`]: crate::FrameStatistics::tuning
//! [`Granularity::Adaptive`]: crate::Granularity::Adaptive
//! [`Quality::balanced`]: crate::quality::Quality::balanced
//! [`Quality::radiance_sum`]: crate::quality::Quality::radiance_sum
//! [`Scheduler::with_available_parallelism`]: crate::task::Scheduler::with_available_parallelism
//! [`ShadowQuality::interval`]: crate::quality::ShadowQuality::interval
//! [`PipelineLibrary`]: crate::backend::PipelineLibrary
//! [`WgpuBackend::transient_targets`]: crate::backend::WgpuBackend::transient_targets
//! [levels of detail]: crate::scene::Mesh::with_levels
