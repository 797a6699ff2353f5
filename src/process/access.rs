//! How processes use targets.

use super::Format;
use crate::scene::ViewKind;

/// How a process uses a target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Access {
    /// Drawn into; cleared first.
    ClearColor(Format, ClearColor),
    /// Drawn into, over its content.
    DrawOver,
    /// Tested and written; cleared first.
    ClearDepth(Format),
    /// Tested and written; cleared first. A layer of a texture array that all views of the kind share.
    ClearDepthLayer(Format),
    /// Tested and written, over its content.
    DrawDepth,
    /// Tested; its stencil is written.
    MarkStencil,
    /// Only its stencil is tested.
    TestStencil,
    /// Tested.
    TestDepth,
    /// Tested for equality.
    MatchDepth,
    /// Read by the shader.
    Sample,
    /// Read by the shader: what another target held at the end of the frame before. The name is that of
    /// [`previous_name`](super::previous_name).
    SamplePrevious,
    /// Read by the shader: a texture array that all views of this kind share.
    SampleLayers(ViewKind),
    /// Read by the shader: the target of another view, of this kind. Which view is
    /// [`Declaration::sampled_views`](super::Declaration::sampled_views) at this index.
    SampleView(ViewKind, usize),
    /// Read by the shader: what the target of another view, or of the view itself, held at the end of the frame before.
    /// The name is that of [`previous_name`](super::previous_name), the kind and the view are those of
    /// [`Access::SampleView`].
    SampleViewPrevious(ViewKind, usize),
    /// The target of a resolve: overwritten with the mean of a multisampled target's samples.
    Resolve(Format),
    /// Written by a raw pass.
    Write(Format),
    /// Read and written by a raw pass.
    Change,
    /// Read by a raw pass.
    Read,
}

impl Access {
    /// Whether it depends on what other processes wrote in the same frame and view, or in all views of a kind.
    pub fn reads(self) -> bool {
        !matches!(
            self,
            Self::SamplePrevious
                | Self::SampleView(..)
                | Self::SampleViewPrevious(..)
                | Self::ClearColor(..)
                | Self::ClearDepth(_)
                | Self::ClearDepthLayer(_)
                | Self::Resolve(_)
                | Self::Write(_)
        )
    }

    /// Whether it changes the target.
    pub fn writes(self) -> bool {
        !matches!(
            self,
            Self::TestStencil
                | Self::TestDepth
                | Self::MatchDepth
                | Self::Sample
                | Self::SamplePrevious
                | Self::SampleLayers(_)
                | Self::SampleView(..)
                | Self::SampleViewPrevious(..)
                | Self::Read
        )
    }

    /// The target's format, if the access creates the target.
    pub fn format(self) -> Option<Format> {
        match self {
            Self::ClearColor(format, _)
            | Self::ClearDepth(format)
            | Self::ClearDepthLayer(format)
            | Self::Resolve(format)
            | Self::Write(format) => Some(format),
            _ => None,
        }
    }

    /// The kind of view that the target belongs to, for a process that draws in views of the kind `own`.
    pub fn views(self, own: ViewKind) -> ViewKind {
        match self {
            Self::SampleLayers(views) | Self::SampleView(views, _) | Self::SampleViewPrevious(views, _) => views,
            _ => own,
        }
    }

    /// Whether the target is the depth target.
    pub fn is_depth(self) -> bool {
        matches!(
            self,
            Self::ClearDepth(_)
                | Self::ClearDepthLayer(_)
                | Self::DrawDepth
                | Self::MarkStencil
                | Self::TestStencil
                | Self::TestDepth
                | Self::MatchDepth
        )
    }

    /// Whether it may write the depth of a depth target.
    pub fn writes_depth(self) -> bool {
        self.is_depth() && self.writes() && self != Self::MarkStencil
    }

    /// Whether it keeps what a depth target holds.
    pub fn keeps_depth(self) -> bool {
        self.is_depth() && self.reads()
    }

    /// Whether the name is that of a history.
    pub(crate) fn is_previous(self) -> bool {
        matches!(self, Self::SamplePrevious | Self::SampleViewPrevious(..))
    }

    /// Whether the target is drawn into as colour.
    pub fn is_color(self) -> bool {
        matches!(self, Self::ClearColor(..) | Self::DrawOver)
    }

    /// Whether a raw pass makes the access.
    pub fn is_raw(self) -> bool {
        matches!(self, Self::Write(_) | Self::Change | Self::Read)
    }
}

/// The colour that a target is cleared to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearColor {
    /// Red, green, blue and alpha, linear.
    Value([f64; 4]),
    /// The scene's background, opaque.
    Background,
}
