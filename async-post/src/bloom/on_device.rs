//! Bloom on the device.

use std::sync::Arc;

#[cfg(feature = "software")]
use drawloom::process::CpuShader;
use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, PostStep, RenderProcess, TargetSize};

#[cfg(feature = "software")]
use super::cpu_shader::{AddCpuShader, BlurCpuShader};
use super::kernel::{Kernel, MAX_RADIUS, NAME};

const ROWS: &str = "bloom rows";
const COLUMNS: &str = "bloom columns";

/// Blurs what is brighter than the threshold along rows.
pub(super) struct BloomRows {
    pub(super) source: String,
    pub(super) divisor: u32,
    pub(super) kernel: Kernel,
}

/// Blurs that along columns.
pub(super) struct BloomColumns {
    pub(super) divisor: u32,
    pub(super) kernel: Kernel,
}

fn declare_blur(declare: &mut Declare, [source, target]: [&str; 2], divisor: u32) {
    declare.samples(source);
    declare.clears_color(target, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    declare.size(target, TargetSize::Divided(divisor));
}

/// `Settings` in `blur.wgsl`: the step to the next pixel, the radius, the threshold, and the weights.
fn draw_blur(kernel: &Kernel, step: [u32; 2], threshold: f32) -> Draws<'static> {
    let mut weights = kernel.weights.clone();
    let radius = weights.len() as u32 - 1;
    weights.resize(MAX_RADIUS as usize + 1, 0.0);
    let mut words = vec![0, 0, 0, 0, step[0], step[1], radius, threshold.to_bits()];
    words.extend(weights.into_iter().map(f32::to_bits));
    let parameters = drawloom::bytemuck::cast_slice(&words).to_vec().into();
    Draws::FullScreen(FullScreen { shader: include_str!("blur.wgsl"), parameters, ..FullScreen::default() })
}

impl RenderProcess for BloomRows {
    fn name(&self) -> &str {
        ROWS
    }

    fn declare(&self, declare: &mut Declare) {
        declare_blur(declare, [&self.source, ROWS], self.divisor);
    }

    fn draws(&self) -> Draws<'_> {
        draw_blur(&self.kernel, [1, 0], self.kernel.threshold)
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(BlurCpuShader { kernel: self.kernel.clone(), step: [1, 0] }))
    }
}

impl RenderProcess for BloomColumns {
    fn name(&self) -> &str {
        COLUMNS
    }

    fn declare(&self, declare: &mut Declare) {
        declare_blur(declare, [ROWS, COLUMNS], self.divisor);
    }

    fn draws(&self) -> Draws<'_> {
        draw_blur(&self.kernel, [0, 1], 0.0)
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<CpuShader> {
        let kernel = Kernel { threshold: 0.0, ..self.kernel.clone() };
        Some(CpuShader::full_screen(BlurCpuShader { kernel, step: [0, 1] }))
    }
}

/// Adds the blurred picture to another one.
pub(super) struct BloomLayer {
    pub(super) strength: f32,
}

impl PostStep for BloomLayer {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        let (source, target) = (source.to_owned(), target.to_owned());
        Arc::new(BloomLayerProcess { source, target, strength: self.strength })
    }
}

struct BloomLayerProcess {
    source: String,
    target: String,
    strength: f32,
}

impl RenderProcess for BloomLayerProcess {
    fn name(&self) -> &str {
        NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        declare.samples(COLUMNS);
        declare.clears_color(&self.target, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let parameters = drawloom::bytemuck::cast_slice(&[0.0, 0.0, 0.0, self.strength]).to_vec().into();
        Draws::FullScreen(FullScreen { shader: include_str!("add.wgsl"), parameters, ..FullScreen::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(AddCpuShader { strength: self.strength }))
    }
}
