//! The sizes of targets.

/// The size of a target that each view has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum TargetSize {
    /// That of the view's picture.
    #[default]
    Picture,
    /// Width and height of the view's picture, divided by this number and rounded up.
    Divided(u32),
    /// Width and height in pixels, whatever the size of the picture.
    Fixed([u32; 2]),
}

impl TargetSize {
    /// Width and height in pixels in a view whose picture has this size.
    pub fn in_view(self, picture: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Picture => picture,
            Self::Divided(divisor) => picture.map(|pixels| pixels.div_ceil(divisor.max(1))),
            Self::Fixed(size) => size,
        }
    }

    /// Whether a target can have it.
    pub(super) fn is_valid(self) -> bool {
        match self {
            Self::Picture => true,
            Self::Divided(divisor) => divisor > 0,
            Self::Fixed(size) => !size.contains(&0),
        }
    }
}
