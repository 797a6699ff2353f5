//! Places, sizes and scales: wherever a scene is and however large, it looks the same.

use drawloom::FrameError;
use drawloom::backend::BackendError;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Light, Mesh, Scene, Topology, Vertex};
use drawloom::view::{FixedPosition, RejectionReason};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::square;
use libtest_mimic::Failed;

use crate::Case;
use crate::look::assert_alike;
use crate::signs::{BLUE, GREEN, RED, Sign, Signs, camera, told};
use crate::stage::Studio;

pub const CASES: &[Case] = &[
    ("a_scene_looks_the_same_anywhere_up_to_four_million_kilometres", anywhere),
    ("signs_are_in_their_places_anywhere", signs_anywhere),
    ("what_is_out_of_reach_is_refused_or_counted", out_of_reach),
    ("a_scene_a_thousand_times_as_large_and_as_far_looks_the_same", similar),
    ("meshes_from_a_micrometre_to_ten_thousand_kilometres", sizes),
    ("scales_of_nothing_mirrored_and_at_the_end_of_f32", scales),
    ("objects_many_times_as_large_as_they_are_far_leave_no_other_pixels", larger_than_far),
    ("a_box_looks_the_same_mirrored", mirrored),
    ("objects_too_large_for_f32_are_counted", too_large),
    ("everything_in_one_plane", coplanar),
];

const SIZE: [u32; 2] = [48, 32];

/// Moves all there is.
fn shift(scene: &mut Scene, by: DVec3) -> Result<(), Failed> {
    for camera in &mut scene.cameras {
        camera.position += by;
    }
    for light in &mut scene.lights {
        if let Some(position) = position_of(light) {
            *position += by;
        }
    }
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle)?;
        object.position += by;
        scene.replace_object(handle, object)?;
    }
    Ok(())
}

fn position_of(light: &mut Light) -> Option<&mut DVec3> {
    match light {
        Light::Point { position, .. } | Light::Spot { position, .. } | Light::Hemispherical { position, .. } => {
            Some(position)
        }
        _ => None,
    }
}

/// A directional light's map lies on a raster of the world, so its shadows' edges move by less than a pixel of the map.
fn without_sun_shadows(scene: &mut Scene) {
    for light in &mut scene.lights {
        if let Light::Directional { casts_shadow, .. } = light {
            *casts_shadow = false;
        }
    }
}

fn anywhere(studio: &mut Studio) -> Result<(), Failed> {
    // Only a map of many pixels moves its shadows by less than is seen.
    let is_slow = studio.name().is_slow();
    for sun_shadows in [false, true].into_iter().filter(|sun_shadows| !(*sun_shadows && is_slow)) {
        let make = || {
            let mut scene = everything();
            if !sun_shadows {
                without_sun_shadows(&mut scene);
            }
            scene
        };
        let here = studio.draw_whole(&make())?;
        for distance in [1e3, 1e5, 1e6, 1e7, 1e8, 1e9, 4.2e9] {
            let ways = [DVec3::X, DVec3::NEG_Z, DVec3::new(-1.0, 0.7, 0.4), DVec3::new(0.5, -1.0, 1.0)];
            for way in ways.into_iter().skip(if is_slow { 3 } else { 0 }) {
                let mut scene = make();
                shift(&mut scene, way * distance)?;
                let what = format!("at {distance:e} m along {way}");
                let there = studio.draw_whole(&scene).map_err(|failed| told(&what, failed))?;
                if there.visible != here.visible {
                    return Err(format!("{what}: {} objects are seen, not {}", there.visible, here.visible).into());
                }
                assert_alike(&what, there.look.as_ref(), here.look.as_ref())?;
            }
        }
    }
    Ok(())
}

