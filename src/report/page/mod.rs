//! A page that shows a log: one HTML file that needs nothing else.

mod data;

use std::io::{self, BufWriter, Write};

use serde::Serialize;
use serde_json::{Serializer, ser::Formatter};

use self::data::Data;
use super::SchedulerCosts;
use crate::timeline::Log;

/// The document, with the names of its parts in braces where they go.
const DOCUMENT: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const MODEL: &str = include_str!("model.js");
const DRAWING: &str = include_str!("drawing.js");
const OVERLAY: &str = include_str!("overlay.js");
const WORDS: &str = include_str!("words.js");
const CONTROLS: &str = include_str!("controls.js");

/// Writes a page that shows the log, to be opened in a browser: one HTML file, which loads nothing.
///
/// Workers are lanes and stages colours. Beside them stands, for each frame, its [report](super::FrameReport), which every
/// frame is replayed for: so a long log takes its time. A chunk takes some 40 bytes, and the words of a frame's report some 4 KiB.
///
/// # Errors
///
/// If the writer fails; if the log speaks of a process, a worker or a thread that it does not have
/// ([`InvalidData`](io::ErrorKind::InvalidData)), as none does that a [`Timeline`](crate::timeline::Timeline) has recorded.
pub fn write_page(log: &Log, prices: &SchedulerCosts, writer: impl Write) -> io::Result<()> {
    let data = Data::new(log, prices)?;
    let mut writer = BufWriter::new(writer);
    let mut rest = DOCUMENT;
    for part in ["{style}", "{data}", "{script}"] {
        let (before, after) = rest.split_once(part).unwrap_or((rest, ""));
        writer.write_all(before.as_bytes())?;
        match part {
            "{style}" => writer.write_all(STYLE.as_bytes())?,
            "{data}" => data.serialize(&mut Serializer::with_formatter(&mut writer, InsideScript))?,
            _ => [MODEL, DRAWING, OVERLAY, WORDS, CONTROLS]
                .iter()
                .try_for_each(|script| writer.write_all(script.as_bytes()))?,
        }
        rest = after;
    }
    writer.write_all(rest.as_bytes())?;
    writer.flush()
}

/// JSON without anything that could end the element it stands in, or a line of a script.
struct InsideScript;

impl Formatter for InsideScript {
    fn write_string_fragment<W: ?Sized + Write>(&mut self, writer: &mut W, fragment: &str) -> io::Result<()> {
        let mut rest = fragment;
        while let Some(place) = rest.find(['<', '\u{2028}', '\u{2029}']) {
            let (plain, special) = rest.split_at(place);
            let mut following = special.chars();
            let code = following.next().map_or(0, u32::from);
            write!(writer, "{plain}\\u{code:04x}")?;
            rest = following.as_str();
        }
        writer.write_all(rest.as_bytes())
    }
}
