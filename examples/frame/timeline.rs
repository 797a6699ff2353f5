//! The outputs of the frames' timeline: a report as text, a page, a trace.

use std::error::Error;
use std::fs::File;
use std::io::{self, BufWriter};

use drawloom::report::{FrameReport, SchedulerCosts, write_chrome_trace, write_page};
use drawloom::timeline::{Frame, Log};
use drawloom_output::{OutputFile, path_text};

use crate::arguments::Arguments;

/// The number of recorded frames, from the last one backwards. The first frames create pipelines and try recording
/// strategies.
const RECORDED_FRAMES: u32 = 60;

/// The first frame to record, if any output of the timeline is requested.
pub fn first_recorded_frame(arguments: &Arguments) -> Option<u32> {
    let is_requested = arguments.explain || arguments.timeline.is_some() || arguments.html.is_some();
    is_requested.then_some(arguments.frames.count().saturating_sub(RECORDED_FRAMES))
}

/// Writes the requested files, and returns what is to be printed.
///
/// # Errors
/// If a file cannot be written, or if the frame to explain was not recorded completely.
pub fn write_outputs(arguments: &Arguments, log: &Log) -> Result<Vec<String>, Box<dyn Error>> {
    let mut lines = Vec::new();
    if let Some(file) = &arguments.timeline {
        lines.push(write(file, |file| write_chrome_trace(log, file))?);
    }
    if arguments.html.is_none() && !arguments.explain {
        return Ok(lines);
    }
    let costs = SchedulerCosts::measure()?;
    if let Some(file) = &arguments.html {
        lines.push(write(file, |file| write_page(log, &costs, file))?);
    }
    if let Some(frame) = median_frame(log).filter(|_| arguments.explain) {
        lines.push(format!("\n{}", FrameReport::new(log, frame, &costs)?));
    }
    Ok(lines)
}

/// The frame of median duration.
fn median_frame(log: &Log) -> Option<u64> {
    let mut frames = log.frames.clone();
    frames.sort_by_key(|frame: &Frame| frame.ended - frame.began);
    Some(frames.get(frames.len() / 2)?.number)
}

fn write(
    file: &OutputFile,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<String, Box<dyn Error>> {
    file.write(write)?;
    Ok(format!("{} written", path_text(file.path())))
}
