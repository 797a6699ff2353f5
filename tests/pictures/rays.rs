//! The expected picture of flat panels, computed by ray casting in f64: it shares no code with the renderer.

use std::f64::consts::{PI, TAU};

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Light, Material, Mesh, Projection, RenderObject, Scene, Topology, Vertex};
use drawloom::view::ShadowMaps;
use libtest_mimic::Failed;

use crate::fixture::{Fixture, radiance};

/// A flat white parallelogram that reflects all light, visible from the side that right × up points to.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    /// In the world, in metres.
    pub center: DVec3,
    /// From the centre to the midpoint of an edge.
    pub right: DVec3,
    /// From the centre to the midpoint of the next edge.
    pub up: DVec3,
    /// Whether it is visible from both sides, and blocks light from both.
    pub double_sided: bool,
}

impl Panel {
    /// A panel that is visible only from the side that it faces.
    pub fn new(center: DVec3, right: DVec3, up: DVec3) -> Self {
        Self { center, right, up, double_sided: false }
    }

    /// A square of this half width around a centre.
    pub fn facing(center: DVec3, normal: DVec3, half: f64) -> Self {
        let right = normal.any_orthonormal_vector();
        Self::new(center, right * half, normal.cross(right) * half)
    }

    /// The same, visible from both sides.
    pub fn double_sided(self) -> Self {
        Self { double_sided: true, ..self }
    }

    pub fn normal(&self) -> DVec3 {
        self.right.cross(self.up).normalize()
    }

    /// Six panels that face inwards: a room.
    pub fn room(center: DVec3, half: f64) -> Vec<Self> {
        DVec3::AXES
            .into_iter()
            .flat_map(|axis| [axis, -axis])
            .map(|axis| Self::facing(center + axis * half, -axis, half))
            .collect()
    }

    /// Six panels that face outwards: a box.
    pub fn closed_box(center: DVec3, half: DVec3) -> Vec<Self> {
        let side = |axis: DVec3, right: DVec3| {
            let up = axis.cross(right);
            Self::new(center + axis * half, right * half, up * half)
        };
        let axes = [(DVec3::X, DVec3::Y), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::X)];
        axes.into_iter().flat_map(|(axis, right)| [side(axis, right), side(-axis, right)]).collect()
    }

    fn mesh(&self) -> Result<Mesh, Failed> {
        let normal = self.normal().as_vec3().to_array();
        let corner = |x: f64, y: f64| Vertex {
            position: (self.right * x + self.up * y).as_vec3().to_array(),
            normal,
            uv: [0.0; 2],
        };
        let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
        Ok(Mesh::new("panel", Topology::TriangleList, corners, vec![0, 1, 2, 2, 1, 3])?)
    }
}

/// A panel, prepared for ray intersection.
struct Face {
    center: DVec3,
    normal: DVec3,
    /// Vectors whose dot products with a point relative to the centre are 1 at the end of `right` and of `up`.
    right: DVec3,
    up: DVec3,
    double_sided: bool,
}

impl Face {
    fn new(panel: &Panel) -> Self {
        let across = panel.right.cross(panel.up);
        let size = across.length_squared();
        let (right, up) = (panel.up.cross(across) / size, across.cross(panel.right) / size);
        let (center, normal) = (panel.center, across.normalize());
        Self { center, normal, right, up, double_sided: panel.double_sided }
    }

    /// Where a ray meets its plane, as a multiple of `along`; infinite if they are parallel.
    fn plane_distance(&self, from: DVec3, along: DVec3) -> f64 {
        (self.center - from).dot(self.normal) / along.dot(self.normal)
    }

    fn hit(&self, from: DVec3, along: DVec3) -> Option<f64> {
        let towards = along.dot(self.normal);
        if towards == 0.0 || (towards > 0.0 && !self.double_sided) {
            return None;
        }
        let share = (self.center - from).dot(self.normal) / towards;
        if share <= 0.0 {
            return None;
        }
        let local = from + along * share - self.center;
        (local.dot(self.right).abs() <= 1.0 && local.dot(self.up).abs() <= 1.0).then_some(share)
    }
}

/// Panels, and the lights that shine on them.
#[derive(Clone, Debug, Default)]
pub struct PanelScene {
    pub panels: Vec<Panel>,
    pub lights: Vec<Light>,
    /// How shadows are drawn.
    pub maps: ShadowMaps,
}

