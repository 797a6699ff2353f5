//! What a file may take.

use std::cell::Cell;
use std::fmt::Display;

use crate::error::Problem;

/// What a file may take, so that a damaged or hostile one cannot exhaust memory or take very long. What is made of a
/// file counts, and not only what is read of it: an accessor without a buffer view makes zeros of nothing, and an
/// accessor that many primitives refer to is read for each of them.
///
/// A file that exceeds a limit is refused, and the message names the limit. Images and lights that exceed theirs are
/// left out, with a warning that names it.
///
/// ```
/// use drawloom_gltf::{GltfLimits, LoadOptions};
///
/// let limits = GltfLimits { geometry_bytes: 256 << 20, ..GltfLimits::default() };
/// let options = LoadOptions { limits, ..LoadOptions::default() };
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GltfLimits {
    /// The bytes of the `.gltf` or `.glb`. Default: 2 GiB.
    pub scene_bytes: u64,
    /// The values of its JSON: numbers, strings, lists and objects. Each takes up to 100 bytes while the file is
    /// loaded. Default: 16 Mi.
    pub json_values: u64,
    /// The bytes of all buffers outside the `.glb` together. Default: 2 GiB.
    pub buffer_bytes: u64,
    /// The bytes of all vertices, indices, attributes, morph targets and inverse bind matrices. Default: 1 GiB.
    pub geometry_bytes: u64,
    /// The bytes of the zeros of accessors without a buffer view, beyond 64 for each value that a sparse accessor
    /// replaces. Default: 4 MiB.
    pub zero_bytes: u64,
    /// The bytes of the keyframes of the animation that is drawn. Default: 256 MiB.
    pub keyframe_bytes: u64,
    /// The bytes of the joints and the morph weights of all objects. Default: 24 MiB.
    pub pose_bytes: u64,
    /// The objects: one for each primitive of each node's mesh. Default: 1 Mi.
    pub objects: u64,
    /// The lights: one for each node whose light is not dark. Every pixel adds up all lights. Default: 1,024.
    pub lights: u64,
    /// The bytes of an image before it is decoded. Default: 256 MiB.
    pub texture_file_bytes: u64,
    /// The bytes that an image takes at once while it is decoded: 4 for each pixel, and as many as the file's format
    /// has where that is not RGBA of 8 bits. The decoder of a JPEG takes its file once more, and 8 bytes for each pixel
    /// if the JPEG is progressive or has a scan for each component. A PNG may have 1 MiB of metadata beyond the limit.
    /// Background jobs decode several images at once. Default: 1 GiB.
    pub texture_bytes: u64,
    /// The bytes that all images take together: those of their files, also if they cannot be decoded, and 4 for each
    /// pixel. The textures that are made of them, with mip levels, take as much again at most. Default: 1 GiB.
    pub all_textures_bytes: u64,
    /// The warnings that are listed. All are counted. Default: 100.
    pub warnings: u64,
}

impl Default for GltfLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

type Field = fn(&mut GltfLimits) -> &mut u64;

const FIELDS: [(&str, Field); 13] = [
    ("scene_bytes", |limits| &mut limits.scene_bytes),
    ("json_values", |limits| &mut limits.json_values),
    ("buffer_bytes", |limits| &mut limits.buffer_bytes),
    ("geometry_bytes", |limits| &mut limits.geometry_bytes),
    ("zero_bytes", |limits| &mut limits.zero_bytes),
    ("keyframe_bytes", |limits| &mut limits.keyframe_bytes),
    ("pose_bytes", |limits| &mut limits.pose_bytes),
    ("objects", |limits| &mut limits.objects),
    ("lights", |limits| &mut limits.lights),
    ("texture_file_bytes", |limits| &mut limits.texture_file_bytes),
    ("texture_bytes", |limits| &mut limits.texture_bytes),
    ("all_textures_bytes", |limits| &mut limits.all_textures_bytes),
    ("warnings", |limits| &mut limits.warnings),
];

impl GltfLimits {
    /// The defaults.
    pub const DEFAULT: Self = Self {
        scene_bytes: 2 << 30,
        json_values: 16 << 20,
        buffer_bytes: 2 << 30,
        geometry_bytes: 1 << 30,
        zero_bytes: 4 << 20,
        keyframe_bytes: 256 << 20,
        pose_bytes: 24 << 20,
        objects: 1 << 20,
        lights: 1 << 10,
        texture_file_bytes: 256 << 20,
        texture_bytes: 1 << 30,
        all_textures_bytes: 1 << 30,
        warnings: 100,
    };

    /// Sets the limit of a name, for command lines.
    ///
    /// # Errors
    /// If no limit has this name. The message lists those that there are.
    pub fn set(&mut self, name: &str, value: u64) -> Result<(), UnknownLimit> {
        let Some((_, field)) = FIELDS.into_iter().find(|(field, _)| *field == name) else {
            return Err(UnknownLimit { name: name.to_owned() });
        };
        *field(self) = value;
        Ok(())
    }
}

/// No limit has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} is none of {}", FIELDS.map(|(field, _)| field).join(", "))]
#[non_exhaustive]
pub struct UnknownLimit {
    /// The name that was given.
    pub name: String,
}

/// One of the limits, and what is taken of it.
#[derive(Debug)]
pub(crate) struct Limit {
    /// Its field in [`GltfLimits`].
    field: &'static str,
    greatest: u64,
    taken: Cell<u64>,
}

impl Limit {
    pub(crate) fn new(field: &'static str, greatest: u64) -> Self {
        Self { field, greatest, taken: Cell::new(0) }
    }

    /// What is left of it.
    pub(crate) fn left(&self) -> u64 {
        self.greatest - self.taken.get()
    }

    /// Takes `count` times `size` for an element.
    ///
    /// # Errors
    /// If that is more than is left. Nothing is taken then.
    pub(crate) fn take(&self, element: impl Display, count: u64, size: u64) -> Result<(), Problem> {
        let amount = count.saturating_mul(size);
        if amount <= self.left() {
            self.taken.set(self.taken.get() + amount);
            return Ok(());
        }
        let (element, taken) = (element.to_string(), self.taken.get());
        Err(Problem::OverLimit { element, amount, taken, field: self.field, limit: self.greatest })
    }
}

/// The limits that elements of a file share.
#[derive(Debug)]
pub(crate) struct Budget {
    pub(crate) buffers: Limit,
    pub(crate) geometry: Limit,
    pub(crate) zeros: Limit,
    pub(crate) keyframes: Limit,
    pub(crate) poses: Limit,
    pub(crate) objects: Limit,
}

impl Budget {
    pub(crate) fn new(limits: &GltfLimits) -> Self {
        Self {
            buffers: Limit::new("buffer_bytes", limits.buffer_bytes),
            geometry: Limit::new("geometry_bytes", limits.geometry_bytes),
            zeros: Limit::new("zero_bytes", limits.zero_bytes),
            keyframes: Limit::new("keyframe_bytes", limits.keyframe_bytes),
            poses: Limit::new("pose_bytes", limits.pose_bytes),
            objects: Limit::new("objects", limits.objects),
        }
    }
}
