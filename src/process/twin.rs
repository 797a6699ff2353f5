//! A process's twin on the CPU: what the software backend runs in the place of its WGSL.

use std::sync::Arc;

use crate::raster::{Quaternion, Real, Vector2, Vector3, Vector4};
use crate::scene::{Blend, LightKind, Projection};

/// What the software backend runs in the place of a process's WGSL, in f32 and in f64: see
/// [`RenderProcess::twin`](super::RenderProcess::twin). It does just what the shader does, number for number.
#[derive(Clone)]
pub struct Twin {
    pub(crate) single: TwinShader<f32>,
    pub(crate) double: TwinShader<f64>,
}

/// A twin in one kind of number.
#[derive(Clone)]
pub(crate) enum TwinShader<R> {
    Objects(Arc<dyn ObjectTwin<R>>),
    FullScreen(Arc<dyn FullScreenTwin<R>>),
    Lights(Arc<dyn LightTwin<R>>),
}

impl Twin {
    /// Of a process that draws objects: [`Draws::Commands`](super::Draws::Commands).
    pub fn objects<T: ObjectTwin<f32> + ObjectTwin<f64> + 'static>(twin: T) -> Self {
        let twin = Arc::new(twin);
        Self { single: TwinShader::Objects(Arc::clone(&twin) as _), double: TwinShader::Objects(twin) }
    }

    /// Of a process that draws every pixel once: [`Draws::FullScreen`](super::Draws::FullScreen).
    pub fn full_screen<T: FullScreenTwin<f32> + FullScreenTwin<f64> + 'static>(twin: T) -> Self {
        let twin = Arc::new(twin);
        Self { single: TwinShader::FullScreen(Arc::clone(&twin) as _), double: TwinShader::FullScreen(twin) }
    }

    /// Of a process that draws what lights reach: [`Draws::Lights`](super::Draws::Lights).
    pub fn lights<T: LightTwin<f32> + LightTwin<f64> + 'static>(twin: T) -> Self {
        let twin = Arc::new(twin);
        Self { single: TwinShader::Lights(Arc::clone(&twin) as _), double: TwinShader::Lights(twin) }
    }
}

/// The twin of shaders that draw objects.
pub trait ObjectTwin<R: Real>: Send + Sync {
    /// The entry point `vertex`: where a corner is, and what is handed on to the pixels.
    fn vertex(&self, view: &ViewValues<R>, object: &ObjectValues<R>, vertex: &VertexValues<R>) -> Corner<R>;

    /// Whether there is a fragment entry point. Without one, depth alone is drawn.
    fn draws_pixels(&self) -> bool {
        true
    }

    /// The fragment entry point: fills in the targets in the order declared; `false` discards the pixel.
    fn fragment(&self, pass: &PassValues<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool;
}

/// The twin of shaders that draw every pixel once.
pub trait FullScreenTwin<R: Real>: Send + Sync {
    /// The fragment entry point: fills in the targets in the order declared; `false` discards the pixel.
    fn fragment(&self, pass: &PassValues<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool;
}

/// The twin of shaders that draw what lights reach.
///
/// It is called for all pixels that may be reached and whose surface is nearer than the far side of the light, not for those of a
/// geometry around the light: what a light does not reach is to be discarded.
pub trait LightTwin<R: Real>: Send + Sync {
    /// The fragment entry point: fills in the targets in the order declared; `false` discards the pixel.
    fn fragment(
        &self,
        pass: &PassValues<'_, R>,
        pixel: &FullScreenPixel<R>,
        light: &LightValues<R>,
        targets: &mut [Vector4<R>],
    ) -> bool;
}

/// How many numbers a corner hands on to the pixels.
pub const VARYINGS: usize = 9;

/// A triangle's corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner<R> {
    /// In clip space.
    pub clip: Vector4<R>,
    /// What is handed on to the pixels, interpolated in perspective.
    pub varyings: [R; VARYINGS],
}

/// A pixel of an object.
#[derive(Clone, Copy, Debug)]
pub struct ObjectPixel<R> {
    /// Column and row, from the top left.
    pub place: [usize; 2],
    /// What the corners handed on, at the pixel's middle.
    pub varyings: [R; VARYINGS],
    /// How that changes to the next column: the derivative `dpdx`.
    pub across: [R; VARYINGS],
    /// How that changes to the next row: the derivative `dpdy`.
    pub down: [R; VARYINGS],
    /// The object's material.
    pub material: u32,
}

/// A pixel of the picture.
#[derive(Clone, Copy, Debug)]
pub struct FullScreenPixel<R> {
    /// Column and row, from the top left.
    pub place: [usize; 2],
    /// Its middle, from (-1, -1) at the picture's lower left to (1, 1) at its upper right.
    pub clip: Vector2<R>,
}

/// What a pass reads.
pub struct PassValues<'a, R: Real> {
    /// The view.
    pub view: &'a ViewValues<R>,
    /// The lights that reach the view.
    pub lights: &'a [LightValues<R>],
    /// Materials and their textures.
    pub materials: &'a dyn Materials<R>,
    /// The targets that the process samples, in the order declared.
    pub sampled: &'a [&'a dyn Sampled<R>],
}

