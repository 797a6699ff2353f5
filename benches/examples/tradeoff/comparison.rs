//! Distances between pictures.

use drawloom::backend::Picture;
use image::{RgbImage, RgbaImage};
use image_compare::Algorithm;

use crate::Failure;

/// The distance of two pictures.
#[derive(Clone, Copy, Debug, Default)]
pub struct Distance {
    /// Root mean square error over pixels and channels, 0 to 1.
    pub rmse: f64,
    /// Mean structural similarity: 1 for equal pictures.
    pub mssim: f64,
    /// The visible difference, 0 to 1 (FLIP, Andersson et al. 2020); only with the feature `flip`.
    pub flip: Option<f64>,
}

impl Distance {
    /// # Errors
    /// Returns an error if the two differ in size.
    pub fn between(one: &Picture, other: &Picture) -> Result<Self, Failure> {
        let (one, other) = (without_alpha(one)?, without_alpha(other)?);
        if one.dimensions() != other.dimensions() {
            return Err("pictures of different sizes cannot be compared".into());
        }
        let squares =
            one.as_raw().iter().zip(other.as_raw()).map(|(one, other)| f64::from(one.abs_diff(*other)).powi(2));
        let rmse = (squares.sum::<f64>() / one.as_raw().len() as f64).sqrt() / 255.0;
        let mssim = image_compare::rgb_similarity_structure(&Algorithm::MSSIMSimple, &one, &other)?.score;
        Ok(Self { rmse, mssim, flip: flip(&one, &other) })
    }

    /// The distance of several pairs together.
    pub fn together(distances: &[Self]) -> Self {
        let count = distances.len().max(1) as f64;
        let mean = |of: fn(&Self) -> f64| distances.iter().map(of).sum::<f64>() / count;
        let flips: Option<Vec<_>> = distances.iter().map(|distance| distance.flip).collect();
        Self {
            rmse: mean(|distance| distance.rmse.powi(2)).sqrt(),
            mssim: mean(|distance| distance.mssim),
            flip: flips.filter(|flips| !flips.is_empty()).map(|flips| flips.iter().sum::<f64>() / count),
        }
    }
}

/// The share of pixels that differ by more than `tolerance` of 255 in a channel.
pub fn share_that_differs(one: &Picture, other: &Picture, tolerance: u8) -> f64 {
    let differs =
        |(one, other): &(&[u8], &[u8])| one.iter().zip(*other).any(|(one, other)| one.abs_diff(*other) > tolerance);
    let pixels = one.bytes.chunks_exact(4).zip(other.bytes.chunks_exact(4));
    pixels.filter(differs).count() as f64 / (one.bytes.len() / 4).max(1) as f64
}

/// Converts to an RGB image.
pub fn without_alpha(picture: &Picture) -> Result<RgbImage, Failure> {
    let image = RgbaImage::from_raw(picture.width, picture.height, picture.bytes.clone());
    Ok(image::DynamicImage::ImageRgba8(image.ok_or("the bytes do not fit the size")?).to_rgb8())
}

#[cfg(feature = "flip")]
fn flip(one: &RgbImage, other: &RgbImage) -> Option<f64> {
    let (width, height) = one.dimensions();
    let image = |image: &RgbImage| nv_flip::FlipImageRgb8::with_data(width, height, image.as_raw());
    let errors = nv_flip::flip(image(other), image(one), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    Some(f64::from(nv_flip::FlipPool::from_image(&errors).mean()))
}

#[cfg(not(feature = "flip"))]
fn flip(_one: &RgbImage, _other: &RgbImage) -> Option<f64> {
    None
}
