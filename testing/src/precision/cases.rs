//! Random vertices of rotated and scaled objects anywhere in the world, at least as far from the camera as they are
//! large.

use std::f64::consts::TAU;

use drawloom::glam::{DQuat, DVec3, Quat, Vec3};
use drawloom::scene::{
    Camera, Light, Material, Mesh, Projection, RenderObject, Scene, SceneError, SceneRef, Topology, Vertex,
};
use drawloom::view::ShadowMaps;
use drawloom::view::internal::{GpuObject, ObjectTable};

use super::vertex::Case;
use crate::random::Random;

/// The kinds of views.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A main camera's, with the vertical field of view in degrees and the picture size in pixels.
    Perspective { degrees: f64, size: [u32; 2] },
    /// A main camera's orthographic view, as deep as `heights` times its height.
    Orthographic { heights: f64 },
    /// A spot light's shadow map, with the outer angle in degrees.
    Spot { degrees: f64 },
    /// A directional light's shadow map, around what a main camera sees up to `reach` metres.
    Directional { reach: f32 },
    /// A hemispherical light's shadow map.
    Hemispherical,
}

impl Kind {
    pub const FULL_HD: [u32; 2] = [1920, 1080];

    /// Its name in tables.
    pub fn name(self) -> String {
        match self {
            Self::Perspective { degrees, size: [width, height] } => format!("perspective {degrees}°, {width}x{height}"),
            Self::Orthographic { heights } => format!("orthographic, {heights} heights deep"),
            Self::Spot { degrees } => format!("shadow map, spot {degrees}°"),
            Self::Directional { reach } => format!("shadow map, directional, {reach} m"),
            Self::Hemispherical => "shadow map, hemispherical".to_owned(),
        }
    }

    /// A camera of this kind at `position`, with a random orientation.
    pub fn camera(self, position: DVec3, random: &mut Random) -> Camera {
        let orientation = rotation(random);
        let main = Camera { orientation, ..Camera::looking_at("main", position, position + DVec3::X) };
        let direction = random.direction().as_vec3().normalize();
        let (intensity, range, casts_shadow) = (Vec3::ONE, 1e5, true);
        let maps = ShadowMaps::default();
        let map_camera =
            |maps: ShadowMaps, light: Light, cameras: &[Camera]| maps.cameras("map", &light, cameras).swap_remove(0);
        match self {
            Self::Perspective { degrees, size } => {
                let field_of_view = degrees.to_radians() as f32;
                Camera { projection: Projection::Perspective { field_of_view }, size, ..main }
            }
            Self::Orthographic { heights } => {
                let height = log_between(random, 0.1, 1e4);
                let projection = Projection::Orthographic { height: height as f32 };
                Camera { projection, far: (heights * height) as f32, near: 0.01, size: Self::FULL_HD, ..main }
            }
            Self::Spot { degrees } => {
                let (inner_angle, outer_angle) = (0.0, degrees.to_radians() as f32);
                let light =
                    Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow };
                map_camera(maps, light, &[])
            }
            Self::Directional { reach } => {
                let light = Light::Directional { direction, illuminance: intensity, casts_shadow };
                map_camera(ShadowMaps { max_distance: reach, ..maps }, light, &[main])
            }
            Self::Hemispherical => {
                let light = Light::Hemispherical { position, direction, intensity, range, casts_shadow };
                map_camera(maps, light, &[])
            }
        }
    }
}

/// A vertex that `camera` sees, of a mesh that is at least as far from it as the mesh's radius around its own origin.
pub fn vertex_of(camera: Camera, random: &mut Random) -> Case {
    let (relative, distance) = visible_point(&camera, random);
    // In one case of four the camera is at the mesh's edge, where the error is greatest.
    let radius = if random.below(4) == 0 { distance } else { distance * log_between(random, 1e-4, 1.0) };
    let orientation = rotation(random);
    let scale = Vec3::from_array([(); 3].map(|()| log_between(random, 1e-2, 1e2) as f32));
    // On the outside of the mesh, in object space.
    let outside = random.direction() * radius * 0.999;
    let vertex = (outside / scale.as_dvec3()).as_vec3();
    let turned = orientation.as_dquat().normalize() * (scale.as_dvec3() * vertex.as_dvec3());
    let position = camera.position + (relative - turned);
    Case { camera, position, orientation, scale, vertex }
}

