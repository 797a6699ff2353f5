//! Text of files as messages quote it.

/// The first characters of a text, for messages.
pub(super) fn excerpt(text: &str) -> String {
    const MAX_CHARACTERS: usize = 160;
    match text.char_indices().nth(MAX_CHARACTERS) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
