//! The text of a frame's report, for a terminal.

use std::cmp::Reverse;
use std::fmt::{self, Display, Formatter};
use std::time::Duration;

use super::queue_wait::QueueWait;
use super::report::FrameReport;
use super::slack::Slack;
use super::step::{HeldBy, Step};
use super::what_if::WhatIf;
use super::worker_report::WorkerReport;
use crate::text::is_escaped;
use crate::timeline::{JobSize, TuningChoice};

/// How many lines a list has, for a person to read it.
const MAX_LINES: usize = 10;
const MAX_QUEUE_WAITS: usize = 5;
const MAX_WORKERS: usize = 16;

/// How many groups are named in one line: those that workers ran during a wait, and those with the longest shares of
/// the path.
const MAX_MEANWHILE: usize = 3;
const MAX_SHARES_IN_SUMMARY: usize = 3;

/// How many characters there are in a line, a name, a worker's name, and a name that shares its line with others.
const MAX_LINE_LENGTH: usize = 120;
const MAX_NAME_LENGTH: usize = 60;
const MAX_WORKER_NAME_LENGTH: usize = 40;
const MAX_SHORT_NAME_LENGTH: usize = 17;

/// Savings and slack shorter than the frame divided by this number are left out.
const MIN_SAVING_DIVISOR: u32 = 200;

/// What is to blame first, then each list, cut to a length that a person reads.
impl Display for FrameReport {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        self.write_summary(formatter)?;
        self.write_path(formatter)?;
        self.write_shares(formatter)?;
        self.write_what_if(formatter)?;
        self.write_worker_counts(formatter)?;
        self.write_slack(formatter)?;
        self.write_queue_waits(formatter)?;
        self.write_tuning(formatter)?;
        self.write_workers(formatter)
    }
}

impl FrameReport {
    fn write_summary(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let Self { frame, duration, .. } = self;
        let workers = counted(self.workers.len(), "worker", "workers");
        writeln!(formatter, "frame {frame} took {} ms on {workers}", Milliseconds(*duration))?;
        let mut ran: Vec<_> = self.shares.iter().filter(|share| !share.ran.is_zero()).collect();
        ran.sort_by_key(|share| Reverse(share.ran));
        if !ran.is_empty() {
            let most = ran.iter().take(MAX_SHARES_IN_SUMMARY);
            let group = |group| truncated(&sanitized(group), MAX_SHORT_NAME_LENGTH);
            let most = most.map(|share| format!("{}% {}", percent(share.ran, *duration), group(&share.group)));
            let waited = percent(self.critical_path.iter().map(Step::waited).sum(), *duration);
            let most = most.collect::<Vec<_>>().join(", ");
            writeln!(formatter, "its critical path: {most}; {waited}% waiting for a worker")?;
        }
        if let Some(WhatIf { group, saved, .. }) = self.worth_saving().first() {
            writeln!(formatter, "most could be saved in {}: {} ms", sanitized(group), Milliseconds(*saved))?;
        }
        Ok(())
    }

    fn write_path(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        if self.critical_path.is_empty() {
            return Ok(());
        }
        let mut lines: Vec<Line> = self.critical_path.iter().map(Line::new).collect();
        if lines.len() > MAX_LINES {
            lines = merge(lines);
        }
        let mut longest_first: Vec<_> = (0..lines.len()).collect();
        longest_first.sort_by_key(|&index| Reverse(lines[index].duration));
        let left_out = longest_first.split_off(lines.len().min(MAX_LINES));
        longest_first.sort_unstable();
        write!(formatter, "\ncritical path\n{:>12}{:>12}{:>12}", "from ms", "took ms", "waited ms")?;
        writeln!(formatter, "  {:<12} step", "held by")?;
        for Line { name, held_by, ready, duration, waited, .. } in longest_first.into_iter().map(|index| &lines[index])
        {
            let from = Milliseconds(ready.saturating_sub(self.began));
            let (took, waited) = (Milliseconds(*duration), MillisecondsOrDash(*waited));
            let held_by = held_by_text(*held_by);
            let line = format!("{from:>12}{took:>12}{waited:>12}  {held_by:<12} {name}");
            writeln!(formatter, "{}", truncated(&line, MAX_LINE_LENGTH))?;
        }
        let rest = left_out.iter().map(|&index| lines[index].duration).sum();
        write_rest(formatter, left_out.len(), ["shorter step", "shorter steps"], rest)
    }

