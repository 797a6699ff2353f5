//! The settings of frames that trade accuracy for speed.
//!
//! Those of a pipeline, a camera or a view are where these are:
//! [`ShadowMaps::cascades`](crate::view::ShadowMaps::cascades) and
//! [`max_distance`](crate::view::ShadowMaps::max_distance), [`Camera::redraw`](crate::scene::Camera::redraw),
//! [`Camera::impostor`](crate::scene::Camera::impostor) and the forms of views in a [`ViewBudget`](crate::ViewBudget).

mod culling_volume;
mod depth_precision;
mod formats;
mod knobs;
mod quality_error;
mod radiance_sum;
mod settings;
mod shadow_quality;
mod tone_curve;
mod transform_precision;

pub use culling_volume::CullingVolume;
pub(crate) use depth_precision::DepthQuantizer;
pub use depth_precision::{DepthCurve, DepthPrecision};
pub use formats::{DiffuseFormat, NormalFormat, VertexFormat};
pub use knobs::Knob;
pub use quality_error::QualityError;
pub use radiance_sum::RadianceSum;
pub use settings::Quality;
pub use shadow_quality::ShadowQuality;
pub use tone_curve::ToneCurve;
pub use transform_precision::TransformPrecision;
