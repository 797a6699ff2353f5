//! A glow around bright objects: `radiance` at a half and a quarter of its size, added to itself.

use drawloom::process::{
    ClearColor, Declare, Draws, Format, FullScreen, InjectionPoint, RenderProcess, Target, TargetSize, targets,
};
use drawloom::scene::Blend;

const HALF: Target = Target::new("bloom, half");

/// Draws a blurred picture of a target into a smaller one.
pub struct BloomDown {
    source: Target,
    target: Target,
    divisor: u32,
    shader: &'static str,
}

impl BloomDown {
    /// What is brighter than white, at half the size.
    pub const HALF: Self = Self {
        source: targets::RADIANCE,
        target: HALF,
        divisor: 2,
        shader: concat!(include_str!("bloom_blur.wgsl"), include_str!("bloom_bright.wgsl")),
    };

    /// The same at a quarter of the size.
    pub const QUARTER: Self = Self {
        source: HALF,
        target: Target::new("bloom, quarter"),
        divisor: 4,
        shader: concat!(include_str!("bloom_blur.wgsl"), include_str!("bloom_all.wgsl")),
    };
}

impl RenderProcess for BloomDown {
    fn name(&self) -> &str {
        self.target.name()
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.samples(self.source);
        declare.clears_color(self.target, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
        declare.size(self.target, TargetSize::Divided(self.divisor));
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen { shader: self.shader, ..FullScreen::default() })
    }
}

/// Adds the smaller pictures to `radiance`.
pub struct BloomUp;

impl RenderProcess for BloomUp {
    fn name(&self) -> &str {
        "bloom"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterTransparency);
        declare.after(BloomDown::HALF.name());
        declare.samples(BloomDown::HALF.target);
        declare.samples(BloomDown::QUARTER.target);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = include_str!("bloom_up.wgsl");
        Draws::FullScreen(FullScreen { shader, blend: Blend::Additive, ..FullScreen::default() })
    }
}
