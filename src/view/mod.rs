//! Views: "everything is a camera" (M 10.4). What there is, worked out once a frame, and what of it each view sees.

mod boxes;
mod fixed_position;
mod frustum;
mod light_table;
mod object_table;
mod occlusion;
mod rejection;
mod render_view;
mod shadow_maps;
mod spheres;
mod triangle_culling;
mod view_record;
mod visible_set;

pub use boxes::{Boxes, ObjectBox};
pub use fixed_position::FixedPosition;
pub use frustum::Frustum;
pub use light_table::{LightClass, LightRecord, LightTable};
pub use object_table::{ObjectBlock, ObjectDraw, ObjectRecord, ObjectTable};
pub use occlusion::{OccluderMeshes, Occlusion};
pub use rejection::{Rejection, RejectionReason, Rejections};
pub use render_view::RenderView;
pub use shadow_maps::ShadowMaps;
pub use spheres::{Spheres, WorldBounds};
pub use view_record::ViewRecord;
pub use visible_set::VisibleSet;
pub(crate) use visible_set::places;
