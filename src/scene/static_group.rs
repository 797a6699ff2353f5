//! Static groups of a scene, which frames and views execute as a whole.

use super::ObjectSet;

/// A static group of the scene: objects that stand still together, such as a room's furniture, a block of a city, or a
/// forest. It is recorded once, and executed by every view that sees any of it, in this frame and in later ones: L
/// 3.2's command buffers, which other contexts execute.
///
/// A static group that a view executes costs that view one culling test, and no visibility, sort or merge of its
/// objects. What the backend has uploaded of it stays, and so do its bundles while the view executes the same static
/// groups. In exchange a view that sees a corner of a static group draws all of it. So a static group is worth it if
/// its objects are seen together: some hundreds or thousands of them, close to each other.
///
/// Static groups change no picture, except where surfaces of two objects lie at the same depth: objects of static
/// groups are drawn before the others. What cannot be executed is drawn as if it were in no static group:
///
/// - blended objects, which need an order; objects whose mesh has levels of detail that views choose from; objects
///   whose triangles are culled (`Mesh::with_triangle_culling`);
/// - a static group with an object that [changed](super::SceneRef::changes), until the first frame in which none of
///   them does. That frame records the static group anew; the next one executes it. In frames that report
///   [`Changes::Unknown`](super::Changes::Unknown) any object may have changed, so an engine that wants static groups
///   executed reports its changes;
/// - all static groups in a view with a process that draws opaque objects in an order, by
///   [depth](crate::quality::Quality::opaque_order), by [the engine's](crate::command::DrawOrder) or [before blended
///   ones](crate::command::Selection::ALL); in maps of paraboloids; and while a view tests for occlusion
///   (`Quality::occlusion`), which finds hidden objects one by one;
/// - a static group of which a view's [filter](super::Camera::filter) shows only some objects, and one that reaches
///   beyond the [far plane](super::Camera::far) of a perspective view.
///
/// ```
/// use drawloom::glam::{DVec3, Vec3};
/// use drawloom::scene::{Changes, Material, Mesh, StaticGroup, RenderObject, Scene, SceneRef};
///
/// let mut scene = Scene::new();
/// let (chair, wood) = (scene.add(Mesh::cuboid("chair", Vec3::new(0.4, 0.9, 0.4))?)?, scene.add(Material::default())?);
/// let mut chairs = Vec::new();
/// for seat in 0..200 {
///     chairs.push(scene.add_object(RenderObject::new(chair, wood, DVec3::X * f64::from(seat)))?);
/// }
/// scene.static_groups.push(StaticGroup::new("hall", scene.object_set(chairs)?));
/// // Nothing changed since the frame before.
/// let frame = SceneRef { changes: Changes::Objects(&[]), ..scene.as_scene_ref() };
/// assert_eq!(frame.static_groups[0].objects.len(), 200);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StaticGroup {
    /// Its name, which no other static group of the scene has.
    pub name: String,
    /// Its objects, by index, none of which is in another static group. Those at which the scene has no object are
    /// counted as [`IssueReason::UnknownObject`](crate::view::IssueReason::UnknownObject). If an object moves to
    /// another index, the engine makes the set again.
    pub objects: ObjectSet,
}

impl StaticGroup {
    /// A static group of these objects.
    pub fn new(name: impl Into<String>, objects: ObjectSet) -> Self {
        Self { name: name.into(), objects }
    }
}
