//! Scenes that do not move.

use image::{Rgba, RgbaImage};
use serde_json::json;

use super::builder::Builder;
use super::shapes::{Shape, brick, sphere, square};

/// A square in the middle of the picture, with a texture of four colours: red, green, blue, yellow, from the upper
/// left.
pub fn textured_square() -> Builder {
    let mut builder = Builder::new();
    let texture = builder.texture(&four_colors(64));
    let material = builder.push(
        "materials",
        json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}, "metallicFactor": 0.0},
        }),
    );
    let mesh = builder.mesh(&square(), Some(material));
    builder.root(json!({"mesh": mesh}));
    builder.camera_at([0.0, 0.0, 4.0]);
    builder.sun(3.0);
    builder
}

/// An image of four colours: red, green, blue, yellow, from the upper left.
pub fn four_colors(side: u32) -> RgbaImage {
    RgbaImage::from_fn(side, side, |x, y| match (x < side / 2, y < side / 2) {
        (true, true) => Rgba([255, 0, 0, 255]),
        (false, true) => Rgba([0, 255, 0, 255]),
        (true, false) => Rgba([0, 0, 255, 255]),
        (false, false) => Rgba([255, 255, 0, 255]),
    })
}

/// Five by two spheres: rougher to the right, and metal above. Bumps from a texture of normals on the lower ones.
pub fn metallic_roughness_grid() -> Builder {
    let mut builder = Builder::new();
    let bumps = RgbaImage::from_fn(128, 64, |x, y| {
        let slope = |at: u32| ((at % 16) as f32 / 16.0 * std::f32::consts::TAU).sin() * 0.4;
        let normal = drawloom::glam::Vec3::new(slope(x), slope(y), 1.0).normalize() * 127.0 + 128.0;
        Rgba([normal.x as u8, normal.y as u8, normal.z as u8, 255])
    });
    let bumps = builder.texture(&bumps);
    // Green is roughness, blue is metalness.
    let stripes = RgbaImage::from_fn(32, 32, |x, _| Rgba([0, if x / 4 % 2 == 0 { 255 } else { 90 }, 255, 255]));
    let stripes = builder.texture(&stripes);
    let shape = sphere(48, 32);
    for (row, column) in (0..2).flat_map(|row| (0..5).map(move |column| (row, column))) {
        let mut material = json!({"pbrMetallicRoughness": {
            "baseColorFactor": [0.95, 0.64, 0.4, 1.0],
            "metallicFactor": row as f32,
            "roughnessFactor": 0.05 + 0.2375 * column as f32,
        }});
        if row == 0 {
            material["normalTexture"] = json!({"index": bumps, "scale": 0.7});
        } else {
            material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = json!({"index": stripes});
        }
        let material = builder.push("materials", material);
        let mesh = builder.mesh(&shape, Some(material));
        builder.root(json!({"mesh": mesh, "translation": [column as f32 * 2.4 - 4.8, row as f32 * 2.4 - 1.2, 0.0]}));
    }
    builder.camera_at([0.0, 0.0, 10.0]);
    builder.sun(2.0);
    builder.light(json!({"type": "point", "intensity": 60.0}), [-5.0, 5.0, 4.0], [0.0, 0.0, 0.0, 1.0]);
    builder
}

/// Three squares before a white wall, lit by ambient light and a sun: with round holes, half transparent red, and
/// single-sided seen from behind; each at x = -2.5, 0, 2.5.
pub fn alpha_modes() -> Builder {
    let mut builder = Builder::new();
    let round = RgbaImage::from_fn(64, 64, |x, y| {
        let [x, y] = [x, y].map(|at| at as f32 - 31.5);
        Rgba([0, 255, 0, if x.hypot(y) < 20.0 { 0 } else { 255 }])
    });
    let round = builder.texture(&round);
    let white = builder.push("materials", json!({"pbrMetallicRoughness": {"metallicFactor": 0.0}}));
    let masked = builder.push(
        "materials",
        json!({
            "alphaMode": "MASK", "doubleSided": true,
            "pbrMetallicRoughness": {"baseColorTexture": {"index": round}, "metallicFactor": 0.0},
        }),
    );
    let blended = builder.push(
        "materials",
        json!({
            "alphaMode": "BLEND",
            "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.0, 0.0, 0.5], "metallicFactor": 0.0},
        }),
    );
    let single = builder.push(
        "materials",
        json!({
            "pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 1.0, 1.0], "metallicFactor": 0.0},
        }),
    );
    let wall = builder.mesh(&square(), Some(white));
    builder.root(json!({"mesh": wall, "translation": [0, 0, -6], "scale": [9, 6, 1]}));
    let half_turn = [0.0, 1.0, 0.0, 0.0];
    for (index, (material, rotation)) in
        [(masked, half_turn), (blended, [0.0, 0.0, 0.0, 1.0]), (single, half_turn)].into_iter().enumerate()
    {
        let mesh = builder.mesh(&square(), Some(material));
        builder.root(json!({"mesh": mesh, "translation": [index as f32 * 2.5 - 2.5, 0.0, 0.0], "rotation": rotation}));
    }
    builder.camera_at([0.0, 0.0, 7.0]);
    builder.sun(3.0);
    builder
}

