//! What an engine gets wrong in safe code: numbers at their extremes, code that calls back while it is called, and
//! guards that it leaks. Each is harmless, or an error that names what is wrong. Nothing unwinds, hangs, or does
//! nothing without a word.

mod code_under_locks;
mod fixture;
mod leaked_guards;
mod numbers;
mod public_numbers;
#[path = "../extremes/timeout.rs"]
mod timeout;

use libtest_mimic::{Arguments, Failed, Trial};

/// A case without arguments.
type Case = (&'static str, fn() -> Result<(), Failed>);

fn main() {
    let arguments = Arguments::from_args();
    let numbers = numbers::CASES.iter().copied().flatten().map(|case| (case.name, case.check));
    let others = [code_under_locks::CASES, leaked_guards::CASES, public_numbers::CASES].into_iter().flatten().copied();
    let trial = |(name, check): Case| Trial::test(name, move || timeout::with_timeout(check));
    libtest_mimic::run(&arguments, numbers.chain(others).map(trial).collect()).exit();
}
