//! What a process declares to sample of other views.

use super::{Access, Declare, SampledShape, SampledView, previous_name};
use crate::scene::ViewKind;

impl Declare {
    /// Reads a target of another view in the shader, at `@group(2)` as [`Declare::samples`] does: a mirror's picture, a
    /// portal's, or that of a camera whose picture a screen in the scene shows (M 10.1). The view has the kind `views`.
    /// In a view called `V` it is the one called `V/view`, which
    /// [`Camera::child_name`](crate::scene::Camera::child_name) makes of the two; if the frame has none, the one called
    /// `view`, which all views share. Of views with the same name it is the first.
    ///
    /// That view is submitted before. Views that sample each other in a circle are
    /// [`FrameError::CircularViews`](crate::FrameError::CircularViews), and so are views that sample each other and are
    /// submitted [process by process](super::internal::ViewOrder::ProcessByProcess). If the frame has no such view, or
    /// only the view itself has that name, the texture is a single pixel whose channels and depth are all 0. So a
    /// format with alpha tells whether there is one, and the recursion of mirrors in mirrors ends where the engine adds
    /// no further camera. The shader finds the texture's size with `textureDimensions`. A target with [mip
    /// levels](Declare::mipmapped) is sampled with all of them. A raw pass cannot sample views.
    ///
    /// ```
    /// use drawloom::command::Selection;
    /// use drawloom::process::{CommandDraws, Declare, Draws, InjectionPoint, RenderProcess, targets};
    /// use drawloom::scene::{LayerMask, ViewKind};
    ///
    /// const MIRROR: LayerMask = LayerMask::layer(5);
    ///
    /// /// Draws the objects of a layer as mirrors, with the picture of the view `mirror`.
    /// struct Mirror;
    ///
    /// impl RenderProcess for Mirror {
    ///     fn name(&self) -> &str {
    ///         "mirror"
    ///     }
    ///
    ///     fn declare(&self, declare: &mut Declare) {
    ///         declare.at(InjectionPoint::AfterLighting);
    ///         declare.samples_view(ViewKind::Reflection, "mirror", targets::RADIANCE);
    ///         declare.draws_over(targets::RADIANCE);
    ///         // The pipeline has drawn the mirror as an opaque object.
    ///         declare.matches_depth(targets::DEPTH);
    ///     }
    ///
    ///     fn draws(&self) -> Draws<'_> {
    ///         Draws::Commands(CommandDraws {
    ///             selection: Selection::ALL.in_layers(MIRROR),
    ///             shader: "
    ///                 @group(2) @binding(1) var mirrored: texture_2d<f32>;
    ///
    ///                 @vertex
    ///                 fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
    ///                     return clip_position(relative_position(drawn_object(in.instance), in.position));
    ///                 }
    ///
    ///                 @fragment
    ///                 fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    ///                     // The reflected camera sees left and right swapped.
    ///                     let across = position.xy / vec2<f32>(view.width, view.height);
    ///                     return textureSampleLevel(mirrored, target_sampler, vec2<f32>(1.0 - across.x, across.y), 0.0);
    ///                 }
    ///             ",
    ///             ..CommandDraws::default()
    ///         })
    ///     }
    /// }
    /// ```
    pub fn samples_view(&mut self, views: ViewKind, view: &str, target: impl AsRef<str>) {
        self.sample_shape(views, view, target.as_ref(), SampledShape::Picture);
    }

    /// Reads a target of up to `layers` views in the shader, as the layers of one texture array: all views of a team's
    /// cameras, say, or what a row of screens shows. Layer `i` is the view called `view/i`. Everything that
    /// [`Declare::samples_view`] says of one view holds for each: in a view called `V` they are those called `V/view/i`
    /// if the frame has one of them. Their targets must have the same size. The layers of views that the frame does not
    /// have are all zeros; a view that is one of them itself sees zeros in all layers.
    ///
    /// In WGSL it is a `texture_2d_array<f32>`, a `texture_depth_2d_array` or a `texture_2d_array<u32>`.
    ///
    /// A plan is refused if there are 0 layers, more than 256, or if the target is multisampled, layered or used by a
    /// raw pass ([`PlanError::SampledLayers`](super::PlanError::SampledLayers)); a frame, if the targets' sizes differ
    /// ([`FrameError::UnequalLayers`](crate::FrameError::UnequalLayers)).
    pub fn samples_view_layers(&mut self, views: ViewKind, view: &str, target: impl AsRef<str>, layers: u32) {
        self.sample_shape(views, view, target.as_ref(), SampledShape::Layers(layers));
    }

