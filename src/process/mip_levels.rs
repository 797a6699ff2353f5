//! What a process declares of mip levels.

use super::Declare;

impl Declare {
    /// Gives a target a complete chain of mip levels: level 0 has its size, each further one half the width and height
    /// of the one before, rounded down, and the last one is a single pixel. The process must create the target: clear
    /// it, and not in layers, resolve into it, or overwrite it in a raw pass. Its format must be
    /// [filterable](super::Format::is_filterable), and it is not [multisampled](Declare::multisampled).
    ///
    /// Processes draw into level 0. The other levels are generated after the last pass that writes the target and
    /// before a pass samples it, in the same view, in another one or in a later frame. So whatever is sampled has all
    /// levels: [`Declare::samples`], [`Declare::samples_view`] with its layers and cubes, and the histories of
    /// [`Declare::samples_previous`] and [`Declare::samples_view_previous`]. A view that the frame does not have is a
    /// single pixel of zeros, with one level.
    ///
    /// A pixel of a level is the mean of the pixels of the level before that it covers, weighted by area: of 2 × 2, and
    /// of 3 in a direction in which their number is odd. So the last level is the mean of the whole target. Means are
    /// of linear values, also in sRGB formats; each level is rounded to the format: a mean in half floats is off by up
    /// to 2⁻¹⁰ of itself per level.
    ///
    /// Shaders choose a level with `textureSampleLevel`, or load a pixel of one: a rough mirror samples a coarse level
    /// of what its view has. CPU shaders have `SampledTexture::sample_level` and `SampledTexture::load_level`. A raw
    /// pass draws into a view of level 0, as a texture with several levels cannot be attached as a whole. What is read
    /// back is level 0. A target with mip levels cannot be [imported](crate::backend::WgpuBackend::import_target).
    ///
    /// The levels take a third of the target's memory in addition, and a small pass for each level whenever they are
    /// generated.
    ///
    /// ```
    /// use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, TargetSize, targets};
    ///
    /// /// Copies the radiance, so that others sample it blurred.
    /// struct Blurred;
    ///
    /// impl RenderProcess for Blurred {
    ///     fn name(&self) -> &str {
    ///         "blurred"
    ///     }
    ///
    ///     fn declare(&self, declare: &mut Declare) {
    ///         declare.samples(targets::RADIANCE);
    ///         declare.clears_color("blurred", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    ///         declare.mipmapped("blurred");
    ///     }
    ///
    ///     fn draws(&self) -> Draws<'_> {
    ///         Draws::FullScreen(FullScreen {
    ///             shader: "
    ///                 @group(2) @binding(1) var radiance: texture_2d<f32>;
    ///
    ///                 @fragment
    ///                 fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    ///                     return textureLoad(radiance, vec2<u32>(in.position.xy), 0);
    ///                 }
    ///             ",
    ///             ..FullScreen::default()
    ///         })
    ///     }
    /// }
    ///
    /// /// Meters the exposure: a pixel of the mean radiance.
    /// struct Meter;
    ///
    /// impl RenderProcess for Meter {
    ///     fn name(&self) -> &str {
    ///         "meter"
    ///     }
    ///
    ///     fn declare(&self, declare: &mut Declare) {
    ///         declare.samples("blurred");
    ///         declare.clears_color("mean", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    ///         declare.size("mean", TargetSize::Fixed([1, 1]));
    ///     }
    ///
    ///     fn draws(&self) -> Draws<'_> {
    ///         Draws::FullScreen(FullScreen {
    ///             shader: "
    ///                 @group(2) @binding(1) var blurred: texture_2d<f32>;
    ///
    ///                 @fragment
    ///                 fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
    ///                     return textureLoad(blurred, vec2<u32>(0u), textureNumLevels(blurred) - 1u);
    ///                 }
    ///             ",
    ///             ..FullScreen::default()
    ///         })
    ///     }
    /// }
    /// ```
    pub fn mipmapped(&mut self, target: impl AsRef<str>) {
        self.add_mipmapped(target.as_ref());
    }
}
