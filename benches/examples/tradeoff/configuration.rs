//! Everything that a knob sets.

use drawloom::quality::Quality;
use drawloom::scene::LayerMask;
use drawloom::view::ShadowMaps;
use drawloom::{QualityLevel, ViewVariant};

use crate::subject::NO_CASTER;

/// The values of all knobs, wherever an engine sets them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration {
    /// Of the renderer.
    pub quality: Quality,
    /// Of the deferred pipeline. [`Configuration::quality`] sets the side, the bias and the filter.
    pub maps: ShadowMaps,
    /// The form of the mirrors' views.
    pub mirrors: ViewVariant,
    /// Whether the mirrors' views are drawn at all.
    pub draws_mirrors: bool,
    /// The `max_angle` of [`Camera::impostor`](drawloom::scene::Camera::impostor), in degrees. `None` draws the
    /// original.
    pub impostor: Option<f64>,
}

impl Configuration {
    /// The most accurate one.
    pub fn exact() -> Self {
        let maps = ShadowMaps { cascades: ShadowMaps::MAX_CASCADES, ..default_maps() };
        Self { quality: Quality::exact(), maps, mirrors: ViewVariant::BEST, draws_mirrors: true, impostor: None }
    }

    /// A preset of [`Quality`], with what an engine gets that sets nothing else.
    pub fn preset(quality: Quality) -> Self {
        Self { quality, maps: default_maps(), ..Self::exact() }
    }

    /// The quality level of the mirrors' views.
    pub fn level(&self) -> QualityLevel {
        if self.draws_mirrors { QualityLevel::Drawn(self.mirrors) } else { QualityLevel::LeftOut }
    }
}

fn default_maps() -> ShadowMaps {
    ShadowMaps { layers: LayerMask(!NO_CASTER.0), ..ShadowMaps::default() }
}
