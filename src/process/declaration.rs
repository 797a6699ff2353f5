//! What a process declares before it draws.

use bytemuck::Pod;

use super::{
    Access, BufferAccess, BufferLayout, ClearColor, Format, InjectionPoint, SampledView, StorageBuffer, TargetSize,
};
use crate::scene::{
    AttributeLayout, AttributeValue, ColumnLayout, MaterialLayout, MaterialType, ObjectColumn, VertexAttribute,
    ViewKind,
};

/// Collects what a process reads and writes. Targets have names: a [`Target`](super::Target), or a string. Each view of
/// the process's kind has targets of its own, of the size of its picture unless [`Declare::size`] says otherwise.
///
/// A process can use only what it declares. What it declares and does not use is warned of through `tracing`: a target,
/// buffer, column or material type that its shader has no variable for, or that its [raw pass](super::RawPassResources)
/// never asks for.
#[derive(Debug, Default)]
pub struct Declare {
    declaration: Declaration,
}

impl Declare {
    /// Sets the kind of view that the process draws in; the default is [`ViewKind::Main`].
    pub fn views(&mut self, kind: ViewKind) {
        self.declaration.views = kind;
    }

    /// Draws in views of this kind too, in targets of theirs, whenever a scene has such views, and draws there what
    /// others sample. The pipeline's own processes draw in [`ViewKind::Reflection`] as they do in [`ViewKind::Main`];
    /// an engine's do so with this call. It has no effect on a process that draws once a frame.
    pub fn also_views(&mut self, kind: ViewKind) {
        self.declaration.also_views.push(kind);
    }

    /// Draws into a colour target, cleared first. Colour targets are the shader's outputs in the order declared.
    pub fn clears_color(&mut self, target: impl AsRef<str>, format: Format, clear: ClearColor) {
        self.access(target.as_ref(), Access::ClearColor(format, clear));
    }

