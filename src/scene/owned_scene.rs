//! The shipped scene.

use glam::{DVec3, Quat, Vec3};

use super::transform::transform_is_valid;
use super::{Asset, Assets, Bounds, Camera, Light, Material, Mesh, SceneError, SceneRef};
use crate::handle::{Handle, Slots, StaleHandle};

/// A scene that owns its objects as one array a property, and their assets. Everything can be added, changed and removed
/// between frames.
///
/// ```
/// use drawloom::glam::DVec3;
/// use drawloom::scene::{Material, Mesh, RenderObject, Scene, Topology, Vertex};
///
/// let mut scene = Scene::new();
/// let corner = |x, y| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
/// let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)];
/// let mesh = scene.add(Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])?)?;
/// let material = scene.add(Material::default())?;
/// scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
#[derive(Debug, Default)]
pub struct Scene {
    /// A view for each.
    pub cameras: Vec<Camera>,
    /// The lights.
    pub lights: Vec<Light>,
    /// Radiance that reaches every surface from everywhere, linear: a surface of diffuse 1 then looks just as bright.
    pub ambient: Vec3,
    /// Radiance where nothing is, linear.
    pub background: Vec3,
    assets: Assets,
    /// Where in the arrays below each object is.
    places: Slots<usize>,
    /// The way back from the arrays.
    owners: Vec<Handle<usize>>,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

/// Refers to an object of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ObjectHandle(Handle<usize>);

/// One thing to draw (M 10.3's `RenderObject`): it says where it is, what its triangles are and what it is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderObject {
    /// Its origin in the world, in metres.
    pub position: DVec3,
    /// From object space to the world's axes; of unit length.
    pub orientation: Quat,
    /// Along its own axes, applied first.
    pub scale: Vec3,
    /// Its triangles.
    pub mesh: Handle<Mesh>,
    /// What it is made of.
    pub material: Handle<Material>,
}

impl RenderObject {
    /// An object at `position`, neither turned nor scaled.
    pub fn new(mesh: Handle<Mesh>, material: Handle<Material>, position: DVec3) -> Self {
        Self { position, orientation: Quat::IDENTITY, scale: Vec3::ONE, mesh, material }
    }
}

impl Scene {
    /// An empty scene.
    pub fn new() -> Self {
        Self::default()
    }

    /// What a frame reads.
    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            assets: &self.assets,
            lights: &self.lights,
            cameras: &self.cameras,
            ambient: self.ambient,
            background: self.background,
        }
    }

    /// Adds an object.
    ///
    /// # Errors
    /// If its transform is not finite, its orientation is no rotation, or a handle is stale.
    pub fn add_object(&mut self, object: RenderObject) -> Result<ObjectHandle, SceneError> {
        let place = self.positions.len();
        let bounds = self.check(&object, place)?;
        let owner = self.places.insert(place);
        self.owners.push(owner);
        self.positions.push(object.position);
        self.orientations.push(object.orientation);
        self.scales.push(object.scale);
        self.bounds.push(bounds);
        self.meshes.push(object.mesh);
        self.materials.push(object.material);
        Ok(ObjectHandle(owner))
    }

    /// Changes an object.
    ///
    /// # Errors
    /// As [`Scene::add_object`], and if the object was removed. Nothing changes then.
    pub fn replace_object(&mut self, handle: ObjectHandle, object: RenderObject) -> Result<(), SceneError> {
        let place = self.place(handle)?;
        let bounds = self.check(&object, place)?;
        self.positions[place] = object.position;
        self.orientations[place] = object.orientation;
        self.scales[place] = object.scale;
        self.bounds[place] = bounds;
        self.meshes[place] = object.mesh;
        self.materials[place] = object.material;
        Ok(())
    }

    /// Takes an object out. The last one takes its index.
    ///
    /// # Errors
    /// If it was removed already.
    pub fn remove_object(&mut self, handle: ObjectHandle) -> Result<RenderObject, StaleHandle> {
        let object = self.object(handle)?;
        let place = self.places.remove(handle.0).map_err(as_object)?;
        self.owners.swap_remove(place);
        self.positions.swap_remove(place);
        self.orientations.swap_remove(place);
        self.scales.swap_remove(place);
        self.bounds.swap_remove(place);
        self.meshes.swap_remove(place);
        self.materials.swap_remove(place);
        if let Some(&moved) = self.owners.get(place) {
            *self.places.get_mut(moved).map_err(as_object)? = place;
        }
        Ok(object)
    }

    /// An object as it is.
    ///
    /// # Errors
    /// If it was removed.
    pub fn object(&self, handle: ObjectHandle) -> Result<RenderObject, StaleHandle> {
        let place = self.place(handle)?;
        Ok(RenderObject {
            position: self.positions[place],
            orientation: self.orientations[place],
            scale: self.scales[place],
            mesh: self.meshes[place],
            material: self.materials[place],
        })
    }

    /// Each object `copies` times over, at the same place, as in L 6: more draws, the same picture. 1 changes nothing, and
    /// 0 counts as 1.
    pub fn duplicate_objects(&mut self, copies: usize) {
        let originals = self.positions.len();
        for _ in 1..copies {
            for place in 0..originals {
                self.owners.push(self.places.insert(self.positions.len()));
                self.positions.push(self.positions[place]);
            }
            self.orientations.extend_from_within(..originals);
            self.scales.extend_from_within(..originals);
            self.bounds.extend_from_within(..originals);
            self.meshes.extend_from_within(..originals);
            self.materials.extend_from_within(..originals);
        }
    }

    /// The number of objects.
    pub fn object_count(&self) -> usize {
        self.positions.len()
    }

    /// The objects' handles, in the order of their indices.
    pub fn objects(&self) -> impl Iterator<Item = ObjectHandle> {
        self.owners.iter().copied().map(ObjectHandle)
    }

    /// Meshes, materials and textures.
    pub fn assets(&self) -> &Assets {
        &self.assets
    }

    /// See [`Assets::add`].
    ///
    /// # Errors
    /// If it is invalid, or refers to what is not here.
    pub fn add<T: Asset>(&mut self, asset: T) -> Result<Handle<T>, SceneError> {
        self.assets.add(asset)
    }

    /// See [`Assets::replace`].
    ///
    /// # Errors
    /// If the handle is stale or the new one is invalid; nothing changes then.
    pub fn replace<T: Asset>(&mut self, handle: Handle<T>, asset: T) -> Result<(), SceneError> {
        let meshes_before = self.assets.meshes.revision();
        self.assets.replace(handle, asset)?;
        if self.assets.meshes.revision() != meshes_before {
            // It was a mesh: what objects copied of it is renewed.
            for (bounds, &mesh) in
                self.bounds.iter_mut().zip(&self.meshes).filter(|(_, mesh)| mesh.index() == handle.index())
            {
                if let Ok(mesh) = self.assets.get(mesh) {
                    *bounds = mesh.bounds();
                }
            }
        }
        Ok(())
    }

    /// See [`Assets::remove`].
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn remove<T: Asset>(&mut self, handle: Handle<T>) -> Result<T, StaleHandle> {
        self.assets.remove(handle)
    }

    fn place(&self, handle: ObjectHandle) -> Result<usize, StaleHandle> {
        self.places.get(handle.0).copied().map_err(as_object)
    }

    fn check(&self, object: &RenderObject, place: usize) -> Result<Bounds, SceneError> {
        if !transform_is_valid(object.position, object.orientation, object.scale) {
            return Err(SceneError::InvalidTransform { object: place });
        }
        self.assets.get(object.material)?;
        Ok(self.assets.get(object.mesh)?.bounds())
    }
}