/// The materials of a scene and their textures: `@group(1)`.
pub trait Materials<R: Real>: Sync {
    /// The material in this slot.
    fn get(&self, slot: u32) -> MaterialValues<R>;

    /// What `textureSampleGrad` finds in a material's texture, linear, at a place of it and given how that changes to the next column
    /// and row; white where the material has none.
    fn texel(&self, slot: u32, uv: Vector2<R>, across: Vector2<R>, down: Vector2<R>) -> Vector4<R>;
}

/// A target to read from.
pub trait Sampled<R: Real>: Sync {
    /// Width and height in pixels.
    fn size(&self) -> [usize; 2];

    /// A pixel: of a target that views share, that of a layer; of depth, with depth as the first number. The place is inside.
    fn load(&self, place: [usize; 2], layer: usize) -> Vector4<R>;
}

/// A view as twins read it: `View` in `drawloom.wgsl`, but for the camera's place, which is already taken from everything.
#[derive(Clone, Debug)]
pub struct ViewValues<R> {
    /// From world axes relative to the camera to clip space, column by column; depth is reversed.
    pub clip_from_relative: [Vector4<R>; 4],
    /// Half the picture's width, to the right; in perspective at a distance of 1.
    pub right: Vector3<R>,
    /// Half the picture's height, up; in perspective at a distance of 1.
    pub up: Vector3<R>,
    /// The way the camera looks.
    pub forward: Vector3<R>,
    /// In metres.
    pub near: R,
    /// In metres; infinite for most cameras.
    pub far: R,
    /// In pixels.
    pub size: [usize; 2],
    /// How it is projected.
    pub projection: Projection,
    /// Whether what lies before the near plane is drawn onto it: of an orthographic shadow map.
    pub clamps_near: bool,
    /// The scene's ambient light.
    pub ambient: Vector3<R>,
}

/// An object as twins read it: `Object` in `drawloom.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct ObjectValues<R> {
    /// Relative to the camera, along the world's axes; in the world, where transforms are absolute.
    pub origin: Vector3<R>,
    /// What is taken from its places in the end: where the camera is, where transforms are absolute, and otherwise 0.
    pub camera: Vector3<R>,
    /// From object space to the world's axes.
    pub orientation: Quaternion<R>,
    /// Along the object's own axes.
    pub scale: Vector3<R>,
    /// Its material's slot.
    pub material: u32,
}

/// A vertex as twins read it.
#[derive(Clone, Copy, Debug)]
pub struct VertexValues<R> {
    /// In object space.
    pub position: Vector3<R>,
    /// In object space.
    pub normal: Vector3<R>,
    /// Of the texture.
    pub uv: Vector2<R>,
}

/// A material as twins read it: `Material` in `drawloom.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct MaterialValues<R> {
    /// The share of light reflected.
    pub diffuse: Vector3<R>,
    /// Only of blended materials.
    pub opacity: R,
    /// Radiance given off.
    pub emission: Vector3<R>,
    /// Whether triangles that face away are drawn too.
    pub double_sided: bool,
    /// How it mixes with what is behind it.
    pub blend: Blend,
}

/// A light as twins read it: `Light` in `drawloom.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct LightValues<R> {
    /// Relative to the camera, along the world's axes. Of a directional light: where its shadow map is seen from.
    pub position: Vector3<R>,
    /// What it is.
    pub kind: LightKind,
    /// The way it travels.
    pub direction: Vector3<R>,
    /// Where it ends, in metres; of a directional light, where its shadow map does.
    pub range: R,
    /// At 1 m, or on a surface that faces a directional light.
    pub intensity: Vector3<R>,
    /// The cosine at which a spot light begins to fade.
    pub cone_begin: R,
    /// The cosine at which a spot light is gone.
    pub cone_end: R,
    /// The layer of its shadow map; none without one.
    pub shadow_layer: Option<usize>,
    /// Half as wide as its shadow map: at 1 m for a spot light, in metres for a directional one.
    pub shadow_half: R,
    /// Where the shadow map begins, in metres.
    pub shadow_near: R,
    /// From the axes of the shadow map's camera to the world's.
    pub shadow_orientation: Quaternion<R>,
}
