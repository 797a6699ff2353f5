//! What a frame reads.

use glam::{DVec3, Quat, Vec3};

use super::transform::transform_is_valid;
use super::{Assets, Bounds, Camera, Light, Material, Mesh, SceneError};
use crate::handle::Handle;

/// A scene as a frame reads it: borrowed slices, one entry an object, so that an engine hands over its own storage
/// without copying. [`Scene`](super::Scene) is one source of it.
///
/// It is read only while a frame is recorded; the borrow ends, and the engine has its world back, when
/// [`Renderer::record`](crate::Renderer::record) returns (L 3).
#[derive(Clone, Copy, Debug)]
pub struct SceneRef<'a> {
    /// Where each object's origin is in the world, in metres. Anywhere up to 2³² m, 4.3 million kilometres, from the
    /// world's origin.
    pub positions: &'a [DVec3],
    /// From object space to the world's axes; of unit length.
    pub orientations: &'a [Quat],
    /// Along the object's own axes, applied first; negative mirrors. A vertex is drawn within some millionth of its distance of
    /// where it belongs, so what is as many times as large as it is far does not lie where it should.
    pub scales: &'a [Vec3],
    /// In object space, before scaling. A sphere that holds all that is drawn of the object.
    pub bounds: &'a [Bounds],
    /// What each object's triangles are.
    pub meshes: &'a [Handle<Mesh>],
    /// What each object is made of.
    pub materials: &'a [Handle<Material>],
    /// What the handles refer to.
    pub assets: &'a Assets,
    /// The lights.
    pub lights: &'a [Light],
    /// A view for each (M 10.4).
    pub cameras: &'a [Camera],
    /// Radiance that reaches every surface from everywhere, linear: a surface of diffuse 1 then looks just as bright.
    pub ambient: Vec3,
    /// Radiance where nothing is, linear.
    pub background: Vec3,
}

impl SceneRef<'_> {
    /// The number of objects.
    pub fn object_count(&self) -> usize {
        self.positions.len()
    }

    /// # Errors
    /// If slices differ in length, naming the first that does.
    pub(crate) fn check_lengths(&self) -> Result<(), SceneError> {
        let positions = self.positions.len();
        let slices = [
            ("orientations", self.orientations.len()),
            ("scales", self.scales.len()),
            ("bounds", self.bounds.len()),
            ("meshes", self.meshes.len()),
            ("materials", self.materials.len()),
        ];
        match slices.into_iter().find(|&(_, count)| count != positions) {
            Some((slice, count)) => Err(SceneError::UnequalSlices { slice, count, positions }),
            None => Ok(()),
        }
    }

    /// Whether the object's transform can be drawn: it is finite, and its orientation is a rotation.
    pub(crate) fn transform_is_valid(&self, object: usize) -> bool {
        transform_is_valid(self.positions[object], self.orientations[object], self.scales[object])
    }

    /// The objects whose transforms can be drawn; none if the scene's slices differ in length.
    pub(crate) fn drawable_objects(self) -> impl Iterator<Item = usize> {
        let count = if self.check_lengths().is_ok() { self.object_count() } else { 0 };
        (0..count).filter(move |&object| self.transform_is_valid(object))
    }

    /// Centre and radius, in metres, of a sphere around all objects that can be drawn. Without any it is a sphere of
    /// radius 1 around the world's origin.
    pub fn bounding_sphere(self) -> (DVec3, f64) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for object in self.drawable_objects() {
            let scale = self.scales[object];
            let bounds = self.bounds[object];
            let center = self.positions[object] + (self.orientations[object] * (bounds.center * scale)).as_dvec3();
            let reach = DVec3::splat(f64::from(bounds.radius * scale.abs().max_element()));
            if center.is_finite() && reach.is_finite() {
                low = low.min(center - reach);
                high = high.max(center + reach);
            }
        }
        let radius = (high - low).length() / 2.0;
        if radius > 0.0 && radius.is_finite() { ((low + high) / 2.0, radius) } else { (DVec3::ZERO, 1.0) }
    }
}