fn signs_anywhere(studio: &mut Studio) -> Result<(), Failed> {
    for distance in [0.0, 1.0, 1e3, 1e6, 1e9, 4.2e9] {
        for way in [DVec3::X, DVec3::NEG_ONE, DVec3::new(0.2, -1.0, 0.6)] {
            for projection in [camera(SIZE).projection, drawloom::scene::Projection::Orthographic { height: 6.0 }] {
                let camera = Camera { position: way * distance, projection, far: 1e3, ..camera(SIZE) };
                let signs = [
                    Sign::before(&camera, 5.0, 1.0).moved(&camera, 1.5, 1.0),
                    Sign::before(&camera, 5.001, 2.4).moved(&camera, 1.5, 1.0).colored(RED),
                    Sign::before(&camera, 9.0, 3.0).moved(&camera, -1.0, 0.0).colored(BLUE),
                ];
                Signs::new(camera, signs)?.expect(studio, &format!("at {distance:e} m along {way}"), 3)?;
            }
        }
    }
    Ok(())
}

fn out_of_reach(studio: &mut Studio) -> Result<(), Failed> {
    let whole = Signs::new(camera(SIZE), [Sign::before(&camera(SIZE), 5.0, 2.0)])?;
    for far in [FixedPosition::MAX_COORDINATE, -FixedPosition::MAX_COORDINATE, 1e10, -1e300, f64::MAX] {
        let signs = Signs::new(Camera { position: DVec3::Y * far, ..camera(SIZE) }, [])?;
        match studio.refusal(&signs.scene.as_scene_ref())? {
            FrameError::Backend(BackendError::ViewOutOfReach { view }) if view == "main" => {}
            other => return Err(format!("a camera at {far:e} m: {other}").into()),
        }
        let mut signs = Signs::new(camera(SIZE), [Sign::before(&camera(SIZE), 5.0, 2.0)])?;
        signs.add(Sign { position: DVec3::Z * far, ..signs.signs[0] })?;
        signs.signs.pop();
        let intensity = Vec3::ONE;
        signs.scene.lights = vec![Light::Point { position: DVec3::X * far, intensity, range: 10.0 }];
        let drawn = studio.draw(&signs.scene)?;
        let told: Vec<_> = drawn.rejections.iter().map(|left_out| (left_out.reason, left_out.count)).collect();
        if told != [(RejectionReason::OutOfReach, 1), (RejectionReason::LightOutOfReach, 1)] {
            return Err(format!("an object and a light at {far:e} m: {told:?}").into());
        }
        signs.compare(&drawn, 1)?;
        whole.expect(studio, "the frame after", 1)?;
    }
    let within = Camera { position: DVec3::splat(FixedPosition::MAX_COORDINATE.next_down()), ..camera(SIZE) };
    let sign = Sign { position: within.position - DVec3::new(0.1, 1.5, 3.0), ..Sign::before(&within, 5.0, 3.0) };
    Signs::new(within, [sign])?.expect(studio, "just within reach", 1)
}

/// The same scene, so many times as large, and lit as brightly.
fn enlarged(factor: f64) -> Result<Scene, Failed> {
    let mut scene = everything();
    let (single, square) = (factor as f32, (factor * factor) as f32);
    // How far its map reaches is said in metres.
    scene.lights.retain(|light| !matches!(light, Light::Directional { casts_shadow: true, .. }));
    for camera in &mut scene.cameras {
        camera.position *= factor;
        camera.near *= single;
    }
    for light in &mut scene.lights {
        match light {
            Light::Point { position, intensity, range }
            | Light::Spot { position, intensity, range, .. }
            | Light::Hemispherical { position, intensity, range, .. } => {
                *position *= factor;
                *intensity *= square;
                *range *= single;
            }
            _ => {}
        }
    }
    for handle in scene.objects().collect::<Vec<_>>() {
        let mut object = scene.object(handle)?;
        object.position *= factor;
        object.scale *= single;
        scene.replace_object(handle, object)?;
    }
    Ok(scene)
}

