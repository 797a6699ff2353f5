//! What a frame reads.

use glam::{DVec3, Quat, Vec3};

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

    /// Whether the object's transform can be drawn: finite, and its orientation a rotation.
    pub(crate) fn transform_is_valid(&self, object: usize) -> bool {
        transform_is_valid(self.positions[object], self.orientations[object], self.scales[object])
    }
}

/// Whether the square of a length is that of a unit vector or quaternion. What an engine's own arithmetic has turned many
/// times may have drifted by a thousandth, and is brought back to unit length where it is used.
pub(crate) fn is_unit(length_squared: f32) -> bool {
    (length_squared - 1.0).abs() < 2e-3
}

pub(super) fn transform_is_valid(position: DVec3, orientation: Quat, scale: Vec3) -> bool {
    position.is_finite() && scale.is_finite() && is_unit(orientation.length_squared())
}
