//! What a process says of itself before it draws.

use super::Format;
use crate::scene::ViewKind;

/// Collects what a process reads and writes. Targets are named; each view of the process's kind has its own, of its
/// picture's size.
#[derive(Debug, Default)]
pub struct Declare {
    declaration: Declaration,
}

impl Declare {
    /// The kind of view it draws in; [`ViewKind::Main`] unless said otherwise.
    pub fn views(&mut self, kind: ViewKind) {
        self.declaration.views = kind;
    }

    /// Draws into a colour target that is cleared first. Colour targets are the shader's outputs in the order declared.
    pub fn clears_color(&mut self, target: &str, format: Format, clear: ClearColor) {
        self.access(target, Access::ClearColor(format, clear));
    }

    /// Draws over what other processes drew into a colour target.
    pub fn draws_over(&mut self, target: &str) {
        self.access(target, Access::DrawOver);
    }

    /// Tests and writes a depth target that is first cleared to 0, infinitely far away (depth is reversed).
    pub fn clears_depth(&mut self, target: &str, format: Format) {
        self.access(target, Access::ClearDepth(format));
    }

    /// Tests and writes a depth target over what another process drew into it.
    pub fn draws_depth(&mut self, target: &str) {
        self.access(target, Access::DrawDepth);
    }

    /// Tests and writes a depth target that all views of its kind share: one texture array, of which each view has a layer. It
    /// is first cleared to 0, infinitely far away. Those views have pictures of one size.
    pub fn clears_depth_layer(&mut self, target: &str, format: Format) {
        self.access(target, Access::ClearDepthLayer(format));
    }

    /// Tests against the depth that another process wrote, and leaves it as it is.
    pub fn tests_depth(&mut self, target: &str) {
        self.access(target, Access::TestDepth);
    }

    /// Draws only where its depth is exactly what another process wrote, and leaves it as it is.
    pub fn matches_depth(&mut self, target: &str) {
        self.access(target, Access::MatchDepth);
    }

    /// Reads a target in its shader, at `@group(2)`: the first one sampled is binding 1, the next 2, and so on.
    pub fn samples(&mut self, target: &str) {
        self.access(target, Access::Sample);
    }

    /// Reads in its shader, at `@group(2)` as [`Declare::samples`], the texture array that all views of another kind share.
    pub fn samples_layers(&mut self, views: ViewKind, target: &str) {
        self.access(target, Access::SampleLayers(views));
    }

    /// A raw pass writes a target by commands of its own; as a storage texture too, where [`Format::can_be_stored`].
    pub fn writes(&mut self, target: &str, format: Format) {
        self.access(target, Access::Write(format));
    }

    /// A raw pass changes, by commands of its own, what others wrote into a target.
    pub fn changes(&mut self, target: &str) {
        self.access(target, Access::Change);
    }

    /// A raw pass reads a target by commands of its own.
    pub fn reads(&mut self, target: &str) {
        self.access(target, Access::Read);
    }

    /// Comes after another process, whatever they read and write.
    pub fn after(&mut self, process: &str) {
        self.declaration.after.push(process.to_owned());
    }

    /// Comes before another process, whatever they read and write.
    pub fn before(&mut self, process: &str) {
        self.declaration.before.push(process.to_owned());
    }

    /// Stays in the graph even though no output depends on it: it has effects of its own.
    pub fn keep(&mut self) {
        self.declaration.keep = true;
    }

    /// All that was declared.
    pub fn finish(self) -> Declaration {
        self.declaration
    }

    fn access(&mut self, target: &str, access: Access) {
        self.declaration.accesses.push((target.to_owned(), access));
    }
}

/// What a process declared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Declaration {
    /// The kind of view it draws in.
    pub views: ViewKind,
    /// Which targets it uses, and how, in the order declared.
    pub accesses: Vec<(String, Access)>,
    /// The processes it comes after.
    pub after: Vec<String>,
    /// The processes it comes before.
    pub before: Vec<String>,
    /// Whether it stays although no output depends on it.
    pub keep: bool,
}