fn similar(studio: &mut Studio) -> Result<(), Failed> {
    let usual = studio.draw_whole(&enlarged(1.0)?)?;
    for factor in [1e-6, 1e-3, 0.1, 30.0, 1e3, 1e6, 1e7] {
        let what = format!("{factor:e} times as large");
        let other = studio.draw_whole(&enlarged(factor)?).map_err(|failed| told(&what, failed))?;
        assert_alike(&what, other.look.as_ref(), usual.look.as_ref())?;
    }
    Ok(())
}

/// A square of so many metres.
fn sized_square(side: f32) -> Result<Mesh, Failed> {
    let mesh = square(Topology::TriangleList);
    let vertices = mesh.vertices().iter();
    let vertices = vertices.map(|vertex| Vertex { position: vertex.position.map(|x| x * side * 0.5), ..*vertex });
    Ok(Mesh::new("square", mesh.topology(), vertices.collect(), mesh.indices().to_vec())?)
}

fn sizes(studio: &mut Studio) -> Result<(), Failed> {
    for size in [1e-6_f64, 1e-5, 1e-3, 1.0, 1e3, 1e5, 1e7] {
        for mesh_share in [0.0, 0.5, 1.0, 2.0] {
            // Some of it by the mesh, the rest by the scale.
            let of_mesh = size.powf(mesh_share) as f32;
            let near = Camera { near: (size * 0.01) as f32, ..camera(SIZE) };
            let distance = size * 3.0;
            let mut signs = [
                Sign::before(&near, distance, size).moved(&near, size * 0.5, size * 0.3),
                Sign::before(&near, distance * 1.2, size * 1.5).colored(RED),
            ];
            for sign in &mut signs {
                sign.scale *= 2.0 / of_mesh;
            }
            let what = format!("{size:e} m, of which {of_mesh:e} by the mesh");
            let mut all = Signs::of(sized_square(of_mesh)?, near, signs)?;
            // The oracle has the same mesh.
            all.scene.background = Vec3::ZERO;
            all.expect(studio, &what, 2)?;
        }
    }
    Ok(())
}

fn scales(studio: &mut Studio) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let witness = Sign::before(&camera, 5.0, 1.0).moved(&camera, -2.0, 1.0).colored(BLUE);
    let tilt = camera.orientation * Quat::from_rotation_x(0.3);
    for (scale, seen) in [
        (Vec3::ZERO, 1),
        (Vec3::NEG_ONE, 1),
        (Vec3::new(-1.0, 1.0, 1.0), 2),
        (Vec3::new(1.0, -1.0, 1.0), 2),
        (Vec3::new(-1.0, -1.0, 1.0), 2),
        // What is mirrored along its normal shows its other side.
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
                let sign = Sign { scale, double_sided, orientation, ..Sign::before(&camera, 6.0, 1.0) };
                let what = format!("scale {scale}, double-sided {double_sided}, tilted {}", orientation == tilt);
                Signs::new(camera.clone(), [witness, sign])?.expect(studio, &what, seen)?;
            }
        }
    }
    Ok(())
}

/// A vertex is off by a millionth of how far it is from the camera: what is many times as large as it is far is somewhere else.
/// But it is drawn, and nothing else is.
fn larger_than_far(studio: &mut Studio) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let witness = Sign::before(&camera, 5.0, 1.0).moved(&camera, -2.0, 1.0).colored(BLUE);
    for size in [1e7, 1e9, 1e12, 1e20, 1e29] {
        for scale in [Vec3::ONE, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0), Vec3::new(-1.0, 1.0, 1.0)] {
            for tilt in [0.0, 0.3] {
                let scale = scale * size;
                let orientation = camera.orientation * Quat::from_rotation_x(tilt);
                let behind = Sign { scale, orientation, ..Sign::before(&camera, 6.0, 1.0) };
                let what = format!("scale {scale}, tilted by {tilt}");
                let signs = Signs::new(camera.clone(), [witness, behind])?;
                let drawn = studio.draw_whole(&signs.scene).map_err(|failed| told(&what, failed))?;
                if drawn.visible != 2 {
                    return Err(format!("{what}: {} of 2 were drawn", drawn.visible).into());
                }
                let Some(look) = drawn.look else { continue };
                let known = [BLUE, GREEN, signs.scene.background].map(|color| color.as_dvec3().to_array());
                let all = (0..look.size[1]).flat_map(|y| (0..look.size[0]).map(move |x| (x, y)));
                if let Some((x, y)) = all.into_iter().find(|&(x, y)| !known.contains(&look.radiance(x, y))) {
                    return Err(format!("{what}: ({x}, {y}) is {:?}", look.radiance(x, y)).into());
                }
            }
        }
    }
    Ok(())
}

