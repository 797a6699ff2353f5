//! Values of which there is one for each key.

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
    /// Each with the hash of its key.
    shared: Vec<(u64, Weak<(K, V)>)>,
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
    /// No lock is held meanwhile, so two threads may both make it, and get the one that is made first.
    ///
    /// # Errors
    /// Those of `make`. Nothing is kept of them, so the next to ask gets an error of its own.
    pub(super) fn get_or_make<E>(&self, key: K, make: impl FnOnce(&K) -> Result<V, E>) -> Result<Shared<K, V>, E> {
        let hash = self.hasher.hash_one(&key);
        if let Some(known) = self.entries.lock().find(hash, &key) {
            return Ok(Shared(known));
        }
        let value = make(&key)?;
        let mut entries = self.entries.lock();
        if let Some(known) = entries.find(hash, &key) {
            return Ok(Shared(known));
        }
        let made = Arc::new((key, value));
        entries.shared.retain(|(_, value)| value.strong_count() > 0);
        entries.shared.push((hash, Arc::downgrade(&made)));
        if self.keeps {
            entries.kept.push(Arc::clone(&made));
        }
        Ok(Shared(made))
    }

    /// Makes values anew for those who ask from now on.
    pub(super) fn clear(&self) {
        *self.entries.lock() = Entries::default();
    }

    /// The number of values that stay although nobody has them.
    pub(super) fn kept_count(&self) -> usize {
        self.entries.lock().kept.len()
    }
}

impl<K: Eq, V> Entries<K, V> {
    fn find(&self, hash: u64, key: &K) -> Option<Arc<(K, V)>> {
        let of_hash = self.shared.iter().filter(|(known, _)| *known == hash);
        of_hash.filter_map(|(_, value)| value.upgrade()).find(|value| value.0 == *key)
    }
}

// Derived implementations would require theirs of `K` and `V`.
impl<K, V> Default for Entries<K, V> {
    fn default() -> Self {
        Self { shared: Vec::new(), kept: Vec::new() }
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
