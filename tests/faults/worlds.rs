//! What frames that fail draw in turn.

use drawloom::scene::{Changes, RenderObject, Scene, SceneRef, StaticGroup};
use drawloom::{FrameError, FrameInputs, RecordedFrame, Renderer};
use drawloom_testing::fault_injection::FaultyBackend;
use drawloom_testing::hills::GeneratedHills;
use libtest_mimic::Failed;

use crate::fixture::{Fixture, Refusal, two_scenes};
use crate::subjects::Subject;

/// Two states of a world, the objects in which they differ, and what nodes make in each frame.
pub struct Worlds {
    scenes: [Scene; 2],
    pub moved: Vec<u32>,
    hills: Option<GeneratedHills>,
}

impl Worlds {
    /// All that the pipeline draws.
    pub fn plain() -> Result<Self, Failed> {
        let (scenes, moved) = two_scenes()?;
        Ok(Self { scenes, moved, hills: None })
    }

    /// Also hills that nodes make anew in each frame, and static groups of all other objects.
    pub fn with_nodes_and_static_groups() -> Result<Self, Failed> {
        let (mut scenes, moved) = two_scenes()?;
        let hills = GeneratedHills::new();
        for scene in &mut scenes {
            let objects: Vec<_> = scene.objects().collect();
            // One static group has an object that moves, and one that does not.
            for (number, objects) in objects.chunks(2).enumerate() {
                let objects = scene.object_set(objects.iter().copied())?;
                scene.static_groups.push(StaticGroup::new(format!("static group {number}"), objects));
            }
            let first = scene.object(objects[0])?;
            let mesh = scene.add(hills.mesh()?)?;
            scene.add_object(RenderObject { mesh, ..first })?;
        }
        Ok(Self { scenes, moved, hills: Some(hills) })
    }

    pub fn has_static_groups(&self) -> bool {
        self.scenes.iter().any(|scene| !scene.static_groups.is_empty())
    }

    /// Records one of the states.
    pub fn record<S: Subject>(
        &self,
        renderer: &mut Renderer<FaultyBackend<S>>,
        index: usize,
        changes: Changes<'_>,
    ) -> Result<RecordedFrame<FaultyBackend<S>>, FrameError> {
        let scene = self.state(index, changes);
        match &self.hills {
            None => renderer.record(scene),
            Some(hills) => {
                let (vertices, indices) = hills.nodes(index);
                renderer.record_with(FrameInputs { nodes: &[&vertices, &indices], ..FrameInputs::new(scene) })
            }
        }
    }

    fn state<'a>(&'a self, index: usize, changes: Changes<'a>) -> SceneRef<'a> {
        let state = self.scenes[index].as_scene_ref();
        let (positions, scales, bounds, ambient) = (state.positions, state.scales, state.bounds, state.ambient);
        // Another scene has other meshes and materials.
        SceneRef { positions, scales, bounds, ambient, changes, ..self.scenes[0].as_scene_ref() }
    }

    /// Draws one of the states. `Err` within `Ok` is a refusal by the renderer or submitter.
    pub fn draw<S: Subject>(
        &self,
        fixture: &mut Fixture<S>,
        index: usize,
        changes: Changes<'_>,
    ) -> Result<Result<Vec<u8>, Refusal>, Failed> {
        let scene = self.state(index, changes);
        match &self.hills {
            None => fixture.draw_with_nodes(scene, &[]),
            Some(hills) => {
                let (vertices, indices) = hills.nodes(index);
                fixture.draw_with_nodes(scene, &[&vertices, &indices])
            }
        }
    }

    /// Draws one of the states in a frame that nothing fails.
    pub fn picture<S: Subject>(
        &self,
        fixture: &mut Fixture<S>,
        index: usize,
        changes: Changes<'_>,
    ) -> Result<Vec<u8>, Failed> {
        self.draw(fixture, index, changes)?.map_err(|refusal| format!("{refusal:?}").into())
    }
}
