//! The processes of a frame follow from the objects and lights that it draws, and not from those that it could draw.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::process::{
    ClearColor, Declare, Deferred, DeviceSupport, Format, Pipeline, PipelineProcesses, PlanError, Requirements,
    SceneContents,
};
use drawloom::quality::Quality;
use drawloom::scene::{Assets, Blend, Bounds, Camera, Changes, Light, Material, MaterialType, Mesh, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer};
use drawloom_testing::random::Random;
use drawloom_testing::scenes::cube;
use parking_lot::Mutex;
use proptest::prelude::*;

use crate::declaring::Declaring;

const GLOW: MaterialType<[f32; 4]> = MaterialType::new("glow");

/// An engine's own storage of objects, all of one mesh.
struct World {
    assets: Assets,
    mesh: Handle<Mesh>,
    stone: Handle<Material>,
    cameras: Vec<Camera>,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

impl World {
    /// Opaque objects of one material.
    fn new(objects: usize) -> Self {
        let mut assets = Assets::default();
        let mesh = assets.add(cube()).unwrap();
        let stone = assets.add(Material::default()).unwrap();
        let cameras = vec![Camera::looking_at("main", DVec3::Z * 50.0, DVec3::ZERO)];
        let mut world = Self {
            assets,
            mesh,
            stone,
            cameras,
            positions: Vec::new(),
            orientations: Vec::new(),
            scales: Vec::new(),
            bounds: Vec::new(),
            meshes: Vec::new(),
            materials: Vec::new(),
        };
        (0..objects).for_each(|_| world.add(stone));
        world
    }

    fn add(&mut self, material: Handle<Material>) {
        let index = self.positions.len() as f64;
        self.positions.push(DVec3::new(index % 20.0 - 10.0, index / 20.0 - 5.0, 0.0));
        self.orientations.push(Quat::IDENTITY);
        self.scales.push(Vec3::splat(0.4));
        self.bounds.push(cube().bounds());
        self.meshes.push(self.mesh);
        self.materials.push(material);
    }

    /// Removes an object; the last one takes its index.
    fn remove(&mut self, object: usize) {
        self.positions.swap_remove(object);
        self.orientations.swap_remove(object);
        self.scales.swap_remove(object);
        self.bounds.swap_remove(object);
        self.meshes.swap_remove(object);
        self.materials.swap_remove(object);
    }

    fn scene<'a>(&'a self, changes: Changes<'a>) -> SceneRef<'a> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            cameras: &self.cameras,
            changes,
            ..SceneRef::new(&self.assets)
        }
    }

    /// Whether an object is blended and of no material type, by looking at all of them.
    fn has_glass(&self) -> bool {
        let materials = self.materials.iter().filter_map(|material| self.assets.get(*material).ok());
        materials.filter(|material| material.values.is_none()).any(|material| material.blend != Blend::None)
    }
}

fn glass() -> Material {
    Material { blend: Blend::Alpha, opacity: 0.5, ..Material::default() }
}

fn glowing(material: Material) -> Material {
    Material { values: Some(GLOW.values([1.0; 4])), ..material }
}

fn new_renderer() -> Renderer<NullBackend> {
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap().0
}

/// Whether a frame of the scene has the process for transparency.
fn has_transparency(renderer: &mut Renderer<NullBackend>, scene: SceneRef<'_>) -> bool {
    drop(renderer.record(scene).unwrap());
    let names: Vec<_> = renderer.plan().processes().iter().map(|planned| planned.name.as_str()).collect();
    let has_it = names.contains(&"transparency");
    let expected: &[_] = if has_it {
        &["geometry buffer", "transparency", "tone mapping"]
    } else {
        &["geometry buffer", "tone mapping"]
    };
    assert_eq!(names, expected);
    has_it
}

