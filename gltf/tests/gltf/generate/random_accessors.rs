//! Random accessors of all types that the specification allows for a purpose.

use fastrand::Rng;
use serde_json::{Value, json};

use super::builder::Builder;

/// Floats, floats of which some are replaced, zeros of which some are replaced, and, with `KHR_mesh_quantization`,
/// integers.
pub fn random_positions(builder: &mut Builder, rng: &mut Rng, count: usize, may_be_compact: bool) -> usize {
    let mut positions: Vec<_> = (0..count).map(|_| [rng.f32() * 4.0 - 2.0, rng.f32(), -rng.f32()]).collect();
    match rng.u8(..5) {
        0 if may_be_compact => {
            let is_normalized = rng.bool();
            let integers: Vec<[i16; 4]> = (0..count).map(|_| [rng.i16(..), rng.i16(..), 7, 0]).collect();
            let view = strided(builder, bytemuck::cast_slice(&integers), 8);
            let edge = |pick: fn(i16, i16) -> i16| -> Value {
                (0..3).map(|axis| integers.iter().map(|it| it[axis]).reduce(pick)).map(|edge| json!(edge)).collect()
            };
            let (min, max) = (edge(i16::min), edge(i16::max));
            let accessor = json!({
                "bufferView": view, "componentType": 5122, "normalized": is_normalized, "count": count, "type": "VEC3",
                "min": min, "max": max,
            });
            builder.push("accessors", accessor)
        }
        1 | 2 => {
            let is_based = rng.bool();
            let mut accessor = if is_based {
                let view = strided(builder, bytemuck::cast_slice(&positions), 12);
                json!({"bufferView": view})
            } else {
                positions.fill([0.0; 3]);
                json!({})
            };
            let replaced = rng.usize(..count);
            positions[replaced] = [5.0, -6.0, 7.0];
            let (indices, component) = match rng.u8(..3) {
                0 => (builder.view(&[replaced as u8]), 5121),
                1 => (builder.view(&(replaced as u16).to_le_bytes()), 5123),
                _ => (builder.view(&(replaced as u32).to_le_bytes()), 5125),
            };
            let indices = json!({"bufferView": indices, "componentType": component});
            let values = builder.view(bytemuck::cast_slice(&[[5.0_f32, -6.0, 7.0]]));
            let parts = json!({
                "componentType": 5126, "count": count, "type": "VEC3",
                "sparse": {"count": 1, "indices": indices, "values": {"bufferView": values}},
                "min": edge(&positions, f32::min), "max": edge(&positions, f32::max),
            });
            let parts = parts.as_object().expect("an object").clone();
            accessor.as_object_mut().expect("an object").extend(parts);
            builder.push("accessors", accessor)
        }
        3 => {
            // In whole numbers that are written as such, and as fractions.
            positions.iter_mut().flatten().for_each(|number| *number = number.round());
            builder.floats(&positions)
        }
        _ => builder.floats(&positions),
    }
}

fn edge<const N: usize>(values: &[[f32; N]], pick: fn(f32, f32) -> f32) -> Vec<f32> {
    (0..N).map(|axis| values.iter().map(|value| value[axis]).reduce(pick).unwrap_or(0.0)).collect()
}

/// A buffer view of vertices, `stride` bytes apart.
fn strided(builder: &mut Builder, bytes: &[u8], stride: usize) -> usize {
    let view = builder.view(bytes);
    builder.json["bufferViews"][view]["byteStride"] = json!(stride);
    view
}

pub fn random_normals(builder: &mut Builder, rng: &mut Rng, count: usize) -> usize {
    if rng.bool() {
        return builder.floats(&vec![[0.0, 0.6, -0.8]; count]);
    }
    let view = strided(builder, &[0, 127, 0, 0].repeat(count), 4);
    let accessor =
        json!({"bufferView": view, "componentType": 5120, "normalized": true, "count": count, "type": "VEC3"});
    builder.push("accessors", accessor)
}

pub fn random_tangents(builder: &mut Builder, rng: &mut Rng, count: usize) -> usize {
    let sign = if rng.bool() { 1.0 } else { -1.0 };
    builder.floats(&vec![[1.0, 0.0, 0.0, sign]; count])
}

