//! Typed values from the bytes of buffers.

use crate::document::{Source, View};
use crate::element::{Element, Kind};
use crate::error::Problem;
use crate::limits::Limit;

/// Reads accessors. What is made of them counts, each time.
#[derive(Clone, Copy)]
pub(crate) struct Accessors<'a> {
    pub(crate) source: &'a Source,
    /// What the values are taken of.
    pub(crate) limit: &'a Limit,
}

/// What an accessor says of its values.
#[derive(Clone, Copy)]
struct Format {
    component: Component,
    is_normalized: bool,
    count: usize,
}

/// The type of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl<'a> Accessors<'a> {
    /// For vertices, indices, and what else is drawn.
    pub(crate) fn of_geometry(source: &'a Source) -> Self {
        Self { source, limit: &source.budget.geometry }
    }

    /// For animations.
    pub(crate) fn of_keyframes(source: &'a Source) -> Self {
        Self { source, limit: &source.budget.keyframes }
    }

    /// How many numbers a value of an accessor has.
    ///
    /// # Errors
    /// If it has no type that is known.
    pub(crate) fn width(&self, accessor: &Element<'_>) -> Result<usize, Problem> {
        match accessor.text("type")? {
            Some("SCALAR") => Ok(1),
            Some("VEC2") => Ok(2),
            Some("VEC3") => Ok(3),
            Some("VEC4" | "MAT2") => Ok(4),
            Some("MAT3") => Ok(9),
            Some("MAT4") => Ok(16),
            Some(_) => Err(Problem::invalid(accessor, "has a `type` that is not known")),
            None => Err(accessor.lacks("type")),
        }
    }

    /// The values as floats, normalised if the accessor says so, and finite. `purpose` is what they are, in errors.
    pub(crate) fn floats<const N: usize>(
        &self,
        accessor: &Element<'_>,
        purpose: &str,
    ) -> Result<Vec<[f32; N]>, Problem> {
        let format = self.format::<N>(accessor, purpose)?;
        let values = self.read(accessor, format, |bytes| float(bytes, format.component, format.is_normalized))?;
        match values.iter().position(|value: &[f32; N]| !value.iter().all(|number| number.is_finite())) {
            None => Ok(values),
            Some(index) => Err(Problem::NotFinite { element: format!("{purpose} ({accessor})"), index }),
        }
    }

    /// The values as whole numbers, of up to `bytes` bytes each.
    pub(crate) fn integers<const N: usize>(
        &self,
        accessor: &Element<'_>,
        purpose: &str,
        bytes: usize,
    ) -> Result<Vec<[u32; N]>, Problem> {
        let format = self.format::<N>(accessor, purpose)?;
        let is_unsigned = matches!(format.component, Component::U8 | Component::U16 | Component::U32);
        if !is_unsigned || format.component.size() > bytes {
            let expected = format!("of unsigned integers of up to {bytes} bytes");
            return Err(wrong_type(accessor, format.component, purpose, &expected));
        }
        self.read(accessor, format, |bytes| integer(bytes, format.component))
    }

    /// The format of an accessor whose values have `N` numbers.
    fn format<const N: usize>(&self, accessor: &Element<'_>, purpose: &str) -> Result<Format, Problem> {
        let number = accessor.needed_index("componentType")?;
        let Some(component) = Component::of_number(number) else {
            return Err(Problem::invalid(accessor, format!("has the `componentType` {number}, which is not known")));
        };
        if self.width(accessor)? != N || accessor.text("type")? == Some("MAT2") {
            return Err(wrong_type(accessor, component, purpose, &format!("of {N} components")));
        }
        let count = accessor.needed_index("count")?;
        let is_normalized = accessor.flag("normalized")?.unwrap_or(false);
        Ok(Format { component, is_normalized, count })
    }

    fn read<T: Copy + Default, const N: usize>(
        &self,
        accessor: &Element<'_>,
        Format { component, count, .. }: Format,
        convert: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<[T; N]>, Problem> {
        let size = N * component.size();
        let value = |bytes: &[u8]| std::array::from_fn(|index| convert(&bytes[index * component.size()..]));
        // What is replaced is in the file: it is there before anything is made.
        let replaced = Replaced::find(self.source, accessor, size)?;
        let taken = (N * size_of::<T>()) as u64;
        let mut values = match accessor.index("bufferView")? {
            Some(view) => {
                let view = self.source.view(accessor, view)?;
                let stride = view.stride.unwrap_or(size);
                let offset = accessor.index("byteOffset")?.unwrap_or(0);
                let bytes = elements(accessor, &view, offset, stride, size, count)?;
                self.limit.take(accessor, count as u64, taken)?;
                bytes.chunks(stride).map(value).collect()
            }
            None => {
                let in_file = replaced.as_ref().map_or(0, |replaced| replaced.count.saturating_mul(ZEROS_PER_REPLACED));
                self.source.budget.zeros.take(accessor, count.saturating_sub(in_file) as u64, taken)?;
                self.limit.take(accessor, count as u64, taken)?;
                vec![[T::default(); N]; count]
            }
        };
        if let Some(replaced) = replaced {
            for (index, bytes) in replaced.elements(size)? {
                let count = values.len();
                *values.get_mut(index as usize).ok_or_else(|| Problem::IndexOutOfRange {
                    element: format!("the sparse indices of {accessor}"),
                    index: index.into(),
                    count,
                    what: "elements",
                })? = value(bytes);
            }
        }
        Ok(values)
    }

    /// The accessor that a member of an object refers to, if it is there.
    ///
    /// # Errors
    /// If it is no index, or there is no accessor of that index.
    pub(crate) fn member(&self, from: &Element<'_>, member: &str) -> Result<Option<Element<'a>>, Problem> {
        self.source.member(from, member, Kind::Accessor)
    }
}

/// How many zeros a sparse accessor may have for each value that it replaces, before they count as made of nothing.
const ZEROS_PER_REPLACED: usize = 64;

/// The values that a sparse accessor replaces.
struct Replaced<'a> {
    accessor: &'a Element<'a>,
    count: usize,
    index_type: Component,
    indices: View<'a>,
    values: View<'a>,
    /// Where they begin in their views.
    offsets: [usize; 2],
}