/// Bounds of a radiance, channel by channel.
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl PanelScene {
    pub fn new(panels: Vec<Panel>, lights: Vec<Light>) -> Self {
        Self { panels, lights, maps: ShadowMaps::default() }
    }

    /// The scene that the renderer draws.
    pub fn scene(&self, cameras: &[Camera]) -> Result<Scene, Failed> {
        let mut scene = Scene::new();
        scene.cameras = cameras.to_vec();
        scene.lights.clone_from(&self.lights);
        let material = |double_sided| Material { diffuse: Vec3::ONE, double_sided, ..Material::default() };
        let [one, both] = [scene.add(material(false))?, scene.add(material(true))?];
        for panel in &self.panels {
            let mesh = scene.add(panel.mesh()?)?;
            let material = if panel.double_sided { both } else { one };
            scene.add_object(RenderObject::new(mesh, material, panel.center))?;
        }
        Ok(scene)
    }
}

/// The number of pixels by expected result.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub lit: usize,
    pub dark: usize,
    /// Pixels in a shadow's penumbra, which may have any value between the two.
    pub fading: usize,
    /// Pixels at the edges of panels, which may have any value.
    pub edges: usize,
}

impl PanelScene {
    /// Draws the panels, and fails if a pixel of any camera differs from the ray cast result.
    pub fn expect(&self, fixture: &mut Fixture, cameras: &[Camera]) -> Result<Counts, Failed> {
        self.expect_of(fixture, &self.scene(cameras)?)
    }

    /// Draws a scene, and fails if a pixel of any camera differs from the ray cast result.
    pub fn expect_of(&self, fixture: &mut Fixture, scene: &Scene) -> Result<Counts, Failed> {
        let recorded = fixture.record(scene)?;
        let submission = fixture.submit(recorded)?;
        self.expect_radiance(&scene.cameras, |view| radiance(&submission, view))
    }

    /// Fails if a pixel of any camera's radiance differs from the ray cast result.
    pub fn expect_radiance(
        &self,
        cameras: &[Camera],
        radiance_of: impl Fn(usize) -> Result<Vec<[f64; 3]>, Failed>,
    ) -> Result<Counts, Failed> {
        let mut counts = Counts::default();
        for (view, camera) in cameras.iter().enumerate() {
            self.compare(&radiance_of(view)?, camera, &mut counts)
                .map_err(|problem| format!("view {view}: {problem}"))?;
        }
        Ok(counts)
    }

    /// Fails if a pixel of a camera's picture differs from the ray cast result.
    pub fn compare_with(&self, camera: &Camera, found: &[[f64; 3]]) -> Result<Counts, Failed> {
        let mut counts = Counts::default();
        self.compare(found, camera, &mut counts)?;
        Ok(counts)
    }

    /// The distance to the nearest panel on a ray, in lengths of `along`, and the panel's index.
    pub fn nearest(&self, from: DVec3, along: DVec3) -> Option<(f64, usize)> {
        let faces = self.panels.iter().map(Face::new).enumerate();
        let hits = faces.filter_map(|(index, face)| Some((face.hit(from, along)?, index)));
        hits.min_by(|one, other| one.0.total_cmp(&other.0))
    }

    fn compare(&self, found: &[[f64; 3]], camera: &Camera, counts: &mut Counts) -> Result<(), String> {
        let rays = Rays {
            ray_camera: RayCamera::new(camera),
            camera,
            faces: self.panels.iter().map(Face::new).collect(),
            lights: &self.lights,
            map_pixels: self.lights.iter().map(|light| map_pixels(light, &self.maps, camera)).collect(),
            slice_ends: slice_ends(&self.maps, camera),
            filter: self.maps.filter,
        };
        let [width, height] = camera.size;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let (mut wrong, mut worst) = (0, None::<(f64, u32, u32, DVec3, DVec3, DVec3)>);
        for ((x, y), &found) in pixels.zip(found) {
            let Some(Bounds { low, high }) = rays.radiance(x, y) else {
                counts.edges += 1;
                continue;
            };
            let found = DVec3::from(found);
            if low.max_element() > 0.0 {
                counts.lit += 1;
            } else if high.max_element() < 1e-6 {
                counts.dark += 1;
            } else {
                counts.fading += 1;
            }
            if !(found.cmpge(low).all() && found.cmple(high).all()) {
                wrong += 1;
                let off = (low - found).max(found - high).max_element() / high.max_element().max(1e-6);
                if worst.is_none_or(|(most, ..)| off > most || off.is_nan()) {
                    worst = Some((off, x, y, found, low, high));
                }
            }
        }
        match worst {
            None => Ok(()),
            Some((_, x, y, found, low, high)) => Err(format!(
                "{wrong} of {} pixels are wrong; at ({x}, {y}) it is {found}, and should be from {low} to {high}",
                width * height
            )),
        }
    }
}

