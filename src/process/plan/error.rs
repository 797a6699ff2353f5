//! Errors in a frame's processes and how they fit together.

use std::borrow::Cow;

use crate::graph::GraphProblem;
use crate::process::{Format, TargetSize};

/// Why no frame can be made of these processes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// What the processes read and write cannot be ordered.
    #[error(transparent)]
    Graph(#[from] GraphProblem),
    /// A process uses a target that no process writes.
    #[error("no process writes target {target:?}, used by {processes}; processes write only: {known}")]
    UnknownTarget {
        /// The target, with the kind of its views unless they are main views.
        target: String,
        /// The processes that use it.
        processes: String,
        /// The targets that processes write.
        known: String,
    },
    /// No process writes an output of the frame.
    #[error("no process writes the output {target:?}; processes write only: {known}")]
    UnknownOutput {
        /// The output.
        target: String,
        /// The targets that processes write.
        known: String,
    },
    /// A process is declared to come after or before one that the graph does not have.
    #[error("process {process:?} is to come after or before {other:?}, which the plan does not have")]
    UnknownProcess {
        /// The process.
        process: String,
        /// The missing process.
        other: String,
    },
    /// Two processes create a target in different formats.
    #[error("target {target:?} is both {first:?} and {second:?}")]
    ConflictingFormats {
        /// The target.
        target: String,
        /// One format.
        first: Format,
        /// The other.
        second: Format,
    },
    /// Two processes create a target in different sizes.
    #[error("target {target:?} has the sizes {first:?} and {second:?}")]
    ConflictingSizes {
        /// The target.
        target: String,
        /// One size.
        first: TargetSize,
        /// The other.
        second: TargetSize,
    },
    /// A process sets the size of a target that has none of its own.
    #[error("process {process:?} sets the size of target {target:?}, {problem}")]
    InvalidSize {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// What is wrong.
        problem: Cow<'static, str>,
    },
    /// A process draws into targets of different sizes at once, or tests depth of another size.
    #[error("process {process:?} uses targets {:?} and {:?}, which differ in size, in one pass", targets[0], targets[1])]
    UnequalSizes {
        /// The process.
        process: String,
        /// Two targets.
        targets: [String; 2],
    },
    /// A process uses a target of another that draws once a frame, and so in one of its views only.
    #[error("process {process:?} draws target {target:?} once a frame, but process {other:?} uses that of each view")]
    OnceAFrame {
        /// The process that draws once a frame.
        process: String,
        /// The process that draws in each view.
        other: String,
        /// The target.
        target: String,
    },
    /// A process reads the history of a target that no process of its views writes, or that is drawn in layers.
    #[error(
        "process {process:?} reads {target:?}, but the targets that the same views have, one for each view, are only: {known}"
    )]
    NoHistory {
        /// The process.
        process: String,
        /// What it reads.
        target: String,
        /// The targets that have a history.
        known: String,
    },
    /// A process samples a target of several views as layers of one texture, which it cannot be.
    #[error(
        "process {process:?} cannot sample target {target:?} of the views {view:?} as layers of one texture: {problem}"
    )]
    SampledLayers {
        /// The process.
        process: String,
        /// What the names of the views begin with.
        view: String,
        /// The target.
        target: String,
        /// What is wrong.
        problem: &'static str,
    },
    /// A target is used as depth with a format that holds colour, or the other way round.
    #[error("process {process:?} uses target {target:?} in a way that its format {format:?} does not allow")]
    WrongFormat {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// Its format.
        format: Format,
    },
    /// A target is drawn as a layer of a texture array by one process, and used as a texture of its own by another.
    #[error(
        "process {process:?} and another disagree whether target {target:?} is one for all views, in layers, or one for each view"
    )]
    LayeringMismatch {
        /// The process.
        process: String,
        /// The target.
        target: String,
    },
    /// A process has more than one depth target.
    #[error("process {process:?} has more than one depth target")]
    MultipleDepthTargets {
        /// The process.
        process: String,
    },
    /// A process clears depth to a value that is not from 0 to 1, or clears none.
    #[error("process {process:?} cannot clear depth to {value}: {problem}")]
    DepthClearValue {
        /// The process.
        process: String,
        /// The value.
        value: String,
        /// What is wrong.
        problem: &'static str,
    },
    /// A target that cannot be multisampled is declared so, or is used as no multisampled target can be.
    #[error("process {process:?} cannot use target {target:?} as a multisampled one: {problem}")]
    Multisampling {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// What is wrong.
        problem: Cow<'static, str>,
    },
    /// A target that cannot have [mip levels](crate::process::Declare::mipmapped) is declared to have them, or
    /// processes disagree whether it has them.
    #[error("process {process:?} declares the mip levels of target {target:?} wrongly: {problem}")]
    MipLevels {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// What is wrong.
        problem: Cow<'static, str>,
    },
    /// A process draws into, or tests, targets with different numbers of samples.
    #[error("process {process:?} uses targets {:?} and {:?} in one pass, but only one of them is multisampled", targets[0], targets[1])]
    UnequalSamples {
        /// The process.
        process: String,
        /// The targets.
        targets: [String; 2],
    },
    /// A resolve that no pass can do.
    #[error("process {process:?} cannot resolve target {target:?}: {problem}")]
    Resolve {
        /// The process.
        process: String,
        /// The target that it resolves.
        target: String,
        /// What is wrong.
        problem: Cow<'static, str>,
    },
    /// Two processes read material types of one name with values of different sizes.
    #[error(
        "process {process:?} reads {second} bytes of the material type {material_type:?} for each material, another process {first}"
    )]
    ConflictingMaterialTypes {
        /// The second process.
        process: String,
        /// The material type.
        material_type: &'static str,
        /// The size of the values that the first process reads, in bytes.
        first: usize,
        /// The same of the second process.
        second: usize,
    },
    /// Two processes read columns of one name with elements of different sizes.
    #[error(
        "process {process:?} reads {second} bytes of the column {column:?} for each object, another process {first}"
    )]
    ConflictingColumns {
        /// The second process.
        process: String,
        /// The column.
        column: &'static str,
        /// The size of an element of the first process's column, in bytes.
        first: usize,
        /// The same of the second process's column.
        second: usize,
    },
    /// Two processes read an attribute of one name in different formats, or with different defaults.
    #[error("process {process:?} and another disagree about the format or the default of the attribute {attribute:?}")]
    ConflictingAttributes {
        /// The second process.
        process: String,
        /// The attribute.
        attribute: &'static str,
    },
    /// Two processes use buffers of one name with different sizes.
    #[error("process {process:?} uses the buffer {buffer:?} with {second} bytes, another process with {first}")]
    ConflictingBuffers {
        /// The second process.
        process: String,
        /// The buffer.
        buffer: &'static str,
        /// The size of the first process's buffer, in bytes.
        first: u64,
        /// The same of the second process's buffer.
        second: u64,
    },
    /// A process changes a buffer that it also reads or takes arguments from.
    #[error("process {process:?} changes the buffer {buffer:?}, and cannot use it in another way too")]
    BufferInUse {
        /// The process.
        process: String,
        /// The buffer.
        buffer: &'static str,
    },
    /// A process samples a target of another view that no process writes in any view.
    #[error("process {process:?} samples {target:?} of the view {view:?}, but processes write only: {known}")]
    UnknownSampledTarget {
        /// The process.
        process: String,
        /// The view.
        view: String,
        /// The target.
        target: String,
        /// The targets that processes write in views of that kind.
        known: String,
    },
    /// The settings of the shadow maps are invalid.
    #[error("invalid shadow map settings: {problem}")]
    ShadowMaps {
        /// What is wrong with them.
        problem: &'static str,
    },
    /// A process is to be replaced, left out or kept that the pipeline never has.
    #[error("there is no process {name:?} to replace, leave out or keep, only: {known}")]
    NoSuchProcess {
        /// The name.
        name: String,
        /// Those that there may be.
        known: String,
    },
    /// A renderer has no process or output to remove or switch that the engine added by this name.
    #[error("the engine has added no {what} {name:?}, only: {known}")]
    NotAdded {
        /// `process` or `output`.
        what: &'static str,
        /// The name.
        name: String,
        /// Those that it has added.
        known: String,
    },
    /// A call of the [pipeline](crate::process::Pipeline) panicked, or of what is in it: of the deferred one's steps,
    /// deformations and replacements.
    #[error("the pipeline's `{call}` panicked: {message}")]
    PipelinePanicked {
        /// The method.
        call: &'static str,
        /// The message of the panic.
        message: String,
    },
    /// A process panicked in `declare` or `draws`.
    #[error("process {process:?} panicked in `declare` or `draws`: {message}")]
    ProcessPanicked {
        /// The process.
        process: String,
        /// What the panic said.
        message: String,
    },
    /// The scene has no such column.
    #[error("process {process:?} reads the column {column:?}, which the scene does not have")]
    MissingColumn {
        /// The process.
        process: String,
        /// The column.
        column: &'static str,
    },
    /// The values of the scene's materials of a type have another size than those that the process declares or selects.
    #[error(
        "process {process:?} knows the material type {material_type:?} with {declared} bytes for each material, but the scene has {found}"
    )]
    MaterialTypeSize {
        /// The process.
        process: String,
        /// The material type.
        material_type: &'static str,
        /// The size that the process knows, in bytes.
        declared: usize,
        /// The size of the scene's, in bytes.
        found: usize,
    },
    /// The elements of the scene's column have another size than those that the process declares.
    #[error(
        "process {process:?} reads {declared} bytes of the column {column:?} for each object, but the scene has {found}"
    )]
    ColumnSize {
        /// The process.
        process: String,
        /// The column.
        column: &'static str,
        /// The size of an element that the process declares, in bytes.
        declared: usize,
        /// The size of an element of the scene, in bytes.
        found: usize,
    },
    /// What a process draws is to be blended with a target whose format cannot be blended.
    #[error("process {process:?} blends with target {target:?}, whose format {format:?} cannot be blended")]
    CannotBlend {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// Its format.
        format: Format,
    },
    /// A process has blend equations for another number of colour targets than it draws into.
    #[error("process {process:?} has {equations} blend equations for {targets} colour targets")]
    BlendEquationCount {
        /// The process.
        process: String,
        /// The number of equations.
        equations: usize,
        /// The number of colour targets.
        targets: usize,
    },
    /// A process moves depth by a slope or up to a bound that is not finite.
    #[error("the depth bias of process {process:?} is not finite")]
    DepthBias {
        /// The process.
        process: String,
    },
    /// A process has masks for another number of colour targets than it draws into.
    #[error("process {process:?} has {masks} colour masks for {targets} colour targets")]
    ColorMaskCount {
        /// The process.
        process: String,
        /// The number of masks.
        masks: usize,
        /// The number of colour targets.
        targets: usize,
    },
    /// A [resource](crate::process::ShaderResource::Bytes) of a size that no storage buffer can have.
    #[error("resource {resource} of process {process:?} has {bytes} bytes, instead of 4, 8, 12 ...")]
    ResourceSize {
        /// The process.
        process: String,
        /// The index of the resource.
        resource: usize,
        /// Its size.
        bytes: usize,
    },
    /// The arguments of an indirect draw or dispatch are not where the process may read them.
    #[error("process {process:?} takes its arguments from the buffer {buffer:?}, {problem}")]
    Arguments {
        /// The process.
        process: String,
        /// The buffer.
        buffer: &'static str,
        /// What is wrong.
        problem: &'static str,
    },
    /// A process uses a stencil that it does not have.
    #[error("process {process:?} uses a stencil, {problem}")]
    Stencil {
        /// The process.
        process: String,
        /// What is wrong.
        problem: &'static str,
    },
    /// A compute shader is declared to draw into targets, or to test depth.
    #[error("process {process:?} runs a compute shader, which cannot draw into target {target:?} or test its depth")]
    ComputeDraws {
        /// The process.
        process: String,
        /// The target.
        target: String,
    },
    /// A raw pass declares that it draws into or samples a target, beside histories and layers, or another process that
    /// it writes, changes or reads one by commands of its own.
    #[error(
        "process {process:?} declares target {target:?} with an access of raw passes but draws no raw pass, or draws one with an access of drawn passes"
    )]
    Misdeclared {
        /// The process.
        process: String,
        /// The target.
        target: String,
    },
    /// `RenderProcess::name`, `PostStep::process` or `PostStep::with_quality` panicked.
    #[error("a process or a step of post-processing panicked while the frame was planned: {message}")]
    Panicked {
        /// The message of the panic.
        message: String,
    },
    /// No process is left, because none leads to an output.
    #[error("no process leads to an output")]
    Empty,
}
