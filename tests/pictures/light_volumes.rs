//! Light volumes clip nothing that the lights reach.

use drawloom::glam::{DQuat, DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Light, Projection};
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, radiance};
use crate::rays::{Counts, Panel, PanelScene};

pub const CASES: &[Case] = &[
    ("lights_reach_to_the_end_of_their_range", end_of_range),
    ("cones_of_every_width_light_everything_in_reach", cones),
    ("hemispheres_light_everything_in_reach", hemispheres),
    ("spheres_light_everything_in_reach", spheres),
    ("lights_outside_of_the_picture_light_its_edge", outside_of_the_picture),
    ("lights_are_drawn_from_within", from_within),
    ("the_near_plane_may_clip_a_light_volume", near_plane),
    ("a_hundred_lights_add_up", hundred),
    ("lights_test_depth_and_do_not_write_it", depth_is_left_alone),
    ("an_orthographic_camera_sees_the_same_light", orthographic),
    ("light_far_from_the_origin_equals_light_near_it", far_away),
];

const RANGE: f64 = 4.0;

fn point(position: DVec3) -> Light {
    Light::Point { position, intensity: Vec3::new(50.0, 40.0, 30.0), range: RANGE as f32, casts_shadow: false }
}

/// It is bright up to its edge, so that a clipped edge shows.
fn spot(position: DVec3, direction: DVec3, degrees: f32) -> Light {
    let outer_angle = degrees.to_radians();
    Light::Spot {
        position,
        direction: direction.as_vec3().normalize(),
        intensity: Vec3::new(50.0, 40.0, 30.0),
        range: RANGE as f32,
        inner_angle: outer_angle * 0.9,
        outer_angle,
        casts_shadow: false,
    }
}

fn hemisphere(position: DVec3, direction: DVec3) -> Light {
    Light::Hemispherical {
        position,
        direction: direction.as_vec3().normalize(),
        intensity: Vec3::new(50.0, 40.0, 30.0),
        range: RANGE as f32,
        casts_shadow: false,
    }
}

fn camera(position: DVec3, target: DVec3, degrees: f64) -> Camera {
    let field_of_view = degrees.to_radians() as f32;
    let camera = Camera::looking_at("main", position, target);
    sized(Camera { projection: Projection::Perspective { field_of_view }, ..camera }, [64, 64])
}

/// The six axes, and four directions between them.
fn directions() -> impl Iterator<Item = DVec3> {
    let between = [[1.0, 0.3, 0.3], [-0.3, 0.9, 0.2], [0.4, -0.1, -0.9], [1e-4, 1e-4, -1.0]].map(DVec3::from);
    DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).chain(between).map(DVec3::normalize)
}

fn end_of_range() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let position = DVec3::new(0.3, -0.2, 0.5);
    for light in [point(position), spot(position, DVec3::NEG_Z, 45.0), hemisphere(position, DVec3::NEG_Z)] {
        for (share, is_lit) in [(0.02, true), (0.5, true), (0.97, true), (0.999, true), (1.0, false), (1.2, false)] {
            let wall = Panel::facing(position + DVec3::NEG_Z * (share * RANGE), DVec3::Z, 40.0);
            let panel_scene = PanelScene::new(vec![wall], vec![light]);
            // A light close to the wall lights little of it.
            let target = wall.center;
            let views = [
                camera(position + DVec3::new(0.01, 0.02, 1.0), target, 90.0),
                camera(position + DVec3::new(1.5, 0.3, 0.3), target, 3.0),
                camera(position + DVec3::new(1.5, 0.3, 0.3), target, 120.0),
            ];
            let counts = panel_scene.expect(&mut fixture, &views)?;
            if (counts.lit > 0) != is_lit {
                return Err(format!("{light:?} at {share} of its range: {counts:?}").into());
            }
        }
    }
    // A directional light has no range.
    for distance in [1.0, 1e3, 1e6] {
        let sun = Light::Directional {
            direction: Vec3::new(0.48, -0.6, -0.64),
            illuminance: Vec3::new(3.0, 2.0, 1.0),
            casts_shadow: false,
        };
        let panel_scene = PanelScene::new(vec![Panel::facing(DVec3::NEG_Z * distance, DVec3::Z, distance)], vec![sun]);
        let counts = panel_scene.expect(&mut fixture, &[camera(DVec3::ZERO, DVec3::NEG_Z, 80.0)])?;
        expect_lit(counts, 1.0)?;
    }
    Ok(())
}