    /// Draws into a colour target over what other processes drew.
    pub fn draws_over(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::DrawOver);
    }

    /// Tests and writes a depth target, first cleared to 0: infinitely far away, as depth is reversed; or to [another
    /// depth](Declare::clears_depth_to), for pipelines of an engine's own whose depth is not. If it has a
    /// [stencil](super::Stencil), that is written and cleared to 0 too.
    pub fn clears_depth(&mut self, target: impl AsRef<str>, format: Format) {
        self.access(target.as_ref(), Access::ClearDepth(format));
    }

    /// Clears the depth target to this depth instead of 0: to 1, for pipelines of an engine's own whose near plane is at
    /// depth 0. A frame with a process that clears none, or clears it to a depth that is not from 0 to 1, is refused.
    pub fn clears_depth_to(&mut self, depth: f32) {
        self.declaration.depth_clear_value = Some(depth);
    }

    /// Tests and writes a depth target over what another process drew.
    pub fn draws_depth(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::DrawDepth);
    }

    /// Tests and writes a depth target that all views of its kind share: a texture array with one layer for each view,
    /// first cleared to 0, infinitely far away. The pictures of those views have the same size.
    pub fn clears_depth_layer(&mut self, target: impl AsRef<str>, format: Format) {
        self.access(target.as_ref(), Access::ClearDepthLayer(format));
    }

    /// Tests against the depth that another process wrote, without writing it, and writes the [stencil](super::Stencil)
    /// beside it. What has the stored depth passes the test, so that objects which are drawn already can be marked. In
    /// the map of a directional light, what is beyond the far plane may pass: see [`Self::matches_depth`].
    pub fn marks_stencil(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::MarkStencil);
    }

    /// Tests against the [stencil](super::Stencil) beside a depth, whatever the depth, and writes neither.
    pub fn tests_stencil(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::TestStencil);
    }

    /// Tests against the depth that another process wrote, without writing it.
    pub fn tests_depth(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::TestDepth);
    }

    /// Draws only where its depth equals the depth that another process wrote, without writing it.
    ///
    /// In the map of a directional light, devices with
    /// [`DEPTH_CLIP_FEATURES`](crate::backend::WgpuBackend::DEPTH_CLIP_FEATURES) clamp the depth of what is beyond the
    /// far plane to 0, which equals the cleared depth. A fragment shader that discards pixels whose
    /// `@builtin(position)` has a z of at most 0 draws the same on all devices.
    pub fn matches_depth(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::MatchDepth);
    }

    /// Reads a target in the shader, at `@group(2)`: the first sampled target is binding 1, the next 2, and so on. The
    /// prelude's `target_sampler` samples it between pixels, if its [format allows that](Format::is_filterable).
    ///
    /// In WGSL it is a `texture_2d<f32>`; a `texture_depth_2d` if its format has depth; a `texture_2d<u32>` for
    /// [`Format::R32Uint`] and [`Format::Stencil8`]. [`targets`](super::targets) has those of the deferred pipeline:
    ///
    /// ```wgsl
    /// @group(2) @binding(1) var depth_target: texture_depth_2d;
    /// ```
    pub fn samples(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::Sample);
    }

    /// Reads what a target held at the end of the frame before, in the shader, at `@group(2)` as [`Declare::samples`]
    /// does: the history of temporal filters. The process may write the target itself.
    ///
    /// That is the frame submitted last. It, and every frame that was recorded since and dropped, had a view of this
    /// kind and name, and its target this size and format; of several views of one name none has a history after their
    /// number changed. Otherwise all channels of the format are 0: a target with an alpha that is written as 1 tells
    /// whether it has a history. The price is a copy of the target at the end of each frame. A raw pass finds it as the
    /// target [`previous_name`].
    ///
    /// A history that is mixed with a share a of each frame ends within r/a of the mean of what it is mixed with, as a
    /// fraction of it. Here r is what a write in the target's format loses: 2⁻¹⁰ for half floats and 2⁻²³ for floats if
    /// the device truncates, half of that if it rounds. So a share of 1/100 needs [`Format::Rgba32Float`].
    pub fn samples_previous(&mut self, target: impl AsRef<str>) {
        self.access(&previous_name(target), Access::SamplePrevious);
    }

    /// Sets the size of a target that the process creates: that it clears, resolves into, or overwrites in a raw pass.
    /// Without this call it has the size of the view's picture. All targets that a process draws into, and the depth
    /// that it tests, have the same size.
    ///
    /// The prelude's `view.width`, `view.height` and `clip_of_pixel` are those of the picture: shaders that draw into
    /// targets of other sizes use `textureDimensions`, or the `clip` of `FullScreenPixel`.
    pub fn size(&mut self, target: impl AsRef<str>, size: TargetSize) {
        let size = if size == TargetSize::Divided(1) { TargetSize::Picture } else { size };
        self.declaration.sizes.push((target.as_ref().to_owned(), size));
    }

    /// Makes a target multisampled, so that edges are smooth: four samples per pixel, the number that every device
    /// supports. The process must clear the target, and not in layers. All targets that a process draws into, and the
    /// depth that it tests, must have the same number of samples.
    ///
    /// A shader that [samples](Declare::samples) a multisampled target declares a `texture_multisampled_2d<f32>` or a
    /// `texture_depth_multisampled_2d`. What reads it as any other target reads the one that it is
    /// [resolved](Declare::resolves) into.
    ///
    /// Triangle culling is off for a process with multisampled targets, because it tests the centres of pixels. The
    /// software backend returns an error.
    ///
    /// ```
    /// use drawloom::process::{ClearColor, Declare, Format, targets};
    ///
    /// fn declare(declare: &mut Declare) {
    ///     declare.clears_color("multisampled colour", Format::Rgba16Float, ClearColor::Background);
    ///     declare.clears_depth("multisampled depth", Format::Depth32Float);
    ///     declare.multisampled("multisampled colour");
    ///     declare.multisampled("multisampled depth");
    ///     // Tone mapping samples the mean of the four.
    ///     declare.resolves("multisampled colour", targets::RADIANCE, Format::Rgba16Float);
    /// }
    /// ```
    pub fn multisampled(&mut self, target: impl AsRef<str>) {
        self.declaration.multisampled.push(target.as_ref().to_owned());
    }

    /// Creates the target `resolved`, and writes the mean of the samples of `multisampled` into it when the process has
    /// drawn into that. It has the same size, and `format` must be the same. A process resolves a target at most once.
    pub fn resolves(&mut self, multisampled: impl AsRef<str>, resolved: impl AsRef<str>, format: Format) {
        let [multisampled, resolved] = [multisampled.as_ref(), resolved.as_ref()];
        self.declaration.resolves.push((multisampled.to_owned(), resolved.to_owned()));
        self.access(resolved, Access::Resolve(format));
    }

    /// Reads the texture array that all views of another kind share, in the shader, at `@group(2)` as
    /// [`Declare::samples`] does. A raw pass finds it as the [layered target](super::RawPassResources::layered_target).
    pub fn samples_layers(&mut self, views: ViewKind, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::SampleLayers(views));
    }

    /// Reads an engine's own data of objects in the shader, at `@group(3)`: the first such column is binding 0, the
    /// next 1, and so on. Each is an array with an element for each object of the scene, by `Object.index`. It may be
    /// longer than that.
    ///
    /// Frames whose scene has no such column fail; [`PREVIOUS_OBJECTS`](crate::scene::PREVIOUS_OBJECTS) is one that
    /// Drawloom has. A device with the least number of storage buffers a shader,
    /// [`WgpuBackend::REQUIRED_LIMITS`](crate::backend::WgpuBackend::REQUIRED_LIMITS), has none left for columns:
    /// request `max_storage_buffers_per_shader_stage` of 4 and one for each column.
    ///
    /// ```
    /// use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};
    /// use drawloom::scene::ObjectColumn;
    ///
    /// const TINT: ObjectColumn<[f32; 4]> = ObjectColumn::new("tint");
    ///
    /// /// Draws every object in its tint.
    /// struct Tinted;
    ///
    /// impl RenderProcess for Tinted {
    ///     fn name(&self) -> &str {
    ///         "tinted"
    ///     }
    ///
    ///     fn declare(&self, declare: &mut Declare) {
    ///         declare.clears_color("picture", Format::Rgba8Srgb, ClearColor::Background);
    ///         declare.clears_depth("depth", Format::Depth32Float);
    ///         declare.reads_column(TINT);
    ///     }
    ///
    ///     fn draws(&self) -> Draws<'_> {
    ///         Draws::Commands(CommandDraws {
    ///             shader: "
    ///                 @group(3) @binding(0) var<storage, read> tints: array<vec4<f32>>;
    ///
    ///                 struct Corner {
    ///                     @builtin(position) position: vec4<f32>,
    ///                     @location(0) tint: vec4<f32>,
    ///                 }
    ///
    ///                 @vertex
    ///                 fn vertex(in: VertexInput) -> Corner {
    ///                     let object = drawn_object(in.instance);
    ///                     let position = clip_position(relative_position(object, in.position));
    ///                     return Corner(position, tints[object.index]);
    ///                 }
    ///
    ///                 @fragment
    ///                 fn fragment(in: Corner) -> @location(0) vec4<f32> {
    ///                     return in.tint;
    ///                 }
    ///             ",
    ///             ..CommandDraws::default()
    ///         })
    ///     }
    /// }
    /// ```
    pub fn reads_column<T: Pod>(&mut self, column: ObjectColumn<T>) {
        self.declaration.columns.push(column.layout());
    }

    /// Reads the values of materials of a [material type](MaterialType) in the shader, at `@group(3)` behind the
    /// columns: the first such type has the next binding, and so on. Each is an array with an element for each material
    /// of the scene, by `Object.material`; those of other types are all zeros. If a material changes, only the blocks
    /// of 1 KiB that its values are in are uploaded.
    ///
    /// For the number of storage buffers that a device needs, see [`Declare::reads_column`].
    pub fn reads_materials<T: Pod>(&mut self, material_type: MaterialType<T>) {
        if !self.declaration.material_types.contains(&material_type.layout()) {
            self.declaration.material_types.push(material_type.layout());
        }
    }

    /// Reads an engine's own attribute of vertices: a field of the prelude's `VertexInput`, by its name. Meshes without
    /// it have the default for each vertex.
    ///
    /// ```
    /// use drawloom::process::Declare;
    /// use drawloom::scene::VertexAttribute;
    ///
    /// const TANGENT: VertexAttribute<[f32; 4]> = VertexAttribute::new("tangent");
    ///
    /// fn declare(declare: &mut Declare) {
    ///     declare.clears_depth("depth", drawloom::process::Format::Depth32Float);
    ///     // In the shader: in.tangent
    ///     declare.reads_attribute(TANGENT, [1.0, 0.0, 0.0, 1.0]);
    /// }
    /// ```
    pub fn reads_attribute<T: AttributeValue>(&mut self, attribute: VertexAttribute<T>, default: T) {
        let default = bytemuck::bytes_of(&default).to_vec();
        let declared = DeclaredAttribute { layout: attribute.layout(), default };
        if !self.declaration.attributes.contains(&declared) {
            self.declaration.attributes.push(declared);
        }
    }

    /// Reads a buffer in the shader, at `@group(2)` after the sampled targets: the first of the process's buffers has
    /// the next binding, the next the one after that, and so on. It comes after the processes that change the buffer.
    ///
    /// A device with only [`WgpuBackend::REQUIRED_LIMITS`](crate::backend::WgpuBackend::REQUIRED_LIMITS) has no storage
    /// buffers left for these: see [`Declare::reads_column`].
    pub fn reads_buffer<T: Pod>(&mut self, buffer: StorageBuffer<T>) {
        self.declaration.buffers.push((buffer.layout(), BufferAccess::Read));
    }

    /// Reads and writes a buffer in the shader, with a binding as [`Declare::reads_buffer`] has. Compute and fragment
    /// shaders have it, and vertex shaders have not. Processes that change the same buffer need an order. A process
    /// that draws in several views sees what it changed in those that are submitted before: in the order of the scene's
    /// cameras, if these are of one kind.
    pub fn changes_buffer<T: Pod>(&mut self, buffer: StorageBuffer<T>) {
        self.declaration.buffers.push((buffer.layout(), BufferAccess::Change));
    }

    /// Takes the arguments of its indirect draw or dispatch from a buffer, which has no binding.
    pub fn reads_arguments<T: Pod>(&mut self, buffer: StorageBuffer<T>) {
        self.declaration.buffers.push((buffer.layout(), BufferAccess::Arguments));
    }

    /// A raw pass overwrites a target with its own commands; as a storage texture too, if [`Format::can_be_stored`].
    pub fn writes(&mut self, target: impl AsRef<str>, format: Format) {
        self.access(target.as_ref(), Access::Write(format));
    }

    /// A raw pass reads and writes a target with its own commands; as a storage texture too, if
    /// [`Format::can_be_stored`] and it is not multisampled.
    pub fn changes(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::Change);
    }

    /// A raw pass reads a target with its own commands. Nothing checks that it does not write it.
    pub fn reads(&mut self, target: impl AsRef<str>) {
        self.access(target.as_ref(), Access::Read);
    }

    /// Draws over the targets that were declared to be cleared so far: for a process that declares what another one
    /// does, and goes on where that one ended.
    pub fn without_clears(&mut self) {
        for (_, access) in &mut self.declaration.accesses {
            *access = match *access {
                Access::ClearColor(..) => Access::DrawOver,
                Access::ClearDepth(_) | Access::ClearDepthLayer(_) => Access::DrawDepth,
                other => other,
            };
        }
    }

    /// Orders the process after another one, whatever they read and write.
    pub fn after(&mut self, process: &str) {
        self.declaration.after.push(process.to_owned());
    }

    /// Orders the process before another one, whatever they read and write.
    pub fn before(&mut self, process: &str) {
        self.declaration.before.push(process.to_owned());
    }

    /// Puts the process at a place of the pipeline, such as the [deferred one](super::Deferred): after all of its
    /// processes before it, and before those behind it. Processes at the same place that write the same target still
    /// need an order.
    pub fn at(&mut self, place: InjectionPoint) {
        let [begin, end] = place.slots();
        self.after(begin);
        self.before(end);
    }

    /// Draws once a frame, in the first of its views, instead of once in each: for work that all views share, such as a
    /// compute shader for particles. Its targets are those of that view, so processes that draw in each view may not
    /// use them. If views are [cached](crate::scene::Redraw), it draws in the first that is not, and not at all if all
    /// are.
    pub fn once_a_frame(&mut self) {
        self.declaration.once_a_frame = true;
    }

    /// Keeps the process in the graph although no output depends on it, because it has side effects.
    pub fn keep(&mut self) {
        self.declaration.keep = true;
    }

    /// The declaration.
    pub fn finish(self) -> Declaration {
        self.declaration
    }

    /// Adds a view whose target is sampled, and returns its index among them.
    pub(super) fn add_sampled_view(&mut self, view: SampledView) -> usize {
        self.declaration.sampled_views.push(view);
        self.declaration.sampled_views.len() - 1
    }

    /// Adds a target that has mip levels.
    pub(super) fn add_mipmapped(&mut self, target: &str) {
        self.declaration.mipmapped.push(target.to_owned());
    }

    pub(super) fn access(&mut self, target: &str, access: Access) {
        self.declaration.accesses.push((target.to_owned(), access));
    }
}

