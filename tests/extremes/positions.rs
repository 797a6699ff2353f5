//! Positions, sizes and scales: a scene looks the same anywhere and at any size.

use drawloom::FrameError;
use drawloom::backend::BackendError;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Light, Mesh, Scene, Topology, Vertex};
use drawloom::view::IssueReason;
use drawloom::view::internal::FixedPosition;
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::square;
use libtest_mimic::Failed;

use crate::Case;
use crate::capture::{Capture, PRECISION, assert_alike, assert_alike_except};
use crate::harness::Harness;
use crate::markers::{BLUE, GREEN, Marker, MarkerScene, RED, camera, with_context};
use crate::moved_scenes::{scale_scene, shift_scene};

pub const CASES: &[Case] = &[
    ("a_scene_looks_the_same_anywhere_up_to_four_million_kilometres", anywhere),
    ("markers_appear_at_their_positions_anywhere", markers_anywhere),
    ("cameras_out_of_reach_are_refused_and_objects_and_lights_counted", out_of_reach),
    ("a_scaled_scene_looks_the_same", scaled_scenes),
    ("meshes_from_a_micrometre_to_ten_thousand_kilometres", sizes),
    ("scales_of_zero_mirrored_and_at_the_limits_of_f32", scales),
    ("objects_much_larger_than_their_distance_cause_no_wrong_colours", larger_than_far),
    ("a_mirrored_box_looks_the_same", mirrored),
    ("objects_too_large_for_f32_are_counted", too_large),
    ("everything_in_one_plane", coplanar),
];

const SIZE: [u32; 2] = [48, 32];

/// Shadow maps of directional lights are aligned to a grid in the world, so moving the scene moves shadow edges by up
/// to a texel: see [`is_at_shadow_edge`].
fn without_sun_shadows(scene: &mut Scene) {
    for light in &mut scene.lights {
        if let Light::Directional { casts_shadow, .. } = light {
            *casts_shadow = false;
        }
    }
}

/// Whether a pixel is so close to an edge of the sun's shadow that the edge may move across it, given the picture with
/// and that without this shadow. The maps have 1,024 pixels across some 2.4 × 60 m, and a pixel of the picture is 14 cm
/// wide at a distance of 8 m: an edge moves by up to a pixel of the map, and fades over one on either side of it. Each
/// of these is a pixel of the picture.
fn is_at_shadow_edge(here: &Capture, bare: &Capture) -> Vec<bool> {
    let shadow = here.differs_from(bare);
    (0..shadow.len()).map(|index| here.around(index, 2).any(|other| shadow[other] != shadow[index])).collect()
}

fn anywhere(harness: &mut Harness) -> Result<(), Failed> {
    // Both pictures have vertices in the wrong place.
    let shift = 2.0 * PRECISION;
    // Only with large shadow maps do shadow edges move so little.
    let is_slow = harness.name().is_slow();
    let mut plain = everything();
    without_sun_shadows(&mut plain);
    let bare = harness.draw_whole(&plain)?;
    for sun_shadows in [false, true].into_iter().filter(|sun_shadows| !(*sun_shadows && is_slow)) {
        let make = || {
            let mut scene = everything();
            if !sun_shadows {
                without_sun_shadows(&mut scene);
            }
            scene
        };
        let here = harness.draw_whole(&make())?;
        let captures = here.capture.as_ref().zip(bare.capture.as_ref());
        let may_move = captures.map(|(here, bare)| is_at_shadow_edge(here, bare)).unwrap_or_default();
        for distance in [1e3, 1e5, 1e6, 1e7, 1e8, 1e9, 4.2e9] {
            let directions = [DVec3::X, DVec3::NEG_Z, DVec3::new(-1.0, 0.7, 0.4), DVec3::new(0.5, -1.0, 1.0)];
            for direction in directions.into_iter().skip(if is_slow { 3 } else { 0 }) {
                let mut scene = make();
                shift_scene(&mut scene, direction * distance)?;
                let context = format!("at {distance:e} m along {direction}");
                let there = harness.draw_whole(&scene).map_err(|failed| with_context(&context, failed))?;
                if there.visible != here.visible {
                    return Err(
                        format!("{context}: {} objects are visible, not {}", there.visible, here.visible).into()
                    );
                }
                let [there, here] = [&there, &here].map(|drawn| drawn.capture.as_ref());
                assert_alike_except(&context, there, here, shift, |pixel| may_move[pixel])?;
            }
        }
    }
    Ok(())
}

