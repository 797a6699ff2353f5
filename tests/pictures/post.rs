//! Post-processing: tone mapping, anti-aliasing, and an engine's step between them.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Format, FullScreen, Fxaa, GeometryBuffer, GeometryFormats, PostStep,
    RenderProcess, ToneMapping,
};
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::{field, sized};
use image::{Rgb, RgbImage};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::{Distance, as_image, assert_color, tone_mapped};

pub const CASES: &[Case] = &[
    ("fxaa_moves_a_slanted_edge_closer_to_its_coverage", slanted_edge),
    ("edges_along_rows_and_columns_stay_sharp", straight_edges),
    ("pictures_without_contrast_are_unchanged", no_contrast),
    ("the_dark_threshold_applies_to_dark_areas", dark),
    ("sub_pixel_detail_is_blended_by_the_setting", sub_pixel),
    ("a_picture_is_clamped_at_its_border", borders),
    ("settings_out_of_range_are_clamped", settings),
    ("an_engines_step_is_part_of_the_chain", own_step),
    ("a_picture_may_have_the_channels_of_a_surface", channels_of_a_surface),
    ("negative_radiance_is_black_and_infinite_radiance_white", extreme_radiance),
];

/// An engine's full-screen process. Its WGSL is a function body that returns a colour, computed from `pixel`, the
/// pixel's centre, and `source`, the colour of the source target there.
struct Step {
    name: &'static str,
    source: Option<String>,
    target: String,
    format: Format,
    shader: String,
    numbers: [f32; 4],
}

impl Step {
    /// Draws a picture without a source.
    fn pattern(target: &str, format: Format, body: &str, numbers: [f32; 4]) -> Self {
        let shader = format!(
            "@group(2) @binding(0) var<uniform> numbers: vec4<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {{
                let pixel = in.position.xy;
                {body}
            }}"
        );
        Self { name: "pattern", source: None, target: target.to_owned(), format, shader, numbers }
    }

    /// Changes every pixel independently of its neighbours.
    fn between(source: &str, target: &str, name: &'static str, body: &str) -> Self {
        let shader = format!(
            "@group(2) @binding(0) var<uniform> numbers: vec4<f32>;
            @group(2) @binding(1) var source_target: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {{
                let pixel = in.position.xy;
                let source = textureLoad(source_target, vec2<i32>(pixel), 0);
                {body}
            }}"
        );
        let (source, target) = (Some(source.to_owned()), target.to_owned());
        Self { name, source, target, format: Format::Rgba8Srgb, shader, numbers: [0.0; 4] }
    }
}

impl RenderProcess for Step {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        if let Some(source) = &self.source {
            declare.samples(source);
        }
        declare.clears_color(&self.target, self.format, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen {
            shader: &self.shader,
            parameters: self.numbers.map(f32::to_le_bytes).concat().into(),
            ..FullScreen::default()
        })
    }
}

fn empty_scene(size: [u32; 2]) -> Scene {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z, DVec3::ZERO), size)];
    scene
}

/// A pattern of this size, before and after anti-aliasing.
fn smoothed(size: [u32; 2], fxaa: Fxaa, body: &str, numbers: [f32; 4]) -> Result<(Picture, Picture), Failed> {
    let pattern = Step::pattern("pattern", Format::Rgba8Srgb, body, numbers);
    let mut fixture = Fixture::with(2, |builder| {
        builder.process(pattern).process(fxaa.process("pattern", "picture")).output("pattern").output("picture")
    })?;
    let recorded = fixture.record(&empty_scene(size))?;
    let submission = fixture.submit(recorded)?;
    Ok((submission.read(0, "pattern")?, submission.read(0, "picture")?))
}

/// White where the third number plus a multiple of each coordinate is greater than 0.
const HALF_PLANE: &str = "return vec4(vec3(select(0.0, 1.0, dot(vec3(pixel, 1.0), numbers.xyz) > 0.0)), 1.0);";

