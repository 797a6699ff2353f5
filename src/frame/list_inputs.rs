//! What a draw list is made from.

use glam::{DVec3, Quat};

use crate::command::{Selection, Version};
use crate::scene::Camera;

/// What a draw list is made from: equal inputs make equal lists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ListInputs {
    /// The version of the view's visible set.
    pub(super) visible: Version,
    /// The versions of the lists of static groups and of the static groups that the view executes; `None` for a scene
    /// without static groups, or a pass that orders its objects by depth.
    pub(super) static_groups: Option<[Version; 2]>,
    /// The version of the levels of detail in the view; `None` if all are 0.
    pub(super) levels: Option<Version>,
    pub(super) selection: Selection,
    /// The epoch of the object table, if the layers of objects decide which are drawn.
    pub(super) layers: Option<u64>,
    /// Counts how often the type of a material changed.
    pub(super) material_types: u64,
    pub(super) instancing: bool,
    pub(super) order: OrderInputs,
}

/// What the order of a list depends on, beside the visible set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum OrderInputs {
    /// By bin: the epoch in which an object was last drawn in another way.
    Bins { draws_changed_in: u64 },
    /// By depth: the epoch of the object table, and the camera.
    Depth { epoch: u64, position: DVec3, orientation: Quat, near: f32, far: f32 },
}

impl OrderInputs {
    pub(super) fn of_depth(epoch: u64, camera: &Camera) -> Self {
        let &Camera { position, orientation, near, far, .. } = camera;
        Self::Depth { epoch, position, orientation, near, far }
    }
}
