//! Characters whose vertices the engine moves: a morph target of each, then joints. They cast the shadows of their
//! poses.

use std::f32::consts::TAU;
use std::sync::Arc;

use drawloom::glam::{DVec3, Mat4, Quat, Vec2, Vec3};
use drawloom::process::{Declare, Deformation, ShaderResource};
use drawloom::scene::{
    Bounds, Camera, ColumnValues, LayerMask, Light, Material, Mesh, ObjectColumn, RenderObject, Scene, SceneError,
    SceneRef, Topology, Vertex, VertexAttribute,
};
use parking_lot::Mutex;

use crate::outline;

/// The two joints that move a vertex.
const JOINTS: VertexAttribute<[u32; 2]> = VertexAttribute::new("joints");
/// How much the second of them does.
const WEIGHT: VertexAttribute<f32> = VertexAttribute::new("weight");
/// Where a vertex is if its character is as stout as can be, from where it is otherwise.
const STOUT: VertexAttribute<[f32; 3]> = VertexAttribute::new("stout");

/// The index of a character's first joint, and how stout it is, from 0 to 1.
const CHARACTER: ObjectColumn<Character> = ObjectColumn::new("character");

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Character {
    first_joint: u32,
    stoutness: f32,
}

/// The layer of the characters.
const LAYER: LayerMask = LayerMask::layer(2);

/// Morphs and skins the characters, in every process of the pipeline.
#[derive(Default)]
pub struct Characters {
    /// From the shape of the mesh to that of the pose: the joints of all characters.
    palette: Mutex<Arc<[u8]>>,
}

impl Deformation for Characters {
    fn name(&self) -> &str {
        "characters"
    }

    fn layers(&self) -> LayerMask {
        LAYER
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads_column(CHARACTER);
        declare.reads_attribute(JOINTS, [0; 2]);
        declare.reads_attribute(WEIGHT, 0.0);
        declare.reads_attribute(STOUT, [0.0; 3]);
    }

    fn shader(&self) -> &str {
        include_str!("characters.wgsl")
    }

    fn resources(&self) -> Vec<ShaderResource<'_>> {
        vec![ShaderResource::SharedBytes(Arc::clone(&self.palette.lock()))]
    }
}

/// A joint: its parent, and where it is in the mesh.
const SKELETON: [(Option<usize>, Vec3); 9] = [
    (None, Vec3::new(0.0, 1.0, 0.0)),
    (Some(HIPS), Vec3::new(0.22, 1.5, 0.0)),
    (Some(1), Vec3::new(0.5, 1.2, 0.0)),
    (Some(HIPS), Vec3::new(-0.22, 1.5, 0.0)),
    (Some(3), Vec3::new(-0.5, 1.2, 0.0)),
    (Some(HIPS), Vec3::new(0.13, 0.95, 0.0)),
    (Some(5), Vec3::new(0.15, 0.5, 0.0)),
    (Some(HIPS), Vec3::new(-0.13, 0.95, 0.0)),
    (Some(7), Vec3::new(-0.15, 0.5, 0.0)),
];
const HIPS: usize = 0;

/// A part of the body, round at both ends.
struct Part {
    /// The joints of its first and its second half.
    joints: [u32; 2],
    ends: [Vec3; 2],
    /// At both ends.
    radii: [f32; 2],
    /// How much wider it is if the character is stout.
    wider: f32,
}

const BODY: [Part; 6] = [
    part([0, 0], [[0.0, 0.9, 0.0], [0.0, 1.6, 0.0]], [0.19, 0.25], 0.22),
    part([0, 0], [[0.0, 1.66, 0.0], [0.0, 2.02, 0.0]], [0.17, 0.17], 0.03),
    part([1, 2], [[0.22, 1.5, 0.0], [0.78, 0.9, 0.0]], [0.09, 0.07], 0.04),
    part([3, 4], [[-0.22, 1.5, 0.0], [-0.78, 0.9, 0.0]], [0.09, 0.07], 0.04),
    part([5, 6], [[0.13, 0.95, 0.0], [0.17, 0.08, 0.0]], [0.12, 0.08], 0.06),
    part([7, 8], [[-0.13, 0.95, 0.0], [-0.17, 0.08, 0.0]], [0.12, 0.08], 0.06),
];