impl<'a> Replaced<'a> {
    /// Those of an accessor whose values take `size` bytes, if it is sparse.
    fn find(source: &'a Source, accessor: &'a Element<'a>, size: usize) -> Result<Option<Self>, Problem> {
        let Some(sparse) = accessor.object("sparse")? else { return Ok(None) };
        let part = |member: &str| sparse.object(member)?.ok_or_else(|| sparse.lacks(member));
        let (indices, values, count) = (part("indices")?, part("values")?, sparse.needed_index("count")?);
        let index_type = match Component::of_number(indices.needed_index("componentType")?) {
            Some(unsigned @ (Component::U8 | Component::U16 | Component::U32)) => unsigned,
            _ => return Err(Problem::invalid(accessor, "has sparse indices that are no unsigned integers")),
        };
        let view_of = |part: &Element<'_>| source.view(accessor, part.needed_index("bufferView")?);
        if count > accessor.needed_index("count")? {
            return Err(Problem::invalid(accessor, "has more sparse values than values"));
        }
        let offset = |part: &Element<'_>| Ok::<_, Problem>(part.index("byteOffset")?.unwrap_or(0));
        let offsets = [offset(&indices)?, offset(&values)?];
        let (indices, values) = (view_of(&indices)?, view_of(&values)?);
        let replaced = Self { accessor, count, index_type, indices, values, offsets };
        replaced.elements(size).map(|_| ())?;
        Ok(Some(replaced))
    }

    /// The index and the bytes of each.
    ///
    /// # Errors
    /// If they are not all there.
    fn elements(&self, size: usize) -> Result<impl Iterator<Item = (u32, &[u8])>, Problem> {
        let named = |part: &str| format!("the sparse {part} of {}", self.accessor);
        let (index_size, [of_indices, of_values]) = (self.index_type.size(), self.offsets);
        let indices = elements(&named("indices"), &self.indices, of_indices, index_size, index_size, self.count)?;
        let values = elements(&named("values"), &self.values, of_values, size, size, self.count)?;
        let indices = indices.chunks(index_size).map(|bytes| integer(bytes, self.index_type));
        Ok(indices.zip(values.chunks(size)))
    }
}

/// The bytes of `count` elements of `size` bytes, `stride` bytes apart.
fn elements<'v>(
    element: &dyn std::fmt::Display,
    view: &'v View<'_>,
    offset: usize,
    stride: usize,
    size: usize,
    count: usize,
) -> Result<&'v [u8], Problem> {
    if stride < size {
        return Err(Problem::invalid(element, format!("has elements of {size} bytes, {stride} bytes apart")));
    }
    if count == 0 {
        return Ok(&[]);
    }
    let end = offset as u128 + (count as u128 - 1) * stride as u128 + size as u128;
    if end > view.bytes.len() as u128 {
        let (element, container) = (element.to_string(), view.element.to_string());
        return Err(Problem::OutOfRange { element, end, container, bytes: view.bytes.len() });
    }
    Ok(&view.bytes[offset..end as usize])
}

fn wrong_type(accessor: &Element<'_>, component: Component, purpose: &str, expected: &str) -> Problem {
    let found = match accessor.text("type") {
        Ok(Some("SCALAR")) => "a scalar",
        Ok(Some("VEC2")) => "a vector of 2",
        Ok(Some("VEC3")) => "a vector of 3",
        Ok(Some("VEC4")) => "a vector of 4",
        _ => "a matrix",
    };
    Problem::WrongType {
        accessor: accessor.to_string(),
        purpose: purpose.to_owned(),
        found: format!("{found} of {component:?}"),
        expected: expected.to_owned(),
    }
}

impl Component {
    fn of_number(number: usize) -> Option<Self> {
        match number {
            5120 => Some(Self::I8),
            5121 => Some(Self::U8),
            5122 => Some(Self::I16),
            5123 => Some(Self::U16),
            5125 => Some(Self::U32),
            5126 => Some(Self::F32),
            _ => None,
        }
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

fn float(bytes: &[u8], component: Component, normalized: bool) -> f32 {
    let (value, greatest) = match component {
        Component::F32 => return f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        Component::I8 => (f32::from(bytes[0].cast_signed()), 127.0),
        Component::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        Component::U8 => (integer(bytes, component) as f32, 255.0),
        Component::U16 => (integer(bytes, component) as f32, 65535.0),
        Component::U32 => (integer(bytes, component) as f32, 4_294_967_295.0),
    };
    if normalized { (value / greatest).max(-1.0) } else { value }
}

fn integer(bytes: &[u8], component: Component) -> u32 {
    match component {
        Component::U8 => bytes[0].into(),
        Component::U16 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}
