//! Pages in a real browser: they show their log, react to input, and write nothing to the console.
//!
//! Without Chromium all cases are ignored, or fail if `DRAWLOOM_REQUIRE_BROWSER` is set.

#[path = "../timeline/adversarial_names.rs"]
mod adversarial_names;
mod browser;
mod logs;

use std::env;
use std::process::ExitCode;

use drawloom_jobs::timeline::Log;
use libtest_mimic::{Arguments, Failed, Trial, run};

use self::browser::{Browser, LoadedPage};

/// Dispatches input events, and reports their effects.
const USER_INPUT: &str = include_str!("user_input.js");

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let trials = vec![
        trial("an_empty_log", |browser| {
            let page = browser.open("empty", &Log::default())?;
            expect("jobs", page.value("jobs"), "")
        }),
        trial("real_runs", |browser| {
            let log = logs::real_runs()?;
            let page = browser.open("real", &log)?;
            shows_the_longest_frame(&page, &log)
        }),
        trial("adversarial_names", |browser| {
            let mut log = adversarial_names::log_of(&adversarial_names::adversarial_names());
            log.dropped = 3;
            let page = browser.open("adversarial_names", &log)?;
            expect("frame", page.value("frame"), "0")?;
            expect("jobs", page.value("jobs"), &log.runs[0].chunks.len().to_string())
        }),
        trial("a_hundred_thousand_chunks", |browser| {
            let log = logs::many_chunks(100_000, 20);
            let page = browser.open("many", &log)?;
            shows_the_longest_frame(&page, &log)?;
            if page.length <= 6_000_000 { Ok(()) } else { Err(format!("{} bytes are too many", page.length).into()) }
        }),
        trial("a_hundred_thousand_chunks_in_one_frame", |browser| {
            let log = logs::many_chunks(100_000, 1);
            shows_the_longest_frame(&browser.open("one_frame", &log)?, &log)
        }),
        trial("user_input", |browser| {
            let outcome = browser.open_with("user_input", &logs::diamonds(), USER_INPUT)?.value("outcome");
            let failed: Vec<_> = outcome.split(' ').filter(|step| step.ends_with("=false")).collect();
            if failed.is_empty() { Ok(()) } else { Err(format!("failed: {failed:?} of {outcome:?}").into()) }
        }),
    ];
    run(&arguments, trials).exit_code()
}

fn trial(name: &str, test: impl FnOnce(&Browser) -> Result<(), Failed> + Send + 'static) -> Trial {
    let browser = Browser::find();
    let is_ignored = browser.is_none() && env::var_os("DRAWLOOM_REQUIRE_BROWSER").is_none();
    Trial::test(name, move || test(&browser.ok_or("there is no Chromium in PATH")?)).with_ignored_flag(is_ignored)
}

fn shows_the_longest_frame(page: &LoadedPage, log: &Log) -> Result<(), Failed> {
    // The first of the longest frames.
    let longest = log.frames.iter().rev().max_by_key(|frame| frame.ended - frame.began).ok_or("no frame")?;
    let jobs: usize = log.runs_of(longest.number).map(|run| run.chunks.len()).sum();
    if jobs == 0 {
        return Err("the log has no jobs".into());
    }
    expect("frame", page.value("frame"), &longest.number.to_string())?;
    expect("jobs", page.value("jobs"), &jobs.to_string())
}

fn expect(name: &str, actual: String, expected: &str) -> Result<(), Failed> {
    if actual == expected { Ok(()) } else { Err(format!("{name}: {actual:?} instead of {expected:?}").into()) }
}
