//! Scenes of meshes that joints, morph targets or animations move. Each comes in two forms: as such, and with all
//! vertices where they are at a time, by plain arithmetic.

use serde_json::{Value, json};

use super::builder::Builder;
use super::shapes::{Shape, brick, sphere, tube};
use crate::oracle::{Matrix, append_placed, append_transformed, matrix_of, multiply};

/// How far each joint of the tube has turned around the z axis at a time, in radians.
fn turn(joint: usize, time: f64) -> f64 {
    let ends = [0.2, 0.7, -1.1][joint];
    ends * (time / 2.0).clamp(0.0, 1.0)
}

/// A node that the tube's joints are below: turned, scaled and moved.
fn armature(is_mirrored: bool) -> Value {
    let x = if is_mirrored { -1.0 } else { 1.0 };
    json!({"translation": [0.3, -1.6, 0.2], "rotation": [0.0, 0.3826834323650898, 0.0, 0.9238795325112867], "scale": [x, 1.1, 0.8]})
}

/// How much each of two joints moves a point at a height.
fn joint_weights(height: f32) -> [(usize, f32); 2] {
    let below = (height.floor() as usize).min(1);
    let share = (height - below as f32).clamp(0.0, 1.0);
    [(below, 1.0 - share), (below + 1, share)]
}

/// A tube that three joints bend within two seconds. `time` is that of the vertices; `None` for joints and an
/// animation.
pub fn bending_tube(time: Option<f64>) -> Builder {
    tube_scene(time, false)
}

/// The same below a node that mirrors it.
pub fn mirrored_tube(time: Option<f64>) -> Builder {
    tube_scene(time, true)
}

fn tube_scene(time: Option<f64>, is_mirrored: bool) -> Builder {
    let mut builder = Builder::new();
    let shape = tube(0.4, 3.0, 24, 30);
    let material = clay(&mut builder);
    match time {
        Some(time) => {
            let mut world = matrix_of(&armature(is_mirrored));
            let mut joints = Vec::new();
            for joint in 0..3 {
                let turned = json!({"translation": [0.0, if joint == 0 { 0.0 } else { 1.0 }, 0.0], "rotation": around_z(turn(joint, time))});
                world = multiply(&world, &matrix_of(&turned));
                let bind = matrix_of(&json!({"translation": [0.0, -(joint as f64), 0.0]}));
                joints.push(multiply(&world, &bind));
            }
            let blended = |position: &[f32; 3]| {
                joint_weights(position[1]).into_iter().fold([[0.0; 4]; 4], |sum: Matrix, (joint, weight)| {
                    std::array::from_fn(|row| {
                        std::array::from_fn(|column| sum[row][column] + f64::from(weight) * joints[joint][row][column])
                    })
                })
            };
            add_flat(&mut builder, &shape, &shape.positions.iter().map(blended).collect::<Vec<_>>(), material);
        }
        None => add_skinned(&mut builder, &shape, material, is_mirrored),
    }
    builder.camera_at([0.0, 0.0, 6.0]);
    builder.slanted_sun();
    builder
}

fn add_skinned(builder: &mut Builder, shape: &Shape, material: usize, is_mirrored: bool) {
    let mut primitive = builder.primitive(shape, Some(material));
    let used: Vec<_> = shape.positions.iter().map(|position| joint_weights(position[1])).collect();
    let joints: Vec<_> = used.iter().map(|[one, other]| [one.0 as u8, other.0 as u8, 0, 0]).collect();
    // They need not add up to 1.
    let weights: Vec<_> = used.iter().map(|[one, other]| [one.1 * 0.5, other.1 * 0.5, 0.0, 0.0]).collect();
    primitive["attributes"]["JOINTS_0"] = builder.joints(&joints).into();
    primitive["attributes"]["WEIGHTS_0"] = builder.floats(&weights).into();
    let mesh = builder.push("meshes", json!({"primitives": [primitive]}));
    let last = builder.push("nodes", json!({"translation": [0, 1, 0], "name": "last"}));
    let middle = builder.push("nodes", json!({"translation": [0, 1, 0], "children": [last]}));
    let first = builder.push("nodes", json!({"children": [middle]}));
    let mut root = armature(is_mirrored);
    root["children"] = json!([first]);
    builder.root(root);
    let binds = (0..3).map(|joint| {
        let mut matrix = [0.0; 16];
        [0, 5, 10, 15].into_iter().for_each(|index| matrix[index] = 1.0);
        matrix[13] = -(joint as f32);
        matrix
    });
    let binds = builder.floats(&binds.collect::<Vec<_>>());
    let skin = builder.push("skins", json!({"joints": [first, middle, last], "inverseBindMatrices": binds}));
    // The transform of a node with a skin has no effect.
    builder.root(json!({"mesh": mesh, "skin": skin, "translation": [5, 5, 5], "scale": [3, 1, 1]}));
    let times = builder.floats(&[[0.0], [1.0], [2.0]]);
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    for (joint, node) in [first, middle, last].into_iter().enumerate() {
        let rotations = [0.0, 1.0, 2.0].map(|time| around_z(turn(joint, time)).map(|number| number as f32));
        samplers.push(json!({"input": times, "output": builder.floats(&rotations)}));
        channels.push(json!({"sampler": joint, "target": {"node": node, "path": "rotation"}}));
    }
    builder.push("animations", json!({"name": "bend", "samplers": samplers, "channels": channels}));
}

