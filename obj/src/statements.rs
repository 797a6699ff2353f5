//! The statements of OBJ and MTL files, read as streams.
//!
//! Lines end in LF, CR or both. Text is UTF-8 or, with a byte order mark or recognised by its first two characters,
//! UTF-16. A line that is not UTF-8 is read as Latin-1, in which every byte is a character: names in other encodings
//! look wrong, but those of an OBJ file still match those of its libraries. Control characters are escaped, so that no
//! name has any.

use std::io::{self, BufRead};

use crate::error::ObjWarning;
use crate::warnings::Warnings;

/// How the bytes of a file become characters.
#[derive(Clone, Copy, Debug)]
enum Encoding {
    Utf8,
    Utf16 { to_u16: fn([u8; 2]) -> u16 },
}

/// Reads one statement after the other.
#[derive(Debug)]
pub(crate) struct Statements<R> {
    reader: R,
    encoding: Encoding,
    max_line_bytes: u64,
    /// The number of the last line that was read, counted from 1.
    line: usize,
    /// The bytes of that line, without its end.
    bytes: Vec<u8>,
    /// Whether that line is longer than is allowed. Then `bytes` lacks the rest.
    is_too_long: bool,
    /// Whether the last line ended in CR, so that LF directly behind belongs to it.
    ended_in_cr: bool,
    statement: String,
    /// The number of lines that are not text in the file's encoding, and the first of them.
    not_text: (usize, usize),
    /// The same for lines that are too long.
    too_long: (usize, usize),
}

impl<R: BufRead> Statements<R> {
    /// # Errors
    /// If the reader fails.
    pub(crate) fn new(mut reader: R, max_line_bytes: u64) -> io::Result<Self> {
        let (encoding, mark) = match reader.fill_buf()? {
            [0xef, 0xbb, 0xbf, ..] => (Encoding::Utf8, 3),
            [0xff, 0xfe, ..] => (Encoding::Utf16 { to_u16: u16::from_le_bytes }, 2),
            [0xfe, 0xff, ..] => (Encoding::Utf16 { to_u16: u16::from_be_bytes }, 2),
            [1..=255, 0, 1..=255, 0, ..] => (Encoding::Utf16 { to_u16: u16::from_le_bytes }, 0),
            [0, 1..=255, 0, 1..=255, ..] => (Encoding::Utf16 { to_u16: u16::from_be_bytes }, 0),
            _ => (Encoding::Utf8, 0),
        };
        reader.consume(mark);
        Ok(Self {
            reader,
            encoding,
            max_line_bytes,
            line: 0,
            bytes: Vec::new(),
            is_too_long: false,
            ended_in_cr: false,
            statement: String::new(),
            not_text: (0, 0),
            too_long: (0, 0),
        })
    }

    /// The next statement, with the number of its last line, or `None` at the end. A backslash at the end continues a
    /// line.
    ///
    /// # Errors
    /// If the reader fails.
    pub(crate) fn next(&mut self) -> io::Result<Option<(usize, &str)>> {
        loop {
            self.statement.clear();
            let is_complete = self.read_statement()?;
            let text = self.statement.trim();
            if !text.is_empty() && !text.starts_with('#') {
                break;
            }
            if !is_complete {
                return Ok(None);
            }
        }
        Ok(Some((self.line, self.statement.trim())))
    }

    /// Reads a line and those that continue it. Returns false at the end of the file.
    fn read_statement(&mut self) -> io::Result<bool> {
        let mut is_too_long = false;
        loop {
            let is_line = self.read_line()?;
            // A comment is not continued: many end with the path of a folder. It may be in any encoding.
            if self.statement.is_empty() && self.bytes.trim_ascii_start().starts_with(b"#") {
                return Ok(is_line);
            }
            let is_continued = is_line && self.takes_continuation();
            is_too_long |= self.is_too_long || (self.statement.len() + self.bytes.len()) as u64 > self.max_line_bytes;
            if is_too_long {
                self.statement.clear();
            } else {
                self.append_line();
            }
            if !is_continued {
                if is_too_long {
                    count(&mut self.too_long, self.line);
                }
                return Ok(is_line);
            }
            self.statement.push(' ');
        }
    }

    /// The first line that is not text in the file's encoding.
    pub(crate) fn first_non_text_line(&self) -> Option<usize> {
        let (lines, first) = self.not_text;
        (lines > 0).then_some(first)
    }

    /// The first line that is too long.
    pub(crate) fn first_long_line(&self) -> Option<usize> {
        let (lines, first) = self.too_long;
        (lines > 0).then_some(first)
    }

    /// Warns about lines that were left out or may be misread.
    pub(crate) fn warn(&self, file: &str, warnings: &mut Warnings) {
        let file = || file.to_owned();
        let (lines, first_line) = self.not_text;
        if lines > 0 {
            warnings.push(ObjWarning::NotUnicode { file: file(), lines, first_line });
        }
        let (lines, first_line) = self.too_long;
        if lines > 0 {
            warnings.push(ObjWarning::LongLines { file: file(), lines, first_line, limit: self.max_line_bytes });
        }
    }