    fn write_shares(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let shares: Vec<_> = self.shares.iter().filter(|share| !share.duration().is_zero()).collect();
        if shares.is_empty() {
            return Ok(());
        }
        writeln!(
            formatter,
            "\nshares of the critical path\n{:>12}{:>12}{:>12}  group",
            "of it", "took ms", "waited ms"
        )?;
        for share in shares.iter().take(MAX_LINES) {
            let percent = percent(share.duration(), self.duration);
            let (took, waited) = (Milliseconds(share.duration()), MillisecondsOrDash(share.waited));
            writeln!(formatter, "{percent:>11}%{took:>12}{waited:>12}  {}", sanitized(&share.group))?;
        }
        let rest = shares.iter().skip(MAX_LINES).map(|share| share.duration());
        write_rest(formatter, rest.len(), ["group", "groups"], rest.sum())
    }

    fn write_what_if(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let saving = self.worth_saving();
        if saving.is_empty() {
            return Ok(());
        }
        writeln!(formatter, "\nby replay, on {}", counted(self.workers.len(), "worker", "workers"))?;
        let lines = saving.iter().take(MAX_LINES);
        let lines: Vec<_> =
            lines.map(|what_if| (format!("if {} cost nothing:", sanitized(&what_if.group)), what_if)).collect();
        let width = lines.iter().map(|(condition, _)| condition.chars().count()).max().unwrap_or(0);
        for (condition, WhatIf { time, saved, .. }) in &lines {
            let saved = format!("−{}", Milliseconds(*saved));
            writeln!(
                formatter,
                "  {condition:<width$}{saved:>12} ms ({} → {})",
                Milliseconds(self.replayed),
                Milliseconds(*time)
            )?;
        }
        match self.what_if.len() - lines.len() {
            0 => Ok(()),
            more => writeln!(formatter, "  and {} that would save less", counted(more, "group", "groups")),
        }
    }

    /// Those that save enough to be listed, what saves the most first.
    fn worth_saving(&self) -> &[WhatIf] {
        let is_worth_it =
            |what_if: &WhatIf| what_if.saved >= self.replayed / MIN_SAVING_DIVISOR && !what_if.saved.is_zero();
        &self.what_if[..self.what_if.partition_point(is_worth_it)]
    }

    fn write_worker_counts(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        writeln!(formatter, "\nby replay, on other numbers of workers")?;
        for (workers, time) in &self.on_workers {
            let label = format!("on {}:", counted(*workers, "worker", "workers"));
            writeln!(formatter, "  {label:<14}{:>12} ms", Milliseconds(*time))?;
        }
        Ok(())
    }

    fn write_slack(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let is_loose = |slack: &&Slack| slack.time > self.duration / MIN_SAVING_DIVISOR;
        let mut loose: Vec<&Slack> = self.slack.iter().filter(is_loose).collect();
        if loose.is_empty() {
            return Ok(());
        }
        loose.sort_by_key(|slack| slack.time);
        // The first ones would soon be critical if the path were shorter; the last ones could be postponed.
        let left_out = match loose.len() {
            0..=MAX_LINES => 0..0,
            count => MAX_LINES / 2..count - MAX_LINES / 2,
        };
        let all = counted(self.slack.len(), "node", "nodes");
        writeln!(formatter, "\nslack: {} of {all} could have ended later at no cost, by", loose.len())?;
        for (index, slack) in loose.iter().enumerate() {
            if !left_out.contains(&index) {
                writeln!(formatter, "{:>12} ms  {}", Milliseconds(slack.time), sanitized(&slack.name))?;
            } else if index == left_out.start {
                writeln!(formatter, "{:>12}     and {} more in between", "...", left_out.len())?;
            }
        }
        Ok(())
    }

