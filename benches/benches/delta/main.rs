//! What delta commands save and cost, beside the fixed form of commands.
//!
//!     cargo bench -p drawloom-benches --bench delta
//!     cargo bench -p drawloom-benches --bench delta -- --quick
//!
//! All contenders take turns on the same sorted commands, so that whatever else the machine does meets them alike; what is
//! shown is the median. They keep their memory from turn to turn, as they would from frame to frame. A copy of the fixed form is
//! what storing a frame's commands costs otherwise, and comparing it with the last frame's is how to find out that
//! nothing changed.
//!
//! Written to `drawloom/delta.json` in the target folder too.

mod report;

use std::error::Error;
use std::hint::black_box;
use std::mem;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Parser;
use drawloom::command::{DeltaCommands, DrawState, RenderCommand, SortKey};
use drawloom::demo;
use drawloom::quality::Quality;
use drawloom::scene::obj;
use drawloom_benches::quick::Quick;
use drawloom_benches::stopwatch::median;
use drawloom_testing::draw_lists::draw_lists;
use drawloom_testing::random::Random;
use indicatif::{ProgressBar, ProgressStyle};

use report::{Report, Row};

fn main() -> Result<(), Box<dyn Error>> {
    let quick = Quick::parse().is_quick();
    let rounds = if quick { 15 } else { 1_001 };
    let cases = cases()?;
    let progress = ProgressBar::new((cases.len() * rounds) as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} rounds, {eta} left  {msg}")?);
    let mut report = Report::new(rounds, quick);
    for case in &cases {
        progress.set_message(case.scene);
        report.add(measure(case, rounds, &progress));
    }
    progress.finish_and_clear();
    report.print();
    // A trial must not take the place of what was measured.
    if !quick {
        report.write()?;
    }
    Ok(())
}

/// The sorted commands of a frame: a list for each process in each view.
struct Case {
    scene: &'static str,
    lists: Vec<Vec<RenderCommand>>,
}

fn cases() -> Result<Vec<Case>, Box<dyn Error>> {
    let mut cases = vec![
        Case { scene: "colonnade", lists: draw_lists(&demo::colonnade()?)? },
        Case { scene: "scattered", lists: vec![scattered(10_000)] },
    ];
    let sponza = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes/sponza/sponza_part.obj");
    if sponza.is_file() {
        let mut scene = obj::load(sponza)?.scene;
        demo::add_camera_and_lights(&mut scene);
        scene.duplicate_objects(20);
        cases.push(Case { scene: "sponza x 20", lists: draw_lists(&scene)? });
    } else {
        eprintln!("sponza is left out: there is no {}", sponza.display());
    }
    Ok(cases)
}

/// Objects of 64 meshes and 16 materials anywhere in a view, one in ten blended.
fn scattered(objects: u32) -> Vec<RenderCommand> {
    let mut random = Random::new();
    let Quality { opaque_order, blended_order, .. } = Quality::balanced();
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

/// Lets everything that can be done with a frame's commands take turns.
fn measure(case: &Case, rounds: usize, progress: &ProgressBar) -> Row {
    let Case { scene, lists } = case;
    let commands: usize = lists.iter().map(Vec::len).sum();
    // A small frame is too short for the clock.
    let frames = (10_000 / commands).max(1);
    let mut coded: Vec<_> = lists.iter().map(|_| DeltaCommands::new()).collect();
    let (mut copies, mut decoded) = (lists.clone(), lists.clone());
    let mut times: [Vec<Duration>; 5] = Default::default();
    for _ in 0..rounds {
        let mut turn = 0;
        let mut time = |mut act: Box<dyn FnMut() + '_>| {
            let start = Instant::now();
            (0..frames).for_each(|_| act());
            times[turn].push(start.elapsed());
            turn += 1;
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
                *coded = received.expect("nothing has happened to them");
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
        assert!(decoded == *lists, "commands come back as they were");
        progress.inc(1);
    }
    let nanoseconds = |times: Vec<Duration>| median(times).as_secs_f64() * 1e9 / (frames * commands) as f64;
    let [encode, check, decode, copy, compare] = times.map(nanoseconds);
    let bytes: usize = coded.iter().map(|coded| coded.bytes().len()).sum();
    Row { scene, commands, bytes: bytes as f64 / commands as f64, encode, check, decode, copy, compare }
}