/// A half plane drawn with 16 × 16 samples per pixel.
fn half_plane_truth(size: [u32; 2], [across, down, offset, _]: [f32; 4]) -> RgbImage {
    const SIDE: u32 = 16;
    RgbImage::from_fn(size[0], size[1], |x, y| {
        let coordinate = |pixel: u32, sample: u32| f64::from(pixel) + (f64::from(sample) + 0.5) / f64::from(SIDE);
        let is_white = |sample: u32| {
            let (x, y) = (coordinate(x, sample % SIDE), coordinate(y, sample / SIDE));
            f64::from(across) * x + f64::from(down) * y + f64::from(offset) > 0.0
        };
        let white = (0..SIDE * SIDE).filter(|&sample| is_white(sample)).count();
        Rgb([encoded(white as f64 / f64::from(SIDE * SIDE)); 3])
    })
}

fn encoded(linear: f64) -> u8 {
    let encoded = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

fn slanted_edge() -> Result<(), Failed> {
    const SIZE: [u32; 2] = [64, 64];
    // The gradient across and down; each edge runs near the picture's centre.
    for [across, down] in [[0.25, 1.0], [-0.25, 1.0], [1.0, 0.25], [-1.0, 0.25], [0.1, -1.0], [1.0, 1.0], [0.4, 1.0]] {
        let numbers = [across, down, -(across + down) * 32.27, 0.0];
        let (before, after) = smoothed(SIZE, Fxaa::default(), HALF_PLANE, numbers)?;
        let truth = half_plane_truth(SIZE, numbers);
        let jagged = Distance::between(&as_image(&before)?, &truth)?.root_mean_square;
        let smooth = Distance::between(&as_image(&after)?, &truth)?.root_mean_square;
        if smooth > 0.5 * jagged {
            return Err(format!("{numbers:?}: {smooth} from the truth, and {jagged} before").into());
        }
        // Across the edge: down where it is flat, to the right where it is steep.
        let is_flat = down.abs() >= across.abs();
        let rises = if is_flat { down > 0.0 } else { across > 0.0 };
        let mut smoothed_lines = 0;
        for line in 0..64 {
            let value = |index| if is_flat { pixel(&after, line, index)[0] } else { pixel(&after, index, line)[0] };
            let mut values: Vec<_> = (0..64).map(value).collect();
            if !rises {
                values.reverse();
            }
            if !values.is_sorted() {
                return Err(format!("{numbers:?}: line {line} goes up and down: {values:?}").into());
            }
            smoothed_lines += u32::from(values.iter().any(|&value| value > 0 && value < 255));
        }
        if smoothed_lines < 56 {
            return Err(format!("{numbers:?}: {smoothed_lines} of 64 lines are smoothed").into());
        }
    }
    Ok(())
}

fn unchanged(context: &str, (before, after): (Picture, Picture)) -> Result<(), Failed> {
    let changed = before.bytes.chunks(4).zip(after.bytes.chunks(4)).position(|(before, after)| before != after);
    changed.map_or(Ok(()), |first| Err(format!("{context}: pixel {first} changed").into()))
}

fn straight_edges() -> Result<(), Failed> {
    for numbers in [[1.0, 0.0, -9.0, 0.0], [0.0, 1.0, -9.0, 0.0], [-1.0, 0.0, 9.0, 0.0], [0.0, -1.0, 9.0, 0.0]] {
        unchanged(&format!("{numbers:?}"), smoothed([24, 20], Fxaa::default(), HALF_PLANE, numbers)?)?;
    }
    Ok(())
}

fn no_contrast() -> Result<(), Failed> {
    // Without thresholds every pixel is processed.
    let without_thresholds = Fxaa { contrast_threshold: 0.0, dark_threshold: 0.0, sub_pixel: 1.0, ..Fxaa::default() };
    for value in 0..=255 {
        let decoded = f64::from(value) / 255.0;
        let linear = if decoded <= 0.040_45 { decoded / 12.92 } else { ((decoded + 0.055) / 1.055).powf(2.4) };
        let numbers = [linear as f32, 0.3, 1.0 - linear as f32, 0.6];
        let pair = smoothed([3, 2], without_thresholds, "return numbers;", numbers)?;
        assert_color([pixel(&pair.0, 0, 0)[0]; 3], [value; 3])?;
        unchanged(&format!("flat {value}"), pair)?;
    }
    // A tenth of the range in 64 steps is below every threshold.
    let gradient = "return vec4(vec3(0.2, 0.3, 0.4) + (pixel.x + pixel.y) * 0.1 / 64.0, 1.0);";
    unchanged("gradient", smoothed([64, 64], Fxaa::default(), gradient, [0.0; 4])?)
}

/// A flat edge: lines of these two linear values.
const TWO_GREYS: &str = "
    let is_second = pixel.y > 16.0 + pixel.x / 4.0;
    return vec4(vec3(select(numbers.x, numbers.y, is_second)), 1.0);
";

fn dark() -> Result<(), Failed> {
    // Perceived, 0.03 and 0.08: a large relative difference, but only a twentieth of the range.
    let numbers = [0.0009, 0.0064, 0.0, 0.0];
    unchanged("in the dark", smoothed([40, 40], Fxaa::default(), TWO_GREYS, numbers)?)?;
    let lower = Fxaa { dark_threshold: 0.03, ..Fxaa::default() };
    let (before, after) = smoothed([40, 40], lower, TWO_GREYS, numbers)?;
    if before == after {
        return Err("a lower threshold should find the edge".into());
    }
    // Perceived, 0.9 and 1: a difference above the dark threshold, but only a tenth of the brighter value.
    let numbers = [0.81, 1.0, 0.0, 0.0];
    unchanged("in the light", smoothed([40, 40], Fxaa::default(), TWO_GREYS, numbers)?)?;
    let lower = Fxaa { contrast_threshold: 0.08, ..Fxaa::default() };
    let (before, after) = smoothed([40, 40], lower, TWO_GREYS, numbers)?;
    if before == after { Err("a lower threshold should find the edge".into()) } else { Ok(()) }
}

fn sub_pixel() -> Result<(), Failed> {
    let dot = "return vec4(vec3(select(0.0, 1.0, all(vec2<i32>(pixel) == vec2(4, 4)))), 1.0);";
    let line = "return vec4(vec3(select(0.0, 1.0, i32(pixel.x) == 4)), 1.0);";
    // A single pixel differs from all its neighbours; a pixel of a line differs from two thirds of them by weight.
    for (body, max_share) in [(dot, 1.0), (line, 0.5)] {
        for sub_pixel in [0.0, 0.25, 1.0] {
            let (_, after) = smoothed([9, 9], Fxaa { sub_pixel, ..Fxaa::default() }, body, [0.0; 4])?;
            let left = 1.0 - f64::from(sub_pixel) * max_share;
            assert_color(pixel(&after, 4, 4), [encoded(left); 3])?;
            assert_color(pixel(&after, 3, 4), [0; 3])?;
        }
    }
    Ok(())
}

/// Half planes and stripes in colour, on a picture of size `numbers.zw` that begins at `numbers.xy` and continues
/// beyond its border.
const BUSY: &str = "
    let texel = clamp(floor(pixel - numbers.xy), vec2(0.0), numbers.zw - 1.0);
    let slanted = select(0.1, 0.9, texel.x * 0.3 + texel.y * 1.1 > 6.0);
    let steep = select(0.0, 1.0, texel.x * 1.2 - texel.y * 0.2 > 7.0);
    let stripes = select(0.2, 0.8, (i32(texel.x) * 3 + i32(texel.y) * 5) % 7 < 3);
    return vec4(slanted, steep, stripes, 1.0);
";

fn borders() -> Result<(), Failed> {
    // Wider than the distance that FXAA searches.
    const MARGIN: u32 = 20;
    for [width, height] in [[1, 1], [2, 1], [1, 2], [3, 2], [1, 40], [17, 13], [40, 40]] {
        let size = [width as f32, height as f32];
        let (_, whole) = smoothed([width, height], Fxaa::default(), BUSY, [0.0, 0.0, size[0], size[1]])?;
        let wide = [width + 2 * MARGIN, height + 2 * MARGIN];
        let margin = MARGIN as f32;
        let (_, part) = smoothed(wide, Fxaa::default(), BUSY, [margin, margin, size[0], size[1]])?;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let (found, expected) = (pixel(&whole, x, y), pixel(&part, x + MARGIN, y + MARGIN));
            if found != expected {
                return Err(format!("{width}x{height}: ({x}, {y}) is {found:?} and not {expected:?}").into());
            }
        }
    }
    // Black and white side by side have nothing to smooth.
    unchanged("two pixels", smoothed([2, 1], Fxaa::default(), HALF_PLANE, [1.0, 0.0, -1.0, 0.0])?)
}

