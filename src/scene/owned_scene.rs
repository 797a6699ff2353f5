//! A scene that owns its objects and assets.

use std::collections::HashSet;

use glam::{DVec3, Quat, Vec3};

use super::transform::transform_is_valid;
use super::{
    Arrivals, Asset, AssetLoader, Assets, Bounds, Camera, Changes, LayerMask, Light, Material, Mesh, ObjectSet,
    SceneError, SceneRef, StaticGroup, WrittenColumns,
};
use crate::handle::{Handle, Slots, StaleHandle};

/// A scene that owns its objects, as one array per property, and their assets. Everything can be added, changed and
/// removed between frames.
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
    /// The cameras; each has a view.
    pub cameras: Vec<Camera>,
    /// The lights.
    pub lights: Vec<Light>,
    /// Ambient radiance, linear, uniform in all directions: a surface with a diffuse reflectance of 1 has this
    /// radiance.
    pub ambient: Vec3,
    /// The radiance of the background, linear.
    pub background: Vec3,
    /// Objects that stand still together, and that views execute as a whole.
    pub static_groups: Vec<StaticGroup>,
    assets: Assets,
    /// The index of each object in the arrays below.
    indices: Slots<usize>,
    /// The handle of each object, by index.
    handles: Vec<Handle<usize>>,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
    layers: Vec<LayerMask>,
}

/// Refers to an object of a [`Scene`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ObjectHandle(Handle<usize>);

/// An object to draw (M 10.3's `RenderObject`): a transform, a mesh and a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderObject {
    /// The object's origin in the world, in metres.
    pub position: DVec3,
    /// The rotation from object space to the world; of unit length.
    pub orientation: Quat,
    /// The scale along the object's own axes, applied before the rotation.
    pub scale: Vec3,
    /// The mesh.
    pub mesh: Handle<Mesh>,
    /// The material.
    pub material: Handle<Material>,
    /// The layers that it belongs to.
    pub layers: LayerMask,
}

impl RenderObject {
    /// An object at `position`, without rotation and scale, in all layers.
    pub fn new(mesh: Handle<Mesh>, material: Handle<Material>, position: DVec3) -> Self {
        Self { position, orientation: Quat::IDENTITY, scale: Vec3::ONE, mesh, material, layers: LayerMask::ALL }
    }
}

impl Scene {
    /// An empty scene.
    pub fn new() -> Self {
        Self::default()
    }

    /// The scene as a frame reads it.
    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            layers: &self.layers,
            columns: &[],
            written: WrittenColumns::default(),
            changes: Changes::Unknown,
            static_groups: &self.static_groups,
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
    /// If its transform is not finite, its orientation is not of unit length, or a handle is stale.
    pub fn add_object(&mut self, object: RenderObject) -> Result<ObjectHandle, SceneError> {
        let index = self.positions.len();
        let bounds = self.check(&object, index)?;
        let handle = self.indices.insert(index);
        self.handles.push(handle);
        self.positions.push(object.position);
        self.orientations.push(object.orientation);
        self.scales.push(object.scale);
        self.bounds.push(bounds);
        self.meshes.push(object.mesh);
        self.materials.push(object.material);
        self.layers.push(object.layers);
        Ok(ObjectHandle(handle))
    }

    /// Replaces an object.
    ///
    /// # Errors
    /// As [`Scene::add_object`], and if the object has been removed. Nothing changes then.
    pub fn replace_object(&mut self, handle: ObjectHandle, object: RenderObject) -> Result<(), SceneError> {
        let index = self.index_of(handle)?;
        let bounds = self.check(&object, index)?;
        self.positions[index] = object.position;
        self.orientations[index] = object.orientation;
        self.scales[index] = object.scale;
        self.bounds[index] = bounds;
        self.meshes[index] = object.mesh;
        self.materials[index] = object.material;
        self.layers[index] = object.layers;
        Ok(())
    }

