//! Resources of the engine's own that shaders read.

use std::borrow::Cow;
use std::sync::Arc;

/// Something of the engine's own that a process's shader reads, at `@group(3)`: after the
/// [columns](super::Declare::reads_column) and [materials](super::Declare::reads_materials) that the process reads,
/// each has the next binding. The first of them is `FIRST_RESOURCE` in WGSL, so that text which several processes have
/// finds its resources in all of them: `@group(3) @binding(FIRST_RESOURCE + 1)`.
///
/// Handles are of the renderer's device. wgpu recognises those of another device, unless it belongs to another
/// `wgpu::Instance`.
///
/// Bytes and buffers take a storage buffer each, and a device with only
/// [`WgpuBackend::REQUIRED_LIMITS`](crate::backend::WgpuBackend::REQUIRED_LIMITS) has none left for them.
///
/// The bind group is made by the crate, and made anew only when a resource is another one. A CPU shader does not get
/// these: it brings its own, since [`RenderProcess::cpu_shader`](super::RenderProcess) is called once a frame.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ShaderResource<'a> {
    /// Bytes that the CPU writes, such as skinning palettes: `var<storage, read>`. They are copied when the frame is
    /// recorded; the blocks of 1 KiB that changed are uploaded. There are 4 or more, in multiples of 4.
    Bytes(Cow<'a, [u8]>),
    /// The same for several processes: uploaded once for all that have this `Arc`.
    SharedBytes(Arc<[u8]>),
    /// A buffer with the usage `STORAGE`: `var<storage, read>`.
    #[cfg(feature = "wgpu")]
    Buffer(wgpu::Buffer),
    /// A texture with the usage `TEXTURE_BINDING`. Write all of it before the first frame that reads it is recorded, or
    /// write it only by copies from buffers. Otherwise `Queue::write_texture` can deadlock with a submission on another
    /// thread, such as that of a [`FrameLoop`](crate::FrameLoop) (wgpu issue 9460, up to 30.0.2).
    #[cfg(feature = "wgpu")]
    Texture {
        /// The view of it.
        view: wgpu::TextureView,
        /// The dimension that the view was made with: `D2` for `texture_2d`.
        dimension: wgpu::TextureViewDimension,
    },
    /// Another texture in each view. What is said of [`Texture`](Self::Texture) holds for each.
    #[cfg(feature = "wgpu")]
    TextureOfView {
        /// The textures of views, by name. All have the format of `other`, or one that shaders read as the same kind of
        /// number.
        views: Arc<[(String, wgpu::TextureView)]>,
        /// The texture of all other views.
        other: wgpu::TextureView,
        /// The dimension that all of them were made with.
        dimension: wgpu::TextureViewDimension,
    },
    /// A sampler.
    #[cfg(feature = "wgpu")]
    Sampler {
        /// The sampler.
        sampler: wgpu::Sampler,
        /// How it samples: `Filtering` for `sampler`, `Comparison` for `sampler_comparison`.
        kind: wgpu::SamplerBindingType,
    },
}

impl<'a> ShaderResource<'a> {
    /// The bytes of a slice, which the frame copies.
    pub fn bytes_of<T: bytemuck::NoUninit>(values: &'a [T]) -> Self {
        Self::Bytes(Cow::Borrowed(bytemuck::cast_slice(values)))
    }

    /// The bytes that the CPU writes; `None` for resources of the device.
    pub(crate) fn bytes(&self) -> Option<&[u8]> {
        match self {
            Self::Bytes(bytes) => Some(bytes),
            Self::SharedBytes(bytes) => Some(bytes),
            #[cfg(feature = "wgpu")]
            _ => None,
        }
    }
}
