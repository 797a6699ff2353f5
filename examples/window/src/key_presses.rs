//! Which keys go down, once for each press.

use std::collections::HashSet;

use winit::keyboard::KeyCode;

/// Which keys go down, whichever window has the focus: a key that is held repeats, and also in a window that gets the
/// focus meanwhile.
#[derive(Debug, Default)]
pub struct KeyPresses {
    pressed: HashSet<KeyCode>,
    /// What was pressed when a window got the focus. It may have been released while no window heard of it.
    before_focus: HashSet<KeyCode>,
}

impl KeyPresses {
    /// A window got the focus. The system tells it of the keys that are held, as if they went down.
    pub fn gain_focus(&mut self) {
        self.before_focus = std::mem::take(&mut self.pressed);
    }

    /// The system tells of a key that was held when a window got the focus.
    pub fn find_held(&mut self, key: KeyCode) {
        if self.before_focus.remove(&key) {
            self.pressed.insert(key);
        }
    }

    /// A key went down, or repeats. Returns whether it went down.
    pub fn press(&mut self, key: KeyCode) -> bool {
        self.pressed.insert(key)
    }

    /// A key went up.
    pub fn release(&mut self, key: KeyCode) {
        self.pressed.remove(&key);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: KeyCode = KeyCode::KeyN;

    #[test]
    fn a_key_that_repeats_is_pressed_once() {
        let mut keys = KeyPresses::default();
        assert_eq!([keys.press(KEY), keys.press(KEY), keys.press(KeyCode::F1)], [true, false, true]);
        keys.release(KEY);
        assert!(keys.press(KEY));
    }

    #[test]
    fn a_key_that_is_held_while_the_focus_changes_is_pressed_once() {
        let mut keys = KeyPresses::default();
        keys.press(KEY);
        keys.gain_focus();
        keys.find_held(KEY);
        assert!(!keys.press(KEY));
    }

    #[test]
    fn a_key_that_goes_down_as_a_window_gets_the_focus_is_pressed() {
        let mut keys = KeyPresses::default();
        keys.gain_focus();
        // The system tells what is held when it is asked, and so of what is still to come.
        keys.find_held(KEY);
        assert!(keys.press(KEY));
    }

    #[test]
    fn a_key_that_went_up_elsewhere_is_forgotten() {
        let mut keys = KeyPresses::default();
        keys.press(KEY);
        keys.gain_focus();
        assert!(keys.press(KEY));
    }
}
