//! Meshes.

use std::f32::consts::{PI, TAU};

use drawloom::glam::Vec3;

/// Vertices and triangles.
#[derive(Clone, Default)]
pub struct Shape {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub indices: Vec<u32>,
}

/// A square that faces +Z, with sides of 2. The upper left of a texture is its upper left.
pub fn square() -> Shape {
    Shape {
        positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        indices: vec![0, 1, 2, 0, 2, 3],
    }
}

/// A sphere of radius 1.
pub fn sphere(columns: u32, rows: u32) -> Shape {
    let mut shape = Shape::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let [u, v] = [column as f32 / columns as f32, row as f32 / rows as f32];
            let (latitude, longitude) = ((0.5 - v) * PI, u * TAU);
            let position = [latitude.cos() * longitude.sin(), latitude.sin(), latitude.cos() * longitude.cos()];
            shape.positions.push(position);
            shape.normals.push(position);
            shape.uvs.push([u, v]);
            if row < rows && column < columns {
                let first = row * (columns + 1) + column;
                let below = first + columns + 1;
                shape.indices.extend([first, below, below + 1, first, below + 1, first + 1]);
            }
        }
    }
    shape
}

/// A box with three sides of different lengths, in the corner of the axes: it shows whether it is mirrored.
pub fn brick(size: [f32; 3]) -> Shape {
    let mut shape = Shape::default();
    let size = Vec3::from(size);
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let [across, up] = [(axis + 1) % 3, (axis + 2) % 3];
            let first = shape.positions.len() as u32;
            for corner in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                let mut point = Vec3::ZERO;
                (point[axis], point[across], point[up]) = (side, corner[0], corner[1]);
                shape.positions.push((point * size).to_array());
                let mut normal = Vec3::ZERO;
                normal[axis] = 2.0 * side - 1.0;
                shape.normals.push(normal.to_array());
            }
            let [a, b] = if side == 1.0 { [1, 2] } else { [2, 1] };
            let [c, d] = if side == 1.0 { [2, 3] } else { [3, 2] };
            shape.indices.extend([first, first + a, first + b, first, first + c, first + d]);
        }
    }
    shape
}

/// A tube around the y axis, from 0 up to `height`, open at its ends.
pub fn tube(radius: f32, height: f32, around: u32, along: u32) -> Shape {
    let mut shape = Shape::default();
    for row in 0..=along {
        for column in 0..=around {
            let [u, v] = [column as f32 / around as f32, row as f32 / along as f32];
            let normal = [(u * TAU).sin(), 0.0, (u * TAU).cos()];
            shape.positions.push([normal[0] * radius, v * height, normal[2] * radius]);
            shape.normals.push(normal);
            shape.uvs.push([u, 1.0 - v]);
            if row < along && column < around {
                let first = row * (around + 1) + column;
                let above = first + around + 1;
                shape.indices.extend([first, first + 1, above + 1, first, above + 1, above]);
            }
        }
    }
    shape
}
