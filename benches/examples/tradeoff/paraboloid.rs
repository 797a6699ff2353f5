//! The error of straight edges in a paraboloid projection.

use drawloom::command::RenderCommand;
use drawloom::glam::{DQuat, DVec2, DVec3, Vec3};
use drawloom::scene::{Light, Scene};

use crate::errors::worst_of;

/// The greatest distance of a subdivided edge from its curve, in pixels of a map of 1024. `None` if no hemispherical
/// light has a map with an edge in it.
pub fn greatest_error(scene: &Scene, shadow_maps: &[(usize, Vec<RenderCommand>)]) -> Option<f64> {
    let view = scene.as_scene_ref();
    let mut worst: Option<f64> = None;
    for (light, commands) in shadow_maps {
        let Some(&Light::Hemispherical { position, direction, range, .. }) = view.lights.get(*light) else { continue };
        let turn = DQuat::from_rotation_arc(direction.as_dvec3().normalize(), DVec3::NEG_Z);
        for command in commands {
            let object = command.object as usize;
            let Ok(mesh) = view.assets.get(view.meshes[object]) else { continue };
            let (scale, orientation) =
                (view.scales[object].as_dvec3(), view.orientations[object].as_dquat().normalize());
            let offset = view.positions[object] - position;
            let position = |index: u32| {
                let local = Vec3::from(mesh.vertices()[index as usize].position).as_dvec3();
                turn * (offset + orientation * (local * scale))
            };
            // No edge is longer than this after subdivision.
            let longest = mesh.longest_edge() / (1_u64 << command.state.subdivision_level()) as f32;
            for corners in mesh.triangles() {
                for [one, other] in [[0, 1], [1, 2], [2, 0]].map(|edge| edge.map(|corner| corners[corner])) {
                    let [first, last] =
                        [one, other].map(|corner| Vec3::from(mesh.vertices()[corner as usize].position));
                    let level = (first.distance(last) / longest).log2().ceil().clamp(0.0, 12.0);
                    let segments = 1 << level as u32;
                    let (start, end) = (position(one), position(other));
                    // The crate clamps distances to the light to a thousandth of its range.
                    let is_in_front = [start, end].iter().all(|point| -point.z > f64::from(range) * 1e-3);
                    if is_in_front {
                        let error = edge_error(start, end, segments);
                        worst = Some(worst.map_or(error, |worst| worst_of(worst, error)));
                    }
                }
            }
        }
    }
    worst
}

/// The greatest distance of an edge's segments from its curve.
fn edge_error(start: DVec3, end: DVec3, segments: u32) -> f64 {
    const SAMPLES: u32 = 8;
    let at = |share: f64| project(start.lerp(end, share));
    let mut worst: f64 = 0.0;
    for segment in 0..segments {
        let [first, last] = [segment, segment + 1].map(|end| f64::from(end) / f64::from(segments));
        let (from, to) = (at(first), at(last));
        let along = (to - from).normalize_or_zero();
        for sample in 1..SAMPLES {
            let offset = at(first + (last - first) * f64::from(sample) / f64::from(SAMPLES)) - from;
            worst = worst.max(offset.perp_dot(along).abs());
        }
    }
    // Clip space is 2 wide.
    worst * 512.0
}

/// Projects a point with a paraboloid that faces −Z (Brabec et al. 2002).
fn project(point: DVec3) -> DVec2 {
    let distance = point.length();
    point.truncate() / (distance - point.z)
}
