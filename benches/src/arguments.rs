//! Command line arguments that benchmarks share.

#[cfg(feature = "wgpu")]
use std::error::Error;
use std::num::NonZero;
use std::thread;

use clap::{Args, Parser};
use drawloom::task::Scheduler;
#[cfg(feature = "wgpu")]
use drawloom_output::print_diagnostic;

#[cfg(feature = "wgpu")]
use crate::backends::BackendName;

/// The extent of the measurement.
#[derive(Parser)]
pub struct ExtentArguments {
    /// Runs few rounds on small scenes, to see that the benchmark works.
    #[arg(long)]
    quick: bool,
    /// Cargo passes it under `cargo bench`; without it, as under `cargo test --benches`, the run is a quick one.
    #[arg(long, hide = true)]
    bench: bool,
}

impl ExtentArguments {
    /// Whether the run is a quick one. Its results must not overwrite those of a full run.
    pub fn is_quick(&self) -> bool {
        self.quick || !self.bench
    }
}

/// The extent of the measurement, and its wgpu backends.
#[cfg(feature = "wgpu")]
#[derive(Args)]
pub struct BackendArguments {
    #[command(flatten)]
    extent: ExtentArguments,
    /// Measures on this backend only.
    #[arg(long)]
    backend: Option<BackendName>,
}

#[cfg(feature = "wgpu")]
impl BackendArguments {
    /// Whether the run is a quick one. Its results must not overwrite those of a full run.
    pub fn is_quick(&self) -> bool {
        self.extent.is_quick()
    }

    /// The requested backend, or all that this machine has. Says why the adapter is left out.
    ///
    /// # Errors
    /// Returns an error if this machine lacks the requested backend.
    pub fn backends(&self) -> Result<Vec<BackendName>, Box<dyn Error>> {
        let mut backends = self.backend.map_or(BackendName::ALL.to_vec(), |backend| vec![backend]);
        if backends.contains(&BackendName::Adapter)
            && let Err(error) = BackendName::Adapter.device()
        {
            if self.backend.is_some() {
                return Err(format!("--backend adapter: {error}").into());
            }
            print_diagnostic!("The backend adapter is left out, and noop measured alone: {error}");
            backends.retain(|&backend| backend != BackendName::Adapter);
        }
        Ok(backends)
    }
}

/// The numbers of workers to measure. Peers run on as many threads.
#[derive(Args)]
pub struct WorkersArguments {
    /// Measures with these numbers of workers, at most as many as there are cores; by default, the powers of two up to
    /// that.
    #[arg(long, value_name = "NUMBER,…", value_delimiter = ',', value_parser = |text: &str| worker_count(text, cores()))]
    workers: Vec<usize>,
}

impl WorkersArguments {
    /// The numbers in ascending order: one worker is among those by default.
    pub fn counts(&self) -> Vec<usize> {
        self.counts_on(cores())
    }

    /// The same for what compares several workers with one thread: by default from two workers on, if there are two
    /// cores.
    pub fn parallel_counts(&self) -> Vec<usize> {
        let mut counts = self.counts();
        if self.workers.is_empty() && counts.len() > 1 {
            counts.remove(0);
        }
        counts
    }

    fn counts_on(&self, cores: usize) -> Vec<usize> {
        if self.workers.is_empty() {
            return (0..=cores.ilog2()).map(|power| 1 << power).collect();
        }
        let mut counts = self.workers.clone();
        counts.sort_unstable();
        counts.dedup();
        counts
    }
}

/// The number of workers of a run that has one only. Peers run on as many threads.
#[derive(Args)]
pub struct WorkerCountArgument {
    /// Measures with this number of workers, at most as many as there are cores; by default, with as many.
    #[arg(long, value_name = "NUMBER", value_parser = |text: &str| worker_count(text, cores()))]
    workers: Option<usize>,
}

impl WorkerCountArgument {
    pub fn count(&self) -> usize {
        self.workers.unwrap_or_else(cores)
    }
}