/// What a process declared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Declaration {
    /// The kind of view that it draws in.
    pub views: ViewKind,
    /// The further kinds of views that it draws in. A plan has a process for each, with `views` of its own.
    pub also_views: Vec<ViewKind>,
    /// The views whose targets it samples: see [`Declare::samples_view`] and [`Declare::samples_view_previous`].
    pub sampled_views: Vec<SampledView>,
    /// The targets that it uses, and how, in the order declared.
    pub accesses: Vec<(String, Access)>,
    /// The sizes of targets that it creates, if they are not those of the pictures.
    pub sizes: Vec<(String, TargetSize)>,
    /// The depth that the depth target is cleared to, if it is not 0.
    pub depth_clear_value: Option<f32>,
    /// The targets that it makes multisampled.
    pub multisampled: Vec<String>,
    /// The targets that it gives mip levels: see [`Declare::mipmapped`].
    pub mipmapped: Vec<String>,
    /// The multisampled targets that it resolves, each with the one that it is resolved into.
    pub resolves: Vec<(String, String)>,
    /// The data of objects that its shader reads, in the order of their bindings.
    pub columns: Vec<ColumnLayout>,
    /// The material types whose values its shader reads, in the order of their bindings.
    pub material_types: Vec<MaterialLayout>,
    /// The attributes of vertices that its shader reads, in the order of their locations.
    pub attributes: Vec<DeclaredAttribute>,
    /// The buffers that it uses, and how, in the order declared.
    pub buffers: Vec<(BufferLayout, BufferAccess)>,
    /// The processes that it comes after.
    pub after: Vec<String>,
    /// The processes that it comes before.
    pub before: Vec<String>,
    /// Whether it draws in the first of its views only.
    pub once_a_frame: bool,
    /// Whether it stays in the graph although no output depends on it.
    pub keep: bool,
}

