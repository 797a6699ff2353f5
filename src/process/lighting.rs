//! Lighting (L 4.2).

use super::{Declare, Draws, FullScreen, RenderProcess};
use crate::scene::Blend;

/// Adds to the target `radiance` what every light, and the ambient light, makes each surface of the geometry buffer
/// reflect. Surfaces are Lambertian; nothing casts a shadow.
///
/// One full-screen pass goes over all lights: what L 4.2.1 does for a directional light, done for every kind.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lighting;

impl RenderProcess for Lighting {
    fn name(&self) -> &str {
        "lighting"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("depth");
        declare.samples("normal");
        declare.samples("diffuse");
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen {
            shader: include_str!("lighting.wgsl"),
            blend: Blend::Additive,
            ..FullScreen::default()
        })
    }
}
