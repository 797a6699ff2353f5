//! The blend equation.

use crate::scene::Blend;

/// How a drawn colour, the source, blends with the colour that a target has, the destination: one equation for red,
/// green and blue, one for alpha. A process has one for each of its colour targets where [`Blend`] is not enough.
///
/// ```
/// use drawloom::process::{BlendComponent, BlendEquation, BlendFactor};
///
/// // The second target of weighted order-independent transparency: what remains visible through all surfaces.
/// let revealage = BlendEquation::same_for_all_channels(BlendComponent::Add {
///     source: BlendFactor::Zero,
///     destination: BlendFactor::OneMinusSource,
/// });
/// let blend_equations = vec![BlendEquation::ADDITIVE, revealage];
/// # assert_ne!(blend_equations[0], blend_equations[1]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlendEquation {
    /// Red, green and blue.
    pub color: BlendComponent,
    /// Alpha.
    pub alpha: BlendComponent,
}

impl BlendEquation {
    /// The source replaces the destination. The only equation for targets that [cannot be
    /// blended](super::Format::can_be_blended).
    pub const REPLACE: Self = Self::sum(BlendFactor::One, BlendFactor::Zero);
    /// Source + destination.
    pub const ADDITIVE: Self = Self::sum(BlendFactor::One, BlendFactor::One);
    /// Source × destination.
    pub const MULTIPLY: Self = Self::sum(BlendFactor::Destination, BlendFactor::Zero);
    /// The source, already multiplied by its alpha, over the destination.
    pub const PREMULTIPLIED_ALPHA: Self = Self::sum(BlendFactor::One, BlendFactor::OneMinusSourceAlpha);

    /// The same for colour and alpha.
    pub const fn same_for_all_channels(component: BlendComponent) -> Self {
        Self { color: component, alpha: component }
    }

    const fn sum(source: BlendFactor, destination: BlendFactor) -> Self {
        Self::same_for_all_channels(BlendComponent::Add { source, destination })
    }
}

impl From<Blend> for BlendEquation {
    fn from(blend: Blend) -> Self {
        let one = BlendFactor::One;
        match blend {
            Blend::None => Self::REPLACE,
            Blend::Alpha => {
                let destination = BlendFactor::OneMinusSourceAlpha;
                Self {
                    color: BlendComponent::Add { source: BlendFactor::SourceAlpha, destination },
                    alpha: BlendComponent::Add { source: one, destination },
                }
            }
            Blend::Additive => Self::ADDITIVE,
            Blend::Subtractive => {
                Self::same_for_all_channels(BlendComponent::ReverseSubtract { source: one, destination: one })
            }
        }
    }
}

/// How a channel of the source blends with that of the destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BlendComponent {
    /// Source × its factor + destination × its factor.
    Add {
        /// The source's factor.
        source: BlendFactor,
        /// The destination's factor.
        destination: BlendFactor,
    },
    /// Source × its factor − destination × its factor.
    Subtract {
        /// The source's factor.
        source: BlendFactor,
        /// The destination's factor.
        destination: BlendFactor,
    },
    /// Destination × its factor − source × its factor.
    ReverseSubtract {
        /// The source's factor.
        source: BlendFactor,
        /// The destination's factor.
        destination: BlendFactor,
    },
    /// The smaller of source and destination, without factors.
    Min,
    /// The greater of source and destination, without factors.
    Max,
}

/// What a channel is multiplied by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BlendFactor {
    /// 0.
    Zero,
    /// 1.
    One,
    /// The same channel of the source.
    Source,
    /// 1 − the same channel of the source.
    OneMinusSource,
    /// The source's alpha.
    SourceAlpha,
    /// 1 − the source's alpha.
    OneMinusSourceAlpha,
    /// The same channel of the destination.
    Destination,
    /// 1 − the same channel of the destination.
    OneMinusDestination,
    /// The destination's alpha; 1 if it has none.
    DestinationAlpha,
    /// 1 − the destination's alpha.
    OneMinusDestinationAlpha,
}
