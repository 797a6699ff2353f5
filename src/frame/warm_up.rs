//! Warming up: frames that are drawn while a world is loaded, so that no later frame waits for what they have made.

use std::vec;

use glam::Vec3;

use super::renderer::FrameScope;
use super::{FrameError, FrameInputs, RecordedFrame, Renderer};
use crate::backend::Backend;
use crate::process::Requirements;
use crate::scene::{Camera, Changes, Light, LightFieldsMut, SceneRef};
use crate::view::LightClass;

/// Frames to draw while a world is loaded, whose pictures are not shown.
///
/// Many drivers compile a shader when something is first drawn with it, for the formats and numbers of layers of the
/// textures that are bound then. [`Renderer::prepare_pipelines`] makes pipelines, but draws nothing. A warm-up draws
/// what a scene may require when lights, blended objects and reflections come and go: first the whole scene; then, for
/// each class of lights that it has, one light and no other; then no light at all, with everything else, without
/// transparency, and without reflections. It also uploads the scene's meshes and textures, and makes its targets.
///
/// So it varies the standard facts of [`Requirements`]. It does not vary what only a pipeline of the engine's knows,
/// [`Requirements::own`]: each frame has what the pipeline says then. An engine whose pipeline has such bits draws a
/// warm-up for each value that has shaders of its own, and changes what the pipeline says in between.
/// [`Renderer::prepare_pipelines`] makes the pipelines for other values too, if the pipeline
/// [names them](crate::process::Pipeline::to_prepare).
///
/// The scene holds everything that later frames may have, at the size of the later pictures. Its lights may be out of
/// sight or dark, as those that are switched off are: a light that is drawn alone stands before a camera, and shines.
/// Objects that no camera of the scene sees are not drawn, so neither is what only their materials need. Buffers that
/// processes change keep what they hold. The first frame after the warm-up is [one without frames before
/// it](Renderer::forget_previous_frames).
///
/// ```
/// # #[cfg(feature = "wgpu")]
/// # use drawloom::{Renderer, Submitter, WarmUp, backend::WgpuBackend, scene::SceneRef};
/// # #[cfg(feature = "wgpu")]
/// # fn load(
/// #     renderer: &mut Renderer<WgpuBackend>, submitter: &Submitter<WgpuBackend>, world: SceneRef<'_>,
/// # ) -> Result<(), Box<dyn std::error::Error>> {
/// let mut warm_up = WarmUp::new(world);
/// while let Some(frame) = warm_up.record_next(renderer)? {
///     submitter.submit(frame)?.submission.wait()?;
///     println!("{} frames left", warm_up.frames_left());
/// }
/// # Ok(())
/// # }
/// ```
pub struct WarmUp<'a> {
    scene: SceneRef<'a>,
    frames: vec::IntoIter<WarmUpFrame>,
}

/// What a frame of a warm-up draws of the scene.
struct WarmUpFrame {
    lights: Vec<Light>,
    transparency: bool,
    /// Whether it has the views that a scene may do without: reflections.
    optional_views: bool,
}

impl<'a> WarmUp<'a> {
    /// The warm-up for a scene.
    pub fn new(scene: SceneRef<'a>) -> Self {
        let frame = |lights, transparency, optional_views| WarmUpFrame { lights, transparency, optional_views };
        let of_class = |class| {
            let mut lights = scene.lights.iter().filter(|light| LightClass::of(light, true) == class);
            lights.find(|light| light.check(0).is_ok())
        };
        let main = scene.cameras.iter().find(|camera| camera.kind.rules().owns_shadow_maps).or(scene.cameras.first());
        let alone = |light: &Light| frame(vec![main.map_or(*light, |camera| shining_from(camera, *light))], true, true);
        let mut frames = vec![frame(scene.lights.to_vec(), true, true)];
        frames.extend(LightClass::all().filter_map(of_class).map(alone));
        frames.push(frame(Vec::new(), true, true));
        if Requirements::any_needs_transparency(&scene) {
            frames.push(frame(Vec::new(), false, true));
        }
        let is_optional = |camera: &Camera| camera.kind.rules().is_optional;
        if scene.cameras.iter().any(is_optional) && !scene.cameras.iter().all(is_optional) {
            frames.push(frame(Vec::new(), true, false));
        }
        Self { scene, frames: frames.into_iter() }
    }

    /// The number of frames that are not recorded yet.
    pub fn frames_left(&self) -> usize {
        self.frames.len()
    }

    /// Records the next frame, which the engine submits; `None` after the last one. The engine waits for the device
    /// between frames, as the driver may compile in the meantime.
    ///
    /// # Errors
    /// As [`Renderer::record`]. The warm-up goes on with the frame after it.
    pub fn record_next<B: Backend>(
        &mut self,
        renderer: &mut Renderer<B>,
    ) -> Result<Option<RecordedFrame<B>>, FrameError> {
        let Some(WarmUpFrame { lights, transparency, optional_views }) = self.frames.next() else { return Ok(None) };
        let is_drawn = |camera: &&Camera| optional_views || !camera.kind.rules().is_optional;
        let cameras: Vec<_> = self.scene.cameras.iter().filter(is_drawn).cloned().collect();
        let scene = SceneRef { lights: &lights, cameras: &cameras, changes: Changes::Unknown, ..self.scene };
        let recorded = renderer.record_part(&FrameInputs::new(scene), FrameScope { transparency, lacks_items: true });
        renderer.forget_previous_frames();
        recorded.map(Some)
    }
}

/// The light at the near plane of a camera, in its direction, and bright enough to be drawn.
fn shining_from(camera: &Camera, mut light: Light) -> Light {
    let along = (camera.orientation * Vec3::NEG_Z).normalize();
    // Behind the near plane the volume of a light with a short range would not be seen.
    let at = camera.position + along.as_dvec3() * f64::from(camera.near);
    let LightFieldsMut { position, direction, color, .. } = light.fields_mut();
    *color = color.max(Vec3::ONE);
    if let Some(position) = position {
        *position = at;
        direction.into_iter().for_each(|direction| *direction = along);
    }
    light
}
