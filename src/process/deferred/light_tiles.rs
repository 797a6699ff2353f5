//! The lights that may reach each tile of the picture.

#[cfg(feature = "software")]
pub(super) mod cpu_shader;

use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, Target, TargetSize};

/// Marks the lights that may reach each tile of 32 × 32 pixels, for a shader that sums lights: so that a pixel tests
/// those of its tile, and not all.
///
/// A tile's marks are in the pixels of a target of half the picture's size that the tile covers: 24 bits in each,
/// because f32 holds whole numbers up to 2²⁴. So there are 6,144 bits; if there are more lights, or fewer pixels at the
/// picture's edge, a bit stands for several lights.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightTiles;

impl LightTiles {
    pub(super) const NAME: &str = "tiles of lights";
    pub(super) const TARGET: Target = Target::new("light tiles");
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
