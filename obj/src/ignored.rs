//! Counts statements that are left out, by keyword.

use crate::error::{IgnoredKeyword, ObjWarning, excerpt};
use crate::warnings::Warnings;

/// The most keywords that are named: a file that is not OBJ has as many as it has lines.
const MAX_KEYWORDS: usize = 16;

/// The statements of a file that are left out.
#[derive(Debug, Default)]
pub(crate) struct IgnoredStatements {
    keywords: Vec<IgnoredKeyword>,
    others: usize,
}

impl IgnoredStatements {
    pub(crate) fn add(&mut self, keyword: &str, line: usize) {
        let keyword = excerpt(keyword);
        if let Some(known) = self.keywords.iter_mut().find(|known| known.keyword == keyword) {
            known.statements += 1;
        } else if self.keywords.len() < MAX_KEYWORDS {
            self.keywords.push(IgnoredKeyword { keyword, statements: 1, first_line: line });
        } else {
            self.others += 1;
        }
    }

    pub(crate) fn warn(self, file: &str, warnings: &mut Warnings) {
        let Self { keywords, others } = self;
        if !keywords.is_empty() {
            warnings.push(ObjWarning::IgnoredStatements { file: file.to_owned(), keywords, others });
        }
    }
}