fn settings() -> Result<(), Failed> {
    let draw = |contrast_threshold: f32, dark_threshold: f32, sub_pixel: f32| {
        let fxaa = Fxaa { contrast_threshold, dark_threshold, sub_pixel, ..Fxaa::default() };
        smoothed([32, 32], fxaa, BUSY, [0.0, 0.0, 32.0, 32.0])
    };
    let lowest = draw(0.0, 0.0, 0.0)?;
    for below in [-1.0, f32::NAN, f32::NEG_INFINITY] {
        if draw(below, below, below)? != lowest {
            return Err(format!("{below} should be as 0").into());
        }
    }
    let highest = draw(0.0, 0.0, 1.0)?;
    if highest == lowest || draw(0.0, 0.0, f32::INFINITY)? != highest {
        return Err("infinity should be as 1".into());
    }
    unchanged("no edge exceeds an infinite threshold", draw(f32::INFINITY, 0.0, 1.0)?)?;
    unchanged("no edge exceeds an infinite threshold", draw(0.0, f32::INFINITY, 1.0)?)
}

/// A scene's background after the steps, in order.
fn after_steps(background: Vec3, steps: &[&dyn PostStep]) -> Result<[u8; 3], Failed> {
    let mut scene = empty_scene([8, 8]);
    scene.background = background;
    let mut fixture = Fixture::with(2, |builder| {
        let mut builder = builder.process(GeometryBuffer::new(GeometryFormats::default())).output("picture");
        let mut source = "radiance".to_owned();
        for (index, step) in steps.iter().enumerate() {
            let last = index + 1 == steps.len();
            let target = if last { "picture".to_owned() } else { format!("after step {index}") };
            builder = builder.process(step.process(&source, &target));
            source = target;
        }
        builder
    })?;
    Ok(pixel(&fixture.draw(&scene)?, 5, 2))
}

