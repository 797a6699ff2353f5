//! The world that the engine draws: a field of props and plants around a pool, their meshes, and the texels of their
//! materials.

use std::f32::consts::TAU;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{Quat, Vec3};
use wgpu::util::DeviceExt;

use super::drawables::{ALL_VIEWS, Drawable, Floater, Prop, Thicket};
use super::engine::{MAIN, MIRROR, Shading};
use super::resources::Mesh;

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: [f32; 2],
}

// Meshes, by index.
const CUBOID: usize = 0;
const PYRAMID: usize = 1;
const CROSS: usize = 2;
const STAR: usize = 3;
const PLANE: usize = 4;

// Materials, by index: first stone of many hues, then leaves, then the pool's mirror.
const LEAF_MATERIALS: Range<usize> = 56..64;
pub const MIRROR_MATERIAL: usize = LEAF_MATERIALS.end;

/// Half of the width of the pool.
const POOL: f32 = 9.0;
/// One of this many places in the field has a floater.
const PLACES_PER_FLOATER: usize = 8;

pub fn shading(material: usize) -> Shading {
    match material {
        MIRROR_MATERIAL => Shading::Mirror,
        _ if LEAF_MATERIALS.contains(&material) => Shading::Leaf,
        _ => Shading::Surface,
    }
}

/// Bricks of a hue, or a round leaf.
pub fn color_texel(material: usize, x: usize, y: usize) -> [u8; 4] {
    let is_leaf = LEAF_MATERIALS.contains(&material);
    // All leaves are green.
    let hue = if is_leaf { 3.8 + (material % 8) as f32 * 0.1 } else { material as f32 / MIRROR_MATERIAL as f32 * TAU };
    let is_joint = !is_leaf && (y.is_multiple_of(8) || (x + y / 8 * 8).is_multiple_of(16));
    let shade = if is_joint { 0.5 } else { 0.9 + (hash(y * 16 + x) % 100) as f32 * 0.001 };
    let is_hole = is_leaf && x.abs_diff(8).pow(2) + y.abs_diff(8).pow(2) > 50;
    let [r, g, b] = [0.0, 2.1, 4.2].map(|phase: f32| ((150.0 + 80.0 * (hue + phase).cos()) * shade) as u8);
    [r, g, b, if is_hole { 0 } else { 255 }]
}

/// An offset of the normal.
pub fn detail_texel(material: usize, x: usize, y: usize) -> [u8; 4] {
    let [across, along] = [x, y].map(|at| 128 + (hash(at * 16 + material) % 64) as u8 - 32);
    [across, along, 128, 255]
}

pub fn gloss_texel(material: usize, x: usize, y: usize) -> [u8; 4] {
    [(hash(material * 31 + y * 16 + x) % 160) as u8; 4]
}

fn hash(value: usize) -> usize {
    let mixed = (value as u32 ^ 0x9E37).wrapping_mul(0x85EB_CA6B);
    ((mixed ^ mixed >> 13).wrapping_mul(0xC2B2_AE35) >> 8) as usize
}

/// A square field of `side` by `side` places around the pool, and the ground below it. Also returns the number of
/// drawables that move, which come first.
pub fn create_drawables(side: usize) -> (Vec<Box<dyn Drawable>>, usize) {
    // Neighbours in the field are not neighbours in the list.
    let place = |index: usize| {
        let place = index * 7919 % (side * side);
        let [x, z] = [place % side, place / side].map(|step| (step as f32 - (side - 1) as f32 * 0.5) * 2.0);
        Vec3::new(x, 0.6, z)
    };
    let moving = side * side / PLACES_PER_FLOATER;
    let floaters = (0..moving).map(|index| {
        let prop = create_prop(index, hash(index) % LEAF_MATERIALS.start, place(index));
        Box::new(Floater { prop, start: prop.position, phase: index as f32 }) as Box<dyn Drawable>
    });
    let is_outside_pool = |index: &usize| place(*index).abs().max_element() > POOL + 1.0;
    let standing = (moving..side * side).filter(is_outside_pool).map(|index| {
        let material = hash(index) % LEAF_MATERIALS.end;
        if LEAF_MATERIALS.contains(&material) {
            Box::new(create_thicket(index, material, place(index))) as Box<dyn Drawable>
        } else {
            Box::new(create_prop(index, material, place(index)))
        }
    });
    let plane = |material, views, height, scale: f32| {
        let (position, scale) = (Vec3::Y * height, Vec3::new(scale, 1.0, scale));
        let tint = Vec3::new(0.5, 1.0, 0.8);
        Box::new(Prop { mesh: PLANE, material, views, position, scale, tint }) as Box<dyn Drawable>
    };
    // The ground is below the mirror, and the pool is the mirror: it shows neither.
    let ground = plane(0, ALL_VIEWS & !(1 << MIRROR), -0.3, side as f32 * 1.2);
    let pool = plane(MIRROR_MATERIAL, 1 << MAIN, 0.0, POOL);
    (floaters.chain(standing).chain([ground, pool]).collect(), moving)
}

/// A cuboid or pyramid.
fn create_prop(seed: usize, material: usize, position: Vec3) -> Prop {
    let tint = [1, 2, 3].map(|channel| 0.6 + (hash(seed * 3 + channel) % 40) as f32 * 0.01);
    Prop {
        mesh: if hash(seed + 7).is_multiple_of(2) { CUBOID } else { PYRAMID },
        material,
        views: ALL_VIEWS,
        position,
        scale: Vec3::new(0.5, 0.5 + (hash(seed + 1) % 10) as f32 * 0.1, 0.5),
        tint: Vec3::from(tint),
    }
}

fn create_thicket(seed: usize, material: usize, center: Vec3) -> Thicket {
    let plant = |number: usize, mesh| {
        let away = Quat::from_rotation_y(number as f32 * TAU / 4.0) * Vec3::new(0.6, 0.0, 0.0);
        Prop { mesh, ..create_prop(seed * 4 + number, material, center + away) }
    };
    let plants = [[plant(0, CROSS), plant(1, CROSS)], [plant(2, STAR), plant(3, STAR)]];
    let reach = |plant: &Prop| {
        let sphere = plant.bounding_sphere();
        center.distance(sphere.center) + sphere.radius
    };
    Thicket { plants, center, radius: plants.as_flattened().iter().map(reach).fold(0.0, f32::max) }
}

/// The meshes, which drawables name by index.
pub fn create_meshes(device: &wgpu::Device) -> Vec<Mesh> {
    let plane = vec![quad(Vec3::ZERO, Vec3::Z, Vec3::X)];
    [cuboid(), pyramid(), plant(2), plant(3), plane].iter().map(|quads| create_mesh(device, quads)).collect()
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

/// Upright quadrilaterals through one axis.
fn plant(count: usize) -> Vec<[Vec3; 4]> {
    let angle = |index: usize| index as f32 / count as f32 * TAU / 2.0;
    (0..count).map(|index| quad(Vec3::ZERO, Quat::from_rotation_y(angle(index)) * Vec3::X, Vec3::Y)).collect()
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
