//! Light in the picture of a camera that touches its clip plane: the position of a pixel is computed from a depth that
//! hardly differs.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, ClipPlane, Light, Material, RenderObject, Scene, Topology};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::square;
use libtest_mimic::Failed;

use crate::Case;
use crate::derived::axes;
use crate::error_table::{TOUCHING, UNIT_ROUNDOFF, expect_within};
use crate::harness::Harness;
use crate::markers::camera;
use crate::oracle::View;

pub const CASES: &[Case] = &[
    ("a_lamp_lights_what_a_camera_sees_that_touches_its_clip_plane", lamp),
    ("every_light_and_blend_is_drawn_for_a_camera_that_touches_its_clip_plane", everything_lit),
];

const SIZE: [u32; 2] = [48, 32];

/// Distances of a camera from its clip plane, in metres; its near plane is at 5 cm.
const DISTANCES: [f64; 6] = [0.0, 1e-12, 1e-6, 3e-3, 0.02, 0.3];

/// A plane that is as far before a camera, and that more than half of its rays never meet.
fn grazed_plane(camera: &Camera, distance: f64) -> ClipPlane {
    let [right, up, forward] = axes(camera);
    let normal = (forward * 0.1 - up + right * 0.2).as_vec3().normalize();
    ClipPlane { point: camera.position + normal.as_dvec3().normalize() * distance, normal }
}

/// A floor that reflects all light, and a lamp above it.
///
/// The radiance is ρ ÷ π · I cos θ ÷ d², as the range is so large that nothing of it is cut off.
fn lamp(harness: &mut Harness) -> Result<(), Failed> {
    for distance in DISTANCES {
        let mut scene = Scene::new();
        let camera = camera(SIZE);
        let mesh = scene.add(square(Topology::TriangleList))?;
        let material = scene.add(Material { diffuse: Vec3::ONE, double_sided: true, ..Material::default() })?;
        let [_, up, forward] = axes(&camera);
        // It faces the camera from the front and below, from 3 m on.
        let orientation = (camera.orientation * Quat::from_rotation_x(-1.2)).normalize();
        let normal = orientation.as_dquat().normalize() * DVec3::Z;
        let center = camera.position + forward * 5.0 - up * 1.5;
        let object = RenderObject::new(mesh, material, center);
        scene.add_object(RenderObject { orientation, scale: Vec3::splat(2.0), ..object })?;
        let position = center + normal * 2.0;
        let intensity = Vec3::splat(20.0);
        scene.lights = vec![Light::Point { position, intensity, range: 1e4, casts_shadow: false }];
        let plane = grazed_plane(&camera, distance);
        scene.cameras = vec![Camera { clip_plane: Some(plane), ..camera.clone() }];
        let Some(capture) = harness.draw_whole(&scene)?.capture else { continue };
        let view = View::of(&camera);
        let mut count = 0;
        for (x, y) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x as usize, y as usize))) {
            let [_, ray] = view.ray(x as f64 + 0.5, y as f64 + 0.5);
            let along = normal.dot(center - camera.position) / normal.dot(ray);
            let point = camera.position + ray * along;
            let local = orientation.as_dquat().normalize().inverse() * (point - center);
            let slope = plane.normal.as_dvec3().normalize().dot(ray);
            // On the floor, a pixel from its edge, and in front of the plane.
            if along < 0.0 || local.abs().max_element() > 1.7 || slope < 0.02 {
                continue;
            }
            let to_lamp = position - point;
            let (d, cosine) = (to_lamp.length(), to_lamp.normalize().dot(normal));
            let expected = f64::from(intensity.x) * cosine / (d * d) / std::f64::consts::PI;
            // Depth is 1 − a π ÷ w, where π is the distance in front of the plane and a is 1 ÷ the greatest slope of a
            // corner, which is below 1 here. The sum is off by 8u (1 + a) |r|, at most 16u a |r|; quotient and
            // interpolation add as much. That moves the point along its ray by t² ÷ (a D) of it, where D is 1/16 of the
            // near plane's distance at least. A device moves the floor's corners by 1/512 of a pixel along each axis,
            // and depth changes by at most a for each half of the picture.
            let (least, length) = (distance.max(0.05 / 16.0), ray.length());
            let pixel = (view.up.length() * 2.0 / f64::from(SIZE[1])) * 2_f64.sqrt() / 512.0;
            let moved = along * along / least * length * (32.0 * UNIT_ROUNDOFF + pixel);
            // The radiance changes by at most 3 ÷ d of itself for each metre. Half floats round it by 2⁻¹¹.
            let bound = 3.0 * moved / (d - moved).max(0.5) + 2.0 * 0.5_f64.powi(11) + 64.0 * UNIT_ROUNDOFF;
            let error = (capture.radiance(x, y)[0] / expected - 1.0).abs();
            expect_within(
                ("light behind a clip plane", TOUCHING, "share"),
                &format!("{distance:e} m, ({x}, {y}): {} of {expected}", capture.radiance(x, y)[0]),
                [error, bound],
            )?;
            count += 1;
        }
        if count < 40 {
            return Err(format!("only {count} pixels show the floor").into());
        }
    }
    Ok(())
}

/// Nothing fails, no pixel is NaN, and what is behind the plane is not drawn.
fn everything_lit(harness: &mut Harness) -> Result<(), Failed> {
    // Its shadow maps take long on the CPU.
    for distance in DISTANCES.into_iter().step_by(if harness.name().is_slow() { 3 } else { 1 }) {
        let mut scene = everything();
        let camera = scene.cameras[0].clone();
        let plane = grazed_plane(&camera, distance);
        scene.cameras[0].clip_plane = Some(plane);
        let Some(capture) = harness.draw_whole(&scene)?.capture else { continue };
        let (view, background) = (View::of(&camera), scene.background.as_dvec3().to_array());
        let mut covered = 0;
        for (x, y) in (0..capture.size[1]).flat_map(|y| (0..capture.size[0]).map(move |x| (x, y))) {
            let [_, ray] = view.ray(x as f64 + 0.5, y as f64 + 0.5);
            let slope = plane.normal.as_dvec3().normalize().dot(ray);
            let is_background =
                (0..3).all(|channel| (capture.radiance(x, y)[channel] - background[channel]).abs() < 1e-3);
            if slope < -0.02 && !is_background {
                return Err(format!("{distance:e} m: ({x}, {y}) is {:?}", capture.radiance(x, y)).into());
            }
            covered += usize::from(!is_background);
        }
        if covered < 500 {
            return Err(format!("{distance:e} m: only {covered} pixels show anything").into());
        }
    }
    Ok(())
}