/// The number of cores that this process may use, or of workers that a scheduler may have, if that is less.
pub(crate) fn cores() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get).min(Scheduler::MAX_WORKERS)
}

/// With more workers than cores the system decides which of them run, so the figures would say nothing about the number
/// of workers.
fn worker_count(text: &str, cores: usize) -> Result<usize, String> {
    match text.parse() {
        Ok(count) if (1..=cores).contains(&count) => Ok(count),
        _ => Err(format!("a number of workers is a whole number from 1 to {cores}, the number of cores here")),
    }
}

#[cfg(test)]
mod tests {
    use clap::error::ErrorKind;

    use super::*;

    #[derive(Parser)]
    struct Arguments {
        #[command(flatten)]
        workers: WorkersArguments,
    }

    fn parse(arguments: &[&str]) -> Result<WorkersArguments, clap::Error> {
        let arguments = Arguments::try_parse_from(["bench"].iter().chain(arguments))?;
        Ok(arguments.workers)
    }

    #[test]
    fn numbers_of_workers_are_the_powers_of_two_up_to_the_cores() {
        let none = WorkersArguments { workers: Vec::new() };
        let expected: [(usize, &[usize]); 5] =
            [(1, &[1]), (2, &[1, 2]), (3, &[1, 2]), (12, &[1, 2, 4, 8]), (16, &[1, 2, 4, 8, 16])];
        for (cores, counts) in expected {
            assert_eq!(none.counts_on(cores), counts, "{cores} cores");
        }
        assert_eq!(none.parallel_counts().contains(&1), cores() == 1);
    }

    #[test]
    fn requested_numbers_are_measured_once_each_in_order() {
        let requested = WorkersArguments { workers: vec![6, 1, 6, 4] };
        assert_eq!(requested.counts(), [1, 4, 6]);
        assert_eq!(requested.parallel_counts(), [1, 4, 6]);
        let all = cores().to_string();
        let parsed = parse(&["--workers", &format!("{all},1")]).map(|arguments| arguments.counts());
        assert_eq!(parsed.ok(), Some(if cores() == 1 { vec![1] } else { vec![1, cores()] }));
    }

    #[test]
    fn what_is_no_number_of_workers_is_refused_with_the_bound() {
        let too_many = (cores() + 1).to_string();
        for text in
            ["0", &too_many, "1001", "18446744073709551616", "-1", "1.5", "two", "", "1,,1", "1,", "1;2", "1, 1"]
        {
            let Err(error) = parse(&[&format!("--workers={text}")]) else { panic!("{text:?} is accepted") };
            assert_eq!(error.kind(), ErrorKind::ValueValidation, "{text:?}: {error}");
            assert_eq!(error.exit_code(), 2);
            let bound = format!("from 1 to {}, the number of cores here", cores());
            assert!(error.to_string().contains(&bound), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_run_with_one_number_of_workers_has_that_of_the_cores_by_default() {
        #[derive(Parser)]
        struct OneNumber {
            #[command(flatten)]
            workers: WorkerCountArgument,
        }
        let count = |arguments: &[&str]| {
            let parsed = OneNumber::try_parse_from(["bench"].iter().chain(arguments));
            parsed.map(|arguments| arguments.workers.count()).map_err(|error| error.kind())
        };
        assert_eq!(count(&[]), Ok(cores()));
        assert_eq!(count(&["--workers", "1"]), Ok(1));
        assert_eq!(count(&["--workers=0"]), Err(ErrorKind::ValueValidation));
        assert_eq!(count(&["--workers=1,1"]), Err(ErrorKind::ValueValidation));
        assert_eq!(count(&[&format!("--workers={}", cores() + 1)]), Err(ErrorKind::ValueValidation));
    }

    #[test]
    fn all_numbers_up_to_the_cores_are_accepted() {
        for cores in [1, 2, 16, 65] {
            let accepted: Vec<_> = (0..100).filter(|count| worker_count(&count.to_string(), cores).is_ok()).collect();
            assert_eq!(accepted, (1..=cores).collect::<Vec<_>>());
        }
    }
}
