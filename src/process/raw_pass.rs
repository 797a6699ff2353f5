//! Passes that an engine encodes itself.

use std::error::Error;

use crate::scene::ViewKind;

/// A pass that gets the encoder: compute, copies and viewports do not fit into a bundle.
///
/// It is called on a worker, once a frame for each view of its process.
pub trait RawPass: Send + Sync {
    /// Encodes the pass.
    ///
    /// # Errors
    /// Whatever the engine finds wrong; the frame fails and names the process.
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>>;
}

/// What a raw pass can use.
pub struct RawPassResources<'a> {
    /// The device.
    pub device: &'a wgpu::Device,
    /// The view's index among the frame's views.
    pub view: usize,
    /// Width and height of the view's picture, in pixels.
    pub size: [u32; 2],
    pub(crate) textures: &'a dyn Fn(&str) -> Option<&'a wgpu::Texture>,
    pub(crate) layered: &'a dyn Fn(ViewKind, &str) -> Option<&'a wgpu::Texture>,
}

impl RawPassResources<'_> {
    /// The view's target of this name; `None` where no process declares one.
    pub fn target(&self, name: &str) -> Option<&wgpu::Texture> {
        (self.textures)(name)
    }

    /// The texture array that all views of a kind share under this name; `None` where no process declares one.
    pub fn layered_target(&self, views: ViewKind, name: &str) -> Option<&wgpu::Texture> {
        (self.layered)(views, name)
    }
}
