//! The JSON of a file and its buffers.

use std::cell::OnceCell;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::element::{Element, Kind};
use crate::error::{Problem, excerpt};
use crate::files::read_uri;
use crate::glb::split;
use crate::json::Json;
use crate::limits::{Budget, GltfLimits, Limit};
use crate::version::check_version;
use crate::warnings::Warnings;

/// The extensions that are read.
const KNOWN_EXTENSIONS: [&str; 5] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions that compress the bytes of a buffer view.
const VIEW_COMPRESSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// A parsed file. Its elements are checked where they are read, and its buffers are read when they are needed.
pub(crate) struct Source {
    /// The folder that URIs are relative to.
    pub(crate) folder: PathBuf,
    pub(crate) limits: GltfLimits,
    pub(crate) budget: Budget,
    root: Json,
    file: Arc<[u8]>,
    binary: Option<Range<usize>>,
    /// Of each buffer, once it was needed: its bytes, or what is wrong with it.
    buffers: Vec<OnceCell<Result<Bytes, String>>>,
}

/// Some bytes of a file or a URI. Clones share them.
#[derive(Clone, Debug)]
pub(crate) struct Bytes {
    all: Arc<[u8]>,
    range: Range<usize>,
}

/// A buffer view.
pub(crate) struct View<'a> {
    pub(crate) element: Element<'a>,
    pub(crate) bytes: Bytes,
    pub(crate) stride: Option<usize>,
}

impl Source {
    /// Parses the bytes of a `.gltf` or a `.glb`.
    ///
    /// # Errors
    /// If it is not glTF 2.0, or requires an extension that is not known.
    pub(crate) fn parse(
        folder: PathBuf,
        mut bytes: Vec<u8>,
        limits: &GltfLimits,
        warnings: &mut Warnings,
    ) -> Result<Self, Problem> {
        let chunks = split(&bytes, warnings)?;
        Json::replace_lone_surrogates(&mut bytes[chunks.json.clone()]);
        let root = Json::parse(&bytes[chunks.json], &Limit::new("json_values", limits.json_values))?;
        check_version(&root, warnings)?;
        check_extensions(&root, warnings)?;
        let mut source = Self {
            folder,
            limits: *limits,
            budget: Budget::new(limits),
            root,
            file: if chunks.binary.is_some() { bytes.into() } else { Arc::default() },
            binary: chunks.binary,
            buffers: Vec::new(),
        };
        source.buffers.resize_with(source.count(Kind::Buffer), OnceCell::new);
        source.warn_of_arrays(warnings);
        Ok(source)
    }

