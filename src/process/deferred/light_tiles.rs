//! The lights that may reach each tile of the picture.

#[cfg(feature = "software")]
pub(super) mod cpu_shader;

#[cfg(doc)]
use super::Deferred;
use super::shading::lighting_shader;
use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, Target, TargetSize};
use crate::view::ShadowMaps;

/// Marks the lights that may reach each tile of 32 × 32 pixels, for a shader that sums lights: so that a pixel tests
/// those of its tile, and not all.
///
/// A [`Deferred`] pipeline has this process if a [shader](crate::quality::RadianceSum::Shader) sums its lights. To
/// another one an engine adds it, for processes of its own that [sample](Declare::samples) the
/// [target](Self::TARGET) and have its [shader](Self::lighting_shader).
///
/// A tile's marks are in the pixels of a target of half the picture's size that the tile covers: 24 bits in each,
/// because f32 holds whole numbers up to 2²⁴. So there are 6,144 bits; if there are more lights, or fewer pixels at the
/// picture's edge, a bit stands for several lights.
#[derive(Clone, Copy, Debug)]
pub struct LightTiles;

impl LightTiles {
    pub(super) const NAME: &str = "tiles of lights";

    /// The marks, in whole numbers.
    pub const TARGET: Target = Target::new("light tiles");

    /// [`lighting_shader`] for a process that samples the marks at the binding
    /// `tiles` of `@group(2)`. `illuminance_in_tile(pixel, position, normal)` is what `illuminance_at(position, normal)`
    /// is, at a pixel of the view's picture: `vec2<u32>(in.clip.xy)`, if `clip` is the built-in position.
    pub fn lighting_shader(tiles: u32, maps: Option<(u32, &ShadowMaps)>) -> String {
        let binding = format!("@group(2) @binding({tiles}) var light_tiles: texture_2d<u32>;\n");
        let tiled_loop = include_str!("light_tiles/tiled_light_loop.wgsl");
        [&lighting_shader(maps), &binding, LIGHT_TILES_SHADER, tiled_loop].concat()
    }
}

/// WGSL that both the process and readers of its target need.
pub(super) const LIGHT_TILES_SHADER: &str = include_str!("light_tiles/light_tiles.wgsl");

impl RenderProcess for LightTiles {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color(Self::TARGET, Format::R32Uint, ClearColor::Value([0.0; 4]));
        declare.size(Self::TARGET, TargetSize::Divided(2));
    }

    fn draws(&self) -> Draws<'_> {
        const SHADER: &str =
            concat!(include_str!("light_tiles/light_tiles.wgsl"), include_str!("light_tiles/mark_lights.wgsl"));
        Draws::FullScreen(FullScreen { shader: SHADER, ..FullScreen::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        Some(crate::process::CpuShader::full_screen(cpu_shader::LightTilesCpuShader))
    }
}
