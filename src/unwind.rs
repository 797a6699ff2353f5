//! The boundary to code of the engine's, which may panic: its backend, processes, nodes, steps and destructors.
//!
//! A panic is caught where the engine's code is called, and becomes an error that names the call. Behind these catches
//! stand others around the recording of a frame and its submission, for a call that was forgotten.
//!
//! These are all places where this crate calls such code. `tests/boundary` makes each of these calls panic in turn,
//! except the iterators and writers that the engine passes to a call, and `SurfaceFrame::present`, which needs a
//! window. The module `unwind` of `drawloom-jobs` has those of jobs, nodes, clocks, hooks and subscribers, and that of
//! `drawloom-async-post` those of steps of asynchronous post-processing.
//!
//! | code | called in | its panic |
//! | --- | --- | --- |
//! | `Backend` and `BackendExtras`: `begin`, `uploaded_bytes`, `counters` and others | `backend/guarded_backend.rs` | `FrameError::Panicked` with the call; of `read_back` `BackendError::Panicked`; of `submit` `SubmitError::Panicked`; of `discard_frame` `FrameError::DiscardPanicked` |
//! | `FrameRecorder` in jobs: `upload_objects`, `prepare`, `record`, `finish` and others; `RenderProcess` and `RawPass` there | `frame/stages`, caught where a graph runs its nodes | `FrameError::Panicked` with process, view and stage |
//! | `BackendExtras::work_in_background` | `frame/renderer.rs`: in a background job, or with one worker on the calling thread | `FrameError::Panicked` of that frame, or of one after the job |
//! | `RenderProcess`: `name`, `declare`, `draws`, `cpu_shader` | `process/plan/planned_process.rs`, `backend/software/rasterizer.rs` | `PlanError::ProcessPanicked`, or `PlanError::Panicked` |
//! | CPU shaders | `backend/software`, in jobs | `BackendError::CpuShaderPanicked` |
//! | `Pipeline`: `requirements`, `build` and others; in that of `Deferred` also `PostStep` and `Deformation`: `name`, `layers` | `frame/plan_cache.rs` | `PlanError::PipelinePanicked` with the call |
//! | `Deformation`: `declare`, `shader`, `resources`, `cpu_shader` | `process/deferred/deformation.rs`, in calls of the process that deforms | as that of the process |
//! //! | `CpuNode`: `name`, `declare` | `frame/nodes/borrowed_nodes.rs` | `FrameError::Panicked` with the node |
//! | `CpuNode`: `width`, `run` and others | in jobs, caught where a graph runs its nodes | `FrameError::Panicked` with the node |
//! | predicates of materials | `frame/views/view_visibility.rs` | `FrameError::FilterPanicked` |
//! | what follows a submission | `frame/frame_loop/mod.rs` | `FrameLoopError::Panicked` |
//! | loads | `scene/asset_loader.rs` | `LoadError` |
//! | what the engine passes to a call, or asks itself, on its own thread: `Parameters::update`, `MaterialPredicate::contains`, `Deferred::names`, `output` and `quality`, `SurfaceFrame::present`, iterators and writers | there | unwinds to the caller; nothing has changed but values of the engine's |
//! | destructors of any of these, of `Frame`, `Part`, `Commands`, `Submission`, and of the payloads of panics | [`discard`], [`Contained`], in which processes and deformations are wrapped when they are added | nothing |

pub use drawloom_jobs::internal::Contained;
pub(crate) use drawloom_jobs::internal::{CaughtSpan, discard, discard_all, emit};
// Only backends that draw send events while they hold locks.
#[cfg(any(feature = "wgpu", feature = "software"))]
pub(crate) use drawloom_jobs::internal::{emit_unlocked, hold_events};
