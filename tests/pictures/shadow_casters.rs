//! Which objects cast shadows, and the content of shadow maps.

use drawloom::glam::{DVec2, DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Blend, Camera, LayerMask, Light, Material, Mesh, Projection, RenderObject, Scene, Topology};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::{cube, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::radiance;
use crate::rays::{Panel, PanelScene};
use crate::shadows::{MAPS, camera, fixture_with, hemisphere, lamp, spot, sun, with_context};

pub const CASES: &[Case] = &[
    ("boxes_cast_their_shadow_mirrored_or_not", boxes),
    ("squares_cast_their_shadow_as_lists_and_as_strips", squares),
    ("blended_objects_cast_no_shadow", blended_casts_none),
    ("blended_objects_are_darker_in_shadow", blended_receives),
    ("objects_outside_of_the_layers_of_maps_cast_no_shadow", layers),
    ("extreme_scales_do_not_corrupt_a_shadow_map", extreme_scales),
    ("casters_that_are_larger_than_a_map_leave_finite_light_and_later_maps_right", larger_than_maps),
    ("a_shadow_map_holds_the_nearest_depth", depths),
];

fn lights() -> [Light; 4] {
    let down = DVec3::new(0.2, -0.9, -0.3).normalize();
    let position = DVec3::new(-0.4, 3.0, 0.9);
    [sun(down), spot(position, down, 45.0), hemisphere(position, down), lamp(position)]
}

fn floor() -> Panel {
    Panel::facing(DVec3::ZERO, DVec3::Y, 6.0)
}

/// A floor in one light, seen from above, and from just over it; and the panels of the scene.
struct FloorScene {
    floor: PanelScene,
    scene: Scene,
}

impl FloorScene {
    fn new(light: Light) -> Result<Self, Failed> {
        let views = [
            camera(DVec3::new(2.0, 3.5, 3.0), DVec3::new(0.3, 0.5, -0.2), 50.0),
            camera(DVec3::new(1.2, 0.6, 0.8), DVec3::new(0.2, 0.0, -0.2), 80.0),
        ];
        let floor = PanelScene { panels: vec![floor()], lights: vec![light], maps: MAPS };
        let scene = floor.scene(&views)?;
        Ok(Self { floor, scene })
    }

    fn add(
        &mut self,
        mesh: Handle<Mesh>,
        material: Material,
        change: impl FnOnce(&mut RenderObject),
    ) -> Result<(), Failed> {
        let material = self.scene.add(material)?;
        let mut object = RenderObject::new(mesh, material, DVec3::Y);
        change(&mut object);
        self.scene.add_object(object)?;
        Ok(())
    }

    /// The expected result with these panels on top.
    fn with(&self, panels: Vec<Panel>) -> PanelScene {
        let mut panel_scene = self.floor.clone();
        panel_scene.panels.extend(panels);
        panel_scene
    }
}

fn white() -> Material {
    Material { diffuse: Vec3::ONE, ..Material::default() }
}

fn boxes() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    for light in lights() {
        for signs in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, -1.0, -1.0), Vec3::NEG_ONE] {
            let half = Vec3::new(0.5, 0.15, 0.3);
            let mut floor_scene = FloorScene::new(light)?;
            let mesh = floor_scene.scene.add(cube())?;
            floor_scene.add(mesh, white(), |object| object.scale = half * signs)?;
            let panel_scene = floor_scene.with(Panel::closed_box(DVec3::Y, half.as_dvec3()));
            let counts = panel_scene
                .expect_of(&mut fixture, &floor_scene.scene)
                .map_err(|failed| with_context(failed, signs))?;
            if counts.dark < 50 {
                return Err(format!("too few pixels to compare: {counts:?}").into());
            }
        }
    }
    Ok(())
}

