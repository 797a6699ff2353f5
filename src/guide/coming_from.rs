//! What the words of other renderers are called here.
//!
//! | Bevy | rend3 | a hand-written renderer | Drawloom |
//! | --- | --- | --- | --- |
//! | the main world, extracted into the render world in each frame | objects added to the renderer | an array of draws | the engine's own columns, lent as a [`SceneRef`] until the frame is recorded; no second world |
//! | `Mesh`, `Mesh3d` | `Mesh`, `MeshHandle` | vertex and index buffers | [`Mesh`], by [`Handle`]; [`Mesh::from_buffers`] for buffers of the engine's |
//! | `Material`, `AsBindGroup` | `Material` | a bind group and a pipeline | [`Material`] for what ships; a [`MaterialType`] and a shader for the engine's own |
//! | `Camera`, `RenderTarget` | `Camera` | a view matrix and a target | [`Camera`]: each is a view; [`import_target`] draws it into a texture of the engine's |
//! | `ViewVisibility`, `RenderLayers` | | an `if` in the loop | culling by [`CullingVolume`], [`LayerMask`], [`ViewFilter`] |
//! | render graph node, `RenderSystems` | a routine in a `RenderGraph` | a function that encodes a pass | [`RenderProcess`]: its order follows from what it declares |
//! | phases, `PhaseItem`, `SetItemPipeline` ... | | a sort of draws | a process's commands, by its [`Selection`] |
//! | `MeshUniform`, instance data | | a storage buffer by object | an [`ObjectColumn`], lent and uploaded where objects changed |
//! | `ExtractSchedule`, `Changed<T>` | | a dirty flag | [`Changes`]: what the engine reports; `examples/ecs` derives it from ticks |
//! | `PipelineCache`, which compiles in the background | | pipelines made at start | [`WarmUp`] at start, [`Renderer::prepare_pipelines_in_background`] later; otherwise in the frame that needs one first |
//! | `ComputeTaskPool`, `par_iter_mut` | | rayon | [`Scheduler`], [`Scheduler::parallel_for_each`]: one set of threads for engine and renderer |
//! | `PipelinedRenderingPlugin` | | a render thread | `record`, then `submit` on the device thread beside the next update: see [step 8](super::from_wgpu#8-overlap-and-look) |
//! | `RenderDiagnosticsPlugin`, Tracy | | timers of one's own | the [timeline](crate::timeline), the inspector, `drawloom-tracy` |
//!
//! What differs most, in one sentence each:
//!
//! - **From Bevy.** There is no app, no plugin and no world: the engine calls `record` and `submit` in its own loop. In
//!   return, nothing is copied into a render world, and nothing is drawn that the engine did not lend.
//! - **From rend3.** The renderer keeps no objects: the engine lends all of them in each frame, and says which changed.
//! - **From a hand-written renderer.** Passes say what they read and write, and not when they run. A pass that must run
//!   at a place says so by `InjectionPoint`, or by `after` and `before`.
//!
//! [`CullingVolume`]: crate::quality::CullingVolume
//! [`Camera`]: crate::scene::Camera
//! [`Changes`]: crate::scene::Changes
//! [`Handle`]: crate::handle::Handle
//! [`LayerMask`]: crate::scene::LayerMask
//! [`Material`]: crate::scene::Material
//! [`MaterialType`]: crate::scene::MaterialType
//! [`Mesh`]: crate::scene::Mesh
//! [`Mesh::from_buffers`]: crate::scene::Mesh::from_buffers
//! [`ObjectColumn`]: crate::scene::ObjectColumn
//! [`ViewFilter`]: crate::scene::ViewFilter
//! [`RenderProcess`]: crate::process::RenderProcess
//! [`Renderer::prepare_pipelines_in_background`]: crate::Renderer::prepare_pipelines_in_background
//! [`WarmUp`]: crate::WarmUp
//! [`SceneRef`]: crate::scene::SceneRef
//! [`Scheduler`]: crate::task::Scheduler
//! [`Scheduler::parallel_for_each`]: crate::task::Scheduler::parallel_for_each
//! [`Selection`]: crate::command::Selection
//! [`import_target`]: crate::backend::WgpuBackend::import_target
