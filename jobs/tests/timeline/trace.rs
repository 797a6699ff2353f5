//! Parses a Chrome trace.

use drawloom_jobs::report::write_chrome_trace;
use drawloom_jobs::timeline::Log;
use serde_json::Value;

/// The trace of a log, parsed.
pub struct Trace {
    pub text: String,
    pub other_data: Value,
    pub events: Vec<Event>,
}

/// An event. Times are in nanoseconds.
#[derive(Clone, Debug)]
pub struct Event {
    pub kind: String,
    pub category: String,
    pub name: String,
    pub process: u64,
    pub thread: u64,
    pub began: u64,
    pub ended: u64,
    pub id: Option<u64>,
    pub arguments: Value,
    pub all: Value,
}

impl Trace {
    pub fn of(log: &Log) -> Self {
        let mut bytes = Vec::new();
        write_chrome_trace(log, &mut bytes).expect("a vector does not fail");
        let text = String::from_utf8(bytes).expect("JSON is UTF-8");
        check_decimals(&text);
        let whole: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error} in {text}"));
        assert_eq!(whole["displayTimeUnit"], "ns");
        let events = whole["traceEvents"].as_array().expect("events are an array").iter().map(read).collect();
        Self { text, other_data: whole["otherData"].clone(), events }
    }

    pub fn of_kind(&self, kind: &str) -> impl Iterator<Item = &Event> {
        self.events.iter().filter(move |event| event.kind == kind)
    }

    pub fn slices(&self, category: &str) -> impl Iterator<Item = &Event> {
        self.of_kind("X").filter(move |event| event.category == category)
    }

    /// The values of a counter, each with its time.
    pub fn counter_values(&self, name: &str) -> Vec<(u64, f64)> {
        let values = self.of_kind("C").filter(|event| event.name == name);
        values.map(|event| (event.began, event.arguments["value"].as_f64().expect("it is a number"))).collect()
    }

    /// The process number, thread number and name of each thread.
    pub fn thread_names(&self) -> Vec<(u64, u64, String)> {
        let names = self.of_kind("M").filter(|event| event.name == "thread_name");
        names.map(|event| (event.process, event.thread, text_of(&event.arguments["name"]))).collect()
    }
}

impl Event {
    pub fn contains(&self, other: &Event) -> bool {
        self.is_on_track_of(other) && self.began <= other.began && other.ended <= self.ended
    }

    pub fn is_on_track_of(&self, other: &Event) -> bool {
        (self.process, self.thread) == (other.process, other.thread)
    }
}

/// All times are microseconds with three decimals: `ts`, `dur`, and arguments with names that end in `_us`.
fn check_decimals(text: &str) {
    for key in ["\"ts\":", "\"dur\":", "_us\":"] {
        for (at, _) in text.match_indices(key) {
            let number: String =
                text[at + key.len()..].chars().take_while(|&letter| letter != ',' && letter != '}').collect();
            let (whole, decimals) = number.split_once('.').unwrap_or_else(|| panic!("{key}{number}"));
            let is_digits = |digits: &str| !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit());
            assert!(is_digits(whole) && is_digits(decimals) && decimals.len() == 3, "{key}{number}");
        }
    }
}

fn read(all: &Value) -> Event {
    let began = nanoseconds(&all["ts"]);
    let kind = text_of(&all["ph"]);
    assert_eq!((all["ts"].is_number(), all["dur"].is_number()), (kind != "M", kind == "X"), "{all}");
    Event {
        kind,
        category: text_of(&all["cat"]),
        name: text_of(&all["name"]),
        process: all["pid"].as_u64().expect("events have a process"),
        thread: all["tid"].as_u64().expect("events have a thread"),
        began,
        ended: began + nanoseconds(&all["dur"]),
        id: all["id"].as_u64(),
        arguments: all["args"].clone(),
        all: all.clone(),
    }
}

pub fn nanoseconds(microseconds: &Value) -> u64 {
    (microseconds.as_f64().unwrap_or(0.0) * 1000.0).round() as u64
}

fn text_of(value: &Value) -> String {
    value.as_str().expect("it is a string").to_owned()
}
