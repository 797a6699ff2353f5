//! Bloom on workers and on the device.

use drawloom::RendererBuilder;
use drawloom::backend::{Picture, SoftwareBackend, WgpuBackend};
use drawloom::glam::Vec3;
use drawloom::process::{Deferred, ToneMapping};
use drawloom::scene::Scene;
use drawloom_async_post::{AsyncPost, Bloom, LayerSettings};
use drawloom_testing::scenes::field;
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{DrawingBackend, Engine};

pub const ON_ADAPTER: &[Case] = &[
    ("bloom_on_workers_is_that_of_the_device", same_as_on_device::<WgpuBackend>),
    ("the_source_is_the_mean_of_what_it_covers", source::<WgpuBackend>),
];

pub const IN_SOFTWARE: &[Case] = &[
    ("software_bloom_on_workers_is_that_of_the_device", same_as_on_device::<SoftwareBackend>),
    ("software_the_source_is_the_mean_of_what_it_covers", source::<SoftwareBackend>),
];

fn scene() -> Scene {
    let mut scene = field(60);
    scene.cameras.truncate(1);
    // No multiple of the divisors.
    scene.cameras[0].size = [101, 67];
    scene.background = Vec3::new(0.2, 3.0, 1.5);
    scene
}

fn halves(picture: &Picture) -> Vec<f64> {
    picture.bytes.chunks_exact(2).map(|bytes| f16::from_le_bytes([bytes[0], bytes[1]]).to_f64()).collect()
}

/// Every term of the sums is 0 or more. The device rounds rows and columns to half floats, by up to 2⁻¹⁰ each if it
/// truncates, and the CPU rounds once, by 2⁻¹¹; denormal numbers by 2⁻²⁴ each. Each of them adds up to 66 terms twice
/// in f32, which is 2⁻¹⁶.
fn same_as_on_device<B: DrawingBackend>() -> Result<(), Failed> {
    let scene = scene();
    let view = scene.cameras[0].name.clone();
    for (divisor, radius) in [(1, 1), (2, 16), (4, 31), (5, 7)] {
        let bloom = Bloom { divisor, threshold: 0.5, radius };
        let mut on_cpu = Engine::<B>::new(bloom.on_cpu(), bloom.source(), |builder, post| with(builder, post))?;
        let frame = on_cpu.draw_and_wait(&scene, &[&view])?;
        let source = B::read(&frame.submission, 0, "bloom source")?;
        let (_, of_workers) = on_cpu.post.latest(&view).ok_or("there is a result")?;
        // The post of the second engine is not used.
        let mut on_device = Engine::<B>::new(bloom.on_cpu(), bloom.source(), |mut builder, _| {
            let (processes, step) = bloom.on_device(0.3);
            for process in processes {
                builder = builder.process(process);
            }
            builder.pipeline(Deferred::new().post(step).post(ToneMapping::default()))
        })?;
        let frame = on_device.draw(&scene)?;
        let of_device = B::read(&frame.submission, 0, "bloom columns")?;
        if B::read(&frame.submission, 0, "bloom source")? != source {
            return Err("the sources differ".into());
        }
        let (of_workers, of_device) = (halves(&of_workers), halves(&of_device));
        let (mut largest, mut is_lit) = (0.0_f64, 0);
        for (index, (one, other)) in of_workers.iter().zip(&of_device).enumerate().filter(|(index, _)| index % 4 < 3) {
            let bound =
                one.max(*other) * (2.0 * 2_f64.powi(-10) + 2_f64.powi(-11) + 2_f64.powi(-15)) + 3.0 * 2_f64.powi(-24);
            let is_equal = (one - other).abs() <= bound;
            if !is_equal {
                return Err(format!("÷ {divisor}, radius {radius}, number {index}: {one} and {other}").into());
            }
            largest = largest.max((one - other).abs());
            is_lit += usize::from(*one > 0.1);
        }
        println!("÷ {divisor}, radius {radius}: the largest difference is {largest:e}");
        if is_lit < of_workers.len() / 4 || of_workers.len() != of_device.len() {
            return Err("nothing glows".into());
        }
    }
    Ok(())
}

fn with<B: DrawingBackend>(builder: RendererBuilder<B>, post: &AsyncPost) -> RendererBuilder<B> {
    let deferred = Deferred::new().post(post.layer(LayerSettings::default())).post(ToneMapping::default());
    builder.pipeline(deferred).process(post.downsample().expect("it is downsampled"))
}

fn source<B: DrawingBackend>() -> Result<(), Failed> {
    let scene = scene();
    for divisor in [1_usize, 3, 8, 200] {
        let bloom = Bloom { divisor: divisor as u32, ..Bloom::default() };
        let mut engine = Engine::<B>::new(bloom.on_cpu(), bloom.source(), |builder, post| {
            let deferred = Deferred::new().post(post.layer(LayerSettings::default()));
            builder.pipeline(deferred).process(post.downsample().expect("it is downsampled")).output("radiance")
        })?;
        let frame = engine.draw(&scene)?;
        let [radiance, source] = ["radiance", "bloom source"].map(|target| B::read(&frame.submission, 0, target));
        let (radiance, source) = (radiance?, source?);
        let [width, height] = [radiance.width as usize, radiance.height as usize];
        if [source.width as usize, source.height as usize] != [width.div_ceil(divisor), height.div_ceil(divisor)] {
            return Err(format!("{}x{}", source.width, source.height).into());
        }
        let (whole, small) = (halves(&radiance), halves(&source));
        for (index, found) in small.iter().enumerate() {
            let (pixel, channel) = (index / 4, index % 4);
            let [x, y] = [pixel % source.width as usize * divisor, pixel / source.width as usize * divisor];
            let (mut sum, mut count) = (0.0, 0.0);
            for y in y..(y + divisor).min(height) {
                for x in x..(x + divisor).min(width) {
                    sum += whole[(y * width + x) * 4 + channel];
                    count += 1.0;
                }
            }
            let expected: f64 = sum / count;
            // The half float, and a sum of as many numbers in f32.
            let bound = expected * (2_f64.powi(-10) + count * 2_f64.powi(-24)) + 2_f64.powi(-24);
            if (found - expected).abs() > bound {
                return Err(format!("÷ {divisor}, number {index}: {found} instead of {expected}").into());
            }
        }
    }
    Ok(())
}
