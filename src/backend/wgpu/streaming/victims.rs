//! What makes room for what is streamed.

use super::request::Request;

/// Something on the device that may make room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Victim {
    pub(super) slot: u32,
    pub(super) bytes: u64,
    /// The latest frame that drew it.
    pub(super) latest_use: u64,
    pub(super) priority: i32,
    /// Whether one of the latest frames drew it.
    pub(super) is_in_sight: bool,
}

/// What may make room, in the order in which it does: by last use.
pub(super) struct Victims(Vec<Victim>);

impl Victims {
    pub(super) fn new(victims: impl Iterator<Item = Victim>) -> Self {
        let mut victims: Vec<_> = victims.collect();
        // In sight last; then by last use, and of the same use by priority.
        victims.sort_unstable_by_key(|victim| (victim.is_in_sight, victim.latest_use, victim.priority, victim.slot));
        Self(victims)
    }

    /// Takes those that make room for a request; none if there are not enough.
    ///
    /// What is in sight evicts what is not, and of what is in sight only what has a lower priority. What is not evicts only what is not in
    /// sight either and has a lower priority. So nothing ever makes room for what it replaced before.
    pub(super) fn take(&mut self, request: &Request<'_>, needed: u64) -> Vec<u32> {
        let may_evict = |victim: &Victim| match (request.is_wanted, victim.is_in_sight) {
            (true, false) => true,
            (true, true) | (false, false) => victim.priority < request.priority,
            (false, true) => false,
        };
        let mut bytes = 0;
        let candidates = self.0.iter().filter(|victim| may_evict(victim)).copied();
        let chosen: Vec<_> = candidates
            .take_while(|victim| {
                let is_needed = bytes < needed;
                bytes += if is_needed { victim.bytes } else { 0 };
                is_needed
            })
            .map(|victim| victim.slot)
            .collect();
        if bytes < needed {
            return Vec::new();
        }
        self.0.retain(|victim| !chosen.contains(&victim.slot));
        chosen
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::backend::wgpu::streaming::request::Requested;
    use crate::scene::{Mesh, Topology, Vertex};

    fn mesh() -> Mesh {
        let corner = |[x, y]: [f32; 2]| Vertex { position: [x, y, 0.0], ..Vertex::default() };
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(corner).to_vec();
        Mesh::new("leaf", Topology::TriangleList, corners, vec![0, 1, 2]).unwrap()
    }

    fn victim(slot: u32, latest_use: u64, priority: i32) -> Victim {
        Victim { slot, bytes: 10, latest_use, priority, is_in_sight: latest_use > 100 }
    }

    fn taken(victims: &[Victim], (is_wanted, priority): (bool, i32), needed: u64) -> Vec<u32> {
        let mesh = mesh();
        let request = Request { is_wanted, priority, requested: Requested::Mesh(0, 0, &mesh) };
        Victims::new(victims.iter().copied()).take(&request, needed)
    }

    #[test]
    fn what_was_used_longest_ago_makes_room_first() {
        let victims = [victim(0, 7, 0), victim(1, 3, 9), victim(2, 5, 0), victim(3, 101, -9), victim(4, 3, 1)];
        assert_eq!(taken(&victims, (true, 0), 10), [4]);
        assert_eq!(taken(&victims, (true, 0), 31), [4, 1, 2, 0]);
        assert_eq!(taken(&victims, (true, 0), 50), [4, 1, 2, 0, 3], "in sight, but less important");
        assert_eq!(taken(&victims, (true, -9), 41), [] as [u32; 0], "not enough");
    }

    #[test]
    fn what_is_out_of_sight_makes_room_only_for_what_is_more_important() {
        let victims = [victim(0, 1, 5), victim(1, 2, 4), victim(2, 101, 0)];
        assert_eq!(taken(&victims, (false, 5), 10), [1]);
        assert_eq!(taken(&victims, (false, 4), 10), [] as [u32; 0]);
        assert_eq!(taken(&victims, (false, 6), 20), [0, 1]);
        assert_eq!(taken(&victims, (false, 6), 21), [] as [u32; 0], "what is in sight stays");
    }
}
