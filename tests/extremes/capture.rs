//! Captured pictures.

use drawloom::backend::Picture;
use drawloom::process::Format;
use half::f16;
use libtest_mimic::Failed;

/// The targets `radiance` and `picture` of a view.
#[derive(Clone)]
pub struct Capture {
    pub size: [usize; 2],
    /// Red, green and blue, row by row from the top.
    radiance: Vec<[f64; 3]>,
    /// The tone-mapped picture, RGBA.
    picture: Vec<u8>,
}

/// Reads both targets. Radiance may be infinite, where the sum of lights exceeds the range of half floats; tone mapping clamps
/// it.
///
/// # Errors
/// If the radiance of a pixel is NaN or negative infinity.
pub fn capture(radiance: &Picture, picture: Picture) -> Result<Capture, Failed> {
    let pixels = numbers(radiance)?;
    let size = [radiance.width as usize, radiance.height as usize];
    let is_broken = |channel: &f64| channel.is_nan() || *channel == f64::NEG_INFINITY;
    if let Some(broken) = pixels.iter().position(|pixel| pixel.iter().any(is_broken)) {
        let (x, y, value) = (broken % size[0], broken / size[0], pixels[broken]);
        let count = pixels.iter().flatten().filter(|channel| is_broken(channel)).count();
        return Err(format!("the radiance at ({x}, {y}) is {value:?}, and {count} channels are like that").into());
    }
    Ok(Capture { size, radiance: pixels, picture: picture.bytes })
}

impl Capture {
    pub fn radiance(&self, x: usize, y: usize) -> [f64; 3] {
        self.radiance[y * self.size[0] + x]
    }

    /// The radiance of the middle pixel.
    pub fn middle(&self) -> [f64; 3] {
        self.radiance(self.size[0] / 2, self.size[1] / 2)
    }

    /// The greatest magnitude of each channel.
    pub fn greatest(&self) -> [f64; 3] {
        self.radiance
            .iter()
            .fold([0.0; 3], |max, pixel| std::array::from_fn(|channel| pixel[channel].abs().max(max[channel])))
    }

    /// The share of pixels that are not black.
    pub fn covered(&self) -> f64 {
        let bright = self.radiance.iter().filter(|pixel| pixel.iter().any(|channel| *channel > 0.0)).count();
        bright as f64 / self.radiance.len() as f64
    }

    /// The root mean square difference of two pictures, 0 to 255, and the share of pixels that differ by more than 8.
    pub fn distance(&self, other: &Self) -> [f64; 2] {
        let off = || self.picture.iter().zip(&other.picture).map(|(one, other)| f64::from(one.abs_diff(*other)));
        let mean_square = off().map(|off| off * off).sum::<f64>() / self.picture.len() as f64;
        let pixels = off().collect::<Vec<_>>();
        let far = pixels.chunks_exact(4).filter(|pixel| pixel.iter().any(|channel| *channel > 8.0)).count();
        [mean_square.sqrt(), far as f64 / (pixels.len() / 4) as f64]
    }
}

/// Fails if two pictures of equivalent scenes differ. Where an edge runs through the centre of a pixel, rounding determines the
/// pixel, so 2% of the pixels may differ by any amount.
pub fn assert_alike(context: &str, one: Option<&Capture>, other: Option<&Capture>) -> Result<(), Failed> {
    let (Some(one), Some(other)) = (one, other) else { return Ok(()) };
    let [root_mean_square, share] = one.distance(other);
    if root_mean_square <= 2.55 || share <= 0.02 {
        return Ok(());
    }
    Err(format!("{context}: differs by {root_mean_square:.2} of 255, and at {:.1}% of the pixels", share * 100.0)
        .into())
}

fn numbers(picture: &Picture) -> Result<Vec<[f64; 3]>, Failed> {
    let bytes = &picture.bytes;
    let whole: Vec<f64> = match picture.format {
        Format::Rgba16Float => bytes.as_chunks().0.iter().map(|&half| f16::from_le_bytes(half).to_f64()).collect(),
        other => return Err(format!("radiance in {other:?}").into()),
    };
    Ok(whole.as_chunks::<4>().0.iter().map(|&[red, green, blue, _]| [red, green, blue]).collect())
}