/// Fails unless about this fraction of the pixels with a known result is lit.
fn expect_lit(counts: Counts, least: f64) -> Result<(), Failed> {
    let Counts { lit, dark, fading, edges } = counts;
    let all = (lit + dark + fading + edges) as f64;
    let certain = fading as f64 <= 0.05 * all && edges as f64 <= 0.05 * all;
    if certain && lit as f64 >= least * all {
        Ok(())
    } else {
        Err(format!("too few pixels to compare: {counts:?}").into())
    }
}

/// A room around a light, which reaches the centres of the walls but not the corners.
fn room(light: Light) -> PanelScene {
    PanelScene::new(Panel::room(DVec3::ZERO, 0.8 * RANGE), vec![light])
}

fn cones() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    for degrees in [1.0_f32, 10.0, 45.0, 80.0, 90.0] {
        for direction in directions() {
            // Tilted, so that the axis meets no corner.
            let position = DVec3::new(0.11, -0.23, 0.17);
            let panel_scene = room(spot(position, direction, degrees));
            let sideways = direction.any_orthonormal_vector();
            let ahead = position + direction * (0.6 * RANGE);
            let wide = (f64::from(degrees) * 2.6).min(110.0);
            let views = [
                camera(position - direction * 0.2 + sideways * 0.3, position + direction * RANGE, wide),
                camera(position + sideways * 2.0, ahead, (f64::from(degrees) * 6.0).min(90.0)),
                camera(position + (direction + sideways) * 0.4, position - direction, 100.0),
            ];
            let counts = panel_scene
                .expect(&mut fixture, &views)
                .map_err(|failed| with_direction(failed, degrees, direction))?;
            expect_lit(counts, 0.05).map_err(|failed| with_direction(failed, degrees, direction))?;
        }
    }
    Ok(())
}

fn with_direction(failed: Failed, degrees: f32, direction: DVec3) -> Failed {
    format!("{degrees} degrees around {direction}: {}", failed.message().unwrap_or("")).into()
}

fn hemispheres() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    for direction in directions() {
        let position = DVec3::new(0.11, -0.23, 0.17);
        let sideways = direction.any_orthonormal_vector();
        let views = [
            camera(position - direction * 0.3, position + direction, 110.0),
            camera(position + direction * 2.0, position + sideways, 100.0),
            camera(position - sideways, position - direction + sideways * 4.0, 100.0),
        ];
        let counts = room(hemisphere(position, direction)).expect(&mut fixture, &views)?;
        expect_lit(counts, 0.15).map_err(|failed| with_direction(failed, 90.0, direction))?;
    }
    Ok(())
}

fn spheres() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    // Walls through the centre of a sphere, seen from all sides: the lit discs have the sphere's outline.
    for direction in directions() {
        let position = DVec3::new(0.3, 0.1, -0.2);
        let wall = Panel::facing(position - direction * 0.05, direction, 3.0 * RANGE);
        let panel_scene = PanelScene::new(vec![wall], vec![point(position)]);
        let sideways = direction.any_orthonormal_vector();
        let views = [
            camera(position + direction * 12.0, position, 45.0),
            camera(position + (direction + sideways * 2.0) * 3.0, position, 70.0),
            camera(position + (direction * 0.1 - sideways) * 3.0, position, 100.0),
        ];
        expect_lit(panel_scene.expect(&mut fixture, &views)?, 0.2)?;
    }
    Ok(())
}

fn from_within() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let position = DVec3::new(0.11, -0.23, 0.17);
    let direction = DVec3::new(0.6, 0.0, -0.8);
    let half_angle = 30.0_f32;
    // On the cone's surface at half of its height.
    let turn = DQuat::from_rotation_y(f64::from(half_angle).to_radians());
    let edge = turn * direction * (0.5 * RANGE);
    for light in [point(position), spot(position, direction, half_angle), hemisphere(position, direction)] {
        let panel_scene = PanelScene::new(Panel::room(DVec3::ZERO, 1.5 * RANGE), vec![light]);
        let eyes = [
            DVec3::ZERO,
            direction * 1e-3,
            direction * (RANGE * 0.5),
            direction * (RANGE * 0.9999),
            direction * (RANGE * 1.0001),
            direction * (RANGE * 1.2),
            -direction * 1e-3,
            -direction * 0.1,
            -direction * (RANGE * 0.999),
            edge * 0.999,
            edge,
            edge * 1.001,
            DVec3::Y * 0.05,
            DVec3::Y * (RANGE * 0.9999),
        ];
        let directions = [direction, -direction, DVec3::new(-0.8, 0.05, -0.6), DVec3::new(0.1, -1.0, 0.1)];
        for eye in eyes {
            let views = directions.map(|ahead| sized(camera(position + eye, position + eye + ahead, 100.0), [40, 40]));
            panel_scene.expect(&mut fixture, &views).map_err(|failed| with_direction(failed, half_angle, eye))?;
        }
    }
    // In the room above, much of the walls is out of range; in this one all walls are lit.
    for light in [point(position), spot(position, direction, half_angle), hemisphere(position, direction)] {
        for eye in [DVec3::ZERO, direction * 1.5, -direction, edge] {
            let directions = [direction, -direction, DVec3::new(-0.8, 0.05, -0.6), DVec3::new(0.1, -1.0, 0.1)];
            let views = directions.map(|ahead| sized(camera(position + eye, position + eye + ahead, 100.0), [40, 40]));
            let counts =
                room(light).expect(&mut fixture, &views).map_err(|failed| with_direction(failed, half_angle, eye))?;
            expect_lit(counts, 0.01)?;
        }
    }
    Ok(())
}

