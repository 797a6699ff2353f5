//! What CPU shaders are given: the Rust side of the structures and bindings in `drawloom.wgsl`.

use std::sync::Arc;

use bytemuck::Pod;
use glam::DVec3;

use super::level_sampling::{bilinear, trilinear};
use crate::raster::{Quaternion, Real, Vector2, Vector3, Vector4};
use crate::scene::{Blend, ColumnLayout, LightKind, MaterialType, MaterialValues, ObjectColumn, Projection};
use crate::view::LightClass;

/// How many numbers a vertex hands on to the pixels.
pub const VARYINGS: usize = 11;

/// How many attributes of the engine's own a CPU shader can read.
pub const MAX_ATTRIBUTES: usize = 4;

/// What a vertex shader returns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VertexOutput<R> {
    /// In clip space.
    pub clip: Vector4<R>,
    /// Interpolated in perspective and handed on to the pixels.
    pub varyings: [R; VARYINGS],
}

/// A pixel of an object.
#[derive(Clone, Copy, Debug)]
pub struct ObjectPixel<R> {
    /// Column and row, from the top left.
    pub coordinates: [usize; 2],
    /// The interpolated varyings at the pixel's centre.
    pub varyings: [R; VARYINGS],
    /// Their derivatives towards the next column.
    pub dpdx: [R; VARYINGS],
    /// Their derivatives towards the next row.
    pub dpdy: [R; VARYINGS],
    /// The object's material slot.
    pub material: u32,
    /// The object's index in the scene.
    pub object: u32,
}

/// A pixel of the picture.
#[derive(Clone, Copy, Debug)]
pub struct FullScreenPixel<R> {
    /// Column and row, from the top left.
    pub coordinates: [usize; 2],
    /// Its centre, from (-1, -1) at the picture's lower left to (1, 1) at its upper right.
    pub clip: Vector2<R>,
}

/// What the shaders of a pass read.
pub struct PassInputs<'a, R: Real> {
    /// The view.
    pub view: &'a ShaderView<R>,
    /// The lights that reach the view.
    pub lights: &'a [ShaderLight<R>],
    /// For each class of lights, by [`LightClass::index`](crate::view::LightClass::index): where they end among the
    /// lights. They begin where those of the class before end.
    pub light_ends: &'a [usize; LightClass::COUNT],
    /// By layer of the shadow maps, the light that the layer belongs to, as that map shows it; empty unless a light has
    /// several maps.
    pub lights_by_layer: &'a [ShaderLight<R>],
    /// Materials and their textures.
    pub materials: &'a dyn Materials<R>,
    /// The targets that the process samples, in the order declared.
    pub sampled: &'a [&'a dyn SampledTexture<R>],
    /// The columns of objects that the processes of the frame read: see [`column`](Self::column).
    pub(crate) columns: &'a [(ColumnLayout, Box<[u8]>)],
}

impl<R: Real> PassInputs<'_, R> {
    /// The values of a material in a slot: those that a shader on the device has after
    /// [`Declare::reads_materials`](crate::process::Declare::reads_materials), all zeros if the material is of another
    /// type.
    pub fn material_values<T: Pod>(&self, material: MaterialType<T>, slot: u32) -> T {
        let values = self.materials.values(slot).filter(|values| values.layout() == material.layout());
        values.map_or_else(T::zeroed, |values| bytemuck::pod_read_unaligned(values.bytes()))
    }

    /// The value that a column has for an object, by its index in the scene: [`ShaderObject::index`] or
    /// [`ObjectPixel::object`]. It is `@group(3)` of a shader on the device.
    ///
    /// # Panics
    /// If no process of the frame [reads the column](crate::process::Declare::reads_column), or the scene has no such
    /// object. A panic of a CPU shader is an error of the submission.
    pub fn column<T: Pod>(&self, column: ObjectColumn<T>, object: u32) -> T {
        let ColumnLayout { name, stride } = column.layout();
        let values = self.columns.iter().find(|(layout, _)| *layout == column.layout());
        let (_, values) = values.unwrap_or_else(|| panic!("no process declares that it reads the column {name:?}"));
        bytemuck::pod_read_unaligned(&values[object as usize * stride..][..stride])
    }
}