fn own_step() -> Result<(), Failed> {
    let negative = |source: &str, target: &str| {
        Step::between(source, target, "negative", "return vec4(1.0 - source.rgb, source.a);")
    };
    let redden = |source: &str, target: &str| {
        Step::between(source, target, "redden", "return vec4(source.r, 0.5 * source.gb, source.a);")
    };
    let background = [0.02, 0.2, 0.6];
    let radiance_before = Vec3::from_array(background.map(|radiance| radiance as f32));
    let (tone_mapping, fxaa) = (ToneMapping::new(2.0), Fxaa::default());

    let mapped = background
        .map(|radiance| 2.0 * radiance)
        .map(|radiance: f64| (radiance * (2.51 * radiance + 0.03)) / (radiance * (2.43 * radiance + 0.59) + 0.14));
    let negated = mapped.map(|mapped| 1.0 - mapped);
    let [red, green, blue] = negated;
    assert_color(after_steps(radiance_before, &[&tone_mapping])?, mapped.map(encoded))?;
    assert_color(after_steps(radiance_before, &[&tone_mapping, &negative, &fxaa])?, negated.map(encoded))?;
    assert_color(after_steps(radiance_before, &[&tone_mapping, &fxaa, &negative])?, negated.map(encoded))?;
    let both: [&dyn PostStep; 4] = [&tone_mapping, &negative, &redden, &fxaa];
    assert_color(after_steps(radiance_before, &both)?, [red, green / 2.0, blue / 2.0].map(encoded))?;
    // The reverse order gives another picture: green and blue are halved before the negative.
    let swapped: [&dyn PostStep; 4] = [&tone_mapping, &redden, &negative, &fxaa];
    let [_, green, blue] = mapped;
    assert_color(after_steps(radiance_before, &swapped)?, [red, 1.0 - green / 2.0, 1.0 - blue / 2.0].map(encoded))
}

