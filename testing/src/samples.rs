//! A reference rasteriser, which draws every triangle in f64 at every sample. It shares only the scene types
//! with the crate.

use drawloom::glam::{DMat3, DVec2, DVec3, Vec3};
use drawloom::scene::{Blend, Camera, Projection, SceneRef, Topology};

/// The samples of a picture in regular rows and columns, each with its nearest object.
pub struct Samples {
    /// The distance between samples in pixels.
    spacing: f64,
    columns: usize,
    rows: usize,
    /// Near ÷ depth, or (far − depth) ÷ (far − near) without perspective; 0 if there is no object.
    nearness: Vec<f64>,
    objects: Vec<u32>,
    /// For each object, whether it is visible at any sample.
    pub shown: Vec<bool>,
    /// For each object, whether it would be visible at any sample without all other objects.
    pub alone: Vec<bool>,
}

impl Samples {
    /// Draws the objects of a scene for which `drawn` returns `true`, with samples `spacing` pixels apart. Opaque
    /// objects hide what is behind them, blended ones do not. Back faces are culled as on a device.
    pub fn new(scene: &SceneRef<'_>, camera: &Camera, spacing: f64, drawn: impl Fn(usize) -> bool) -> Self {
        let [columns, rows] = camera.size.map(|pixels| (f64::from(pixels) / spacing).round().max(1.0) as usize);
        let count = scene.object_count();
        let mut samples = Self {
            spacing,
            columns,
            rows,
            nearness: vec![0.0; columns * rows],
            objects: vec![u32::MAX; columns * rows],
            shown: vec![false; count],
            alone: vec![false; count],
        };
        let is_opaque = |object: usize| scene.assets.get(scene.materials[object]).unwrap().blend == Blend::None;
        let camera = ReferenceCamera::new(camera);
        for object in (0..count).filter(|&object| drawn(object) && is_opaque(object)) {
            samples.draw(scene, &camera, object, true);
        }
        for &object in samples.objects.iter().filter(|&&object| object != u32::MAX) {
            samples.shown[object as usize] = true;
        }
        for object in (0..count).filter(|&object| drawn(object) && !is_opaque(object)) {
            samples.draw(scene, &camera, object, false);
        }
        samples
    }

    /// The nearness of the nearest object at a sample; 0 if there is none, and outside the picture.
    pub fn nearness_at(&self, column: usize, row: usize) -> f64 {
        if column < self.columns && row < self.rows { self.nearness[row * self.columns + column] } else { 0.0 }
    }

    fn draw(&mut self, scene: &SceneRef<'_>, camera: &ReferenceCamera, object: usize, is_opaque: bool) {
        let mesh = scene.assets.get(scene.meshes[object]).unwrap();
        let is_double = scene.assets.get(scene.materials[object]).unwrap().double_sided;
        let (rotation, scale) = (scene.orientations[object].as_dquat().normalize(), scene.scales[object].as_dvec3());
        let is_mirrored = scale.x * scale.y * scale.z < 0.0;
        let origin = scene.positions[object] - camera.position;
        let position = |index: u32| {
            let vertex = Vec3::from(mesh.vertices()[index as usize].position).as_dvec3();
            camera.rotation * (origin + rotation * (scale * vertex))
        };
        let (step, strip) = match mesh.topology() {
            Topology::TriangleList => (3, false),
            Topology::TriangleStrip => (1, true),
        };
        for (number, corners) in mesh.indices().windows(3).step_by(step).enumerate() {
            let [a, b, c] = [corners[0], corners[1], corners[2]].map(position);
            let normal = (b - a).cross(c - a) * if (strip && number % 2 == 1) != is_mirrored { -1.0 } else { 1.0 };
            // Camera axes are right, down and forward: right-handed, as the world's are.
            let towards = if camera.is_perspective { -a } else { DVec3::NEG_Z };
            if !is_double && normal.dot(towards) <= 0.0 {
                continue;
            }
            self.draw_triangle(camera, [a, b, c], normal, object, is_opaque);
        }
    }

