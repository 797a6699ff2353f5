//! All images of a file as layers of a few texture arrays, because a process has the same textures for all materials.
//!
//! Each image keeps its pixels: one that is smaller than its layer is in the upper left of it, and so are its mip
//! levels in those of the layer. The shader filters such an image itself.

use std::collections::BTreeMap;
use std::sync::Arc;

use drawloom::task::{JobPanic, Scheduler};

use crate::array_sizes::array_sizes;
use crate::images::NamedImage;
use crate::limits::GltfLimits;
use crate::mip_levels::{ColorSpace, mip_levels_within};
use crate::progress::StepCounter;
use crate::surface::TexturePlace;
use crate::warnings::Warnings;

/// The number of images that a texture array has at most: what usual devices allow.
const MAX_LAYERS: usize = 2048;

/// An image as materials use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TextureUse {
    pub(crate) image: usize,
    pub(crate) space: ColorSpace,
}

/// All uses of images, each with a number.
#[derive(Debug, Default)]
pub(crate) struct TextureUses {
    uses: Vec<TextureUse>,
    numbers: BTreeMap<TextureUse, u32>,
}

impl TextureUses {
    /// The number of a use.
    pub(crate) fn add(&mut self, used: TextureUse) -> u32 {
        *self.numbers.entry(used).or_insert_with(|| {
            self.uses.push(used);
            self.uses.len() as u32 - 1
        })
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.uses.len()
    }

    /// The indices of the images, each once.
    pub(crate) fn images(&self) -> impl Iterator<Item = usize> {
        let mut images: Vec<_> = self.uses.iter().map(|used| used.image).collect();
        images.sort_unstable();
        images.dedup();
        images.into_iter()
    }
}

/// Texture arrays, at most [`ARRAYS`](crate::array_sizes::ARRAYS).
#[derive(Debug, Default)]
pub(crate) struct TextureArrays {
    pub(crate) arrays: Vec<TextureArray>,
    /// Where each use is that has an image.
    places: BTreeMap<u32, TexturePlace>,
}

/// Images of one size, or of smaller ones.
#[derive(Debug)]
pub(crate) struct TextureArray {
    #[cfg_attr(not(feature = "draw"), expect(dead_code, reason = "only drawing needs it"))]
    pub(crate) size: [u32; 2],
    /// The RGBA bytes of each layer: all mip levels, the largest first.
    pub(crate) layers: Vec<Vec<u8>>,
}

impl TextureArray {
    /// One white pixel, where no image is.
    pub(crate) fn white() -> Self {
        Self { size: [1, 1], layers: vec![vec![255; 4]] }
    }
}