pub fn random_uvs(builder: &mut Builder, rng: &mut Rng, count: usize) -> usize {
    match rng.u8(..3) {
        0 => builder.floats(&(0..count).map(|_| [rng.f32() * 9.0 - 4.0, rng.f32()]).collect::<Vec<_>>()),
        1 => {
            let bytes: Vec<_> = (0..count).flat_map(|_| [rng.u8(..), rng.u8(..), 0, 0]).collect();
            compact(builder, &bytes, 4, 5121, count, "VEC2")
        }
        _ => {
            let numbers: Vec<u16> = (0..count * 2).map(|_| rng.u16(..)).collect();
            compact(builder, bytemuck::cast_slice(&numbers), 4, 5123, count, "VEC2")
        }
    }
}

pub fn random_colors(builder: &mut Builder, rng: &mut Rng, count: usize) -> usize {
    match rng.u8(..4) {
        0 => builder.floats(&vec![[rng.f32(), rng.f32(), 1.0]; count]),
        1 => builder.floats(&vec![[rng.f32(), rng.f32(), 1.0, rng.f32()]; count]),
        2 => {
            let bytes: Vec<_> = (0..count * 4).map(|_| rng.u8(..)).collect();
            compact(builder, &bytes, 4, 5121, count, "VEC4")
        }
        _ => {
            let numbers: Vec<u16> = (0..count * 4).map(|_| rng.u16(..)).collect();
            compact(builder, bytemuck::cast_slice(&numbers), 8, 5123, count, "VEC3")
        }
    }
}

fn compact(builder: &mut Builder, bytes: &[u8], stride: usize, component: u32, count: usize, kind: &str) -> usize {
    let view = strided(builder, bytes, stride);
    let accessor =
        json!({"bufferView": view, "componentType": component, "normalized": true, "count": count, "type": kind});
    builder.push("accessors", accessor)
}

/// Joints below a number, and weights that add up to 1.
pub fn random_joints(builder: &mut Builder, rng: &mut Rng, count: usize, below: usize) -> [usize; 2] {
    let mut joint = || rng.usize(..below) as u16;
    // Joints without weight are 0, and none is there twice.
    let joints: Vec<[u16; 4]> =
        (0..count).map(|_| [joint(), 0, 0, 0]).map(|[one, ..]| [one, (one + 1) % 3, 0, 0]).collect();
    let is_split = rng.bool();
    let joints: Vec<[u16; 4]> =
        joints.into_iter().map(|[one, other, ..]| [one, if is_split { other } else { 0 }, 0, 0]).collect();
    let of_joints = if rng.bool() {
        let bytes: Vec<u8> = joints.as_flattened().iter().map(|&joint| joint as u8).collect();
        let view = strided(builder, &bytes, 4);
        json!({"bufferView": view, "componentType": 5121, "count": count, "type": "VEC4"})
    } else {
        let view = strided(builder, bytemuck::cast_slice(&joints), 8);
        json!({"bufferView": view, "componentType": 5123, "count": count, "type": "VEC4"})
    };
    let of_joints = builder.push("accessors", of_joints);
    let weights = if is_split { [0.25, 0.75, 0.0, 0.0] } else { [1.0, 0.0, 0.0, 0.0] };
    let of_weights = if rng.bool() {
        builder.floats(&vec![weights; count])
    } else {
        let bytes = if is_split { [55, 200, 0, 0] } else { [255, 0, 0, 0] };
        compact(builder, &bytes.repeat(count), 4, 5121, count, "VEC4")
    };
    [of_joints, of_weights]
}

/// Indices below a number, of any type.
pub fn indices(builder: &mut Builder, rng: &mut Rng, length: usize, below: usize) -> usize {
    let numbers: Vec<_> = (0..length).map(|_| rng.usize(..below)).collect();
    let (view, component) = match rng.u8(..3) {
        0 => (builder.view(&numbers.iter().map(|&it| it as u8).collect::<Vec<_>>()), 5121),
        1 => {
            let numbers: Vec<u16> = numbers.iter().map(|&it| it as u16).collect();
            (builder.view(bytemuck::cast_slice(&numbers)), 5123)
        }
        _ => {
            let numbers: Vec<u32> = numbers.iter().map(|&it| it as u32).collect();
            (builder.view(bytemuck::cast_slice(&numbers)), 5125)
        }
    };
    builder
        .push("accessors", json!({"bufferView": view, "componentType": component, "count": length, "type": "SCALAR"}))
}
