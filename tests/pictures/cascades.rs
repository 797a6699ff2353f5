//! A directional light with several maps: each point is looked up in one that is fine enough for its distance.

use drawloom::glam::DVec3;
use drawloom::scene::{Camera, Light, Projection, Scene};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::sized;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::radiance;
use crate::rays::{Panel, PanelScene};
use crate::shadows::{MAPS, camera, fixture_with, sun, with_context, without_shadow};

pub const CASES: &[Case] = &[
    ("shadows_are_as_fine_as_the_cascade_of_their_distance", shadows_at_all_distances),
    ("no_line_shows_where_one_cascade_follows_another", transitions),
    ("lit_surfaces_do_not_shadow_themselves_in_any_cascade", self_shadowing),
    ("near_edges_of_shadows_become_as_sharp_as_the_first_cascade", edges),
];

fn maps(cascades: u32, filter: u32) -> ShadowMaps {
    ShadowMaps { side: 512, max_distance: 60.0, cascades, filter, ..MAPS }
}

fn floor() -> Panel {
    Panel::facing(DVec3::ZERO, DVec3::Y, 120.0)
}

/// A camera 2 m above the floor that sees it from its feet to the horizon.
fn walker() -> Camera {
    let projection = Projection::Perspective { field_of_view: 1.2 };
    let looking = Camera::looking_at("main", DVec3::Y * 2.0, DVec3::new(0.0, 0.0, -6.0));
    sized(Camera { projection, near: 0.1, ..looking }, [160, 120])
}

/// Squares over the floor along the way, larger with their distance.
fn avenue() -> Vec<Panel> {
    let distances = [1.5, 3.0, 5.0, 8.0, 12.0, 18.0, 27.0, 40.0];
    let square = |distance: f64| {
        let center = DVec3::new(distance * 0.15, 0.25 + distance * 0.1, -distance);
        let mut square = Panel::facing(center, DVec3::Y, 0.15 * distance).double_sided();
        (square.right, square.up) = (square.right + square.up * 0.3, square.up - square.right * 0.3);
        square
    };
    distances.map(square).into_iter().chain([floor()]).collect()
}

fn shadows_at_all_distances() -> Result<(), Failed> {
    for (cascades, filter, split_lambda) in [(2, 1, 0.5), (3, 0, 0.0), (4, 1, 0.5), (4, 4, 1.0)] {
        let maps = ShadowMaps { split_lambda, ..maps(cascades, filter) };
        let mut fixture = fixture_with(maps)?;
        for direction in [DVec3::new(0.3, -0.9, 0.2), DVec3::new(-0.6, -0.5, -0.4)] {
            let lights = vec![sun(direction.normalize())];
            let panel_scene = PanelScene { panels: avenue(), lights, maps };
            let counts = panel_scene
                .expect(&mut fixture, &[walker()])
                .map_err(|failed| with_context(failed, format!("{cascades} {filter} {direction}")))?;
            if counts.lit < 6000 || counts.dark < 100 {
                return Err(format!("{cascades} {filter}: too few pixels to compare: {counts:?}").into());
            }
        }
    }
    Ok(())
}

/// A floor up to a wall, half of it under a roof: every pixel there is dark, and every other one lit.
fn transitions() -> Result<(), Failed> {
    for filter in [0, 1, 4] {
        let maps = maps(4, filter);
        let roof = Panel::facing(DVec3::new(-50.0, 6.0, -30.0), DVec3::Y, 50.0).double_sided();
        let wall = Panel::facing(DVec3::Z * -50.0, DVec3::Z, 90.0);
        let lights = vec![sun(DVec3::new(0.2, -0.9, -0.1).normalize())];
        let panel_scene = PanelScene { panels: vec![floor(), roof, wall], lights, maps };
        let looking = Camera::looking_at("main", DVec3::new(0.0, 2.0, 0.0), DVec3::new(0.0, 0.0, -9.0));
        let view = sized(Camera { near: 0.1, ..looking }, [160, 120]);
        let counts =
            panel_scene.expect(&mut fixture_with(maps)?, &[view]).map_err(|failed| with_context(failed, filter))?;
        if counts.lit < 3000 || counts.dark < 3000 {
            return Err(format!("too few pixels to compare: {counts:?}").into());
        }
    }
    Ok(())
}

