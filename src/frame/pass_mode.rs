//! What kind of pass it is: which stages it has.

use crate::command::{Blending, DrawOrder, Selection};
use crate::quality::DepthPrecision;
use crate::scene::Projection;
use crate::view::RenderView;

/// What decides which stages a pass has, and its view: fixed for a stage graph. The frame has a mode of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PassMode {
    /// Whether it draws objects.
    pub(super) draws_objects: bool,
    /// Whether it orders its objects by bin, and so makes no commands.
    pub(super) orders_by_bin: bool,
    /// Whether the scene has static groups.
    pub(super) has_static_groups: bool,
    /// Whether views choose levels of detail.
    pub(super) chooses_levels: bool,
    /// Whether the view can test for occlusion.
    pub(super) tests_occlusion: bool,
    /// Whether the scene has meshes whose triangles are culled.
    pub(super) has_cullable_meshes: bool,
}

impl PassMode {
    pub(super) fn always(self) -> bool {
        true
    }

    pub(super) fn draws_objects(self) -> bool {
        self.draws_objects
    }

    /// Whether the pass makes commands of its objects, and sorts them.
    pub(super) fn sorts_commands(self) -> bool {
        self.draws_objects && !self.orders_by_bin
    }

    pub(super) fn orders_by_bin(self) -> bool {
        self.draws_objects && self.orders_by_bin
    }

    pub(super) fn has_static_groups(self) -> bool {
        self.has_static_groups
    }

    /// Whether the pass's draw list has a place for static groups.
    pub(super) fn lists_static_groups(self) -> bool {
        self.orders_by_bin() && self.has_static_groups
    }

    pub(super) fn chooses_levels(self) -> bool {
        self.draws_objects && self.chooses_levels
    }

    #[cfg(feature = "occlusion")]
    pub(super) fn tests_occlusion(self) -> bool {
        self.draws_objects && self.tests_occlusion
    }

    #[cfg(feature = "occlusion")]
    pub(super) fn has_cullable_meshes(self) -> bool {
        self.draws_objects && self.has_cullable_meshes
    }
}

/// Whether a pass orders its objects by bin, and not by depth: it draws opaque ones alone, nothing asks for an order,
/// and the view is not a paraboloid, where the subdivision level gives an object another state.
pub(super) fn orders_by_bin(selection: Selection, view: &RenderView, opaque_order: DepthPrecision) -> bool {
    (selection.order, selection.blending) == (DrawOrder::ByState, Blending::Opaque)
        && opaque_order.bits == 0
        && view.camera.projection != Projection::Paraboloid
}