    /// Removes an object. The last object moves to its index, so an [`ObjectSet`] that names either is out of date.
    ///
    /// # Errors
    /// If the object has been removed already.
    pub fn remove_object(&mut self, handle: ObjectHandle) -> Result<RenderObject, StaleHandle> {
        let object = self.object(handle)?;
        let index = self.indices.remove(handle.0).map_err(as_object)?;
        self.handles.swap_remove(index);
        self.positions.swap_remove(index);
        self.orientations.swap_remove(index);
        self.scales.swap_remove(index);
        self.bounds.swap_remove(index);
        self.meshes.swap_remove(index);
        self.materials.swap_remove(index);
        self.layers.swap_remove(index);
        if let Some(&moved) = self.handles.get(index) {
            *self.indices.get_mut(moved).map_err(as_object)? = index;
        }
        Ok(object)
    }

    /// Returns an object.
    ///
    /// # Errors
    /// If the object has been removed.
    pub fn object(&self, handle: ObjectHandle) -> Result<RenderObject, StaleHandle> {
        let index = self.index_of(handle)?;
        Ok(RenderObject {
            position: self.positions[index],
            orientation: self.orientations[index],
            scale: self.scales[index],
            mesh: self.meshes[index],
            material: self.materials[index],
            layers: self.layers[index],
        })
    }

    /// Adds copies, so that each object is there `copies` times at the same position, as in L 6: more draws, the same
    /// picture. 0 and 1 change nothing.
    pub fn duplicate_objects(&mut self, copies: usize) {
        let originals = self.positions.len();
        for _ in 1..copies {
            for index in 0..originals {
                self.handles.push(self.indices.insert(self.positions.len()));
                self.positions.push(self.positions[index]);
            }
            self.orientations.extend_from_within(..originals);
            self.scales.extend_from_within(..originals);
            self.bounds.extend_from_within(..originals);
            self.meshes.extend_from_within(..originals);
            self.materials.extend_from_within(..originals);
            self.layers.extend_from_within(..originals);
        }
    }

    /// The number of objects.
    pub fn object_count(&self) -> usize {
        self.positions.len()
    }

    /// The handles of all objects, by index.
    pub fn objects(&self) -> impl Iterator<Item = ObjectHandle> {
        self.handles.iter().copied().map(ObjectHandle)
    }

    /// The set of some objects at their present indices, for an [`ViewFilter`](super::ViewFilter). Removing an
    /// object changes indices: make the set again then.
    ///
    /// ```
    /// # use drawloom::glam::DVec3;
    /// # use drawloom::scene::{Material, Mesh, RenderObject, Scene, Topology, Vertex};
    /// use drawloom::scene::{Camera, ViewFilter};
    ///
    /// # let mut scene = Scene::new();
    /// # let corner = |x, y| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
    /// # let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)];
    /// # let mesh = scene.add(Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])?)?;
    /// # let material = scene.add(Material::default())?;
    /// # let object = RenderObject::new(mesh, material, DVec3::ZERO);
    /// let statue = scene.add_object(object)?;
    /// let portrait = Camera::looking_at("portrait", DVec3::Z * 3.0, DVec3::ZERO);
    /// let filter = ViewFilter::only(scene.object_set([statue])?);
    /// scene.cameras.push(Camera { filter, ..portrait });
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// If an object has been removed.
    pub fn object_set(&self, objects: impl IntoIterator<Item = ObjectHandle>) -> Result<ObjectSet, StaleHandle> {
        // A scene of more objects than indices makes no frame.
        objects.into_iter().map(|handle| self.index_of(handle).map(|index| index as u32)).collect()
    }

    /// Meshes, materials and textures.
    pub fn assets(&self) -> &Assets {
        &self.assets
    }

    /// See [`Assets::add`].
    ///
    /// # Errors
    /// If the asset is invalid, or refers to an asset that is not in this scene.
    pub fn add<T: Asset>(&mut self, asset: T) -> Result<Handle<T>, SceneError> {
        self.assets.add(asset)
    }