    /// The index of the scene that is drawn, if the file has scenes.
    pub(crate) fn scene(&self, warnings: &mut Warnings) -> Option<Element<'_>> {
        let default = self.root.get("scene");
        let index = default.map_or(Some(0), Json::as_index);
        let scene = index.and_then(|index| self.get(Kind::Scene, index));
        if default.is_some() && scene.is_none() {
            warnings.add("the `scene` of the file is none of its scenes, and the first one is drawn");
        }
        scene.or_else(|| self.get(Kind::Scene, 0))
    }

    /// How many elements of a kind there are.
    pub(crate) fn count(&self, kind: Kind) -> usize {
        self.array(kind).len()
    }

    /// All elements of a kind.
    pub(crate) fn all(&self, kind: Kind) -> impl Iterator<Item = Element<'_>> {
        self.array(kind).iter().enumerate().map(move |(index, json)| Element::new(json, kind, index))
    }

    /// An element; `None` beyond the end.
    pub(crate) fn get(&self, kind: Kind, index: usize) -> Option<Element<'_>> {
        self.array(kind).get(index).map(|json| Element::new(json, kind, index))
    }

    /// The element that another refers to.
    ///
    /// # Errors
    /// If there is none of that index.
    pub(crate) fn referred(&self, from: &Element<'_>, kind: Kind, index: usize) -> Result<Element<'_>, Problem> {
        self.get(kind, index).ok_or_else(|| Problem::IndexOutOfRange {
            element: from.to_string(),
            index: index as u64,
            count: self.count(kind),
            what: kind.names()[2],
        })
    }

    /// The element that a member refers to, if the member is there.
    ///
    /// # Errors
    /// If it is no index, or there is no element of that index.
    pub(crate) fn member(&self, from: &Element<'_>, member: &str, kind: Kind) -> Result<Option<Element<'_>>, Problem> {
        from.index(member)?.map(|index| self.referred(from, kind, index)).transpose()
    }

    /// The bytes of the buffer view that an element refers to.
    ///
    /// # Errors
    /// If they are not there.
    pub(crate) fn view(&self, from: &Element<'_>, index: usize) -> Result<View<'_>, Problem> {
        let element = self.referred(from, Kind::BufferView, index)?;
        let bytes = self.bytes_of(&element).map_err(|problem| {
            let is_compressed = |name: &&str| element.extension(name).is_some();
            match VIEW_COMPRESSIONS.into_iter().find(is_compressed) {
                Some(extension) if !problem.is_of_file() => {
                    Problem::Compressed { element: element.to_string(), extension }
                }
                _ => problem,
            }
        })?;
        Ok(View { element, bytes, stride: element.index("byteStride")? })
    }

    fn bytes_of(&self, view: &Element<'_>) -> Result<Bytes, Problem> {
        let buffer = self.referred(view, Kind::Buffer, view.needed_index("buffer")?)?;
        let bytes = self.buffer(&buffer)?;
        let (start, length) = (view.index("byteOffset")?.unwrap_or(0), view.needed_index("byteLength")?);
        let (end, bytes_of_buffer) = (start.saturating_add(length), bytes.range.len());
        if end > bytes_of_buffer {
            let (element, container) = (view.to_string(), buffer.to_string());
            return Err(Problem::OutOfRange { element, end: end as u128, container, bytes: bytes_of_buffer });
        }
        let range = bytes.range.start + start..bytes.range.start + end;
        Ok(Bytes { all: Arc::clone(&bytes.all), range })
    }

    fn buffer(&self, buffer: &Element<'_>) -> Result<&Bytes, Problem> {
        let cell = &self.buffers[buffer.index];
        if cell.get().is_none() {
            let read = match self.read_buffer(buffer) {
                Err(problem) if problem.is_of_file() => return Err(problem),
                read => read.map_err(|problem| problem.to_string()),
            };
            // It is empty.
            let _ = cell.set(read);
        }
        match cell.get() {
            Some(Ok(bytes)) => Ok(bytes),
            Some(Err(reason)) => Err(Problem::Unavailable { reason: reason.clone() }),
            None => Err(Problem::invalid(buffer, "is not read")),
        }
    }

    /// All bytes that are there: buffer views say which of them they have.
    fn read_buffer(&self, buffer: &Element<'_>) -> Result<Bytes, Problem> {
        match (buffer.text("uri")?, &self.binary) {
            (Some(uri), _) => {
                let all: Arc<[u8]> = read_uri(&self.folder, buffer, uri, &self.budget.buffers)?.into();
                let range = 0..all.len();
                Ok(Bytes { all, range })
            }
            (None, Some(binary)) if buffer.index == 0 => {
                Ok(Bytes { all: Arc::clone(&self.file), range: binary.clone() })
            }
            _ => Err(Problem::invalid(buffer, "has neither a URI nor a binary chunk")),
        }
    }

    fn array(&self, kind: Kind) -> &[Json] {
        self.array_json(kind).and_then(Json::as_list).unwrap_or_default()
    }

    fn array_json(&self, kind: Kind) -> Option<&Json> {
        let holder = match kind {
            Kind::Light => self.root.get("extensions")?.get("KHR_lights_punctual")?,
            _ => &self.root,
        };
        holder.get(kind.names()[0])
    }

    fn warn_of_arrays(&self, warnings: &mut Warnings) {
        let kinds = [
            Kind::Accessor,
            Kind::Animation,
            Kind::Buffer,
            Kind::BufferView,
            Kind::Camera,
            Kind::Image,
            Kind::Light,
            Kind::Material,
            Kind::Mesh,
            Kind::Node,
            Kind::Sampler,
            Kind::Scene,
            Kind::Skin,
            Kind::Texture,
        ];
        for name in kinds.map(|kind| (kind.names()[0], self.array_json(kind))) {
            if let (name, Some(Json::Null | Json::Flag(_) | Json::Number(_) | Json::Text(_) | Json::Object(_))) = name {
                warnings.add(format!("the `{name}` of the file are no list, and are ignored"));
            }
        }
    }
}

impl Bytes {
    /// All bytes of some.
    pub(crate) fn new(bytes: Vec<u8>) -> Self {
        let range = 0..bytes.len();
        Self { all: bytes.into(), range }
    }
}

impl std::ops::Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.all[self.range.clone()]
    }
}

fn check_extensions(root: &Json, warnings: &mut Warnings) -> Result<(), Problem> {
    let mut listed = |member: &str| {
        let list = root.get(member);
        let names: Vec<_> = list.and_then(Json::as_list).unwrap_or_default().iter().filter_map(Json::as_text).collect();
        if list.is_some_and(|list| list.as_list().is_none_or(|list| list.len() != names.len())) {
            warnings.add(format!("the `{member}` of the file are not all strings in a list"));
        }
        names.into_iter().filter(|name| !KNOWN_EXTENSIONS.contains(name)).map(excerpt).collect::<Vec<_>>()
    };
    if let Some(name) = listed("extensionsRequired").into_iter().next() {
        return Err(Problem::Extension { name });
    }
    for name in listed("extensionsUsed") {
        warnings.add(format!("the extension {name} is ignored"));
    }
    Ok(())
}

/// The folder of a file.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).to_owned()
}
