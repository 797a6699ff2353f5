//! The scenes.

use drawloom::scene::{Scene, SceneError};
use drawloom_benches::clouds::{around_one, back_to_back};

/// In the order they are shown.
pub const NAMES: [&str; 8] = ["even", "uneven", "single", "many", "small", "interrupted", "even-large", "single-large"];

/// A scene, and the number of objects that its cameras see.
pub struct Case {
    pub name: &'static str,
    pub scene: Scene,
    /// The number of objects that each camera must see.
    pub visible: Vec<usize>,
    /// Whether another thread occupies a core half of the time (the system events of M 10.5).
    pub is_interrupted: bool,
    /// Whether it is measured on `noop` alone, because a software device takes seconds to draw it.
    pub is_large: bool,
}

impl Case {
    /// Visible objects, summed over all views.
    pub fn object_views(&self) -> usize {
        self.visible.iter().sum()
    }
}

/// All scenes, with their objects divided by `divisor`.
///
/// # Errors
/// Returns an error if a scene rejects a mesh, a material or an object.
pub fn all(divisor: usize) -> Result<Vec<Case>, SceneError> {
    let of = |objects: usize| (objects / divisor).max(1);
    let uneven = [20_000, 500, 1_000, 1_500].map(of);
    let round = |name, cameras, objects| {
        let scene = around_one(cameras, objects)?;
        Ok::<_, SceneError>(Case {
            name,
            scene,
            visible: vec![objects; cameras],
            is_interrupted: false,
            is_large: false,
        })
    };
    let turned = |name, is_interrupted| {
        let scene = back_to_back(uneven)?;
        Ok::<_, SceneError>(Case { name, scene, visible: uneven.to_vec(), is_interrupted, is_large: false })
    };
    let large = |name, cameras, objects| Ok::<_, SceneError>(Case { is_large: true, ..round(name, cameras, objects)? });
    let [even, uneven, single, many, small, interrupted, even_large, single_large] = NAMES;
    Ok(vec![
        round(even, 4, of(10_000))?,
        turned(uneven, false)?,
        round(single, 1, of(40_000))?,
        round(many, 64, of(50))?,
        round(small, 1, 7)?,
        turned(interrupted, true)?,
        large(even_large, 4, of(100_000))?,
        large(single_large, 1, of(400_000))?,
    ])
}
