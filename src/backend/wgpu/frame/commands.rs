//! The recorded commands of a pass.

/// A part of a pass, recorded before the pass is finished.
pub struct WgpuPart(pub(crate) RecordedPart);

pub(crate) enum RecordedPart {
    Bundle(wgpu::RenderBundle),
    /// One of several encoders.
    Encoder(wgpu::CommandBuffer),
}

/// The commands of a pass, ready to be submitted.
pub struct WgpuCommands(pub(crate) PassCommands);

pub(crate) enum PassCommands {
    Finished(wgpu::CommandBuffer),
    /// In the encoder of an earlier pass of the frame.
    InEarlierPass,
    /// From several encoders, in submission order.
    Parts(Vec<WgpuPart>),
    /// To be finished on the device thread.
    Open(wgpu::CommandEncoder),
}
