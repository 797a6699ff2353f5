//! All images of a file as layers of a few texture arrays, because a process has the same textures for all materials.

use std::collections::BTreeMap;
use std::sync::Arc;

use drawloom::task::Scheduler;
use image::RgbaImage;
use image::imageops::{self, FilterType};
use indicatif::ProgressBar;

use crate::error::Problem;
use crate::mip_levels::with_mip_levels;

/// The number of arrays that the shader has.
pub(crate) const ARRAYS: usize = 4;

/// How the channels of an image are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ColorSpace {
    /// Colours.
    Srgb,
    /// Numbers.
    Linear,
}

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

/// Texture arrays, at most [`ARRAYS`].
#[derive(Debug, Default)]
pub(crate) struct TextureArrays {
    pub(crate) arrays: Vec<TextureArray>,
    /// The array and the layer of each use.
    layers: Vec<[u32; 2]>,
}

/// Images of one size.
#[derive(Debug)]
pub(crate) struct TextureArray {
    pub(crate) size: [u32; 2],
    /// The RGBA bytes of each layer: all mip levels, the largest first.
    pub(crate) layers: Vec<Vec<u8>>,
}

impl TextureArrays {
    /// Scales images to the sizes of the arrays, and makes their mip levels, in background jobs.
    ///
    /// # Errors
    /// If the arrays would be too large.
    pub(crate) fn new(
        uses: &TextureUses,
        images: &BTreeMap<usize, Arc<RgbaImage>>,
        scheduler: &Scheduler,
        progress: &ProgressBar,
    ) -> Result<Self, Problem> {
        let size_of_use = |used: &TextureUse| <[u32; 2]>::from(images[&used.image].dimensions());
        let (sizes, array_of_size) = array_sizes(uses.uses.iter().map(size_of_use));
        let array_of = |used: &TextureUse| array_of_size[&size_of_use(used)];
        let bytes =
            uses.uses.iter().map(|used| sizes[array_of(used)].map(u64::from)).map(|[width, height]| width * height * 4);
        let count = bytes.sum::<u64>();
        if count > MAX_BYTES {
            let (element, what) = ("the scene".to_owned(), "bytes of textures");
            return Err(Problem::TooMany { element, what, count, limit: MAX_BYTES });
        }
        let mut arrays: Vec<_> = sizes.iter().map(|&size| TextureArray { size, layers: Vec::new() }).collect();
        let mut jobs = Vec::new();
        for used in &uses.uses {
            let (image, space, [width, height]) = (Arc::clone(&images[&used.image]), used.space, sizes[array_of(used)]);
            jobs.push(scheduler.background(move || {
                let fits = image.dimensions() == (width, height);
                let image = if fits {
                    RgbaImage::clone(&image)
                } else {
                    imageops::resize(&*image, width, height, FilterType::Triangle)
                };
                with_mip_levels(image, space)
            }));
        }
        let mut layers = Vec::new();
        for (used, job) in uses.uses.iter().zip(jobs) {
            let array = array_of(used);
            let panicked =
                |panic: drawloom::task::JobPanic| Problem::Image { image: used.image, reason: panic.to_string() };
            layers.push([array as u32, arrays[array].layers.len() as u32]);
            arrays[array].layers.push(job.wait().map_err(panicked)?);
            progress.inc(1);
        }
        Ok(Self { arrays, layers })
    }

    /// Where a use is, as shaders read it: the array above the layer.
    pub(crate) fn place(&self, used: u32) -> u32 {
        let [array, layer] = self.layers[used as usize];
        array << 16 | layer
    }
}

/// The greatest number of bytes of all arrays without their mip levels.
const MAX_BYTES: u64 = 4 << 30;

/// The sizes of the arrays, and which of them images of a size are in. If there are more sizes than arrays, small images are scaled up.
fn array_sizes(of_images: impl Iterator<Item = [u32; 2]>) -> (Vec<[u32; 2]>, BTreeMap<[u32; 2], usize>) {
    // Each group: its size, and the sizes of images in it.
    let mut groups: Vec<([u32; 2], Vec<[u32; 2]>)> = Vec::new();
    for size in of_images {
        if !groups.iter().any(|(of_group, _)| *of_group == size) {
            groups.push((size, vec![size]));
        }
    }
    while groups.len() > ARRAYS {
        groups.sort_by_key(|([width, height], _)| std::cmp::Reverse(u64::from(*width) * u64::from(*height)));
        if let (Some((small, of_small)), Some((larger, of_larger))) = (groups.pop(), groups.last_mut()) {
            *larger = [larger[0].max(small[0]), larger[1].max(small[1])];
            of_larger.extend(of_small);
        }
    }
    let of_group = |(array, (_, sizes)): (usize, &(_, Vec<[u32; 2]>))| {
        sizes.iter().map(move |&size| (size, array)).collect::<Vec<_>>()
    };
    let array_of_size = groups.iter().enumerate().flat_map(of_group).collect();
    (groups.into_iter().map(|(size, _)| size).collect(), array_of_size)
}
