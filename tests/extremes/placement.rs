//! How far the vertices of markers are from where they belong in a picture.

use drawloom::glam::{DVec2, DVec3};
use drawloom::scene::{Camera, Projection};
use drawloom::view::RenderView;
use drawloom_testing::adapter;
use drawloom_testing::precision::cases::GpuObjects;
use drawloom_testing::precision::device::ShaderOnDevice;
use drawloom_testing::precision::measure::WORST_ANGLE;
use drawloom_testing::precision::vertex::{Case, ShaderInRust, ShaderInput, VertexShader, gpu_view_of};
use libtest_mimic::Failed;

use crate::error_table::{UNIT_ROUNDOFF, expect_within};
use crate::harness::{BackendName, Harness};
use crate::markers::{MarkerScene, with_context};
use crate::oracle::View;

/// Draws markers and compares the picture with what the scene's view predicts, and measures where the shader places
/// their visible corners. Returns the largest bound of a corner's error, in pixels.
pub fn expect_placed(
    harness: &mut Harness,
    (feature, column, context): (&'static str, &str, &str),
    scene: &MarkerScene,
    min_visible: usize,
) -> Result<f64, Failed> {
    let of_feature = format!("{feature}, {column}, {context}");
    scene.expect(harness, &of_feature, min_visible)?;
    let mut shader: Box<dyn VertexShader> = match harness.name() {
        BackendName::Wgpu => {
            let (device, queue) = adapter::shared_device()?;
            Box::new(ShaderOnDevice::new(device, queue))
        }
        _ => Box::new(ShaderInRust),
    };
    let view = scene.view.unwrap_or_else(|| View::of(&scene.scene.cameras[0]));
    let errors = placement_errors(&mut *shader, scene, &view).map_err(|failed| with_context(&of_feature, failed))?;
    let largest = errors.iter().map(|[_, bound]| *bound).fold(0.0, f64::max);
    errors.into_iter().try_for_each(|error| expect_within((feature, column, "pixel"), context, error))?;
    Ok(largest)
}

/// For each corner in the picture, how far from its place the shader moves it, and how far it may.
fn placement_errors(shader: &mut dyn VertexShader, scene: &MarkerScene, view: &View) -> Result<Vec<[f64; 2]>, Failed> {
    let (camera, mesh) = (&scene.scene.cameras[0], scene.mesh()?);
    let size = DVec2::from(camera.size.map(f64::from));
    let (mut cases, mut bounds, mut expected) = (Vec::new(), Vec::new(), Vec::new());
    for marker in &scene.markers {
        let radius = marker.corner(marker.position, mesh, 0).length();
        for corner in 0..mesh.vertices().len() as u32 {
            let point = marker.corner(view.reference, mesh, corner);
            let (pixel, depth) = view.project(point);
            let is_clipped = view.clip_plane.is_some_and(|[on_plane, normal]| normal.dot(point - on_plane) < 0.0);
            if depth >= view.near && !is_clipped && pixel.cmpge(DVec2::ZERO).all() && pixel.cmple(size).all() {
                let vertex = mesh.vertices()[corner as usize].position.into();
                let (position, orientation, scale) = (marker.position, marker.orientation, marker.scale);
                cases.push(Case { camera: camera.clone(), position, orientation, scale, vertex });
                bounds.push(placement_bound(camera, pixel, point - view.origin, radius));
                expected.push(pixel);
            }
        }
    }
    let (mut objects, mut inputs) = (GpuObjects::new()?, Vec::new());
    objects.visit(&cases, |case, &object| {
        inputs.push(ShaderInput { case, object, view: gpu_view_of(&RenderView::new(camera)) });
    })?;
    let placed = shader.clip_positions(&inputs)?;
    let measured =
        cases.iter().zip(placed).zip(&expected).map(|((case, clip), pixel)| case.drawn_at(clip).distance(*pixel));
    Ok(measured.zip(bounds).map(|(measured, bound)| [measured, bound]).collect())
}

/// How far a vertex may be from its place, in pixels, for a mesh whose origin is `radius` metres from it.
///
/// - The shader turns the ray of a vertex that is at least as far as that by up to 30u: see
///   [`GpuView`](drawloom::view::GpuView).
/// - The derived camera's quaternion is rounded, each number by u of it at most, which turns the camera by 2u; its axes
///   are normalised.
/// - Object and camera are rounded to steps of 2⁻³⁰ m, half a step on each axis. A derived camera's position was
///   computed in f64, in which some three roundings move it by half a unit in the last place each.
/// - The tangent of half the field of view, and the lens shift, are rounded to f32: by some 4u of the distance from the
///   axis.
///
/// See [`pixels_per_radian`](drawloom_testing::precision::vertex::pixels_per_radian) for what an angle is in the
/// picture.
fn placement_bound(camera: &Camera, pixel: DVec2, offset: DVec3, radius: f64) -> f64 {
    let size = DVec2::from(camera.size.map(f64::from));
    let from_axis = pixel - size * 0.5 + camera.shift.as_dvec2() * DVec2::new(0.5, -0.5) * size;
    let (distance, from_axis) = (offset.length(), from_axis.length());
    let ulp = camera.position.abs().max_element() * 0.5_f64.powi(52);
    let moved = 3_f64.sqrt() * (0.5_f64.powi(30) + 1.5 * ulp);
    let turned = (WORST_ANGLE + 4.0) * UNIT_ROUNDOFF * (radius / distance).max(1.0);
    let by_angles = match camera.projection {
        Projection::Perspective { field_of_view } => {
            let focal = size.y * 0.5 / (f64::from(field_of_view) * 0.5).tan();
            (turned + moved / distance) * (focal + from_axis * from_axis / focal)
        }
        Projection::Orthographic { height } => (turned * distance + moved) * size.y / f64::from(height),
        other => unreachable!("no main camera is {other:?}"),
    };
    by_angles + 4.0 * UNIT_ROUNDOFF * (from_axis + camera.shift.abs().max_element() as f64 * size.max_element())
}