impl Declaration {
    /// The colour targets in the order of the shader's outputs, each with its clear colour if it is cleared.
    pub fn colors(&self) -> impl Iterator<Item = (&str, Option<ClearColor>)> {
        self.accesses.iter().filter_map(|(target, access)| match access {
            Access::ClearColor(_, clear) => Some((target.as_str(), Some(*clear))),
            Access::DrawOver => Some((target.as_str(), None)),
            _ => None,
        })
    }

    /// The targets that it writes.
    pub fn written(&self) -> impl Iterator<Item = &str> {
        self.accesses.iter().filter(|(_, access)| access.writes()).map(|(target, _)| target.as_str())
    }

    /// The buffers that the shader has, in the order of their bindings, each with whether it writes them.
    pub fn bound_buffers(&self) -> impl Iterator<Item = (BufferLayout, bool)> + Clone {
        let bound = self.buffers.iter().filter(|(_, access)| *access != BufferAccess::Arguments);
        bound.map(|(buffer, access)| (*buffer, *access == BufferAccess::Change))
    }

    /// The depth target, and how it is used.
    pub fn depth(&self) -> Option<(&str, Access)> {
        let depth = self.accesses.iter().find(|(_, access)| access.is_depth());
        depth.map(|(target, access)| (target.as_str(), *access))
    }

