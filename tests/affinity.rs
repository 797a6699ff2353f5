//! Threads are restricted to processors with the feature `affinity`, on systems that can. Elsewhere that is an error.

use std::io::ErrorKind;

use drawloom::task::{AffinityMask, Scheduler, SchedulerError};

#[test]
fn an_affinity_is_applied_or_says_what_it_needs() {
    let built = Scheduler::builder().workers(2).affinity(|_| AffinityMask::new(0..1024)).build();
    let is_on = cfg!(feature = "affinity");
    if is_on && cfg!(any(target_os = "linux", target_os = "android")) {
        built.unwrap();
        return;
    }
    match built.unwrap_err() {
        SchedulerError::Affinity { worker: 1, source, .. } if source.kind() == ErrorKind::Unsupported => {
            let message = source.to_string();
            assert_eq!(message.contains("the feature `affinity`"), !is_on, "{message}");
        }
        other => panic!("{other}"),
    }
}