/// The weights of the sphere's morph targets at a time.
fn morph_weights(time: f64) -> [f64; 2] {
    let share = (time / 2.0).clamp(0.0, 1.0);
    [share, 0.25 + 0.5 * share]
}

/// A sphere with two morph targets, below a turned and scaled node: the first stretches it, the second makes waves.
pub fn morphing_sphere(time: Option<f64>) -> Builder {
    let mut builder = Builder::new();
    let shape = sphere(32, 24);
    let material = clay(&mut builder);
    let stretch = |[x, y, z]: [f32; 3]| [-0.3 * x, 0.6 * y, -0.3 * z];
    let wave = |[x, y, _]: [f32; 3]| [0.3 * (y * 6.0).sin(), 0.0, 0.2 * (x * 5.0).cos()];
    let bent_normal = |[x, y, z]: [f32; 3]| [0.4 * x, -0.5 * y, 0.4 * z];
    let node = json!({"rotation": [0.0, 0.0, 0.3826834323650898, 0.9238795325112867], "scale": [1.0, 1.0, 0.7]});
    match time {
        Some(time) => {
            let [first, second] = morph_weights(time).map(|weight| weight as f32);
            let mut morphed = shape.clone();
            let add = |point: &mut [f32; 3], weight: f32, [x, y, z]: [f32; 3]| {
                *point = [point[0] + weight * x, point[1] + weight * y, point[2] + weight * z];
            };
            for (index, point) in morphed.positions.iter_mut().enumerate() {
                add(point, first, stretch(shape.positions[index]));
                add(point, second, wave(shape.positions[index]));
            }
            let normals = morphed.normals.iter_mut().zip(&shape.normals);
            normals.for_each(|(normal, unchanged)| add(normal, first, bent_normal(*unchanged)));
            add_flat(&mut builder, &morphed, &vec![matrix_of(&node); morphed.positions.len()], material);
        }
        None => {
            let targets = json!([
                {
                    "POSITION": builder.floats(&shape.positions.iter().copied().map(stretch).collect::<Vec<_>>()),
                    "NORMAL": builder.floats(&shape.normals.iter().copied().map(bent_normal).collect::<Vec<_>>()),
                },
                {"POSITION": builder.floats(&shape.positions.iter().copied().map(wave).collect::<Vec<_>>())},
            ]);
            let mut primitive = builder.primitive(&shape, Some(material));
            primitive["targets"] = targets;
            let mesh = builder.push("meshes", json!({"primitives": [primitive], "weights": morph_weights(0.0)}));
            let mut node = node;
            node["mesh"] = mesh.into();
            let node = builder.root(node);
            let times = builder.floats(&[[0.0], [2.0]]);
            let weights = [morph_weights(0.0), morph_weights(2.0)].concat().into_iter().map(|weight| [weight as f32]);
            let weights = builder.floats(&weights.collect::<Vec<_>>());
            builder.push(
                "animations",
                json!({
                    "samplers": [{"input": times, "output": weights, "interpolation": "LINEAR"}],
                    "channels": [{"sampler": 0, "target": {"node": node, "path": "weights"}}],
                }),
            );
        }
    }
    builder.camera_at([0.0, 0.0, 5.0]);
    builder.slanted_sun();
    builder
}