    /// Removes the backslash that continues the line, if there is one.
    fn takes_continuation(&mut self) -> bool {
        let [before @ .., b'\\'] = &self.bytes[..] else {
            return false;
        };
        // The second byte of some characters in Shift-JIS and GBK is a backslash.
        let is_in_character = before.last().is_some_and(|byte| !byte.is_ascii()) && str::from_utf8(before).is_err();
        if !is_in_character {
            self.bytes.pop();
        }
        !is_in_character
    }

    /// Appends the line to the statement.
    fn append_line(&mut self) {
        let bytes = self.bytes.as_slice();
        let mut append = |character: char| push_escaped(&mut self.statement, character);
        match str::from_utf8(bytes) {
            // All that need no escape.
            Ok(text) if text.bytes().all(|byte| matches!(byte, b' '..0x7f | b'\t')) => self.statement.push_str(text),
            Ok(text) => text.chars().for_each(append),
            Err(_) => {
                count(&mut self.not_text, self.line);
                bytes.iter().for_each(|&byte| append(char::from(byte)));
            }
        }
    }

    /// Reads the next line into `bytes`, as UTF-8 unless it is in another encoding. Returns false at the end.
    fn read_line(&mut self) -> io::Result<bool> {
        self.bytes.clear();
        self.is_too_long = false;
        self.line += 1;
        let is_line = match self.encoding {
            Encoding::Utf8 => self.read_bytes(),
            Encoding::Utf16 { to_u16 } => self.read_utf16(to_u16),
        }?;
        self.line -= usize::from(!is_line);
        Ok(is_line)
    }

    fn read_bytes(&mut self) -> io::Result<bool> {
        let mut is_end = true;
        loop {
            let available = self.reader.fill_buf()?;
            if available.is_empty() {
                return Ok(!is_end);
            }
            if std::mem::take(&mut self.ended_in_cr) && available[0] == b'\n' {
                self.reader.consume(1);
                continue;
            }
            is_end = false;
            let end = line_end(available);
            let part = &available[..end.unwrap_or(available.len())];
            if (self.bytes.len() + part.len()) as u64 <= self.max_line_bytes {
                self.bytes.extend_from_slice(part);
            } else {
                self.is_too_long = true;
            }
            self.ended_in_cr = end.is_some_and(|end| available[end] == b'\r');
            let consumed = part.len() + usize::from(end.is_some());
            self.reader.consume(consumed);
            if end.is_some() {
                return Ok(true);
            }
        }
    }

    fn read_utf16(&mut self, to_u16: fn([u8; 2]) -> u16) -> io::Result<bool> {
        let mut units = Vec::new();
        let mut is_end = true;
        while let Some(unit) = self.read_unit(to_u16)? {
            let follows_cr = std::mem::take(&mut self.ended_in_cr);
            if unit == u16::from(b'\n') && follows_cr && is_end {
                continue;
            }
            is_end = false;
            if unit == u16::from(b'\n') || unit == u16::from(b'\r') {
                self.ended_in_cr = unit == u16::from(b'\r');
                break;
            }
            if (units.len() as u64) < self.max_line_bytes / 2 {
                units.push(unit);
            } else {
                self.is_too_long = true;
            }
        }
        if char::decode_utf16(units.iter().copied()).any(|character| character.is_err()) {
            count(&mut self.not_text, self.line);
        }
        self.bytes.extend_from_slice(String::from_utf16_lossy(&units).as_bytes());
        Ok(!is_end)
    }

    /// The next two bytes, unless fewer are left.
    fn read_unit(&mut self, to_u16: fn([u8; 2]) -> u16) -> io::Result<Option<u16>> {
        let mut unit = [0; 2];
        match self.reader.read_exact(&mut unit) {
            Ok(()) => Ok(Some(to_u16(unit))),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(error),
        }
    }
}

/// The index of the first LF or CR.
fn line_end(bytes: &[u8]) -> Option<usize> {
    let is_end = |byte: u8| byte == b'\n' || byte == b'\r';
    // Without an early exit, so that it takes a few instructions for all.
    let has_end = |chunk: &&[u8]| chunk.iter().fold(false, |found, &byte| found | is_end(byte));
    let skipped = bytes.chunks(64).take_while(|chunk| !has_end(chunk)).map(<[u8]>::len).sum::<usize>();
    bytes[skipped..].iter().position(|&byte| is_end(byte)).map(|end| skipped + end)
}

fn count((lines, first): &mut (usize, usize), line: usize) {
    if *lines == 0 {
        *first = line;
    }
    *lines += 1;
}

/// The values of a statement, without the comment behind them. Names may contain `#`.
pub(crate) fn without_comment(values: &str) -> &str {
    values.split_once('#').map_or(values, |(values, _)| values)
}

