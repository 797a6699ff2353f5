//! A picture as numbers.

use drawloom::backend::Picture;
use drawloom::process::Format;
use half::f16;
use libtest_mimic::Failed;

/// A view's `radiance` and its `picture`.
#[derive(Clone)]
pub struct Look {
    pub size: [usize; 2],
    /// Red, green and blue, row by row from the top.
    radiance: Vec<[f64; 3]>,
    /// What was made of it.
    picture: Vec<u8>,
}

/// What several lights add up to may be past the end of half floats, and then it is infinite: tone mapping takes it for the
/// brightest there is.
///
/// # Errors
/// If a pixel's radiance is not a number, or infinitely less than nothing.
pub fn look(radiance: &Picture, picture: Picture) -> Result<Look, Failed> {
    let pixels = numbers(radiance)?;
    let size = [radiance.width as usize, radiance.height as usize];
    let is_broken = |channel: &f64| channel.is_nan() || *channel == f64::NEG_INFINITY;
    if let Some(broken) = pixels.iter().position(|pixel| pixel.iter().any(is_broken)) {
        let (x, y, value) = (broken % size[0], broken / size[0], pixels[broken]);
        let count = pixels.iter().flatten().filter(|channel| is_broken(channel)).count();
        return Err(format!("the radiance at ({x}, {y}) is {value:?}, and {count} channels are like that").into());
    }
    Ok(Look { size, radiance: pixels, picture: picture.bytes })
}

impl Look {
    pub fn radiance(&self, x: usize, y: usize) -> [f64; 3] {
        self.radiance[y * self.size[0] + x]
    }

    /// That of the middle.
    pub fn middle(&self) -> [f64; 3] {
        self.radiance(self.size[0] / 2, self.size[1] / 2)
    }

    /// The greatest magnitude of each channel.
    pub fn greatest(&self) -> [f64; 3] {
        self.radiance
            .iter()
            .fold([0.0; 3], |most, pixel| std::array::from_fn(|channel| pixel[channel].abs().max(most[channel])))
    }

    /// What share of the pixels is not as dark as nothing.
    pub fn covered(&self) -> f64 {
        let bright = self.radiance.iter().filter(|pixel| pixel.iter().any(|channel| *channel > 0.0)).count();
        bright as f64 / self.radiance.len() as f64
    }

    /// The root of the mean square by which two pictures differ, 0 to 255, and the share of pixels that are off by more than 8.
    pub fn distance(&self, other: &Self) -> [f64; 2] {
        let off = || self.picture.iter().zip(&other.picture).map(|(one, other)| f64::from(one.abs_diff(*other)));
        let mean_square = off().map(|off| off * off).sum::<f64>() / self.picture.len() as f64;
        let pixels = off().collect::<Vec<_>>();
        let far = pixels.chunks_exact(4).filter(|pixel| pixel.iter().any(|channel| *channel > 8.0)).count();
        [mean_square.sqrt(), far as f64 / (pixels.len() / 4) as f64]
    }
}

/// Fails where two pictures of what is to look the same do not. Where an edge runs just through the middle of a pixel, a
/// rounding decides which side that pixel shows: so two pixels of a hundred may be anything.
pub fn assert_alike(what: &str, one: Option<&Look>, other: Option<&Look>) -> Result<(), Failed> {
    let (Some(one), Some(other)) = (one, other) else { return Ok(()) };
    let [root_mean_square, share] = one.distance(other);
    if root_mean_square <= 2.55 || share <= 0.02 {
        return Ok(());
    }
    Err(format!("{what}: differs by {root_mean_square:.2} of 255, and at {:.1}% of the pixels", share * 100.0).into())
}

fn numbers(picture: &Picture) -> Result<Vec<[f64; 3]>, Failed> {
    let bytes = &picture.bytes;
    let whole: Vec<f64> = match picture.format {
        Format::Rgba16Float => bytes.as_chunks().0.iter().map(|&half| f16::from_le_bytes(half).to_f64()).collect(),
        other => return Err(format!("radiance in {other:?}").into()),
    };
    Ok(whole.as_chunks::<4>().0.iter().map(|&[red, green, blue, _]| [red, green, blue]).collect())
}