fn self_shadowing() -> Result<(), Failed> {
    for (side, filter) in [(128, 1), (1024, 0), (1024, 4)] {
        let maps = ShadowMaps { side, ..maps(4, filter) };
        let mut fixture = fixture_with(maps)?;
        for degrees in [0.0_f64, 40.0, 75.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let light = sun(DVec3::new(sine * 0.8, -cosine, sine * 0.6));
            let mut drawn = |light: Light| -> Result<Vec<[f64; 3]>, Failed> {
                let recorded = fixture.record(&PanelScene::new(vec![floor()], vec![light]).scene(&[walker()])?)?;
                radiance(&fixture.submit(recorded)?, 0)
            };
            let (lit, shadowed) = (drawn(without_shadow(light))?, drawn(light)?);
            let wrong =
                lit.iter().zip(&shadowed).filter(|(lit, shadowed)| (lit[0] - shadowed[0]).abs() > 5e-3 * lit[0]);
            let count = wrong.count();
            if count > 0 {
                return Err(format!("{degrees} degrees, {side}, {filter}: {count} pixels are in shadow").into());
            }
        }
    }
    Ok(())
}

/// A shadow that fades from 0 to 1 over w metres differs from a sharp one by w/4 square metres for each metre of its
/// edge. So the sum of differences is proportional to the width of a map's pixel.
fn edges() -> Result<(), Failed> {
    let blocked = Panel::new(DVec3::new(-2.0, 0.5, -2.0), DVec3::new(2.0, 0.0, 0.6), DVec3::new(-0.6, 0.0, 2.0));
    let panels = vec![floor(), blocked.double_sided()];
    let direction = DVec3::new(0.1, -0.9, 0.05).normalize();
    let view = camera(DVec3::new(0.3, 1.0, 0.0), DVec3::new(0.2, 0.0, -1.2), 60.0);
    let view = sized(Camera { near: 0.1, ..view }, [256, 256]);
    let measured = |cascades: u32| -> Result<(f64, f64), Failed> {
        let maps = maps(cascades, 1);
        let mut fixture = fixture_with(maps)?;
        let mut drawn = |scene: &Scene| -> Result<Vec<[f64; 3]>, Failed> {
            let recorded = fixture.record(scene)?;
            radiance(&fixture.submit(recorded)?, 0)
        };
        let scene = |light| PanelScene::new(panels.clone(), vec![light]).scene(std::slice::from_ref(&view));
        let (lit, found) = (drawn(&scene(without_shadow(sun(direction)))?)?, drawn(&scene(sun(direction))?)?);
        let [map, ..] = &maps.cameras("", &sun(direction), std::slice::from_ref(&view))[..] else {
            return Err("there is no map".into());
        };
        let Projection::Orthographic { height } = map.projection else { return Err("it is not orthographic".into()) };
        let fraction = lit.iter().zip(&found).filter(|(lit, _)| lit[0] > 0.0).map(|(lit, found)| found[0] / lit[0]);
        let error: f64 = fraction.map(|visible| visible.min(1.0 - visible).max(0.0)).sum();
        Ok((error, f64::from(height) / f64::from(maps.side)))
    };
    let (single, coarse) = measured(1)?;
    let (several, fine) = measured(4)?;
    let (found, expected) = (single / several, coarse / fine);
    println!("edges: {single:.1} and {several:.1} pixels, {found:.2} times less; by theory {expected:.2} times");
    if (found / expected).ln().abs() > 0.2 || expected < 4.0 {
        return Err(format!("edges are {found} times as sharp, and should be {expected} times").into());
    }
    Ok(())
}
