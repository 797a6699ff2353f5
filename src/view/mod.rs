//! Views: "everything is a camera" (M 10.4). Tables that all views of a frame share, and culling for each view.
//!
//! An embedder uses [`ShadowMaps`], [`RenderView`] and [`RejectionReason`]; everything else is public for this
//! repository's tests and benchmarks.

mod bounding_boxes;
mod bounding_spheres;
mod fill;
mod fixed_position;
mod frustum;
mod gpu_light;
mod gpu_object;
mod gpu_view;
mod light_table;
mod object_table;
mod occlusion;
mod rejection;
mod render_view;
mod shadow_maps;
mod subdivision_level;
mod triangle_culling;
mod visible_set;

pub use bounding_boxes::{BoundingBoxes, OrientedBox};
pub use bounding_spheres::{BoundingSphere, BoundingSpheres};
pub(crate) use fill::Fill;
pub use fixed_position::FixedPosition;
pub use frustum::Frustum;
pub use gpu_light::GpuLight;
pub use gpu_object::GpuObject;
pub use gpu_view::GpuView;
pub use light_table::{LightClass, LightTable};
pub use object_table::{ObjectBlock, ObjectDraw, ObjectTable};
pub use occlusion::{OccluderMeshes, OcclusionCuller};
pub use rejection::{Rejection, RejectionReason, Rejections};
pub use render_view::RenderView;
pub use shadow_maps::ShadowMaps;
pub use visible_set::VisibleSet;
pub(crate) use visible_set::set_bits;
