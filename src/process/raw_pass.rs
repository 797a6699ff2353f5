//! Passes that an engine encodes itself.

use std::error::Error;

use crate::scene::ViewKind;

/// A pass that gets the command encoder, because compute, copies and viewports cannot be recorded into a bundle.
///
/// It is called on a worker, once per frame and view of its process's kind.
pub trait RawPass: Send + Sync {
    /// Encodes the pass.
    ///
    /// # Errors
    /// Any error of the engine: the frame fails with an error that names the process.
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>>;
}

/// The resources of a raw pass.
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
    /// The view's target of this name; `None` if no process declares it.
    pub fn target(&self, name: &str) -> Option<&wgpu::Texture> {
        (self.textures)(name)
    }

    /// The texture array of this name that all views of a kind share; `None` if no process declares it.
    pub fn layered_target(&self, views: ViewKind, name: &str) -> Option<&wgpu::Texture> {
        (self.layered)(views, name)
    }
}
