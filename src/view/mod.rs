//! Views: "everything is a camera" (M 10.4). Tables that all views of a frame share, and culling for each view.
//!
//! Engines use [`ShadowMaps`] and [`IssueReason`]. Backends also use the tables and the GPU layouts, most of which
//! are in the hidden module `internal`.

mod bin;
mod block_bounds;
mod block_reader;
mod bounding_boxes;
mod bounding_spheres;
mod camera_planes;
mod cascades;
mod changed_objects;
mod describe_block;
mod draw_states;
mod fill;
mod fixed_position;
mod frustum;
mod gpu_light;
mod gpu_object;
mod gpu_view;
mod bounds4;
mod level_errors;
mod level_selector;
mod light_table;
mod map_owners;
mod object_block;
mod object_description;
mod object_levels;
mod object_table;
#[cfg(feature = "occlusion")]
mod occlusion;
mod packet_columns;
mod per_view;
mod static_group_objects;
mod scene_issue;
mod render_view;
mod draw_filter;
mod shadow_maps;
mod subdivision_level;
mod table_limits;
#[cfg(feature = "occlusion")]
mod triangle_culling;
mod used_meshes;
mod view_registry;
mod visible_set;

pub(crate) use bin::{VisibleRange, bin_objects, bin_visible, can_scan_bin_order};
pub(crate) use bounding_boxes::OrientedBox;
pub(crate) use bounds4::{Bounds4, Overlap};
pub(crate) use draw_filter::DrawFilter;
pub(crate) use draw_states::possible_draw_states;
pub(crate) use fill::Fill;
pub use gpu_view::GpuView;
pub(crate) use internal::*;
pub(crate) use level_errors::MeshLevels;
pub(crate) use level_selector::LevelSelector;
pub(crate) use map_owners::MapOwners;
pub(crate) use object_levels::ObjectLevels;
pub(crate) use per_view::PerView;
pub use render_view::RenderView;
pub(crate) use render_view::ViewId;
pub use scene_issue::{IssueReason, SceneIssue, SceneIssues};
pub use shadow_maps::ShadowMaps;
pub(crate) use static_group_objects::recordable_objects;
pub(crate) use table_limits::TableLimits;
pub(crate) use view_registry::ViewRegistry;

/// Tables and culling of a frame: for the tests and benchmarks of this repository. No part of the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::bounding_boxes::BoundingBoxes;
    pub use super::bounding_spheres::{BoundingSphere, BoundingSpheres};
    pub use super::fixed_position::FixedPosition;
    pub use super::frustum::Frustum;
    pub use super::gpu_light::GpuLight;
    pub use super::gpu_object::GpuObject;
    pub use super::light_table::{LightClass, LightTable};
    pub use super::object_block::ObjectBlock;
    pub use super::object_description::ObjectDraw;
    pub use super::object_table::ObjectTable;
    #[cfg(feature = "occlusion")]
    pub use super::occlusion::{OccluderMeshes, OcclusionCuller};
    pub use super::used_meshes::UsedMeshes;
    pub use super::visible_set::VisibleSet;
}
