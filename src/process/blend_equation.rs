//! The blend equation.

use crate::scene::Blend;

/// How a drawn colour, the source, mixes with the colour that a target has, the destination: one equation for red, green and blue, one
/// for alpha. A process has one for each of its colour targets where [`Blend`] is not enough.
///
/// ```
/// use drawloom::process::{BlendComponent, BlendEquation, BlendFactor};
///
/// // The second target of weighted order-independent transparency: what remains visible through all surfaces.
/// let revealage = BlendEquation::same_for_all_channels(BlendComponent::Sum {
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
    /// The source: nothing is mixed. The only equation for targets that [cannot be blended](super::Format::can_be_blended).
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
        Self::same_for_all_channels(BlendComponent::Sum { source, destination })
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
                    color: BlendComponent::Sum { source: BlendFactor::SourceAlpha, destination },
                    alpha: BlendComponent::Sum { source: one, destination },
                }
            }
            Blend::Additive => Self::ADDITIVE,
            Blend::Subtractive => {
                Self::same_for_all_channels(BlendComponent::ReverseDifference { source: one, destination: one })
            }
        }
    }
}

/// How a channel of the source mixes with that of the destination.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BlendComponent {
    /// Source × factor + destination × factor.
    Sum {
        /// The source's factor.
        source: BlendFactor,
        /// The destination's factor.
        destination: BlendFactor,
    },
    /// Source × factor − destination × factor.
    Difference {
        /// The source's factor.
        source: BlendFactor,
        /// The destination's factor.
        destination: BlendFactor,
    },
    /// Destination × factor − source × factor.
    ReverseDifference {
        /// The source's factor.
        source: BlendFactor,
        /// The destination's factor.
        destination: BlendFactor,
    },
    /// The less of the two.
    Minimum,
    /// The greater of the two.
    Maximum,
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
    /// 1 less that.
    OneMinusSource,
    /// The source's alpha.
    SourceAlpha,
    /// 1 less that.
    OneMinusSourceAlpha,
    /// The same channel of the destination.
    Destination,
    /// 1 less that.
    OneMinusDestination,
    /// The destination's alpha; 1 if it has none.
    DestinationAlpha,
    /// 1 less that.
    OneMinusDestinationAlpha,
}
