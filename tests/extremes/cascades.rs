//! The shadow of a sun, in maps around what one main camera sees, against rays to the sun.

use drawloom::glam::{DVec2, DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Camera, Light, Material, Projection, RenderObject, Scene, Topology};
use drawloom::view::ShadowMaps;
use drawloom_testing::scenes::square;
use libtest_mimic::Failed;

use crate::Case;
use crate::capture::Capture;
use crate::derived::camera_at;
use crate::error_table::{EXTREMES, Extreme, TOUCHING, expect_within};
use crate::harness::{Harness, Setup};
use crate::markers::with_context;
use crate::oracle::View;

pub const CASES: &[Case] = &[("the_edge_of_a_suns_shadow_is_within_texels_of_where_rays_say", shadow_edges)];

const SIDE: u32 = 192;
const FILTER: u32 = 1;

/// How far maps reach, in units of the scale.
const REACH: f64 = 10.0;

/// A floor, and a square above it, in units of the scale around a point below the camera.
struct ShadowScene {
    scene: Scene,
    /// From the camera to the middle of the floor, and to that of the square.
    floor: DVec3,
    blocker: DVec3,
    half: f64,
    /// The direction in which the light travels.
    light: DVec3,
}

impl ShadowScene {
    fn new(extreme: &Extreme, eye: DVec3, direction: DVec3) -> Result<Self, Failed> {
        let Extreme { position, scale, .. } = *extreme;
        let mut scene = Scene::new();
        let looking = Camera::looking_at("main", DVec3::ZERO, DVec3::new(0.3, -0.25, -3.0) - eye * 0.4);
        let camera = Camera { orientation: looking.orientation, ..camera_at(extreme) };
        let near = if extreme.name == TOUCHING { 1e-4 } else { camera.near };
        scene.cameras = vec![Camera { near, ..camera }];
        let (mesh, up) =
            (scene.add(square(Topology::TriangleList))?, Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2));
        let material = scene.add(Material { diffuse: Vec3::ONE, double_sided: true, ..Material::default() })?;
        // A camera that touches the floor is under the square, and sees the shadow at its feet.
        let ahead = if extreme.name == TOUCHING { -0.75 } else { 4.0 };
        let (floor, blocker, half) = (-eye * scale, (DVec3::new(0.2, 1.5, -ahead) - eye) * scale, 1.3 * scale);
        for (offset, half) in [(floor, 60.0 * scale), (blocker, half)] {
            let object = RenderObject::new(mesh, material, position + offset);
            scene.add_object(RenderObject { orientation: up, scale: Vec3::splat(half as f32), ..object })?;
        }
        let light = direction.as_vec3().normalize();
        scene.lights = vec![Light::Directional { direction: light, illuminance: Vec3::splat(3.0), casts_shadow: true }];
        Ok(Self { scene, floor, blocker, half, light: light.as_dvec3().normalize() })
    }

    /// Where a ray from the camera first meets the floor, if nothing is before it or nearly so.
    fn on_floor(&self, view: &View, pixel: [usize; 2]) -> Option<(DVec3, f64)> {
        let ray = |dx: f64, dy: f64| view.ray(pixel[0] as f64 + 0.5 + dx, pixel[1] as f64 + 0.5 + dy)[1];
        let meets = |height: f64, direction: DVec3| direction * (height / direction.y);
        let misses_blocker = |direction: DVec3| {
            let hit = meets(self.blocker.y, direction);
            let is_before = hit.dot(direction) > 0.0;
            !is_before || (hit - self.blocker).abs().max_element() > self.half
        };
        let around = [[0.0, 0.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
        if !around.iter().all(|&[dx, dy]| misses_blocker(ray(dx, dy))) {
            return None;
        }
        let hit = meets(self.floor.y, ray(0.0, 0.0));
        // The direction has length 1 along the axis.
        let depth = hit.dot(view.forward);
        (depth > view.near && (hit - self.floor).abs().max_element() < 50.0 * self.half).then_some((hit, depth))
    }

    /// Whether the square is between a point and the sun, and how far the ray there is from its nearest edge.
    fn shadow_at(&self, point: DVec3) -> (bool, f64) {
        let towards = -self.light;
        let hit = point + towards * ((self.blocker.y - point.y) / towards.y) - self.blocker;
        let inside = DVec2::new(self.half - hit.x.abs(), self.half - hit.z.abs());
        let is_inside = inside.min_element() > 0.0;
        // In the plane across the light, where maps have their pixels, a distance in the floor's plane is shorter by no
        // more than this.
        let beside = DVec3::new((-inside.x).max(0.0), 0.0, (-inside.y).max(0.0)).length();
        (is_inside, if is_inside { inside.min_element() } else { beside } * towards.y.abs())
    }
}

/// The width of a pixel of the finest map that has what is seen at some depth, at most: the sphere of a slice around
/// the camera would be so large. Slices end as the practical split scheme says.
fn texel(camera: &Camera, maps: &ShadowMaps, depth: f64) -> Option<f64> {
    let Projection::Perspective { field_of_view } = camera.projection else { return None };
    let far = f64::from(maps.max_distance);
    let near = f64::from(camera.near).max(far * 1e-3);
    let end = |index: u32| {
        let share = f64::from(index) / f64::from(maps.cascades);
        let [by_ratio, by_depth] = [near * (far / near).powf(share), near + (far - near) * share];
        by_depth + (by_ratio - by_depth) * f64::from(maps.split_lambda)
    };
    let end = (1..=maps.cascades).map(end).find(|end| depth < *end)?;
    let (up, aspect) = ((f64::from(field_of_view) * 0.5).tan(), f64::from(camera.size[0]) / f64::from(camera.size[1]));
    let radius = end * (1.0 + up * up * (1.0 + aspect * aspect)).sqrt();
    // Without what lies beyond the slice for the filter, and for moving the map by less than a pixel.
    let unused = 2.0 * f64::from(maps.filter + 2);
    Some(2.0 * radius / (f64::from(maps.side) - unused))
}

/// Compares the pixels of the floor with the rays from there to the sun.
fn check(
    [bare, shadowed]: [&Capture; 2],
    shadow: &ShadowScene,
    maps: &ShadowMaps,
    (column, context): (&str, &str),
) -> Result<(), Failed> {
    let camera = &shadow.scene.cameras[0];
    let view = View::of(camera);
    let (mut lit, mut dark) = (0, 0);
    for (x, y) in (0..bare.size[1]).flat_map(|y| (0..bare.size[0]).map(move |x| (x, y))) {
        let Some((point, depth)) = shadow.on_floor(&view, [x, y]) else { continue };
        let Some(texel) = texel(camera, maps, depth) else { continue };
        let (is_dark, to_edge) = shadow.shadow_at(point);
        let visible = shadowed.radiance(x, y)[0] / bare.radiance(x, y)[0];
        let expected = if is_dark { 0.0 } else { 1.0 };
        // NaN is wrong, too.
        let is_wrong = (visible - expected).abs().total_cmp(&0.01).is_gt();
        // The filter reads `FILTER` + 1 pixels along each of the map's axes.
        let bound = f64::from(FILTER + 1) * 2_f64.sqrt();
        expect_within(
            ("edge of a sun's shadow", column, "texel"),
            &format!("{context}, ({x}, {y})"),
            [if is_wrong { to_edge / texel } else { 0.0 }, bound],
        )?;
        if to_edge > bound * texel {
            *(if is_dark { &mut dark } else { &mut lit }) += 1;
        }
    }
    if lit < 30 || dark < 5 {
        return Err(format!("{column}, {context}: {lit} lit pixels and {dark} dark ones").into());
    }
    Ok(())
}

fn shadow_edges(harness: &mut Harness) -> Result<(), Failed> {
    let shadows = ShadowQuality { side: SIDE, filter: FILTER, ..ShadowQuality::default() };
    let quality = Quality { shadows, ..Quality::balanced() };
    for extreme in EXTREMES.into_iter().chain([Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 }]) {
        // Maps reach a thousand kilometres at most.
        let extreme = Extreme { scale: extreme.scale.min(1e6 / REACH), ..extreme };
        // A camera that touches the floor, or stands on it.
        let (height, reach) = if extreme.name == TOUCHING { (0.05, 1.0) } else { (1.7, REACH) };
        for cascades in [1, 3] {
            let max_distance = (reach * extreme.scale) as f32;
            let maps = ShadowMaps { side: SIDE, filter: FILTER, max_distance, cascades, ..ShadowMaps::default() };
            let deferred = Deferred::to_picture().shadow_maps(Some(maps));
            let mut harness =
                harness.with(Setup { deferred, ..quality.into() }).map_err(|error| Failed::from(error.to_string()))?;
            // From above: its right vector is any, and the products of such a small number leave the range of f32.
            let overhead = [DVec3::NEG_Y, DVec3::new(1e-21, -1.0, 0.0), DVec3::new(-3e-23, -1.0, 2e-23)];
            for direction in [DVec3::new(0.3, -0.9, 0.2), DVec3::new(-0.4, -0.8, 0.1)].into_iter().chain(overhead) {
                let mut shadow = ShadowScene::new(&extreme, DVec3::Y * height, direction)?;
                let shadowed = harness.draw_whole(&shadow.scene)?;
                for light in &mut shadow.scene.lights {
                    if let Light::Directional { casts_shadow, .. } = light {
                        *casts_shadow = false;
                    }
                }
                let bare = harness.draw_whole(&shadow.scene)?;
                let (Some(bare), Some(shadowed)) = (&bare.capture, &shadowed.capture) else { continue };
                let context = format!("{cascades} cascades, along {direction}");
                check([bare, shadowed], &shadow, &maps, (extreme.name, &context))
                    .map_err(|failed| with_context(&context, failed))?;
            }
        }
    }
    Ok(())
}
