//! What a process draws.

use std::borrow::Cow;

#[cfg(feature = "wgpu")]
use super::RawPass;
use crate::command::Selection;
use crate::scene::Blend;
use crate::view::LightClass;

/// What a process draws in each of its views.
#[derive(Clone)]
#[non_exhaustive]
pub enum Draws<'a> {
    /// The objects that the view sees, with one shader.
    Commands(CommandDraws<'a>),
    /// Every pixel once.
    FullScreen(FullScreen<'a>),
    /// What the lights of a class reach.
    Lights(LightDraws<'a>),
    /// Whatever the process encodes itself: compute, copies, passes of its own.
    #[cfg(feature = "wgpu")]
    Raw(&'a dyn RawPass),
}

/// The objects that a view sees: culled, sorted, merged into instanced batches and recorded into bundles.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandDraws<'a> {
    /// WGSL that is appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `vertex`.
    pub shader: &'a str,
    /// The fragment entry point; `None` draws depth alone.
    pub fragment: Option<&'a str>,
    /// Which objects.
    pub selection: Selection,
    /// Whether what is drawn hides what comes behind it.
    pub writes_depth: bool,
    /// The bytes of the uniform at `@group(2) @binding(0)`; none, no binding.
    pub parameters: Cow<'a, [u8]>,
}

impl Default for CommandDraws<'_> {
    fn default() -> Self {
        Self {
            shader: "",
            fragment: Some("fragment"),
            selection: Selection::OPAQUE,
            writes_depth: true,
            parameters: Cow::Borrowed(&[]),
        }
    }
}

/// Every pixel of the view once, by one triangle that is infinitely far away: where the process tests depth, it shows where
/// nothing else is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FullScreen<'a> {
    /// WGSL that is appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `fragment`, whose input is
    /// the prelude's `FullScreenPixel`.
    pub shader: &'a str,
    /// How it mixes with what is in the targets.
    pub blend: Blend,
    /// The bytes of the uniform at `@group(2) @binding(0)`; none, no binding.
    pub parameters: Cow<'a, [u8]>,
}

/// The pixels that lights reach: each light is drawn as geometry that surrounds what it lights (L 4.2.1), all of a class in one
/// instanced draw, and what they add up to is added to the targets. A process that draws lights tests depth, so that pixels
/// whose surface is behind a light's geometry are left out before they are shaded.
#[derive(Clone, Debug, PartialEq)]
pub struct LightDraws<'a> {
    /// WGSL that is appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `fragment`, whose input is
    /// the prelude's `LightPixel`.
    pub shader: &'a str,
    /// Which lights.
    pub class: LightClass,
    /// The bytes of the uniform at `@group(2) @binding(0)`; none, no binding.
    pub parameters: Cow<'a, [u8]>,
}

impl Draws<'_> {
    /// Which objects are drawn; `None` where none are.
    pub fn selection(&self) -> Option<Selection> {
        match self {
            Self::Commands(commands) => Some(commands.selection),
            _ => None,
        }
    }

    /// Whether what is drawn hides what comes behind it, where it writes depth.
    pub fn hides(&self) -> bool {
        matches!(self, Self::Commands(commands) if commands.writes_depth)
    }

    /// The bytes of the uniform at `@group(2) @binding(0)`; empty where there is none.
    pub fn parameters(&self) -> &[u8] {
        match self {
            Self::Commands(commands) => &commands.parameters,
            Self::FullScreen(full_screen) => &full_screen.parameters,
            Self::Lights(lights) => &lights.parameters,
            #[cfg(feature = "wgpu")]
            Self::Raw(_) => &[],
        }
    }
}