    fn write_queue_waits(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        if self.queue_waits.is_empty() {
            return Ok(());
        }
        writeln!(formatter, "\nlongest waits for a worker; how many workers ran what meanwhile")?;
        for wait @ QueueWait { name, meanwhile, .. } in self.queue_waits.iter().take(MAX_QUEUE_WAITS) {
            let workers = |time: Duration| time.as_secs_f64() / wait.waited().as_secs_f64().max(f64::MIN_POSITIVE);
            let at_once = meanwhile.iter().map(|(group, time)| (group, workers(*time)));
            // Without those that would be printed as 0.0 workers.
            let mut groups: Vec<_> = at_once
                .filter(|&(_, workers)| workers >= 0.05)
                .map(|(group, workers)| format!("{workers:.1} {}", sanitized(group)))
                .collect();
            match groups.len() {
                0 => groups.push("none".to_owned()),
                count if count > MAX_MEANWHILE => {
                    groups.truncate(MAX_MEANWHILE);
                    groups.push(format!("{} more", count - MAX_MEANWHILE));
                }
                _ => (),
            }
            let line = format!("{:>12} ms  {}: {}", Milliseconds(wait.waited()), sanitized(name), groups.join(", "));
            writeln!(formatter, "{}", truncated(&line, MAX_LINE_LENGTH))?;
        }
        Ok(())
    }

    fn write_tuning(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let choices: Vec<_> =
            self.tuning.iter().flat_map(|tuning| &tuning.choices).map(TuningChoice::to_string).collect();
        let mut sizes: Vec<_> = self.tuning.iter().flat_map(|tuning| &tuning.job_sizes).collect();
        if choices.is_empty() && sizes.is_empty() {
            return Ok(());
        }
        writeln!(formatter, "\nchosen by measured cost")?;
        sizes.sort_by(|one, other| other.work().total_cmp(&one.work()));
        let sizes: Vec<_> = sizes.into_iter().map(JobSize::to_string).collect();
        for (lines, kind) in
            [(choices, ["choice", "choices"]), (sizes, ["node with less work", "nodes with less work"])]
        {
            for line in lines.iter().take(MAX_LINES) {
                writeln!(formatter, "  {}", printable(&truncated(line, MAX_LINE_LENGTH - 2)))?;
            }
            match lines.len().saturating_sub(MAX_LINES) {
                0 => (),
                more => writeln!(formatter, "  and {}", counted(more, kind[0], kind[1]))?,
            }
        }
        Ok(())
    }

    fn write_workers(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let listed = self.workers.iter().take(MAX_WORKERS);
        let listed: Vec<_> =
            listed.map(|worker| (truncated(&sanitized(&worker.name), MAX_WORKER_NAME_LENGTH), worker)).collect();
        let width = listed.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max("worker".len());
        write!(formatter, "\n  {:<width$}{:>12}{:>6}", "worker", "busy ms", "")?;
        writeln!(
            formatter,
            "{:>14}{:>12}{:>12}{:>8}{:>8}",
            "searching ms", "asleep ms", "other ms", "chunks", "stolen"
        )?;
        for (name, worker) in &listed {
            let WorkerReport { busy, searching, asleep, other, chunks, stolen, .. } = worker;
            let percent = percent(*busy, self.duration);
            let [searching, asleep, other] = [searching, asleep, other].map(|time| MillisecondsOrDash(*time));
            write!(formatter, "  {name:<width$}{:>12}{percent:>5}%", Milliseconds(*busy))?;
            writeln!(formatter, "{searching:>14}{asleep:>12}{other:>12}{chunks:>8}{stolen:>8}")?;
        }
        let rest = self.workers.iter().skip(MAX_WORKERS).map(|worker| worker.busy);
        match rest.len() {
            0 => Ok(()),
            count => {
                let busy = percent(rest.sum::<Duration>() / count as u32, self.duration);
                writeln!(formatter, "  and {}, {busy}% busy", counted(count, "worker", "workers"))
            }
        }
    }
}