/// Lights to the left, right, above and below of a picture, which reach its outermost pixels with the last tenth of
/// their range.
fn outside_of_the_picture() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let wall = Panel::facing(DVec3::ZERO, DVec3::Z, 20.0);
    let view = camera(DVec3::Z * 5.0, DVec3::ZERO, 60.0);
    let edge = 5.0 * 30_f64.to_radians().tan();
    for outwards in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y] {
        let position = outwards * (edge + 0.9 * RANGE) + DVec3::Z * 0.4;
        let towards = -(outwards + DVec3::Z * 0.1).normalize();
        for light in [point(position), spot(position, towards, 40.0), hemisphere(position, towards)] {
            let counts = PanelScene::new(vec![wall], vec![light]).expect(&mut fixture, std::slice::from_ref(&view))?;
            if counts.lit < 20 {
                return Err(format!("{light:?} lights no edge: {counts:?}").into());
            }
        }
    }
    Ok(())
}

fn near_plane() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let position = DVec3::new(0.11, -0.23, 0.17);
    let direction = DVec3::new(0.0, 0.6, -0.8);
    for light in [point(position), spot(position, direction, 40.0), hemisphere(position, direction)] {
        for near in [0.5, 2.0, 3.0, 3.9] {
            let eyes =
                [position, position - direction, position + DVec3::new(1.5, 0.2, 1.0), position + DVec3::X * 1.2];
            let views = eyes.map(|eye| {
                let view = camera(eye, position + direction * 2.0 + DVec3::X * 0.1, 90.0);
                Camera { near, ..view }
            });
            near_plane_scene(light)
                .expect(&mut fixture, &views)
                .map_err(|failed| with_direction(failed, near, direction))?;
        }
    }
    Ok(())
}

fn near_plane_scene(light: Light) -> PanelScene {
    let mut panel_scene = room(light);
    // An object within the light, partly in front of the near plane.
    panel_scene.panels.extend(Panel::closed_box(DVec3::new(0.3, 0.9, -1.6), DVec3::new(0.5, 0.1, 0.4)));
    panel_scene
}

fn hundred() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let wall = Panel::facing(DVec3::ZERO, DVec3::Z, 8.0);
    let light = |index: u32| {
        let [column, row] = [index % 10, index / 10].map(f64::from);
        let position = DVec3::new(column - 4.5, row - 4.5, 0.3 + 0.05 * ((column * 3.0 + row * 7.0) % 5.0));
        let intensity = Vec3::new(1.0 + (index % 3) as f32, (index % 5) as f32, 0.25 * (index % 7) as f32);
        Light::Point { position, intensity, range: 1.0 + 0.5 * (index % 4) as f32, casts_shadow: false }
    };
    let panel_scene = PanelScene::new(vec![wall], (0..100).map(light).collect());
    let view = camera(DVec3::new(0.5, -1.0, 9.0), DVec3::ZERO, 65.0);
    expect_lit(panel_scene.expect(&mut fixture, std::slice::from_ref(&view))?, 0.7)?;

    let recorded = fixture.record(&panel_scene.scene(&[view])?)?;
    let processes = fixture.renderer.plan().processes().iter();
    let names: Vec<_> = processes.map(|planned| planned.name.clone()).collect();
    if names != ["geometry buffer", "point lights", "tone mapping"] || recorded.statistics().views[0].lights != 100 {
        return Err(format!("{names:?} draw {} lights", recorded.statistics().views[0].lights).into());
    }
    Ok(())
}

