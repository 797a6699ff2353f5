//! A process for the unit tests of plans.

use crate::process::{CommandDraws, Declare, Draws, RenderProcess};

/// A process of this name, which draws objects. The function is its declaration.
pub(super) struct TestProcess<F>(pub(super) &'static str, pub(super) F);

impl<F: Fn(&mut Declare) + Send + Sync> RenderProcess for TestProcess<F> {
    fn name(&self) -> &str {
        self.0
    }

    fn declare(&self, declare: &mut Declare) {
        (self.1)(declare);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}
