//! What a process samples of other views: a picture, an array of pictures, or the faces of a cube.

/// What a process samples of other views: see [`Declare::samples_view`](super::Declare::samples_view).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SampledView {
    /// The name of the view, or of those that are numbered behind it.
    pub name: String,
    /// How many views, and what the shader sees of them.
    pub shape: SampledShape,
}

/// What a shader sees of the views that it samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SampledShape {
    /// The picture of one view.
    Picture,
    /// A texture array of this number of views.
    Layers(u32),
    /// A cube map of six views.
    Cube,
}

impl SampledShape {
    /// The most layers that every device allows.
    pub const MAX_LAYERS: u32 = 256;

    /// The number of views.
    pub fn view_count(self) -> u32 {
        match self {
            Self::Picture => 1,
            Self::Layers(count) => count,
            Self::Cube => 6,
        }
    }
}