fn markers_anywhere(harness: &mut Harness) -> Result<(), Failed> {
    for distance in [0.0, 1.0, 1e3, 1e6, 1e9, 4.2e9] {
        for direction in [DVec3::X, DVec3::NEG_ONE, DVec3::new(0.2, -1.0, 0.6)] {
            for projection in [camera(SIZE).projection, drawloom::scene::Projection::Orthographic { height: 6.0 }] {
                let camera = Camera { position: direction * distance, projection, far: 1e3, ..camera(SIZE) };
                let markers = [
                    Marker::before(&camera, 5.0, 1.0).moved(&camera, 1.5, 1.0),
                    Marker::before(&camera, 5.001, 2.4).moved(&camera, 1.5, 1.0).colored(RED),
                    Marker::before(&camera, 9.0, 3.0).moved(&camera, -1.0, 0.0).colored(BLUE),
                ];
                MarkerScene::new(camera, markers)?.expect(
                    harness,
                    &format!("at {distance:e} m along {direction}"),
                    3,
                )?;
            }
        }
    }
    Ok(())
}

fn out_of_reach(harness: &mut Harness) -> Result<(), Failed> {
    let whole = MarkerScene::new(camera(SIZE), [Marker::before(&camera(SIZE), 5.0, 2.0)])?;
    for far in [FixedPosition::MAX_COORDINATE, -FixedPosition::MAX_COORDINATE, 1e10, -1e300, f64::MAX] {
        let markers = MarkerScene::new(Camera { position: DVec3::Y * far, ..camera(SIZE) }, [])?;
        match harness.refusal(&markers.scene.as_scene_ref())? {
            FrameError::Backend(BackendError::ViewOutOfReach { view }) if view == "main" => {}
            other => return Err(format!("a camera at {far:e} m: {other}").into()),
        }
        let mut markers = MarkerScene::new(camera(SIZE), [Marker::before(&camera(SIZE), 5.0, 2.0)])?;
        markers.add(Marker { position: DVec3::Z * far, ..markers.markers[0] })?;
        markers.markers.pop();
        let intensity = Vec3::ONE;
        markers.scene.lights =
            vec![Light::Point { position: DVec3::X * far, intensity, range: 10.0, casts_shadow: false }];
        let drawn = harness.draw(&markers.scene)?;
        let scene_issues: Vec<_> = drawn.scene_issues.iter().map(|issue| (issue.reason, issue.count)).collect();
        if scene_issues != [(IssueReason::OutOfReach, 1), (IssueReason::LightOutOfReach, 1)] {
            return Err(format!("an object and a light at {far:e} m: {scene_issues:?}").into());
        }
        markers.compare(&drawn, 1)?;
        whole.expect(harness, "the frame after", 1)?;
    }
    let within = Camera { position: DVec3::splat(FixedPosition::MAX_COORDINATE.next_down()), ..camera(SIZE) };
    let marker = Marker { position: within.position - DVec3::new(0.1, 1.5, 3.0), ..Marker::before(&within, 5.0, 3.0) };
    MarkerScene::new(within, [marker])?.expect(harness, "just within reach", 1)
}

/// The scene, scaled by `factor`, without a sun's shadow: the range of its shadow map is in metres, and is not scaled.
fn enlarged(factor: f64) -> Result<Scene, Failed> {
    let mut scene = everything();
    scene.lights.retain(|light| !matches!(light, Light::Directional { casts_shadow: true, .. }));
    scale_scene(&mut scene, factor)?;
    Ok(scene)
}

fn scaled_scenes(harness: &mut Harness) -> Result<(), Failed> {
    let usual = harness.draw_whole(&enlarged(1.0)?)?;
    for factor in [1e-6, 1e-3, 0.1, 30.0, 1e3, 1e6, 1e7] {
        let context = format!("{factor:e} times as large");
        let other = harness.draw_whole(&enlarged(factor)?).map_err(|failed| with_context(&context, failed))?;
        // Positions are rounded to steps of 2⁻³⁰ m, half a step each for the camera and the object. The nearest object
        // is 5.5 m away before scaling, and the focal length is 55 pixels.
        let by_steps = 55.0 * 0.5_f64.powi(30) / (5.5 * factor);
        assert_alike(&context, other.capture.as_ref(), usual.capture.as_ref(), 2.0 * PRECISION + by_steps)?;
    }
    Ok(())
}

