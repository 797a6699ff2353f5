//! Cases that take long are ignored, unless `DRAWLOOM_SLOW_CASES` is `1`, for all cases, or `only`, for no others.

use std::env;

/// Whether a case is ignored: it is one of `slow`, and these do not run, or it is none, and only these run.
pub fn leave_out(slow: &[&str], name: &str) -> bool {
    let is_slow = slow.contains(&name);
    if is_set_to("only") { !is_slow } else { is_slow && !is_set_to("1") }
}

/// Whether they run.
pub fn are_enabled() -> bool {
    is_set_to("1") || is_set_to("only")
}

fn is_set_to(expected: &str) -> bool {
    env::var_os("DRAWLOOM_SLOW_CASES").is_some_and(|value| value == expected)
}