/// The materials of a scene and their textures: `@group(1)`.
pub trait Materials<R: Real>: Sync {
    /// The material in a slot.
    fn get(&self, slot: u32) -> ShaderMaterial<R>;

    /// The engine's own values of the material in a slot; `None` if it has none.
    fn values(&self, slot: u32) -> Option<&MaterialValues>;

    /// `texture_at` of the material in a slot: its texture in a place at texture coordinates with these derivatives,
    /// linear; white where the material has none.
    fn texture_at(&self, slot: u32, place: usize, uv: Vector2<R>, derivatives: [Vector2<R>; 2]) -> Vector4<R>;
}

/// A target that a process samples.
pub trait SampledTexture<R: Real>: Sync {
    /// Width and height in pixels.
    fn size(&self) -> [usize; 2];

    /// `textureLoad`: a pixel, of one layer if views share the target as layers. Depth is the first number. The
    /// coordinates are inside the texture.
    fn load(&self, coordinates: [usize; 2], layer: usize) -> Vector4<R>;

    /// `textureNumLevels`: 1, and more for a target with [mip levels](crate::process::Declare::mipmapped).
    fn level_count(&self) -> usize {
        1
    }

    /// `textureDimensions` of a mip level.
    fn size_of_level(&self, level: usize) -> [usize; 2] {
        self.size().map(|pixels| (pixels >> level).max(1))
    }

    /// `textureLoad` of a mip level, which the texture has. The coordinates are inside that level.
    fn load_level(&self, coordinates: [usize; 2], layer: usize, _level: usize) -> Vector4<R> {
        self.load(coordinates, layer)
    }

    /// `textureSampleLevel` with the `target_sampler`: between the pixels of a level, from (0, 0) at the picture's
    /// upper left to (1, 1) at its lower right, and between levels. Beyond the edges it is as on them.
    fn sample_level(&self, uv: Vector2<R>, layer: usize, level: R) -> Vector4<R> {
        trilinear(self.level_count(), level, |level| {
            bilinear(self.size_of_level(level), uv, |pixel| self.load_level(pixel, layer, level))
        })
    }

    /// The pixel of a cube map that lies in a direction of the world, of any length but 0.
    fn load_cube(&self, direction: Vector3<R>) -> Vector4<R> {
        self.load_cube_level(direction, 0)
    }

    /// The pixel of a cube map's mip level, which the texture has, that lies in a direction of the world, of any length
    /// but 0.
    fn load_cube_level(&self, direction: Vector3<R>, level: usize) -> Vector4<R> {
        let [x, y, z] = direction.0;
        let zero = R::zero();
        // The face, the distance along its axis, and the position to the right and down: see `Camera::cube_faces`.
        let (face, along, across, down) = if x.abs() >= y.abs() && x.abs() >= z.abs() {
            if x >= zero { (0, x, z, -y) } else { (1, -x, -z, -y) }
        } else if y.abs() >= z.abs() {
            if y >= zero { (2, y, x, -z) } else { (3, -y, x, z) }
        } else if z < zero {
            (4, -z, x, -y)
        } else {
            (5, z, -x, -y)
        };
        let side = self.size_of_level(level)[0];
        let coordinate = |offset: R| {
            let share = (offset / along + R::one()) * R::of(0.5) * R::of(side as f64);
            (share.as_f64().max(0.0) as usize).min(side - 1)
        };
        self.load_level([coordinate(across), coordinate(down)], face, level)
    }
}

