//! A scene as borrowed slices.

use glam::{DVec3, Quat, Vec3};

use super::transform::transform_is_valid;
use super::{
    Assets, Bounds, Camera, Changes, Column, ColumnLayout, ColumnValues, LayerMask, Light, Material, Mesh, SceneError,
    StaticGroup, WrittenColumns,
};
use crate::handle::Handle;

/// A scene as a frame reads it: borrowed slices with one entry per object, so that an engine lends its own storage
/// without copying. [`Scene::as_scene_ref`](super::Scene::as_scene_ref) returns one, too.
///
/// Only [`Renderer::record`](crate::Renderer::record) reads it. When that returns, the borrow ends and the engine may
/// change its world (L 3).
#[derive(Clone, Copy, Debug)]
pub struct SceneRef<'a> {
    /// The origin of each object in the world, in metres: up to 2³² m, 4.3 million kilometres, from the world's origin.
    pub positions: &'a [DVec3],
    /// The rotation from object space to the world; of unit length.
    pub orientations: &'a [Quat],
    /// The scale along the object's own axes, applied before the rotation; negative factors mirror. The position of a
    /// vertex is accurate to about a millionth of its distance from the camera. The error grows with the object's size
    /// divided by its distance: an object a million times as large as its distance appears at the wrong position.
    pub scales: &'a [Vec3],
    /// A bounding sphere of each object, in object space before scaling.
    pub bounds: &'a [Bounds],
    /// The mesh of each object.
    pub meshes: &'a [Handle<Mesh>],
    /// The material of each object.
    pub materials: &'a [Handle<Material>],
    /// The layers of each object, by which processes [select](crate::command::Selection::in_layers) what they draw.
    /// Empty if every object belongs to all. A process that does not draw all layers makes its list anew in each frame
    /// in which an object changes.
    pub layers: &'a [LayerMask],
    /// Data of the engine's own for each object, which shaders of its processes read: see
    /// [`ObjectColumn`](super::ObjectColumn). Columns that no process reads cost nothing.
    pub columns: &'a [ColumnValues<'a>],
    /// The columns that CPU nodes write while the frame is recorded, in the place of the slices of the same names.
    pub written: WrittenColumns<'a>,
    /// Which objects changed since the last frame.
    pub changes: Changes<'a>,
    /// Objects that stand still together, and that views execute as a whole.
    pub static_groups: &'a [StaticGroup],
    /// The assets that the handles refer to.
    pub assets: &'a Assets,
    /// The lights.
    pub lights: &'a [Light],
    /// The cameras; each has a view (M 10.4).
    pub cameras: &'a [Camera],
    /// Ambient radiance, linear, uniform in all directions: a surface with a diffuse reflectance of 1 has this
    /// radiance.
    pub ambient: Vec3,
    /// The radiance of the background, linear.
    pub background: Vec3,
}

impl<'a> SceneRef<'a> {
    /// A scene without objects, lights and cameras, dark and with a black background. Of its objects, any may have
    /// changed.
    ///
    /// An engine names what it has, and takes the rest from here:
    ///
    /// ```
    /// use drawloom::scene::{Assets, Camera, SceneRef};
    ///
    /// fn lend<'a>(assets: &'a Assets, cameras: &'a [Camera]) -> SceneRef<'a> {
    ///     SceneRef { cameras, ..SceneRef::new(assets) }
    /// }
    /// ```
    pub fn new(assets: &'a Assets) -> Self {
        Self {
            positions: &[],
            orientations: &[],
            scales: &[],
            bounds: &[],
            meshes: &[],
            materials: &[],
            layers: &[],
            columns: &[],
            written: WrittenColumns::default(),
            changes: Changes::Unknown,
            static_groups: &[],
            assets,
            lights: &[],
            cameras: &[],
            ambient: Vec3::ZERO,
            background: Vec3::ZERO,
        }
    }
}

impl<'a> SceneRef<'a> {
    /// The positions, wherever they are.
    #[inline(always)]
    pub(crate) fn position_column(&self) -> Column<'a, DVec3> {
        Column::new(self.positions, self.written.positions)
    }

    /// The orientations, wherever they are.
    #[inline(always)]
    pub(crate) fn orientation_column(&self) -> Column<'a, Quat> {
        Column::new(self.orientations, self.written.orientations)
    }

    /// The scales, wherever they are.
    #[inline(always)]
    pub(crate) fn scale_column(&self) -> Column<'a, Vec3> {
        Column::new(self.scales, self.written.scales)
    }

    /// The bounds, wherever they are.
    #[inline(always)]
    pub(crate) fn bounds_column(&self) -> Column<'a, Bounds> {
        Column::new(self.bounds, self.written.bounds)
    }
}

impl SceneRef<'_> {
    /// The number of objects.
    pub fn object_count(&self) -> usize {
        self.position_column().len()
    }

    /// The values of a column; `None` if the scene has none of its name and element size.
    pub(crate) fn column(&self, layout: ColumnLayout) -> Option<ColumnValues<'_>> {
        self.columns.iter().find(|values| values.layout() == layout).copied()
    }

    /// # Errors
    /// If a slice or a column has another length than `positions`, or two columns have the same name. The error names
    /// the first one.
    pub(crate) fn check_lengths(&self) -> Result<(), SceneError> {
        let positions = self.object_count();
        let slices = [
            ("orientations", self.orientation_column().len()),
            ("scales", self.scale_column().len()),
            ("bounds", self.bounds_column().len()),
            ("meshes", self.meshes.len()),
            ("materials", self.materials.len()),
        ];
        match slices.into_iter().find(|&(_, count)| count != positions) {
            Some((slice, count)) => Err(SceneError::UnequalSlices { slice, count, positions }),
            None if !self.layers.is_empty() && self.layers.len() != positions => {
                Err(SceneError::UnequalSlices { slice: "layers", count: self.layers.len(), positions })
            }
            None => self.check_columns(),
        }
    }

    fn check_columns(&self) -> Result<(), SceneError> {
        let positions = self.object_count();
        for (index, values) in self.columns.iter().enumerate() {
            let (column, count) = (values.name(), values.count());
            if count != positions {
                return Err(SceneError::UnequalColumn { column, count, positions });
            }
            if self.columns[..index].iter().any(|earlier| earlier.name() == column) {
                return Err(SceneError::RepeatedColumn { column });
            }
        }
        Ok(())
    }

    /// Whether the object's transform can be drawn: it is finite, and its orientation is a rotation.
    pub(crate) fn transform_is_valid(&self, object: usize) -> bool {
        let (position, orientation) = (self.position_column().get(object), self.orientation_column().get(object));
        transform_is_valid(position, orientation, self.scale_column().get(object))
    }

    /// The indices of the objects whose transforms can be drawn; none if the scene's slices differ in length.
    pub fn drawable_objects(self) -> impl Iterator<Item = usize> {
        let count = if self.check_lengths().is_ok() { self.object_count() } else { 0 };
        (0..count).filter(move |&object| self.transform_is_valid(object))
    }

    /// Centre and radius, in metres, of a sphere around all objects that can be drawn. Without any it is a sphere of
    /// radius 1 around the world's origin. It reads all [written columns](Self::written), so nodes can write them no
    /// more.
    pub fn bounding_sphere(self) -> (DVec3, f64) {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for object in self.drawable_objects() {
            let scale = self.scale_column().get(object);
            let bounds = self.bounds_column().get(object);
            let offset = (self.orientation_column().get(object) * (bounds.center * scale)).as_dvec3();
            let center = self.position_column().get(object) + offset;
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