    /// See [`Assets::replace`].
    ///
    /// # Errors
    /// If the handle is stale or the new asset is invalid. Nothing changes then.
    pub fn replace<T: Asset>(&mut self, handle: Handle<T>, asset: T) -> Result<(), SceneError> {
        let meshes_before = self.assets.meshes.revision();
        self.assets.replace(handle, asset)?;
        if self.assets.meshes.revision() != meshes_before {
            // The asset is a mesh, and the bounds of its objects are copies.
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

    /// Adds what a loader has loaded since the last call, and sets the bounds of the objects whose meshes arrived. See
    /// [`Assets::receive`].
    pub fn receive(&mut self, loader: &AssetLoader) -> Arrivals {
        let arrivals = self.assets.receive(loader);
        if !arrivals.meshes.is_empty() {
            let arrived: HashSet<_> = arrivals.meshes.iter().copied().collect();
            for (mesh, bounds) in self.meshes.iter().zip(&mut self.bounds).filter(|(mesh, _)| arrived.contains(mesh)) {
                if let Ok(mesh) = self.assets.get(*mesh) {
                    *bounds = mesh.bounds();
                }
            }
        }
        arrivals
    }

    /// See [`Assets::unload`].
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn unload<T: Asset>(&mut self, handle: Handle<T>) -> Result<Option<T>, StaleHandle> {
        self.assets.unload(handle)
    }

    /// See [`Assets::set_priority`].
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn set_priority<T: Asset>(&mut self, handle: Handle<T>, priority: i32) -> Result<(), StaleHandle> {
        self.assets.set_priority(handle, priority)
    }

    /// See [`Assets::remove`].
    ///
    /// # Errors
    /// If the handle is stale.
    pub fn remove<T: Asset>(&mut self, handle: Handle<T>) -> Result<T, StaleHandle> {
        self.assets.remove(handle)
    }

    fn index_of(&self, handle: ObjectHandle) -> Result<usize, StaleHandle> {
        self.indices.get(handle.0).copied().map_err(as_object)
    }

    fn check(&self, object: &RenderObject, index: usize) -> Result<Bounds, SceneError> {
        if !transform_is_valid(object.position, object.orientation, object.scale) {
            return Err(SceneError::InvalidTransform { object: index });
        }
        if !self.assets.is_pending(object.material) {
            self.assets.get(object.material)?;
        }
        // The bounds of a mesh that has not arrived are set when it arrives.
        let is_pending = self.assets.is_pending(object.mesh);
        Ok(if is_pending { Bounds::default() } else { self.assets.get(object.mesh)?.bounds() })
    }
}

fn as_object(stale: StaleHandle) -> StaleHandle {
    StaleHandle { kind: "RenderObject", ..stale }
}

#[cfg(test)]
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
        let object = |number| RenderObject::new(mesh, material, DVec3::X * number as f64);
        let handles = (0..count).map(|number| scene.add_object(object(number)).unwrap()).collect();
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
    fn a_set_of_objects_has_their_present_indices() {
        let (mut scene, handles) = scene_of(4);
        let set = |scene: &Scene, objects: &[usize]| scene.object_set(objects.iter().map(|object| handles[*object]));
        assert_eq!(set(&scene, &[3, 1]), Ok(ObjectSet::new([1, 3])));
        scene.remove_object(handles[1]).unwrap();
        assert_eq!(set(&scene, &[3, 0]), Ok(ObjectSet::new([0, 1])), "the last object moved");
        assert_eq!(set(&scene, &[3, 1]).unwrap_err().kind, "RenderObject");
        assert_eq!(set(&scene, &[]), Ok(ObjectSet::default()));
    }

    #[test]
    fn an_invalid_transform_is_an_error() {
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
    fn replacing_a_mesh_updates_the_bounds_of_its_objects() {
        let (mut scene, handles) = scene_of(2);
        let mesh = scene.object(handles[0]).unwrap().mesh;
        let before = scene.as_scene_ref().bounds[1].radius;
        scene.replace(mesh, triangle(10.0)).unwrap();
        assert!(scene.as_scene_ref().bounds[1].radius > before * 9.0);
    }

    #[test]
    fn duplicates_have_the_transforms_of_their_originals() {
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
