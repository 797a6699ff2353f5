//! The scenes.

use clap::ValueEnum;
use drawloom::quality::{DepthCurve, DepthPrecision, Quality};
use drawloom::scene::{Blend, Scene, SceneError};
use drawloom_benches::clouds::{around_one, back_to_back};
use serde::Serialize;

/// What a scene makes the renderer do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// All objects move and all cameras turn, and the engine says nothing of it, so each frame makes its draw lists:
    /// opaque objects are ordered by bin.
    Moving,
    /// The same, and objects are ordered by depth: fill, sort and instance run.
    Ordered,
    /// Nothing moves, so draw lists are kept, and no command is made.
    Still,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Moving, Self::Ordered, Self::Still];

    pub fn name(self) -> &'static str {
        match self {
            Self::Moving => "moving",
            Self::Ordered => "ordered",
            Self::Still => "still",
        }
    }
}

/// In the order they are shown. The last three are ordered; each of the others is measured moving and still.
pub const NAMES: [&str; 11] = [
    "even",
    "uneven",
    "single",
    "many",
    "small",
    "interrupted",
    "even-large",
    "single-large",
    "by-depth",
    "blended",
    "not-instanced",
];

/// A scene, and how it is drawn.
pub struct Case {
    pub name: &'static str,
    pub kind: Kind,
    pub scene: Scene,
    pub quality: Quality,
    /// Whether equal draws become one. If not, each object is a draw.
    pub instancing: bool,
    /// The number of objects that each camera sees at rest.
    pub visible: Vec<usize>,
    /// Whether another thread occupies a core half of the time (the system events of M 10.5).
    pub is_interrupted: bool,
    /// Whether it is measured on `noop` alone, because a software device takes seconds to draw it.
    pub is_large: bool,
}

/// All scenes, with their objects divided by `divisor`.
///
/// # Errors
/// Returns an error if a scene rejects a mesh, a material or an object.
pub fn all(divisor: usize) -> Result<Vec<Case>, SceneError> {
    let of = |objects: usize| (objects / divisor).max(1);
    let uneven = [20_000, 500, 1_000, 1_500].map(of);
    let [
        even_name,
        uneven_name,
        single,
        many,
        small,
        interrupted,
        even_large,
        single_large,
        by_depth,
        blended,
        not_instanced,
    ] = NAMES;
    let case = |name, kind, scene, visible: &[usize]| Case {
        name,
        kind,
        scene,
        quality: Quality::balanced(),
        instancing: true,
        visible: visible.to_vec(),
        is_interrupted: false,
        is_large: false,
    };
    let round = |name, kind, cameras, objects| {
        Ok::<_, SceneError>(case(name, kind, around_one(cameras, objects)?, &vec![objects; cameras]))
    };
    let turned = |name, kind, blend| Ok::<_, SceneError>(case(name, kind, back_to_back(uneven, blend)?, &uneven));
    let mut cases = Vec::new();
    for kind in [Kind::Moving, Kind::Still] {
        cases.push(round(even_name, kind, 4, of(10_000))?);
        cases.push(turned(uneven_name, kind, Blend::None)?);
        cases.push(round(single, kind, 1, of(40_000))?);
        cases.push(round(many, kind, 64, of(50))?);
        cases.push(round(small, kind, 1, 7)?);
        cases.push(Case { is_interrupted: true, ..turned(interrupted, kind, Blend::None)? });
        cases.push(Case { is_large: true, ..round(even_large, kind, 4, of(100_000))? });
        cases.push(Case { is_large: true, ..round(single_large, kind, 1, of(400_000))? });
    }
    let quality =
        Quality { opaque_order: DepthPrecision { bits: 20, curve: DepthCurve::Logarithmic }, ..Quality::balanced() };
    cases.push(Case { quality, ..round(by_depth, Kind::Ordered, 4, of(10_000))? });
    cases.push(turned(blended, Kind::Ordered, Blend::Alpha)?);
    cases.push(Case { quality, instancing: false, ..round(not_instanced, Kind::Ordered, 4, of(2_500))? });
    cases.sort_by_key(|case| case.kind as usize);
    Ok(cases)
}
