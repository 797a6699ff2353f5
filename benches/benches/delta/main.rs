//! The savings and the cost of delta commands, compared with the fixed form of commands.
//!
//!     cargo bench -p drawloom-benches --bench delta
//!     cargo bench -p drawloom-benches --bench delta -- --quick
//!
//! Each round runs all operations in the order of their data flow, on the same sorted commands; the table shows
//! medians. They keep their memory from round to round, as they would from frame to frame. Copying the fixed form is
//! the alternative to storing deltas; comparing it with the last frame's detects that nothing changed.
//!
//! `target/drawloom/delta.json` has the same.

mod report;

use std::error::Error;
use std::hint::black_box;
use std::mem;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use drawloom::command::{DrawState, RenderCommand, SortKey};
use drawloom::quality::Quality;
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::delta::DeltaCommands;
use drawloom_benches::harness::progress_bar;
use drawloom_benches::statistics::median_duration;
use drawloom_output::print_diagnostic;
use drawloom_testing::demo;
use drawloom_testing::draw_lists::draw_lists;
use drawloom_testing::random::Random;
use drawloom_testing::shared_scenes;
use indicatif::ProgressBar;

use report::{Report, Row};

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let quick = drawloom_output::parse_arguments::<ExtentArguments>().is_quick();
    let rounds = if quick { 15 } else { 1_001 };
    let cases = cases()?;
    let progress = progress_bar("rounds");
    progress.set_length((cases.len() * rounds) as u64);
    let mut report = Report::new(rounds, quick);
    for case in &cases {
        progress.set_message(case.scene);
        report.add(measure(case, rounds, &progress));
    }
    progress.finish_and_clear();
    report.print();
    if !quick {
        report.write()?;
    }
    Ok(())
}

/// The sorted commands of a frame: one list per process and view.
struct Case {
    scene: &'static str,
    lists: Vec<Vec<RenderCommand>>,
}

fn cases() -> Result<Vec<Case>, Box<dyn Error>> {
    let mut cases = vec![
        Case { scene: "colonnade", lists: draw_lists(&demo::colonnade()?)? },
        Case { scene: "scattered", lists: vec![scattered(10_000)] },
    ];
    let sponza = shared_scenes::folder().join("sponza/sponza_part.obj");
    if sponza.is_file() {
        let mut scene = drawloom_obj::load(sponza)?.scene;
        demo::add_camera_and_lights(&mut scene);
        scene.duplicate_objects(20);
        cases.push(Case { scene: "sponza x 20", lists: draw_lists(&scene)? });
    } else {
        print_diagnostic!("sponza is left out: {} does not exist", sponza.display());
    }
    Ok(cases)
}

/// Objects of 64 meshes and 16 materials at random depths, one in ten blended.
fn scattered(objects: u32) -> Vec<RenderCommand> {
    let mut random = Random::new();
    let Quality { opaque_order, blended_order, .. } = Quality::exact();
    let command = |object: u32| {
        let (mesh, material) = (random.below(64) as u32, random.below(16) as u32);
        let (depth, state) = (random.between(100.0, 200.0) as f32, DrawState::PLAIN);
        let key = match object % 10 {
            0 => SortKey::blended(blended_order.quantize(depth, 0.05, f32::INFINITY)),
            _ => SortKey::opaque(state, mesh, opaque_order.quantize(depth, 0.05, f32::INFINITY)),
        };
        RenderCommand { key, object, mesh, material, state }
    };
    let mut commands: Vec<_> = (0..objects).map(command).collect();
    commands.sort_by_key(|command| (command.key, command.object));
    commands
}

/// Times all operations on a frame's commands.
fn measure(case: &Case, rounds: usize, progress: &ProgressBar) -> Row {
    let Case { scene, lists } = case;
    let commands: usize = lists.iter().map(Vec::len).sum();
    // A small frame is too short to be timed once.
    let frames = (10_000 / commands).max(1);
    let mut coded: Vec<_> = lists.iter().map(|_| DeltaCommands::new()).collect();
    let (mut copies, mut decoded) = (lists.clone(), lists.clone());
    let mut times: [Vec<Duration>; 5] = Default::default();
    for _ in 0..rounds {
        let mut operation = 0;
        let mut time = |mut run: Box<dyn FnMut() + '_>| {
            let start = Instant::now();
            (0..frames).for_each(|_| run());
            times[operation].push(start.elapsed());
            operation += 1;
        };
        time(Box::new(|| {
            for (coded, list) in coded.iter_mut().zip(lists) {
                coded.clear();
                coded.extend_from_slice(black_box(list));
            }
        }));
        time(Box::new(|| {
            for coded in &mut coded {
                let received = DeltaCommands::from_bytes(mem::take(coded).into_bytes());
                *coded = received.expect("the bytes are those that were encoded");
            }
        }));
        time(Box::new(|| {
            for (decoded, coded) in decoded.iter_mut().zip(&coded) {
                decoded.clear();
                decoded.extend(black_box(coded).iter());
            }
        }));
        time(Box::new(|| {
            for (copy, list) in copies.iter_mut().zip(lists) {
                copy.clear();
                copy.extend_from_slice(black_box(list));
            }
        }));
        time(Box::new(|| {
            assert!(black_box(lists) == black_box(&copies));
        }));
        assert!(decoded == *lists, "decoding must return the encoded commands");
        progress.inc(1);
    }
    let nanoseconds = |times: Vec<Duration>| median_duration(times).as_secs_f64() * 1e9 / (frames * commands) as f64;
    let [encode, check, decode, copy, compare] = times.map(nanoseconds);
    let bytes: usize = coded.iter().map(|coded| coded.bytes().len()).sum();
    Row { scene, commands, bytes: bytes as f64 / commands as f64, encode, check, decode, copy, compare }
}
