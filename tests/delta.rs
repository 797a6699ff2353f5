//! Delta coding of the commands of whole frames is lossless and compact.
//!
//! The case that needs a shared scene is ignored if that is missing, or fails with `DRAWLOOM_REQUIRE_SCENES=1`.

use std::process::ExitCode;

use drawloom::command::DeltaCommands;
use drawloom::demo;
use drawloom::scene::{Scene, obj};
use drawloom_testing::draw_lists::draw_lists;
use drawloom_testing::shared_scenes;
use libtest_mimic::{Arguments, Failed, Trial, run};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let trials = vec![
        Trial::test("colonnade", || check(&demo::colonnade()?)),
        Trial::test("shared::sponza_twenty_times", || {
            let mut scene = obj::load(shared_scenes::folder().join("sponza/sponza_part.obj"))?.scene;
            demo::add_camera_and_lights(&mut scene);
            scene.duplicate_objects(20);
            check(&scene)
        })
        .with_ignored_flag(shared_scenes::are_optional_and_missing()),
    ];
    run(&arguments, trials).exit_code()
}

/// The largest allowed average size of a command, in bytes: half of its uncompressed size.
const MAX_AVERAGE_BYTES: f64 = 12.0;

/// Encodes and decodes each draw list of a frame separately.
fn check(scene: &Scene) -> Result<(), Failed> {
    let lists = draw_lists(scene)?;
    let (mut count, mut bytes) = (0, 0);
    let mut encoded = DeltaCommands::new();
    for commands in &lists {
        encoded.clear();
        encoded.extend_from_slice(commands);
        let decoded = DeltaCommands::from_bytes(encoded.bytes().to_vec())?;
        if !decoded.iter().eq(commands.iter().copied()) {
            return Err("the decoded commands differ".into());
        }
        count += commands.len();
        bytes += encoded.bytes().len();
    }
    let average = bytes as f64 / count as f64;
    println!("{count} commands in {} lists, {average:.2} bytes each", lists.len());
    // Without commands the average is NaN, which fails.
    if average <= MAX_AVERAGE_BYTES { Ok(()) } else { Err(format!("{average:.1} bytes per command").into()) }
}