/// A view: `View` in `drawloom.wgsl`.
#[derive(Clone, Debug)]
pub struct ShaderView<R> {
    /// The name of the view's camera.
    pub name: Arc<str>,
    /// Where in the world the camera is, in metres. All other positions are relative to it.
    pub position: DVec3,
    /// From world axes relative to the camera to clip space, column by column; depth is reversed.
    pub clip_from_relative: [Vector4<R>; 4],
    /// To the right, as long as half the picture's width; in perspective at a distance of 1.
    pub right: Vector3<R>,
    /// Up, as long as half the picture's height; in perspective at a distance of 1.
    pub up: Vector3<R>,
    /// The direction in which the camera looks.
    pub forward: Vector3<R>,
    /// In metres.
    pub near: R,
    /// In metres; infinite for most cameras.
    pub far: R,
    /// In pixels.
    pub size: [usize; 2],
    /// How it is projected.
    pub projection: Projection,
    /// Whether what is in front of the near plane is drawn as if it were on it: only in an orthographic shadow map.
    pub clamps_near: bool,
    /// The scene's ambient light.
    pub ambient: Vector3<R>,
}

/// An object: `Object` in `drawloom.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct ShaderObject<R> {
    /// Relative to the camera, along the world's axes; in the world if transforms are absolute.
    pub origin: Vector3<R>,
    /// Subtracted from transformed positions: the camera's position if transforms are absolute, and otherwise 0.
    pub camera: Vector3<R>,
    /// From object space to the world's axes.
    pub orientation: Quaternion<R>,
    /// Along the object's own axes.
    pub scale: Vector3<R>,
    /// Its material's slot.
    pub material: u32,
    /// Its index in the scene.
    pub index: u32,
}

/// A vertex: `VertexInput` in `drawloom.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct VertexInput<R> {
    /// In object space.
    pub position: Vector3<R>,
    /// In object space, of any length; 0 for the geometric normal of the triangle.
    pub normal: Vector3<R>,
    /// Texture coordinates.
    pub uv: Vector2<R>,
    /// The value of [`VERTEX_COLOR`](crate::scene::VERTEX_COLOR), and white if the process does not read it.
    pub color: Vector3<R>,
    /// The first other attributes that the process reads, in the order declared, each with 0 for the numbers that it
    /// lacks.
    pub attributes: [Vector4<R>; MAX_ATTRIBUTES],
}

/// A material: `Material` in `drawloom.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct ShaderMaterial<R> {
    /// The fraction of light that is reflected.
    pub diffuse: Vector3<R>,
    /// Used by blended and masked materials only.
    pub opacity: R,
    /// Where a mask's alpha is less, there is no surface; 0 for a material without a mask.
    pub alpha_cutoff: R,
    /// Emitted radiance.
    pub emission: Vector3<R>,
    /// Whether triangles that face away are drawn too.
    pub double_sided: bool,
    /// How it blends with what is behind it.
    pub blend: Blend,
}

/// A light: `Light` in `drawloom.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct ShaderLight<R> {
    /// Relative to the camera, along the world's axes. For a directional light: the position of its shadow map's
    /// camera.
    pub position: Vector3<R>,
    /// What kind of light it is.
    pub kind: LightKind,
    /// The direction in which the light travels.
    pub direction: Vector3<R>,
    /// Where the light ends, in metres; for a directional light, where its shadow map ends.
    pub range: R,
    /// At 1 m; for a directional light, on a surface that faces it.
    pub intensity: Vector3<R>,
    /// The cosine at which a spot light begins to fade.
    pub cone_begin: R,
    /// The cosine at which a spot light has faded out.
    pub cone_end: R,
    /// The layer of its shadow map, if it has one; the first layer if it has several.
    pub shadow_layer: Option<usize>,
    /// Half the width of its shadow map: at 1 m for a spot or point light, in metres for a directional one.
    pub shadow_half: R,
    /// Where the shadow map begins, in metres.
    pub shadow_near: R,
    /// From the axes of the shadow map's camera to the world's.
    pub shadow_orientation: Quaternion<R>,
}
