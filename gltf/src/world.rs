//! A loaded scene, as the engine keeps it.

use std::collections::BTreeSet;
use std::sync::Arc;

use drawloom::scene::{Bounds, ColumnValues, Scene, SceneRef, Texture};

use crate::attributes::{POSE, Pose};
use crate::surface_kind::SurfaceKind;

/// A loaded scene: what Drawloom draws, and what the loader left out of the file. In names of the file, control
/// characters are escaped.
#[derive(Debug)]
pub struct World {
    pub(crate) scene: Scene,
    /// Of each object, in its pose.
    pub(crate) bounds: Vec<Bounds>,
    /// Of each object; zeros if it has none.
    pub(crate) poses: Vec<Pose>,
    pub(crate) palette: Arc<[u8]>,
    pub(crate) morphs: Arc<[u8]>,
    /// Which surfaces there are, and whether they are deformed.
    #[cfg_attr(not(feature = "draw"), expect(dead_code, reason = "only drawing needs it"))]
    pub(crate) surfaces: BTreeSet<(SurfaceKind, bool)>,
    /// What the loader left out of the file or drew otherwise, in sentences that name the element. As many as
    /// [`GltfLimits::warnings`](crate::GltfLimits::warnings) says are listed.
    pub warnings: Vec<String>,
    /// How many more warnings there are.
    pub unlisted_warnings: u64,
    /// The names of the file's animations; `animation 2` for one without a name.
    pub animations: Vec<String>,
    /// How many cameras the scene has.
    pub cameras: usize,
}

impl World {
    /// How many objects there are: one for each primitive of each node.
    pub fn object_count(&self) -> usize {
        self.poses.len()
    }

    /// The bytes of its textures with their mip levels, its joints and its morph targets.
    pub fn resource_bytes(&self) -> u64 {
        let textures = self.scene.assets().iter::<Texture>().map(|(_, texture)| texture.class().bytes());
        textures.sum::<u64>() + (self.palette.len() + self.morphs.len()) as u64
    }

    /// The engine's own data of objects.
    pub fn columns(&self) -> [ColumnValues<'_>; 1] {
        [POSE.values(&self.poses)]
    }

    /// The scene as a frame reads it.
    pub fn as_scene_ref<'a>(&'a self, columns: &'a [ColumnValues<'a>]) -> SceneRef<'a> {
        SceneRef { columns, bounds: &self.bounds, ..self.scene.as_scene_ref() }
    }
}