/// A white wall, with a red point light before its left, and a green cone on its right. Two cameras: one in
/// perspective, and a parallel one that sees the right half.
pub fn lights_and_cameras() -> Builder {
    let mut builder = Builder::new();
    let white = builder.push("materials", json!({"pbrMetallicRoughness": {"metallicFactor": 0.0}}));
    let wall = builder.mesh(&square(), Some(white));
    builder.root(json!({"mesh": wall, "scale": [4, 2, 1]}));
    let upright = [0.0, 0.0, 0.0, 1.0];
    builder.light(json!({"type": "point", "color": [1, 0, 0], "intensity": 4.0}), [-2.0, 0.0, 1.0], upright);
    let cone = json!({"outerConeAngle": 0.4, "innerConeAngle": 0.3});
    builder.light(
        json!({"type": "spot", "color": [0, 1, 0], "intensity": 12.0, "spot": cone}),
        [2.0, 0.0, 2.0],
        upright,
    );
    builder.camera_at([0.0, 0.0, 6.0]);
    let camera = json!({"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 2, "znear": 0, "zfar": 20}});
    let camera = builder.push("cameras", camera);
    builder.root(json!({"camera": camera, "translation": [2, 0, 6]}));
    builder
}

/// Bricks below nodes that turn, scale unevenly, mirror and so skew them. With `is_flat`, the same in a mesh without a
/// hierarchy: positions and normals are those in the world, by plain arithmetic in double precision.
pub fn hierarchy(is_flat: bool) -> Builder {
    let mut builder = Builder::new();
    let material = builder.push("materials", json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.5, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9},
    }));
    let shape = brick([1.0, 0.6, 0.3]);
    let quarter = std::f64::consts::FRAC_1_SQRT_2;
    let tilt = [0.0, 0.0, 0.3826834323650898, 0.9238795325112867];
    let matrix = [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -2.0, 1.0, 0.0, 1.0];
    // Each chain: from the root to the node with the mesh.
    let chains = [
        vec![
            json!({"translation": [-2.5, -1.0, 0.0], "rotation": [0.0, quarter, 0.0, quarter]}),
            json!({"translation": [0.5, 0.0, 0.0]}),
        ],
        vec![
            json!({"scale": [-1.0, 1.0, 1.0], "translation": [0.0, -1.0, 0.0]}),
            json!({"rotation": tilt, "translation": [0.1, 0.2, 0.3]}),
        ],
        vec![json!({"scale": [2.0, 0.7, 1.0], "translation": [1.0, 0.0, 0.0]}), json!({"rotation": tilt})],
        vec![json!({"matrix": matrix}), json!({"scale": [1.0, -1.0, -1.0]}), json!({"scale": [0.5, 1.5, 1.0]})],
        vec![
            json!({"scale": [1.5, -0.6, 1.0], "translation": [-0.5, 1.5, 0.0]}),
            json!({"rotation": tilt, "scale": [1.0, 1.0, 2.0]}),
        ],
    ];
    let mut flat = Shape::default();
    let mesh = if is_flat { None } else { Some(builder.mesh(&shape, Some(material))) };
    for chain in &chains {
        match mesh {
            Some(mesh) => {
                let mut child: Option<usize> = None;
                for (index, node) in chain.iter().enumerate().rev() {
                    let mut node = node.clone();
                    match child {
                        None => node["mesh"] = mesh.into(),
                        Some(child) => node["children"] = json!([child]),
                    }
                    child = Some(if index == 0 { builder.root(node) } else { builder.push("nodes", node) });
                }
            }
            None => crate::oracle::append_placed(&mut flat, &shape, chain),
        }
    }
    if is_flat {
        let mesh = builder.mesh(&flat, Some(material));
        builder.root(json!({"mesh": mesh}));
    }
    builder.camera_at([0.0, 0.5, 7.0]);
    builder.slanted_sun();
    builder
}
