//! A frame's report in words, for a terminal.

use std::{
    cmp::Reverse,
    fmt::{self, Display, Formatter},
    time::Duration,
};

use super::{FrameReport, HeldBy, QueueWait, Slack, Step, WhatIf, WorkerReport};

/// How long a list may be, for somebody to read it.
const MOST_LINES: usize = 10;
const MOST_QUEUE_WAITS: usize = 5;

/// How many workers may be listed, how many groups that they were at meanwhile, and how many that the path was most.
const MOST_WORKERS: usize = 16;
const MOST_AT_ONCE: usize = 3;
const MOST_OF_PATH: usize = 3;

/// How many characters a line may have, a name, a worker's name, and a name where several stand in a line.
const LONGEST_LINE: usize = 120;
const LONGEST_NAME: usize = 60;
const LONGEST_OF_WORKER: usize = 40;
const LONGEST_OF_SEVERAL: usize = 17;

/// Which part of the frame is the least that is worth saving, and worth telling as slack: one in so many.
const LEAST_SAVED: u32 = 200;

/// The report in words: what is to blame first, then each list of it, no longer than somebody reads.
impl Display for FrameReport {
    fn fmt(&self, to: &mut Formatter<'_>) -> fmt::Result {
        self.write_summary(to)?;
        self.write_path(to)?;
        self.write_shares(to)?;
        self.write_what_if(to)?;
        self.write_numbers_of_workers(to)?;
        self.write_slack(to)?;
        self.write_queue_waits(to)?;
        self.write_workers(to)
    }
}

impl FrameReport {
    fn write_summary(&self, to: &mut Formatter<'_>) -> fmt::Result {
        let Self { frame, took, .. } = self;
        let workers = counted(self.workers.len(), "worker", "workers");
        writeln!(to, "frame {frame} took {} ms on {workers}", Milliseconds(*took))?;
        let mut ran: Vec<_> = self.shares.iter().filter(|share| !share.ran.is_zero()).collect();
        ran.sort_by_key(|share| Reverse(share.ran));
        if !ran.is_empty() {
            let most = ran.iter().take(MOST_OF_PATH);
            let group = |group| shortened(&shown(group), LONGEST_OF_SEVERAL);
            let most = most.map(|share| format!("{}% {}", percent(share.ran, *took), group(&share.group)));
            let waited = percent(self.critical_path.iter().map(Step::waited).sum(), *took);
            let most = most.collect::<Vec<_>>().join(", ");
            writeln!(to, "its critical path: {most}; {waited}% waited for workers to come")?;
        }
        if let Some(WhatIf { group, saved, .. }) = self.worth_saving().first() {
            writeln!(to, "most could be saved in {}: {} ms", shown(group), Milliseconds(*saved))?;
        }
        Ok(())
    }

    fn write_path(&self, to: &mut Formatter<'_>) -> fmt::Result {
        if self.critical_path.is_empty() {
            return Ok(());
        }
        let mut lines: Vec<Line> = self.critical_path.iter().map(Line::new).collect();
        if lines.len() > MOST_LINES {
            lines = merge(lines);
        }
        let mut longest_first: Vec<_> = (0..lines.len()).collect();
        longest_first.sort_by_key(|&place| Reverse(lines[place].took));
        let left_out = longest_first.split_off(lines.len().min(MOST_LINES));
        longest_first.sort_unstable();
        write!(to, "\ncritical path\n{:>12}{:>12}{:>12}", "from ms", "took ms", "waited ms")?;
        writeln!(to, "  {:<12} step", "held by")?;
        for Line { name, held_by, ready, took, waited, .. } in longest_first.into_iter().map(|place| &lines[place]) {
            let from = Milliseconds(ready.saturating_sub(self.began));
            let (took, waited, held_by) = (Milliseconds(*took), MillisecondsIfAny(*waited), in_words(*held_by));
            let line = format!("{from:>12}{took:>12}{waited:>12}  {held_by:<12} {name}");
            writeln!(to, "{}", shortened(&line, LONGEST_LINE))?;
        }
        let rest = left_out.iter().map(|&place| lines[place].took).sum();
        write_more(to, left_out.len(), ["shorter step", "shorter steps"], rest)
    }

    fn write_shares(&self, to: &mut Formatter<'_>) -> fmt::Result {
        let shares: Vec<_> = self.shares.iter().filter(|share| !share.took().is_zero()).collect();
        if shares.is_empty() {
            return Ok(());
        }
        writeln!(to, "\nshares of the critical path\n{:>12}{:>12}{:>12}  group", "of it", "took ms", "waited ms")?;
        for share in shares.iter().take(MOST_LINES) {
            let percent = percent(share.took(), self.took);
            let (took, waited) = (Milliseconds(share.took()), MillisecondsIfAny(share.waited));
            writeln!(to, "{percent:>11}%{took:>12}{waited:>12}  {}", shown(&share.group))?;
        }
        let rest = shares.iter().skip(MOST_LINES).map(|share| share.took());
        write_more(to, rest.len(), ["group", "groups"], rest.sum())
    }