fn squares() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    for light in lights() {
        for (topology, mirrored) in
            [(Topology::TriangleList, 1.0), (Topology::TriangleStrip, 1.0), (Topology::TriangleStrip, -1.0)]
        {
            // Visible from both sides; from the light's side only; from the other side only, and then it casts no
            // shadow.
            for (double_sided, turn) in [(true, -90.0_f32), (true, 90.0), (false, -90.0), (false, 90.0)] {
                let mut floor_scene = FloorScene::new(light)?;
                let mesh = floor_scene.scene.add(square(topology))?;
                floor_scene.add(mesh, Material { double_sided, ..white() }, |object| {
                    object.orientation = Quat::from_rotation_x(turn.to_radians());
                    object.scale = Vec3::new(0.5 * mirrored, 0.4, 0.7);
                })?;
                let up = -f64::from(turn).signum();
                let panel = Panel { double_sided, ..Panel::new(DVec3::Y, DVec3::X * 0.5, DVec3::NEG_Z * (0.4 * up)) };
                let counts = floor_scene.with(vec![panel]).expect_of(&mut fixture, &floor_scene.scene);
                let counts = counts
                    .map_err(|failed| with_context(failed, format!("{topology:?} {mirrored} {double_sided} {turn}")))?;
                if (counts.fading > 20) != (double_sided || up > 0.0) {
                    return Err(format!("{double_sided} {turn}: {counts:?}").into());
                }
            }
        }
    }
    Ok(())
}

fn blended_casts_none() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    for light in lights() {
        for blend in [Blend::Alpha, Blend::Additive, Blend::Subtractive] {
            let mut floor_scene = FloorScene::new(light)?;
            // From below, the glass is not visible.
            floor_scene.scene.cameras.remove(0);
            let mesh = floor_scene.scene.add(cube())?;
            floor_scene.add(mesh, Material { blend, opacity: 0.9, ..white() }, |object| {
                object.scale = Vec3::new(0.6, 0.1, 0.6)
            })?;
            let counts = floor_scene.floor.expect_of(&mut fixture, &floor_scene.scene)?;
            if counts.lit < 2500 {
                return Err(format!("too few pixels to compare: {counts:?}").into());
            }
        }
    }
    Ok(())
}

/// A floor of glass that reflects half of the light, with nothing behind it.
fn blended_receives() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    for light in lights() {
        for blend in [Blend::Alpha, Blend::Additive] {
            let shade = Panel::facing(DVec3::Y, DVec3::Y, 0.5).double_sided();
            let mut floor_scene = FloorScene::new(light)?;
            let mut scene = PanelScene { panels: vec![shade], ..floor_scene.floor.clone() }
                .scene(&floor_scene.scene.cameras[1..])?;
            std::mem::swap(&mut floor_scene.scene, &mut scene);
            let mesh = floor_scene.scene.add(square(Topology::TriangleList))?;
            floor_scene.add(mesh, Material { blend, opacity: 0.5, ..white() }, |object| {
                object.position = DVec3::ZERO;
                object.orientation = Quat::from_rotation_x(-90_f32.to_radians());
                object.scale = Vec3::splat(6.0);
            })?;
            let mut panel_scene = floor_scene.with(vec![shade]);
            panel_scene.lights = vec![halved(light)];
            let counts = panel_scene
                .expect_of(&mut fixture, &floor_scene.scene)
                .map_err(|failed| with_context(failed, format!("{light:?}")))?;
            if counts.lit < 1000 || counts.dark < 50 {
                return Err(format!("too few pixels to compare: {counts:?}").into());
            }
        }
    }
    Ok(())
}

fn halved(light: Light) -> Light {
    let mut light = light;
    if let Light::Directional { illuminance: color, .. }
    | Light::Point { intensity: color, .. }
    | Light::Spot { intensity: color, .. }
    | Light::Hemispherical { intensity: color, .. } = &mut light
    {
        *color *= 0.5;
    }
    light
}

