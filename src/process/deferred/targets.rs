//! The targets of the [deferred pipeline](super::Deferred), which an engine's processes read and write too.
//! [`GeometryFormats`](super::GeometryFormats) has the formats of the first four, and
//! [`GeometryBuffer`](super::GeometryBuffer) says what they hold.

use crate::process::Target;

/// Reversed depth of opaque objects: 0 where nothing was drawn.
pub const DEPTH: Target = Target::new("depth");

/// The world-space normal of the nearest opaque surface, which
/// [`GeometryFormats::normal_encoding_wgsl`](super::GeometryFormats::normal_encoding_wgsl) decodes.
pub const NORMAL: Target = Target::new("normal");

/// The fraction of light that the nearest opaque surface reflects, 0 to 1.
pub const DIFFUSE: Target = Target::new("diffuse");

/// What all light is added to: neither limited to 1 nor tone-mapped. It is the output of a pipeline without
/// post-processing.
pub const RADIANCE: Target = Target::new("radiance");

/// What the last step of post-processing draws: the output of a pipeline that has one.
pub const PICTURE: Target = Target::new("picture");

/// The shadow maps: one texture array, a layer for each view of
/// [`ViewKind::Shadow`](crate::scene::ViewKind::Shadow). Processes of other views read it with
/// [`Declare::samples_layers`](crate::process::Declare::samples_layers).
pub const SHADOW_MAP: Target = Target::new("shadow map");
