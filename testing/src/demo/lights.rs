//! Lights that make any scene visible.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Light, Scene, SceneRef};

use super::bvh::Bvh;
use super::camera::camera_of;
use super::up_axis::UpAxis;

/// Weak, cool ambient light.
pub const AMBIENT: Vec3 = Vec3::new(0.10, 0.11, 0.13);

/// A dark bluish background.
pub const BACKGROUND: Vec3 = Vec3::new(0.015, 0.02, 0.035);

/// Prepares a scene of objects, such as one from an OBJ file, for drawing: adds [`camera`](super::camera()), adds
/// [`lights`] if the scene has none, and sets [`AMBIENT`] and [`BACKGROUND`].
pub fn add_camera_and_lights(scene: &mut Scene) {
    add_camera_and_lights_upright(scene, UpAxis::Y);
}

/// As [`add_camera_and_lights`], for a scene that is upright along another axis.
pub fn add_camera_and_lights_upright(scene: &mut Scene, up: UpAxis) {
    let bvh = Bvh::new(scene.as_scene_ref(), up);
    let camera = camera_of(bvh.as_ref(), up);
    if scene.lights.is_empty() {
        scene.lights.extend(lights_of(bvh.as_ref(), &camera));
    }
    scene.cameras.push(camera);
    scene.ambient = AMBIENT;
    scene.background = BACKGROUND;
}

/// A warm key light from the camera's upper left, a cool fill light from its right, and a point light above it. The
/// intensity and range of the point light follow from the scene's size, without the outliers that
/// [`camera`](super::camera()) ignores.
pub fn lights(scene: SceneRef<'_>, camera: &Camera) -> [Light; 3] {
    lights_of(Bvh::new(scene, UpAxis::Y).as_ref(), camera)
}

/// The lights of a scene with these triangles.
fn lights_of(bvh: Option<&Bvh>, camera: &Camera) -> [Light; 3] {
    let radius = bvh.map_or(0.0, |bvh| bvh.radius);
    let [right, up, back] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| camera.orientation * axis);
    let lamp = (up * 0.25 - right * 0.2 - back * 0.3).as_dvec3() * radius;
    let intensity = (Vec3::new(1.0, 0.85, 0.65).as_dvec3() * (0.6 * radius * radius)).min(DVec3::splat(1e30)).as_vec3();
    [
        Light::Directional {
            direction: (right * 0.5 - up * 0.75 - back * 0.6).normalize(),
            illuminance: Vec3::new(2.2, 1.9, 1.5),
            casts_shadow: false,
        },
        Light::Directional {
            direction: (-right * 0.8 - up * 0.2 - back * 0.5).normalize(),
            illuminance: Vec3::new(0.3, 0.45, 0.8),
            casts_shadow: false,
        },
        Light::Point {
            position: camera.position + lamp,
            intensity,
            range: Light::range_for(intensity).max(f32::MIN_POSITIVE),
            casts_shadow: false,
        },
    ]
}
