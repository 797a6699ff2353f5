//! What differs between the two kinds of number that the backend draws in.

use std::ops::Range;

use glam::DVec3;

use super::values;
use crate::process::{LightValues, ObjectValues, Twin, TwinShader, ViewValues};
use crate::quality::TransformPrecision;
use crate::raster::Real;
use crate::scene::{Light, SceneRef};
use crate::view::{FixedPosition, GpuLight, GpuView, ObjectTable, RenderView};

/// A number that the backend draws in: f32, from the very numbers that a device gets, or f64, from what the scene says.
pub(super) trait Number: Real {
    /// What is known of a frame's objects.
    type Objects: Send + Sync;

    /// Whether targets round what they hold to their formats.
    const ROUNDS: bool;

    /// A process's twin in this number.
    fn shader(twin: &Twin) -> &TwinShader<Self>;

    /// Room for a frame's objects.
    fn objects(scene: &SceneRef<'_>) -> Self::Objects;

    /// Takes in blocks of objects.
    fn upload(objects: &Self::Objects, table: &ObjectTable, blocks: Range<usize>);

    /// One object, relative to a camera; `None` if there is none.
    fn object(objects: &Self::Objects, index: usize, camera: &CameraPlace) -> Option<ObjectValues<Self>>;

    /// A view.
    fn view(view: &RenderView, record: &GpuView, scene: &SceneRef<'_>) -> ViewValues<Self>;

    /// A light as a view's camera has it, and the view that draws its shadow map.
    fn light(record: &GpuLight, light: &Light, camera: &CameraPlace, map: Option<&RenderView>) -> LightValues<Self>;
}

/// Where a camera is in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraPlace {
    /// In metres.
    pub(super) exact: DVec3,
    /// As devices have it.
    pub(super) fixed: FixedPosition,
    /// How devices take places from it.
    pub(super) transforms: TransformPrecision,
}

impl Number for f32 {
    type Objects = values::Uploaded;

    const ROUNDS: bool = true;

    fn shader(twin: &Twin) -> &TwinShader<Self> {
        &twin.single
    }

    fn objects(scene: &SceneRef<'_>) -> values::Uploaded {
        values::Uploaded::new(scene)
    }

    fn upload(objects: &values::Uploaded, table: &ObjectTable, blocks: Range<usize>) {
        objects.upload(table, blocks);
    }

    fn object(objects: &values::Uploaded, index: usize, camera: &CameraPlace) -> Option<ObjectValues<Self>> {
        objects.get(index, camera)
    }

    fn view(view: &RenderView, record: &GpuView, _scene: &SceneRef<'_>) -> ViewValues<Self> {
        values::view_of_record(view, record)
    }

    fn light(record: &GpuLight, _light: &Light, _camera: &CameraPlace, _map: Option<&RenderView>) -> LightValues<Self> {
        values::light_of_record(record)
    }
}

impl Number for f64 {
    type Objects = Vec<values::Placed>;

    const ROUNDS: bool = false;

    fn shader(twin: &Twin) -> &TwinShader<Self> {
        &twin.double
    }

    fn objects(scene: &SceneRef<'_>) -> Vec<values::Placed> {
        (0..scene.object_count()).map(|object| values::Placed::new(scene, object)).collect()
    }

    fn upload(_objects: &Vec<values::Placed>, _table: &ObjectTable, _blocks: Range<usize>) {}

    fn object(objects: &Vec<values::Placed>, index: usize, camera: &CameraPlace) -> Option<ObjectValues<Self>> {
        objects.get(index).map(|placed| placed.relative_to(camera))
    }

    fn view(view: &RenderView, _record: &GpuView, scene: &SceneRef<'_>) -> ViewValues<Self> {
        values::exact_view(view, scene)
    }

    fn light(record: &GpuLight, light: &Light, camera: &CameraPlace, map: Option<&RenderView>) -> LightValues<Self> {
        values::exact_light(record, light, camera, map)
    }
}
