//! The backends under test.

use std::sync::Arc;

use drawloom::backend::internal::NullSubmission;
use drawloom::backend::{Backend, NullBackend, SoftwareBackend, SoftwareSubmission};
use drawloom::task::Scheduler;
use libtest_mimic::Failed;

/// A backend under test.
pub trait Subject: Backend + Sized {
    /// A backend on a device that may be shared.
    fn open(scheduler: &Arc<Scheduler>) -> Result<Self, Failed>;

    /// What a submission has drawn into a view's target, byte by byte.
    fn read(submission: &Self::Submission, view: usize, target: &str) -> Result<Vec<u8>, Failed>;
}

impl Subject for NullBackend {
    fn open(_: &Arc<Scheduler>) -> Result<Self, Failed> {
        Ok(Self)
    }

    fn read(submission: &NullSubmission, _: usize, _: &str) -> Result<Vec<u8>, Failed> {
        Ok(format!("{submission:?}").into_bytes())
    }
}

impl Subject for SoftwareBackend {
    fn open(scheduler: &Arc<Scheduler>) -> Result<Self, Failed> {
        Ok(Self::new(Arc::clone(scheduler)))
    }

    fn read(submission: &SoftwareSubmission, view: usize, target: &str) -> Result<Vec<u8>, Failed> {
        Ok(submission.read(view, target)?.bytes)
    }
}

#[cfg(feature = "wgpu")]
mod of_wgpu {
    use std::sync::Arc;

    use drawloom::backend::{WgpuBackend, WgpuSubmission};
    use drawloom::task::Scheduler;
    use drawloom_testing::adapter;
    use libtest_mimic::Failed;

    use super::Subject;

    impl Subject for WgpuBackend {
        /// Subjects share what they compile: dozens are opened, one for each call that fails.
        fn open(_: &Arc<Scheduler>) -> Result<Self, Failed> {
            Ok(adapter::shared_backend()?)
        }

        fn read(submission: &WgpuSubmission, view: usize, target: &str) -> Result<Vec<u8>, Failed> {
            Ok(submission.read(view, target)?.bytes)
        }
    }
}
