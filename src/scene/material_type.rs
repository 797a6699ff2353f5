//! Material types: materials that an engine defines.

use std::marker::PhantomData;
use std::sync::Arc;

use bytemuck::Pod;

/// A material type that an engine defines: a name, and the structure that shaders read of each material. Make it once,
/// as a constant: [materials](super::Material::values) bring values for it, and a process
/// [declares](crate::process::Declare::reads_materials) that its shader reads them and
/// [selects](crate::command::Selection::of_material_type) the objects that have a material of the type.
///
/// The shipped depth pre-pass, geometry buffer and transparency leave these objects to that process: without one they
/// are not drawn. Opaque ones cast shadows like others, and those whose material [is a
/// mask](super::Material::is_masked) cast them in its shape: see [`ShadowCasters`](crate::process::ShadowCasters).
///
/// `T` has the layout of the structure in WGSL, padding included: a `vec3<f32>` begins at a multiple of 16 bytes, and
/// the size of `T` is a multiple of the greatest alignment of its fields.
///
/// ```
/// use drawloom::command::Selection;
/// use drawloom::process::{CommandDraws, Declare, Draws, InjectionPoint, RenderProcess, SURFACE_SHADER, targets};
/// use drawloom::scene::{Material, MaterialType, Scene};
///
/// /// A surface that glows by how it faces the viewer.
/// #[repr(C)]
/// #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
/// struct Glow {
///     color: [f32; 3],
///     strength: f32,
/// }
///
/// const GLOW: MaterialType<Glow> = MaterialType::new("glow");
///
/// struct Glowing;
///
/// impl RenderProcess for Glowing {
///     fn name(&self) -> &str {
///         "glowing"
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.at(InjectionPoint::AfterLighting);
///         declare.draws_over(targets::RADIANCE);
///         declare.draws_depth(targets::DEPTH);
///         declare.reads_materials(GLOW);
///     }
///
///     fn draws(&self) -> Draws<'_> {
///         Draws::Commands(CommandDraws {
///             shader: "
///                 struct Glow {
///                     color: vec3<f32>,
///                     strength: f32,
///                 }
///
///                 @group(3) @binding(0) var<storage, read> glows: array<Glow>;
///
///                 struct Corner {
///                     @builtin(position) position: vec4<f32>,
///                     @location(0) @interpolate(flat) material: u32,
///                 }
///
///                 @vertex
///                 fn vertex(in: VertexInput) -> Corner {
///                     let object = drawn_object(in.instance);
///                     return Corner(clip_position(relative_position(object, in.position)), object.material);
///                 }
///
///                 @fragment
///                 fn fragment(in: Corner) -> @location(0) vec4<f32> {
///                     let glow = glows[in.material];
///                     return vec4<f32>(glow.color * glow.strength, 1.0);
///                 }
///             ",
///             selection: Selection::OPAQUE.of_material_type(GLOW),
///             ..CommandDraws::default()
///         })
///     }
/// }
///
/// let mut scene = Scene::new();
/// let values = GLOW.values(Glow { color: [1.0, 0.5, 0.2], strength: 4.0 });
/// let lamp = scene.add(Material { name: "lamp".into(), values: Some(values), ..Material::default() })?;
/// # assert_eq!(scene.assets().get(lamp)?.values.as_ref().unwrap().bytes().len(), size_of::<Glow>());
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
pub struct MaterialType<T> {
    name: &'static str,
    /// Neither owns nor borrows a `T`.
    values: PhantomData<fn() -> T>,
}

impl<T: Pod> MaterialType<T> {
    /// A type of this name. Two types of one name are the same type.
    ///
    /// # Panics
    /// If the size of `T` is 0 or not a multiple of 4 bytes, which no storage buffer can have. For a constant, that is
    /// an error of the compiler.
    pub const fn new(name: &'static str) -> Self {
        assert!(size_of::<T>() > 0 && size_of::<T>().is_multiple_of(4), "a material has 4, 8, 12 ... bytes");
        Self { name, values: PhantomData }
    }

    /// Its name and the size of a material's values.
    pub(crate) const fn layout(self) -> MaterialLayout {
        MaterialLayout { name: self.name, stride: size_of::<T>() }
    }

    /// The values of a material.
    pub fn values(self, values: T) -> MaterialValues {
        MaterialValues { layout: self.layout(), bytes: bytemuck::bytes_of(&values).into() }
    }
}

// Derived implementations would require them of `T`.
impl<T> Clone for MaterialType<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for MaterialType<T> {}

impl<T> std::fmt::Debug for MaterialType<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("MaterialType").field(&self.name).finish()
    }
}

/// A [`MaterialType`] without the type of its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialLayout {
    /// Its name.
    pub name: &'static str,
    /// The size of a material's values in bytes.
    pub stride: usize,
}

/// The values of one material of a [`MaterialType`]: see [`MaterialType::values`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MaterialValues {
    layout: MaterialLayout,
    bytes: Arc<[u8]>,
}

impl MaterialValues {
    /// The name of the type and the size of the values.
    pub(crate) fn layout(&self) -> MaterialLayout {
        self.layout
    }

    /// The values, as shaders read them.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}