fn depth_is_left_alone() -> Result<(), Failed> {
    let wall = Panel::facing(DVec3::ZERO, DVec3::Z, 2.0);
    let behind = DVec3::NEG_Z;
    let small = |light: Light| match light {
        Light::Point { position, intensity, .. } => {
            Light::Point { position, intensity, range: 0.9, casts_shadow: false }
        }
        other => other,
    };
    let lights = [small(point(behind)), spot(behind, DVec3::NEG_Z, 60.0), hemisphere(behind, DVec3::NEG_Z)];
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).output("depth"))?;
    let view = camera(DVec3::new(1.0, 0.5, 4.0), DVec3::ZERO, 60.0);
    let mut depths = Vec::new();
    // Behind the wall; on both of its sides; in front of it.
    let before = lights.map(|light| shifted(light, DVec3::Z * 2.0));
    for lights in [vec![], lights.to_vec(), lights.into_iter().chain(before).collect(), before.to_vec()] {
        let panel_scene = PanelScene::new(vec![wall, Panel::facing(DVec3::NEG_Z * 2.5, DVec3::Z, 1.0)], lights);
        panel_scene.expect(&mut fixture, std::slice::from_ref(&view))?;
        let recorded = fixture.record(&panel_scene.scene(std::slice::from_ref(&view))?)?;
        depths.push(fixture.submit(recorded)?.read(0, "depth")?);
    }
    if depths.iter().any(|depth| *depth != depths[0]) {
        return Err("lights change the depth".into());
    }
    Ok(())
}

fn shifted(light: Light, shift: DVec3) -> Light {
    let mut light = light;
    if let Light::Point { position, .. } | Light::Spot { position, .. } | Light::Hemispherical { position, .. } =
        &mut light
    {
        *position += shift;
    }
    light
}

fn orthographic() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let position = DVec3::new(0.11, -0.23, 0.17);
    let direction = DVec3::new(0.3, -0.5, -0.8).normalize();
    let sun = Light::Directional {
        direction: Vec3::new(0.48, -0.6, -0.64),
        illuminance: Vec3::new(3.0, 2.0, 1.0),
        casts_shadow: false,
    };
    for light in [point(position), spot(position, direction, 35.0), hemisphere(position, direction), sun] {
        for (from, near, far) in [
            (DVec3::new(1.0, 2.0, 2.5), 0.1, 50.0),
            // The light reaches beyond the far plane and in front of the near plane.
            (DVec3::new(0.5, 1.0, 2.5), 0.1, 7.0),
            (DVec3::new(0.0, 0.0, 2.0), 2.5, 5.3),
            (DVec3::new(0.0, 0.0, 2.0), 0.5, 5.3),
            (DVec3::new(0.0, 0.0, -2.0), 0.01, 1.3),
        ] {
            let looking = Camera::looking_at("plan", from, from + DVec3::new(-0.1, -0.1, -1.0));
            let projection = Projection::Orthographic { height: 5.0 };
            let view = sized(Camera { projection, near, far, ..looking }, [64, 64]);
            let counts =
                room(light).expect(&mut fixture, &[view]).map_err(|failed| with_direction(failed, far, from))?;
            if counts.lit == 0 {
                return Err(format!("{light:?} from {from}: {counts:?}").into());
            }
        }
    }
    Ok(())
}

fn far_away() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let shift = DVec3::new(1e6, -5e5, 2.5e5);
    let position = DVec3::new(0.11, -0.23, 0.17);
    let direction = DVec3::new(0.3, -0.5, -0.8).normalize();
    for light in [point(position), spot(position, direction, 35.0), hemisphere(position, direction)] {
        let mut panel_scene = room(shifted(light, shift));
        panel_scene.panels.iter_mut().for_each(|panel| panel.center += shift);
        let eye = shift + DVec3::new(-1.0, 0.5, 2.0);
        let view = camera(eye, eye + direction, 100.0);
        expect_lit(panel_scene.expect(&mut fixture, std::slice::from_ref(&view))?, 0.04)?;

        // To the precision of half floats, it equals the picture that is drawn near the origin.
        let near = Camera { position: view.position - shift, ..view.clone() };
        let pictures = [(room(light), near), (panel_scene, view)].map(|(panel_scene, view)| {
            let recorded = fixture.record(&panel_scene.scene(&[view])?)?;
            radiance(&fixture.submit(recorded)?, 0)
        });
        let [one, other] = pictures;
        let differ = one?
            .as_flattened()
            .iter()
            .zip(other?.as_flattened())
            .map(|(one, other)| (one - other).abs() / one.max(1.0))
            .fold(0.0, f64::max);
        if differ > 2e-3 {
            return Err(format!("far away it is off by {differ}").into());
        }
    }
    Ok(())
}
