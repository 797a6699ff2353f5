//! What all worlds of Drawloom have: assets, cameras and the light.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Assets, Bounds, Camera, Changes, Light, Material, Mesh, Projection, SceneError, SceneRef, WrittenColumns,
};

use crate::layout::{self, Layout};

/// Everything but the objects.
pub struct Surroundings {
    pub assets: Assets,
    pub meshes: Vec<Handle<Mesh>>,
    pub materials: Vec<Handle<Material>>,
    /// The bounds of every mesh.
    pub bounds: Bounds,
    lights: Vec<Light>,
    cameras: Vec<Camera>,
}

impl Surroundings {
    pub fn new(layout: &Layout) -> Result<Self, SceneError> {
        let mut assets = Assets::default();
        let cube = |index: usize| Mesh::cuboid(format!("cube {index}"), Vec3::ONE);
        let bounds = cube(0)?.bounds();
        let meshes = (0..layout::MESHES).map(|index| assets.add(cube(index)?)).collect::<Result<_, _>>()?;
        let paint = |(index, &diffuse): (usize, &[f32; 3])| Material {
            name: format!("paint {index}"),
            diffuse: Vec3::from_array(diffuse),
            ..Material::default()
        };
        let materials =
            layout::MATERIALS.iter().enumerate().map(|each| assets.add(paint(each))).collect::<Result<_, _>>()?;
        let light = Light::Directional {
            direction: Vec3::from_array(layout::LIGHT).normalize(),
            illuminance: Vec3::splat(3.0),
            casts_shadow: false,
        };
        let camera = |(index, position)| Camera {
            projection: Projection::Perspective { field_of_view: layout::FIELD_OF_VIEW },
            near: layout::NEAR,
            size: [layout.picture; 2],
            ..Camera::looking_at(format!("camera {index}"), DVec3::from_array(position), DVec3::ZERO)
        };
        let cameras = layout.cameras().enumerate().map(camera).collect();
        Ok(Self { assets, meshes, materials, bounds, lights: vec![light], cameras })
    }

    /// Turns the cameras.
    pub fn turn(&mut self, frame: u32) {
        let turn = Quat::from_rotation_y(layout::angle(frame));
        self.cameras.iter_mut().for_each(|camera| camera.orientation = turn * camera.orientation);
    }

    /// A scene without objects. All objects may have changed.
    pub fn as_scene_ref(&self) -> SceneRef<'_> {
        SceneRef {
            positions: &[],
            orientations: &[],
            scales: &[],
            bounds: &[],
            meshes: &[],
            materials: &[],
            layers: &[],
            columns: &[],
            written: WrittenColumns::default(),
            changes: Changes::Unknown,
            static_groups: &[],
            assets: &self.assets,
            lights: &self.lights,
            cameras: &self.cameras,
            ambient: Vec3::splat(0.1),
            background: Vec3::ZERO,
        }
    }
}
