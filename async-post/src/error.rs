//! Why there is no result.

use drawloom::backend::{BackendError, Picture};
use drawloom::fence::FenceError;
use drawloom::process::Format;

/// Why there is no result of a frame in one view. The frames after it are computed as usual.
#[derive(Debug, thiserror::Error)]
#[error("the step {step:?} has no result of frame {frame} in view {view:?}: {reason}")]
pub struct AsyncPostError {
    /// The step.
    pub step: String,
    /// The view; empty if the error is of all views.
    pub view: String,
    /// The number of the frame.
    pub frame: u64,
    /// What is wrong.
    #[source]
    pub reason: AsyncPostErrorReason,
}

/// What is wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AsyncPostErrorReason {
    /// The backend cannot read the source back, cannot upload the result, or its device is lost.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// The device did not finish the frame.
    #[error(transparent)]
    Fence(#[from] FenceError),
    /// The step panicked.
    #[error("it panicked: {message}")]
    Panicked {
        /// What the panic said.
        message: String,
    },
    /// The frame that is read back is of another renderer than [`begin_frame`](crate::AsyncPost::begin_frame) was
    /// called with, or its backend was replaced between.
    #[error("the frame is of another renderer than `begin_frame` was called with, or its backend was replaced since")]
    ForeignFrame,
    /// The step's picture has a format that cannot be filtered.
    #[error("its picture has the format {format:?}, which cannot be filtered")]
    NotFilterable {
        /// The format of a pixel.
        format: Format,
    },
    /// The step's picture has other bytes than its size and format say, or none.
    #[error("its picture of {width}x{height} pixels of the format {format:?} has {bytes} bytes")]
    InvalidPicture {
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
        /// The format of a pixel.
        format: Format,
        /// The number of bytes.
        bytes: usize,
    },
}

impl AsyncPostErrorReason {
    /// # Errors
    /// If a step's picture is not whole, or its format cannot be filtered.
    pub(crate) fn check(picture: &Picture) -> Result<(), Self> {
        let Picture { width, height, format, ref bytes } = *picture;
        if !format.is_filterable() {
            return Err(Self::NotFilterable { format });
        }
        if picture.is_whole() {
            return Ok(());
        }
        Err(Self::InvalidPicture { width, height, format, bytes: bytes.len() })
    }
}
