//! What streaming may take.

use std::time::Duration;

use crate::backend::BackendError;

/// What streaming may take: memory of the device, and a part of each frame. `u64::MAX` and `Duration::MAX` are no
/// limit. See [`WgpuBackend::stream_resources`](crate::backend::WgpuBackend::stream_resources).
///
/// ```
/// use std::time::Duration;
///
/// use drawloom::backend::StreamingBudget;
///
/// // 64 MiB for a world of gigabytes.
/// let budget = StreamingBudget {
///     mesh_bytes: 32 << 20,
///     texture_bytes: 32 << 20,
///     upload_bytes_per_frame: 1 << 20,
///     upload_time_per_frame: Duration::from_millis(2),
/// };
/// assert!(budget.check().is_ok());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamingBudget {
    /// The device's memory for meshes, in bytes: that of whole pages, of which each takes up to a sixteenth of the
    /// budget, and 4 MiB at most, unless a mesh is larger.
    pub mesh_bytes: u64,
    /// The device's memory for textures, in bytes: that of whole texture arrays, of which each has textures of one
    /// [class](crate::scene::TextureClass). While an array moves to a larger one, both are there.
    pub texture_bytes: u64,
    /// The most bytes that are uploaded from one frame to the next, or a row of a texture, if that takes more. Larger
    /// meshes and textures take several frames. The same number more may be uploaded by the frame itself, for meshes
    /// that replace others on the device and are no larger.
    pub upload_bytes_per_frame: u64,
    /// A background job that uploads ends after this time, once it has done what it began: a portion of 256 KiB at
    /// most, or the mip levels of one texture.
    pub upload_time_per_frame: Duration,
}

impl StreamingBudget {
    /// The smallest budget of each kind in bytes.
    pub const MIN_BYTES: u64 = 1 << 20;
    /// The smallest number of bytes a frame: a few rows of a usual texture.
    pub const MIN_UPLOAD_BYTES: u64 = 1 << 16;

    /// Checks the numbers.
    ///
    /// # Errors
    /// Names the number that is too small.
    pub fn check(&self) -> Result<(), BackendError> {
        let Self { mesh_bytes, texture_bytes, upload_bytes_per_frame, upload_time_per_frame } = *self;
        let sizes = [
            ("mesh_bytes", mesh_bytes, Self::MIN_BYTES),
            ("texture_bytes", texture_bytes, Self::MIN_BYTES),
            ("upload_bytes_per_frame", upload_bytes_per_frame, Self::MIN_UPLOAD_BYTES),
            ("upload_time_per_frame", upload_time_per_frame.as_nanos().try_into().unwrap_or(u64::MAX), 1),
        ];
        match sizes.into_iter().find(|(_, value, least)| value < least) {
            Some((field, value, least)) => Err(BackendError::InvalidStreamingBudget { field, value, least }),
            None => Ok(()),
        }
    }
}

impl Default for StreamingBudget {
    /// 256 MiB for meshes and as much for textures; 4 MiB and 2 ms a frame.
    fn default() -> Self {
        Self {
            mesh_bytes: 256 << 20,
            texture_bytes: 256 << 20,
            upload_bytes_per_frame: 4 << 20,
            upload_time_per_frame: Duration::from_millis(2),
        }
    }
}
