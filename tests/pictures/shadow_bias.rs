//! Lit surfaces do not shadow themselves, and shadows begin where their casters end.

use std::f64::consts::{PI, TAU};

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Light, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::{cube, sized};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, radiance};
use crate::rays::{Panel, PanelScene};
use crate::shadows::{MAPS, camera, fixture_with, hemisphere, lamp, spot, sun, with_context, without_shadow};

pub const CASES: &[Case] = &[
    ("lit_surfaces_do_not_shadow_themselves_in_the_sun", || surfaces(|_, axis| sun(axis), &[0.0])),
    ("lit_surfaces_do_not_shadow_themselves_in_a_spot_light", || {
        surfaces(|position, axis| spot(position, axis, 57.0), &[0.0, 40.0])
    }),
    ("lit_surfaces_do_not_shadow_themselves_in_a_hemisphere", || surfaces(hemisphere, &[0.0, 45.0, 80.0])),
    // On a face of the cube, and across its edge.
    ("lit_surfaces_do_not_shadow_themselves_in_a_point_light", || surfaces(|position, _| lamp(position), &[0.0, 36.4])),
    ("without_bias_lit_surfaces_shadow_themselves", without_bias),
    ("a_ball_does_not_shadow_its_lit_side", ball),
    ("a_shadow_begins_at_the_foot_of_its_caster", box_on_a_floor),
    ("a_shadow_begins_as_near_as_the_filter_reads", close_to_a_wall),
];

/// The greatest loss of light of a surface by self-shadowing, as a fraction of its light.
fn max_self_shadowing(fixture: &mut Fixture, lit: &Scene, shadowed: &Scene) -> Result<f64, Failed> {
    let mut shots = Vec::new();
    for scene in [lit, shadowed] {
        let recorded = fixture.record(scene)?;
        shots.push(radiance(&fixture.submit(recorded)?, 0)?);
    }
    let pixels = shots[0].iter().zip(&shots[1]).map(|(lit, shadowed)| (lit[0], shadowed[0]));
    let losses = pixels.filter(|(lit, _)| *lit > 0.0).map(|(lit, shadowed)| (lit - shadowed) / lit);
    // A maximum would ignore NaN.
    Ok(losses.fold(0.0, |max, loss| if loss <= max { max } else { loss }))
}

/// A panel that a light meets at an angle, this many degrees from the light's axis; a camera in front of it; and the
/// light.
fn slope(
    light: impl Fn(DVec3, DVec3) -> Light,
    distance: f64,
    [slope, turn, off_axis]: [f64; 3],
) -> (Panel, Camera, Light) {
    let position = DVec3::new(0.3, 2.0, -0.7);
    let axis = DVec3::new(0.1, -0.9, -0.3).normalize();
    let right = axis.cross(DVec3::Y).normalize();
    let [cosine, sine] = [off_axis.to_radians().cos(), off_axis.to_radians().sin()];
    let direction = axis * cosine + (right * 0.8 + right.cross(axis) * 0.6) * sine;
    let right = (right - direction * right.dot(direction)).normalize();
    let tangent = right * turn.cos() + right.cross(direction) * turn.sin();
    let normal = -direction * slope.to_radians().cos() + tangent * slope.to_radians().sin();
    let center = position + direction * distance;
    let panel = Panel::facing(center, normal, distance * 0.2);
    let projection = Projection::Perspective { field_of_view: 0.7 };
    let looking = Camera::looking_at("main", center + normal * (distance * 0.5), center);
    let view = sized(Camera { projection, near: 0.01, ..looking }, [48, 48]);
    (panel, view, light(position, axis))
}

