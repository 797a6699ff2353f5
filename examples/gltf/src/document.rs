//! The JSON of a file and its buffers.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use gltf::json::validation::Validate;
use gltf::{Document, Glb, json};

use crate::error::Problem;
use crate::files::{read_file, read_uri};
use crate::warnings::Warnings;

/// A parsed file with its buffers. All indices in its JSON are in range.
pub(crate) struct Source {
    pub(crate) document: Document,
    /// The folder that URIs are relative to.
    pub(crate) folder: PathBuf,
    buffers: Vec<Arc<[u8]>>,
}

impl Source {
    /// Reads a `.gltf` or a `.glb`, and the buffers that it refers to.
    pub(crate) fn open(path: &Path, warnings: &mut Warnings) -> Result<Self, Problem> {
        let bytes = read_file(path)?;
        let (json, binary) = split(&bytes)?;
        let root: json::Root = json::deserialize::from_slice(json).map_err(malformed)?;
        check(&root, warnings)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let document = Document::from_json_without_validation(root);
        let buffers = document.buffers().map(|buffer| read_buffer(&buffer, &folder, binary));
        let buffers = buffers.collect::<Result<_, _>>()?;
        Ok(Self { document, folder, buffers })
    }

    /// The buffer of a view, and which of its bytes the view has.
    pub(crate) fn view(&self, view: &gltf::buffer::View<'_>) -> Result<(&Arc<[u8]>, Range<usize>), Problem> {
        let buffer = &self.buffers[view.buffer().index()];
        let end = view.offset() as u128 + view.length() as u128;
        if end > buffer.len() as u128 {
            return Err(Problem::OutOfRange {
                element: format!("buffer view {}", view.index()),
                end,
                container: format!("buffer {}", view.buffer().index()),
                bytes: buffer.len(),
            });
        }
        Ok((buffer, view.offset()..view.offset() + view.length()))
    }
}

/// The JSON, and the binary chunk of a `.glb`.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Problem> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes, None));
    }
    // The crate subtracts the size of the header from the length without a check.
    let length = bytes.get(8..12).and_then(|length| length.try_into().ok()).map(u32::from_le_bytes);
    if length.is_none_or(|length| length < 12) {
        return Err(malformed("its header is cut off"));
    }
    let glb = Glb::from_slice(bytes).map_err(malformed)?;
    let part = |part| match part {
        std::borrow::Cow::Borrowed(bytes) => Ok(bytes),
        std::borrow::Cow::Owned(_) => Err(malformed("its chunks are not in the file")),
    };
    Ok((part(glb.json)?, glb.bin.map(part).transpose()?))
}

/// Checks indices, enumerations and required members.
fn check(root: &json::Root, warnings: &mut Warnings) -> Result<(), Problem> {
    // The accessors read quantised attributes, which the crate does not list.
    let is_known = |name: &str| name == "KHR_mesh_quantization" || json::extensions::ENABLED_EXTENSIONS.contains(&name);
    if let Some(name) = root.extensions_required.iter().find(|name| !is_known(name)) {
        return Err(Problem::Extension { name: name.clone() });
    }
    for name in root.extensions_used.iter().filter(|name| !is_known(name)) {
        warnings.add(format!("the extension {name} is ignored"));
    }
    check_positions(root)?;
    let mut first = None;
    root.validate(root, json::Path::new, &mut |path, error| {
        let path = path();
        if !is_tolerated(path.as_str(), error) {
            first.get_or_insert_with(|| format!("{path} is {}", description(error)));
        }
    });
    first.map_or(Ok(()), |reason| Err(Problem::Malformed { reason }))
}

/// Checks what the crate's validation indexes without a check.
fn check_positions(root: &json::Root) -> Result<(), Problem> {
    let positions = json::validation::Checked::Valid(json::mesh::Semantic::Positions);
    for (index, mesh) in root.meshes.iter().enumerate() {
        let accessors = mesh.primitives.iter().filter_map(|primitive| primitive.attributes.get(&positions));
        if let Some(accessor) = accessors.into_iter().find(|accessor| accessor.value() >= root.accessors.len()) {
            let (element, what) = (format!("mesh {index}"), "accessors");
            let (index, count) = (accessor.value() as u64, root.accessors.len());
            return Err(Problem::IndexOutOfRange { element, index, count, what });
        }
    }
    Ok(())
}

/// Whether the loader needs not what the crate misses: it computes bounds itself, warns of primitives without positions, and reads
/// accessors without a buffer view as zeros.
fn is_tolerated(path: &str, error: json::validation::Error) -> bool {
    let is_zeros = path.starts_with("accessors[") && path.ends_with("].bufferView");
    match error {
        json::validation::Error::IndexOutOfBounds => false,
        json::validation::Error::Unsupported => true,
        json::validation::Error::Missing if is_zeros => true,
        _ => path.contains("POSITION"),
    }
}

fn description(error: json::validation::Error) -> &'static str {
    match error {
        json::validation::Error::IndexOutOfBounds => "an index that is out of range",
        json::validation::Error::Missing => "missing",
        json::validation::Error::Oversize => "too large",
        _ => "invalid",
    }
}

fn read_buffer(buffer: &gltf::Buffer<'_>, folder: &Path, binary: Option<&[u8]>) -> Result<Arc<[u8]>, Problem> {
    let bytes: Arc<[u8]> = match (buffer.source(), binary) {
        (gltf::buffer::Source::Uri(uri), _) => read_uri(folder, &format!("buffer {}", buffer.index()), uri)?.into(),
        (gltf::buffer::Source::Bin, Some(binary)) if buffer.index() == 0 => binary.into(),
        _ => return Err(Problem::MissingBuffer { buffer: buffer.index() }),
    };
    let expected = buffer.length();
    if bytes.len() < expected {
        return Err(Problem::ShortBuffer { buffer: buffer.index(), bytes: bytes.len(), expected });
    }
    Ok(bytes)
}

fn malformed(reason: impl ToString) -> Problem {
    Problem::Malformed { reason: reason.to_string() }
}