/// A square with sides of `side` metres.
fn sized_square(side: f32) -> Result<Mesh, Failed> {
    let mesh = square(Topology::TriangleList);
    let vertices = mesh.vertices().iter();
    let vertices = vertices.map(|vertex| Vertex { position: vertex.position.map(|x| x * side * 0.5), ..*vertex });
    Ok(Mesh::new("square", mesh.topology(), vertices.collect(), mesh.indices().to_vec())?)
}

fn sizes(harness: &mut Harness) -> Result<(), Failed> {
    for size in [1e-6_f64, 1e-5, 1e-3, 1.0, 1e3, 1e5, 1e7] {
        for mesh_share in [0.0, 0.5, 1.0, 2.0] {
            // The mesh contributes a part of the size, and the scale the rest.
            let of_mesh = size.powf(mesh_share) as f32;
            let near = Camera { near: (size * 0.01) as f32, ..camera(SIZE) };
            let distance = size * 3.0;
            let mut markers = [
                Marker::before(&near, distance, size).moved(&near, size * 0.5, size * 0.3),
                Marker::before(&near, distance * 1.2, size * 1.5).colored(RED),
            ];
            for marker in &mut markers {
                marker.scale *= 2.0 / of_mesh;
            }
            let context = format!("{size:e} m, {of_mesh:e} of it by the mesh");
            let mut all = MarkerScene::of(sized_square(of_mesh)?, near, markers)?;
            all.scene.background = Vec3::ZERO;
            all.expect(harness, &context, 2)?;
        }
    }
    Ok(())
}

fn scales(harness: &mut Harness) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let control = Marker::before(&camera, 5.0, 1.0).moved(&camera, -2.0, 1.0).colored(BLUE);
    let tilt = camera.orientation * Quat::from_rotation_x(0.3);
    for (scale, min_visible) in [
        (Vec3::ZERO, 1),
        (Vec3::NEG_ONE, 1),
        (Vec3::new(-1.0, 1.0, 1.0), 2),
        (Vec3::new(1.0, -1.0, 1.0), 2),
        (Vec3::new(-1.0, -1.0, 1.0), 2),
        // Mirrored along its normal, it shows its other side.
        (Vec3::new(1.0, 1.0, -1.0), 1),
        (Vec3::new(1.0, 1.0, 0.0), 2),
        (Vec3::new(1.0, 0.0, 1.0), 1),
        (Vec3::splat(1e-20), 1),
        (Vec3::splat(-1e-20), 1),
        (Vec3::splat(f32::from_bits(1)), 1),
        (Vec3::splat(f32::MIN_POSITIVE), 1),
        (Vec3::new(1e6, 1.0, 1.0), 2),
        (Vec3::new(1.0, 1e6, 1e-6), 2),
        (Vec3::new(1e3, 1e-3, 1.0), 1),
        (Vec3::new(1.0, 1.0, 1e20), 2),
        (Vec3::splat(1e3), 1),
        (Vec3::splat(1e5), 1),
    ] {
        for double_sided in [false, true] {
            for orientation in [camera.orientation, tilt] {
                let marker = Marker { scale, double_sided, orientation, ..Marker::before(&camera, 6.0, 1.0) };
                let context = format!("scale {scale}, double-sided {double_sided}, tilted {}", orientation == tilt);
                MarkerScene::new(camera.clone(), [control, marker])?.expect(harness, &context, min_visible)?;
            }
        }
    }
    Ok(())
}

