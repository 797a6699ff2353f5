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

    /// Tests against the depth that another process wrote, and leaves it as it is.
    pub fn tests_depth(&mut self, target: &str) {
        self.access(target, Access::TestDepth);
    }

    /// Reads a target in its shader, at `@group(2)`: the first one sampled is binding 1, the next 2, and so on.
    pub fn samples(&mut self, target: &str) {
        self.access(target, Access::Sample);
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

    /// The depth target it tests; and whether it clears and writes it.
    pub fn depth(&self) -> Option<(&str, bool)> {
        self.accesses.iter().find_map(|(target, access)| match access {
            Access::ClearDepth(_) => Some((target.as_str(), true)),
            Access::TestDepth => Some((target.as_str(), false)),
            _ => None,
        })
    }

    /// The targets its shader reads, in the order of their bindings.
    pub fn samples(&self) -> impl Iterator<Item = &str> {
        self.accesses.iter().filter(|(_, access)| *access == Access::Sample).map(|(target, _)| target.as_str())
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
    /// Tested.
    TestDepth,
    /// Read by the shader.
    Sample,
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
        !matches!(self, Self::ClearColor(..) | Self::ClearDepth(_) | Self::Write(_))
    }

    /// Whether it leaves the target changed.
    pub fn writes(self) -> bool {
        !matches!(self, Self::TestDepth | Self::Sample | Self::Read)
    }

    /// The format it gives the target, where it does.
    pub fn format(self) -> Option<Format> {
        match self {
            Self::ClearColor(format, _) | Self::ClearDepth(format) | Self::Write(format) => Some(format),
            _ => None,
        }
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
