//! What frames request of a backend and give to it, within its limits.

use std::array;
use std::sync::Arc;
use std::time::Duration;

use glam::Vec3;

use super::BackendError;
use crate::command::DrawList;
use crate::fence::FenceSetter;
use crate::process::{Draws, FramePlan, Items, Pass, SampledViews};
use crate::quality::Quality;
use crate::scene::{GeneratedContents, Light, SceneRef};
use crate::view::{GpuLight, GpuObject, GpuView, LightTable, ObjectTable, RenderView, SceneIssues};

/// Everything that a backend needs to know of a frame.
#[derive(Clone, Copy)]
pub struct FrameRequest<'a> {
    /// The render processes and their targets.
    pub plan: &'a FramePlan,
    /// What each render process draws, in the plan's order.
    pub draws: &'a [Draws<'a>],
    /// The views. The targets of a cached view still hold what an earlier frame drew: see [`RenderView::is_cached`].
    pub views: &'a [RenderView],
    /// The valid lights of the scene, in its order. With several main cameras, a directional light that casts shadows
    /// is followed by a copy for each that has maps of it.
    pub lights: &'a [Light],
    /// The lights that reach each view.
    pub light_tables: &'a [LightTable],
    /// Each render process in each of its views, in submission order.
    pub passes: &'a [Pass],
    /// The views that passes sample.
    pub sampled_views: &'a SampledViews,
    /// The scene.
    pub scene: &'a SceneRef<'a>,
    /// The items that the engine lends.
    pub items: &'a [Items<'a>],
    /// The items of each pass, by index among those that are lent; `None` for one that draws no items.
    pub items_of_passes: &'a [Option<usize>],
    /// What all views need to know about the scene's objects. Blocks are complete when they are uploaded.
    pub objects: &'a ObjectTable,
    /// The most objects that a draw list has: all of the scene, and once more those of its static groups.
    pub list_capacity: usize,
    /// What CPU nodes fill while the frame is recorded, for the device when it is submitted. Complete when all passes
    /// are finished.
    pub generated: &'a [Arc<GeneratedContents>],
    /// Whether the backend records passes in bundles, even if another strategy is cheaper, unless the engine has fixed
    /// one. Set for [`PerDraw`](crate::Granularity::PerDraw) and [`Chunk`](crate::Granularity::Chunk).
    pub records_bundles: bool,
    /// The number of workers that record the frame.
    pub workers: usize,
    /// The frame's accuracy.
    pub quality: &'a Quality,
    /// The backend's [limits](super::Backend::limits). What is beyond them is not drawn: a backend that keeps arrays of
    /// the scene's lights or materials may cut them off there.
    pub limits: SceneLimits,
    /// Counts what the backend leaves out.
    pub scene_issues: &'a SceneIssues,
}

impl<'a> FrameRequest<'a> {
    /// All items that the engine lends for a pass, by index; `None` if it draws none.
    pub fn items_of(&self, pass: usize) -> Option<&'a Items<'a>> {
        self.items_of_passes.get(pass).copied().flatten().map(|index| &self.items[index])
    }

    /// One of the views, by index.
    pub fn view(&self, index: usize) -> ViewRequest<'_> {
        ViewRequest {
            index,
            view: &self.views[index],
            light_table: &self.light_tables[index],
            views: self.views,
            lights: self.lights,
            ambient: self.scene.ambient,
        }
    }

    /// # Errors
    /// If the camera of a view is out of reach.
    pub(crate) fn check_reach(&self) -> Result<(), BackendError> {
        match self.views.iter().find(|view| !GpuView::is_in_reach(view)) {
            Some(view) => Err(BackendError::ViewOutOfReach { view: view.name().to_owned() }),
            None => Ok(()),
        }
    }
}

/// Everything that a backend needs to know of one view of a frame.
#[derive(Clone, Copy)]
pub struct ViewRequest<'a> {
    /// The view's index.
    pub index: usize,
    /// The view.
    pub view: &'a RenderView,
    /// The lights that reach it.
    pub light_table: &'a LightTable,
    /// The views of the frame, among them those of the shadow maps that the lights have.
    pub views: &'a [RenderView],
    /// See [`FrameRequest::lights`].
    pub lights: &'a [Light],
    /// The scene's ambient light.
    pub ambient: Vec3,
}

impl ViewRequest<'_> {
    /// What shaders read of the view.
    ///
    /// # Errors
    /// If the camera is out of reach.
    pub fn gpu_view(&self) -> Result<GpuView, BackendError> {
        let gpu_view = GpuView::new(self.view, self.ambient, self.light_table.light_count());
        let ends = self.light_table.class_ends();
        let light_ends = array::from_fn(|class| ends.get(class).copied().unwrap_or(u32::MAX));
        gpu_view
            .map(|gpu_view| GpuView { light_ends, ..gpu_view })
            .ok_or_else(|| BackendError::ViewOutOfReach { view: self.view.name().to_owned() })
    }
}

/// Everything that a backend needs to know of one pass of a frame.
#[derive(Clone, Copy)]
pub struct PassRequest<'a> {
    /// The frame.
    pub frame: &'a FrameRequest<'a>,
    /// The index of the pass in [`FrameRequest::passes`].
    pub index: usize,
    /// The render process and the view.
    pub pass: Pass,
    /// Its batches, or its items; empty for a pass that draws neither.
    pub list: &'a DrawList,
}

