//! The distance between pictures, and bounds for it.

use drawloom::backend::Picture;
use image::{RgbImage, RgbaImage};
use libtest_mimic::Failed;

/// The distance between two pictures.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// Root mean square error over all pixels of the channel where it is largest, 0 to 1.
    pub root_mean_square: f64,
    /// Root mean square error over all channels of the tile of 20 × 20 pixels where it is largest. It shows a missing
    /// small object.
    pub worst_tile: f64,
}

impl Distance {
    /// Whether two adapters may differ this much on one scene. Their rounding differs. Where it decides which of two
    /// surfaces a pixel on an edge shows, the whole pixel differs: in a tile, two of its 400 pixels may differ by half
    /// of the range.
    pub fn is_within_bound(self) -> bool {
        self.root_mean_square <= 0.01 && self.worst_tile <= 0.04
    }

    pub fn between(one: &RgbImage, other: &RgbImage) -> Result<Self, Failed> {
        if one.dimensions() != other.dimensions() {
            return Err("pictures of different sizes cannot be compared".into());
        }
        Ok(Self { root_mean_square: worst_channel(one, other), worst_tile: worst_tile(one, other) })
    }
}

fn worst_channel(one: &RgbImage, other: &RgbImage) -> f64 {
    let mut sums = [0.0; 3];
    for (one, other) in one.pixels().zip(other.pixels()) {
        for (channel, sum) in sums.iter_mut().enumerate() {
            *sum += (f64::from(one.0[channel].abs_diff(other.0[channel])) / 255.0).powi(2);
        }
    }
    let pixels = f64::from(one.width() * one.height());
    sums.map(|sum| (sum / pixels).sqrt()).into_iter().fold(0.0, f64::max)
}

fn worst_tile(one: &RgbImage, other: &RgbImage) -> f64 {
    const SIDE: u32 = 20;
    let mut sums = std::collections::HashMap::new();
    for ((x, y, one), other) in one.enumerate_pixels().zip(other.pixels()) {
        let squared = one.0.iter().zip(other.0).map(|(one, other)| (f64::from(one.abs_diff(other)) / 255.0).powi(2));
        *sums.entry((x / SIDE, y / SIDE)).or_insert(0.0) += squared.sum::<f64>() / 3.0;
    }
    let worst = sums.into_values().fold(0.0, f64::max);
    (worst / f64::from(SIDE * SIDE)).sqrt()
}

/// A picture as an `image::RgbImage`, without alpha.
pub fn as_image(picture: &Picture) -> Result<RgbImage, Failed> {
    let image = RgbaImage::from_raw(picture.width, picture.height, picture.bytes.clone());
    Ok(image::DynamicImage::ImageRgba8(image.ok_or("the bytes do not fit the size")?).to_rgb8())
}

/// Fails if the distance between two pictures exceeds the bound for two adapters.
pub fn assert_alike(one: &Picture, other: &Picture) -> Result<(), Failed> {
    let distance = Distance::between(&as_image(one)?, &as_image(other)?)?;
    if distance.is_within_bound() { Ok(()) } else { Err(format!("the pictures differ: {distance:?}").into()) }
}

/// Fails if the distance between two pictures is within the bound for two adapters.
pub fn assert_different(one: &Picture, other: &Picture) -> Result<(), Failed> {
    match assert_alike(one, other) {
        Ok(()) => Err("the pictures should differ".into()),
        Err(_) => Ok(()),
    }
}

/// Fails if a channel of a colour is off by more than 2 of 255.
pub fn assert_color(found: [u8; 3], expected: [u8; 3]) -> Result<(), Failed> {
    let close = found.iter().zip(expected).all(|(found, expected)| found.abs_diff(expected) <= 2);
    if close { Ok(()) } else { Err(format!("{found:?} should be {expected:?}").into()) }
}

/// The shipped tone mapping of a radiance, computed in f64.
pub fn tone_mapped(radiance: [f64; 3]) -> [u8; 3] {
    radiance.map(|radiance| {
        let mapped = (radiance * (2.51 * radiance + 0.03)) / (radiance * (2.43 * radiance + 0.59) + 0.14);
        let linear = mapped.clamp(0.0, 1.0);
        let encoded = if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
        (encoded * 255.0).round() as u8
    })
}
