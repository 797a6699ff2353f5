//! What the loader leaves out of a file.

/// Sentences about what the loader leaves out, each once.
#[derive(Debug, Default)]
pub(crate) struct Warnings(Vec<String>);

impl Warnings {
    /// Adds a warning, unless it is there already.
    pub(crate) fn add(&mut self, warning: impl Into<String>) {
        let warning = warning.into();
        if !self.0.contains(&warning) {
            self.0.push(warning);
        }
    }

    /// All of them.
    pub(crate) fn into_inner(self) -> Vec<String> {
        self.0
    }
}