    /// The targets that the shader samples in the order of their bindings, each with the kind of view that it belongs
    /// to.
    pub fn samples(&self) -> impl Iterator<Item = (ViewKind, &str)> {
        self.accesses.iter().filter_map(|(target, access)| match access {
            Access::Sample | Access::SamplePrevious => Some((self.views, target.as_str())),
            Access::SampleLayers(views) | Access::SampleView(views, _) | Access::SampleViewPrevious(views, _) => {
                Some((*views, target.as_str()))
            }
            _ => None,
        })
    }
}

/// An attribute of vertices that a process reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeclaredAttribute {
    /// Its name and format.
    pub layout: AttributeLayout,
    /// The bytes of the value that vertices of meshes without it have.
    pub default: Vec<u8>,
}

/// The name of the copy that holds a target's history. The copy is made at the end of each frame: passes read what the
/// target held in the frame before, and once the frame is submitted, the copy is that of the frame itself.
pub fn previous_name(target: impl AsRef<str>) -> String {
    format!("{}{PREVIOUS_SUFFIX}", target.as_ref())
}

/// The target whose history has this name; `None` if it is not the name of a history.
pub(super) fn source_of_previous(name: &str) -> Option<&str> {
    name.strip_suffix(PREVIOUS_SUFFIX)
}

const PREVIOUS_SUFFIX: &str = " of the frame before";
