//! Levels of detail, and static groups that are executed as a whole.

use drawloom::glam::{DVec2, DVec3, Quat};
use drawloom::quality::{DepthPrecision, Quality};
use drawloom::scene::{Camera, Changes, Scene, SceneRef, StaticGroup};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::leveled::globe;
use drawloom_testing::scenes::{field, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::capture::Capture;
use crate::derived::camera_at;
use crate::error_table::{EXTREMES, Extreme, TOUCHING, expect_within};
use crate::harness::{Drawn, Harness};
use crate::markers::{Marker, MarkerScene};
use crate::moved_scenes::{scale_scene, shift_scene};
use crate::oracle::View;

pub const CASES: &[Case] = &[
    ("levels_of_detail_move_no_point_by_more_than_a_pixel", levels),
    ("a_camera_within_the_bounds_of_an_object_sees_its_full_detail", touched_levels),
    ("static_groups_change_no_byte", static_groups),
    ("a_camera_within_a_static_group_and_objects_that_are_left_out_change_no_byte", touched_static_groups),
];

/// The triangles of the globe's levels.
const TRIANGLES: [usize; 3] = [960, 224, 48];

fn harness_for_levels(harness: &Harness) -> Result<Harness, Failed> {
    let quality = Quality { level_of_detail: 1.0, ..harness.name().affordable(Quality::balanced()) };
    harness.with(quality).map_err(|error| error.to_string().into())
}

/// A globe before a camera, whose colour it has.
fn globe_before(camera: &Camera, distance: f64, radius: f64) -> Result<MarkerScene, Failed> {
    let marker = Marker { orientation: Quat::IDENTITY, ..Marker::before(camera, distance, 2.0 * radius) };
    MarkerScene::of(globe(), camera.clone(), [marker])
}

/// The level that is drawn, by its number of triangles.
fn level_of(drawn: &Drawn) -> Result<usize, Failed> {
    let level = TRIANGLES.iter().position(|triangles| Some(*triangles) == drawn.triangles);
    level.ok_or_else(|| format!("{:?} triangles", drawn.triangles).into())
}

/// The most pixels by which a point in the bounds moves that faces the camera, if it moves by the error and stays
/// within them.
fn most_moved(view: &View, center: DVec3, radius: f64, error: f64) -> f64 {
    let mut most = 0.0_f64;
    let unit = |index: i32, count: i32| (f64::from(index) + 0.5) / f64::from(count);
    for (row, column) in (0..16).flat_map(|row| (0..32).map(move |column| (row, column))) {
        let (down, around) = (unit(row, 16) * std::f64::consts::PI, unit(column, 32) * std::f64::consts::TAU);
        let normal = DVec3::new(down.sin() * around.sin(), down.cos(), down.sin() * around.cos());
        let from = center + normal * radius;
        if normal.dot(from - view.origin) > 0.0 {
            continue;
        }
        let sideways = [normal.any_orthonormal_vector(), normal.cross(normal.any_orthonormal_vector())];
        for aside in [DVec3::ZERO, sideways[0], -sideways[0], sideways[1], -sideways[1]] {
            // A little inwards, so that it stays within the sphere.
            let to = from + (aside - normal * (0.5 * error / radius).max(0.01)).normalize() * error;
            let [(one, near), (other, nearer)] = [from, to].map(|point| view.project(point));
            let is_inside = (0.0..=1.0).contains(&(one / DVec2::from(view.whole)).min_element())
                && (0.0..=1.0).contains(&(one / DVec2::from(view.whole)).max_element());
            if near >= view.near && nearer >= view.near && is_inside && to.distance(center) <= radius {
                most = most.max(one.distance(other));
            }
        }
    }
    most
}

/// Fails if a pixel is unlike a sphere, but for the pixels that its levels cut off, and the pixel itself.
fn expect_sphere(
    scene: &MarkerScene,
    capture: &Capture,
    (center, radius, depth): (DVec3, f64, f64),
    moved: f64,
) -> Result<(), Failed> {
    let view = View::of(&scene.scene.cameras[0]);
    let color = scene.markers[0].color.as_dvec3().to_array();
    let background = scene.scene.background.as_dvec3().to_array();
    let margin = moved + 1.0;
    for (x, y) in (0..capture.size[1]).flat_map(|y| (0..capture.size[0]).map(move |x| (x, y))) {
        let hits = |radius: f64| {
            let around = [[0.0, 0.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
            around.map(|[across, down]| {
                let [_, direction] = view.ray(x as f64 + 0.5 + across * margin, y as f64 + 0.5 + down * margin);
                let nearest = direction * (center.dot(direction) / direction.length_squared());
                nearest.distance(center) < radius && center.dot(direction) > 0.0
            })
        };
        let found = capture.radiance(x, y);
        if hits(radius - depth).iter().all(|hits| *hits) && found != color {
            return Err(format!("({x}, {y}) is {found:?}, and inside").into());
        }
        if hits(radius).iter().all(|hits| !*hits) && found != background {
            return Err(format!("({x}, {y}) is {found:?}, and outside").into());
        }
    }
    Ok(())
}

fn levels(harness: &mut Harness) -> Result<(), Failed> {
    let mut harness = harness_for_levels(harness)?;
    let globe = globe();
    let errors = [0.0, f64::from(globe.levels()[0].error()), f64::from(globe.levels()[1].error())];
    for extreme in EXTREMES {
        let Extreme { name, scale, .. } = extreme;
        let camera = Camera { near: (0.005 * scale) as f32, ..camera_at(&extreme) };
        let mut drawn_levels = Vec::new();
        for distance in [1.02, 1.3, 2.0, 3.0, 5.0, 12.0, 300.0] {
            let scene = globe_before(&camera, distance * scale, scale)?;
            let drawn = scene.draw(&mut harness)?;
            let level = level_of(&drawn)?;
            let view = View::of(&camera);
            let center = scene.markers[0].position - camera.position;
            let moved = if level == 0 { 0.0 } else { most_moved(&view, center, scale, errors[level] * scale) };
            expect_within(("level of detail", name, "pixel"), &format!("{distance} radii away"), [moved, 1.0])?;
            if let Some(capture) = &drawn.capture {
                // The first level is below the sphere, too.
                let depth = 0.02 * scale;
                let sphere = (center, scale, depth);
                expect_sphere(&scene, capture, sphere, moved).map_err(|failed| {
                    crate::markers::with_context(&format!("{name}, {distance} radii away, level {level}"), failed)
                })?;
            }
            drawn_levels.push(level);
        }
        if drawn_levels[0] != 0 || drawn_levels.last() != Some(&2) || !drawn_levels.is_sorted() {
            return Err(format!("{name}: levels {drawn_levels:?}").into());
        }
    }
    // What is very far away, and as large.
    for distance in [1e6, 1e9] {
        let camera = camera_at(&Extreme { name: "", position: DVec3::ZERO, scale: 1.0 });
        for (radii, level) in [(1.3, 0), (300.0, 2)] {
            let scene = globe_before(&camera, distance, distance / radii)?;
            let found = level_of(&scene.draw(&mut harness)?)?;
            if found != level {
                return Err(format!("level {found} of a globe {distance:e} m away, {radii} of its radii").into());
            }
        }
    }
    Ok(())
}

fn touched_levels(harness: &mut Harness) -> Result<(), Failed> {
    let mut harness = harness_for_levels(harness)?;
    for scale in [1e-6, 1.0, 1e6] {
        for (distance, near) in
            [(0.0, 0.05), (0.5, 0.05), (0.5, 0.5), (0.995, 1e-3), (1.0, 1e-3), (1.0 + 1e-7, 1e-6), (1.05, 0.05)]
        {
            for position in [DVec3::ZERO, EXTREMES[1].position] {
                // Far away, no position is within a micrometre.
                if position != DVec3::ZERO && scale < 1.0 {
                    continue;
                }
                let camera = camera_at(&Extreme { name: TOUCHING, position, scale });
                let camera = Camera { near: (near * scale) as f32, ..camera };
                let scene = globe_before(&camera, distance * scale, scale)?;
                let level = level_of(&scene.draw(&mut harness)?)?;
                let context = format!("{distance} of {scale:e} m away, near {near}");
                // At level 0 nothing moves.
                let moved = if level == 0 { 0.0 } else { f64::INFINITY };
                expect_within(("level of detail", TOUCHING, "pixel"), &context, [moved, 1.0])?;
            }
        }
    }
    Ok(())
}

/// Renderers whose views execute static groups: they order nothing by depth, and test for no occlusion.
fn harness_for_static_groups(harness: &Harness) -> Result<Harness, Failed> {
    let quality = harness.name().affordable(Quality::balanced());
    let quality = Quality { opaque_order: DepthPrecision::UNORDERED, occlusion: None, ..quality };
    harness.with(quality).map_err(|error| error.to_string().into())
}

/// Draws a scene with static groups in three frames, in the last of which they are executed, and compares each with one
/// without.
///
/// The object at `without_position`, if there is one, has a position that is not a number, which no owned scene takes.
fn compare_static_groups(
    harness: &Harness,
    scene: &mut Scene,
    without_position: Option<usize>,
    [column, context]: [&str; 2],
) -> Result<(), Failed> {
    let mut plain = harness_for_static_groups(harness)?;
    scene.static_groups.clear();
    let mut positions = scene.as_scene_ref().positions.to_vec();
    if let Some(object) = without_position {
        positions[object] = DVec3::NAN;
    }
    let expected = plain.outcome(&SceneRef { positions: &positions, ..scene.as_scene_ref() })?.drawn()?;
    let count = positions.len() as u32;
    let static_groups = [0..count / 3, count / 3..count - 2];
    scene.static_groups =
        static_groups.into_iter().map(|objects| StaticGroup::new(format!("{objects:?}"), objects.collect())).collect();
    let mut with_static_groups = harness_for_static_groups(harness)?;
    let mut executed = 0;
    for _ in 0..3 {
        let frame = SceneRef { positions: &positions, changes: Changes::Objects(&[]), ..scene.as_scene_ref() };
        let found = with_static_groups.outcome(&frame)?.drawn()?;
        executed = found.static_groups;
        if found.scene_issues != expected.scene_issues || found.visible < expected.visible {
            return Err(
                format!("{column}, {context}: {:?}, not {:?}", found.scene_issues, expected.scene_issues).into()
            );
        }
        let different = match (&found.capture, &expected.capture) {
            (Some(found), Some(expected)) => found.different_bytes(expected),
            _ => 0,
        };
        expect_within(("static group", column, "byte"), context, [different as f64, 0.0])?;
    }
    // What reaches beyond the far plane is not executed as a whole.
    if executed == 0 && scene.cameras[0].far.is_infinite() {
        return Err(format!("{column}, {context}: no static group was executed").into());
    }
    Ok(())
}

/// A scene with static groups, somewhere in the world.
fn place(mut scene: Scene, extreme: &Extreme) -> Result<Scene, Failed> {
    scene.cameras.truncate(1);
    scene.cameras[0] = sized(scene.cameras[0].clone(), [48, 32]);
    scale_scene(&mut scene, extreme.scale)?;
    shift_scene(&mut scene, extreme.position)?;
    Ok(scene)
}

fn static_groups(harness: &mut Harness) -> Result<(), Failed> {
    for extreme in EXTREMES {
        compare_static_groups(harness, &mut place(field(60), &extreme)?, None, [extreme.name, "a field"])?;
        // Its shadow maps take long on the CPU.
        if !harness.name().is_slow() {
            compare_static_groups(harness, &mut place(everything(), &extreme)?, None, [extreme.name, "everything"])?;
        }
    }
    Ok(())
}

fn touched_static_groups(harness: &mut Harness) -> Result<(), Failed> {
    for position in [DVec3::ZERO, EXTREMES[0].position] {
        let mut scene = place(field(60), &Extreme { name: TOUCHING, position, scale: 1.0 })?;
        let objects: Vec<_> = scene.objects().collect();
        let middle = scene.object(objects[4])?;
        // At an object, with the near plane across others, and with the far plane across others.
        let endless = f32::INFINITY;
        let aside = DVec3::new(-0.3, 0.2, 3.0);
        for (aside, near, far) in
            [(DVec3::ZERO, 0.05, endless), (DVec3::X, 0.5, endless), (aside, 2.0, endless), (aside, 0.05, 9.0)]
        {
            scene.cameras[0].position = middle.position + aside;
            (scene.cameras[0].near, scene.cameras[0].far) = (near, far);
            let context = format!("{aside} from an object");
            compare_static_groups(harness, &mut scene, None, [TOUCHING, &context])?;
        }
        // Objects without size, out of reach, and too large, and one without a position.
        for (index, aside, scale) in [(0, 0.0, 0.0), (2, 1e10, 1.0), (3, 0.0, f32::MAX)] {
            let mut object = scene.object(objects[index])?;
            object.position.x += aside;
            object.scale *= scale;
            scene.replace_object(objects[index], object)?;
        }
        compare_static_groups(harness, &mut scene, Some(1), [TOUCHING, "with objects that are left out"])?;
    }
    Ok(())
}
