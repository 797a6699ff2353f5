//! Warming up: frames that are drawn while a world is loaded, so that no later frame waits for what they have made.

use std::vec;

use super::{FrameError, Recorded, Renderer};
use crate::backend::Backend;
use crate::scene::{Camera, Changes, Light, SceneRef, ViewKind};
use crate::view::LightClass;

/// Frames to draw while a world is loaded, and to show to nobody.
///
/// Many drivers compile a shader when something is first drawn with it, for the formats and numbers of layers of the textures that are bound
/// then. [`Renderer::prepare_pipelines`] makes pipelines, but draws nothing. A warm-up draws what a scene may require when lights, blended
/// objects and reflections come and go: the whole scene, then one light of each class and nothing else of its kind, then no light, no
/// transparency, and no reflections. It also uploads the scene's meshes and textures, and makes its targets.
///
/// The scene holds everything that later frames may have, such as lights that are still off, at the size of the later pictures. The first
/// frame after the warm-up is [one without frames before it](Renderer::forget_previous_frames).
///
/// ```
/// # use drawloom::{Renderer, Submitter, WarmUp, backend::WgpuBackend, scene::SceneRef};
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
    reflections: bool,
}

impl<'a> WarmUp<'a> {
    /// The warm-up for a scene.
    pub fn new(scene: SceneRef<'a>) -> Self {
        let whole = WarmUpFrame { lights: scene.lights.to_vec(), transparency: true, reflections: true };
        let of_class = |class| scene.lights.iter().find(|light| LightClass::of(light, true) == class);
        let with_light = |light: &Light| WarmUpFrame { lights: vec![*light], transparency: true, reflections: true };
        let unlit = |transparency, reflections| WarmUpFrame { lights: Vec::new(), transparency, reflections };
        let mut frames = vec![whole];
        frames.extend(LightClass::all().filter_map(of_class).map(with_light));
        frames.extend([unlit(true, true), unlit(false, true), unlit(true, false)]);
        Self { scene, frames: frames.into_iter() }
    }

    /// The number of frames that are not recorded yet.
    pub fn frames_left(&self) -> usize {
        self.frames.len()
    }

    /// Records the next frame, which the engine submits; `None` after the last one. The engine waits for the device between frames, as the
    /// driver may compile in the meantime.
    ///
    /// # Errors
    /// As [`Renderer::record`]. The warm-up goes on with the frame after it.
    pub fn record_next<B: Backend>(&mut self, renderer: &mut Renderer<B>) -> Result<Option<Recorded<B>>, FrameError> {
        let Some(WarmUpFrame { lights, transparency, reflections }) = self.frames.next() else { return Ok(None) };
        let is_drawn = |camera: &&Camera| reflections || camera.kind != ViewKind::Reflection;
        let cameras: Vec<_> = self.scene.cameras.iter().filter(is_drawn).cloned().collect();
        let scene = SceneRef { lights: &lights, cameras: &cameras, changes: Changes::Unknown, ..self.scene };
        let recorded = renderer.record_part(&scene, transparency);
        renderer.forget_previous_frames();
        recorded.map(Some)
    }
}