const fn part(joints: [u32; 2], [from, to]: [[f32; 3]; 2], radii: [f32; 2], wider: f32) -> Part {
    Part { joints, ends: [Vec3::from_array(from), Vec3::from_array(to)], radii, wider }
}

/// A character in the pose in which its joints are where [`SKELETON`] has them.
fn body() -> Result<Mesh, SceneError> {
    const AROUND: u32 = 16;
    const ALONG: u32 = 20;
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    let (mut joints, mut weights, mut stout) = (Vec::new(), Vec::new(), Vec::new());
    for Part { joints: of_part, ends: [from, to], radii: [first_radius, last_radius], wider } in BODY {
        let first = vertices.len() as u32;
        let turn = Quat::from_rotation_arc(Vec3::Y, (to - from).normalize());
        for along in 0..=ALONG {
            // Around a half circle at each end.
            let angle = (along as f32 / ALONG as f32 - 0.5) * TAU / 2.0;
            let (t, radius) = (0.5 + 0.5 * angle.sin(), angle.cos().max(0.0).powf(0.6));
            for around in 0..=AROUND {
                let across = Vec2::from_angle(around as f32 / AROUND as f32 * TAU);
                let outward = turn * Vec3::new(across.x, 0.0, -across.y);
                let normal = (outward * radius + turn * Vec3::Y * angle.sin().powi(7)).normalize();
                let position = from.lerp(to, t) + outward * radius * (first_radius + (last_radius - first_radius) * t);
                let uv = [around as f32 / AROUND as f32, t];
                vertices.push(Vertex { position: position.to_array(), normal: normal.to_array(), uv });
                joints.push(of_part);
                weights.push(((t - 0.5) * 5.0 + 0.5).clamp(0.0, 1.0));
                stout.push((outward * radius * wider * (1.0 - (2.0 * t - 0.7).powi(2) * 0.5)).to_array());
                if along < ALONG && around < AROUND {
                    let here = first + along * (AROUND + 1) + around;
                    let above = here + AROUND + 1;
                    indices.extend([here, here + 1, above + 1, here, above + 1, above]);
                }
            }
        }
    }
    let mesh = Mesh::new("body", Topology::TriangleList, vertices, indices)?;
    mesh.with_attribute(JOINTS, &joints)?.with_attribute(WEIGHT, &weights)?.with_attribute(STOUT, &stout)
}

/// How each joint is turned at a moment of a walk, in turns: about its own place, relative to its parent.
fn pose(moment: f32) -> [Quat; SKELETON.len()] {
    let swing = (moment * TAU).sin();
    let bent = |swing: f32| Quat::from_rotation_x(-0.6 + 0.5 * swing.min(0.0));
    let leg = |swing: f32| Quat::from_rotation_x(-0.6 * swing);
    let knee = |phase: f32| Quat::from_rotation_x(0.15 + 0.8 * ((moment + phase) * TAU).cos().max(0.0));
    [
        Quat::from_rotation_y(0.15 * swing),
        Quat::from_rotation_x(0.7 * swing),
        bent(-swing),
        Quat::from_rotation_x(-0.7 * swing),
        bent(swing),
        leg(swing),
        knee(0.0),
        leg(-swing),
        knee(0.5),
    ]
}

/// The joints of a pose, each from the mesh's shape to that of the pose.
fn joints(turns: [Quat; SKELETON.len()]) -> [Mat4; SKELETON.len()] {
    let mut joints = [Mat4::IDENTITY; SKELETON.len()];
    for (joint, ((parent, at), turn)) in SKELETON.into_iter().zip(turns).enumerate() {
        // Parents come before their children.
        let parent = parent.map_or(Mat4::IDENTITY, |parent| joints[parent]);
        joints[joint] = parent * Mat4::from_translation(at) * Mat4::from_quat(turn) * Mat4::from_translation(-at);
    }
    joints
}

/// Characters that walk over a plain, each at a moment of its own.
pub struct Crowd {
    scene: Scene,
    columns: Vec<Character>,
    bounds: Vec<Bounds>,
    characters: Arc<Characters>,
}