impl<'a> PassRequest<'a> {
    /// All items that the engine lends for the pass; `None` if it draws none.
    pub fn items(&self) -> Option<&'a Items<'a>> {
        self.frame.items_of(self.index)
    }

    /// Divides a time that was spent on passes together among them, by what each costs relative to the others: a share
    /// for each, in order.
    pub(crate) fn divide_time<'b>(
        passes: &'b [PassRequest<'_>],
        time: Duration,
    ) -> impl Iterator<Item = Duration> + 'b {
        // A pass costs something without batches too.
        divide_by_costs(time, passes.iter().map(|pass| 1 + pass.list.draw_count() as u64))
    }
}

fn divide_by_costs(time: Duration, costs: impl Iterator<Item = u64> + Clone) -> impl Iterator<Item = Duration> {
    let (time, all) = (time.as_nanos() as u64, costs.clone().sum::<u64>());
    costs.map(move |cost| Duration::from_nanos(time * cost / all))
}

/// What a backend can hold of a scene: the limits of its device's buffers and textures. A frame draws what is within
/// them, leaves out the rest, and counts it among its [scene issues](crate::FrameStatistics::scene_issues).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneLimits {
    /// The size of the largest buffer, in bytes: what the lights of all views can take together.
    pub buffer_bytes: u64,
    /// The most bytes of a buffer that a shader can read: all objects, a [column](crate::scene::ObjectColumn), all
    /// materials, their values of a [type](crate::scene::MaterialType), or the lights of a view. In each of them, every
    /// object, material slot or light has an element.
    pub binding_bytes: u64,
    /// The most layers of a texture: what shadow maps can take together. Lights without room for theirs are counted as
    /// [`ShadowMapLimit`](crate::view::IssueReason::ShadowMapLimit).
    pub texture_layers: u32,
}

impl SceneLimits {
    /// No limits but those of memory, and 256 layers of a texture, as most devices have.
    pub const NONE: Self = Self { buffer_bytes: u64::MAX, binding_bytes: u64::MAX, texture_layers: 256 };

    /// The maximum number of objects if shaders read columns of up to `column_stride` bytes an object. Each object also
    /// takes 64 bytes itself. Objects at higher indices are counted as
    /// [`ObjectLimit`](crate::view::IssueReason::ObjectLimit).
    pub fn max_objects(&self, column_stride: usize) -> usize {
        elements(self.binding_bytes, column_stride.max(size_of::<GpuObject>()))
    }

    /// The most lights that a view can have, each layer of shadow maps counted as another one if a light has several.
    /// Lights that come later in the scene are counted as [`LightLimit`](crate::view::IssueReason::LightLimit).
    pub fn max_lights(&self) -> usize {
        elements(self.binding_bytes, size_of::<GpuLight>())
    }
}

impl Default for SceneLimits {
    /// [`SceneLimits::NONE`].
    fn default() -> Self {
        Self::NONE
    }
}

fn elements(bytes: u64, stride: usize) -> usize {
    usize::try_from(bytes / stride as u64).unwrap_or(usize::MAX)
}

/// The queue of one view: its finished passes in order, ready to submit (M 10.3).
#[derive(Debug)]
pub struct ViewQueue<T> {
    /// The view's index.
    pub view: usize,
    /// The passes, each with its commands.
    pub passes: Vec<(Pass, T)>,
}

/// A fence that the device sets at a place in a frame.
#[derive(Debug)]
pub struct FrameFence {
    /// The number of passes before the place, in submission order. If it is that of all passes, the place is the end of
    /// the frame, after everything that the backend adds.
    pub passes: usize,
    /// Sets the fence.
    pub setter: FenceSetter,
}

impl FrameFence {
    /// Sets the fences whose places come after this many passes at most, of fences that are in the order of their
    /// places. For devices that have done what is submitted when the call returns.
    ///
    /// ```
    /// # use drawloom::backend::FrameFence;
    /// # use drawloom::fence::Fence;
    /// let (setter, middle) = Fence::new("after two passes");
    /// let mut fences = vec![FrameFence { passes: 2, setter }];
    /// FrameFence::set_up_to(1, &mut fences);
    /// assert!(!middle.is_set());
    /// FrameFence::set_up_to(2, &mut fences);
    /// assert!(middle.is_set());
    /// ```
    pub fn set_up_to(passes: usize, fences: &mut Vec<Self>) {
        let reached = fences.iter().take_while(|fence| fence.passes <= passes).count();
        fences.drain(..reached).for_each(|fence| fence.setter.set());
    }
}

/// The memory of a frame's targets, without those that the engine imports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetMemory {
    /// The number of textures. One that several targets share counts once.
    pub textures: usize,
    /// The size of these textures in bytes.
    pub bytes: u64,
    /// What their size would be if no [transient targets](super::WgpuBackend::transient_targets) shared a texture.
    pub dedicated_bytes: u64,
}

#[cfg(feature = "wgpu")]
impl TargetMemory {
    /// Counts a texture of this size.
    pub(crate) fn add_texture(&mut self, bytes: u64) {
        self.textures += 1;
        self.bytes += bytes;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_is_proportional_to_the_cost() {
        let shares = divide_by_costs(Duration::from_micros(30), [1, 3, 2].into_iter());
        assert_eq!(shares.collect::<Vec<_>>(), [5, 15, 10].map(Duration::from_micros));
    }
}
