//! Haze: distant land fades into the sky.

use drawloom::bytemuck;
use drawloom::glam::Vec3;
use drawloom::process::{BlendEquation, Declare, Draws, FullScreen, InjectionPoint, RenderProcess, targets};

/// Draws haze over everything, thicker with distance.
pub struct Haze {
    /// Linear radiance.
    color: Vec3,
}

impl Haze {
    pub fn new(color: Vec3) -> Self {
        Self { color }
    }
}

impl RenderProcess for Haze {
    fn name(&self) -> &str {
        "haze"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.samples(targets::DEPTH);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        // Drivers may inline a uniform buffer's first member, so it is one that the shader does not read.
        let parameters: [[f32; 4]; 2] = [[0.0; 4], self.color.extend(0.0).to_array()];
        Draws::FullScreen(FullScreen {
            shader: include_str!("haze.wgsl"),
            parameters: bytemuck::cast_slice(&parameters).to_vec().into(),
            blend_equations: vec![BlendEquation::PREMULTIPLIED_ALPHA],
            ..FullScreen::default()
        })
    }
}
