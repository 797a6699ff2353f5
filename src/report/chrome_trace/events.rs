//! Events of the Trace Event Format, written one after another.

use std::{
    fmt,
    io::{self, Write},
    time::Duration,
};

use serde::Serialize;

/// A trace that is being written.
pub(super) struct Events<W> {
    writer: W,
    is_empty: bool,
}

/// Where an event stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lane {
    pub(super) process: usize,
    pub(super) thread: usize,
}

impl<W: Write> Events<W> {
    pub(super) fn begin(mut writer: W) -> io::Result<Self> {
        writer.write_all(b"{\"displayTimeUnit\":\"ns\",\"traceEvents\":[")?;
        Ok(Self { writer, is_empty: true })
    }

    /// An event, to be ended by the caller.
    pub(super) fn event(&mut self, kind: &str, category: &str, name: &str, lane: Lane) -> io::Result<Object<'_, W>> {
        self.writer.write_all(if self.is_empty { b"\n" } else { b",\n" })?;
        self.is_empty = false;
        let event = Object::begin(&mut self.writer)?.value("ph", kind)?.value("cat", category)?.value("name", name)?;
        event.value("pid", lane.process)?.value("tid", lane.thread)
    }

    /// A complete event: something that began and ended.
    pub(super) fn slice(
        &mut self,
        category: &str,
        name: &str,
        lane: Lane,
        began: Duration,
        ended: Duration,
    ) -> io::Result<Object<'_, W>> {
        let event = self.event("X", category, name, lane)?;
        event.time("ts", began)?.time("dur", ended.saturating_sub(began))
    }

    /// A reading of a counter.
    pub(super) fn reading(&mut self, name: &str, lane: Lane, at: Duration, value: impl Serialize) -> io::Result<()> {
        let event = self.event("C", "counter", name, lane)?.time("ts", at)?;
        event.object("args", |arguments| arguments.value("value", value))?.end()
    }

    /// What is told of a process or a thread itself: `thread_name`, say.
    pub(super) fn metadata(&mut self, what: &str, lane: Lane, key: &str, value: impl Serialize) -> io::Result<()> {
        self.event("M", "__metadata", what, lane)?.object("args", |arguments| arguments.value(key, value))?.end()
    }

    /// Ends the trace, with what is to be said of it as a whole.
    pub(super) fn finish(
        mut self,
        other_data: impl FnOnce(Object<'_, W>) -> io::Result<Object<'_, W>>,
    ) -> io::Result<()> {
        self.writer.write_all(b"\n],\"otherData\":")?;
        other_data(Object::begin(&mut self.writer)?)?.end()?;
        self.writer.write_all(b"}\n")?;
        self.writer.flush()
    }
}

/// A JSON object that is being written.
#[must_use = "it is to be ended"]
pub(super) struct Object<'writer, W> {
    writer: &'writer mut W,
    is_empty: bool,
}

impl<'writer, W: Write> Object<'writer, W> {
    fn begin(writer: &'writer mut W) -> io::Result<Self> {
        writer.write_all(b"{")?;
        Ok(Self { writer, is_empty: true })
    }

    pub(super) fn value(mut self, key: &str, value: impl Serialize) -> io::Result<Self> {
        self.key(key)?;
        serde_json::to_writer(&mut *self.writer, &value)?;
        Ok(self)
    }

    pub(super) fn time(mut self, key: &str, time: Duration) -> io::Result<Self> {
        self.key(key)?;
        write!(self.writer, "{}", microseconds(time))?;
        Ok(self)
    }

    pub(super) fn object(
        mut self,
        key: &str,
        fill: impl FnOnce(Object<'_, W>) -> io::Result<Object<'_, W>>,
    ) -> io::Result<Self> {
        self.key(key)?;
        fill(Object::begin(self.writer)?)?.end()?;
        Ok(self)
    }

    pub(super) fn end(self) -> io::Result<()> {
        self.writer.write_all(b"}")
    }

    fn key(&mut self, key: &str) -> io::Result<()> {
        let separator = if self.is_empty { "" } else { "," };
        self.is_empty = false;
        write!(self.writer, "{separator}\"{key}\":")
    }
}

/// With three decimals: all nanoseconds are told apart, however many there are.
pub(super) fn microseconds(time: Duration) -> impl fmt::Display {
    let nanoseconds = time.as_nanos();
    fmt::from_fn(move |formatter| write!(formatter, "{}.{:03}", nanoseconds / 1000, nanoseconds % 1000))
}
