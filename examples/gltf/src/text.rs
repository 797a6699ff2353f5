//! Text of files in messages, which reach terminals and reports.

/// How many characters of a text messages show.
const MAX_CHARACTERS: usize = 80;

/// The beginning of a text, without control characters and those that turn or break lines: they are escaped, so that
/// none reaches a terminal.
pub(crate) fn excerpt(text: &str) -> String {
    let mut shown = String::new();
    for (number, character) in text.chars().enumerate() {
        if number == MAX_CHARACTERS {
            shown.push('…');
            break;
        }
        let breaks = matches!(character, '\u{2028}' | '\u{2029}');
        let turns = matches!(character, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        if character.is_control() || breaks || turns {
            shown.extend(character.escape_unicode());
        } else {
            shown.push(character);
        }
    }
    shown
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
