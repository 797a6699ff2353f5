//! Sets of classes of lights.

use crate::view::LightClass;

/// A bit for each class of lights, by [`LightClass::index`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct LightClasses(u32);

const _: () = assert!(LightClass::COUNT <= u32::BITS as usize);

impl LightClasses {
    pub(super) fn insert(&mut self, class: LightClass) {
        self.0 |= 1 << class.index();
    }

    pub(super) fn bits(self) -> u32 {
        self.0
    }

    pub(super) fn contains(self, class: LightClass) -> bool {
        self.0 & 1 << class.index() != 0
    }
}

impl FromIterator<LightClass> for LightClasses {
    fn from_iter<I: IntoIterator<Item = LightClass>>(classes: I) -> Self {
        let mut set = Self::default();
        classes.into_iter().for_each(|class| set.insert(class));
        set
    }
}
