//! The pictures of the example `own_content` are compared with stored references.
//!
//! Without an adapter the cases are reported as ignored. With `DRAWLOOM_REQUIRE_ADAPTER=1` a missing adapter fails
//! them. Slow ones are ignored without `DRAWLOOM_SLOW_CASES=1`. `DRAWLOOM_RENEW_REFERENCES=1` rewrites the references:
//! check each of them before you commit it.

#[path = "../../examples/own_content/bloom.rs"]
mod bloom;
#[path = "../../examples/own_content/characters.rs"]
mod characters;
#[path = "../../examples/own_content/engine.rs"]
mod engine;
#[path = "../pictures/image_distance.rs"]
#[expect(dead_code, reason = "the pictures of other tests are compared in more ways")]
mod image_distance;
#[path = "../../examples/own_content/metal.rs"]
mod metal;
#[path = "../../examples/own_content/outline.rs"]
mod outline;
#[path = "../../examples/own_content/particles.rs"]
mod particles;
#[path = "../../examples/own_content/picking.rs"]
mod picking;
#[path = "../../examples/own_content/temporal.rs"]
mod temporal;
#[path = "../../examples/own_content/tints.rs"]
mod tints;
#[path = "../../examples/own_content/world.rs"]
mod world;

use std::error::Error;
use std::path::PathBuf;

use drawloom::backend::Picture;
use drawloom_testing::{adapter, slow_cases};
use libtest_mimic::{Arguments, Failed, Trial};

use crate::engine::Engine;
use crate::image_distance::{Distance, as_image};
use crate::world::World;

const SIZE: [u32; 2] = [320, 180];
const OBJECTS: usize = 2500;
const FRAMES: usize = 20;

type Draw = fn(&Engine, World) -> Result<Picture, Box<dyn Error>>;

const PICTURES: [(&str, Draw); 5] = [
    ("tints", tints),
    ("bloom", |engine, world| engine.bloom(&world)),
    ("particles", |engine, world| engine.particles(&world, FRAMES, || ())),
    ("smooth", |engine, mut world| engine.smooth(&mut world, FRAMES, || ())),
    ("characters", |engine, _| engine.characters(SIZE)),
];

/// Those that take several seconds.
const SLOW_PICTURES: [&str; 2] = ["smooth", "characters"];

fn main() {
    let arguments = Arguments::from_args();
    let has_adapter = adapter::device().is_ok();
    let required = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let trial = |(name, draw)| {
        let trial = Trial::test(format!("reference_of_{name}"), move || compare(name, draw));
        let is_too_slow = slow_cases::leave_out(&SLOW_PICTURES, name);
        trial.with_ignored_flag((!has_adapter && !required) || is_too_slow)
    };
    libtest_mimic::run(&arguments, PICTURES.map(trial).into()).exit();
}

fn tints(engine: &Engine, world: World) -> Result<Picture, Box<dyn Error>> {
    let (picture, object) = engine.tints(&world)?;
    // The ring in the middle is the second of three, behind all spheres.
    if object as usize == OBJECTS + 1 { Ok(picture) } else { Err(picking::describe(object).into()) }
}

fn compare(name: &str, draw: Draw) -> Result<(), Failed> {
    let engine = Engine::new(adapter::device()?)?;
    let drawn = as_image(&draw(&engine, World::new(OBJECTS, SIZE)?)?)?;
    let references = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/own_content/references");
    let path = references.join(format!("{name}.png"));
    if std::env::var_os("DRAWLOOM_RENEW_REFERENCES").is_some() {
        drawn.save(&path)?;
    }
    let distance = Distance::between(&drawn, &image::open(&path)?.to_rgb8())?;
    if distance.is_within_bound() {
        return Ok(());
    }
    let found = std::env::temp_dir().join(format!("drawloom-own-{name}.png"));
    drawn.save(&found)?;
    Err(format!("{distance:?} between {} and {}", path.display(), found.display()).into())
}
