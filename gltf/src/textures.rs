//! The textures of materials: an image as colours or as numbers, with a sampler.

use std::collections::BTreeMap;
use std::sync::Arc;

use drawloom::handle::Handle;
use drawloom::scene::{Sampler, Scene, Texture, TextureFormat};

use crate::error::Problem;
use crate::images::NamedImage;
use crate::limits::GltfLimits;
use crate::warnings::Warnings;

/// An image as materials use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct TextureUse {
    pub(crate) image: usize,
    pub(crate) space: ColorSpace,
    pub(crate) sampler: Sampler,
}

/// How the channels of an image are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum ColorSpace {
    /// Colours.
    Srgb,
    /// Numbers.
    Linear,
}

/// Adds the textures that are used to a scene, in the order of the materials: those of which there is an image. Those
/// that exceed the limit of all textures are left out, with a warning.
///
/// # Errors
/// If a limit is exceeded.
pub(crate) fn add_textures(
    scene: &mut Scene,
    uses: impl Iterator<Item = TextureUse>,
    images: &BTreeMap<usize, Arc<NamedImage>>,
    limits: &GltfLimits,
    warnings: &mut Warnings,
) -> Result<BTreeMap<TextureUse, Handle<Texture>>, Problem> {
    let (mut textures, mut left_out, mut bytes) = (BTreeMap::new(), Vec::new(), 0_u64);
    // Textures that differ in their samplers share the pixels of an image.
    let mut of_images: BTreeMap<(usize, ColorSpace), Texture> = BTreeMap::new();
    for used in uses {
        let Some(image) = images.get(&used.image) else { continue };
        if textures.contains_key(&used) || left_out.contains(&used) {
            continue;
        }
        let format = match used.space {
            ColorSpace::Srgb => TextureFormat::Rgba8Srgb,
            ColorSpace::Linear => TextureFormat::Rgba8Unorm,
        };
        let new = || {
            let (size, pixels) = (<[u32; 2]>::from(image.pixels.dimensions()), image.pixels.as_raw().clone());
            let texture = Texture::with_levels(image.name.clone(), format, size, vec![pixels]);
            texture.map_err(Problem::of_scene(&image.name))
        };
        let texture = of_images.get(&(used.image, used.space)).map_or_else(new, |known| Ok(known.clone()));
        let Some(texture) = warnings.keep(texture, "a texture is left out")? else { continue };
        of_images.insert((used.image, used.space), texture.clone());
        bytes = bytes.saturating_add(texture.class().bytes());
        if bytes > limits.all_textures_bytes {
            let (name, limit) = (&image.name, limits.all_textures_bytes);
            let reason = "with its mip levels, and those before it, it exceeds `GltfLimits::all_textures_bytes`";
            warnings.add(format!("{name} is left out: {reason}, which is {limit}"));
            bytes -= texture.class().bytes();
            left_out.push(used);
            continue;
        }
        let added = scene.add(texture.sampled_by(used.sampler)).map_err(Problem::of_scene(&image.name));
        textures.extend(warnings.keep(added, "a texture is left out")?.map(|texture| (used, texture)));
    }
    Ok(textures)
}