    fn write_what_if(&self, to: &mut Formatter<'_>) -> fmt::Result {
        let saving = self.worth_saving();
        if saving.is_empty() {
            return Ok(());
        }
        writeln!(to, "\nby replay, on {}", counted(self.workers.len(), "worker", "workers"))?;
        let lines = saving.iter().take(MOST_LINES);
        let lines: Vec<_> = lines.map(|one| (format!("if {} cost nothing:", shown(&one.group)), one)).collect();
        let width = lines.iter().map(|(words, _)| words.chars().count()).max().unwrap_or(0);
        for (words, WhatIf { time, saved, .. }) in &lines {
            let saved = format!("−{}", Milliseconds(*saved));
            writeln!(
                to,
                "  {words:<width$}{saved:>12} ms ({} → {})",
                Milliseconds(self.replayed),
                Milliseconds(*time)
            )?;
        }
        match self.what_if.len() - lines.len() {
            0 => Ok(()),
            more => writeln!(to, "  and {} that would save less", counted(more, "group", "groups")),
        }
    }

    /// Those with which it would make a difference, the most first.
    fn worth_saving(&self) -> &[WhatIf] {
        let is_worth = |what_if: &WhatIf| what_if.saved >= self.replayed / LEAST_SAVED && !what_if.saved.is_zero();
        &self.what_if[..self.what_if.partition_point(is_worth)]
    }

    fn write_numbers_of_workers(&self, to: &mut Formatter<'_>) -> fmt::Result {
        writeln!(to, "\nby replay, on other numbers of workers")?;
        for (workers, time) in &self.on_workers {
            let words = format!("on {}:", counted(*workers, "worker", "workers"));
            writeln!(to, "  {words:<14}{:>12} ms", Milliseconds(*time))?;
        }
        Ok(())
    }

    fn write_slack(&self, to: &mut Formatter<'_>) -> fmt::Result {
        let is_loose = |slack: &&Slack| slack.time > self.took / LEAST_SAVED;
        let mut loose: Vec<&Slack> = self.slack.iter().filter(is_loose).collect();
        if loose.is_empty() {
            return Ok(());
        }
        loose.sort_by_key(|slack| slack.time);
        // The first would be critical soon if the path were shorter; the last could well be put off.
        let left_out = match loose.len() {
            0..=MOST_LINES => 0..0,
            count => MOST_LINES / 2..count - MOST_LINES / 2,
        };
        let all = counted(self.slack.len(), "process", "processes");
        writeln!(to, "\nslack: {} of {all} could have ended later at no cost, by", loose.len())?;
        for (place, slack) in loose.iter().enumerate() {
            if !left_out.contains(&place) {
                writeln!(to, "{:>12} ms  {}", Milliseconds(slack.time), shown(&slack.name))?;
            } else if place == left_out.start {
                writeln!(to, "{:>12}     and {} more in between", "...", left_out.len())?;
            }
        }
        Ok(())
    }

    fn write_queue_waits(&self, to: &mut Formatter<'_>) -> fmt::Result {
        if self.queue_waits.is_empty() {
            return Ok(());
        }
        writeln!(to, "\nlongest waits for a worker, and how many workers were at what meanwhile")?;
        for wait @ QueueWait { name, meanwhile, .. } in self.queue_waits.iter().take(MOST_QUEUE_WAITS) {
            let workers = |time: Duration| time.as_secs_f64() / wait.waited().as_secs_f64().max(f64::MIN_POSITIVE);
            let at_once = meanwhile.iter().map(|(group, time)| (group, workers(*time)));
            // Those that are not rounded to nobody.
            let mut words: Vec<_> = at_once
                .filter(|&(_, workers)| workers >= 0.05)
                .map(|(group, workers)| format!("{workers:.1} {}", shown(group)))
                .collect();
            match words.len() {
                0 => words.push("none".to_owned()),
                count if count > MOST_AT_ONCE => {
                    words.truncate(MOST_AT_ONCE);
                    words.push(format!("{} more", count - MOST_AT_ONCE));
                }
                _ => (),
            }
            let line = format!("{:>12} ms  {}: {}", Milliseconds(wait.waited()), shown(name), words.join(", "));
            writeln!(to, "{}", shortened(&line, LONGEST_LINE))?;
        }
        Ok(())
    }

