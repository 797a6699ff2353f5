//! Post-processing: what is done to a picture after lighting, step by step.

mod fxaa;
mod post_step;
mod shipped_step;
mod tone_mapping;

pub use fxaa::Fxaa;
pub use post_step::PostStep;
pub use tone_mapping::{Exposure, ToneMapping};
