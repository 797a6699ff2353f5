//! Writes events of the Trace Event Format, one after another.

use std::fmt;
use std::io::{self, Write};
use std::time::Duration;

use serde::Serialize;

/// Writes the events of a trace.
pub(super) struct EventWriter<W> {
    writer: W,
    is_empty: bool,
}

/// The track of an event: a process and a thread in the terms of the format.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    pub(super) process: usize,
    pub(super) thread: usize,
}

impl<W: Write> EventWriter<W> {
    /// Begins a trace.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn new(mut writer: W) -> io::Result<Self> {
        writer.write_all(b"{\"displayTimeUnit\":\"ns\",\"traceEvents\":[")?;
        Ok(Self { writer, is_empty: true })
    }

    /// Begins an event. The caller ends it.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn event(
        &mut self,
        kind: &str,
        category: &str,
        name: &str,
        track: Track,
    ) -> io::Result<ObjectWriter<'_, W>> {
        self.writer.write_all(if self.is_empty { b"\n" } else { b",\n" })?;
        self.is_empty = false;
        let event =
            ObjectWriter::begin(&mut self.writer)?.value("ph", kind)?.value("cat", category)?.value("name", name)?;
        event.value("pid", track.process)?.value("tid", track.thread)
    }

    /// Begins a complete event, which has a start and a duration. The caller ends it.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn slice(
        &mut self,
        category: &str,
        name: &str,
        track: Track,
        began: Duration,
        ended: Duration,
    ) -> io::Result<ObjectWriter<'_, W>> {
        let event = self.event("X", category, name, track)?;
        event.time("ts", began)?.time("dur", ended.saturating_sub(began))
    }

    /// Writes a counter event.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn counter(&mut self, name: &str, track: Track, at: Duration, value: impl Serialize) -> io::Result<()> {
        let event = self.event("C", "counter", name, track)?.time("ts", at)?;
        event.object("args", |arguments| arguments.value("value", value))?.end()
    }

    /// Writes a metadata event about a process or a thread: `thread_name`, for example.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn metadata(&mut self, name: &str, track: Track, key: &str, value: impl Serialize) -> io::Result<()> {
        self.event("M", "__metadata", name, track)?.object("args", |arguments| arguments.value(key, value))?.end()
    }

    /// Ends the trace, with an object about the trace as a whole.
    ///
    /// # Errors
    /// Returns the error of the writer or of `other_data`.
    pub(super) fn finish(
        mut self,
        other_data: impl FnOnce(ObjectWriter<'_, W>) -> io::Result<ObjectWriter<'_, W>>,
    ) -> io::Result<()> {
        self.writer.write_all(b"\n],\"otherData\":")?;
        other_data(ObjectWriter::begin(&mut self.writer)?)?.end()?;
        self.writer.write_all(b"}\n")?;
        self.writer.flush()
    }
}

/// Writes a JSON object.
#[must_use = "without `end` the object is not closed"]
pub(super) struct ObjectWriter<'writer, W> {
    writer: &'writer mut W,
    is_empty: bool,
}

impl<'writer, W: Write> ObjectWriter<'writer, W> {
    fn begin(writer: &'writer mut W) -> io::Result<Self> {
        writer.write_all(b"{")?;
        Ok(Self { writer, is_empty: true })
    }

    /// Adds a value.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn value(mut self, key: &str, value: impl Serialize) -> io::Result<Self> {
        self.key(key)?;
        serde_json::to_writer(&mut *self.writer, &value)?;
        Ok(self)
    }

    /// Adds a time.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn time(mut self, key: &str, time: Duration) -> io::Result<Self> {
        self.key(key)?;
        write!(self.writer, "{}", microseconds(time))?;
        Ok(self)
    }

    /// Adds an object that `fill` writes.
    ///
    /// # Errors
    /// Returns the error of the writer or of `fill`.
    pub(super) fn object(
        mut self,
        key: &str,
        fill: impl FnOnce(ObjectWriter<'_, W>) -> io::Result<ObjectWriter<'_, W>>,
    ) -> io::Result<Self> {
        self.key(key)?;
        fill(ObjectWriter::begin(self.writer)?)?.end()?;
        Ok(self)
    }

    /// Closes the object.
    ///
    /// # Errors
    /// Returns the writer's error.
    pub(super) fn end(self) -> io::Result<()> {
        self.writer.write_all(b"}")
    }

    fn key(&mut self, key: &str) -> io::Result<()> {
        let separator = if self.is_empty { "" } else { "," };
        self.is_empty = false;
        write!(self.writer, "{separator}\"{key}\":")
    }
}

/// With three decimals, so that times of any size are exact to the nanosecond.
pub(super) fn microseconds(time: Duration) -> impl fmt::Display {
    let nanoseconds = time.as_nanos();
    fmt::from_fn(move |formatter| write!(formatter, "{}.{:03}", nanoseconds / 1000, nanoseconds % 1000))
}
