//! What a backend can hold of a scene.

use crate::view::{GpuLight, GpuObject};

/// What a backend can hold of a scene: the limits of its device's buffers and textures. A frame draws what is within
/// them, leaves out the rest, and counts it among its [scene issues](crate::FrameStatistics::scene_issues).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneLimits {
    /// The size of the largest buffer, in bytes: what the lights of all views can take together.
    pub buffer_bytes: u64,
    /// The most bytes of a buffer that a shader can read: all objects, a [column](crate::scene::ObjectColumn), all
    /// materials, their values of a [type](crate::scene::MaterialType), or the lights of a view. In each of them, every
    /// object, material slot or light has an element.
    pub binding_bytes: u64,
    /// The most layers of a texture: what shadow maps can take together. Lights without room for theirs are counted as
    /// [`ShadowMapLimit`](crate::view::IssueReason::ShadowMapLimit).
    pub texture_layers: u32,
}

impl SceneLimits {
    /// No limits but those of memory, and 256 layers of a texture, as most devices have.
    pub const NONE: Self = Self { buffer_bytes: u64::MAX, binding_bytes: u64::MAX, texture_layers: 256 };

    /// The maximum number of objects if shaders read columns of up to `column_stride` bytes an object. Each object also
    /// takes 64 bytes itself. Objects at higher indices are counted as
    /// [`ObjectLimit`](crate::view::IssueReason::ObjectLimit).
    pub fn max_objects(&self, column_stride: usize) -> usize {
        elements(self.binding_bytes, column_stride.max(size_of::<GpuObject>()))
    }

    /// The most lights that a view can have, each layer of shadow maps counted as another one if a light has several.
    /// Lights that come later in the scene are counted as [`LightLimit`](crate::view::IssueReason::LightLimit).
    pub fn max_lights(&self) -> usize {
        elements(self.binding_bytes, size_of::<GpuLight>())
    }
}

impl Default for SceneLimits {
    /// [`SceneLimits::NONE`].
    fn default() -> Self {
        Self::NONE
    }
}

fn elements(bytes: u64, stride: usize) -> usize {
    usize::try_from(bytes / stride as u64).unwrap_or(usize::MAX)
}
