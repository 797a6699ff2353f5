//! Cases that take long are ignored, unless `DRAWLOOM_SLOW_CASES=1`.

use std::env;

/// Whether they run.
pub fn are_enabled() -> bool {
    env::var_os("DRAWLOOM_SLOW_CASES").is_some_and(|value| value == "1")
}