impl Crowd {
    pub fn new(characters: Arc<Characters>, size: [u32; 2]) -> Result<Self, SceneError> {
        const COLUMNS: usize = 9;
        const ROWS: usize = 6;
        let mut scene = Scene::new();
        let camera = Camera::looking_at("main", DVec3::new(0.0, 4.2, 10.5), DVec3::new(0.0, 0.7, 0.0));
        scene.cameras = vec![Camera { size, ..camera }];
        scene.lights = vec![Light::Directional {
            direction: Vec3::new(-0.5, -0.7, -0.5).normalize(),
            illuminance: Vec3::splat(2.6),
            casts_shadow: true,
        }];
        scene.ambient = Vec3::new(0.12, 0.14, 0.18);
        scene.background = Vec3::new(0.05, 0.09, 0.16);
        let body = scene.add(body()?)?;
        let (mut columns, mut bounds) = (Vec::new(), Vec::new());
        for index in 0..COLUMNS * ROWS {
            let (column, row) = (index % COLUMNS, index / COLUMNS);
            let shade = index as f32 * 0.37 % 1.0;
            let diffuse = Vec3::new(0.35 + 0.5 * shade, 0.5 - 0.25 * shade, 0.75 - 0.5 * shade);
            let material = scene.add(Material { name: format!("skin {index}"), diffuse, ..Material::default() })?;
            let position = DVec3::new(column as f64 * 1.7 - 6.8, 0.0, row as f64 * -2.2 + 4.0);
            let is_selected = column == COLUMNS / 2 && row == 1;
            let layers = if is_selected { LAYER | outline::LAYER } else { LAYER };
            scene.add_object(RenderObject { layers, ..RenderObject::new(body, material, position) })?;
            let first_joint = (index * SKELETON.len()) as u32;
            columns.push(Character { first_joint, stoutness: column as f32 / (COLUMNS - 1) as f32 });
            // Of all poses.
            bounds.push(Bounds::around([Vec3::new(-1.1, -0.1, -1.2), Vec3::new(1.1, 2.3, 1.2)].into_iter()));
        }
        let plain = scene.add(plain()?)?;
        let grass = Material { name: "grass".into(), diffuse: Vec3::new(0.3, 0.34, 0.24), ..Material::default() };
        let grass = scene.add(grass)?;
        scene
            .add_object(RenderObject { layers: LayerMask::layer(0), ..RenderObject::new(plain, grass, DVec3::ZERO) })?;
        columns.push(Character { first_joint: 0, stoutness: 0.0 });
        bounds.push(Bounds::around([Vec3::new(-40.0, 0.0, -40.0), Vec3::new(40.0, 0.0, 40.0)].into_iter()));
        let mut crowd = Self { scene, columns, bounds, characters };
        crowd.walk_to(0.0);
        Ok(crowd)
    }

    /// Poses all characters for a time in seconds.
    pub fn walk_to(&mut self, time: f32) {
        let characters = &self.columns[..self.columns.len() - 1];
        let moment = |index: usize| time * 0.9 + index as f32 * 0.23;
        let palette: Vec<_> = (0..characters.len()).flat_map(|index| joints(pose(moment(index)))).collect();
        *self.characters.palette.lock() = bytemuck::cast_slice(&palette).into();
    }

    /// The engine's own data of objects.
    pub fn columns(&self) -> [ColumnValues<'_>; 1] {
        [CHARACTER.values(&self.columns)]
    }

    pub fn as_scene_ref<'a>(&'a self, columns: &'a [ColumnValues<'a>]) -> SceneRef<'a> {
        SceneRef { columns, bounds: &self.bounds, ..self.scene.as_scene_ref() }
    }
}

fn plain() -> Result<Mesh, SceneError> {
    let corners = [[-40.0, 40.0], [40.0, 40.0], [40.0, -40.0], [-40.0, -40.0]];
    let vertex = |[x, z]: [f32; 2]| Vertex { position: [x, 0.0, z], normal: [0.0, 1.0, 0.0], uv: [x, z] };
    Mesh::new("plain", Topology::TriangleList, corners.map(vertex).to_vec(), vec![0, 1, 2, 0, 2, 3])
}