fn surfaces(light: impl Fn(DVec3, DVec3) -> Light, angles_off_axis: &[f64]) -> Result<(), Failed> {
    // Along the map's axes, and across them.
    let turns =
        [0.0, PI / 4.0].into_iter().flat_map(|turn| angles_off_axis.iter().map(move |&off_axis| [turn, off_axis]));
    let turns: Vec<_> = turns.collect();
    for (side, filter) in [(64, 1), (256, 0), (1024, 4), (2048, 1)] {
        let maps = ShadowMaps { side, filter, max_distance: 60.0, ..MAPS };
        let mut fixture = fixture_with(maps)?;
        for (distance, angle) in [0.5, 12.0].into_iter().flat_map(|distance| SLOPES.map(|angle| (distance, angle))) {
            for &[turn, off_axis] in &turns {
                let (panel, view, light) = slope(&light, distance, [angle, turn, off_axis]);
                let scene = |light| PanelScene::new(vec![panel], vec![light]).scene(std::slice::from_ref(&view));
                let loss = max_self_shadowing(&mut fixture, &scene(without_shadow(light))?, &scene(light)?)?;
                if loss.is_nan() || loss > 5e-3 {
                    let which = format!("{angle} degrees, {distance} m, {off_axis} degrees off axis, {turn}, {maps:?}");
                    return Err(format!("it loses {loss} of its light to self-shadowing: {which}").into());
                }
            }
        }
    }
    Ok(())
}

const SLOPES: [f64; 5] = [0.0, 30.0, 60.0, 75.0, 85.0];

/// Without this the cases above could pass vacuously.
fn without_bias() -> Result<(), Failed> {
    for bias in [0.0, 0.5] {
        let mut fixture = fixture_with(ShadowMaps { bias, ..MAPS })?;
        for light in
            [|_, axis| sun(axis), |position, axis| spot(position, axis, 57.0), hemisphere, |position, _| lamp(position)]
                as [fn(DVec3, DVec3) -> Light; 4]
        {
            let (panel, view, light) = slope(light, 4.0, [70.0, PI / 4.0, 0.0]);
            let scene = |light| PanelScene::new(vec![panel], vec![light]).scene(std::slice::from_ref(&view));
            let loss = max_self_shadowing(&mut fixture, &scene(without_shadow(light))?, &scene(light)?)?;
            if loss < 0.02 {
                return Err(format!("with a bias of {bias}, {light:?} loses only {loss}").into());
            }
        }
    }
    Ok(())
}

/// A sphere of radius 1 with smooth normals, of this many strips from pole to pole.
fn ball_mesh(strips: u32) -> Result<Mesh, Failed> {
    let around = strips * 2;
    let vertex = |strip: u32, side: u32| {
        let (sine, cosine) = (PI * f64::from(strip) / f64::from(strips)).sin_cos();
        let (z, x) = (TAU * f64::from(side) / f64::from(around)).sin_cos();
        let position = Vec3::new((sine * x) as f32, cosine as f32, (sine * z) as f32).to_array();
        Vertex { position, normal: position, uv: [0.0; 2] }
    };
    let vertices = (0..=strips).flat_map(|strip| (0..=around).map(move |side| vertex(strip, side))).collect();
    let corner = |strip: u32, side: u32| strip * (around + 1) + side;
    let quads = (0..strips).flat_map(|strip| (0..around).map(move |side| (strip, side)));
    let indices = quads.flat_map(|(strip, side)| {
        let [a, b] = [corner(strip, side), corner(strip, side + 1)];
        let [c, d] = [corner(strip + 1, side), corner(strip + 1, side + 1)];
        [a, b, c, b, d, c]
    });
    Ok(Mesh::new("ball", Topology::TriangleList, vertices, indices.collect())?)
}

fn ball() -> Result<(), Failed> {
    // If a pixel of the map is much smaller than a facet, the facet's geometric slope shows, which differs from its
    // normals'.
    for (side, strips, most) in [(256, 16, 0.01), (512, 32, 0.01), (2048, 64, 0.01), (2048, 16, 0.2)] {
        let mut fixture = fixture_with(ShadowMaps { side, ..MAPS })?;
        let axis = DVec3::new(0.3, -0.9, -0.3).normalize();
        let position = -axis * 5.0;
        for light in [sun(axis), spot(position, axis, 30.0), hemisphere(position, axis), lamp(position)] {
            let scene = |light| -> Result<Scene, Failed> {
                let mut scene = Scene::new();
                scene.cameras = vec![camera(DVec3::new(1.0, 2.5, 2.5), DVec3::ZERO, 40.0)];
                scene.lights = vec![light];
                let material = scene.add(Material { diffuse: Vec3::ONE, ..Material::default() })?;
                let mesh = scene.add(ball_mesh(strips)?)?;
                let mut object = RenderObject::new(mesh, material, DVec3::ZERO);
                object.orientation = Quat::from_rotation_y(0.3);
                scene.add_object(object)?;
                Ok(scene)
            };
            let loss = max_self_shadowing(&mut fixture, &scene(without_shadow(light))?, &scene(light)?)?;
            if loss.is_nan() || loss > most {
                return Err(format!(
                    "{strips} strips, {side} pixels, {light:?}: it loses {loss} of its light to self-shadowing"
                )
                .into());
            }
        }
    }
    Ok(())
}

