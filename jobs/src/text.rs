//! Text of files and engines as messages quote it.

use std::fmt::{self, Display, Formatter, Write};
use std::path::Path;

/// A text on one line, in which characters are escaped that do more than show: control characters, which terminals
/// obey, and those that break lines or turn the direction in which text is read.
///
/// Backslashes are kept, so that paths of Windows are legible. A name that spells `\u{a}` out therefore looks
/// like one with a line feed: the result is to be read, and not to be decoded.
///
/// ```
/// use drawloom_jobs::text::Escaped;
///
/// assert_eq!(Escaped::new("été \"oak\"\n\u{1b}[2J").to_string(), "été \"oak\"\\u{a}\\u{1b}[2J");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Escaped<'a>(&'a str);

impl<'a> Escaped<'a> {
    /// Escapes this text where it is shown.
    pub const fn new(text: &'a str) -> Self {
        Self(text)
    }
}

impl Display for Escaped<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|character| match character {
            _ if is_escaped(character) => write!(formatter, "{}", character.escape_unicode()),
            _ => formatter.write_char(character),
        })
    }
}

/// The first `max_characters` of a text, [escaped](Escaped), with `…` where more follow.
///
/// ```
/// assert_eq!(drawloom_jobs::text::excerpt("été\noak", 4), "été\\u{a}…");
/// ```
pub fn excerpt(text: &str, max_characters: usize) -> String {
    match text.char_indices().nth(max_characters) {
        Some((end, _)) => format!("{}…", Escaped(&text[..end])),
        None => Escaped(text).to_string(),
    }
}

/// A whole path, [escaped](Escaped): a path that is cut cannot be found.
pub fn path_text(path: &Path) -> String {
    Escaped(&path.display().to_string()).to_string()
}

/// Whether a character does more than show.
pub(crate) fn is_escaped(character: char) -> bool {
    let breaks = matches!(character, '\u{2028}' | '\u{2029}');
    // All of Unicode's property `Bidi_Control`.
    let turns = matches!(
        character,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    );
    character.is_control() || breaks || turns
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_more_than_show_is_escaped() {
        assert_eq!(Escaped("\u{7}\u{9b}\r\n\t\u{7f}").to_string(), "\\u{7}\\u{9b}\\u{d}\\u{a}\\u{9}\\u{7f}");
        assert_eq!(Escaped("a\u{202e}b\u{2028}c\u{61c}").to_string(), "a\\u{202e}b\\u{2028}c\\u{61c}");
        assert_eq!(Escaped("'é' \"\\\" \u{301} 表\u{200d}").to_string(), "'é' \"\\\" \u{301} 表\u{200d}");
    }

    #[test]
    fn backslashes_stay() {
        assert_eq!(Escaped::new("C:\\new\\u{a}").to_string(), "C:\\new\\u{a}");
    }

    #[test]
    fn an_excerpt_counts_characters_before_they_are_escaped() {
        let text = "é\u{1b}表\u{2028}";
        let shown = ["…", "é…", "é\\u{1b}…", "é\\u{1b}表…", "é\\u{1b}表\\u{2028}", "é\\u{1b}表\\u{2028}"];
        for (count, expected) in shown.into_iter().enumerate() {
            assert_eq!(excerpt(text, count), expected);
        }
        assert_eq!(excerpt("", 0), "");
    }

    #[test]
    fn paths_are_escaped_and_not_cut() {
        let name = "x".repeat(1000);
        assert_eq!(path_text(Path::new(&format!("a/{name}\u{1b}\n"))), format!("a/{name}\\u{{1b}}\\u{{a}}"));
    }

    /// `char::escape_debug` escapes what is not printable, and more.
    #[test]
    fn all_that_is_escaped_is_not_printable() {
        let escaped: Vec<_> = ('\0'..=char::MAX).filter(|character| is_escaped(*character)).collect();
        assert_eq!(escaped.len(), 65 + 2 + 12);
        assert!(escaped.iter().all(|character| character.escape_debug().count() > 1), "{escaped:?}");
    }
}
