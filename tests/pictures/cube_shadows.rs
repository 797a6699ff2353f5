//! Shadows of a point light, whose maps are the faces of a cube.

use drawloom::glam::{DVec2, DVec3};
use drawloom::scene::{Camera, Light, Projection};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, radiance};
use crate::rays::{Panel, PanelScene};
use crate::shadows::{MAPS, expect, fixture_with, lamp, with_context, without_shadow};

pub const CASES: &[Case] = &[
    ("shadows_are_correct_across_the_edges_and_corners_of_a_cube", across_edges),
    ("a_lamps_shadow_errs_by_no_more_than_its_filter_and_a_pixel", error_in_pixels),
];

/// The directions of a cube's edges and corners.
fn edges_and_corners() -> impl Iterator<Item = DVec3> {
    let directions = (0..27).map(|index| DVec3::from([index % 3, index / 3 % 3, index / 9].map(|x| f64::from(x - 1))));
    directions.filter(|direction| direction.length_squared() > 1.5).map(DVec3::normalize)
}

const LAMP: DVec3 = DVec3::new(0.3, 1.0, -2.0);

/// A wall in a direction from a lamp, and a square whose shadow falls on it.
fn wall_and_square(direction: DVec3) -> PanelScene {
    let wall = Panel::facing(LAMP + direction * 2.5, -direction, 1.5);
    let mut square = Panel::facing(LAMP + direction, -direction, 0.25).double_sided();
    // Neither along the map's axes nor across them.
    (square.right, square.up) = (square.right + square.up * 0.3, square.up - square.right * 0.3);
    PanelScene::new(vec![wall, square], vec![lamp(LAMP)])
}

/// A camera that sees the shadow past the square.
fn view(direction: DVec3, side: u32) -> Camera {
    let looking = Camera::looking_at("main", LAMP + direction.any_orthonormal_vector() * 0.9, LAMP + direction * 2.5);
    sized(Camera { projection: Projection::Perspective { field_of_view: 0.9 }, ..looking }, [side; 2])
}

fn across_edges() -> Result<(), Failed> {
    for filter in [1, 4] {
        let maps = ShadowMaps { filter, side: 256 * filter, ..MAPS };
        let mut fixture = fixture_with(maps)?;
        for direction in edges_and_corners() {
            let panel_scene = PanelScene { maps, ..wall_and_square(direction) };
            let context = format!("towards {direction}, {filter}");
            let counts = panel_scene
                .expect(&mut fixture, &[view(direction, 64)])
                .map_err(|failed| with_context(failed, &context))?;
            expect(counts, 0.5, 0.05).map_err(|failed| with_context(failed, &context))?;
        }
    }
    Ok(())
}

/// Every point whose light is not what a ray finds is nearer to the edge of the shadow, along both axes of its face,
/// than the bound of [`ShadowMaps::cameras`].
fn error_in_pixels() -> Result<(), Failed> {
    for filter in [0, 1, 4] {
        let maps = ShadowMaps { filter, side: 128, ..MAPS };
        let mut fixture = fixture_with(maps)?;
        let mut greatest = 0.0_f64;
        for direction in edges_and_corners().chain([DVec3::NEG_Y, DVec3::new(0.2, -0.9, 0.1).normalize()]) {
            let error = greatest_error(&mut fixture, &wall_and_square(direction), &view(direction, 160), &maps)?;
            greatest = greatest.max(error);
        }
        let bound = f64::from(filter) + 1.0;
        println!("a filter of {filter}: {greatest:.3} of at most {bound} pixels");
        // Corners are snapped to 1/256 of a pixel, and the picture's positions are rounded.
        if greatest > bound + 0.02 || greatest < bound * 0.7 {
            return Err(format!("a filter of {filter}: {greatest} pixels").into());
        }
    }
    Ok(())
}

/// The greatest distance from the shadow's edge, in pixels of the map along the axis in which it is greater, at which a
/// pixel of the picture is neither fully lit nor fully dark as the ray says.
fn greatest_error(
    fixture: &mut Fixture,
    panel_scene: &PanelScene,
    view: &Camera,
    maps: &ShadowMaps,
) -> Result<f64, Failed> {
    let mut drawn = |light: Light| -> Result<Vec<[f64; 3]>, Failed> {
        let scene = PanelScene { lights: vec![light], ..panel_scene.clone() }.scene(std::slice::from_ref(view))?;
        let recorded = fixture.record(&scene)?;
        radiance(&fixture.submit(recorded)?, 0)
    };
    let (lit, found) = (drawn(without_shadow(lamp(LAMP)))?, drawn(lamp(LAMP))?);
    let [right, up, forward] = [DVec3::X, DVec3::Y, DVec3::NEG_Z].map(|axis| view.orientation.as_dquat() * axis);
    let half = 0.45_f64.tan();
    let (wall, square) = (panel_scene.panels[0], panel_scene.panels[1]);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let corners = corners.map(|[x, y]| square.center + square.right * x + square.up * y - LAMP);
    let mut greatest = 0.0_f64;
    for (index, (lit, found)) in lit.iter().zip(&found).enumerate() {
        let at = |place: usize| (place as f64 + 0.5) / f64::from(view.size[0]) * 2.0 - 1.0;
        let (x, y) = (at(index % view.size[0] as usize), -at(index / view.size[0] as usize));
        let ray = forward + (right * x + up * y) * half;
        let point = view.position + ray * ((wall.center - view.position).dot(wall.normal()) / ray.dot(wall.normal()));
        // Only the wall, away from where the square covers it.
        if lit[0] == 0.0 || panel_scene.nearest(view.position, ray).is_none_or(|(_, panel)| panel != 0) {
            continue;
        }
        let is_lit = panel_scene.nearest(LAMP, point - LAMP).is_some_and(|(_, panel)| panel == 0);
        if (found[0] / lit[0] - f64::from(u8::from(is_lit))).abs() > 2e-3 {
            let at_edge = distance_to_outline(point - LAMP, corners);
            // A face's pixels, as the documentation of `ShadowMaps::side` defines them.
            greatest = greatest.max(at_edge * f64::from(maps.side - 2 * maps.filter - 2) / 2.0);
        }
    }
    Ok(greatest)
}

/// The distance from a direction to the outline of a polygon, in the face of a cube that sees the direction: along the
/// axis in which it is greater, where the face reaches from -1 to 1.
fn distance_to_outline(direction: DVec3, corners: [DVec3; 4]) -> f64 {
    let axis = direction.abs().max_position();
    let project = |direction: DVec3| {
        let across = DVec2::new(direction[(axis + 1) % 3], direction[(axis + 2) % 3]);
        across / direction[axis].abs()
    };
    let point = project(direction);
    let mut nearest = f64::INFINITY;
    for side in 0..4 {
        let [start, end] = [corners[side], corners[(side + 1) % 4]].map(project);
        // The distance is convex along the side.
        let [mut low, mut high] = [0.0, 1.0];
        let distance = |share: f64| (start.lerp(end, share) - point).abs().max_element();
        for _ in 0..60 {
            let [first, second] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if distance(first) < distance(second) { high = second } else { low = first }
        }
        nearest = nearest.min(distance(low));
    }
    nearest
}
