//! What moves, against the same scenes with all vertices where plain arithmetic puts them.

use drawloom_gltf::LoadOptions;
use libtest_mimic::Failed;

use crate::fixture::{AT_REST, Drawn, draw_builder, expect};
use crate::generate::builder::Builder;
use crate::generate::deforming::{bending_tube, interpolations, mirrored_tube, morphing_sphere};
use crate::generate::static_scenes::hierarchy;

pub const CASES: &[crate::Case] = &[
    ("joints_bend_a_tube_as_arithmetic_does", joints),
    ("morph_targets_move_positions_and_normals_as_arithmetic_does", morph_targets),
    ("keyframes_are_interpolated_as_arithmetic_does", keyframes),
    ("nodes_turn_scale_mirror_and_skew_as_matrices_do", nodes),
];

fn joints() -> Result<(), Failed> {
    moves_as("joints", bending_tube, &[0.0, 0.8, 1.5, 9.0])?;
    moves_as("mirrored joints", mirrored_tube, &[0.0, 1.5])
}

fn morph_targets() -> Result<(), Failed> {
    moves_as("morph targets", morphing_sphere, &[0.0, 0.8, 2.0])
}

fn keyframes() -> Result<(), Failed> {
    moves_as("keyframes", interpolations, &[-1.0, 0.0, 0.4, 1.0, 1.7, 2.0])
}

fn nodes() -> Result<(), Failed> {
    let placed = draw_builder("nodes", &hierarchy(false), &AT_REST)?;
    let flat = draw_builder("nodes, flat", &hierarchy(true), &AT_REST)?;
    is_same("nodes", &placed, &flat)?;
    shows_something(&placed)
}

/// Draws a scene at some times, and with its vertices where they are then.
fn moves_as(name: &str, scene: fn(Option<f64>) -> Builder, times: &[f64]) -> Result<(), Failed> {
    let mut earlier: Option<Drawn> = None;
    for &time in times {
        let options = LoadOptions { time: Some(time.min(2.0)), ..AT_REST };
        let moved = draw_builder(name, &scene(None), &options)?;
        let flat = draw_builder(&format!("{name}, flat"), &scene(Some(time)), &AT_REST)?;
        is_same(&format!("{name} at {time} s"), &moved, &flat)?;
        shows_something(&moved)?;
        if let Some(earlier) = earlier.filter(|_| time > 0.0) {
            expect(earlier.difference(&moved) > 100, || format!("at {time} s nothing has moved"))?;
        }
        earlier = Some(moved);
    }
    Ok(())
}

/// Shadow maps of unequal bounds differ by some pixels.
fn is_same(name: &str, one: &Drawn, other: &Drawn) -> Result<(), Failed> {
    let different = one.difference(other);
    expect(different < 30, || format!("{name}: {different} pixels differ"))
}

fn shows_something(drawn: &Drawn) -> Result<(), Failed> {
    let [darkest, brightest] = drawn.extremes([0.1, 0.9], [0.1, 0.9]);
    expect(brightest - darkest > 200, || "the picture is empty".to_owned())
}
