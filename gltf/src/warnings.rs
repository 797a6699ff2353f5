//! What the loader leaves out of a file.

use std::fmt::Display;

use crate::error::Problem;

/// Sentences about what the loader leaves out.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    /// Each once, up to a limit.
    listed: Vec<String>,
    greatest: usize,
    /// How many more there are.
    pub(crate) unlisted: u64,
    /// The first one about what would be drawn, whether it is listed or not.
    first_lost_shape: Option<String>,
}

impl Warnings {
    /// The most that it lists.
    pub(crate) fn new(greatest: u64) -> Self {
        Self { greatest: usize::try_from(greatest).unwrap_or(usize::MAX), ..Self::default() }
    }

    /// Adds a warning, unless it is listed already.
    pub(crate) fn add(&mut self, warning: impl Into<String>) {
        let warning = warning.into();
        if self.listed.contains(&warning) {
            return;
        }
        if self.listed.len() < self.greatest {
            self.listed.push(warning);
        } else {
            self.unlisted += 1;
        }
    }

    /// What was read; `None` if it has a problem, which is a warning that says what is `lost`.
    ///
    /// # Errors
    /// If the problem is one of the whole file.
    pub(crate) fn keep<T>(&mut self, read: Result<T, Problem>, lost: impl Display) -> Result<Option<T>, Problem> {
        match read {
            Ok(value) => Ok(Some(value)),
            Err(problem) if problem.is_of_file() => Err(problem),
            Err(problem) => {
                self.add(format!("{lost}: {problem}"));
                Ok(None)
            }
        }
    }

    /// As [`Self::keep`], for what would be drawn.
    ///
    /// # Errors
    /// If the problem is one of the whole file.
    pub(crate) fn keep_shape<T>(&mut self, read: Result<T, Problem>, lost: impl Display) -> Result<Option<T>, Problem> {
        match read {
            Err(problem) if !problem.is_of_file() => {
                self.lose_shape(format!("{lost}: {problem}"));
                Ok(None)
            }
            read => read.map(Some),
        }
    }

    /// Adds a warning about what would be drawn and is not, because something is wrong with it.
    pub(crate) fn lose_shape(&mut self, warning: String) {
        self.first_lost_shape.get_or_insert_with(|| warning.clone());
        self.add(warning);
    }

    /// The first of those.
    pub(crate) fn first_lost_shape(&self) -> Option<&str> {
        self.first_lost_shape.as_deref()
    }

    /// All that are listed.
    pub(crate) fn take(&mut self) -> Vec<String> {
        std::mem::take(&mut self.listed)
    }
}