impl Declaration {
    /// The colour targets it draws into, in the order of the shader's outputs; with the clear value where there is one.
    pub fn colors(&self) -> impl Iterator<Item = (&str, Option<ClearColor>)> {
        self.accesses.iter().filter_map(|(target, access)| match access {
            Access::ClearColor(_, clear) => Some((target.as_str(), Some(*clear))),
            Access::DrawOver => Some((target.as_str(), None)),
            _ => None,
        })
    }

    /// The targets it leaves changed.
    pub fn written(&self) -> impl Iterator<Item = &str> {
        self.accesses.iter().filter(|(_, access)| access.writes()).map(|(target, _)| target.as_str())
    }

    /// The depth target it tests, and how it uses it.
    pub fn depth(&self) -> Option<(&str, Access)> {
        let depth = self.accesses.iter().find(|(_, access)| access.is_depth());
        depth.map(|(target, access)| (target.as_str(), *access))
    }

    /// The targets its shader reads, in the order of their bindings; with the kind of view whose they are.
    pub fn samples(&self) -> impl Iterator<Item = (ViewKind, &str)> {
        self.accesses.iter().filter_map(|(target, access)| match access {
            Access::Sample => Some((self.views, target.as_str())),
            Access::SampleLayers(views) => Some((*views, target.as_str())),
            _ => None,
        })
    }
}

/// How a process uses a target.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Access {
    /// Drawn into, cleared first.
    ClearColor(Format, ClearColor),
    /// Drawn into, over what is there.
    DrawOver,
    /// Tested and written, cleared first.
    ClearDepth(Format),
    /// Tested and written, cleared first; a layer of a texture array that all views of the kind share.
    ClearDepthLayer(Format),
    /// Tested and written, over what is there.
    DrawDepth,
    /// Tested.
    TestDepth,
    /// Tested for being exactly the same.
    MatchDepth,
    /// Read by the shader.
    Sample,
    /// Read by the shader: the texture array that all views of this kind share.
    SampleLayers(ViewKind),
    /// Written by a raw pass.
    Write(Format),
    /// Changed by a raw pass.
    Change,
    /// Read by a raw pass.
    Read,
}

impl Access {
    /// Whether it needs what is in the target already.
    pub fn reads(self) -> bool {
        !matches!(self, Self::ClearColor(..) | Self::ClearDepth(_) | Self::ClearDepthLayer(_) | Self::Write(_))
    }

    /// Whether it leaves the target changed.
    pub fn writes(self) -> bool {
        !matches!(self, Self::TestDepth | Self::MatchDepth | Self::Sample | Self::SampleLayers(_) | Self::Read)
    }

    /// The format it gives the target, where it does.
    pub fn format(self) -> Option<Format> {
        match self {
            Self::ClearColor(format, _)
            | Self::ClearDepth(format)
            | Self::ClearDepthLayer(format)
            | Self::Write(format) => Some(format),
            _ => None,
        }
    }

    /// The kind of view whose target it is, of a process that draws in views of the kind `own`.
    pub fn views(self, own: ViewKind) -> ViewKind {
        match self {
            Self::SampleLayers(views) => views,
            _ => own,
        }
    }

    /// Whether the target is the one that depth is tested against.
    pub fn is_depth(self) -> bool {
        matches!(
            self,
            Self::ClearDepth(_) | Self::ClearDepthLayer(_) | Self::DrawDepth | Self::TestDepth | Self::MatchDepth
        )
    }

    /// Whether it is by commands of a raw pass.
    pub fn is_raw(self) -> bool {
        matches!(self, Self::Write(_) | Self::Change | Self::Read)
    }
}

/// What a colour target is cleared to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClearColor {
    /// Red, green, blue and alpha, linear.
    Value([f64; 4]),
    /// The scene's background, opaque.
    Background,
}