/// The changes if the renderer is told of them.
fn told(is_told: bool, changes: Changes<'_>) -> Changes<'_> {
    if is_told { changes } else { Changes::Unknown }
}

#[test]
fn a_blended_material_that_no_object_has_adds_no_process() {
    let mut world = World::new(100);
    let pane = world.assets.add(glass()).unwrap();
    let mut renderer = new_renderer();
    for changes in [Changes::Unknown, Changes::NONE, Changes::Objects(&[3]), Changes::Unknown] {
        assert!(!has_transparency(&mut renderer, world.scene(changes)));
    }
    assert_eq!(renderer.plan_count(), 1);
    // Pipelines are prepared for what the scene draws, and for what has every shader.
    renderer.prepare_pipelines(world.scene(Changes::Unknown)).unwrap();
    assert_eq!(renderer.plan_count(), 4);
    // Nor does an object whose material is gone, even if another one has its slot.
    world.materials[7] = pane;
    world.assets.remove(pane).unwrap();
    assert!(!has_transparency(&mut renderer, world.scene(Changes::Objects(&[7]))));
    let other = world.assets.add(glass()).unwrap();
    assert_eq!(other.index(), pane.index());
    assert!(!has_transparency(&mut renderer, world.scene(Changes::Objects(&[7]))));
    world.materials[7] = other;
    renderer.prepare_pipelines(world.scene(Changes::Unknown)).unwrap();
    assert_eq!(renderer.plan_count(), 5);
}

#[test]
fn the_process_comes_and_goes_in_the_frame_in_which_an_object_changes() {
    for is_told in [true, false] {
        let mut world = World::new(300);
        let (stone, pane) = (world.stone, world.assets.add(glass()).unwrap());
        let mut renderer = new_renderer();
        assert!(!has_transparency(&mut renderer, world.scene(Changes::Unknown)));
        world.materials[130] = pane;
        assert!(has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&[7, 130])))));
        assert!(has_transparency(&mut renderer, world.scene(told(is_told, Changes::NONE))));
        world.materials[130] = stone;
        assert!(!has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&[130])))));
        assert!(!has_transparency(&mut renderer, world.scene(told(is_told, Changes::NONE))));
        // The second one within a range; and an object that is new, which need not be reported.
        world.materials[256] = pane;
        assert!(has_transparency(&mut renderer, world.scene(told(is_told, Changes::Ranges(&[0..3, 200..300])))));
        world.materials[256] = stone;
        world.add(pane);
        assert!(has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&[256])))));
    }
}

#[test]
fn the_process_stays_while_another_object_needs_it() {
    for is_told in [true, false] {
        let mut world = World::new(300);
        let stone = world.stone;
        let panes = [(); 2].map(|()| world.assets.add(glass()).unwrap());
        let glazed = [299, 10, 150];
        glazed.into_iter().for_each(|object| world.materials[object] = panes[0]);
        let mut renderer = new_renderer();
        assert!(has_transparency(&mut renderer, world.scene(Changes::Unknown)));
        // Whichever of them the renderer knows, the others are found. One keeps it with another material.
        for object in [10, 150_u32] {
            world.materials[object as usize] = stone;
            let changed = [object];
            assert!(
                has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&changed)))),
                "{object}"
            );
        }
        world.materials[299] = panes[1];
        assert!(has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&[299])))));
        world.materials[5] = panes[0];
        assert!(has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&[5])))));
        world.materials[299] = stone;
        assert!(has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&[299])))));
        world.materials[5] = stone;
        assert!(!has_transparency(&mut renderer, world.scene(told(is_told, Changes::Objects(&[5])))));
    }
}

#[test]
fn removed_objects_need_nothing() {
    let mut world = World::new(300);
    let pane = world.assets.add(glass()).unwrap();
    world.materials[299] = pane;
    world.materials[80] = pane;
    let mut renderer = new_renderer();
    assert!(has_transparency(&mut renderer, world.scene(Changes::Unknown)));
    // The last one takes the index of the first, which needs it too.
    world.remove(80);
    assert!(has_transparency(&mut renderer, world.scene(Changes::Objects(&[80]))));
    world.remove(80);
    assert!(!has_transparency(&mut renderer, world.scene(Changes::Objects(&[80]))));
    world.add(pane);
    assert!(has_transparency(&mut renderer, world.scene(Changes::NONE)));
    world.remove(298);
    assert!(!has_transparency(&mut renderer, world.scene(Changes::NONE)));
    world.add(pane);
    assert!(has_transparency(&mut renderer, world.scene(Changes::NONE)));
    (0..299).for_each(|_| world.remove(0));
    assert!(!has_transparency(&mut renderer, world.scene(Changes::NONE)));
}

