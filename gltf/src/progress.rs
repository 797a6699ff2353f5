//! How far loading is.

/// How far loading is. What takes long is to decode images, so each is a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// How many steps are done.
    pub done: usize,
    /// How many there are.
    pub total: usize,
}

/// Counts steps, and reports each.
pub(crate) struct StepCounter<'a> {
    progress: Progress,
    report: &'a mut dyn FnMut(Progress),
}

impl<'a> StepCounter<'a> {
    pub(crate) fn new(total: usize, report: &'a mut dyn FnMut(Progress)) -> Self {
        let progress = Progress { done: 0, total };
        report(progress);
        Self { progress, report }
    }

    /// A step is done.
    pub(crate) fn step(&mut self) {
        self.progress.done += 1;
        (self.report)(self.progress);
    }
}
