//! Views, lights and targets for the tests of several CPU shaders.

use glam::{DVec3, Quat, Vec2, Vec3};
use proptest::prelude::*;

use super::{Materials, PassInputs, SampledTexture, ShaderLight, ShaderMaterial, ShaderView};
use crate::raster::{Quaternion, Real, Vector, Vector2, Vector3, Vector4};
use crate::scene::{Blend, Camera, ClipPlane, Light, MaterialValues, Projection, ViewKind};
use crate::view::{GpuLight, LightClass, RenderView};

/// The unit roundoff of f32: 2⁻²⁴.
pub(in crate::process) const UNIT: f64 = 1.0 / 16_777_216.0;

/// Any direction, including the octahedron's corners and edges.
pub(in crate::process) fn direction() -> impl Strategy<Value = DVec3> {
    let number = || prop_oneof![4 => -1.0..1.0_f64, 1 => Just(0.0), 1 => -1e-6..1e-6_f64];
    let vector = [number(), number(), number()].prop_map(DVec3::from);
    vector.prop_filter("a direction", |vector| vector.length() > 1e-6).prop_map(DVec3::normalize)
}

/// A perspective view that looks along -Z, an orthographic one, an off-centre one, and one with a clip plane.
pub(in crate::process) fn views() -> [RenderView; 4] {
    let camera = Camera { size: [16, 9], ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
    let plan = Camera {
        projection: Projection::Orthographic { height: 8.0 },
        near: 2.0,
        far: 50.0,
        ..Camera::looking_at("plan", DVec3::ZERO, DVec3::new(-1.0, 2.0, 0.5))
    };
    let off_center = Camera { shift: Vec2::new(-1.5, 0.5), ..camera.clone() };
    let clip_plane = ClipPlane { point: DVec3::NEG_Z * 3.0, normal: Vec3::new(0.48, 0.36, -0.8) };
    let clipped = Camera { clip_plane: Some(clip_plane), ..off_center.clone() };
    [&camera, &plan, &off_center, &clipped].map(RenderView::new)
}

pub(in crate::process) fn paraboloid() -> Camera {
    Camera {
        projection: Projection::Paraboloid,
        near: 0.1,
        far: 10.0,
        size: [64; 2],
        kind: ViewKind::Shadow,
        ..Camera::looking_at("map", DVec3::ZERO, DVec3::new(1.0, -2.0, 0.5))
    }
}

pub(in crate::process) fn view_values<R: Real>(view: &RenderView) -> ShaderView<R> {
    let [right, up, forward] = view.picture_axes().map(Vector3::of_single);
    let number = |value: f32| R::of(f64::from(value));
    ShaderView {
        name: view.name().into(),
        position: view.camera.position,
        clip_from_relative: view.clip_from_relative().to_cols_array_2d().map(|column| Vector(column.map(number))),
        right,
        up,
        forward,
        near: number(view.camera.near),
        far: number(view.camera.far),
        size: view.camera.size.map(|pixels| pixels as usize),
        projection: view.camera.projection,
        clamps_near: view.clamps_depth(),
        ambient: Vector3::of_single(Vec3::new(0.1, 0.2, 0.3)),
    }
}

/// A light relative to a camera at the world's origin.
pub(in crate::process) fn light_values<R: Real>(light: &Light, map: Option<&RenderView>) -> ShaderLight<R> {
    let record = GpuLight::new(light, DVec3::ZERO, map);
    let number = |value: f32| R::of(f64::from(value));
    let orientation: Quat = record.shadow_orientation;
    ShaderLight {
        position: Vector3::of_single(record.position),
        kind: light.kind(),
        direction: Vector3::of_single(record.direction),
        range: number(record.range),
        intensity: Vector3::of_single(record.intensity),
        cone_begin: number(record.cone_begin),
        cone_end: number(record.cone_end),
        shadow_layer: map.map(|map| map.layer as usize),
        shadow_half: number(record.shadow_half),
        shadow_near: number(record.shadow_near),
        shadow_orientation: Quaternion(orientation.to_array().map(number)),
    }
}

/// A target whose pixels are computed by a function.
pub(in crate::process) struct FunctionTexture<F> {
    pub(in crate::process) size: [usize; 2],
    pub(in crate::process) color: F,
}

impl<R: Real, F: Fn([usize; 2], usize) -> Vector4<R> + Sync> SampledTexture<R> for FunctionTexture<F> {
    fn size(&self) -> [usize; 2] {
        self.size
    }

    fn load(&self, coordinates: [usize; 2], layer: usize) -> Vector4<R> {
        assert!(coordinates[0] < self.size[0] && coordinates[1] < self.size[1], "{coordinates:?} is outside");
        (self.color)(coordinates, layer)
    }
}

/// A target of one colour.
pub(in crate::process) fn plain<R: Real>(
    color: [f64; 4],
) -> FunctionTexture<impl Fn([usize; 2], usize) -> Vector4<R> + Sync> {
    FunctionTexture { size: [64; 2], color: move |_, _| Vector(color.map(R::of)) }
}

/// One material, whose texture returns `uv` and its derivatives.
pub(in crate::process) struct OneMaterial<R>(pub(in crate::process) ShaderMaterial<R>);

impl<R: Real> Materials<R> for OneMaterial<R> {
    fn get(&self, _slot: u32) -> ShaderMaterial<R> {
        self.0
    }

    fn values(&self, _: u32) -> Option<&MaterialValues> {
        None
    }

    fn texture_at(&self, _: u32, _: usize, uv: Vector2<R>, [dpdx, dpdy]: [Vector2<R>; 2]) -> Vector4<R> {
        Vector([uv[0], uv[1], dpdx[0] + dpdy[1], R::one()])
    }
}

pub(in crate::process) fn material<R: Real>(blend: Blend) -> OneMaterial<R> {
    OneMaterial(ShaderMaterial {
        diffuse: Vector([0.5, 0.25, 1.0].map(R::of)),
        opacity: R::of(0.5),
        alpha_cutoff: R::zero(),
        emission: Vector([0.0, 0.5, 0.125].map(R::of)),
        double_sided: false,
        blend,
    })
}

/// The inputs of a pass without lights.
pub(in crate::process) fn pass<'a, R: Real>(
    view: &'a ShaderView<R>,
    materials: &'a dyn Materials<R>,
    sampled: &'a [&'a dyn SampledTexture<R>],
) -> PassInputs<'a, R> {
    PassInputs {
        view,
        lights: &[],
        light_ends: &[0; LightClass::COUNT],
        lights_by_layer: &[],
        materials,
        sampled,
        columns: &[],
    }
}
