//! Places for an engine's processes in a pipeline's frame.

/// A place for processes of the engine between those of the [deferred pipeline](super::Deferred), whose frames
/// have all of them, whatever the scene requires: see [`Declare::at`](super::Declare::at). What its targets hold is listed at
/// [`GeometryBuffer`](super::GeometryBuffer). A pipeline of the engine's [adds](super::PipelineProcesses) those that
/// its frames have.
///
/// A process needs a place where what it reads and writes leaves its order open, as that of all that change `radiance`
/// does.
///
/// ```text
///  geometry buffer │ lights │ transparency │ post-processing │
///  ▲               ▲        ▲              ▲                 ▲
///  BeforeGeometry  │        AfterLighting  │                 AfterPostProcessing
///                  AfterGeometry           AfterTransparency
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum InjectionPoint {
    /// Before the depth pre-pass and the geometry buffer. Shadow maps are drawn in views of their own, which come
    /// first.
    BeforeGeometry,
    /// When `radiance` holds ambient and emitted light.
    AfterGeometry,
    /// When `radiance` is that of all opaque objects.
    AfterLighting,
    /// When `radiance` is complete, before post-processing.
    AfterTransparency,
    /// When the picture is complete.
    AfterPostProcessing,
}

impl InjectionPoint {
    /// All of them, in order.
    pub const ALL: [Self; 5] = [
        Self::BeforeGeometry,
        Self::AfterGeometry,
        Self::AfterLighting,
        Self::AfterTransparency,
        Self::AfterPostProcessing,
    ];

    /// Whether a slot of this name marks a place.
    pub(super) fn is_slot(name: &str) -> bool {
        Self::ALL.into_iter().any(|place| place.slots().contains(&name))
    }

    /// The names of the empty slots at the beginning and at the end of the place: what is there comes between them.
    pub(super) fn slots(self) -> [&'static str; 2] {
        match self {
            Self::BeforeGeometry => ["the place before geometry", "the end of the place before geometry"],
            Self::AfterGeometry => ["the place after geometry", "the end of the place after geometry"],
            Self::AfterLighting => ["the place after lighting", "the end of the place after lighting"],
            Self::AfterTransparency => ["the place after transparency", "the end of the place after transparency"],
            Self::AfterPostProcessing => {
                ["the place after post-processing", "the end of the place after post-processing"]
            }
        }
    }
}