#[test]
fn a_material_that_changes_in_place_changes_what_its_objects_need() {
    let mut world = World::new(300);
    let pane = world.assets.add(Material::default()).unwrap();
    world.materials[200] = pane;
    let mut renderer = new_renderer();
    let mut replaced = |material| {
        world.assets.replace(pane, material).unwrap();
        has_transparency(&mut renderer, world.scene(Changes::NONE))
    };
    assert!(!replaced(Material::default()));
    assert!(replaced(glass()));
    assert!(replaced(Material { blend: Blend::Additive, ..Material::default() }));
    assert!(!replaced(Material::default()));
    // Objects of a material type are left to the process that reads it. Their draw states are the same.
    assert!(!replaced(glowing(glass())));
    assert!(replaced(glass()));
    assert!(!replaced(glowing(glass())));
    assert!(replaced(glass()));
    world.assets.remove(pane).unwrap();
    assert!(!has_transparency(&mut renderer, world.scene(Changes::NONE)));
    // A new material in the same slot is not the one that the object has.
    let other = world.assets.add(glass()).unwrap();
    assert_eq!(other.index(), pane.index());
    assert!(!has_transparency(&mut renderer, world.scene(Changes::NONE)));
}

#[test]
fn a_scene_of_other_assets_needs_what_its_own_objects_need() {
    let mut glazed = World::new(50);
    let pane = glazed.assets.add(glass()).unwrap();
    glazed.materials[20] = pane;
    let mut opaque = World::new(50);
    opaque.assets.add(glass()).unwrap();
    let mut renderer = new_renderer();
    for _ in 0..2 {
        assert!(!has_transparency(&mut renderer, opaque.scene(Changes::Unknown)));
        assert!(has_transparency(&mut renderer, glazed.scene(Changes::Unknown)));
    }
}

#[test]
fn a_failed_frame_loses_no_change() {
    let mut world = World::new(300);
    let (stone, pane) = (world.stone, world.assets.add(glass()).unwrap());
    let mut renderer = new_renderer();
    assert!(!has_transparency(&mut renderer, world.scene(Changes::Unknown)));
    let far_away = [Camera::looking_at("far away", DVec3::splat(1e12), DVec3::ZERO)];
    for cameras in [&[], &far_away[..]] {
        for (material, needs_it) in [(pane, true), (stone, false)] {
            world.materials[77] = material;
            let failing = SceneRef { cameras, ..world.scene(Changes::Objects(&[77])) };
            assert!(renderer.record(failing).is_err());
            // The change was reported to the frame that failed.
            assert_eq!(has_transparency(&mut renderer, world.scene(Changes::NONE)), needs_it);
        }
    }
}

/// What is not reported is drawn as it was: with debug assertions, the frame fails instead.
#[test]
fn a_change_that_is_not_reported_is_not_noticed() {
    let mut world = World::new(300);
    let (stone, pane) = (world.stone, world.assets.add(glass()).unwrap());
    world.materials[77] = pane;
    let mut renderer = new_renderer();
    assert!(has_transparency(&mut renderer, world.scene(Changes::Unknown)));
    world.materials[77] = stone;
    let result = renderer.record(world.scene(Changes::NONE)).map(drop);
    assert_eq!(cfg!(debug_assertions), matches!(result, Err(FrameError::Scene(_))));
    assert!(renderer.plan().processes().iter().any(|planned| planned.name == "transparency"));
}

/// A pipeline that keeps the lights that it was last asked about.
#[derive(Default)]
struct Asked(Mutex<Vec<Light>>);

impl Pipeline for Asked {
    fn requirements(&self, scene: &SceneContents<'_>) -> Requirements {
        *self.0.lock() = scene.lights.to_vec();
        Requirements::default()
    }