    fn write_workers(&self, to: &mut Formatter<'_>) -> fmt::Result {
        let listed = self.workers.iter().take(MOST_WORKERS);
        let listed: Vec<_> =
            listed.map(|worker| (shortened(&shown(&worker.name), LONGEST_OF_WORKER), worker)).collect();
        let width = listed.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max("worker".len());
        write!(to, "\n  {:<width$}{:>12}{:>6}", "worker", "busy ms", "")?;
        writeln!(to, "{:>14}{:>12}{:>12}{:>8}{:>8}", "searching ms", "asleep ms", "other ms", "chunks", "stolen")?;
        for (name, worker) in &listed {
            let WorkerReport { busy, searching, asleep, other, chunks, stolen, .. } = worker;
            let percent = percent(*busy, self.took);
            let [searching, asleep, other] = [searching, asleep, other].map(|time| MillisecondsIfAny(*time));
            write!(to, "  {name:<width$}{:>12}{percent:>5}%", Milliseconds(*busy))?;
            writeln!(to, "{searching:>14}{asleep:>12}{other:>12}{chunks:>8}{stolen:>8}")?;
        }
        let rest = self.workers.iter().skip(MOST_WORKERS).map(|worker| worker.busy);
        match rest.len() {
            0 => Ok(()),
            count => {
                let busy = percent(rest.sum::<Duration>() / count as u32, self.took);
                writeln!(to, "  and {}, {busy}% busy", counted(count, "worker", "workers"))
            }
        }
    }
}

/// A line of the critical path: some steps.
struct Line {
    name: String,
    /// What the names of all its steps begin with.
    common: String,
    group: String,
    held_by: HeldBy,
    ready: Duration,
    took: Duration,
    waited: Duration,
    steps: usize,
}

impl Line {
    fn new(step: &Step) -> Self {
        let Step { name, group, held_by, ready, .. } = step;
        let (name, group, held_by, ready) = (shown(name), group.clone(), *held_by, *ready);
        Self { common: name.clone(), name, group, held_by, ready, took: step.took(), waited: step.waited(), steps: 1 }
    }
}

/// One line for neighbours of one group. It is held by what its first step is held by.
fn merge(lines: Vec<Line>) -> Vec<Line> {
    let mut merged: Vec<Line> = Vec::new();
    for line in lines {
        match merged.last_mut() {
            Some(last) if last.group == line.group => {
                last.steps += line.steps;
                last.took += line.took;
                last.waited += line.waited;
                last.common = common_parts(&last.common, &line.name);
                let common = if last.common.is_empty() { shown(&last.group) } else { last.common.clone() };
                last.name = format!("{common}, {} steps", last.steps);
            }
            _ => merged.push(line),
        }
    }
    merged
}

/// What two names begin with, as far as a comma: the render process and the view, say.
fn common_parts(one: &str, other: &str) -> String {
    let pairs = one.split(", ").zip(other.split(", "));
    pairs.map_while(|(one, other)| (one == other).then_some(one)).collect::<Vec<_>>().join(", ")
}

/// In milliseconds, to the microsecond.
struct Milliseconds(Duration);

/// As [`Milliseconds`], but no time is a dash.
struct MillisecondsIfAny(Duration);

impl Display for Milliseconds {
    fn fmt(&self, to: &mut Formatter<'_>) -> fmt::Result {
        to.pad(&format!("{:.3}", self.0.as_secs_f64() * 1e3))
    }
}

impl Display for MillisecondsIfAny {
    fn fmt(&self, to: &mut Formatter<'_>) -> fmt::Result {
        if self.0.is_zero() { to.pad("-") } else { Milliseconds(self.0).fmt(to) }
    }
}

fn in_words(held_by: HeldBy) -> &'static str {
    match held_by {
        HeldBy::Start => "-",
        HeldBy::Dependency => "dependency",
        HeldBy::Worker => "same worker",
    }
}

/// A name from somewhere, which may be of any length and have anything in it, as it fits into a line.
fn shown(name: &str) -> String {
    let plain = |character: char| if character.is_control() { char::REPLACEMENT_CHARACTER } else { character };
    shortened(name, LONGEST_NAME).chars().map(plain).collect()
}

/// So many characters of it at most.
fn shortened(text: &str, most: usize) -> String {
    let is_long = text.chars().nth(most).is_some();
    let kept = if is_long { most - 1 } else { most };
    text.chars().take(kept).chain(is_long.then_some('…')).collect()
}

fn percent(part: Duration, of: Duration) -> u64 {
    (part.as_secs_f64() / of.as_secs_f64().max(f64::MIN_POSITIVE) * 100.0).round() as u64
}

fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

fn write_more(to: &mut Formatter<'_>, count: usize, words: [&str; 2], time: Duration) -> fmt::Result {
    match count {
        0 => Ok(()),
        _ => writeln!(
            to,
            "{:>12}{:>12}{:>12}  and {}",
            "...",
            Milliseconds(time),
            "",
            counted(count, words[0], words[1])
        ),
    }
}
