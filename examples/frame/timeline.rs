//! What the frames' timeline is asked for: words, a page, a trace.

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use drawloom::report::{FrameReport, SchedulerCosts, write_chrome_trace, write_page};
use drawloom::timeline::{Frame, Log};

use crate::arguments::Arguments;

/// How many of the last frames are recorded: the first ones make pipelines, and try ways to record.
const FRAMES: u32 = 60;

/// For how many jobs there is room, a worker.
pub const CAPACITY: usize = 1 << 18;

/// The first frame that is to be recorded, if any is.
pub fn begins_at(arguments: &Arguments) -> Option<u32> {
    let is_asked = arguments.explain || arguments.timeline.is_some() || arguments.html.is_some();
    is_asked.then_some(arguments.frames.saturating_sub(FRAMES))
}

/// Writes and prints what was asked for.
///
/// # Errors
/// If a file cannot be written, or if not all of the frame that is to be explained was recorded.
pub fn tell(arguments: &Arguments, log: &Log) -> Result<(), Box<dyn Error>> {
    if let Some(path) = &arguments.timeline {
        write(path, |file| write_chrome_trace(log, file))?;
    }
    if arguments.html.is_none() && !arguments.explain {
        return Ok(());
    }
    let costs = SchedulerCosts::measure()?;
    if let Some(path) = &arguments.html {
        write(path, |file| write_page(log, &costs, file))?;
    }
    if let Some(frame) = middle(log).filter(|_| arguments.explain) {
        println!("\n{}", FrameReport::new(log, frame, &costs)?);
    }
    Ok(())
}

/// The frame that as many others are shorter than as are longer.
fn middle(log: &Log) -> Option<u64> {
    let mut frames = log.frames.clone();
    frames.sort_by_key(|frame: &Frame| frame.ended - frame.began);
    Some(frames.get(frames.len() / 2)?.number)
}

fn write(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>) -> Result<(), Box<dyn Error>> {
    let written = File::create(path).and_then(|file| {
        let mut file = BufWriter::new(file);
        write(&mut file)?;
        file.flush()
    });
    written.map_err(|error| format!("{} could not be written: {error}", path.display()))?;
    println!("{} written", path.display());
    Ok(())
}
