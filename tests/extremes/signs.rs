//! Scenes of squares that glow in one colour each, so that what every pixel is to show is known.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology};
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::oracle::{Oracle, Seen};
use crate::stage::{Drawn, Studio};

/// A square of 2 m before scaling that faces its own +Z.
#[derive(Clone, Copy, Debug)]
pub struct Sign {
    pub position: DVec3,
    pub orientation: Quat,
    pub scale: Vec3,
    /// Radiance that half floats can say exactly.
    pub color: Vec3,
    pub double_sided: bool,
}

impl Sign {
    /// A single-sided one that faces the camera: so far before it, `side` by side metres large around the middle of what it sees.
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
}

pub const GREEN: Vec3 = Vec3::new(0.0, 0.75, 0.125);
pub const RED: Vec3 = Vec3::new(0.875, 0.0625, 0.0);
pub const BLUE: Vec3 = Vec3::new(0.03125, 0.25, 1.0);
const BACKGROUND: Vec3 = Vec3::new(0.25, 0.125, 0.0625);

/// A scene of signs, and its only camera.
pub struct Signs {
    pub scene: Scene,
    pub signs: Vec<Sign>,
    mesh: Handle<Mesh>,
}

/// A camera at the origin, turned in no special way.
pub fn camera(size: [u32; 2]) -> Camera {
    sized(Camera::looking_at("main", DVec3::ZERO, DVec3::new(0.3, -0.4, -0.8)), size)
}

impl Signs {
    pub fn new(camera: Camera, signs: impl IntoIterator<Item = Sign>) -> Result<Self, Failed> {
        Self::of(square(Topology::TriangleList), camera, signs)
    }

    /// Of another mesh, a list of triangles.
    pub fn of(mesh: Mesh, camera: Camera, signs: impl IntoIterator<Item = Sign>) -> Result<Self, Failed> {
        let mut scene = Scene::new();
        scene.cameras = vec![camera];
        scene.background = BACKGROUND;
        let mesh = scene.add(mesh)?;
        let mut all = Self { scene, signs: Vec::new(), mesh };
        for sign in signs {
            all.add(sign)?;
        }
        Ok(all)
    }

    pub fn add(&mut self, sign: Sign) -> Result<(), Failed> {
        let Sign { position, orientation, scale, color, double_sided } = sign;
        let glow = Material { emission: color, diffuse: Vec3::ZERO, double_sided, ..Material::default() };
        let material = self.scene.add(glow)?;
        let object = RenderObject { orientation, scale, ..RenderObject::new(self.mesh, material, position) };
        self.scene.add_object(object)?;
        self.signs.push(sign);
        Ok(())
    }

    /// Draws them and fails unless each pixel that is not at an edge shows what a ray finds there; and unless there are such
    /// pixels of so many signs at least.
    pub fn expect(&self, studio: &mut Studio, what: &str, seen_at_least: usize) -> Result<(), Failed> {
        let drawn = studio.draw_whole(&self.scene).map_err(|failed| told(what, failed))?;
        self.compare(&drawn, seen_at_least).map_err(|failed| told(what, failed))
    }

    /// The same of what was drawn already.
    pub fn compare(&self, drawn: &Drawn, seen_at_least: usize) -> Result<(), Failed> {
        let camera = &self.scene.cameras[0];
        let mesh = self.scene.assets().get(self.mesh)?;
        let oracle = Oracle::new(camera, mesh, &self.signs);
        let [width, height] = camera.size.map(|side| side as usize);
        let mut seen = vec![0; self.signs.len()];
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let expected = match oracle.seen(x, y) {
                Seen::Unsure => continue,
                Seen::Background => self.scene.background,
                Seen::Sign(sign) => {
                    seen[sign] += 1;
                    self.signs[sign].color
                }
            };
            let Some(look) = &drawn.look else { continue };
            let found = look.radiance(x, y);
            let far = |(found, expected): (f64, f32)| (found - f64::from(expected)).abs() > 1e-3;
            if found.into_iter().zip(expected.to_array()).any(far) {
                return Err(format!("({x}, {y}) is {found:?}, not {expected}").into());
            }
        }
        let seen = seen.into_iter().filter(|pixels| *pixels > 0).count();
        if seen < seen_at_least {
            return Err(format!("the case is none: a ray sees {seen} signs of {seen_at_least}").into());
        }
        if drawn.visible < seen {
            return Err(format!("{seen} signs are seen, and {} were drawn", drawn.visible).into());
        }
        Ok(())
    }
}

/// A failure, and of what.
pub fn told(what: &str, failed: Failed) -> Failed {
    format!("{what}: {}", failed.message().unwrap_or("failed")).into()
}
