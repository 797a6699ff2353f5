//! The names of targets as constants, and lists of names for messages.

use std::fmt::{self, Display, Formatter};

/// The name of a target. An engine writes it once, so that a misspelt target does not compile:
///
/// ```
/// use drawloom::process::{ClearColor, Declare, Format, Target, targets};
///
/// const GLOW: Target = Target::new("glow");
///
/// /// Of a process that draws what glows.
/// fn declare_glow(declare: &mut Declare) {
///     declare.clears_color(GLOW, Format::Rgba16Float, ClearColor::Value([0.0; 4]));
///     declare.tests_depth(targets::DEPTH);
/// }
///
/// /// Of a process that blurs it into the radiance.
/// fn declare_blur(declare: &mut Declare) {
///     declare.samples(GLOW);
///     declare.draws_over(targets::RADIANCE);
/// }
/// ```
///
/// What takes the name of a target takes a constant, or a string for a name that is made at run time. Two of one name
/// are the same target. [`targets`](super::targets) has those of the deferred pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Target(&'static str);

impl Target {
    /// The target of this name.
    pub const fn new(name: &'static str) -> Self {
        Self(name)
    }

    /// Its name.
    pub const fn name(self) -> &'static str {
        self.0
    }
}

/// Names for a message, each once; "none" if there is none.
pub(crate) fn list_names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut listed: Vec<_> = Vec::new();
    for name in names.map(|name| format!("{name:?}")) {
        if !listed.contains(&name) {
            listed.push(name);
        }
    }
    if listed.is_empty() { "none".to_owned() } else { listed.join(", ") }
}

impl AsRef<str> for Target {
    fn as_ref(&self) -> &str {
        self.0
    }
}

impl Display for Target {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_listed_once_and_in_quotes() {
        assert_eq!(list_names(["depth", "a \"b\"", "depth"].into_iter()), r#""depth", "a \"b\"""#);
        assert_eq!(list_names(std::iter::empty()), "none");
    }
}
