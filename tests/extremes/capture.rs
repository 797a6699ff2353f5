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

/// Reads both targets. Radiance may be infinite, where the sum of lights exceeds the range of half floats; tone mapping
/// clamps it.
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

    /// A part of it, whose upper left pixel is in column and row `corner`.
    pub fn part(&self, corner: [u32; 2], size: [u32; 2]) -> Self {
        let ([left, top], size) = (corner.map(|index| index as usize), size.map(|side| side as usize));
        let rows = (top..top + size[1]).map(|y| y * self.size[0] + left..y * self.size[0] + left + size[0]);
        let radiance = rows.clone().flat_map(|row| self.radiance[row].iter().copied()).collect();
        let picture = rows.flat_map(|row| self.picture[row.start * 4..row.end * 4].iter().copied()).collect();
        Self { size, radiance, picture }
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

    /// The number of bytes of the tone-mapped picture that differ, or of numbers of the radiance.
    pub fn different_bytes(&self, other: &Self) -> usize {
        let bytes = self.picture.iter().zip(&other.picture).filter(|(one, other)| one != other).count();
        let numbers = self.radiance.iter().flatten().zip(other.radiance.iter().flatten());
        bytes + numbers.filter(|(one, other)| one != other).count()
    }

    /// Whether each pixel, row by row, differs from that of another capture of the same size by more than rounding.
    pub fn differs_from(&self, other: &Self) -> Vec<bool> {
        let channels = self.picture.as_chunks::<4>().0.iter().zip(other.picture.as_chunks::<4>().0);
        channels.map(|(one, other)| are_different(one, other)).collect()
    }

    /// Whether each pixel differs by more than rounding from one of the eight around it.
    fn is_edge(&self) -> Vec<bool> {
        let pixels = self.picture.as_chunks::<4>().0;
        let center = |index: usize| pixels[index];
        (0..pixels.len())
            .map(|index| self.around(index, 1).any(|other| are_different(&center(index), &center(other))))
            .collect()
    }

    /// The indices of the pixels at most `reach` columns and rows from one.
    pub fn around(&self, index: usize, reach: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = self.size;
        let near = |center: usize, end: usize| center.saturating_sub(reach)..(center + reach + 1).min(end);
        let (columns, rows) = (near(index % width, width), near(index / width, height));
        rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
    }
}

/// Whether two pixels differ by more than [`ROUNDING`] in a channel.
fn are_different(one: &[u8; 4], other: &[u8; 4]) -> bool {
    one.iter().zip(other).any(|(one, other)| one.abs_diff(*other) > ROUNDING)
}

/// The most by which a channel of the picture may differ where both pictures show the same. Radiance is rounded to half
/// floats, 2⁻¹¹ of it, once for each light and pane: a dozen times at most, 0.6% in all. The tone curve and sRGB turn a
/// change of 1% into at most 0.3% of the range. So the two differ by half a step of 255 at most, and by 1 when both are
/// rounded to whole steps.
const ROUNDING: u8 = 1;

/// The greatest distance in pixels by which either of two pictures may have a vertex in the wrong place: see
/// [`GpuView`](drawloom::view::GpuView).
pub const PRECISION: f64 = 1e-3;

/// Fails if two pictures of equivalent scenes differ by more than what moving every vertex by up to `shift` pixels can
/// change.
///
/// A pixel shows another surface only if an edge passes its centre on the other side. Of the pixels that an edge runs
/// through, it passes a share of `2 shift` within `shift` of the centre. What that pixel shows instead may be visible
/// nowhere else, so there is no bound of its colour, but one of the number of such pixels: `2 shift` times the pixels
/// that differ from a neighbour. With a shift of 0 no pixel may differ.
pub fn assert_alike(context: &str, one: Option<&Capture>, other: Option<&Capture>, shift: f64) -> Result<(), Failed> {
    assert_alike_except(context, one, other, shift, |_| false)
}

/// The same of the pixels, by index, that are not excepted.
pub fn assert_alike_except(
    context: &str,
    one: Option<&Capture>,
    other: Option<&Capture>,
    shift: f64,
    is_excepted: impl Fn(usize) -> bool,
) -> Result<(), Failed> {
    let (Some(one), Some(other)) = (one, other) else { return Ok(()) };
    let different: Vec<_> =
        (0..).zip(one.differs_from(other)).filter(|&(index, differs)| differs && !is_excepted(index)).collect();
    let edges = other.is_edge().into_iter().filter(|is_edge| *is_edge).count();
    let most = (2.0 * shift * edges as f64).ceil() as usize;
    if different.len() <= most {
        return Ok(());
    }
    let [x, y] = [different[0].0 % one.size[0], different[0].0 / one.size[0]];
    let count = different.len();
    Err(format!("{context}: {count} pixels differ, of which ({x}, {y}) is the first, and {most} may").into())
}

fn numbers(picture: &Picture) -> Result<Vec<[f64; 3]>, Failed> {
    let bytes = &picture.bytes;
    let whole: Vec<f64> = match picture.format {
        Format::Rgba16Float => bytes.as_chunks().0.iter().map(|&half| f16::from_le_bytes(half).to_f64()).collect(),
        other => return Err(format!("radiance in {other:?}").into()),
    };
    Ok(whole.as_chunks::<4>().0.iter().map(|&[red, green, blue, _]| [red, green, blue]).collect())
}
