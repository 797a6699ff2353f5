//! What a picture shows, found by drawing every triangle in f64 at every sample: an answer that shares nothing with the crate but
//! the scene.

use drawloom::glam::{DMat3, DVec2, DVec3, Vec3};
use drawloom::scene::{Blend, Camera, Projection, SceneRef, Topology};

/// The samples of a picture, in even rows and columns: which object is nearest at each.
pub struct Samples {
    /// Pixels from one sample to the next.
    spacing: f64,
    columns: usize,
    rows: usize,
    /// Near ÷ depth, or (far − depth) ÷ (far − near) without perspective; 0 where nothing is.
    nearness: Vec<f64>,
    objects: Vec<u32>,
    /// For each object, whether it is seen at any sample.
    pub shown: Vec<bool>,
    /// The same, were nothing else there.
    pub alone: Vec<bool>,
}

impl Samples {
    /// Draws a scene, of which only those objects count that are `drawn`, with samples so many pixels apart: opaque ones hide what
    /// is behind them, blended ones do not. Triangles that face away are left out where the device leaves them out.
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
        let eye = Eye::new(camera);
        for object in (0..count).filter(|&object| drawn(object) && is_opaque(object)) {
            samples.draw(scene, &eye, object, true);
        }
        for &object in samples.objects.iter().filter(|&&object| object != u32::MAX) {
            samples.shown[object as usize] = true;
        }
        for object in (0..count).filter(|&object| drawn(object) && !is_opaque(object)) {
            samples.draw(scene, &eye, object, false);
        }
        samples
    }

    /// How near what is seen at a sample is; 0 where nothing is, and outside of the picture.
    #[allow(dead_code, reason = "not all who include this file look at single samples")]
    pub fn nearness_at(&self, column: usize, row: usize) -> f64 {
        if column < self.columns && row < self.rows { self.nearness[row * self.columns + column] } else { 0.0 }
    }

    fn draw(&mut self, scene: &SceneRef<'_>, eye: &Eye, object: usize, is_opaque: bool) {
        let mesh = scene.assets.get(scene.meshes[object]).unwrap();
        let is_double = scene.assets.get(scene.materials[object]).unwrap().double_sided;
        let (turn, scale) = (scene.orientations[object].as_dquat().normalize(), scene.scales[object].as_dvec3());
        let is_mirrored = scale.x * scale.y * scale.z < 0.0;
        let origin = scene.positions[object] - eye.position;
        let place = |index: u32| {
            let vertex = Vec3::from(mesh.vertices()[index as usize].position).as_dvec3();
            eye.turn * (origin + turn * (scale * vertex))
        };
        let (step, strip) = match mesh.topology() {
            Topology::TriangleList => (3, false),
            Topology::TriangleStrip => (1, true),
        };
        for (number, corners) in mesh.indices().windows(3).step_by(step).enumerate() {
            let [a, b, c] = [corners[0], corners[1], corners[2]].map(place);
            let normal = (b - a).cross(c - a) * if (strip && number % 2 == 1) != is_mirrored { -1.0 } else { 1.0 };
            // The eye's axes are right, down and forward: as right-handed as the world's.
            let towards = if eye.is_perspective { -a } else { DVec3::NEG_Z };
            if !is_double && normal.dot(towards) <= 0.0 {
                continue;
            }
            self.draw_triangle(eye, [a, b, c], normal, object, is_opaque);
        }
    }

    fn draw_triangle(&mut self, eye: &Eye, corners: [DVec3; 3], normal: DVec3, object: usize, is_opaque: bool) {
        let mut polygon = Vec::with_capacity(4);
        for (index, &from) in corners.iter().enumerate() {
            let to = corners[(index + 1) % 3];
            if from.z >= eye.near {
                polygon.push(from);
            }
            if (from.z >= eye.near) != (to.z >= eye.near) {
                polygon.push(from.lerp(to, (eye.near - from.z) / (to.z - from.z)));
            }
        }
        let places: Vec<DVec2> = polygon.iter().map(|&place| eye.picture(place)).collect();
        let around = places.iter().zip(places.iter().cycle().skip(1));
        let [low, high] = [f64::min as fn(f64, f64) -> f64, f64::max]
            .map(|choose| places.iter().map(|place| place.y).reduce(choose).unwrap_or(f64::NAN));
        let offset = normal.dot(corners[0]);
        let sample = |pixel: f64| pixel / self.spacing - 0.5;
        let first = sample(low).ceil().max(0.0);
        let end = (sample(high).floor() + 1.0).min(self.rows as f64);
        if places.len() < 3 || first >= end {
            return;
        }
        for row in first as usize..end as usize {
            let y = (row as f64 + 0.5) * self.spacing;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for (from, to) in around.clone() {
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
                let nearness = eye.nearness(DVec2::new(x, y), normal, offset);
                let place = row * self.columns + column;
                if nearness.is_nan() || nearness <= 0.0 {
                    continue;
                }
                self.alone[object] = true;
                if nearness > self.nearness[place] && is_opaque {
                    self.nearness[place] = nearness;
                    self.objects[place] = object as u32;
                } else if nearness >= self.nearness[place] && !is_opaque {
                    self.shown[object] = true;
                }
            }
        }
    }
}

/// A camera.
pub struct Eye {
    position: DVec3,
    turn: DMat3,
    is_perspective: bool,
    focal: f64,
    center: DVec2,
    near: f64,
    far: f64,
}

impl Eye {
    pub fn new(camera: &Camera) -> Self {
        let [width, height] = camera.size.map(f64::from);
        let orientation = camera.orientation.as_dquat().normalize();
        let axes = [orientation * DVec3::X, orientation * DVec3::NEG_Y, orientation * DVec3::NEG_Z];
        let (is_perspective, focal) = match camera.projection {
            Projection::Perspective { field_of_view } => (true, height * 0.5 / (f64::from(field_of_view) * 0.5).tan()),
            Projection::Orthographic { height: metres } => (false, height / f64::from(metres)),
            _ => unreachable!("no shadow map is asked about"),
        };
        Self {
            position: camera.position,
            turn: DMat3::from_cols(axes[0], axes[1], axes[2]).transpose(),
            is_perspective,
            focal,
            center: DVec2::new(width, height) * 0.5,
            near: f64::from(camera.near),
            far: f64::from(camera.far),
        }
    }

    /// A place of the world, to the right, down and forward.
    #[allow(dead_code, reason = "not all who include this file look at single places")]
    pub fn relative(&self, place: DVec3) -> DVec3 {
        self.turn * (place - self.position)
    }

    /// Where in the picture it is.
    pub fn picture(&self, place: DVec3) -> DVec2 {
        self.center + place.truncate() * if self.is_perspective { self.focal / place.z } else { self.focal }
    }

    /// The near plane's distance.
    #[allow(dead_code, reason = "not all who include this file look at single places")]
    pub fn near(&self) -> f64 {
        self.near
    }

    /// How near a plane is at a place of the picture.
    fn nearness(&self, pixel: DVec2, normal: DVec3, offset: f64) -> f64 {
        let aside = (pixel - self.center) / self.focal;
        if self.is_perspective {
            self.near * normal.dot(aside.extend(1.0)) / offset
        } else {
            let depth = (offset - normal.dot(aside.extend(0.0))) / normal.z;
            (self.far - depth) / (self.far - self.near)
        }
    }
}
