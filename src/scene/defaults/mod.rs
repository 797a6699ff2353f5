//! A camera and lights for a scene that brings none.

mod surfaces;
mod view;

use glam::{DVec3, Vec3};

use self::surfaces::Surfaces;
use super::{Camera, Light, Projection, SceneRef};

/// Light from everywhere, weak and cool, for scenes that bring none.
pub const AMBIENT: Vec3 = Vec3::new(0.10, 0.11, 0.13);

/// A dark bluish background, for scenes that bring none.
pub const BACKGROUND: Vec3 = Vec3::new(0.015, 0.02, 0.035);

/// A camera called `main` that shows the scene, from 1 µm to 10,000 km in size and wherever it is.
///
/// Rays say what the scene is. If its surfaces face points inside and not those outside, it is a room: the camera stands in
/// it at eye height, looking along the longest free line of sight, or looks in from where a wall is missing. Otherwise it
/// is an object, shown from outside and a little above. The scene is upright along +Y. The near plane is at a thousandth of
/// the scene's radius.
///
/// An empty scene, or one of which nothing can be drawn, gets a camera that looks at the world's origin. So does one whose
/// slices differ in length.
///
/// ```
/// use drawloom::scene::{defaults, sample};
///
/// let mut scene = sample::colonnade()?;
/// scene.cameras = vec![defaults::camera(scene.as_scene_ref())];
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
pub fn camera(scene: SceneRef<'_>) -> Camera {
    let Some(surfaces) = Surfaces::new(scene) else {
        return Camera::looking_at("main", DVec3::new(2.0, 1.5, 3.0), DVec3::ZERO);
    };
    let view = view::best(&surfaces);
    let place = |point: Vec3| surfaces.center + point.as_dvec3() * surfaces.radius;
    Camera {
        projection: Projection::Perspective { field_of_view: view.field_of_view },
        near: ((surfaces.radius * 1e-3) as f32).max(f32::MIN_POSITIVE),
        ..Camera::looking_at("main", place(view.eye), place(view.target))
    }
}

/// A warm key from the camera's upper left, a cool fill from its right, and a lamp above it, in strength and range as the
/// scene's size asks for.
pub fn lights(scene: SceneRef<'_>, camera: &Camera) -> [Light; 3] {
    let (_, radius) = extent(scene);
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
        },
    ]
}

/// The centre and radius of a sphere around every object that can be drawn; a radius of 1 if there is none.
pub(super) fn extent(scene: SceneRef<'_>) -> (DVec3, f64) {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for object in drawable_objects(scene) {
        let scale = scene.scales[object];
        let bounds = scene.bounds[object];
        let center = scene.positions[object] + (scene.orientations[object] * (bounds.center * scale)).as_dvec3();
        let reach = DVec3::splat(f64::from(bounds.radius * scale.abs().max_element()));
        if center.is_finite() && reach.is_finite() {
            low = low.min(center - reach);
            high = high.max(center + reach);
        }
    }
    let radius = (high - low).length() / 2.0;
    if radius > 0.0 && radius.is_finite() { ((low + high) / 2.0, radius) } else { (DVec3::ZERO, 1.0) }
}

/// The objects whose transforms can be drawn; none if the scene's slices differ in length.
fn drawable_objects(scene: SceneRef<'_>) -> impl Iterator<Item = usize> {
    let count = if scene.check_lengths().is_ok() { scene.object_count() } else { 0 };
    (0..count).filter(move |&object| scene.transform_is_valid(object))
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests;
