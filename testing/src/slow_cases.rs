//! Cases that take long are ignored, unless `DRAWLOOM_SLOW_CASES=1`.

use std::env;

/// Whether a case is ignored: it is one of `slow`, and these do not run.
pub fn leave_out(slow: &[&str], name: &str) -> bool {
    slow.contains(&name) && !are_enabled()
}

/// Whether they run.
pub fn are_enabled() -> bool {
    env::var_os("DRAWLOOM_SLOW_CASES").is_some_and(|value| value == "1")
}
