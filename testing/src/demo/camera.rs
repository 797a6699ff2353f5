//! A camera that shows any scene.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Projection, SceneRef};

use super::bvh::Bvh;
use super::up_axis::UpAxis;
use super::viewpoint;

/// A camera called `main` that shows the scene, whose size may be 1 µm to 10,000 km, at any distance from the world's
/// origin.
///
/// Rays classify the scene. If its triangles face points inside and not points outside, it is an interior: the camera
/// stands in it at eye height, looking along the longest free line of sight, or looks in through a missing wall.
/// Otherwise it is an object, shown from outside and above, from the side that shows most of its surface and of its
/// detail; of sides that show about as much, from its front (+Z). The scene is upright along +Y. The near plane is at a
/// thousandth of the scene's radius. Outliers, which are farther away than a thousand times the size of the rest, are
/// ignored.
///
/// If nothing in the scene can be drawn, or its slices differ in length, the camera looks at the world's origin.
///
/// ```
/// use drawloom_testing::demo;
///
/// let mut scene = demo::colonnade()?;
/// scene.cameras = vec![demo::camera(scene.as_scene_ref())];
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
pub fn camera(scene: SceneRef<'_>) -> Camera {
    camera_upright(scene, UpAxis::Y)
}

/// As [`camera`], for a scene that is upright along another axis.
pub fn camera_upright(scene: SceneRef<'_>, up: UpAxis) -> Camera {
    camera_of(Bvh::new(scene, up).as_ref(), up)
}

/// The camera of a scene with these triangles.
pub(super) fn camera_of(bvh: Option<&Bvh>, up: UpAxis) -> Camera {
    let Some(bvh) = bvh else {
        return up.looking_at("main", up.to_scene(DVec3::new(2.0, 1.5, 3.0)), DVec3::ZERO);
    };
    let view = viewpoint::choose(bvh);
    let in_world = |point: Vec3| up.to_scene(bvh.center + point.as_dvec3() * bvh.radius);
    Camera {
        projection: Projection::Perspective { field_of_view: view.field_of_view },
        near: ((bvh.radius * 1e-3) as f32).max(f32::MIN_POSITIVE),
        ..up.looking_at("main", in_world(view.eye), in_world(view.target))
    }
}

#[cfg(test)]
mod tests;