/// A square over the floor, in a layer whose objects cast shadows or in another one.
fn layers() -> Result<(), Failed> {
    let maps = ShadowMaps { layers: LayerMask::layer(3), cascades: 3, ..MAPS };
    let mut fixture = fixture_with(maps)?;
    for light in lights() {
        for (layers, casts) in [(LayerMask::layer(3), true), (LayerMask::layer(2), false)] {
            let mut floor_scene = FloorScene::new(light)?;
            // From below, the square is not visible.
            floor_scene.scene.cameras.remove(0);
            let mesh = floor_scene.scene.add(square(Topology::TriangleList))?;
            floor_scene.add(mesh, Material { double_sided: true, ..white() }, |object| {
                object.orientation = Quat::from_rotation_x(-90_f32.to_radians());
                object.scale = Vec3::splat(0.5);
                object.layers = layers;
            })?;
            floor_scene.floor.maps = maps;
            let square = Panel::facing(DVec3::Y, DVec3::Y, 0.5).double_sided();
            let panels = if casts { vec![square] } else { Vec::new() };
            let counts = floor_scene.with(panels).expect_of(&mut fixture, &floor_scene.scene);
            let counts = counts.map_err(|failed| with_context(failed, format!("{layers:?} {light:?}")))?;
            if (counts.fading > 20) != casts {
                return Err(format!("{layers:?} {light:?}: {counts:?}").into());
            }
        }
    }
    Ok(())
}

fn extreme_scales() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    // At a lamp, and near the centre of the scene.
    let position = DVec3::new(-0.4, 3.0, 0.9);
    for light in lights() {
        let is_sun = matches!(light, Light::Directional { .. });
        // The camera is inside of the large ones, and sees no side of them. Nor does a lamp. They hide the sun, which
        // is outside.
        let large = if is_sun {
            // Of still larger triangles a map has a wrong slope, as they cross its near plane: `larger_than_maps` draws
            // them.
            [Vec3::new(-1e2, 1e2, 1e2), Vec3::splat(1e3)]
        } else {
            [Vec3::new(-1e6, 1e3, 1e5), Vec3::splat(1e20)]
        };
        for scale in [Vec3::ZERO, Vec3::splat(1e-20)].into_iter().chain(large) {
            let mut floor_scene = FloorScene::new(light)?;
            let [mesh, flat] =
                [floor_scene.scene.add(cube())?, floor_scene.scene.add(square(Topology::TriangleStrip))?];
            floor_scene.add(mesh, white(), |object| (object.scale, object.position) = (scale, position))?;
            floor_scene.add(flat, Material { double_sided: true, ..white() }, |object| {
                object.orientation = Quat::from_rotation_x(-90_f32.to_radians());
                object.scale = Vec3::splat(0.4);
            })?;
            let mut panels = vec![Panel::facing(DVec3::Y, DVec3::Y, 0.4).double_sided()];
            if is_sun && scale.y > 1.0 {
                panels.extend(Panel::closed_box(position, scale.abs().as_dvec3()));
            }
            let counts = floor_scene.with(panels).expect_of(&mut fixture, &floor_scene.scene);
            let counts = counts.map_err(|failed| with_context(failed, format!("{scale} {light:?}")))?;
            if counts.dark < 50 {
                return Err(format!("too few pixels to compare: {counts:?}").into());
            }
        }
    }
    Ok(())
}

/// What lies in their shadow is documented to be wrong.
fn larger_than_maps() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    let [sun, ..] = lights();
    for scale in [Vec3::new(-1e6, 1e3, 1e5), Vec3::splat(1e20)] {
        let mut floor_scene = FloorScene::new(sun)?;
        let mesh = floor_scene.scene.add(cube())?;
        floor_scene
            .add(mesh, white(), |object| (object.scale, object.position) = (scale, DVec3::new(-0.4, 3.0, 0.9)))?;
        let recorded = fixture.record(&floor_scene.scene)?;
        let submission = fixture.submit(recorded)?;
        for view in 0..floor_scene.scene.cameras.len() {
            let light = radiance(&submission, view)?;
            if !light.iter().flatten().all(|channel| channel.is_finite()) {
                return Err(format!("a box of {scale}: light that is not finite").into());
            }
        }
        let floor_scene = FloorScene::new(sun)?;
        floor_scene.with(vec![]).expect_of(&mut fixture, &floor_scene.scene)?;
    }
    Ok(())
}