impl TextureArrays {
    /// Makes the mip levels of images in background jobs. Images that exceed the limit of all textures, or the number
    /// of layers that an array has, are left out, with a warning.
    pub(crate) fn new(
        uses: &TextureUses,
        images: BTreeMap<usize, Arc<NamedImage>>,
        limits: &GltfLimits,
        scheduler: &Scheduler,
        steps: &mut StepCounter<'_>,
        warnings: &mut Warnings,
    ) -> Self {
        let decoded = |(number, used): (u32, &TextureUse)| Some((number, *used, Arc::clone(images.get(&used.image)?)));
        let mut decoded: Vec<_> = (0..).zip(&uses.uses).filter_map(decoded).collect();
        let size_of = |image: &NamedImage| <[u32; 2]>::from(image.pixels.dimensions());
        // Sizes that do not fit together take more than the images do, so fewer of them may fit: the most that do are
        // searched for.
        let arrays_of = |count: usize| array_sizes(decoded[..count].iter().map(|(_, _, image)| size_of(image)));
        // From here on each image is freed when its last layer is made.
        drop(images);
        let fits =
            |count: usize| arrays_of(count).iter().map(|array| array.bytes()).sum::<u64>() <= limits.all_textures_bytes;
        let (mut kept, mut too_many) = (decoded.len(), decoded.len() + 1);
        if !fits(kept) {
            (kept, too_many) = (0, kept);
        }
        while too_many - kept > 1 {
            let middle = kept + (too_many - kept) / 2;
            if fits(middle) { kept = middle } else { too_many = middle }
        }
        for (_, _, image) in &decoded[kept..] {
            let (name, limit) = (&image.name, limits.all_textures_bytes);
            let reason = "with those before it, its texture array exceeds `GltfLimits::all_textures_bytes`";
            warnings.add(format!("{name} is left out: {reason}, which is {limit}"));
        }
        let sizes = arrays_of(kept);
        decoded.truncate(kept);
        let mut arrays: Vec<_> =
            sizes.iter().map(|array| TextureArray { size: array.size, layers: Vec::new() }).collect();
        let mut layers = vec![0; arrays.len()];
        let mut jobs = Vec::new();
        for (number, used, image) in decoded {
            let size = size_of(&image);
            let Some(array) = sizes.iter().position(|array| array.sizes.contains(&size)) else { continue };
            if layers[array] == MAX_LAYERS {
                let warning = format!("is left out: {MAX_LAYERS} other images share its texture array");
                warnings.add(format!("{} {warning}", image.name));
                continue;
            }
            layers[array] += 1;
            let (layer_size, space) = (sizes[array].size, used.space);
            let name = image.name.clone();
            let job = scheduler.background(move || mip_levels_within(&image.pixels, layer_size, space));
            jobs.push((number, name, array, size, job));
        }
        let mut places = BTreeMap::new();
        for (number, name, array, size, job) in jobs {
            match job.wait() {
                Ok(bytes) => {
                    let layers = &mut arrays[array].layers;
                    let layer = (array as u32) << 16 | layers.len() as u32;
                    places.insert(number, TexturePlace { layer, size });
                    layers.push(bytes);
                }
                Err(panic) => {
                    let panic: JobPanic = panic;
                    warnings.add(format!("{name} is left out: {panic}"));
                }
            }
            steps.step();
        }
        // No layer refers to an array that has none, and devices have no such array.
        let arrays =
            arrays.into_iter().map(|array| if array.layers.is_empty() { TextureArray::white() } else { array });
        Self { arrays: arrays.collect(), places }
    }

    /// Where a use is; `None` if it has no image.
    pub(crate) fn place(&self, used: u32) -> Option<TexturePlace> {
        self.places.get(&used).copied()
    }
}

#[cfg(test)]
mod tests {
    use image::RgbaImage;

    use super::*;
    use crate::array_sizes::ARRAYS;

    /// Images without pixels, which no decoder makes: their jobs panic, and two of them share an array.
    #[test]
    fn arrays_whose_images_are_all_lost_have_a_layer() {
        let (mut uses, mut images) = (TextureUses::default(), BTreeMap::new());
        for (image, [width, height]) in [[1, 0], [0, 1], [100, 100], [200, 200], [300, 300]].into_iter().enumerate() {
            uses.add(TextureUse { image, space: ColorSpace::Linear });
            let image_of_size =
                NamedImage { name: format!("image {image} (sky)"), pixels: RgbaImage::new(width, height) };
            images.insert(image, Arc::new(image_of_size));
        }
        let (scheduler, mut warnings) = (Scheduler::new(1).expect("one worker"), Warnings::new(10));
        let mut ignore = |_| ();
        let mut steps = StepCounter::new(5, &mut ignore);
        let made = TextureArrays::new(&uses, images, &GltfLimits::DEFAULT, &scheduler, &mut steps, &mut warnings);
        assert_eq!((made.arrays.len(), made.places.len()), (ARRAYS, 3));
        assert!(made.arrays.iter().all(|array| !array.layers.is_empty()));
        let warnings = warnings.take();
        let starts = ["image 0 (sky) is left out: ", "image 1 (sky) is left out: "];
        assert!(
            warnings.len() == 2 && starts.iter().zip(&warnings).all(|(start, it)| it.starts_with(start)),
            "{warnings:?}"
        );
    }
}
