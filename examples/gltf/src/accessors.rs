//! Typed values from the bytes of buffers.

use std::cell::Cell;

use gltf::Accessor;
use gltf::accessor::{DataType, Dimensions};

use crate::document::Source;
use crate::error::Problem;

/// Reads accessors, up to [`MAX_BYTES`] in all: one that many elements refer to is read for each of them.
pub(crate) struct Accessors<'a> {
    source: &'a Source,
    bytes: Cell<u64>,
}

impl<'a> Accessors<'a> {
    pub(crate) fn new(source: &'a Source) -> Self {
        Self { source, bytes: Cell::new(0) }
    }

    /// The values as floats, normalised if the accessor says so, and finite. `purpose` is what they are, in errors.
    pub(crate) fn floats<const N: usize>(
        &self,
        accessor: &Accessor<'_>,
        purpose: &str,
    ) -> Result<Vec<[f32; N]>, Problem> {
        let (data_type, normalized) = (accessor.data_type(), accessor.normalized());
        let values = self.read(accessor, purpose, |bytes| float(bytes, data_type, normalized))?;
        match values.iter().position(|value: &[f32; N]| !value.iter().all(|number| number.is_finite())) {
            None => Ok(values),
            Some(index) => {
                Err(Problem::NotFinite { element: format!("{purpose} (accessor {})", accessor.index()), index })
            }
        }
    }

    /// The values as whole numbers.
    pub(crate) fn integers<const N: usize>(
        &self,
        accessor: &Accessor<'_>,
        purpose: &str,
    ) -> Result<Vec<[u32; N]>, Problem> {
        let data_type = accessor.data_type();
        if !matches!(data_type, DataType::U8 | DataType::U16 | DataType::U32) {
            return Err(wrong_type(accessor, purpose, "of unsigned integers"));
        }
        self.read(accessor, purpose, |bytes| integer(bytes, data_type))
    }

    fn read<T: Copy + Default, const N: usize>(
        &self,
        accessor: &Accessor<'_>,
        purpose: &str,
        convert: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<[T; N]>, Problem> {
        if accessor.dimensions().multiplicity() != N {
            return Err(wrong_type(accessor, purpose, &format!("of {N} components")));
        }
        let element = || format!("accessor {}", accessor.index());
        self.count_bytes(element, accessor.count() as u64, (N * size_of::<T>()) as u64)?;
        let component = accessor.data_type().size();
        let mut values = vec![[T::default(); N]; accessor.count()];
        let value = |bytes: &[u8]| std::array::from_fn(|index| convert(&bytes[index * component..]));
        if let Some(view) = accessor.view() {
            let stride = view.stride().unwrap_or(N * component);
            let name = format!("accessor {}", accessor.index());
            let bytes = self.elements(name, &view, accessor.offset(), stride, N * component, values.len())?;
            values.iter_mut().zip(bytes.chunks(stride)).for_each(|(slot, bytes)| *slot = value(bytes));
        }
        if let Some(sparse) = accessor.sparse() {
            let (indices, replaced) = (sparse.indices(), sparse.values());
            let index_type = match indices.index_type() {
                gltf::accessor::sparse::IndexType::U8 => DataType::U8,
                gltf::accessor::sparse::IndexType::U16 => DataType::U16,
                gltf::accessor::sparse::IndexType::U32 => DataType::U32,
            };
            let name = |part| format!("the sparse {part} of accessor {}", accessor.index());
            let (size, count) = (index_type.size(), sparse.count());
            let bytes = self.elements(name("indices"), &indices.view(), indices.offset(), size, size, count)?;
            let (stride, offset) = (N * component, replaced.offset());
            let of_values = self.elements(name("values"), &replaced.view(), offset, stride, stride, count)?;
            for (index, bytes) in bytes.chunks(size).zip(of_values.chunks(stride)) {
                let (index, count) = (integer(index, index_type), values.len());
                *values.get_mut(index as usize).ok_or_else(|| Problem::IndexOutOfRange {
                    element: name("indices"),
                    index: index.into(),
                    count,
                    what: "elements",
                })? = value(bytes);
            }
        }
        Ok(values)
    }

    /// The bytes of `count` elements of `size` bytes, `stride` bytes apart.
    fn elements(
        &self,
        element: String,
        view: &gltf::buffer::View<'_>,
        offset: usize,
        stride: usize,
        size: usize,
        count: usize,
    ) -> Result<&'a [u8], Problem> {
        let (buffer, range) = self.source.view(view)?;
        let bytes = &buffer[range];
        if stride < size {
            return Err(Problem::invalid(element, format!("has elements of {size} bytes, {stride} bytes apart")));
        }
        if count == 0 {
            return Ok(&[]);
        }
        let end = offset as u128 + (count as u128 - 1) * stride as u128 + size as u128;
        if end > bytes.len() as u128 {
            let container = format!("buffer view {}", view.index());
            return Err(Problem::OutOfRange { element, end, container, bytes: bytes.len() });
        }
        Ok(&bytes[offset..end as usize])
    }

    /// Counts what is read of an element.
    ///
    /// # Errors
    /// If it is too much, with what was read before.
    pub(crate) fn count_bytes(&self, element: impl Fn() -> String, values: u64, size: u64) -> Result<(), Problem> {
        let bytes = values.checked_mul(size).and_then(|bytes| bytes.checked_add(self.bytes.get())).unwrap_or(u64::MAX);
        self.bytes.set(bytes);
        if bytes > MAX_BYTES {
            let element = format!("{}, with what is read before it,", element());
            return Err(Problem::TooMany { element, what: "bytes", count: bytes, limit: MAX_BYTES });
        }
        Ok(())
    }
}

/// The greatest number of bytes that all accessors take, each counted as often as it is read.
const MAX_BYTES: u64 = 2 << 30;

fn wrong_type(accessor: &Accessor<'_>, purpose: &str, expected: &str) -> Problem {
    let dimensions = match accessor.dimensions() {
        Dimensions::Scalar => "a scalar",
        Dimensions::Vec2 => "a vector of 2",
        Dimensions::Vec3 => "a vector of 3",
        Dimensions::Vec4 => "a vector of 4",
        _ => "a matrix",
    };
    Problem::WrongType {
        accessor: accessor.index(),
        purpose: purpose.to_owned(),
        found: format!("{dimensions} of {:?}", accessor.data_type()),
        expected: expected.to_owned(),
    }
}

fn float(bytes: &[u8], data_type: DataType, normalized: bool) -> f32 {
    let (value, greatest) = match data_type {
        DataType::F32 => return f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        DataType::I8 => (f32::from(bytes[0].cast_signed()), 127.0),
        DataType::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        DataType::U8 => (integer(bytes, data_type) as f32, 255.0),
        DataType::U16 => (integer(bytes, data_type) as f32, 65535.0),
        DataType::U32 => (integer(bytes, data_type) as f32, 4_294_967_295.0),
    };
    if normalized { (value / greatest).max(-1.0) } else { value }
}

fn integer(bytes: &[u8], data_type: DataType) -> u32 {
    match data_type {
        DataType::U8 => bytes[0].into(),
        DataType::U16 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}