fn depths() -> Result<(), Failed> {
    let mut fixture = fixture_with(MAPS)?;
    for light in lights() {
        let mut panels = Panel::room(DVec3::Y * 3.5, 3.5);
        panels.extend(Panel::closed_box(DVec3::new(0.3, 1.2, -0.2), DVec3::new(0.5, 0.2, 0.6)));
        let panel_scene = PanelScene { panels, lights: vec![light], maps: MAPS };
        let view = camera(DVec3::new(2.0, 3.0, 2.0), DVec3::ZERO, 60.0);
        let maps = MAPS.cameras("", &light, std::slice::from_ref(&view));
        let recorded = fixture.record(&panel_scene.scene(&[view])?)?;
        let submission = fixture.submit(recorded)?;
        for (index, map) in maps.iter().enumerate() {
            let picture = submission.read(1 + index, "shadow map")?;
            if [picture.width, picture.height] != [MAPS.side; 2] {
                return Err(format!("it is {} by {}", picture.width, picture.height).into());
            }
            let depth = |x: u32, y: u32| {
                let start = (y * MAPS.side + x) as usize * 4;
                let bytes = [0, 1, 2, 3].map(|byte| picture.bytes[start + byte]);
                f64::from(f32::from_le_bytes(bytes))
            };
            compare_depths(&panel_scene, map, depth).map_err(|problem| format!("{light:?}{}: {problem}", map.name))?;
        }
    }
    Ok(())
}

/// The ray of a map's pixel, with `along` in the unit of depth; `None` outside of the disc.
fn map_ray(map: &Camera, x: f64, y: f64) -> Option<(DVec3, DVec3)> {
    let side = f64::from(map.size[0]);
    let clip = DVec2::new(x / side * 2.0 - 1.0, 1.0 - y / side * 2.0);
    let orientation = map.orientation.as_dquat().normalize();
    let (from, along) = match map.projection {
        Projection::Perspective { field_of_view } => {
            (DVec3::ZERO, (clip * (f64::from(field_of_view) / 2.0).tan()).extend(-1.0))
        }
        Projection::Orthographic { height } => ((clip * (f64::from(height) / 2.0)).extend(0.0), DVec3::NEG_Z),
        // The half space as a disc: a direction at an angle of φ from the axis is at tan(φ/2).
        _ => {
            let angle = 2.0 * clip.length().atan();
            let offset = clip.normalize_or(DVec2::X) * angle.sin();
            (clip.length() < 1.0).then_some((DVec3::ZERO, offset.extend(-angle.cos())))?
        }
    };
    Some((map.position + orientation * from, orientation * along))
}

fn compare_depths(panel_scene: &PanelScene, map: &Camera, depth: impl Fn(u32, u32) -> f64) -> Result<(), String> {
    let [near, far] = [map.near, map.far].map(f64::from);
    let mut compared = 0;
    for (x, y) in (0..map.size[1]).step_by(5).flat_map(|y| (0..map.size[0]).step_by(3).map(move |x| (x, y))) {
        let nearest = |right: f64, down: f64| {
            let (from, along) = map_ray(map, f64::from(x) + 0.5 + right, f64::from(y) + 0.5 + down)?;
            panel_scene.nearest(from, along)
        };
        let around = [(0.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
        let Some(hits) = around.iter().map(|&(right, down)| nearest(right, down)).collect::<Option<Vec<_>>>() else {
            continue;
        };
        if hits.iter().any(|hit| hit.1 != hits[0].1) {
            continue;
        }
        let found = match map.projection {
            Projection::Perspective { .. } => near / depth(x, y),
            _ => far - depth(x, y) * (far - near),
        };
        // Straight edges of 5° are off by half a pixel of 1024, which is a quarter here; and in between, distances are
        // longer by a thousandth.
        let slope = hits.iter().map(|hit| (hit.0 - hits[0].0).abs()).fold(0.0, f64::max);
        if (found - hits[0].0).abs() > 0.3 * slope + 1e-3 * hits[0].0 {
            return Err(format!("at ({x}, {y}) it is {found} m away, and should be {}", hits[0].0));
        }
        compared += 1;
    }
    if compared > 2000 { Ok(()) } else { Err(format!("only {compared} pixels could be compared")) }
}
