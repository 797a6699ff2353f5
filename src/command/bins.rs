//! Bins: the draw states and meshes that a scene's objects have.

use super::DrawState;

/// The pairs of draw state and mesh that a scene's objects have, or had. Equal commands become one draw, so the objects
/// of a bin are a batch. An object changes its bin seldom, so a pass counts its objects by bin and sorts nothing
/// (Bevy's binned render phases).
///
/// Numbers depend on timing: use [`Bins::in_order`] wherever order matters.
#[derive(Debug, Default)]
pub struct Bins {
    /// For each mesh, by slot, the number of its bin by state; [`NO_BIN`] where it has none.
    numbers: Vec<[u32; STATES]>,
    /// By number.
    bins: Vec<Bin>,
    /// The numbers in draw order; the bins from `in_order.len()` on are not in it yet.
    in_order: Vec<u32>,
    /// By number: the position in `in_order`.
    ranks: Vec<u32>,
}

/// What the objects of a bin have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Bin {
    /// The fixed-function state, of subdivision level 0 and level of detail 0.
    pub state: DrawState,
    /// The mesh's slot.
    pub mesh: u32,
}

/// The number of states of subdivision level 0 and level of detail 0.
const STATES: usize = DrawState::COUNT >> 6;

const NO_BIN: u32 = u32::MAX;

impl Bins {
    /// The number of a bin, if it has one.
    pub fn find(&self, bin: Bin) -> Option<u32> {
        let number = *self.numbers.get(bin.mesh as usize)?.get(bin.state.index())?;
        (number != NO_BIN).then_some(number)
    }

    /// The number of a bin; a new one if it has none.
    ///
    /// # Panics
    /// If the state has a subdivision level or a level of detail above 0.
    pub fn insert(&mut self, bin: Bin) -> u32 {
        if let Some(number) = self.find(bin) {
            return number;
        }
        let mesh = bin.mesh as usize;
        if mesh >= self.numbers.len() {
            self.numbers.resize(mesh + 1, [NO_BIN; STATES]);
        }
        let number = self.bins.len() as u32;
        self.numbers[mesh][bin.state.index()] = number;
        self.bins.push(bin);
        number
    }

    /// Puts new bins in order. Call it between the last [`Bins::insert`] and the first [`Bins::in_order`].
    pub fn sort(&mut self) {
        if self.in_order.len() == self.bins.len() {
            return;
        }
        self.in_order.extend(self.in_order.len() as u32..self.bins.len() as u32);
        self.in_order.sort_unstable_by_key(|&number| self.bins[number as usize]);
        self.ranks.resize(self.bins.len(), 0);
        for (rank, &number) in (0..).zip(&self.in_order) {
            self.ranks[number as usize] = rank;
        }
    }

    /// The numbers in draw order: by state, then by mesh.
    pub fn in_order(&self) -> &[u32] {
        &self.in_order
    }

    /// The index of a bin in [`Bins::in_order`].
    ///
    /// # Panics
    /// If there is no bin with this number.
    pub fn rank(&self, number: u32) -> u32 {
        self.ranks[number as usize]
    }

    /// The bin with this number.
    ///
    /// # Panics
    /// If there is none.
    pub fn get(&self, number: u32) -> Bin {
        self.bins[number as usize]
    }

    /// The number of bins.
    #[allow(clippy::len_without_is_empty)] // It would have no caller.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Removes all bins.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}
