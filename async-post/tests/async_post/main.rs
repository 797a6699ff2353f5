//! Steps of post-processing that idle workers compute a frame late: what each frame shows, on wgpu and on the software
//! backend.
//!
//! Without an adapter the cases on wgpu are reported as ignored. With `DRAWLOOM_REQUIRE_ADAPTER=1` a missing adapter
//! fails them.

mod bloom;
mod fixture;
mod late_pictures;
mod loops;
mod reprojection;
mod trouble;

use libtest_mimic::{Arguments, Failed, Trial};

type Case = (&'static str, fn() -> Result<(), Failed>);

fn main() {
    let arguments = Arguments::from_args();
    let no_adapter = fixture::device().is_none();
    let required = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let on_adapter = [
        bloom::ON_ADAPTER,
        late_pictures::ON_ADAPTER,
        loops::ON_ADAPTER,
        reprojection::ON_ADAPTER,
        trouble::ON_ADAPTER,
    ]
    .concat();
    let mut trials: Vec<_> = on_adapter
        .into_iter()
        .map(|(name, run)| Trial::test(name, run).with_ignored_flag(no_adapter && !required))
        .collect();
    let in_software = [
        bloom::IN_SOFTWARE,
        late_pictures::IN_SOFTWARE,
        loops::IN_SOFTWARE,
        reprojection::IN_SOFTWARE,
        trouble::IN_SOFTWARE,
    ]
    .concat();
    trials.extend(in_software.into_iter().map(|(name, run)| Trial::test(name, run)));
    libtest_mimic::run(&arguments, trials).exit();
}
