//! Data of an engine's own for each object.

use std::marker::PhantomData;

use bytemuck::Pod;

/// A name for data that an engine has for each object, such as a tint or the offset of a skinning palette. Make it once,
/// as a constant: scenes bring values for it, and processes declare that their shaders read them.
///
/// `T` has the layout of an element of the array in WGSL, padding included: `array<vec3<f32>>` has 16 bytes an element.
///
/// ```
/// use drawloom::scene::{ObjectColumn, Scene, SceneRef};
///
/// const TINT: ObjectColumn<[f32; 4]> = ObjectColumn::new("tint");
///
/// let world = Scene::new();
/// let tints: Vec<[f32; 4]> = Vec::new();
/// // One value for each object; `SceneRef::changes` is about them too.
/// let scene = SceneRef { columns: &[TINT.values(&tints)], ..world.as_scene_ref() };
/// # assert_eq!(scene.columns[0].name(), "tint");
/// ```
///
/// A process that reads it says so, and its shader has the array in `@group(3)`:
/// see [`Declare::reads_column`](crate::process::Declare::reads_column).
pub struct ObjectColumn<T> {
    name: &'static str,
    /// Neither owns nor borrows a `T`.
    element: PhantomData<fn() -> T>,
}

impl<T: Pod> ObjectColumn<T> {
    /// A column of this name. Two columns of one name are the same column.
    ///
    /// # Panics
    /// If the size of `T` is 0 or not a multiple of 4 bytes, which no storage buffer can have. For a constant, that is
    /// an error of the compiler.
    pub const fn new(name: &'static str) -> Self {
        assert!(size_of::<T>() > 0 && size_of::<T>().is_multiple_of(4), "an element has 4, 8, 12 ... bytes");
        Self { name, element: PhantomData }
    }

    /// Its name in errors, and that of its buffer.
    pub const fn name(self) -> &'static str {
        self.name
    }

    /// Its name and the size of an element.
    pub(crate) const fn layout(self) -> ColumnLayout {
        ColumnLayout { name: self.name, stride: size_of::<T>() }
    }

    /// Its values, one for each object of a scene, in their order.
    pub fn values(self, values: &[T]) -> ColumnValues<'_> {
        ColumnValues { layout: self.layout(), bytes: bytemuck::cast_slice(values) }
    }
}

/// The objects as they were in the frame before, which Drawloom keeps for processes that [read
/// them](crate::process::Declare::reads_column): for motion vectors, which temporal filters and upscalers need. Scenes
/// bring no values.
///
/// ```wgsl
/// @group(3) @binding(0) var<storage, read> previous_objects: array<Object>;
///
/// fn previous_relative_position(object: Object, position: vec3<f32>) -> vec3<f32> {
///     return relative_position(previous_objects[object.index], position);
/// }
/// ```
///
/// That is where a corner was, relative to this frame's camera; the process knows how the camera moved. The example
/// `own_content` has such a process.
///
/// The frame before is the one that was submitted last. An object is known by its index: one that the frame before did
/// not have is where it was, and one that moves to another index seems to have been where the object was that had it.
/// A [deformed](crate::process::Deformation) object's shape is the engine's.
///
/// The price is a copy of all objects on the device, 64 bytes each, at the end of each frame in which one changes. The
/// software backend has no such column, and returns an error.
pub const PREVIOUS_OBJECTS: ObjectColumn<[u32; 16]> = ObjectColumn::new("previous objects");

// Derived implementations would require them of `T`.
impl<T> Clone for ObjectColumn<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for ObjectColumn<T> {}

impl<T> PartialEq for ObjectColumn<T> {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl<T> Eq for ObjectColumn<T> {}

impl<T> std::hash::Hash for ObjectColumn<T> {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.name.hash(state);
    }
}

impl<T> std::fmt::Debug for ObjectColumn<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("ObjectColumn").field(&self.name).finish()
    }
}

/// An [`ObjectColumn`] without the type of its elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ColumnLayout {
    /// Its name.
    pub name: &'static str,
    /// The size of an element in bytes.
    pub stride: usize,
}

/// The values of an [`ObjectColumn`], one for each object: see [`ObjectColumn::values`].
#[derive(Clone, Copy, Debug)]
pub struct ColumnValues<'a> {
    layout: ColumnLayout,
    bytes: &'a [u8],
}

impl<'a> ColumnValues<'a> {
    /// The name of the column.
    pub fn name(&self) -> &'static str {
        self.layout.name
    }

    /// The name of the column and the size of an element.
    pub(crate) fn layout(&self) -> ColumnLayout {
        self.layout
    }

    /// The number of values.
    pub fn count(&self) -> usize {
        self.bytes.len() / self.layout.stride
    }

    /// All values, one after the other.
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }
}
