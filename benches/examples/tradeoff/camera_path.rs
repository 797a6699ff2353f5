//! Camera paths.

use std::f64::consts::TAU;

use drawloom::glam::{DQuat, DVec3};
use drawloom::scene::{Camera, Scene};

use crate::Failure;
use crate::arguments::Arguments;

/// The scene's first camera at each position of the path.
///
/// # Errors
/// Returns an error if the file cannot be read or parsed, or if the scene has no camera.
pub fn of(scene: &Scene, arguments: &Arguments) -> Result<Vec<Camera>, Failure> {
    let first = scene.cameras.first().ok_or("the scene has no camera")?;
    let camera = Camera { size: arguments.size(), ..first.clone() };
    match arguments.camera_path.as_str() {
        "sway" => Ok(sway(scene, &camera, arguments.path_positions())),
        "orbit" => Ok(orbit(scene, &camera, arguments.path_positions())),
        file => {
            let text = std::fs::read_to_string(file).map_err(|error| format!("{file} could not be read: {error}"))?;
            let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
            let cameras = lines.map(|(index, line)| {
                let (position, target) =
                    parse_position(line).map_err(|error| format!("{file}, line {}: {error}", index + 1))?;
                Ok(looking(&camera, position, target))
            });
            let cameras = cameras.collect::<Result<Vec<_>, Failure>>()?;
            if cameras.is_empty() { Err(format!("{file} has no positions").into()) } else { Ok(cameras) }
        }
    }
}

/// Moves to the right in each frame, by a hundredth of the distance to the scene's centre.
fn sway(scene: &Scene, camera: &Camera, count: usize) -> Vec<Camera> {
    let step = (center(scene) - camera.position).length().max(0.1) * 0.01;
    let right = camera.orientation.as_dquat() * DVec3::X;
    let moved = |index: usize| Camera { position: camera.position + right * (step * index as f64), ..camera.clone() };
    (0..count).map(moved).collect()
}

/// Circles the scene's centre, starting at the camera's position.
fn orbit(scene: &Scene, camera: &Camera, count: usize) -> Vec<Camera> {
    let center = center(scene);
    let around = |index: usize| {
        let rotation = DQuat::from_rotation_y(TAU * index as f64 / count as f64);
        looking(camera, center + rotation * (camera.position - center), center)
    };
    (0..count).map(around).collect()
}

/// The centre of the box around all object positions.
fn center(scene: &Scene) -> DVec3 {
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

fn parse_position(line: &str) -> Result<(DVec3, DVec3), String> {
    let numbers = line.split(',').map(|part| part.trim().parse::<f64>().map_err(|error| format!("{part:?}: {error}")));
    let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
    let &[x, y, z, target_x, target_y, target_z] = numbers.as_slice() else {
        return Err(format!("expected six numbers, found {}", numbers.len()));
    };
    let (position, target) = (DVec3::new(x, y, z), DVec3::new(target_x, target_y, target_z));
    if !position.is_finite() || !target.is_finite() || position == target {
        return Err("the camera and its target must be two different finite points".to_owned());
    }
    Ok((position, target))
}
