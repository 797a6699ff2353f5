//! Functions of the engine's own that choose materials.

use std::fmt;
use std::sync::Arc;

use super::Material;
use crate::unwind::discard;

/// Chooses materials: a function of the engine's own. A clone shares the function, and predicates are equal if they
/// share one, so an engine makes a predicate once and clones it.
///
/// A view calls it once for each material when it first has the predicate, and again after a material changed; not for
/// each object, and not in each frame. So it must depend on nothing but the material. What depends on something else is
/// another predicate.
///
/// ```
/// use drawloom::scene::{Blend, Material, MaterialPredicate};
///
/// let no_glass = MaterialPredicate::new(|material| material.blend == Blend::None);
/// assert!(no_glass.contains(&Material::default()));
/// assert_eq!(no_glass, no_glass.clone());
/// ```
#[derive(Clone)]
pub struct MaterialPredicate(Arc<EngineFunction>);

/// The engine's function. What it captured may panic when it is dropped, which may happen anywhere in a frame.
struct EngineFunction(Option<Box<Function>>);

type Function = dyn Fn(&Material) -> bool + Send + Sync;

impl MaterialPredicate {
    /// The materials for which a function returns true. If it panics, the frame fails with
    /// [`FrameError::FilterPanicked`](crate::FrameError::FilterPanicked).
    pub fn new(contains: impl Fn(&Material) -> bool + Send + Sync + 'static) -> Self {
        Self(Arc::new(EngineFunction(Some(Box::new(contains)))))
    }

    /// Whether it contains a material. Calls the function, which may panic.
    pub fn contains(&self, material: &Material) -> bool {
        self.0.0.as_ref().is_some_and(|contains| contains(material))
    }
}

impl Drop for EngineFunction {
    fn drop(&mut self) {
        discard(self.0.take());
    }
}

impl PartialEq for MaterialPredicate {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Eq for MaterialPredicate {}

impl fmt::Debug for MaterialPredicate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("MaterialPredicate").finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_of_what_the_function_captured_does_not_leave_the_drop() {
        struct Panics;
        impl Drop for Panics {
            fn drop(&mut self) {
                panic!("as planned");
            }
        }
        let captured = Panics;
        let predicate = MaterialPredicate::new(move |_| {
            let _captured = &captured;
            true
        });
        let clone = predicate.clone();
        drop(predicate);
        assert!(clone.contains(&Material::default()));
        drop(clone);
    }

    #[test]
    fn predicates_are_equal_if_they_share_a_function() {
        let predicate = || MaterialPredicate::new(|material| material.double_sided);
        let one = predicate();
        assert_eq!(one, one.clone());
        assert_ne!(one, predicate());
    }
}
