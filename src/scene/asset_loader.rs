//! Assets that are loaded by background jobs, and whose handles can be used at once (L 3.1, M 10.3).

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::error::Error;
use std::fmt;
use std::mem;
use std::sync::{Arc, Weak};

use parking_lot::Mutex;

use super::assets::AssetReservers;
use super::{Asset, Assets, Mesh};
use crate::handle::Handle;
use crate::task::{Scheduler, catch};
use crate::unwind::{Contained, discard};

/// Loads meshes, materials and textures by [background jobs](Scheduler::background). A handle can be made on any thread
/// and used at once; its content arrives with [`Assets::receive`]. Clones load for the same assets.
///
/// Until its mesh and its material have arrived, an object is not drawn, and counted as
/// [`NotResident`](crate::view::IssueReason::NotResident); a material whose texture has not arrived has its plain
/// colour.
///
/// ```
/// use std::sync::Arc;
///
/// use drawloom::glam::DVec3;
/// use drawloom::scene::{AssetLoader, Material, Mesh, RenderObject, Scene, SceneError, Topology, Vertex};
/// use drawloom::task::Scheduler;
///
/// let scheduler = Arc::new(Scheduler::new(2)?);
/// let mut scene = Scene::new();
/// let loader: AssetLoader = scene.assets().loader(&scheduler);
/// // On any thread: what takes long is in the closure.
/// let mesh = loader.load("triangle", 0, || -> Result<Mesh, SceneError> {
///     let corner = |x, y| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
///     let corners = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
///     Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])
/// });
/// let material = scene.add(Material::default())?;
/// scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
/// // Between two frames:
/// while scene.assets().is_pending(mesh) {
///     let arrivals = scene.receive(&loader);
///     arrivals.errors.iter().for_each(|error| eprintln!("{error}"));
///     # std::thread::yield_now();
/// }
/// assert_eq!(scene.assets().get(mesh)?.name(), "triangle");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct AssetLoader {
    shared: Arc<Shared>,
}

struct Shared {
    /// Weak, because its queue holds jobs that hold this.
    scheduler: Weak<Scheduler>,
    slots: AssetReservers,
    /// What is to be loaded, the most important first.
    waiting: Mutex<Waiting>,
    arrived: Mutex<Vec<Arrival>>,
}

#[derive(Default)]
struct Waiting {
    loads: BinaryHeap<Load>,
    /// The number of calls of [`AssetLoader::load`] so far.
    count: u64,
    /// Background jobs that have not begun. Each loads one thing, then queues the next job, so that other background
    /// jobs need not wait until everything is loaded.
    queued_jobs: usize,
    /// Background jobs that have begun. What they load no longer waits.
    running_jobs: usize,
}

/// Something to load.
struct Load {
    /// The oldest of equal priorities first.
    order: (i32, Reverse<u64>),
    run: Contained<Box<dyn FnOnce() -> Arrival + Send>>,
}

/// Adds what was loaded to the assets.
type Arrival = Contained<Box<dyn FnOnce(&mut Assets, &mut Arrivals) + Send>>;

/// Any error.
type BoxedError = Box<dyn Error + Send + Sync>;

/// What has arrived since the last call of [`Assets::receive`].
#[derive(Debug, Default)]
pub struct Arrivals {
    /// The meshes that arrived.
    pub meshes: Vec<Handle<Mesh>>,
    /// The number of meshes, materials and textures that arrived.
    pub count: usize,
    /// What could not be loaded. The handles are stale now.
    pub errors: Vec<LoadError>,
}

/// Something that could not be loaded.
#[derive(Debug, thiserror::Error)]
#[error("`{name}` cannot be loaded: {source}")]
pub struct LoadError {
    /// The name that [`AssetLoader::load`] was called with.
    pub name: String,
    /// Why not: the error of the closure, its [panic](crate::task::JobPanic), or a [`SceneError`](super::SceneError)
    /// about what it returned.
    pub source: BoxedError,
}

impl AssetLoader {
    fn new(assets: &Assets, scheduler: &Arc<Scheduler>) -> Self {
        Self {
            shared: Arc::new(Shared {
                scheduler: Arc::downgrade(scheduler),
                slots: AssetReservers::new(assets),
                waiting: Mutex::default(),
                arrived: Mutex::default(),
            }),
        }
    }

