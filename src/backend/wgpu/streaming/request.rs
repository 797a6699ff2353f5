//! What is used, but not on the device.

use std::cmp::{Ordering, Reverse};

use crate::handle::Handle;
use crate::scene::{Mesh, Texture};

/// Something that is used, but neither on the device nor on its way. The greatest request comes first.
pub(super) struct Request<'a> {
    /// Whether one of the latest frames would have drawn it.
    pub(super) is_wanted: bool,
    pub(super) priority: i32,
    pub(super) requested: Requested<'a>,
}

/// What is requested: with its handle and its revision.
pub(super) enum Requested<'a> {
    Mesh(Handle<Mesh>, u64, &'a Mesh),
    Texture(Handle<Texture>, u64, &'a Texture),
}

impl Requested<'_> {
    /// Whether it is a mesh, and its slot.
    pub(super) fn key(&self) -> (bool, u32) {
        match self {
            Self::Mesh(handle, ..) => (true, handle.index()),
            Self::Texture(handle, ..) => (false, handle.index()),
        }
    }
}

impl Request<'_> {
    /// Meshes come before textures: without a texture something is drawn nevertheless. The rest is there so that any
    /// two differ.
    fn rank(&self) -> (bool, i32, bool, Reverse<u32>) {
        let (is_mesh, slot) = self.requested.key();
        (self.is_wanted, self.priority, is_mesh, Reverse(slot))
    }
}

impl Ord for Request<'_> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank().cmp(&other.rank())
    }
}

impl PartialOrd for Request<'_> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Request<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.rank() == other.rank()
    }
}

impl Eq for Request<'_> {}