/// A random point in the picture, relative to the camera, and the distance that limits the mesh's radius. For
/// orthographic views the limit is the size of the mesh in the picture.
fn visible_point(camera: &Camera, random: &mut Random) -> (DVec3, f64) {
    let (x, y) = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
    let turn = camera.orientation.as_dquat().normalize();
    match camera.projection {
        Projection::Perspective { field_of_view } => {
            let tangent = (f64::from(field_of_view) * 0.5).tan();
            let local = DVec3::new(x * tangent * aspect, y * tangent, -1.0);
            let near = f64::from(camera.near).max(0.1);
            let distance = log_between(random, near, near * 1e6);
            (turn * local * distance, distance * local.length())
        }
        Projection::Orthographic { height } => {
            let half = f64::from(height) * 0.5;
            let depth = random.between(f64::from(camera.near), f64::from(camera.far));
            (turn * DVec3::new(x * half * aspect, y * half, -depth), f64::from(height).min(depth))
        }
        _ => {
            let distance = log_between(random, 1.0, 1e4);
            let axis = random.direction();
            (turn * DVec3::new(axis.x, axis.y, -axis.z.abs()) * distance, distance)
        }
    }
}

/// Computes objects' GPU layouts with an object table.
pub struct GpuObjects {
    scene: Scene,
    table: ObjectTable,
    object: RenderObject,
}

impl GpuObjects {
    pub fn new() -> Result<Self, SceneError> {
        let mut scene = Scene::new();
        let corner = |x, y| Vertex { position: [x, y, 0.0], ..Vertex::default() };
        let corners = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
        let mesh = scene.add(Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])?)?;
        let material = scene.add(Material::default())?;
        let object = RenderObject::new(mesh, material, DVec3::ZERO);
        Ok(Self { scene, table: ObjectTable::default(), object })
    }

    /// Calls `visit` with each case and its object's GPU layout.
    ///
    /// # Errors
    /// Returns an error if the scene rejects an object.
    pub fn visit<'a>(
        &mut self,
        cases: &'a [Case],
        mut visit: impl FnMut(&'a Case, &GpuObject),
    ) -> Result<(), SceneError> {
        let handles: Vec<_> = self.scene.objects().collect();
        for (index, case) in cases.iter().enumerate() {
            let Case { position, orientation, scale, .. } = *case;
            let object = RenderObject { position, orientation, scale, ..self.object };
            match handles.get(index) {
                Some(&handle) => self.scene.replace_object(handle, object)?,
                None => drop(self.scene.add_object(object)?),
            }
        }
        let scene = self.scene.as_scene_ref();
        let count = cases.len();
        // Objects of earlier, longer cases stay in the scene.
        self.table.update(&SceneRef {
            positions: &scene.positions[..count],
            orientations: &scene.orientations[..count],
            scales: &scene.scales[..count],
            bounds: &scene.bounds[..count],
            meshes: &scene.meshes[..count],
            materials: &scene.materials[..count],
            layers: &[],
            columns: &[],
            ..scene
        });
        assert!(self.table.scene_issues().list().is_empty(), "an object was left out");
        for block in 0..self.table.block_count() {
            let (first, gpu_objects) = self.table.gpu_objects(block);
            for (index, gpu_object) in gpu_objects.iter().enumerate() {
                visit(&cases[first + index], gpu_object);
            }
        }
        Ok(())
    }
}

/// A log-uniform number.
pub fn log_between(random: &mut Random, low: f64, high: f64) -> f64 {
    random.between(low.ln(), high.ln()).exp()
}

/// Uniform over all rotations (Shoemake 1992).
fn rotation(random: &mut Random) -> Quat {
    let (share, one, other) = (random.between(0.0, 1.0), random.between(0.0, TAU), random.between(0.0, TAU));
    let (a, b) = ((1.0 - share).sqrt(), share.sqrt());
    DQuat::from_xyzw(a * one.sin(), a * one.cos(), b * other.sin(), b * other.cos()).as_quat()
}