    /// Has a background job call `load`, those with a higher priority first, and returns the handle of what it will
    /// return. `name` is for errors. The asset has the same priority in [streaming](Assets::set_priority) when it
    /// arrives.
    ///
    /// As many assets are loaded at once as [workers run background jobs](Scheduler::set_background_workers).
    ///
    /// With a single worker, no job runs in the background: then each call of [`Assets::receive`] loads one asset. If
    /// the scheduler is gone, each call of this function loads one, the most urgent of those that wait.
    pub fn load<T: Asset, E: Into<BoxedError>>(
        &self,
        name: impl Into<String>,
        priority: i32,
        load: impl FnOnce() -> Result<T, E> + Send + 'static,
    ) -> Handle<T> {
        let (name, handle) = (name.into(), T::reserve(&self.shared.slots));
        let run = move || -> Arrival {
            // The conversion of the error is the engine's code as well.
            let loaded = match catch(|| load().map_err(Into::into)) {
                Ok(loaded) => loaded,
                Err(panic) => Err(panic.into()),
            };
            let loaded = Contained::new(loaded);
            Contained::new(Box::new(move |assets: &mut Assets, arrivals: &mut Arrivals| {
                arrivals.add(assets, handle, (name, priority), loaded.into_inner());
            }))
        };
        {
            let mut waiting = self.shared.waiting.lock();
            let order = (priority, Reverse(waiting.count));
            waiting.count += 1;
            waiting.loads.push(Load { order, run: Contained::new(Box::new(run)) });
        }
        match self.shared.scheduler.upgrade() {
            Some(scheduler) => Shared::queue_job(&self.shared, &scheduler),
            None => self.shared.load_next(),
        }
        handle
    }

    /// The number of assets whose loading has not begun.
    pub fn waiting(&self) -> usize {
        self.shared.waiting.lock().loads.len()
    }

    /// Adds what has arrived.
    fn receive(&self, assets: &mut Assets) -> Arrivals {
        let has_background = self.shared.scheduler.upgrade().is_some_and(|scheduler| scheduler.workers() > 1);
        if !has_background {
            self.shared.load_next();
        }
        let mut arrivals = Arrivals::default();
        for arrival in mem::take(&mut *self.shared.arrived.lock()) {
            arrival.into_inner()(assets, &mut arrivals);
        }
        arrivals
    }
}

impl Assets {
    /// Makes what loads assets by background jobs. See [`AssetLoader`].
    pub fn loader(&self, scheduler: &Arc<Scheduler>) -> AssetLoader {
        AssetLoader::new(self, scheduler)
    }

    /// Adds what a loader has loaded since the last call: call it between two frames. The handles of what could not be
    /// loaded are stale from then on.
    pub fn receive(&mut self, loader: &AssetLoader) -> Arrivals {
        loader.receive(self)
    }
}

impl fmt::Debug for AssetLoader {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("AssetLoader").field("waiting", &self.waiting()).finish_non_exhaustive()
    }
}

impl Shared {
    /// Queues a background job if more loads wait than jobs are queued for them, and not every worker but the first has
    /// a job.
    fn queue_job(shared: &Arc<Self>, scheduler: &Scheduler) {
        let mut waiting = shared.waiting.lock();
        let jobs = waiting.queued_jobs + waiting.running_jobs;
        if waiting.queued_jobs >= waiting.loads.len() || jobs >= scheduler.workers() - 1 {
            return;
        }
        waiting.queued_jobs += 1;
        drop(waiting);
        let shared = Arc::clone(shared);
        // What it returns is in `arrived`.
        drop(scheduler.background(move || {
            {
                let mut waiting = shared.waiting.lock();
                waiting.queued_jobs -= 1;
                waiting.running_jobs += 1;
            }
            shared.load_next();
            shared.waiting.lock().running_jobs -= 1;
            if let Some(scheduler) = shared.scheduler.upgrade() {
                Self::queue_job(&shared, &scheduler);
            }
        }));
    }

    fn load_next(&self) {
        let next = self.waiting.lock().loads.pop();
        if let Some(Load { run, .. }) = next {
            let arrival = run.into_inner()();
            self.arrived.lock().push(arrival);
        }
    }
}

impl Arrivals {
    /// Adds an asset that was loaded. One whose handle was [unloaded](Assets::unload) meanwhile is dropped.
    fn add<T: Asset>(
        &mut self,
        assets: &mut Assets,
        handle: Handle<T>,
        (name, priority): (String, i32),
        loaded: Result<T, BoxedError>,
    ) {
        if !assets.is_pending(handle) {
            // The engine's error may panic when it is dropped, and others have yet to arrive.
            return discard(loaded);
        }
        let checked = loaded.and_then(|asset| asset.check(assets).map(|()| asset).map_err(BoxedError::from));
        let added = match checked {
            Ok(asset) => assets.fill(handle, priority, asset).is_ok(),
            Err(source) => {
                self.errors.push(LoadError { name, source });
                // It is pending.
                let _ = assets.release(handle);
                false
            }
        };
        if added {
            self.count += 1;
            self.meshes.extend(T::as_mesh(handle));
        }
    }
}

impl PartialEq for Load {
    fn eq(&self, other: &Self) -> bool {
        self.order == other.order
    }
}

impl Eq for Load {}

impl PartialOrd for Load {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Load {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.order.cmp(&other.order)
    }
}
