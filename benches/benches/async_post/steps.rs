//! Steps that are measured.

use drawloom::backend::Picture;
use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess};
use drawloom_async_post::{AsyncStep, StepFrame};

/// The grade of a finished picture of bytes: a curve for each channel, darker towards the corners.
pub struct Grade;

impl AsyncStep for Grade {
    fn name(&self) -> &str {
        "grade"
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        let mut picture = frame.picture.clone();
        let curve: [u8; 256] = std::array::from_fn(|value| {
            let value = value as f32 / 255.0;
            (255.0 * (value * value * (3.0 - 2.0 * value)).mul_add(0.3, value * 0.7) + 0.5) as u8
        });
        let [width, height] = [picture.width as f32, picture.height as f32];
        let rows = picture.bytes.chunks_exact_mut(picture.width as usize * 4).enumerate();
        let outcome = frame.scheduler.parallel_for_each(rows, |(y, row), _worker| {
            let down = (y as f32 / height - 0.5).powi(2);
            for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
                let shade = 1.0 - 0.6 * ((x as f32 / width - 0.5).powi(2) + down);
                for channel in &mut pixel[..3] {
                    *channel = (f32::from(curve[usize::from(*channel)]) * shade) as u8;
                }
            }
        });
        outcome.expect("a row does not panic");
        picture
    }
}

/// The same grade on the device.
pub fn grade_on_device(source: &str, target: &str) -> impl RenderProcess + use<> {
    GradeProcess { source: source.to_owned(), target: target.to_owned() }
}

struct GradeProcess {
    source: String,
    target: String,
}

impl RenderProcess for GradeProcess {
    fn name(&self) -> &str {
        "grade"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        declare.clears_color(&self.target, Format::Rgba8Srgb, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        // The curve is of sRGB encoded values, as on the CPU.
        let shader = "
            @group(2) @binding(1) var source: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let linear = textureLoad(source, vec2<i32>(in.position.xy), 0);
                let encoded = select(
                    1.055 * pow(linear.rgb, vec3<f32>(1.0 / 2.4)) - 0.055,
                    12.92 * linear.rgb,
                    linear.rgb <= vec3<f32>(0.0031308),
                );
                let from_center = in.clip * 0.5;
                let shade = 1.0 - 0.6 * dot(from_center, from_center);
                let graded = shade * mix(encoded, encoded * encoded * (3.0 - 2.0 * encoded), 0.3);
                let decoded = select(
                    pow((graded + 0.055) / 1.055, vec3<f32>(2.4)),
                    graded / 12.92,
                    graded <= vec3<f32>(0.04045),
                );
                return vec4<f32>(decoded, linear.a);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

/// How much of each pixel's surroundings is open, at half the size, from depth: a layer with sharp edges, and so one
/// that shows when it is late.
pub struct AmbientOcclusion;

/// Offsets of the pixels that are compared, in pixels of the depth.
const OFFSETS: [[i64; 2]; 12] =
    [[2, 1], [-2, -1], [1, -3], [-1, 3], [5, -2], [-5, 2], [3, 6], [-3, -6], [9, 4], [-9, -4], [4, -10], [-4, 10]];

impl AsyncStep for AmbientOcclusion {
    fn name(&self) -> &str {
        "occlusion"
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        let near = frame.camera.near;
        let words: Vec<f32> = frame
            .picture
            .bytes
            .chunks_exact(4)
            .map(|word| f32::from_le_bytes([word[0], word[1], word[2], word[3]]))
            .collect();
        let [width, height] = [frame.picture.width as i64, frame.picture.height as i64];
        // Depth is reversed: 0 is infinitely far away.
        let distance =
            |x: i64, y: i64| near / words[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize].max(1e-9);
        let [small_width, small_height] = [frame.picture.width.div_ceil(2), frame.picture.height.div_ceil(2)];
        let mut bytes = vec![255_u8; small_width as usize * small_height as usize * 4];
        let rows = bytes.chunks_exact_mut(small_width as usize * 4).enumerate();
        let outcome = frame.scheduler.parallel_for_each(rows, |(y, row), _worker| {
            for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
                let [x, y] = [x as i64 * 2, y as i64 * 2];
                let own = distance(x, y);
                let covers = |[across, down]: &[i64; 2]| {
                    let nearer = (own - distance(x + across, y + down)) / own;
                    if nearer > 0.0 { (nearer * 20.0).min(1.0) * (1.0 - nearer * 4.0).max(0.0) } else { 0.0 }
                };
                let covered = OFFSETS.iter().map(covers).sum::<f32>() / OFFSETS.len() as f32;
                pixel[..3].fill((255.0 * (1.0 - covered) + 0.5) as u8);
            }
        });
        outcome.expect("a row does not panic");
        Picture { width: small_width, height: small_height, format: Format::Rgba8Unorm, bytes }
    }
}