fn mirrored(studio: &mut Studio) -> Result<(), Failed> {
    let with = |studio: &mut Studio, mirror: Vec3| {
        let mut scene = everything();
        for handle in scene.objects().collect::<Vec<_>>() {
            let mut object = scene.object(handle)?;
            // Boxes are the same from every side.
            if scene.assets().get(object.mesh)?.name() == "cube" {
                object.scale *= mirror;
                scene.replace_object(handle, object)?;
            }
        }
        studio.draw_whole(&scene)
    };
    let plain = with(studio, Vec3::ONE)?;
    for mirror in [Vec3::NEG_ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, -1.0)] {
        let other = with(studio, mirror)?;
        assert_alike(&format!("mirrored by {mirror}"), other.look.as_ref(), plain.look.as_ref())?;
    }
    Ok(())
}

fn too_large(studio: &mut Studio) -> Result<(), Failed> {
    let camera = camera(SIZE);
    let witness = Sign::before(&camera, 5.0, 1.0);
    for scale in [1e31_f32, 1e37, f32::MAX] {
        let mut signs = Signs::new(camera.clone(), [witness])?;
        signs.add(Sign { scale: Vec3::splat(scale), ..Sign::before(&camera, 6.0, 1.0) }.colored(RED))?;
        signs.signs.pop();
        let drawn = studio.draw(&signs.scene)?;
        let told: Vec<_> = drawn.rejections.iter().map(|left_out| (left_out.reason, left_out.count)).collect();
        if told != [(RejectionReason::InvalidBounds, 1)] {
            return Err(format!("scale {scale:e}: {told:?}").into());
        }
        signs.compare(&drawn, 1)?;
    }
    Ok(())
}

fn coplanar(studio: &mut Studio) -> Result<(), Failed> {
    for far in [f32::INFINITY, 1e9] {
        for distance in [0.2, 5.0, 1e5] {
            let camera = Camera { far, ..camera(SIZE) };
            // A chequerboard at one depth.
            let colors = [Vec3::X * 0.5, Vec3::Y * 0.5, Vec3::Z * 0.5, Vec3::ONE * 0.25];
            let squares = (0..16).map(|index| {
                let (column, row) = (f64::from(index % 4) - 1.5, f64::from(index / 4) - 1.5);
                let sign = Sign::before(&camera, distance, distance * 0.25);
                let color = colors[(index % 4 + index / 4) as usize % 4];
                sign.moved(&camera, column * distance * 0.25, row * distance * 0.25).colored(color)
            });
            let signs = Signs::new(camera.clone(), squares.collect::<Vec<_>>())?;
            signs.expect(studio, &format!("a board at {distance} m"), 16)?;
            // All at one place: one of them is seen, and the same one at each pixel.
            let sign = Sign::before(&camera, distance, distance * 10.0);
            let stack = Signs::new(camera, colors.map(|color| sign.colored(color)))?;
            let drawn = studio.draw_whole(&stack.scene)?;
            let Some(look) = drawn.look else { continue };
            let [width, height] = look.size;
            let middle = look.middle();
            let differs = |(x, y): (usize, usize)| look.radiance(x, y) != middle;
            if (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).any(differs) {
                return Err(format!("a stack at {distance} m shows more than one of its signs").into());
            }
            if !colors.iter().any(|color| color.as_dvec3().to_array() == middle) {
                return Err(format!("a stack at {distance} m is {middle:?}").into());
            }
        }
    }
    Ok(())
}
