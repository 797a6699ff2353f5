//! Where the camera goes.

use std::f64::consts::TAU;

use drawloom::glam::{DQuat, DVec3};
use drawloom::scene::{Camera, Scene};

use crate::Failure;
use crate::arguments::Arguments;

/// The scene's first camera at each place of the path.
///
/// # Errors
/// If a file cannot be read or a line of it is no place, or if the scene has no camera.
pub fn of(scene: &Scene, arguments: &Arguments) -> Result<Vec<Camera>, Failure> {
    let first = scene.cameras.first().ok_or("the scene has no camera")?;
    let camera = Camera { size: arguments.size(), ..first.clone() };
    match arguments.camera_path.as_str() {
        "sway" => Ok(sway(scene, &camera, Arguments::PLACES)),
        "orbit" => Ok(orbit(scene, &camera, Arguments::PLACES)),
        file => {
            let text = std::fs::read_to_string(file).map_err(|error| format!("{file} could not be read: {error}"))?;
            let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
            let places = lines.map(|(index, line)| {
                let (position, target) = place(line).map_err(|error| format!("{file}, line {}: {error}", index + 1))?;
                Ok(looking(&camera, position, target))
            });
            let places = places.collect::<Result<Vec<_>, Failure>>()?;
            if places.is_empty() { Err(format!("{file} has no place in it").into()) } else { Ok(places) }
        }
    }
}

/// To the right by a hundredth of the way to the scene's middle in each frame.
fn sway(scene: &Scene, camera: &Camera, count: usize) -> Vec<Camera> {
    let step = (middle(scene) - camera.position).length().max(0.1) * 0.01;
    let right = camera.orientation.as_dquat() * DVec3::X;
    let moved = |index: usize| Camera { position: camera.position + right * (step * index as f64), ..camera.clone() };
    (0..count).map(moved).collect()
}

/// Around the scene's middle, from where the camera stands.
fn orbit(scene: &Scene, camera: &Camera, count: usize) -> Vec<Camera> {
    let middle = middle(scene);
    let around = |index: usize| {
        let turn = DQuat::from_rotation_y(TAU * index as f64 / count as f64);
        looking(camera, middle + turn * (camera.position - middle), middle)
    };
    (0..count).map(around).collect()
}

/// Of the box around all objects.
fn middle(scene: &Scene) -> DVec3 {
    let mut corners = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for position in scene.as_scene_ref().positions {
        corners = [corners[0].min(*position), corners[1].max(*position)];
    }
    if corners[0].is_finite() { (corners[0] + corners[1]) * 0.5 } else { DVec3::ZERO }
}

fn looking(camera: &Camera, position: DVec3, target: DVec3) -> Camera {
    let placed = Camera::looking_at(camera.name.clone(), position, target);
    Camera { position, orientation: placed.orientation, ..camera.clone() }
}

fn place(line: &str) -> Result<(DVec3, DVec3), String> {
    let numbers = line.split(',').map(|part| part.trim().parse::<f64>().map_err(|error| format!("{part:?}: {error}")));
    let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
    let &[x, y, z, target_x, target_y, target_z] = numbers.as_slice() else {
        return Err(format!("six numbers are wanted, not {}", numbers.len()));
    };
    let (position, target) = (DVec3::new(x, y, z), DVec3::new(target_x, target_y, target_z));
    if !position.is_finite() || !target.is_finite() || position == target {
        return Err("a camera needs a finite place, and another to look at".to_owned());
    }
    Ok((position, target))
}