/// Casts the rays of one camera.
struct Rays<'a> {
    ray_camera: RayCamera,
    camera: &'a Camera,
    faces: Vec<Face>,
    lights: &'a [Light],
    /// For each light, that of each of its cascades, or of all its maps.
    map_pixels: Vec<Vec<f64>>,
    /// The distances at which the cascades end.
    slice_ends: Vec<f64>,
    filter: u32,
}

impl Rays<'_> {
    /// The nearest face that the camera sees along a ray.
    fn nearest_face(&self, from: DVec3, along: DVec3) -> Option<usize> {
        let mut nearest = (f64::from(self.camera.far), None);
        for (index, face) in self.faces.iter().enumerate() {
            if let Some(share) = face.hit(from, along)
                && share >= f64::from(self.camera.near)
                && share <= nearest.0
            {
                nearest = (share, Some(index));
            }
        }
        nearest.1
    }

    /// The bounds of a pixel; `None` if it is so close to an edge that rounding decides.
    fn radiance(&self, x: u32, y: u32) -> Option<Bounds> {
        let ray = |right: f64, down: f64| self.ray_camera.ray(f64::from(x) + 0.5 + right, f64::from(y) + 0.5 + down);
        let face_at = |right: f64, down: f64| {
            let (from, along) = ray(right, down);
            self.nearest_face(from, along)
        };
        let index = face_at(0.0, 0.0);
        let offset = 0.02;
        let around = [(offset, offset), (-offset, offset), (offset, -offset), (-offset, -offset)];
        if around.iter().any(|&(right, down)| face_at(right, down) != index) {
            return None;
        }
        let Some(index) = index else {
            return Some(Bounds { low: DVec3::ZERO, high: DVec3::ZERO });
        };
        let face = &self.faces[index];
        let point_at = |right: f64, down: f64| {
            let (from, along) = ray(right, down);
            from + along * face.plane_distance(from, along)
        };
        let (from, along) = ray(0.0, 0.0);
        let normal = if along.dot(face.normal) > 0.0 { -face.normal } else { face.normal };
        let center = point_at(0.0, 0.0);
        // A rasterizer snaps corners to a grid of 1/256 of a pixel, and the surface moves as much.
        let footprint = center.distance(point_at(1.0, 0.0)).max(center.distance(point_at(0.0, 1.0)));
        let error = footprint / 256.0 + from.distance(center) * 1e-5;
        let mut sum = Bounds { low: DVec3::ZERO, high: DVec3::ZERO };
        let [.., forward] = self.ray_camera.axes;
        let depth = (center - self.ray_camera.position).dot(forward);
        let slice = self.slice_ends.iter().take_while(|end| depth > **end).count();
        for (light, pixels) in self.lights.iter().zip(&self.map_pixels) {
            let pixel = pixels[slice.min(pixels.len() - 1)];
            let [low, high] = illuminance(light, center, normal, error);
            let [least, most] = if high > 0.0 { self.lit(light, pixel, index, center, normal) } else { [0.0; 2] };
            let color = color(light) / PI;
            sum.low += color * (low * least);
            sum.high += color * (high * most);
        }
        // Half floats, rounded once for each light.
        let rounding = (0.5_f64).powi(11) * (1.0 + self.lights.len() as f64);
        let smallest = (0.5_f64).powi(22);
        Some(Bounds { low: sum.low * (1.0 - rounding) - smallest, high: sum.high * (1.0 + rounding) + smallest })
    }

    /// The least and the greatest fraction of a light after shadowing: 0 or 1, but anything in between where the filter
    /// meets an edge, and so close behind the shadow caster that the bias may reach past it.
    fn lit(&self, light: &Light, pixel: f64, index: usize, point: DVec3, normal: DVec3) -> [f64; 2] {
        if !light.casts_shadow() {
            return [1.0; 2];
        }
        let width = edge_width(light, pixel, self.filter, point, normal);
        let right = normal.any_orthonormal_vector();
        let up = normal.cross(right);
        let ring = |corners: u32, radius: f64| {
            (0..corners).map(move |corner| {
                let (sine, cosine) = (TAU * f64::from(corner) / f64::from(corners)).sin_cos();
                point + (right * cosine + up * sine) * radius
            })
        };
        let [mut least, mut most] = [1.0, 0.0];
        for point in ring(24, width * 1.02).chain(ring(6, width * 0.5)).chain([point]) {
            match self.distance_behind(light, index, point) {
                None => most = 1.0,
                Some(distance) if distance < width * 1.5 => (least, most) = (0.0, 1.0),
                Some(_) => least = 0.0,
            }
            if least < most {
                break;
            }
        }
        [least, most]
    }

    /// The distance from a point to the face that blocks a light from it, if one does; the point lies on the face at
    /// `index`.
    fn distance_behind(&self, light: &Light, index: usize, point: DVec3) -> Option<f64> {
        let (from, along) = match *light {
            Light::Directional { direction, .. } => {
                let along = direction.as_dvec3().normalize() * 1e4;
                (point - along, along)
            }
            Light::Point { position, .. } | Light::Spot { position, .. } | Light::Hemispherical { position, .. } => {
                (position, point - position)
            }
            _ => return None,
        };
        let others = self.faces.iter().enumerate().filter(|(other, _)| *other != index);
        let shares = others.filter_map(|(_, face)| face.hit(from, along)).filter(|share| *share < 1.0 - 1e-9);
        shares.min_by(f64::total_cmp).map(|share| (1.0 - share) * along.length())
    }
}

