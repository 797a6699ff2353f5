//! Values of which there is one for each key.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hash, RandomState};
use std::ops::Deref;
use std::sync::{Arc, Weak};

use parking_lot::Mutex;

/// Makes one value for each key, and gives it to all who ask for it while one of them still has it.
pub(super) struct Interner<K, V> {
    hasher: RandomState,
    entries: Mutex<Entries<K, V>>,
    /// Whether values stay that nobody has any more, until they are [cleared](Self::clear).
    keeps: bool,
}

struct Entries<K, V> {
    /// By the hash of their keys.
    shared: HashMap<u64, Vec<Weak<(K, V)>>>,
    kept: Vec<Arc<(K, V)>>,
}

/// A value with its key. Clones are the same value.
pub(crate) struct Shared<K, V>(Arc<(K, V)>);

impl<K: Eq + Hash, V> Interner<K, V> {
    pub(super) fn new(keeps: bool) -> Self {
        Self { hasher: RandomState::new(), entries: Mutex::default(), keeps }
    }

    /// The value of a key: the one that somebody has, or what `make` makes.
    ///
    /// No lock is held while a value is made or dropped. So two threads may both make it, and get the one that is made
    /// first.
    ///
    /// # Errors
    /// Those of `make`. Nothing is kept of them, so the next to ask gets an error of its own.
    pub(super) fn get_or_make<E>(&self, key: K, make: impl FnOnce(&K) -> Result<V, E>) -> Result<Shared<K, V>, E> {
        let hash = self.hasher.hash_one(&key);
        let find = |key: &K, values: &[Arc<(K, V)>]| values.iter().find(|value| value.0 == *key).cloned();
        let values = self.entries.lock().of_hash(hash);
        if let Some(known) = find(&key, &values) {
            return Ok(Shared(known));
        }
        let value = make(&key)?;
        let made = Arc::new((key, value));
        // The values leave the block, because any of them may be the last of its kind.
        let (known, _values) = {
            let mut entries = self.entries.lock();
            let values = entries.of_hash(hash);
            let known = find(&made.0, &values);
            if known.is_none() {
                entries.add(hash, &made, self.keeps);
            }
            (known, values)
        };
        Ok(Shared(known.unwrap_or(made)))
    }

    /// Makes values anew for those who ask from now on.
    pub(super) fn clear(&self) {
        let entries = std::mem::take(&mut *self.entries.lock());
        drop(entries);
    }

    /// The number of values that stay although nobody has them.
    pub(super) fn kept_count(&self) -> usize {
        self.entries.lock().kept.len()
    }
}

impl<K, V> Entries<K, V> {
    fn of_hash(&self, hash: u64) -> Vec<Arc<(K, V)>> {
        self.shared.get(&hash).map_or_else(Vec::new, |values| values.iter().filter_map(Weak::upgrade).collect())
    }

    /// Adds a value, and removes the entries of those that nobody has any more.
    fn add(&mut self, hash: u64, made: &Arc<(K, V)>, keeps: bool) {
        self.shared.retain(|_, values| {
            values.retain(|value| value.strong_count() > 0);
            !values.is_empty()
        });
        self.shared.entry(hash).or_default().push(Arc::downgrade(made));
        if keeps {
            self.kept.push(Arc::clone(made));
        }
    }
}

// Derived implementations would require theirs of `K` and `V`.
impl<K, V> Default for Entries<K, V> {
    fn default() -> Self {
        Self { shared: HashMap::new(), kept: Vec::new() }
    }
}

impl<K, V> Shared<K, V> {
    /// A number that no other value has at the same time.
    pub(crate) fn identity(&self) -> usize {
        Arc::as_ptr(&self.0).addr()
    }
}

impl<K, V> Clone for Shared<K, V> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<K, V> Deref for Shared<K, V> {
    type Target = V;

    fn deref(&self) -> &V {
        &self.0.1
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::hash::Hasher;

    use super::*;

    /// A key whose hash is that of all others.
    #[derive(PartialEq, Eq)]
    struct Colliding(u32);

    impl Hash for Colliding {
        fn hash<H: Hasher>(&self, state: &mut H) {
            0.hash(state);
        }
    }

    fn get(interner: &Interner<Colliding, u32>, key: u32, value: u32) -> Shared<Colliding, u32> {
        interner.get_or_make(Colliding(key), |_| Ok::<_, ()>(value)).unwrap()
    }

    #[test]
    fn values_are_shared_by_keys_and_not_by_hashes() {
        let interner = Interner::new(false);
        let [one, two] = [get(&interner, 1, 10), get(&interner, 2, 20)];
        assert_eq!([*one, *two, *get(&interner, 1, 11), *get(&interner, 2, 21)], [10, 20, 10, 20]);
    }

    #[test]
    fn values_go_with_the_last_who_has_them() {
        let interner = Interner::new(false);
        let first = get(&interner, 1, 10);
        let second = first.clone();
        drop(first);
        assert_eq!(*get(&interner, 1, 11), 10);
        let value = Arc::downgrade(&second.0);
        drop(second);
        assert_eq!(value.strong_count(), 0);
        assert_eq!(*get(&interner, 1, 12), 12);
        // What nobody has leaves no entry when another is added.
        let _other = get(&interner, 2, 20);
        assert_eq!(interner.entries.lock().shared.len(), 1);
        assert_eq!(interner.kept_count(), 0);
    }

    #[test]
    fn kept_values_stay_until_they_are_cleared() {
        let interner = Interner::new(true);
        drop(get(&interner, 1, 10));
        assert_eq!((*get(&interner, 1, 11), interner.kept_count()), (10, 1));
        interner.clear();
        assert_eq!((*get(&interner, 1, 12), interner.kept_count()), (12, 1));
    }

    /// Checks when it is dropped that its interner is not locked.
    struct Unlocked(Weak<Interner<u32, Unlocked>>);

    impl Drop for Unlocked {
        fn drop(&mut self) {
            let is_locked = self.0.upgrade().is_some_and(|interner| interner.entries.is_locked());
            assert!(!is_locked, "a value is dropped under the lock");
        }
    }

    #[test]
    fn values_are_dropped_without_the_lock() {
        let interner = Arc::new(Interner::new(true));
        let value = || Ok::<_, ()>(Unlocked(Arc::downgrade(&interner)));
        drop(interner.get_or_make(1, |_| value()));
        interner.clear();
        // The second one to make a value drops it.
        let late = interner.get_or_make(2, |_| {
            drop(interner.get_or_make(2, |_| value()));
            value()
        });
        drop(late);
        interner.clear();
    }

    #[test]
    fn errors_are_not_shared_and_of_two_who_make_a_value_both_get_the_first() {
        let interner = Interner::new(false);
        let made = Cell::new(0);
        let fail = |_: &Colliding| {
            made.set(made.get() + 1);
            Err::<u32, _>("refused")
        };
        assert!([(); 2].iter().all(|()| interner.get_or_make(Colliding(1), fail).is_err()));
        assert_eq!(made.get(), 2);
        let mut other = None;
        let late = interner.get_or_make(Colliding(1), |_| {
            other = Some(get(&interner, 1, 10));
            Ok::<_, ()>(11)
        });
        assert_eq!((*late.unwrap(), other.map(|other| *other)), (10, Some(10)));
    }
}