fn extreme_radiance() -> Result<(), Failed> {
    let infinity = f32::INFINITY;
    // Where the curve's denominator is 0, and where a negative times a negative is positive.
    let negatives = [-1e-7, -0.01, -0.12, -0.163, -0.2, -1.0, -300.0, -65504.0, -1e9, -infinity];
    let mut expected: Vec<_> = negatives.into_iter().map(|radiance| (radiance, 1.0, 0)).collect();
    expected.extend([0.0, -0.0].map(|radiance| (radiance, 1.0, 0)));
    expected.extend([300.0, 65504.0, 1e9, infinity].map(|radiance| (radiance, 1.0, 255)));
    expected.extend([
        (infinity, 0.0, 0),
        (infinity, -1.0, 0),
        (infinity, f32::NAN, 0),
        (infinity, 1e30, 255),
        (0.0, infinity, 0),
        (1.0, infinity, 255),
        (-1.0, infinity, 0),
        (-1.0, -1.0, 0),
    ]);
    for (radiance, exposure, expected) in expected {
        // Green is an ordinary value, which must not be affected.
        let numbers = [radiance, 0.25, radiance, 1.0];
        let pattern = Step::pattern("radiance", Format::Rgba16Float, "return numbers;", numbers);
        let tone_mapping = ToneMapping::new(exposure);
        let mut fixture = Fixture::with(2, |builder| builder.process(pattern).process(tone_mapping).output("picture"))?;
        let [red, green, blue] = pixel(&fixture.draw(&empty_scene([4, 4]))?, 1, 1);
        let exposed = if exposure > 0.0 { f64::from(exposure.min(1e9)) * 0.25 } else { 0.0 };
        let [_, ordinary, _] = tone_mapped([exposed; 3]);
        if [red, blue] != [expected; 2] || green.abs_diff(ordinary) > 1 {
            let found = [red, green, blue];
            return Err(format!("{radiance} at {exposure}: {found:?}, not {expected} and {ordinary}").into());
        }
    }
    Ok(())
}

fn channels_of_a_surface() -> Result<(), Failed> {
    let scene = field(40);
    let deferred = |format| {
        let tone_mapping = ToneMapping { format, ..ToneMapping::default() };
        Deferred::new().post(tone_mapping).post(Fxaa { format, ..Fxaa::default() })
    };
    let by_wgpu = |format| {
        let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred(format)))?;
        fixture.draw(&scene)
    };
    let by_software = |format| {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler))).pipeline(deferred(format));
        let (mut renderer, submitter) = builder.build(scheduler)?;
        Ok::<_, Failed>(submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "picture")?)
    };
    let swapped = |mut picture: Picture| {
        picture.bytes.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        picture.bytes
    };
    if by_wgpu(Format::Rgba8Srgb)?.bytes != swapped(by_wgpu(Format::Bgra8Srgb)?) {
        return Err("on wgpu the pictures differ".into());
    }
    if by_software(Format::Rgba8Srgb)?.bytes != swapped(by_software(Format::Bgra8Srgb)?) {
        return Err("on the software backend the pictures differ".into());
    }
    Ok(())
}