    fn draw_triangle(
        &mut self,
        camera: &ReferenceCamera,
        corners: [DVec3; 3],
        normal: DVec3,
        object: usize,
        is_opaque: bool,
    ) {
        let mut polygon = Vec::with_capacity(4);
        for (index, &from) in corners.iter().enumerate() {
            let to = corners[(index + 1) % 3];
            if from.z >= camera.near {
                polygon.push(from);
            }
            if (from.z >= camera.near) != (to.z >= camera.near) {
                polygon.push(from.lerp(to, (camera.near - from.z) / (to.z - from.z)));
            }
        }
        let points: Vec<DVec2> = polygon.iter().map(|&point| camera.project(point)).collect();
        let edges = points.iter().zip(points.iter().cycle().skip(1));
        let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max]
            .map(|choose| points.iter().map(|point| point.y).reduce(choose).unwrap_or(f64::NAN));
        let offset = normal.dot(corners[0]);
        let sample = |pixel: f64| pixel / self.spacing - 0.5;
        let first = sample(low).ceil().max(0.0);
        let end = (sample(high).floor() + 1.0).min(self.rows as f64);
        if points.len() < 3 || first >= end {
            return;
        }
        for row in first as usize..end as usize {
            let y = (row as f64 + 0.5) * self.spacing;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for (from, to) in edges.clone() {
                if (from.y <= y) != (to.y <= y) {
                    let x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y));
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            let first = sample(left).ceil().max(0.0);
            let end = (sample(right).floor() + 1.0).min(self.columns as f64);
            if first >= end {
                continue;
            }
            for column in first as usize..end as usize {
                let x = (column as f64 + 0.5) * self.spacing;
                let nearness = camera.nearness(DVec2::new(x, y), normal, offset);
                let index = row * self.columns + column;
                if nearness.is_nan() || nearness <= 0.0 {
                    continue;
                }
                self.alone[object] = true;
                if nearness > self.nearness[index] && is_opaque {
                    self.nearness[index] = nearness;
                    self.objects[index] = object as u32;
                } else if nearness >= self.nearness[index] && !is_opaque {
                    self.shown[object] = true;
                }
            }
        }
    }
}

/// A camera that projects in f64.
pub struct ReferenceCamera {
    position: DVec3,
    rotation: DMat3,
    is_perspective: bool,
    focal: f64,
    center: DVec2,
    near: f64,
    far: f64,
}

impl ReferenceCamera {
    pub fn new(camera: &Camera) -> Self {
        let [width, height] = camera.size.map(f64::from);
        let orientation = camera.orientation.as_dquat().normalize();
        let axes = [orientation * DVec3::X, orientation * DVec3::NEG_Y, orientation * DVec3::NEG_Z];
        let (is_perspective, focal) = match camera.projection {
            Projection::Perspective { field_of_view } => (true, height * 0.5 / (f64::from(field_of_view) * 0.5).tan()),
            Projection::Orthographic { height: metres } => (false, height / f64::from(metres)),
            _ => unreachable!("shadow maps are not tested"),
        };
        Self {
            position: camera.position,
            rotation: DMat3::from_cols(axes[0], axes[1], axes[2]).transpose(),
            is_perspective,
            focal,
            center: DVec2::new(width, height) * 0.5,
            near: f64::from(camera.near),
            far: f64::from(camera.far),
        }
    }

    /// Transforms a point from world to camera space: right, down and forward.
    pub fn camera_from_world(&self, point: DVec3) -> DVec3 {
        self.rotation * (point - self.position)
    }

    /// Projects a point in camera space into the picture.
    pub fn project(&self, point: DVec3) -> DVec2 {
        self.center + point.truncate() * if self.is_perspective { self.focal / point.z } else { self.focal }
    }

    /// The near plane's distance.
    pub fn near(&self) -> f64 {
        self.near
    }

    /// The nearness of a plane at a point of the picture.
    fn nearness(&self, pixel: DVec2, normal: DVec3, offset: f64) -> f64 {
        let slope = (pixel - self.center) / self.focal;
        if self.is_perspective {
            self.near * normal.dot(slope.extend(1.0)) / offset
        } else {
            let depth = (offset - normal.dot(slope.extend(0.0))) / normal.z;
            (self.far - depth) / (self.far - self.near)
        }
    }
}
