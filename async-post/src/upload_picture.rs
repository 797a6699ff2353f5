//! Uploads of results to the device of a backend.

#[cfg(feature = "software")]
use drawloom::backend::SoftwareBackend;
#[cfg(feature = "wgpu")]
use drawloom::backend::WgpuBackend;
use drawloom::backend::{BackendError, NullBackend, Picture};
use drawloom::process::ShaderResource;

/// A backend to whose device results are uploaded. An engine implements it for backends of its own: one that wraps
/// another passes the call on.
pub trait UploadPicture: Send + Sync + 'static {
    /// A texture with the pixels of a picture, for shaders to sample. Called on any thread, at any time. `None` from a
    /// backend whose shaders read no resources.
    ///
    /// # Errors
    /// If the device refuses it.
    fn upload_picture(&self, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError>;
}

#[cfg(feature = "wgpu")]
impl UploadPicture for WgpuBackend {
    fn upload_picture(&self, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
        WgpuBackend::upload_picture(self, picture).map(Some)
    }
}

/// CPU shaders read results where they are.
#[cfg(feature = "software")]
impl UploadPicture for SoftwareBackend {
    fn upload_picture(&self, _picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
        Ok(None)
    }
}

impl UploadPicture for NullBackend {
    fn upload_picture(&self, _picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
        Ok(None)
    }
}
