//! Errors of backends.

use std::time::Duration;

use crate::process::AccessError;

/// An error of a backend or its device.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BackendError {
    /// The device lacks a feature; see the backend's constants for all required ones.
    #[error("the device lacks {missing}, which Drawloom needs")]
    MissingFeature {
        /// The missing features.
        missing: String,
    },
    /// A limit of the device is too low; see the backend's constants for all required ones.
    #[error("device limit {limit} is {allowed}; Drawloom needs {needed}")]
    Limit {
        /// The limit's name.
        limit: &'static str,
        /// What the device allows.
        allowed: u64,
        /// What Drawloom needs.
        needed: u64,
    },
    /// More views have a layer of one texture than the device's textures can have layers: the scene has as many cameras
    /// of one kind. Shadow maps of lights are never too many.
    #[error(
        "{views} views each have a layer of the target {target:?}, and device limit max_texture_array_layers is {allowed}"
    )]
    TooManyLayers {
        /// The target.
        target: String,
        /// The views that share it.
        views: u64,
        /// The layers that the device allows.
        allowed: u64,
    },
    /// A target is larger than the backend's textures can be: of a view with a picture that is too large, or with a
    /// size of its own.
    #[error(
        "the target {target:?} has {width} x {height} pixels, and the largest width and height of a texture is {allowed}"
    )]
    TargetTooLarge {
        /// The target.
        target: String,
        /// Its width in pixels.
        width: u32,
        /// Its height in pixels.
        height: u32,
        /// The largest width and height: the device limit `max_texture_dimension_2d`, or that of the software backend.
        allowed: u32,
    },
    /// A process has more bindings of a kind than a shader may have on the device: those of Drawloom's own, see the
    /// [limits](crate::guide::limits), the targets and buffers that it declares, and its resources.
    #[error(
        "the {stage} shader of {process:?} has {needed} bindings of the kind that device limit {limit} counts, which is \
         {allowed}: {shares}"
    )]
    BindingLimit {
        /// The process.
        process: String,
        /// Which shader: "vertex", "fragment" or "compute".
        stage: &'static str,
        /// How many there are.
        needed: u64,
        /// Who has how many of them.
        shares: String,
        /// The limit's name.
        limit: &'static str,
        /// What the device allows.
        allowed: u64,
    },
    /// A process's WGSL does not compile.
    #[error("the {part} of {process:?} is wrong in line {line}, column {column}: {message}\n  {text}")]
    Shader {
        /// The process.
        process: String,
        /// Which of the process's own texts it is: "shader" or "deformation".
        part: &'static str,
        /// The line of that text, from 1.
        line: usize,
        /// The column in that line, from 1.
        column: usize,
        /// What is wrong.
        message: String,
        /// The line.
        text: String,
    },
    /// The device refused a pass: an error in a render process's shader, targets or parameters.
    #[error("the device refused {label}: {message}")]
    Validation {
        /// The pass or resource.
        label: String,
        /// The device's message.
        message: String,
    },
    /// The device is out of memory.
    #[error("the device is out of memory for {label}")]
    OutOfMemory {
        /// The pass or resource that needed memory.
        label: String,
    },
    /// The device was lost, with everything on it: see [`Renderer::replace_backend`](crate::Renderer::replace_backend).
    /// Every later frame on it has this error.
    #[error("the device was lost: {message}")]
    DeviceLost {
        /// The device's message.
        message: String,
    },
    /// The device is not done in time. It may be later.
    #[error("the device was not done within {timeout:?}")]
    Timeout {
        /// How long it was waited for.
        timeout: Duration,
    },
    /// The view's camera is too far from the world's origin, or its position is not finite.
    #[error(
        "view {view:?} is out of reach: its camera is more than 2^32 m from the origin, or its position is not finite"
    )]
    ViewOutOfReach {
        /// The view's name.
        view: String,
    },
    /// A render process has WGSL but no CPU shader, which the software backend runs instead.
    #[error("process {process:?} has no CPU shader, so the software backend cannot draw it")]
    NoCpuShader {
        /// The render process's name.
        process: String,
    },
    /// A mesh [in the engine's own buffers](crate::scene::Mesh::from_buffers) has an attribute in a format that shaders
    /// read as another kind of number. The process leaves its objects out, and warns with this error.
    #[error(
        "process {process:?} reads {attribute:?} as {expected}, but mesh `{mesh}`, or one with the same layout, has it as {format}"
    )]
    AttributeFormatMismatch {
        /// The process.
        process: String,
        /// The mesh, or another one with the same layout.
        mesh: String,
        /// The attribute.
        attribute: String,
        /// Its format in the mesh.
        format: String,
        /// The type of number in the shader.
        expected: &'static str,
    },
    /// A mesh [in the engine's own buffers](crate::scene::Mesh::from_buffers) does not have the
    /// [index](crate::scene::VERTEX_INDEX) of its vertices. The process leaves its objects out, and warns with this
    /// error.
    #[error(
        "process {process:?} reads the index of vertices, which mesh `{mesh}`, or one with the same layout, does not have"
    )]
    MissingVertexIndex {
        /// The process.
        process: String,
        /// The mesh, or another one with the same layout.
        mesh: String,
    },
    /// A mesh [in wgpu buffers](crate::scene::Mesh), whose triangles the software backend cannot see: objects with it
    /// are left out.
    #[error("mesh `{mesh}` is in wgpu buffers, which the software backend cannot draw")]
    ImportedMesh {
        /// The mesh.
        mesh: String,
    },
    /// A render process draws into multisampled targets, and the software backend has none.
    #[error("process {process:?} draws into multisampled targets, which the software backend does not support")]
    Multisampling {
        /// The render process's name.
        process: String,
    },
    /// The CPU shader of a render process panicked.
    #[error("the CPU shader of process {process:?} panicked: {message}")]
    CpuShaderPanicked {
        /// The render process's name.
        process: String,
        /// The panic's message.
        message: String,
    },
    /// A raw pass reported an error.
    #[error("the raw pass failed: {0}")]
    RawPass(#[source] Box<dyn std::error::Error + Send + Sync>),
    /// The engine's code that records items reported an error.
    #[error("items {first}..{end} of the {count} that the view sees, in draw order, cannot be recorded: {source}")]
    Items {
        /// The first of them, by its index among those that the view sees.
        first: usize,
        /// The end of the range.
        end: usize,
        /// The number of items that the view sees.
        count: usize,
        /// The error.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The engine's code that records items panicked.
    #[error("recording items {first}..{end} of the {count} that the view sees, in draw order, panicked: {message}")]
    ItemsPanicked {
        /// The first of them, by its index among those that the view sees.
        first: usize,
        /// The end of the range.
        end: usize,
        /// The number of items that the view sees.
        count: usize,
        /// The panic's message.
        message: String,
    },
    /// Items have the versions that they had in an earlier frame, but are recorded to other commands. Only builds with
    /// debug assertions look for that.
    #[error(
        "items {first}..{end} of the {count} that the view sees, in draw order, are recorded to other commands than in an earlier frame with the same versions"
    )]
    ItemVersions {
        /// The first of them, by its index among those that the view sees.
        first: usize,
        /// The end of the range.
        end: usize,
        /// The number of items that the view sees.
        count: usize,
    },
    /// A raw pass asked for a resource that it may not use.
    #[error(transparent)]
    Access(AccessError),
    /// The view has no target of the requested name.
    #[error("view {view} has no target {target:?}, only: {known}")]
    UnknownTarget {
        /// The view's index.
        view: usize,
        /// The requested name.
        target: String,
        /// The targets that it has.
        known: String,
    },
    /// The target shared its texture with others, so what it held is gone: see
    /// [`WgpuBackend::transient_targets`](super::WgpuBackend::transient_targets).
    #[error(
        "target {target:?} of view {view} is transient, so it cannot be read back: name it as an output of the renderer to keep it"
    )]
    TransientTarget {
        /// The view's index.
        view: usize,
        /// The name of the target.
        target: String,
    },
    /// A texture cannot be [imported](super::WgpuBackend::import_target) as a view's target.
    #[error("cannot import a texture as target {target:?} of view {view:?}: {problem}")]
    InvalidImport {
        /// The view's name.
        view: String,
        /// The name of the target.
        target: String,
        /// What is wrong.
        problem: String,
    },
    /// A rectangle that cannot be read back.
    #[error(
        "a rectangle of {}x{} pixels at {origin:?} cannot be read back from target {target:?} of view {view}, which has {}x{} pixels: {problem}",
        size[0], size[1], whole[0], whole[1]
    )]
    InvalidReadBack {
        /// The view's index.
        view: usize,
        /// The name of the target.
        target: String,
        /// The rectangle's upper left pixel.
        origin: [u32; 2],
        /// The rectangle's width and height.
        size: [u32; 2],
        /// The target's width and height.
        whole: [u32; 2],
        /// What is wrong.
        problem: &'static str,
    },
    /// What is read back belongs to a frame that is not submitted, or was dropped.
    #[error("the frame whose pixels are read back was not submitted")]
    NotSubmitted,
    /// A target is to be read back from a backend that cannot.
    #[error("the backend cannot read targets back")]
    CannotReadBack,
    /// A picture has other pixels than its size and format say, or a format that is not uploaded.
    #[error("a picture of {width}x{height} pixels of the format {format:?} with {bytes} bytes cannot be uploaded")]
    InvalidPicture {
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
        /// The format of a pixel.
        format: crate::process::Format,
        /// The number of bytes.
        bytes: usize,
    },
    /// Pass times were requested from a backend that does not time passes.
    #[error("passes are not timed: see `WgpuBackend::time_passes`")]
    NotTimed,
    /// A number of a [`StreamingBudget`](super::StreamingBudget) that is too small.
    #[cfg(feature = "wgpu")]
    #[error("a streaming budget with {field} = {value} is too small: it has to be at least {least}")]
    InvalidStreamingBudget {
        /// The field.
        field: &'static str,
        /// Its value, in bytes or nanoseconds.
        value: u64,
        /// The least possible one.
        least: u64,
    },
    /// A method of the backend panicked. Where the program is built with `panic = "abort"` the program ends instead.
    #[error("the backend's {call} panicked: {message}")]
    Panicked {
        /// The name of the method.
        call: &'static str,
        /// What the panic said.
        message: String,
    },
    /// Drawloom broke a rule between frame and backend. This is a bug in Drawloom.
    #[error("broken rule: {rule}")]
    BrokenRule {
        /// The rule that must hold.
        rule: String,
    },
}

#[cfg(any(feature = "wgpu", feature = "software"))]
impl BackendError {
    /// That a view has no target of this name, but those that are `known`.
    pub(crate) fn unknown_target<'a>(view: usize, target: &str, known: impl Iterator<Item = &'a str>) -> Self {
        Self::UnknownTarget { view, target: target.to_owned(), known: crate::process::list_names(known) }
    }
}

/// The error for a broken rule between frame and backend. `rule` states what must hold.
#[cfg(any(feature = "wgpu", feature = "software"))]
pub(crate) fn broken_rule(rule: &str) -> BackendError {
    BackendError::BrokenRule { rule: rule.to_owned() }
}
