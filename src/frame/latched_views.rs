//! The cameras of a recorded frame, and their replacement until it is submitted: late latching.

use std::sync::Arc;

use glam::Vec3;

use super::LatchError;
use super::views::FrameViews;
use crate::backend::{BackendError, ViewRequest};
use crate::scene::{Camera, CameraMotion, SceneError};
use crate::view::{LightTable, RenderView};

/// The views of a recorded frame, and what it takes to replace the cameras of those that allow it.
pub(super) struct LatchedViews {
    /// As they were recorded.
    views: Arc<FrameViews>,
    ambient: Vec3,
    latched: Vec<LatchedView>,
}

/// A view whose camera may be replaced.
struct LatchedView {
    index: usize,
    /// With the camera that it is drawn with.
    view: RenderView,
    light_table: LightTable,
}

impl LatchedViews {
    /// `light_tables` are those of the views.
    pub(super) fn new(views: Arc<FrameViews>, light_tables: &[LightTable], ambient: Vec3) -> Self {
        let indexed = views.views.iter().zip(light_tables).enumerate();
        let latched = indexed.filter(|(_, (view, _))| view.may_be_replaced()).map(|(index, (view, light_table))| {
            LatchedView { index, view: view.clone(), light_table: light_table.clone() }
        });
        let latched = latched.collect();
        Self { views, ambient, latched }
    }

    /// The camera that a view, by index, is drawn with.
    pub(super) fn camera(&self, index: usize) -> Option<&Camera> {
        let latched = self.latched.iter().find(|latched| latched.index == index);
        latched.map(|latched| &latched.view).or_else(|| self.views.views.get(index)).map(|view| &view.camera)
    }

    /// The views as they were recorded.
    pub(super) fn recorded(&self) -> &[RenderView] {
        &self.views.views
    }

    /// Replaces the camera of a view. `write` hands the view to the backend.
    ///
    /// # Errors
    /// If the camera may not replace the one that was recorded, or `write` fails. Then nothing changes.
    pub(super) fn replace(
        &mut self,
        index: usize,
        camera: &Camera,
        write: impl FnOnce(&ViewRequest<'_>) -> Result<(), BackendError>,
    ) -> Result<(), LatchError> {
        let FrameViews { views, lights, .. } = &*self.views;
        let unknown = || LatchError::UnknownView { view: index, count: views.len() };
        let recorded = &views.get(index).ok_or_else(unknown)?.camera;
        let fixed = || LatchError::NotAllowed { view: recorded.name.clone() };
        let motion = recorded.late_latch.ok_or_else(fixed)?;
        let latched = self.latched.iter_mut().find(|latched| latched.index == index).ok_or_else(fixed)?;
        check(recorded, motion, camera)?;

        let before = (latched.view.camera.position, latched.view.camera.orientation);
        (latched.view.camera.position, latched.view.camera.orientation) = (camera.position, camera.orientation);
        latched.light_table.set_origin(camera.position, lights, views);
        let LatchedView { view, light_table, .. } = &*latched;
        let written = write(&ViewRequest { index, view, light_table, views, lights, ambient: self.ambient });
        if written.is_err() {
            (latched.view.camera.position, latched.view.camera.orientation) = before;
        }
        Ok(written?)
    }
}

/// # Errors
/// If the camera may not replace the recorded one.
fn check(recorded: &Camera, motion: CameraMotion, camera: &Camera) -> Result<(), LatchError> {
    let view = || recorded.name.clone();
    if let Some(property) = differing_property(recorded, camera) {
        return Err(LatchError::DifferentCamera { view: view(), property });
    }
    if let Some(reason) = camera.pose_problem() {
        return Err(SceneError::InvalidCamera { camera: view(), reason }.into());
    }
    let (moved, allowed) = (
        CameraMotion::between((recorded.position, recorded.orientation), (camera.position, camera.orientation)),
        motion.with_rounding(),
    );
    if moved.distance > allowed.distance || moved.angle > allowed.angle {
        let (distance, angle) = (moved.distance, moved.angle);
        return Err(LatchError::BeyondMotion { view: view(), distance, angle, allowed: motion });
    }
    Ok(())
}

/// The first property in which cameras differ that must not: all but position, orientation, the motion, and the whole
/// picture, which moves with the camera.
fn differing_property(one: &Camera, other: &Camera) -> Option<&'static str> {
    let properties = [
        ("name", one.name == other.name),
        ("projection", one.projection == other.projection),
        ("shift", one.shift == other.shift),
        ("clip_plane", one.clip_plane == other.clip_plane),
        ("near", one.near == other.near),
        ("far", one.far == other.far),
        ("size", one.size == other.size),
        ("level_of_detail_scale", one.level_of_detail_scale == other.level_of_detail_scale),
        ("layers", one.layers == other.layers),
        ("filter", one.filter == other.filter),
        ("samples_views", one.samples_views == other.samples_views),
        ("kind", one.kind == other.kind),
        ("redraw", one.redraw == other.redraw),
    ];
    properties.into_iter().find_map(|(property, is_same)| (!is_same).then_some(property))
}
