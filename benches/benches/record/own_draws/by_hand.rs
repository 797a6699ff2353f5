//! What an engine writes by hand: it culls its items eight at a time, in draw order, and records those that a camera
//! sees.

use drawloom::scene::Camera;
use drawloom::view::BoundingSphere;
use drawloom::wgpu;

use super::OwnTechnique;
use super::commands::Commands;
use super::world::World;
use crate::objects::{Sphere, clip_from_world};
use crate::spheres::{LANES, SphereGroup, append_visible, planes};
use crate::technique::Failure;
use crate::threads::Threads;

/// The items in draw order, and their bounding spheres in that order. It holds as long as no key changes.
struct SortedItems {
    items: Vec<u32>,
    groups: Vec<SphereGroup>,
}

/// Groups of items in a job, which are 512 items: fewer are not worth another thread.
const GROUPS_PER_JOB: usize = 512 / LANES;

impl SortedItems {
    fn new(world: &World) -> Self {
        let mut items: Vec<_> = (0..world.keys.len() as u32).collect();
        items.sort_by_key(|&item| world.keys[item as usize]);
        let groups = vec![SphereGroup::EMPTY; items.len().div_ceil(LANES)];
        let mut sorted = Self { items, groups };
        sorted.update(&world.bounds, &Threads::One);
        sorted
    }

    /// Copies the spheres of all items.
    fn update(&mut self, bounds: &[BoundingSphere], threads: &Threads) {
        let Self { items, groups } = self;
        let in_job = GROUPS_PER_JOB * LANES;
        let mut jobs: Vec<_> = items.chunks(in_job).zip(groups.chunks_mut(GROUPS_PER_JOB)).collect();
        threads.for_each(&mut jobs, |(items, groups)| {
            for (items, group) in items.chunks(LANES).zip(groups.iter_mut()) {
                for (lane, &item) in items.iter().enumerate() {
                    let BoundingSphere { center, radius } = bounds[item as usize];
                    group.set(lane, &Sphere { center, radius });
                }
            }
        });
    }

    /// The items that a camera sees, in draw order.
    fn find_visible(&self, camera: &Camera, visible: &mut Vec<u32>) {
        visible.clear();
        append_visible(&self.groups, 0, &planes(&clip_from_world(camera)), visible);
        visible.iter_mut().for_each(|item| *item = self.items[*item as usize]);
    }
}

/// An encoder for each camera, into which a thread records directly.
pub struct Encoders {
    commands: Commands,
    sorted: SortedItems,
    threads: Threads,
    /// By camera.
    visible: Vec<Vec<u32>>,
}

impl Encoders {
    pub fn new(commands: Commands, world: &World, threads: &Threads) -> Self {
        let visible = vec![Vec::new(); world.cameras().len()];
        Self { commands, sorted: SortedItems::new(world), threads: threads.clone(), visible }
    }
}

impl OwnTechnique for Encoders {
    fn frame(&mut self, world: &World) -> Result<usize, Failure> {
        let Self { commands, sorted, threads, visible } = self;
        commands.upload(world, threads);
        if world.kind().moves_items() {
            sorted.update(&world.bounds, threads);
        }
        let mut cameras: Vec<_> = world.cameras().iter().zip(visible.iter_mut()).enumerate().collect();
        let encoded = threads.map(&mut cameras, |(index, (camera, visible))| {
            sorted.find_visible(camera, visible);
            let mut encoder = commands.fixture.encoder();
            commands.record(&mut commands.fixture.pass(&mut encoder, *index), *index, visible);
            encoder.finish()
        });
        commands.fixture.queue.submit(encoded);
        Ok(visible.iter().map(Vec::len).sum())
    }

    fn wait(&self) -> Result<(), Failure> {
        self.commands.fixture.wait()
    }

    fn commands(&self) -> &Commands {
        &self.commands
    }
}

/// Bundles of 256 draws of a camera, each recorded on any thread, and an encoder for each camera, which executes them.
pub struct Bundles {
    commands: Commands,
    sorted: SortedItems,
    threads: Threads,
    /// Whether a bundle is executed again, as long as it draws the same items.
    keeps_bundles: bool,
    /// By camera.
    cameras: Vec<CameraBundles>,
}

/// The draws of a camera, and a bundle for each chunk of them.
#[derive(Default)]
struct CameraBundles {
    visible: Vec<u32>,
    bundles: Vec<Bundle>,
}

#[derive(Default)]
struct Bundle {
    items: Vec<u32>,
    bundle: Option<wgpu::RenderBundle>,
}

/// Fewer draws make bundles costly, more leave threads without work at the end.
const DRAWS_PER_BUNDLE: usize = 256;

impl Bundles {
    pub fn new(commands: Commands, world: &World, threads: &Threads, keeps_bundles: bool) -> Self {
        let cameras = world.cameras().iter().map(|_| CameraBundles::default()).collect();
        Self { commands, sorted: SortedItems::new(world), threads: threads.clone(), keeps_bundles, cameras }
    }

    /// Finds what each camera sees, and records the bundles that draw something else than before.
    fn record(&mut self, world: &World) {
        let Self { commands, sorted, threads, keeps_bundles, cameras } = self;
        if world.kind().moves_items() {
            sorted.update(&world.bounds, threads);
        }
        let mut views: Vec<_> = world.cameras().iter().zip(cameras.iter_mut()).collect();
        threads.for_each(&mut views, |(camera, own)| {
            sorted.find_visible(camera, &mut own.visible);
            own.bundles.resize_with(own.visible.len().div_ceil(DRAWS_PER_BUNDLE), Bundle::default);
        });
        let mut chunks = Vec::new();
        for (camera, own) in cameras.iter_mut().enumerate() {
            let own = own.visible.chunks(DRAWS_PER_BUNDLE).zip(&mut own.bundles);
            chunks.extend(own.map(|(items, bundle)| (camera, items, bundle)));
        }
        threads.for_each(&mut chunks, |(camera, items, bundle)| {
            if !*keeps_bundles || bundle.bundle.is_none() || bundle.items != *items {
                let mut encoder = commands.fixture.bundle_encoder();
                commands.record(&mut encoder, *camera, items);
                bundle.bundle = Some(encoder.finish(&wgpu::RenderBundleDescriptor::default()));
                items.clone_into(&mut bundle.items);
            }
        });
    }
}

impl OwnTechnique for Bundles {
    fn frame(&mut self, world: &World) -> Result<usize, Failure> {
        self.commands.upload(world, &self.threads);
        let moves = world.kind().moves_items() || world.kind().moves_cameras();
        if moves || !self.keeps_bundles || self.cameras.iter().any(|own| own.bundles.is_empty()) {
            self.record(world);
        }
        let Self { commands, threads, cameras, .. } = self;
        let mut views: Vec<_> = cameras.iter().enumerate().collect();
        let encoded = threads.map(&mut views, |(index, own)| {
            let mut encoder = commands.fixture.encoder();
            let bundles = own.bundles.iter().filter_map(|bundle| bundle.bundle.as_ref());
            commands.fixture.pass(&mut encoder, *index).execute_bundles(bundles);
            encoder.finish()
        });
        commands.fixture.queue.submit(encoded);
        Ok(cameras.iter().map(|own| own.visible.len()).sum())
    }

    fn wait(&self) -> Result<(), Failure> {
        self.commands.fixture.wait()
    }

    fn commands(&self) -> &Commands {
        &self.commands
    }
}