/// Three bricks that move up within two seconds: in steps, in a straight line, and along a spline; and one that grows
/// and turns.
pub fn interpolations(time: Option<f64>) -> Builder {
    let mut builder = Builder::new();
    let shape = brick([0.8, 0.5, 0.4]);
    let material = clay(&mut builder);
    let heights = [-1.0, 0.5, 1.5];
    // With a spline, the tangents before and behind each height.
    let tangents = [[0.0, 3.0], [-1.0, 2.0], [-2.0, 0.0]];
    let place = |column: usize, height: f64| json!({"translation": [column as f64 * 1.2 - 2.4, height, 0.0]});
    if let Some(time) = time {
        let clamped = time.clamp(0.0, 2.0);
        let key = (clamped.floor() as usize).min(1);
        let t = clamped - key as f64;
        let [one, other] = [heights[key], heights[key + 1]];
        let step = if clamped >= 2.0 { heights[2] } else { one };
        let spline = (2.0 * t.powi(3) - 3.0 * t.powi(2) + 1.0) * one
            + (t.powi(3) - 2.0 * t.powi(2) + t) * tangents[key][1]
            + (3.0 * t.powi(2) - 2.0 * t.powi(3)) * other
            + (t.powi(3) - t.powi(2)) * tangents[key + 1][0];
        let mut flat = Shape::default();
        for (column, height) in [step, one + (other - one) * t, spline].into_iter().enumerate() {
            append_placed(&mut flat, &shape, &[place(column, height)]);
        }
        let share = clamped / 2.0;
        let turned = json!({
            "translation": [1.2, 0.0, 0.0], "rotation": around_z(share * 1.5), "scale": [1.0 + share, 1.0 - 0.5 * share, 1.0],
        });
        append_placed(&mut flat, &shape, &[turned]);
        let mesh = builder.mesh(&flat, Some(material));
        builder.root(json!({"mesh": mesh}));
    } else {
        let mesh = builder.mesh(&shape, Some(material));
        let times = builder.floats(&[[0.0], [1.0], [2.0]]);
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for (column, interpolation) in ["STEP", "LINEAR", "CUBICSPLINE"].into_iter().enumerate() {
            let mut node = place(column, -1.0);
            let x = node["translation"][0].as_f64().expect("a number") as f32;
            let keys = (0..3).flat_map(|key| {
                let value = [x, heights[key] as f32, 0.0];
                let [before, behind] = tangents[key].map(|tangent| [0.0, tangent as f32, 0.0]);
                if interpolation == "CUBICSPLINE" { vec![before, value, behind] } else { vec![value] }
            });
            let output = builder.floats(&keys.collect::<Vec<_>>());
            node["mesh"] = mesh.into();
            let node = builder.root(node);
            samplers.push(json!({"input": times, "output": output, "interpolation": interpolation}));
            channels.push(json!({"sampler": column, "target": {"node": node, "path": "translation"}}));
        }
        let node = builder.root(json!({"mesh": mesh, "translation": [1.2, 0.0, 0.0]}));
        let ends = builder.floats(&[[0.0], [2.0]]);
        let rotations = [0.0, 1.5].map(|angle| around_z(angle).map(|number| number as f32));
        // The same rotation, but the other way around unless the shorter way is taken.
        let rotations = builder.floats(&[rotations[0], rotations[1].map(|number| -number)]);
        let scales = builder.floats(&[[1.0, 1.0, 1.0], [2.0, 0.5, 1.0]]);
        samplers.extend([json!({"input": ends, "output": rotations}), json!({"input": ends, "output": scales})]);
        channels.push(json!({"sampler": 3, "target": {"node": node, "path": "rotation"}}));
        channels.push(json!({"sampler": 4, "target": {"node": node, "path": "scale"}}));
        builder.push("animations", json!({"name": "move", "samplers": samplers, "channels": channels}));
    }
    builder.camera_at([0.0, 0.2, 6.0]);
    builder.slanted_sun();
    builder
}

fn clay(builder: &mut Builder) -> usize {
    builder.push("materials", json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.5, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9},
    }))
}

fn add_flat(builder: &mut Builder, shape: &Shape, matrices: &[Matrix], material: usize) {
    let mut flat = Shape::default();
    append_transformed(&mut flat, shape, matrices);
    let mesh = builder.mesh(&flat, Some(material));
    builder.root(json!({"mesh": mesh}));
}

/// A quaternion: x, y, z, w.
fn around_z(angle: f64) -> [f64; 4] {
    [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()]
}
