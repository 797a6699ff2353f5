//! Text of files in messages, which reach terminals and reports.

use drawloom::text::Escaped;

/// How many characters of a text messages show.
const MAX_CHARACTERS: usize = 80;

/// The beginning of a text, [escaped](Escaped).
pub(crate) fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MAX_CHARACTERS) {
        Some((end, _)) => format!("{}…", Escaped(&text[..end])),
        None => Escaped(text).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::excerpt;

    #[test]
    fn controls_are_escaped_and_long_text_is_cut() {
        assert_eq!(excerpt("été\u{1b}]0;title\u{7}\u{9b}31m"), "été\\u{1b}]0;title\\u{7}\\u{9b}31m");
        assert_eq!(excerpt("a\u{202e}b\u{2028}c"), "a\\u{202e}b\\u{2028}c");
        assert_eq!(excerpt(&"x".repeat(1000)), format!("{}…", "x".repeat(80)));
    }
}
