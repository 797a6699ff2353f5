//! Text of files as messages quote it.

use crate::text::Escaped;

/// The first characters of a text, for messages, escaped.
pub(super) fn excerpt(text: &str) -> String {
    const MAX_CHARACTERS: usize = 160;
    match text.char_indices().nth(MAX_CHARACTERS) {
        Some((end, _)) => format!("{}…", Escaped(&text[..end])),
        None => Escaped(text).to_string(),
    }
}
