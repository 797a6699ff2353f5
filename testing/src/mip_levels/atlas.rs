//! All mip levels of targets of many sizes and formats, each side by side in a picture.

use drawloom::RendererBuilder;
use drawloom::backend::Backend;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, CpuShader, Declare, Draws, Format, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs,
    RenderProcess, TargetSize,
};
use drawloom::raster::{Real, Vector, Vector4};
use drawloom::scene::{Camera, Scene};

use super::oracle::Level;
use super::processes::loaded_pixel;

/// The formats of targets that can have mip levels.
pub const ATLAS_FORMATS: [Format; 10] = [
    Format::R8Unorm,
    Format::Rg8Unorm,
    Format::Rgba8Unorm,
    Format::Rgba8Srgb,
    Format::Bgra8Unorm,
    Format::Bgra8Srgb,
    Format::Rgb10a2Unorm,
    Format::Rgba16Float,
    Format::Rg16Float,
    Format::R16Float,
];

/// The sizes of the pictures, none larger than the part of an atlas that a level has.
pub const ATLAS_SIZES: [[u32; 2]; 10] =
    [[1, 1], [1, 9], [16, 1], [2, 2], [3, 5], [5, 3], [7, 4], [15, 16], [13, 11], [2, 15]];

/// The width and height of a level's part of an atlas in pixels.
const SIDE: usize = 16;
const LEVELS: usize = 5;

/// Fills a target with mip levels.
#[derive(Clone, Debug)]
struct Source {
    format: Format,
    name: String,
}

/// Shows all levels of a [`Source`] in a target of four floats.
#[derive(Clone, Debug)]
struct Atlas {
    source: String,
    name: String,
}

/// The target that shows the levels of a target of this format.
pub fn atlas_name(format: Format) -> String {
    format!("atlas of {format:?}")
}

/// A renderer of the atlases of all formats, which are outputs of main views.
pub fn with_atlases<B: Backend>(builder: RendererBuilder<B>) -> RendererBuilder<B> {
    ATLAS_FORMATS.into_iter().fold(builder, |builder, format| {
        let source = Source { format, name: format!("{format:?}") };
        let atlas = Atlas { source: source.name.clone(), name: atlas_name(format) };
        builder.output(&atlas.name).process(source).process(atlas)
    })
}

/// A view of each size.
pub fn atlas_scene() -> Scene {
    let mut scene = Scene::new();
    let camera = |size: [u32; 2]| Camera { size, ..Camera::looking_at(format!("{size:?}"), DVec3::Z, DVec3::ZERO) };
    scene.cameras = ATLAS_SIZES.map(camera).to_vec();
    scene
}

impl RenderProcess for Source {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(&self.name, self.format, ClearColor::Value([0.0; 4]));
        declare.mipmapped(&self.name);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let pixel = vec2<u32>(in.position.xy);
                let number = vec4<u32>(37u, 11u, 83u, 61u) * pixel.x + vec4<u32>(59u, 97u, 23u, 5u) * pixel.y;
                return vec4<f32>((number + pixel.x * pixel.y * 7u) % 101u) / 100.0;
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(self.clone()))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Source {
    fn fragment(&self, _: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [x, y] = pixel.coordinates;
        let number = |[across, down]: [usize; 2]| R::of(((across * x + down * y + x * y * 7) % 101) as f64 / 100.0);
        targets[0] = Vector([[37, 59], [11, 97], [83, 23], [61, 5]].map(number));
        true
    }
}

impl RenderProcess for Atlas {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        declare.clears_color(&self.name, Format::Rgba32Float, ClearColor::Value([0.0; 4]));
        declare.size(&self.name, TargetSize::Fixed([(SIDE * LEVELS) as u32, SIDE as u32]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var source: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let pixel = vec2<u32>(in.position.xy);
                let level = min(pixel.x / 16u, textureNumLevels(source) - 1u);
                let coordinates = vec2<u32>(pixel.x % 16u, pixel.y);
                return textureLoad(source, min(coordinates, textureDimensions(source, level) - 1u), level);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(self.clone()))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Atlas {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [x, y] = pixel.coordinates;
        targets[0] = loaded_pixel(pass.sampled[0], [x % SIDE, y], 0, x / SIDE);
        true
    }
}

/// What a backend shows: rounded to formats, or exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// As devices store it.
    Rounded,
    /// As the reference in f64 computes it.
    Exact,
}

/// Compares the pixels of an atlas: each level with the means of the one before it.
///
/// # Errors
/// If a level differs.
pub fn check_atlas(shown: Shown, format: Format, size: [u32; 2], atlas: &[[f64; 4]]) -> Result<(), String> {
    (0..format.channels()).try_for_each(|channel| {
        let of_channel: Vec<_> = atlas.iter().map(|pixel| pixel[channel]).collect();
        let describe = |problem| format!("channel {channel} of {format:?} at {size:?}: {problem}");
        check_channel((shown, format, channel), size, &of_channel).map_err(describe)
    })
}

fn check_channel(
    (shown, format, channel): (Shown, Format, usize),
    size: [u32; 2],
    atlas: &[f64],
) -> Result<(), String> {
    let level = |level: usize| {
        let size = size.map(|pixels| (pixels >> level).max(1) as usize);
        Level::new(size, |[x, y]| atlas[y * SIDE * LEVELS + level * SIDE + x])
    };
    let level_count = size[0].max(size[1]).ilog2() as usize + 1;
    for index in 1..level_count {
        let (found, expected) = (level(index), level(index - 1).coarser());
        for (found, expected) in found.values.iter().zip(&expected.values) {
            let error = match shown {
                Shown::Exact => (found - expected).abs() * 1e9,
                Shown::Rounded => steps(format, channel, *found, *expected),
            };
            // Devices may round to either of the two nearest numbers.
            if error > 1.0 {
                return Err(format!("level {index} has {found} instead of {expected}"));
            }
        }
    }
    Ok(())
}

/// The distance of two numbers in steps of a format.
fn steps(format: Format, channel: usize, one: f64, other: f64) -> f64 {
    let encoded = |value: f64| match format {
        Format::Rgba8Srgb | Format::Bgra8Srgb if channel < 3 => {
            255.0 * if value <= 0.003_130_8 { value * 12.92 } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 }
        }
        Format::Rgb10a2Unorm if channel < 3 => value * 1023.0,
        Format::Rgb10a2Unorm => value * 3.0,
        // Of the numbers from a half on; smaller ones have smaller steps.
        Format::Rgba16Float | Format::Rg16Float | Format::R16Float => value * 2048.0,
        _ => value * 255.0,
    };
    (encoded(one) - encoded(other)).abs()
}
