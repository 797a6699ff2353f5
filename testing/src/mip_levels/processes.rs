//! Processes that give a target mip levels, and that show levels of it.

use drawloom::RendererBuilder;
use drawloom::backend::Backend;
use drawloom::process::{
    ClearColor, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs,
    RenderProcess, SampledTexture,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Blend, ViewKind};

/// What [`Overlay`] adds.
pub(super) const OVERLAY: f64 = 0.25;

/// Draws a pattern, a quarter of level 1 of what the view held in the frame before, and a quarter of level 2 of what
/// the view `mirror` held, into `pyramid`, a target with mip levels.
#[derive(Clone, Copy, Debug)]
struct Pyramid;

/// Adds [`OVERLAY`] to `pyramid` after [`Levels`] has sampled it.
#[derive(Clone, Copy, Debug)]
struct Overlay;

/// Shows levels of the view's own `pyramid` and of those of other views: of one as a picture, of two as an array, and
/// of six as a cube map.
#[derive(Clone, Copy, Debug)]
struct Levels;

/// Shows levels of `pyramid` with the overlay.
#[derive(Clone, Copy, Debug)]
struct LateLevels;

/// A renderer of these processes, with the outputs [`OUTPUTS`] of main views.
pub fn with_mip_levels<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    let builder = builder.process(Pyramid).process(Levels).process(Overlay).process(LateLevels);
    OUTPUTS.into_iter().fold(builder, RendererBuilder::output)
}

/// The targets that [`check`](super::check) compares, all with four floats.
pub const OUTPUTS: [&str; 3] = ["levels", "layers", "late levels"];

impl RenderProcess for Pyramid {
    fn name(&self) -> &str {
        "pyramid"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.samples_previous("pyramid");
        declare.samples_view_previous(ViewKind::Reflection, "mirror", "pyramid");
        declare.clears_color("pyramid", Format::R16Float, ClearColor::Value([0.0; 4]));
        declare.mipmapped("pyramid");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: include_str!("pyramid.wgsl"), ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Pyramid {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let own = R::of(pattern(pass.view.size[0], pixel.coordinates));
        let held = |index: usize, level: usize| loaded(pass.sampled[index], pixel.coordinates, 0, level);
        targets[0][0] = own + (held(0, 1) + held(1, 2)) * R::of(0.25);
        true
    }
}

impl RenderProcess for Overlay {
    fn name(&self) -> &str {
        "overlay"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.draws_over("pyramid");
        declare.after("levels");
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return vec4<f32>(0.25, 0.0, 0.0, 0.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, blend: Blend::Additive, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Overlay {
    fn fragment(&self, _: &PassInputs<'_, R>, _: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = Vector([OVERLAY, 0.0, 0.0, 0.0].map(R::of));
        true
    }
}

impl RenderProcess for Levels {
    fn name(&self) -> &str {
        "levels"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("pyramid");
        declare.samples_view(ViewKind::Reflection, "mirror", "pyramid");
        declare.samples_view_layers(ViewKind::Reflection, "wall", "pyramid", 2);
        declare.samples_view_cube(ViewKind::Reflection, "probe", "pyramid");
        declare.clears_color("levels", Format::Rgba32Float, ClearColor::Value([0.0; 4]));
        declare.clears_color("layers", Format::Rgba32Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: include_str!("levels.wgsl"), ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Levels {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let &[pyramid, mirror, wall, probe] = pass.sampled else { return false };
        let [x, y] = pixel.coordinates;
        let half = R::of(0.5);
        let uv = Vector([(pixel.clip[0] + R::one()) * half, (R::one() - pixel.clip[1]) * half]);
        let between = mirror.sample_level(uv, 0, R::of(sampled_level(x)))[0];
        let count = R::of(pyramid.level_count() as f64);
        targets[0] = Vector([
            loaded(pyramid, [x, y], 0, x / 3 % pyramid.level_count()),
            loaded(mirror, [x, y], 0, x / 3 % mirror.level_count()),
            between,
            count,
        ]);
        let of_wall = loaded(wall, [x, y], x % 2, x / 3 % wall.level_count());
        let last = probe.level_count() - 1;
        let of_probe = probe.load_cube_level(Vector(FACES[y % 6].map(R::of)), last)[0];
        targets[1] = Vector([of_wall, of_probe, R::of(last as f64), R::zero()]);
        true
    }
}

impl RenderProcess for LateLevels {
    fn name(&self) -> &str {
        "late levels"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("pyramid");
        declare.clears_color("late levels", Format::Rgba32Float, ClearColor::Value([0.0; 4]));
        declare.after("overlay");
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var pyramid: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let pixel = vec2<u32>(in.position.xy);
                let level = pixel.x / 3u % textureNumLevels(pyramid);
                let last = max(textureDimensions(pyramid) >> vec2<u32>(level), vec2<u32>(1u)) - 1u;
                return vec4<f32>(textureLoad(pyramid, min(pixel, last), level).r, 0.0, 0.0, 0.0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(*self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for LateLevels {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [x, y] = pixel.coordinates;
        targets[0] = Vector::zero();
        targets[0][0] = loaded(pass.sampled[0], [x, y], 0, x / 3 % pass.sampled[0].level_count());
        true
    }
}

/// A pixel of a level, at most the last one in each direction and the last level.
pub(super) fn loaded_pixel<R: Real>(
    texture: &dyn SampledTexture<R>,
    [x, y]: [usize; 2],
    layer: usize,
    level: usize,
) -> Vector4<R> {
    let level = level.min(texture.level_count() - 1);
    let [width, height] = texture.size_of_level(level);
    texture.load_level([x.min(width - 1), y.min(height - 1)], layer, level)
}

/// The first channel of that pixel.
fn loaded<R: Real>(texture: &dyn SampledTexture<R>, pixel: [usize; 2], layer: usize, level: usize) -> R {
    loaded_pixel(texture, pixel, layer, level)[0]
}

/// What [`Pyramid`] adds to histories, by the width of the picture and the pixel.
pub(super) fn pattern(width: usize, [x, y]: [usize; 2]) -> f64 {
    ((x * 7 + y * 13 + width) % 32) as f64 / 32.0
}

/// The level at which a column samples the mirror.
pub(super) fn sampled_level(x: usize) -> f64 {
    (x % 11) as f64 * 0.375 - 0.25
}

/// The direction of each face of a cube map.
const FACES: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]];
