//! Pages in a real browser: they show what is in the log, react to their reader, and complain of nothing.
//!
//! All cases are ignored, and never pass, where there is no Chromium; with `DRAWLOOM_REQUIRE_BROWSER` set they fail there.

mod browser;
mod logs;

use std::{env, process::ExitCode};

use drawloom::timeline::Log;
use drawloom_testing::hostile;
use libtest_mimic::{Arguments, Failed, Trial, run};

use browser::{Browser, Shown};

/// Does what a reader does, and tells what came of it.
const READER: &str = include_str!("reader.js");

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let trials = vec![
        trial("nothing_at_all", |browser| {
            let shown = browser.open("nothing", &Log::default(), "")?;
            expect("jobs", shown.value("jobs"), "")
        }),
        trial("a_real_log", |browser| {
            let log = logs::of_a_real_run()?;
            let shown = browser.open("real", &log, "")?;
            shows_the_longest_frame(&shown, &log)
        }),
        trial("hostile_names", |browser| {
            let mut log = hostile::log_of(&hostile::hostile_names());
            log.dropped = 3;
            let shown = browser.open("hostile", &log, "")?;
            expect("frame", shown.value("frame"), "0")?;
            expect("jobs", shown.value("jobs"), &log.runs[0].chunks.len().to_string())
        }),
        trial("a_hundred_thousand_chunks", |browser| {
            let log = logs::of_chunks(100_000, 20);
            let shown = browser.open("many", &log, "")?;
            shows_the_longest_frame(&shown, &log)?;
            if shown.length <= 6_000_000 { Ok(()) } else { Err(format!("{} bytes are too many", shown.length).into()) }
        }),
        trial("a_hundred_thousand_chunks_in_one_frame", |browser| {
            let log = logs::of_chunks(100_000, 1);
            shows_the_longest_frame(&browser.open("one_frame", &log, "")?, &log)
        }),
        trial("a_reader", |browser| {
            let outcome = browser.open("reader", &logs::of_diamonds(), READER)?.value("outcome");
            let is_done = outcome.ends_with(" done");
            let failed: Vec<_> = outcome.split(' ').filter(|step| step.ends_with("=false")).collect();
            let is_right = is_done && failed.is_empty();
            if is_right { Ok(()) } else { Err(format!("of {outcome:?} failed {failed:?}").into()) }
        }),
    ];
    run(&arguments, trials).exit_code()
}

fn trial(name: &str, test: impl FnOnce(&Browser) -> Result<(), Failed> + Send + 'static) -> Trial {
    let browser = Browser::find();
    let is_ignored = browser.is_none() && env::var_os("DRAWLOOM_REQUIRE_BROWSER").is_none();
    Trial::test(name, move || test(&browser.ok_or("there is no Chromium in PATH")?)).with_ignored_flag(is_ignored)
}

fn shows_the_longest_frame(shown: &Shown, log: &Log) -> Result<(), Failed> {
    // Of frames equally long the first.
    let longest = log.frames.iter().rev().max_by_key(|frame| frame.ended - frame.began).ok_or("no frame")?;
    let jobs: usize = log.runs_of(longest.number).map(|run| run.chunks.len()).sum();
    if jobs == 0 {
        return Err("the log is to have jobs".into());
    }
    expect("frame", shown.value("frame"), &longest.number.to_string())?;
    expect("jobs", shown.value("jobs"), &jobs.to_string())
}

fn expect(what: &str, is: String, expected: &str) -> Result<(), Failed> {
    if is == expected { Ok(()) } else { Err(format!("{what}: {is:?} instead of {expected:?}").into()) }
}
