//! A fence at a place in a frame.

use crate::fence::FenceSetter;

/// A fence that the device sets at a place in a frame.
#[derive(Debug)]
pub struct FrameFence {
    /// The number of passes before the place, in submission order. If it is that of all passes, the place is the end of
    /// the frame, after everything that the backend adds.
    pub passes: usize,
    /// Sets the fence.
    pub setter: FenceSetter,
}

impl FrameFence {
    /// Sets the fences whose places come after this many passes at most, of fences that are in the order of their
    /// places. For devices that have done what is submitted when the call returns.
    ///
    /// ```
    /// # use drawloom::backend::FrameFence;
    /// # use drawloom::fence::Fence;
    /// let (setter, middle) = Fence::new("after two passes");
    /// let mut fences = vec![FrameFence { passes: 2, setter }];
    /// FrameFence::set_up_to(1, &mut fences);
    /// assert!(!middle.is_set());
    /// FrameFence::set_up_to(2, &mut fences);
    /// assert!(middle.is_set());
    /// ```
    pub fn set_up_to(passes: usize, fences: &mut Vec<Self>) {
        let reached = fences.iter().take_while(|fence| fence.passes <= passes).count();
        fences.drain(..reached).for_each(|fence| fence.setter.set());
    }
}