/// Where the cascades of `maps` end in what a camera sees, in metres, by the practical split scheme.
fn slice_ends(maps: &ShadowMaps, camera: &Camera) -> Vec<f64> {
    let far = f64::from(maps.max_distance.min(camera.far));
    let near = f64::from(camera.near).max(far / 1000.0);
    let end = |cascade: u32| {
        let share = f64::from(cascade) / f64::from(maps.cascades);
        let lambda = f64::from(maps.split_lambda);
        lambda * near * (far / near).powf(share) + (1.0 - lambda) * (near + share * (far - near))
    };
    (1..=maps.cascades).map(end).collect()
}

/// The width of a pixel of a light's maps: in metres for a directional light, for each of its cascades, and at a
/// distance of 1 m for others, as the documentation of [`ShadowMaps`] defines it.
fn map_pixels(light: &Light, maps: &ShadowMaps, camera: &Camera) -> Vec<f64> {
    let side = f64::from(maps.side);
    let pixel = match *light {
        Light::Point { .. } => 2.0 / (side - 2.0 * f64::from(maps.filter) - 2.0),
        Light::Spot { outer_angle, .. } => 2.0 * f64::from(outer_angle.min(1.4835)).tan() / side,
        // Straight edges of 5° are off by half a pixel of 1024.
        Light::Hemispherical { .. } => 4.0 / side + 1.0 / 1024.0,
        Light::Directional { .. } => {
            let pixel = |map: &Camera| match map.projection {
                Projection::Orthographic { height } => f64::from(height) / side,
                _ => f64::NAN,
            };
            let pixels: Vec<_> = maps.cameras("", light, std::slice::from_ref(camera)).iter().map(pixel).collect();
            return if pixels.is_empty() { vec![0.0] } else { pixels };
        }
        _ => 0.0,
    };
    vec![pixel]
}

/// How far from its geometric edge a shadow may fade, in metres on the surface: half of the filter's width and half a
/// pixel of the map, along a diagonal of the map's pixels, and more on a surface that is inclined to the light. A pixel
/// is that of [`map_pixels`].
fn edge_width(light: &Light, pixel: f64, filter: u32, point: DVec3, normal: DVec3) -> f64 {
    let (pixel, towards) = match *light {
        Light::Directional { direction, .. } => (pixel, -direction.as_dvec3()),
        Light::Point { position, .. } | Light::Spot { position, .. } | Light::Hemispherical { position, .. } => {
            (pixel * point.distance(position), (position - point).normalize())
        }
        _ => (pixel, normal),
    };
    let cosine = normal.dot(towards).max(1e-3);
    2_f64.sqrt() * (f64::from(filter) + 1.0) * pixel / cosine
}

