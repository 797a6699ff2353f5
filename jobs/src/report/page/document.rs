//! Writes the page.

use std::io::{self, BufWriter, Write};

use serde::Serialize;
use serde_json::Serializer;
use serde_json::ser::Formatter;

use super::data::Data;
use crate::report::SchedulerCosts;
use crate::timeline::Log;

/// The document, with placeholders in braces.
const DOCUMENT: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPTS: [&str; 5] = [
    include_str!("model.js"),
    include_str!("tracks.js"),
    include_str!("overlay.js"),
    include_str!("panels.js"),
    include_str!("controls.js"),
];

/// Writes a page that shows the log in a browser: one HTML file, which loads nothing else.
///
/// Each worker has a track, and each stage a colour. Beside them is the [report](super::super::FrameReport) of the
/// chosen frame. Every frame is replayed for its report, so a long log takes a while. A chunk takes some 40 bytes, and
/// the report of a frame some 4 KiB.
///
/// # Errors
/// Returns the error of `writer`, or [`InvalidData`](io::ErrorKind::InvalidData) if the log refers to a node, a worker
/// or a thread that it does not list. A [`Timeline`](crate::timeline::Timeline) records no such log.
pub fn write_page(log: &Log, costs: &SchedulerCosts, writer: impl Write) -> io::Result<()> {
    let data = Data::new(log, costs)?;
    let mut writer = BufWriter::new(writer);
    let mut rest = DOCUMENT;
    for placeholder in ["{style}", "{data}", "{script}"] {
        let (before, after) = rest.split_once(placeholder).unwrap_or((rest, ""));
        writer.write_all(before.as_bytes())?;
        match placeholder {
            "{style}" => writer.write_all(STYLE.as_bytes())?,
            "{data}" => data.serialize(&mut Serializer::with_formatter(&mut writer, ScriptSafe))?,
            _ => SCRIPTS.iter().try_for_each(|script| writer.write_all(script.as_bytes()))?,
        }
        rest = after;
    }
    writer.write_all(rest.as_bytes())?;
    writer.flush()
}

/// Formats JSON so that nothing in it ends the script element around it, or a line of a script.
struct ScriptSafe;

impl Formatter for ScriptSafe {
    fn write_string_fragment<W: ?Sized + Write>(&mut self, writer: &mut W, fragment: &str) -> io::Result<()> {
        let mut rest = fragment;
        while let Some(index) = rest.find(['<', '\u{2028}', '\u{2029}']) {
            let (plain, special) = rest.split_at(index);
            let mut following = special.chars();
            let code = following.next().map_or(0, u32::from);
            write!(writer, "{plain}\\u{code:04x}")?;
            rest = following.as_str();
        }
        writer.write_all(rest.as_bytes())
    }
}
