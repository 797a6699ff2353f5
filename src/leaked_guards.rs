//! Locks whose guards the engine has leaked.

use std::mem;

use parking_lot::RwLock;

/// Unlocks a lock that nobody can use meanwhile: who borrowed the guard that still locks it has leaked that. The value
/// stays.
pub(crate) fn unlock<T: Default>(lock: &mut RwLock<T>) {
    if lock.is_locked() {
        *lock = RwLock::new(mem::take(lock.get_mut()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_whose_guard_was_leaked_can_be_locked_again_with_its_value() {
        let mut lock = RwLock::new(7);
        mem::forget(lock.read());
        unlock(&mut lock);
        *lock.write() += 1;
        mem::forget(lock.write());
        unlock(&mut lock);
        assert_eq!(*lock.read(), 8);
    }
}
