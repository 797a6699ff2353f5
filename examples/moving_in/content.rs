//! What the engine draws: a field of objects around a pool, their meshes, and the texels of their materials.

use std::f32::consts::TAU;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use wgpu::util::DeviceExt;

use super::engine::{LEAF_MATERIALS, MAIN, MATERIALS, MIRROR, Mesh, OBJECTS_PER_MOVING, Object, SHADOW, Shading};

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: [f32; 2],
}

/// Half of the width of the pool.
const POOL: f32 = 9.0;

/// Bricks of a hue, or a round leaf.
pub fn color_texel(material: usize, shading: Shading, x: usize, y: usize) -> [u8; 4] {
    let hue = material as f32 / MATERIALS as f32 * TAU;
    let channel = |phase: f32| 150.0 + 80.0 * (hue + phase).cos();
    let is_joint = y.is_multiple_of(8) || (x + y / 8 * 8).is_multiple_of(16);
    let shade = if is_joint { 0.5 } else { 0.9 + (hash(y * 16 + x) % 100) as f32 * 0.001 };
    let is_hole = shading == Shading::Leaf && x.abs_diff(8).pow(2) + y.abs_diff(8).pow(2) > 50;
    let [r, g, b] = [0.0, 2.1, 4.2].map(|phase| (channel(phase) * shade) as u8);
    [r, g, b, if is_hole { 0 } else { 255 }]
}

pub fn hash(value: usize) -> usize {
    let mixed = (value as u32 ^ 0x9E37).wrapping_mul(0x85EB_CA6B);
    ((mixed ^ mixed >> 13).wrapping_mul(0xC2B2_AE35) >> 8) as usize
}

/// A field of this many by this many objects around a pool, and the ground below them. The first ones move.
pub fn create_objects(side: usize) -> Vec<Object> {
    let object = |index: usize| {
        // Neighbours in the field are not neighbours in the list.
        let (place, material) = (index * 7919 % (side * side), hash(index) % MATERIALS);
        let at = |step: usize| (step as f32 - (side - 1) as f32 * 0.5) * 2.0;
        let is_leaf = LEAF_MATERIALS.contains(&material);
        let tint = [1, 2, 3].map(|channel| 0.6 + (hash(index * 3 + channel) % 40) as f32 * 0.01);
        Object {
            mesh: if is_leaf { 2 } else { hash(index + 7) % 2 },
            material,
            views: 1 << SHADOW | 1 << MIRROR | 1 << MAIN,
            position: Vec3::new(at(place % side), 0.6, at(place / side)),
            scale: Vec3::new(0.5, 0.5 + (hash(index + 1) % 10) as f32 * 0.1, 0.5),
            tint: Vec3::from(tint),
        }
    };
    let flat = |material, views, height, scale: f32| Object {
        mesh: 3,
        material,
        views,
        position: Vec3::Y * height,
        scale: Vec3::new(scale, 1.0, scale),
        tint: Vec3::ONE,
    };
    let is_above_water = |index: usize| index < side * side / OBJECTS_PER_MOVING;
    let is_outside = |object: &Object| object.position.abs().max_element() > POOL + 1.0;
    let all = (0..side * side).map(|index| (index, object(index)));
    let mut objects: Vec<_> =
        all.filter(|(index, object)| is_above_water(*index) || is_outside(object)).map(|(_, object)| object).collect();
    objects.push(flat(0, 1 << SHADOW | 1 << MAIN, -0.3, side as f32 * 1.2));
    // The mirror does not show itself.
    objects.push(flat(MATERIALS, 1 << MAIN, 0.0, POOL));
    objects
}

/// The meshes, which objects name by index.
pub fn create_meshes(device: &wgpu::Device) -> Vec<Mesh> {
    let quads = [cuboid(), pyramid(), plant(), vec![quad(Vec3::ZERO, Vec3::Z, Vec3::X)]];
    quads.iter().map(|quads| create_mesh(device, quads)).collect()
}

/// A quadrilateral around `center`, which faces where `right` × `up` points.
fn quad(center: Vec3, right: Vec3, up: Vec3) -> [Vec3; 4] {
    [center - right - up, center + right - up, center + right + up, center - right + up]
}

fn cuboid() -> Vec<[Vec3; 4]> {
    let axes = [(Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X), (Vec3::X, Vec3::Y)];
    axes.into_iter().flat_map(|(u, v)| [quad(u.cross(v), u, v), quad(v.cross(u), v, u)]).collect()
}

fn pyramid() -> Vec<[Vec3; 4]> {
    let side = |out: Vec3| {
        let right = Vec3::Y.cross(out);
        [out - right - Vec3::Y, out + right - Vec3::Y, Vec3::Y, Vec3::Y]
    };
    [Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z].map(side).to_vec()
}

fn plant() -> Vec<[Vec3; 4]> {
    [Vec3::X, Vec3::Z].map(|right| quad(Vec3::ZERO, right, Vec3::Y)).to_vec()
}

pub fn create_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texel: impl Fn(usize, usize) -> [u8; 4],
) -> wgpu::Texture {
    let texels: Vec<_> = (0..16 * 16).flat_map(|index| texel(index % 16, index / 16)).collect();
    let descriptor = wgpu::TextureDescriptor {
        label: Some("material"),
        size: wgpu::Extent3d { width: 16, height: 16, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    device.create_texture_with_data(queue, &descriptor, wgpu::util::TextureDataOrder::LayerMajor, &texels)
}

/// A mesh of quadrilaterals whose corners go round counterclockwise.
fn create_mesh(device: &wgpu::Device, quads: &[[Vec3; 4]]) -> Mesh {
    let corner_uvs = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let mut vertices = Vec::new();
    for [a, b, c, d] in quads {
        let normal = (b - a).cross(c - a).normalize();
        vertices.extend([a, b, c, d].iter().zip(corner_uvs).map(|(&&position, uv)| Vertex { position, normal, uv }));
    }
    let indices: Vec<_> = (0..quads.len() as u16).flat_map(|quad| [0, 1, 2, 0, 2, 3].map(|at| quad * 4 + at)).collect();
    let buffer = |contents, usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some("mesh"), contents, usage })
    };
    Mesh {
        vertices: buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX),
        indices: buffer(bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX),
        index_count: indices.len() as u32,
    }
}
