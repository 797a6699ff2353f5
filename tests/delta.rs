//! Delta commands of whole frames: they come back as they were, and take few bytes.
//!
//! The case that needs a shared scene is ignored, and never passes, where that is missing.

use std::path::PathBuf;
use std::process::ExitCode;

use drawloom::command::DeltaCommands;
use drawloom::demo;
use drawloom::scene::{Scene, obj};
use drawloom_testing::draw_lists::draw_lists;
use libtest_mimic::{Arguments, Failed, Trial, run};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let sponza = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes/sponza/sponza_part.obj");
    let is_missing = !sponza.is_file();
    let trials = vec![
        Trial::test("the_projects_own_scene", || check(&demo::colonnade()?)),
        Trial::test("shared::sponza_twenty_times", move || {
            let mut scene = obj::load(sponza)?.scene;
            demo::add_camera_and_lights(&mut scene);
            scene.duplicate_objects(20);
            check(&scene)
        })
        .with_ignored_flag(is_missing),
    ];
    run(&arguments, trials).exit_code()
}

/// What a command may take on average, in bytes: half of its fixed form.
const MOST: f64 = 12.0;

/// Codes what each process draws in each view of a frame, by itself.
fn check(scene: &Scene) -> Result<(), Failed> {
    let lists = draw_lists(scene)?;
    let (mut count, mut bytes) = (0, 0);
    let mut coded = DeltaCommands::new();
    for commands in &lists {
        coded.clear();
        coded.extend_from_slice(commands);
        let received = DeltaCommands::from_bytes(coded.bytes().to_vec())?;
        if !received.iter().eq(commands.iter().copied()) {
            return Err("not the commands that were coded".into());
        }
        count += commands.len();
        bytes += coded.bytes().len();
    }
    let average = bytes as f64 / count as f64;
    println!("{count} commands in {} lists, {average:.2} bytes each", lists.len());
    // Not a single command would be NaN.
    if average <= MOST { Ok(()) } else { Err(format!("{average:.1} bytes a command").into()) }
}
