//! Scenes of markers: emissive squares of one colour each, so that the expected radiance of every pixel is known.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology};
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::harness::{Drawn, Harness};
use crate::oracle::{Oracle, Prediction, View};

/// A square of 2 m before scaling that faces its own +Z.
#[derive(Clone, Copy, Debug)]
pub struct Marker {
    pub position: DVec3,
    pub orientation: Quat,
    pub scale: Vec3,
    /// Radiance that half floats represent exactly.
    pub color: Vec3,
    pub double_sided: bool,
}

impl Marker {
    /// A single-sided marker that faces the camera, in the middle of the picture, with sides of `side` metres.
    pub fn before(camera: &Camera, distance: f64, side: f64) -> Self {
        let turn = camera.orientation.as_dquat().normalize();
        Self {
            position: camera.position + turn * DVec3::new(0.0, 0.0, -distance),
            orientation: camera.orientation,
            scale: Vec3::splat((side * 0.5) as f32),
            color: GREEN,
            double_sided: false,
        }
    }

    /// Moved along the camera's own axes.
    pub fn moved(mut self, camera: &Camera, right: f64, up: f64) -> Self {
        self.position += camera.orientation.as_dquat().normalize() * DVec3::new(right, up, 0.0);
        self
    }

    pub fn colored(self, color: Vec3) -> Self {
        Self { color, ..self }
    }

    /// A corner of its mesh, relative to a point in the world: subtracted first, as both may be far from the origin.
    pub fn corner(&self, reference: DVec3, mesh: &Mesh, corner: u32) -> DVec3 {
        let vertex = Vec3::from(mesh.vertices()[corner as usize].position);
        let turn = self.orientation.as_dquat().normalize();
        (self.position - reference) + turn * (self.scale.as_dvec3() * vertex.as_dvec3())
    }
}

pub const GREEN: Vec3 = Vec3::new(0.0, 0.75, 0.125);
pub const RED: Vec3 = Vec3::new(0.875, 0.0625, 0.0);
pub const BLUE: Vec3 = Vec3::new(0.03125, 0.25, 1.0);
const BACKGROUND: Vec3 = Vec3::new(0.25, 0.125, 0.0625);

/// A scene of markers, and its only camera.
pub struct MarkerScene {
    pub scene: Scene,
    pub markers: Vec<Marker>,
    /// What its camera is to show, if it has a lens shift or a clip plane, or was derived from another one.
    pub view: Option<View>,
    /// Pixels that are nearer to an edge are not compared, in pixels.
    pub margin: f64,
    mesh: Handle<Mesh>,
}

/// A camera at the origin, not aligned with any axis.
pub fn camera(size: [u32; 2]) -> Camera {
    sized(Camera::looking_at("main", DVec3::ZERO, DVec3::new(0.3, -0.4, -0.8)), size)
}

impl MarkerScene {
    pub fn new(camera: Camera, markers: impl IntoIterator<Item = Marker>) -> Result<Self, Failed> {
        Self::of(square(Topology::TriangleList), camera, markers)
    }

    /// Markers with another mesh, which must be a triangle list.
    pub fn of(mesh: Mesh, camera: Camera, markers: impl IntoIterator<Item = Marker>) -> Result<Self, Failed> {
        let mut scene = Scene::new();
        scene.cameras = vec![camera];
        scene.background = BACKGROUND;
        let mesh = scene.add(mesh)?;
        let mut all = Self { scene, markers: Vec::new(), view: None, margin: 1.0, mesh };
        for marker in markers {
            all.add(marker)?;
        }
        Ok(all)
    }

    pub fn add(&mut self, marker: Marker) -> Result<(), Failed> {
        let Marker { position, orientation, scale, color, double_sided } = marker;
        let glow = Material { emission: color, diffuse: Vec3::ZERO, double_sided, ..Material::default() };
        let material = self.scene.add(glow)?;
        let object = RenderObject { orientation, scale, ..RenderObject::new(self.mesh, material, position) };
        self.scene.add_object(object)?;
        self.markers.push(marker);
        Ok(())
    }

    /// The mesh of all markers.
    pub fn mesh(&self) -> Result<&Mesh, Failed> {
        Ok(self.scene.assets().get(self.mesh)?)
    }

    /// Draws the scene, of which nothing may be left out.
    pub fn draw(&self, harness: &mut Harness) -> Result<Drawn, Failed> {
        harness.draw_whole(&self.scene)
    }

    /// Draws the scene. Fails unless each pixel that is not at an edge has the colour that the oracle expects, and
    /// unless at least `min_visible` markers have such pixels.
    pub fn expect(&self, harness: &mut Harness, context: &str, min_visible: usize) -> Result<(), Failed> {
        let drawn = harness.draw_whole(&self.scene).map_err(|failed| with_context(context, failed))?;
        self.compare(&drawn, min_visible).map_err(|failed| with_context(context, failed))
    }

    /// Checks the same of a frame that has been drawn already.
    pub fn compare(&self, drawn: &Drawn, min_visible: usize) -> Result<(), Failed> {
        let camera = &self.scene.cameras[0];
        let view = self.view.unwrap_or_else(|| View::of(camera));
        let oracle = Oracle::new(view, self.mesh()?, &self.markers, self.margin);
        let [width, height] = camera.size.map(|side| side as usize);
        let mut visible_pixels = vec![0; self.markers.len()];
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let expected = match oracle.predict(x, y) {
                Prediction::Unsure => continue,
                Prediction::Background => self.scene.background,
                Prediction::Marker(marker) => {
                    visible_pixels[marker] += 1;
                    self.markers[marker].color
                }
            };
            let Some(capture) = &drawn.capture else { continue };
            let found = capture.radiance(x, y);
            let far = |(found, expected): (f64, f32)| (found - f64::from(expected)).abs() > 1e-3;
            if found.into_iter().zip(expected.to_array()).any(far) {
                return Err(format!("({x}, {y}) is {found:?}, not {expected}").into());
            }
        }
        let visible = visible_pixels.into_iter().filter(|pixels| *pixels > 0).count();
        if visible < min_visible {
            return Err(format!("the case is invalid: the oracle sees {visible} of {min_visible} markers").into());
        }
        if drawn.visible < visible {
            return Err(format!("{visible} markers are visible, and {} were drawn", drawn.visible).into());
        }
        Ok(())
    }
}

/// Prefixes the message of a failure.
pub fn with_context(context: &str, failed: Failed) -> Failed {
    format!("{context}: {}", failed.message().unwrap_or("failed")).into()
}
