//! Whose maps of directional lights light what each camera sees.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::Camera;

/// Whose maps of directional lights light what each camera sees. An owner is a main camera, the first one that needs
/// the same maps.
#[derive(Debug, Default)]
pub(crate) struct MapOwners {
    /// The indices of the owners among the cameras, in order.
    owners: Vec<usize>,
    /// For each camera, the index of its owner among the cameras; `None` for all without a main camera.
    owner_of: Vec<Option<usize>>,
}

impl MapOwners {
    /// `covered` are the spheres that the maps of a main camera cover, `None` if it has no maps: main cameras with the
    /// same spheres share maps.
    pub(super) fn new(cameras: &[Camera], covered: impl Fn(&Camera) -> Option<Vec<(DVec3, f64)>>) -> Self {
        let main_cameras = || (0..).zip(cameras).filter(|(_, camera)| camera.kind.rules().owns_shadow_maps);
        let mut indices = main_cameras().map(|(index, _)| index);
        let (first, second) = (indices.next(), indices.next());
        if second.is_none() {
            // There is nobody else to share maps with.
            return Self { owners: first.into_iter().collect(), owner_of: vec![first; cameras.len()] };
        }
        let mut owners = Vec::new();
        let mut owner_of = vec![None; cameras.len()];
        let mut by_spheres: HashMap<Option<Vec<[u64; 4]>>, usize> = HashMap::new();
        let mut by_name: HashMap<&str, usize> = HashMap::new();
        for (index, camera) in main_cameras() {
            let bits = |(center, radius): (DVec3, f64)| [center.x, center.y, center.z, radius].map(f64::to_bits);
            let spheres = covered(camera).map(|spheres| spheres.into_iter().map(bits).collect());
            let owner = *by_spheres.entry(spheres).or_insert(index);
            if owner == index {
                owners.push(index);
            }
            owner_of[index] = Some(owner);
            by_name.entry(&camera.name).or_insert(owner);
        }
        let first = owners.first().copied();
        for (camera, owner) in cameras.iter().zip(&mut owner_of).filter(|(_, owner)| owner.is_none()) {
            let mut parents = camera.name.rmatch_indices('/').map(|(end, _)| &camera.name[..end]);
            *owner = parents.find_map(|parent| by_name.get(parent).copied()).or(first);
        }
        Self { owners, owner_of }
    }

    /// The indices of the owners among the cameras, in order.
    pub(crate) fn owners(&self) -> &[usize] {
        &self.owners
    }

    /// The index of a camera's owner among the cameras; `None` without a main camera.
    pub(crate) fn owner_of(&self, camera: usize) -> Option<usize> {
        self.owner_of[camera]
    }

    /// The name of an owner's maps of a light whose maps for the first owner are called `name`.
    pub(crate) fn map_name(&self, name: &str, owner: usize, cameras: &[Camera]) -> String {
        if self.owners.first() == Some(&owner) {
            name.to_owned()
        } else {
            format!("{name} for {}", cameras[owner].name)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ViewKind;

    fn camera(name: &str, kind: ViewKind, x: f64) -> Camera {
        Camera { kind, ..Camera::looking_at(name, DVec3::X * x, DVec3::Z) }
    }

    #[test]
    fn cameras_belong_to_the_first_main_camera_with_the_same_maps_or_to_the_one_in_their_name() {
        use ViewKind::{Main, Post, Reflection};
        let cameras = [
            camera("probe/0", Reflection, 0.0),
            camera("first", Main, 1.0),
            camera("first/mirror", Reflection, 2.0),
            camera("second", Main, 3.0),
            camera("second/portal/portal", Reflection, 4.0),
            camera("secondary/portal", Reflection, 4.0),
            camera("copy of the second", Main, 3.0),
            camera("copy of the second/mirror", Reflection, 5.0),
            camera("second/map", Main, 6.0),
            camera("second/map/mirror", Reflection, 7.0),
            camera("sheet", Post, 8.0),
        ];
        let owners = MapOwners::new(&cameras, |camera| Some(vec![(camera.position, 1.0)]));
        assert_eq!(owners.owners(), [1, 3, 8]);
        let found: Vec<_> = (0..cameras.len()).map(|index| owners.owner_of(index)).collect();
        assert_eq!(found, [1, 1, 1, 3, 3, 1, 3, 3, 8, 8, 1].map(Some));
        let names = [1, 3, 8].map(|owner| owners.map_name("sun", owner, &cameras));
        assert_eq!(names, ["sun", "sun for second", "sun for second/map"]);
    }

    #[test]
    fn without_a_main_camera_nobody_owns_maps() {
        let cameras = [camera("probe/0", ViewKind::Reflection, 0.0)];
        let owners = MapOwners::new(&cameras, |_| Some(Vec::new()));
        assert_eq!((owners.owners(), owners.owner_of(0)), ([].as_slice(), None));
    }
}
