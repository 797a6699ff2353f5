//! The stencil test.

/// How what a process draws is tested against the stencil of its depth target, and how it changes the stencil: a byte
/// for each pixel of targets of a [format with a stencil](super::Format::has_stencil), cleared to 0 with the depth.
/// Both sides of triangles are treated alike.
///
/// ```
/// use drawloom::process::{Comparison, Stencil};
///
/// // One process marks the pixels of some objects, another draws only elsewhere.
/// let (mark, elsewhere) = (Stencil::mark(1), Stencil::test(Comparison::NotEqual, 1));
/// assert!(mark.writes() && !elsewhere.writes());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Stencil {
    /// How `reference` compares with the stencil if the test passes: `reference < stencil` for [`Comparison::Less`].
    pub comparison: Comparison,
    /// What the stencil is compared with, and replaced by.
    pub reference: u8,
    /// The bits that are compared.
    pub read_mask: u8,
    /// The bits that change.
    pub write_mask: u8,
    /// What becomes of the stencil where the stencil test fails.
    pub on_fail: StencilOperation,
    /// What becomes of it where only the depth test fails.
    pub on_depth_fail: StencilOperation,
    /// What becomes of it where both pass.
    pub on_pass: StencilOperation,
}

impl Stencil {
    /// Draws everywhere, and sets the stencil to a value where the depth test passes.
    pub const fn mark(value: u8) -> Self {
        Self { on_pass: StencilOperation::Replace, ..Self::test(Comparison::Always, value) }
    }

    /// Draws where this comparison holds, and leaves the stencil unchanged.
    pub const fn test(comparison: Comparison, reference: u8) -> Self {
        let keep = StencilOperation::Keep;
        Self {
            comparison,
            reference,
            read_mask: u8::MAX,
            write_mask: u8::MAX,
            on_fail: keep,
            on_depth_fail: keep,
            on_pass: keep,
        }
    }

    /// Whether the test passes for every stencil.
    pub fn always_passes(&self) -> bool {
        self.comparison == Comparison::Always
    }

    /// Whether it may change the stencil.
    pub fn writes(&self) -> bool {
        let operations = [self.on_fail, self.on_depth_fail, self.on_pass];
        self.write_mask != 0 && operations.iter().any(|operation| *operation != StencilOperation::Keep)
    }
}

/// How two numbers compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Comparison {
    /// In no way: the test always fails.
    Never,
    /// The first is less.
    Less,
    /// They are equal.
    Equal,
    /// The first is less, or they are equal.
    LessEqual,
    /// The first is greater.
    Greater,
    /// They differ.
    NotEqual,
    /// The first is greater, or they are equal.
    GreaterEqual,
    /// In any way: the test always passes.
    Always,
}

/// What becomes of a stencil.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StencilOperation {
    /// It stays.
    Keep,
    /// It becomes 0.
    Zero,
    /// It becomes the reference.
    Replace,
    /// Its bits are inverted.
    Invert,
    /// It grows by 1, up to 255.
    IncrementClamp,
    /// It falls by 1, down to 0.
    DecrementClamp,
    /// It grows by 1, and from 255 to 0.
    IncrementWrap,
    /// It falls by 1, and from 0 to 255.
    DecrementWrap,
}