fn as_object(stale: StaleHandle) -> StaleHandle {
    StaleHandle { kind: "RenderObject", ..stale }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::scene::{Topology, Vertex};

    fn triangle(size: f32) -> Mesh {
        let corner = |x, y| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
        let corners = vec![corner(0.0, 0.0), corner(size, 0.0), corner(0.0, size)];
        Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2]).unwrap()
    }

    fn scene_of(count: usize) -> (Scene, Vec<ObjectHandle>) {
        let mut scene = Scene::new();
        let mesh = scene.add(triangle(1.0)).unwrap();
        let material = scene.add(Material::default()).unwrap();
        let place = |number| RenderObject::new(mesh, material, DVec3::X * number as f64);
        let handles = (0..count).map(|number| scene.add_object(place(number)).unwrap()).collect();
        (scene, handles)
    }

    #[test]
    fn handles_survive_the_removal_of_others() {
        let (mut scene, handles) = scene_of(4);
        scene.remove_object(handles[1]).unwrap();
        scene.remove_object(handles[3]).unwrap();
        assert_eq!(scene.object_count(), 2);
        assert_eq!(scene.object(handles[0]).unwrap().position, DVec3::ZERO);
        assert_eq!(scene.object(handles[2]).unwrap().position, DVec3::X * 2.0);
        let stale = scene.remove_object(handles[1]).unwrap_err();
        assert_eq!(stale.kind, "RenderObject");
        assert_eq!(scene.objects().count(), 2);
        scene.as_scene_ref().check_lengths().unwrap();
    }

    #[test]
    fn a_transform_that_is_not_finite_is_refused_where_it_enters() {
        let (mut scene, handles) = scene_of(1);
        let good = scene.object(handles[0]).unwrap();
        for bad in [
            RenderObject { position: DVec3::new(f64::NAN, 0.0, 0.0), ..good },
            RenderObject { scale: Vec3::new(1.0, f32::INFINITY, 1.0), ..good },
            RenderObject { orientation: Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), ..good },
            RenderObject { orientation: Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0), ..good },
        ] {
            assert!(matches!(scene.add_object(bad), Err(SceneError::InvalidTransform { object: 1 })));
            assert!(matches!(scene.replace_object(handles[0], bad), Err(SceneError::InvalidTransform { object: 0 })));
        }
        assert_eq!(scene.object(handles[0]).unwrap(), good);
    }

    #[test]
    fn replacing_a_mesh_renews_the_bounds_of_its_objects() {
        let (mut scene, handles) = scene_of(2);
        let mesh = scene.object(handles[0]).unwrap().mesh;
        let before = scene.as_scene_ref().bounds[1].radius;
        scene.replace(mesh, triangle(10.0)).unwrap();
        assert!(scene.as_scene_ref().bounds[1].radius > before * 9.0);
    }

    #[test]
    fn copies_coincide_with_their_originals() {
        let (mut scene, _) = scene_of(3);
        scene.duplicate_objects(4);
        let reference = scene.as_scene_ref();
        reference.check_lengths().unwrap();
        assert_eq!(reference.object_count(), 12);
        assert_eq!(reference.positions[1], reference.positions[10]);
        let last = scene.objects().last().unwrap();
        assert_eq!(scene.object(last).unwrap().position, DVec3::X * 2.0);
    }
}
