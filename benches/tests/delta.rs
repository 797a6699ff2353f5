//! Delta coding of the commands of whole frames is lossless and compact.
//!
//! The case that needs a shared scene is ignored if that is missing, or fails with `DRAWLOOM_REQUIRE_SCENES=1`. A
//! generated hall stands in for it.

use std::path::Path;
use std::process::ExitCode;

use drawloom::scene::Scene;
use drawloom_benches::delta::DeltaCommands;
use drawloom_testing::demo;
use drawloom_testing::draw_lists::draw_lists;
use drawloom_testing::obj_files::hall;
use drawloom_testing::shared_scenes;
use libtest_mimic::{Arguments, Failed, Trial, run};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let trials = vec![
        Trial::test("colonnade", || check(&demo::colonnade()?)),
        Trial::test("hall_twenty_times", || {
            let folder = tempfile::tempdir()?;
            check_twenty_times(&hall().write_to(folder.path())?)
        }),
        Trial::test("shared::sponza_twenty_times", || {
            check_twenty_times(&shared_scenes::folder().join("sponza/sponza_part.obj"))
        })
        .with_ignored_flag(shared_scenes::are_optional_and_missing()),
    ];
    run(&arguments, trials).exit_code()
}

fn check_twenty_times(file: &Path) -> Result<(), Failed> {
    let mut scene = drawloom_obj::load(file)?.scene;
    demo::add_camera_and_lights(&mut scene);
    scene.duplicate_objects(20);
    check(&scene)
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