    /// Reads a target of six views in the shader, as the faces of a cube map: what is reflected by things that are not
    /// flat (M 10.1). [`Camera::cube_faces`](crate::scene::Camera::cube_faces) makes the cameras. As for
    /// [`Declare::samples_view_layers`], face `i` is the view called `view/i`, their targets must have the same size,
    /// and that must be square: otherwise the frame is
    /// [`FrameError::OblongCubeFace`](crate::FrameError::OblongCubeFace).
    ///
    /// In WGSL it is a `texture_cube<f32>`, a `texture_depth_cube` or a `texture_cube<u32>`. Cube maps are left-handed,
    /// and the world is right-handed: `cube_direction` of the prelude turns a direction of the world into the one to
    /// sample.
    ///
    /// ```wgsl
    /// @group(2) @binding(1) var surroundings: texture_cube<f32>;
    ///
    /// fn reflected(incident: vec3<f32>, normal: vec3<f32>) -> vec4<f32> {
    ///     return textureSampleLevel(surroundings, target_sampler, cube_direction(reflect(incident, normal)), 0.0);
    /// }
    /// ```
    pub fn samples_view_cube(&mut self, views: ViewKind, view: &str, target: impl AsRef<str>) {
        self.sample_shape(views, view, target.as_ref(), SampledShape::Cube);
    }

    /// Reads what a target of another view held at the end of the frame before, in the shader, at `@group(2)` as
    /// [`Declare::samples`] does. The view is found by its name as for [`Declare::samples_view`], but orders nothing:
    /// views that show each other, or a view that shows itself, are no circle. Two mirrors that face each other show
    /// each other one frame late, and so does a screen in the picture of the camera that it shows.
    ///
    /// In a view called `V` it is the view called `V/view`; if the frame has none, the one called `view`, which may be
    /// `V` itself. It is also sampled where a camera [samples no views](crate::scene::Camera::samples_views). The
    /// texture has the format and the size of the target. All its channels are 0 if that view had no such target in the
    /// frame submitted before, or one of another size or format; if the frame has no such view, it is a single pixel of
    /// zeros. A view that is [not drawn in every frame](crate::scene::Redraw) has what it drew last, of the frames
    /// before this one.
    ///
    /// The price is that of [`Declare::samples_previous`], a copy for each view of the kind, and the target's texture
    /// is not [shared](crate::backend::WgpuBackend::transient_targets). A target that no process writes in views of the
    /// kind is [`PlanError::UnknownSampledTarget`](super::PlanError::UnknownSampledTarget). One that is drawn in layers
    /// or multisampled is a [`PlanError`](super::PlanError) too: resolve a multisampled target, and sample what it is
    /// resolved into. A raw pass cannot sample views.
    ///
    /// ```
    /// use drawloom::process::{Declare, InjectionPoint, targets};
    /// use drawloom::scene::ViewKind;
    ///
    /// /// A screen that shows the camera `lens`, which may see the screen.
    /// fn declare(declare: &mut Declare) {
    ///     declare.also_views(ViewKind::Reflection);
    ///     declare.at(InjectionPoint::AfterLighting);
    ///     // In the shader: @group(2) @binding(1) var shown: texture_2d<f32>;
    ///     declare.samples_view_previous(ViewKind::Reflection, "lens", targets::RADIANCE);
    ///     declare.draws_over(targets::RADIANCE);
    ///     declare.matches_depth(targets::DEPTH);
    /// }
    /// ```
    pub fn samples_view_previous(&mut self, views: ViewKind, view: &str, target: impl AsRef<str>) {
        let index = self.add_sampled_view(SampledView { name: view.to_owned(), shape: SampledShape::Picture });
        self.access(&previous_name(target), Access::SampleViewPrevious(views, index));
    }

    fn sample_shape(&mut self, views: ViewKind, view: &str, target: &str, shape: SampledShape) {
        let index = self.add_sampled_view(SampledView { name: view.to_owned(), shape });
        self.access(target, Access::SampleView(views, index));
    }
}