fn color(light: &Light) -> DVec3 {
    match *light {
        Light::Directional { illuminance, .. } => illuminance.as_dvec3(),
        Light::Point { intensity, .. } | Light::Spot { intensity, .. } | Light::Hemispherical { intensity, .. } => {
            intensity.as_dvec3()
        }
        _ => DVec3::ZERO,
    }
}

/// The least and the greatest illuminance of a light of intensity 1 at a point that is known to within `error` metres.
fn illuminance(light: &Light, point: DVec3, normal: DVec3, error: f64) -> [f64; 2] {
    // An octahedral normal of half floats is up to 0.12° off if a device truncates them. Those along an axis are exact,
    // except for the rounding of f32.
    let of_normal = if normal.abs().max_element() > 1.0 - 1e-9 { 1e-6 } else { 2.1e-3 };
    let (position, range) = match *light {
        Light::Directional { direction, .. } => {
            let facing = -normal.dot(direction.as_dvec3().normalize());
            return [-of_normal, of_normal].map(|error| (facing + error).max(0.0));
        }
        Light::Point { position, range, .. }
        | Light::Spot { position, range, .. }
        | Light::Hemispherical { position, range, .. } => (position, f64::from(range)),
        _ => return [0.0; 2],
    };
    let away = position - point;
    let distance = away.length();
    if distance <= error {
        return [0.0, f64::INFINITY];
    }
    let of_angle = error / distance;
    let ends = [-1.0, 1.0].map(|sign| {
        let distance = distance - sign * error;
        let facing = (normal.dot(away.normalize()) + sign * (of_normal + of_angle)).max(0.0);
        let window = (1.0 - (distance / range).powi(4)).max(0.0);
        window * window * facing / (distance * distance)
    });
    // Cosines carry a few roundings of f32 each.
    let shape = [-1.0, 1.0].map(|sign| shape(light, -away.normalize(), sign * (of_angle + 4e-7)));
    [ends[0] * shape[0], ends[1] * shape[1]]
}

/// The fraction of a light's intensity in a direction. `more` is added to the cosine of the angle from the light's
/// axis.
fn shape(light: &Light, along: DVec3, more: f64) -> f64 {
    match *light {
        Light::Spot { direction, inner_angle, outer_angle, .. } => {
            let cosine = along.dot(direction.as_dvec3().normalize()) + more;
            let [begin, end] = [inner_angle, outer_angle].map(|angle| f64::from(angle).cos());
            let step = ((cosine - end) / (begin - end)).clamp(0.0, 1.0);
            step * step * (3.0 - 2.0 * step)
        }
        Light::Hemispherical { direction, .. } => (along.dot(direction.as_dvec3().normalize()) + more).max(0.0),
        _ => 1.0,
    }
}

/// Computes the rays of a camera's pixels.
struct RayCamera {
    position: DVec3,
    axes: [DVec3; 3],
    size: [f64; 2],
    /// The picture's centre, in halves of its width and height.
    shift: [f64; 2],
    /// Half of the picture's height: in perspective at 1 m.
    half: f64,
    perspective: bool,
}

impl RayCamera {
    fn new(camera: &Camera) -> Self {
        let orientation = camera.orientation.as_dquat().normalize();
        let (half, perspective) = match camera.projection {
            Projection::Perspective { field_of_view } => ((f64::from(field_of_view) / 2.0).tan(), true),
            Projection::Orthographic { height } => (f64::from(height) / 2.0, false),
            _ => (f64::NAN, false),
        };
        Self {
            position: camera.position,
            axes: [DVec3::X, DVec3::Y, DVec3::NEG_Z].map(|axis| orientation * axis),
            size: camera.size.map(f64::from),
            shift: camera.shift.to_array().map(f64::from),
            half,
            perspective,
        }
    }

    /// A ray's origin, and its direction for 1 m forward; `x` and `y` in pixels from the upper left.
    fn ray(&self, x: f64, y: f64) -> (DVec3, DVec3) {
        let [right, up, forward] = self.axes;
        let [width, height] = self.size;
        let across = right * ((x / width * 2.0 - 1.0 + self.shift[0]) * self.half * width / height)
            + up * ((1.0 - y / height * 2.0 + self.shift[1]) * self.half);
        if self.perspective { (self.position, across + forward) } else { (self.position + across, forward) }
    }
}