/// Appends a character of a statement. Messages escape more of what they quote: a file may have that name.
fn push_escaped(text: &mut String, character: char) {
    match character {
        '\t' => text.push('\t'),
        '\u{b}' | '\u{c}' => text.push(' '),
        _ if character.is_control() => text.extend(character.escape_unicode()),
        _ => text.push(character),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(bytes: &[u8]) -> (Vec<(usize, String)>, Vec<ObjWarning>) {
        let mut found = Vec::new();
        let mut statements = Statements::new(bytes, 60).unwrap();
        while let Some((line, statement)) = statements.next().unwrap() {
            found.push((line, statement.to_owned()));
        }
        let mut warnings = Warnings::new(9);
        statements.warn("a.obj", &mut warnings);
        (found, warnings.listed)
    }

    fn texts(bytes: &[u8]) -> Vec<String> {
        statements(bytes).0.into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn a_continued_line_has_the_number_of_its_last_line() {
        let parsed = statements(b"# head\r\nf 1 2 \\\r\n 3\r\n\nv 1\\").0;
        assert_eq!(parsed, [(3, String::from("f 1 2   3")), (5, String::from("v 1"))]);
        let parsed = statements(b"# C:\\models\\\nv 1\n  # D:\\\nv 2").0;
        assert_eq!(parsed, [(2, String::from("v 1")), (4, String::from("v 2"))]);
    }

    #[test]
    fn lines_end_in_lf_or_cr_or_both() {
        for end in ["\n", "\r", "\r\n"] {
            let text = ["v 1", "", "v 2 \\", "3", "# no", "v 4"].join(end);
            let expected = [(1, String::from("v 1")), (4, String::from("v 2  3")), (6, String::from("v 4"))];
            assert_eq!(statements(text.as_bytes()).0, expected, "{end:?}");
            // CR and LF may lie in different buffers.
            let mut by_byte = Statements::new(io::BufReader::with_capacity(1, text.as_bytes()), 60).unwrap();
            for (line, statement) in &expected {
                assert_eq!(by_byte.next().unwrap(), Some((*line, statement.as_str())), "{end:?} byte by byte");
            }
            assert_eq!(by_byte.next().unwrap(), None);
            let units = |to_bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(to_bytes).collect::<Vec<_>>();
            for bytes in [units(u16::to_le_bytes), units(u16::to_be_bytes)] {
                assert_eq!(statements(&bytes).0, expected, "{end:?} in UTF-16");
            }
        }
    }

    #[test]
    fn the_end_of_a_line_is_found_wherever_it_is() {
        for length in 0..200 {
            assert_eq!(line_end(&vec![b'x'; length]), None);
            for end in 0..length {
                let mut bytes = vec![b'x'; length];
                bytes[end] = b'\r';
                bytes[length - 1] = if end + 1 < length { b'\n' } else { b'\r' };
                assert_eq!(line_end(&bytes), Some(end), "{length}");
            }
        }
    }

    #[test]
    fn a_byte_order_mark_decides() {
        assert_eq!(texts("\u{feff}o ä".as_bytes()), ["o ä"]);
        let little: Vec<u8> = "\u{feff}o ä\u{1f600}".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = "\u{feff}o ä\u{1f600}".encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert_eq!(
            (texts(&little), texts(&big)),
            (vec![String::from("o ä\u{1f600}")], vec![String::from("o ä\u{1f600}")])
        );
        // Half a surrogate pair.
        let (found, warnings) = statements(&[0xff, 0xfe, b'o', 0, b' ', 0, 0x3d, 0xd8]);
        assert_eq!(found, [(1, String::from("o \u{fffd}"))]);
        assert!(matches!(warnings[..], [ObjWarning::NotUnicode { lines: 1, first_line: 1, .. }]), "{warnings:?}");
    }

    #[test]
    fn lines_that_are_not_utf_8_are_read_as_latin_1_and_counted() {
        // The name in the last line is 表 in Shift-JIS, which ends with a backslash.
        let (found, warnings) = statements(b"v 1\n# caf\xe9\no caf\xe9\no \xc3\xa9\nusemtl \x95\\\nv 2");
        let expected = [(1, "v 1"), (3, "o café"), (4, "o é"), (5, "usemtl \\u{95}\\"), (6, "v 2")];
        assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
        assert!(matches!(warnings[..], [ObjWarning::NotUnicode { lines: 2, first_line: 3, .. }]), "{warnings:?}");
    }

    #[test]
    fn control_characters_are_escaped() {
        assert_eq!(texts(b"o \x1b[31mred\x07\tand\x0bso \xc2\x9b on"), ["o \\u{1b}[31mred\\u{7}\tand so \\u{9b} on"]);
    }

    #[test]
    fn a_line_that_is_too_long_is_left_out_and_counted() {
        let long = "1 ".repeat(40);
        let (found, warnings) =
            statements(format!("v 1\nf {long}\nf 1 \\\n{}\\\n{}\nv 2", &long[..50], &long[..20]).as_bytes());
        assert_eq!(found.first().map(|(line, _)| *line), Some(1));
        assert_eq!(found.last(), Some(&(6, String::from("v 2"))));
        assert!(
            matches!(warnings[..], [ObjWarning::LongLines { lines: 2, first_line: 2, limit: 60, .. }]),
            "{warnings:?}"
        );
    }
}