    fn build(&self, _: &Requirements, _: DeviceSupport, processes: &mut PipelineProcesses) -> Result<(), PlanError> {
        let clear = |declare: &mut Declare| declare.clears_color("clear", Format::Rgba8Unorm, ClearColor::Background);
        processes.process(Declaring::new("clear", clear));
        processes.output("clear");
        Ok(())
    }
}

#[test]
fn frames_and_preparations_ask_about_the_same_lights() {
    let world = World::new(10);
    let light = |intensity, range| {
        let position = DVec3::ZERO;
        Light::Point { position, intensity: Vec3::splat(intensity), range, casts_shadow: false }
    };
    let lights = [light(1.0, 100.0), light(0.0, 100.0), light(1.0, f32::NAN), light(4.0, 1.0)];
    let scene = SceneRef { lights: &lights, ..world.scene(Changes::Unknown) };
    let asked = Arc::new(Asked::default());
    let quality = Quality { light_cut_off: 0.25, ..Quality::balanced() };
    let builder = Renderer::builder(NullBackend).pipeline(Arc::clone(&asked)).quality(quality);
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    drop(renderer.record(scene).unwrap());
    let of_frame = std::mem::take(&mut *asked.0.lock());
    assert_eq!(of_frame, [light(1.0, 2.0), light(4.0, 1.0)]);
    renderer.prepare_pipelines(scene).unwrap();
    assert_eq!(*asked.0.lock(), of_frame);
}

/// Changes a world at random, mostly towards few objects that need transparency. Returns the objects that changed.
fn change(world: &mut World, known: &mut [Handle<Material>], random: &mut Random) -> Vec<u32> {
    let mut changed = Vec::new();
    let kinds = [Material::default(), glass(), glowing(glass()), glowing(Material::default())];
    for _ in 0..random.below(4) {
        let count = world.positions.len();
        match random.below(8) {
            0 | 1 if count > 0 => {
                let object = random.below(count);
                world.materials[object] = known[random.below(known.len())];
                changed.push(object as u32);
            }
            // All objects of one material get another one.
            2 => {
                let (from, to) = (known[random.below(known.len())], known[random.below(known.len())]);
                for object in 0..count {
                    if world.materials[object] == from {
                        world.materials[object] = to;
                        changed.push(object as u32);
                    }
                }
            }
            3 if count > 0 => {
                let object = random.below(count);
                world.remove(object);
                changed.push(object as u32);
            }
            4 => {
                // Reported, since an object may have been removed in the same step.
                changed.push(count as u32);
                world.add(known[random.below(known.len())]);
            }
            // Nothing happens if the material is gone.
            5 => drop(world.assets.replace(known[random.below(known.len())], kinds[random.below(4)].clone())),
            6 => {
                // Its objects go on to use the stale handle.
                drop(world.assets.remove(known[random.below(known.len())]));
            }
            _ => {
                let index = random.below(known.len());
                known[index] = world.assets.add(kinds[random.below(4)].clone()).unwrap();
            }
        }
    }
    changed
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_process_is_there_exactly_if_one_object_among_all_needs_it(seed in any::<u64>(), count in 0_usize..200) {
        let mut random = Random::stream(seed);
        let mut world = World::new(count);
        let mut known = vec![world.stone; 3];
        known.extend([(); 3].map(|()| world.assets.add(glass()).unwrap()));
        let mut renderer = new_renderer();
        let mut changed = Vec::new();
        for step in 0..40 {
            let changes = if random.below(6) == 0 { Changes::Unknown } else { Changes::Objects(&changed) };
            if random.below(6) == 0 {
                let failing = SceneRef { cameras: &[], ..world.scene(changes) };
                prop_assert!(renderer.record(failing).is_err());
            } else {
                let found = has_transparency(&mut renderer, world.scene(changes));
                prop_assert_eq!(found, world.has_glass(), "in step {}", step);
            }
            changed = change(&mut world, &mut known, &mut random);
        }
    }
}
