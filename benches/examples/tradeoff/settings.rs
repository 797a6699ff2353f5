//! The settings that are measured: each knob alone at each of its settings, and the presets.

use drawloom::ViewVariant;
use drawloom::quality::{self, Quality};
use drawloom::view::ShadowMaps;

use crate::configuration::Configuration;
use crate::subject::Subject;

/// A setting of one knob, with all others as in [`Configuration::exact`]; or a preset.
#[derive(Clone, Debug)]
pub struct Setting {
    pub knob: Knob,
    /// Its name in reports.
    pub name: String,
    pub configuration: Configuration,
}

impl Setting {
    /// Whether its frames show pictures of earlier frames.
    pub fn keeps_pictures(&self) -> bool {
        let Configuration { quality, mirrors, impostor, .. } = self.configuration;
        quality.shadows.interval > 1 || mirrors.interval > 1 || impostor.is_some()
    }
}

/// What trades accuracy for speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Knob {
    Preset,
    /// A setting of [`Quality`], by its index in [`quality::Knob::ALL`].
    Quality(usize),
    Cascades,
    MaxDistance,
    Redraw,
    ViewSize,
    ViewLevelOfDetail,
    ViewCameras,
    ViewLeftOut,
    ImpostorAngle,
}

impl Knob {
    /// All knobs, in the order of reports.
    pub fn all() -> impl Iterator<Item = Self> {
        [Self::Preset].into_iter().chain((0..quality::Knob::ALL.len()).map(Self::Quality)).chain(Self::ELSEWHERE)
    }

    /// Those that are no settings of [`Quality`].
    const ELSEWHERE: [Self; 8] = [
        Self::Cascades,
        Self::MaxDistance,
        Self::Redraw,
        Self::ViewSize,
        Self::ViewLevelOfDetail,
        Self::ViewCameras,
        Self::ViewLeftOut,
        Self::ImpostorAngle,
    ];

    /// Where an engine sets it: a field of `Quality`, unless a type is named.
    pub fn name(self) -> &'static str {
        match self {
            Self::Preset => "preset",
            Self::Quality(index) => quality::Knob::ALL[index].field,
            Self::Cascades => "ShadowMaps.cascades",
            Self::MaxDistance => "ShadowMaps.max_distance",
            Self::Redraw => "Camera.redraw",
            Self::ViewSize => "ViewVariant.size",
            Self::ViewLevelOfDetail => "ViewVariant.level_of_detail_scale",
            Self::ViewCameras => "ViewVariant.max_cameras",
            Self::ViewLeftOut => "QualityLevel.LeftOut",
            Self::ImpostorAngle => "Camera.impostor",
        }
    }

    /// `configuration` with this knob set as in `other`.
    pub fn changed(self, configuration: &Configuration, other: &Configuration) -> Configuration {
        let mut changed = *configuration;
        let (form, forms) = (&mut changed.mirrors, &other.mirrors);
        match self {
            Self::Preset => changed = *other,
            Self::Quality(index) => quality::Knob::ALL[index].copy(&mut changed.quality, &other.quality),
            Self::Cascades => changed.maps.cascades = other.maps.cascades,
            Self::MaxDistance => changed.maps.max_distance = other.maps.max_distance,
            Self::Redraw => form.interval = forms.interval,
            Self::ViewSize => form.size = forms.size,
            Self::ViewLevelOfDetail => form.level_of_detail_scale = forms.level_of_detail_scale,
            Self::ViewCameras => form.max_cameras = forms.max_cameras,
            Self::ViewLeftOut => changed.draws_mirrors = other.draws_mirrors,
            Self::ImpostorAngle => changed.impostor = other.impostor,
        }
        changed
    }
}

/// All settings of what the subject has; [`Configuration::exact`] first.
pub fn all(subject: &Subject) -> Vec<Setting> {
    let exact = Configuration::exact();
    let mut settings = Vec::new();
    let mut add =
        |knob, name: &str, configuration| settings.push(Setting { knob, name: name.to_owned(), configuration });
    add(Knob::Preset, "exact", exact);
    add(Knob::Preset, "balanced", Configuration::preset(Quality::balanced()));
    add(Knob::Preset, "fast", Configuration::preset(Quality::fast()));
    add_of_quality(|knob, name, quality| add(knob, name, Configuration { quality, ..exact }));
    add_of_maps(|knob, name, maps| add(knob, name, Configuration { maps, ..exact }));
    if !subject.mirrors.is_empty() {
        add_of_mirrors(&mut add);
    }
    if subject.impostor.is_some() {
        for degrees in [0.0, 0.5, 2.0, 5.0] {
            let impostor = Some(degrees);
            add(Knob::ImpostorAngle, &format!("{degrees}°"), Configuration { impostor, ..exact });
        }
    }
    settings
}

fn add_of_maps(mut add: impl FnMut(Knob, &str, ShadowMaps)) {
    let exact = Configuration::exact().maps;
    for cascades in 1..exact.cascades {
        add(Knob::Cascades, &cascades.to_string(), ShadowMaps { cascades, ..exact });
    }
    for max_distance in [7.5, 15.0, 30.0] {
        add(Knob::MaxDistance, &format!("{max_distance} m"), ShadowMaps { max_distance, ..exact });
    }
}

fn add_of_mirrors(mut add: impl FnMut(Knob, &str, Configuration)) {
    let exact = Configuration::exact();
    let best = ViewVariant::BEST;
    let drawn = |mirrors| Configuration { mirrors, ..exact };
    for interval in [2, 4] {
        add(Knob::Redraw, &format!("{interval} frames"), drawn(ViewVariant { interval, ..best }));
    }
    for size in [0.5, 0.25] {
        add(Knob::ViewSize, &size.to_string(), drawn(ViewVariant { size, ..best }));
    }
    for level_of_detail_scale in [2.0, 4.0] {
        // There is nothing to scale in `exact`.
        let quality = Quality { level_of_detail: 1.0, ..exact.quality };
        let configuration = Configuration { quality, ..drawn(ViewVariant { level_of_detail_scale, ..best }) };
        add(Knob::ViewLevelOfDetail, &format!("{level_of_detail_scale} × 1 pixel"), configuration);
    }
    add(Knob::ViewCameras, "1 of 2", drawn(ViewVariant { max_cameras: 1, ..best }));
    add(Knob::ViewLeftOut, "left out", Configuration { draws_mirrors: false, ..exact });
}

/// The settings of the fields of [`Quality`]: those that `exact` has itself only where the error is not that against
/// `exact`.
fn add_of_quality(mut add: impl FnMut(Knob, &str, Quality)) {
    for (index, knob) in quality::Knob::ALL.iter().enumerate() {
        for (name, set) in knob.values.iter().filter(|(name, _)| !LEFT_OUT.contains(&(knob.field, name))) {
            let mut quality = Quality::exact();
            set(&mut quality);
            if quality != Quality::exact() || ["radiance_sum", "transforms"].contains(&knob.field) {
                add(Knob::Quality(index), name, quality);
            }
        }
    }
}

/// Values that are not measured: more than `exact` has, or more than a short path shows.
const LEFT_OUT: [(&str, &str); 4] = [
    ("shadows.side", "4096 pixels"),
    ("shadows.filter", "4 texels"),
    ("shadows.bias", "4"),
    ("shadows.interval", "every 8th frame"),
];