/// Points nearer to the foot than the bias may be lit; all others that the box hides are dark.
fn box_on_a_floor() -> Result<(), Failed> {
    for (side, filter) in [(512, 1), (2048, 4)] {
        let maps = ShadowMaps { side, filter, ..MAPS };
        let mut fixture = fixture_with(maps)?;
        for degrees in [15.0_f64, 45.0, 70.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let axis = DVec3::new(sine * 0.8, -cosine, sine * 0.6);
            let position = DVec3::Y * 0.5 - axis * 6.0;
            for light in [sun(axis), spot(position, axis, 30.0), hemisphere(position, axis), lamp(position)] {
                let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 8.0);
                let mut panel_scene = PanelScene { panels: vec![floor], lights: vec![light], maps };
                let mut scene =
                    panel_scene.scene(&[camera(DVec3::new(3.0, 4.0, 3.0), DVec3::new(0.5, 0.3, 0.4), 50.0)])?;
                // One mesh, because objects that meet in an edge have cracks between them.
                let mesh = scene.add(cube())?;
                let material = scene.add(Material { diffuse: Vec3::ONE, ..Material::default() })?;
                let half = Vec3::new(0.5, 1.0, 0.7);
                scene.add_object(RenderObject { scale: half, ..RenderObject::new(mesh, material, DVec3::Y) })?;
                panel_scene.panels.extend(Panel::closed_box(DVec3::Y, half.as_dvec3()));
                let counts = panel_scene
                    .expect_of(&mut fixture, &scene)
                    .map_err(|failed| with_context(failed, format!("{degrees} {side} {filter} {light:?}")))?;
                if counts.dark < 50 || counts.lit < 1500 {
                    return Err(format!("{degrees}: too few pixels to compare: {counts:?}").into());
                }
            }
        }
    }
    Ok(())
}

/// The floor behind a wall is dark from where the filter reads nothing of what is in front of the wall, and half a
/// pixel, which covers the bias.
fn close_to_a_wall() -> Result<(), Failed> {
    for filter in [0, 1, 4] {
        let maps = ShadowMaps { filter, ..MAPS };
        let mut fixture = fixture_with(maps)?;
        for degrees in [15.0_f64, 30.0, 45.0, 60.0, 75.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let axis = DVec3::new(sine, -cosine, 0.0);
            let wall = Panel::new(DVec3::Y, DVec3::Z * 2.0, DVec3::Y).double_sided();
            let floor = Panel::facing(DVec3::ZERO, DVec3::Y, 4.0);
            let light = spot(-axis * 6.0, axis, 20.0);
            let looking = Camera { far: 6.0, ..Camera::looking_at("plan", DVec3::Y * 4.0, DVec3::ZERO) };
            let (half_width, width) = (0.25, 512_u32);
            let height = (2.0 * half_width / 16.0) as f32;
            let view =
                sized(Camera { projection: Projection::Orthographic { height }, ..looking }, [width, width / 16]);
            let recorded = fixture.record(&PanelScene::new(vec![wall, floor], vec![light]).scene(&[view])?)?;
            let found = radiance(&fixture.submit(recorded)?, 0)?;
            let middle = (width * (width / 32)) as usize;
            let pixel = 2.0 * 6.0 * 20_f64.to_radians().tan() / f64::from(maps.side) / cosine;
            let lit = (0..width).rev().find(|x| found[middle + *x as usize][0] > 0.0);
            let lit = lit.ok_or("nothing is lit")?;
            let away = ((f64::from(lit) + 0.5) / f64::from(width) * 2.0 - 1.0) * half_width / pixel;
            let max = f64::from(filter) + 1.5;
            if !(0.0..=max).contains(&away) {
                return Err(format!(
                    "at {degrees} degrees the shadow begins {away} pixels away, instead of at most {max}"
                )
                .into());
            }
        }
    }
    Ok(())
}
