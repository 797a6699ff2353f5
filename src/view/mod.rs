//! Views: "everything is a camera" (M 10.4). Tables that all views of a frame share, and culling for each view.
//!
//! Engines use [`ShadowMaps`] and [`IssueReason`]. Backends also use the tables and the GPU layouts, most of which
//! are in the hidden module `internal`.

mod bounding_boxes;
mod cascades;
mod draw_states;
mod drawn_objects;
mod fixed_position;
mod frustum;
mod gpu_light;
mod gpu_object;
mod gpu_view;
mod bounds4;
mod item_table;
mod levels_of_detail;
mod light_table;
mod map_owners;
mod object_block;
mod object_description;
mod object_table;
#[cfg(feature = "occlusion")]
mod occlusion;
mod per_view;
mod scene_issue;
mod render_view;
mod shadow_maps;
mod subdivision_level;
mod texture_sets;
#[cfg(feature = "occlusion")]
mod triangle_culling;
mod view_registry;
mod visible_set;

pub(crate) use bounding_boxes::OrientedBox;
pub(crate) use bounds4::{Bounds4, Overlap};
pub(crate) use draw_states::{TableLimits, possible_draw_states};
pub(crate) use drawn_objects::{
    DrawFilter, Fill, VisibleRange, bin_objects, bin_visible, can_scan_bin_order, recordable_objects,
};
pub use frustum::BoundingSphere;
pub use gpu_view::GpuView;
pub(crate) use internal::*;
pub(crate) use item_table::{ItemColumns, ItemTable, ItemVisibility};
pub(crate) use levels_of_detail::{LevelSelector, MeshLevels, ObjectLevels};
pub use light_table::LightClass;
pub(crate) use map_owners::MapOwners;
pub(crate) use per_view::PerView;
pub use render_view::RenderView;
pub(crate) use render_view::ViewId;
pub use scene_issue::{IssueReason, SceneIssue, SceneIssues};
pub use shadow_maps::ShadowMaps;
pub(crate) use view_registry::ViewRegistry;

/// Tables and culling of a frame: for the tests and benchmarks of this repository. No part of the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::bounding_boxes::BoundingBoxes;
    pub use super::draw_states::UsedMeshes;
    pub use super::fixed_position::FixedPosition;
    pub use super::frustum::{BoundingSpheres, Frustum};
    pub use super::gpu_light::GpuLight;
    pub use super::gpu_object::GpuObject;
    pub use super::light_table::LightTable;
    pub use super::object_block::ObjectBlock;
    pub use super::object_description::ObjectDraw;
    pub use super::object_table::ObjectTable;
    #[cfg(feature = "occlusion")]
    pub use super::occlusion::{OccluderMeshes, OcclusionCuller};
    pub use super::texture_sets::{TextureArray, TextureSet, TextureSets};
    pub use super::visible_set::VisibleSet;
}
