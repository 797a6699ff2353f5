//! Each public number that an engine sets, at its extremes. "No limit" is no limit, nonsense is a named error, and both
//! are the same with and without checks of overflows.

mod budgets;
mod generated;
mod imports;
mod limits;
mod processes;
mod recorded;
mod scenes;
mod streaming;
mod tasks;
mod waits;

use libtest_mimic::Failed;

/// A case of some public numbers.
#[derive(Clone, Copy)]
pub struct NumberCase {
    pub name: &'static str,
    /// Paths in `.ci/public-api.txt`, without the crate's name and generic arguments.
    pub numbers: &'static [&'static str],
    pub check: fn() -> Result<(), Failed>,
}

pub const CASES: &[&[NumberCase]] = &[
    budgets::CASES,
    generated::CASES,
    imports::CASES,
    limits::CASES,
    processes::CASES,
    recorded::CASES,
    scenes::CASES,
    streaming::CASES,
    tasks::CASES,
    waits::CASES,
];