/// A line of the critical path: one step, or several of one group.
struct Line {
    name: String,
    /// The common prefix of the names of all its steps.
    common: String,
    group: String,
    held_by: HeldBy,
    ready: Duration,
    duration: Duration,
    waited: Duration,
    steps: usize,
}

impl Line {
    fn new(step: &Step) -> Self {
        let Step { name, group, held_by, ready, .. } = step;
        let (name, group, held_by, ready) = (sanitized(name), group.clone(), *held_by, *ready);
        let (duration, waited) = (step.duration(), step.waited());
        Self { common: name.clone(), name, group, held_by, ready, duration, waited, steps: 1 }
    }
}

/// Merges neighbouring lines of one group. The merged line is held by what held its first step.
fn merge(lines: Vec<Line>) -> Vec<Line> {
    let mut merged: Vec<Line> = Vec::new();
    for line in lines {
        match merged.last_mut() {
            Some(last) if last.group == line.group => {
                last.steps += line.steps;
                last.duration += line.duration;
                last.waited += line.waited;
                last.common = common_prefix(&last.common, &line.name);
                let common = if last.common.is_empty() { sanitized(&last.group) } else { last.common.clone() };
                last.name = format!("{common}, {} steps", last.steps);
            }
            _ => merged.push(line),
        }
    }
    merged
}

/// The common prefix of two names, cut at a comma: the render process and the view, for example.
fn common_prefix(one: &str, other: &str) -> String {
    let pairs = one.split(", ").zip(other.split(", "));
    pairs.map_while(|(one, other)| (one == other).then_some(one)).collect::<Vec<_>>().join(", ")
}

/// A time in milliseconds, to the microsecond.
struct Milliseconds(Duration);

/// As [`Milliseconds`], but zero is a dash.
struct MillisecondsOrDash(Duration);

impl Display for Milliseconds {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.pad(&format!("{:.3}", self.0.as_secs_f64() * 1e3))
    }
}

impl Display for MillisecondsOrDash {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        if self.0.is_zero() { formatter.pad("-") } else { Milliseconds(self.0).fmt(formatter) }
    }
}

fn held_by_text(held_by: HeldBy) -> &'static str {
    match held_by {
        HeldBy::Start => "-",
        HeldBy::Dependency => "dependency",
        HeldBy::Worker => "same worker",
    }
}

/// A name that fits into a line: cut to [`MAX_NAME_LENGTH`], and [printable].
fn sanitized(name: &str) -> String {
    printable(&truncated(name, MAX_NAME_LENGTH))
}

/// The text without control characters, and others that are no part of a line. Each is replaced, so the length stays.
fn printable(text: &str) -> String {
    let plain = |character: char| if is_escaped(character) { char::REPLACEMENT_CHARACTER } else { character };
    text.chars().map(plain).collect()
}

/// At most `max` characters of the text. If it is longer, the last one is an ellipsis.
fn truncated(text: &str, max: usize) -> String {
    let is_long = text.chars().nth(max).is_some();
    let kept = if is_long { max - 1 } else { max };
    text.chars().take(kept).chain(is_long.then_some('…')).collect()
}

fn percent(part: Duration, of: Duration) -> u64 {
    (part.as_secs_f64() / of.as_secs_f64().max(f64::MIN_POSITIVE) * 100.0).round() as u64
}

fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

fn write_rest(formatter: &mut Formatter<'_>, count: usize, names: [&str; 2], time: Duration) -> fmt::Result {
    match count {
        0 => Ok(()),
        _ => writeln!(
            formatter,
            "{:>12}{:>12}{:>12}  and {}",
            "...",
            Milliseconds(time),
            "",
            counted(count, names[0], names[1])
        ),
    }
}
