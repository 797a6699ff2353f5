//! Both worlds give the renderer the scene that the population describes, and report all changes.

use std::collections::BTreeSet;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom_testing::adapter;

use crate::bevy_world::BevyWorld;
use crate::components::{Orientation, Position};
use crate::engine_world::{EngineWorld, Lend};
use crate::graphics::Graphics;
use crate::hecs_world::HecsWorld;
use crate::population::{Kind, Population};
use crate::scene_columns::{LentScene, SceneColumns};

const ENTITIES: u32 = 150;
const STEP: f64 = 0.1;

/// What an object looks like, and where it is, in bits.
type ObjectBits = ([u64; 3], [u32; 4], u32, usize);

fn noop_graphics() -> Graphics {
    let (device, queue) = adapter::noop_device().unwrap();
    Graphics::new(device, queue).unwrap()
}

fn in_scene(graphics: &Graphics, scene: LentScene<'_>) -> BTreeSet<ObjectBits> {
    let object = |object: usize| {
        let material = graphics.looks.materials.iter().position(|material| *material == scene.materials[object]);
        bits(scene.positions[object], scene.orientations[object], scene.scales[object], material.unwrap())
    };
    (0..scene.positions.len()).map(object).collect()
}

fn bits(position: DVec3, orientation: Quat, scale: Vec3, material: usize) -> ObjectBits {
    (position.to_array().map(f64::to_bits), orientation.to_array().map(f32::to_bits), scale.x.to_bits(), material)
}

/// Where the entity of a number is in a frame, if this number is replaced in each. Entities that stand still are where
/// they were when they were spawned: in the frame after whose update that was.
fn expected(population: Population, frame: u64, replaced: u64) -> BTreeSet<ObjectBits> {
    let oldest = (frame + 1) * replaced;
    let numbers = oldest..oldest + u64::from(population.entities);
    let object = |number: u64| {
        let spawned_in = number.checked_sub(u64::from(population.entities)).map_or(0, |later| later / replaced);
        let moves = matches!(population.kind(number), Kind::Moving | Kind::MovingFriend | Kind::MovingFoe);
        let frame = if moves { frame } else { spawned_in };
        let (Position(position), Orientation(orientation)) = population.wave(number).pose(frame as f64 * STEP);
        bits(position, orientation, Vec3::splat(0.25 + 0.05 * (number % 4) as f32), (number % 3) as usize)
    };
    numbers.map(object).collect()
}

fn check(graphics: &mut Graphics, mut world: impl EngineWorld, population: Population, replaced: u32) {
    let mut columns = SceneColumns::default();
    world.spawn(population.entities, graphics.looks, 0.0);
    for frame in 0..40 {
        let time = frame as f64 * STEP;
        world.update(&graphics.scheduler, time).unwrap();
        world.despawn_oldest(replaced);
        world.spawn(replaced, graphics.looks, time);
        let lent = world.lend();
        let archetypes = lent.archetypes();
        let scene = columns.update(&archetypes);
        assert_eq!(in_scene(graphics, scene), expected(population, frame, u64::from(replaced)));
        let changed: Vec<_> = scene.changed.iter().cloned().flatten().collect();
        assert!(changed.is_sorted_by(|before, after| before < after), "{changed:?}");
        // With debug assertions, the renderer refuses a frame with an object that changed and was not reported.
        graphics.draw(scene, false).unwrap();
        drop(archetypes);
        drop(lent);
        world.end_frame();
        if replaced == 0 && frame > 0 {
            // 24 bytes of position and 16 of orientation for each entity that moves, unless they are read in place.
            let moving = match population.name {
                "one archetype, all move" => 0,
                "three archetypes, all move" => 150,
                _ => 15,
            };
            assert_eq!(columns.bytes_copied, moving * 40, "{}", population.name);
        }
    }
}

#[test]
fn scenes_are_what_the_population_describes() {
    let mut graphics = noop_graphics();
    for population in Population::all(ENTITIES) {
        for replaced in [0, 1, 7, 150] {
            check(&mut graphics, HecsWorld::new(population), population, replaced);
            check(&mut graphics, BevyWorld::new(population), population, replaced);
        }
    }
}

#[test]
fn archetypes_may_become_one_and_several_again() {
    let mut graphics = noop_graphics();
    let [one, several, _] = Population::all(ENTITIES);
    let [mut first, mut second] = [one, several].map(HecsWorld::new);
    let mut columns = SceneColumns::default();
    first.spawn(ENTITIES, graphics.looks, 0.0);
    second.spawn(ENTITIES, graphics.looks, 0.0);
    for frame in 0..8 {
        let world = if frame % 2 == 0 { &mut first } else { &mut second };
        let time = (frame / 2) as f64 * STEP;
        world.update(&graphics.scheduler, time).unwrap();
        world.despawn_oldest(1);
        world.spawn(1, graphics.looks, time);
        let lent = world.lend();
        let archetypes = lent.archetypes();
        let scene = columns.update(&archetypes);
        assert_eq!(in_scene(&graphics, scene), expected(one, frame / 2, 1));
        graphics.draw(scene, false).unwrap();
    }
}
