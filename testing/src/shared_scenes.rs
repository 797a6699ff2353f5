//! The scenes beside the repository, which a clone may lack.

use std::path::PathBuf;

/// Their folder, which may be missing.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes")
}

/// Whether cases that need them are ignored: they are missing, and `DRAWLOOM_REQUIRE_SCENES=1` does not make that a
/// failure.
pub fn are_optional_and_missing() -> bool {
    let required = std::env::var_os("DRAWLOOM_REQUIRE_SCENES").is_some_and(|value| value == "1");
    !required && !folder().is_dir()
}