/// The error of a vertex is a millionth of its distance, so an object much larger than its distance appears elsewhere.
/// It still is drawn, and causes no wrong colours.
fn larger_than_far(harness: &mut Harness) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let control = Marker::before(&camera, 5.0, 1.0).moved(&camera, -2.0, 1.0).colored(BLUE);
    for size in [1e7, 1e9, 1e12, 1e20, 1e29] {
        for scale in [Vec3::ONE, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, 1.0, 1.0)] {
            for tilt in [0.0, 0.3] {
                let scale = scale * size;
                let orientation = camera.orientation * Quat::from_rotation_x(tilt);
                let behind = Marker { scale, orientation, ..Marker::before(&camera, 6.0, 1.0) };
                let context = format!("scale {scale}, tilted by {tilt}");
                let markers = MarkerScene::new(camera.clone(), [control, behind])?;
                let drawn = harness.draw_whole(&markers.scene).map_err(|failed| with_context(&context, failed))?;
                if drawn.visible != 2 {
                    return Err(format!("{context}: {} of 2 were drawn", drawn.visible).into());
                }
                let Some(capture) = drawn.capture else { continue };
                let known = [BLUE, GREEN, markers.scene.background].map(|color| color.as_dvec3().to_array());
                let all = (0..capture.size[1]).flat_map(|y| (0..capture.size[0]).map(move |x| (x, y)));
                if let Some((x, y)) = all.into_iter().find(|&(x, y)| !known.contains(&capture.radiance(x, y))) {
                    return Err(format!("{context}: ({x}, {y}) is {:?}", capture.radiance(x, y)).into());
                }
            }
        }
    }
    Ok(())
}

fn mirrored(harness: &mut Harness) -> Result<(), Failed> {
    let with = |harness: &mut Harness, mirror: Vec3| {
        let mut scene = everything();
        for handle in scene.objects().collect::<Vec<_>>() {
            let mut object = scene.object(handle)?;
            // Boxes are symmetric.
            if scene.assets().get(object.mesh)?.name() == "cube" {
                object.scale *= mirror;
                scene.replace_object(handle, object)?;
            }
        }
        harness.draw_whole(&scene)
    };
    let plain = with(harness, Vec3::ONE)?;
    for mirror in [Vec3::NEG_ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, -1.0)] {
        let other = with(harness, mirror)?;
        // Every vertex of a mirrored box is one of the box.
        assert_alike(&format!("mirrored by {mirror}"), other.capture.as_ref(), plain.capture.as_ref(), 0.0)?;
    }
    Ok(())
}

fn too_large(harness: &mut Harness) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let control = Marker::before(&camera, 5.0, 1.0);
    for scale in [1e31_f32, 1e37, f32::MAX] {
        let mut markers = MarkerScene::new(camera.clone(), [control])?;
        markers.add(Marker { scale: Vec3::splat(scale), ..Marker::before(&camera, 6.0, 1.0) }.colored(RED))?;
        markers.markers.pop();
        let drawn = harness.draw(&markers.scene)?;
        let scene_issues: Vec<_> = drawn.scene_issues.iter().map(|issue| (issue.reason, issue.count)).collect();
        if scene_issues != [(IssueReason::InvalidBounds, 1)] {
            return Err(format!("scale {scale:e}: {scene_issues:?}").into());
        }
        markers.compare(&drawn, 1)?;
    }
    Ok(())
}

fn coplanar(harness: &mut Harness) -> Result<(), Failed> {
    for far in [f32::INFINITY, 1e9] {
        for distance in [0.2, 5.0, 1e5] {
            let camera = Camera { far, ..camera(SIZE) };
            // A chequerboard at one depth.
            let colors = [Vec3::X * 0.5, Vec3::Y * 0.5, Vec3::Z * 0.5, Vec3::ONE * 0.25];
            let squares = (0..16).map(|index| {
                let (column, row) = (f64::from(index % 4) - 1.5, f64::from(index / 4) - 1.5);
                let marker = Marker::before(&camera, distance, distance * 0.25);
                let color = colors[(index % 4 + index / 4) as usize % 4];
                marker.moved(&camera, column * distance * 0.25, row * distance * 0.25).colored(color)
            });
            let markers = MarkerScene::new(camera.clone(), squares.collect::<Vec<_>>())?;
            markers.expect(harness, &format!("a board at {distance} m"), 16)?;
            // All at one position: every pixel shows the same one.
            let marker = Marker::before(&camera, distance, distance * 10.0);
            let stack = MarkerScene::new(camera, colors.map(|color| marker.colored(color)))?;
            let drawn = harness.draw_whole(&stack.scene)?;
            let Some(capture) = drawn.capture else { continue };
            let [width, height] = capture.size;
            let middle = capture.middle();
            let differs = |(x, y): (usize, usize)| capture.radiance(x, y) != middle;
            if (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).any(differs) {
                return Err(format!("a stack at {distance} m shows more than one of its markers").into());
            }
            if !colors.iter().any(|color| color.as_dvec3().to_array() == middle) {
                return Err(format!("a stack at {distance} m is {middle:?}").into());
            }
        }
    }
    Ok(())
}
