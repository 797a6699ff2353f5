//! Random files that are valid glTF 2.0: what the specification allows, in any combination.

use fastrand::Rng;
use serde_json::{Value, json};

use super::builder::Builder;
use super::random_accessors::{
    indices, random_colors, random_joints, random_normals, random_positions, random_tangents, random_uvs,
};

/// The number of joints of every skin.
const JOINTS: usize = 3;

/// A random file, the same for the same seed.
pub fn random_file(seed: u64) -> Builder {
    let mut builder = Builder::new();
    let mut rng = Rng::with_seed(seed);
    let rng = &mut rng;
    add_materials(&mut builder, rng);
    let meshes: Vec<_> = (0..rng.usize(1..4)).map(|_| add_mesh(&mut builder, rng)).collect();
    add_nodes(&mut builder, rng, &meshes);
    if rng.bool() {
        add_animation(&mut builder, rng);
    }
    let mut used = vec!["KHR_lights_punctual", "KHR_materials_unlit", "KHR_materials_emissive_strength"];
    used.extend(["KHR_texture_transform", "KHR_mesh_quantization"]);
    if rng.bool() {
        used.push("ACME_unheard_of");
        builder.json["nodes"][0]["extensions"]["ACME_unheard_of"] = json!({"depth": [1, {"a": null}]});
        builder.json["asset"]["extras"] = json!({"anything": [[[]], 1.5, "x"]});
    }
    builder.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    builder.json["extensionsUsed"] = json!(used);
    builder
}

fn add_materials(builder: &mut Builder, rng: &mut Rng) {
    for _ in 0..rng.usize(0..3) {
        let image =
            image::RgbaImage::from_fn(rng.u32(1..9), rng.u32(1..9), |_, _| image::Rgba(rng.u32(..).to_le_bytes()));
        let texture = builder.texture(&image);
        if rng.bool() {
            let pick = |rng: &mut Rng, choices: &[u32]| json!(choices[rng.usize(..choices.len())]);
            let wraps = [33071, 33648, 10497];
            let mut sampler = json!({"wrapS": pick(rng, &wraps), "wrapT": pick(rng, &wraps)});
            if rng.bool() {
                sampler["magFilter"] = pick(rng, &[9728, 9729]);
            }
            if rng.bool() {
                sampler["minFilter"] = pick(rng, &[9728, 9729, 9984, 9985, 9986, 9987]);
            }
            let sampler = builder.push("samplers", sampler);
            builder.json["textures"][texture]["sampler"] = json!(sampler);
        }
    }
    let textures = builder.json["textures"].as_array().map_or(0, Vec::len);
    for _ in 0..rng.usize(0..4) {
        let info = |rng: &mut Rng| {
            let mut info = json!({"index": rng.usize(..textures.max(1))});
            if rng.bool() {
                let transform = json!({"offset": [0.5, -2], "rotation": rng.f32(), "scale": [rng.f32(), 3]});
                info["extensions"] = json!({"KHR_texture_transform": transform});
            }
            info
        };
        let mut material = json!({
            "pbrMetallicRoughness": {
                "baseColorFactor": [rng.f32(), rng.f32(), rng.f32(), rng.f32()], "metallicFactor": rng.f32(),
            },
            "alphaMode": (["OPAQUE", "MASK", "BLEND"][rng.usize(..3)]), "doubleSided": rng.bool(),
            "emissiveFactor": [rng.f32(), 0, 1],
        });
        if textures > 0 {
            material["pbrMetallicRoughness"]["baseColorTexture"] = info(rng);
            if rng.bool() {
                material["normalTexture"] = info(rng);
                material["normalTexture"]["scale"] = json!(-1.5);
                material["occlusionTexture"] = info(rng);
                material["occlusionTexture"]["strength"] = json!(rng.f32());
                material["emissiveTexture"] = info(rng);
                material["pbrMetallicRoughness"]["metallicRoughnessTexture"] = info(rng);
            }
        }
        if rng.bool() {
            material["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 5}});
        } else if rng.bool() {
            material["extensions"] = json!({"KHR_materials_unlit": {}});
        }
        builder.push("materials", material);
    }
}

/// What the primitives of a mesh have in common.
struct MeshKind {
    has_joints: bool,
    targets: usize,
}

fn add_mesh(builder: &mut Builder, rng: &mut Rng) -> usize {
    let kind = MeshKind { has_joints: rng.bool(), targets: rng.usize(..3) };
    let primitives: Vec<_> = (0..rng.usize(1..4)).map(|_| primitive(builder, rng, &kind)).collect();
    let mut mesh = json!({"primitives": primitives, "name": "mesh of any kind"});
    if kind.targets > 0 && rng.bool() {
        mesh["weights"] = (0..kind.targets).map(|_| json!(rng.f32())).collect();
    }
    builder.push("meshes", mesh)
}

fn primitive(builder: &mut Builder, rng: &mut Rng, kind: &MeshKind) -> Value {
    let count = rng.usize(3..20);
    let mut attributes = json!({
        "POSITION": random_positions(builder, rng, count, true), "TEXCOORD_0": random_uvs(builder, rng, count),
    });
    let has_normals = rng.bool();
    if has_normals {
        attributes["NORMAL"] = random_normals(builder, rng, count).into();
        if rng.bool() {
            attributes["TANGENT"] = random_tangents(builder, rng, count).into();
        }
    }
    if rng.bool() {
        attributes["TEXCOORD_1"] = random_uvs(builder, rng, count).into();
    }
    if rng.bool() {
        attributes["COLOR_0"] = random_colors(builder, rng, count).into();
    }
    if rng.bool() {
        attributes["_TEMPERATURE"] = builder.floats(&vec![[rng.f32()]; count]).into();
    }
    if kind.has_joints {
        let [joints, weights] = random_joints(builder, rng, count, JOINTS);
        (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (joints.into(), weights.into());
    }
    let mut primitive = json!({"attributes": attributes});
    let materials = builder.json["materials"].as_array().map_or(0, Vec::len);
    if materials > 0 && rng.bool() {
        primitive["material"] = rng.usize(..materials).into();
    }
    if rng.bool() {
        // Triangles as often as all others, and as if it were not said.
        let mode = [0, 1, 2, 3, 4, 4, 4, 4, 5, 6][rng.usize(..10)];
        primitive["mode"] = json!(mode);
    }
    if rng.bool() {
        let length = rng.usize(1..30);
        primitive["indices"] = indices(builder, rng, length, count).into();
    }
    if kind.targets > 0 {
        let target = |_| {
            let mut target = json!({"POSITION": random_positions(builder, rng, count, false)});
            if has_normals && rng.bool() {
                target["NORMAL"] = builder.floats(&vec![[rng.f32(), 0.0, -1.0]; count]).into();
            }
            target
        };
        primitive["targets"] = (0..kind.targets).map(target).collect();
    }
    primitive
}

/// One root, joints below it, and nodes with all that nodes can have.
fn add_nodes(builder: &mut Builder, rng: &mut Rng, meshes: &[usize]) {
    let root = builder.root(json!({"name": "root"}));
    let mut parent = root;
    let joints: Vec<_> = (0..JOINTS)
        .map(|_| {
            let joint = builder.push("nodes", json!({"translation": [0, 0.25, 0]}));
            add_child(builder, parent, joint);
            parent = joint;
            joint
        })
        .collect();
    let mut skin = json!({"joints": joints});
    if rng.bool() {
        let identity: [f32; 16] = std::array::from_fn(|index| if usize::is_multiple_of(index, 5) { 1.0 } else { 0.0 });
        let view = builder.view(bytemuck::cast_slice(&[identity; JOINTS]));
        let accessor = json!({"bufferView": view, "componentType": 5126, "count": JOINTS, "type": "MAT4"});
        skin["inverseBindMatrices"] = builder.push("accessors", accessor).into();
    }
    let skin = builder.push("skins", skin);
    let lights: Vec<_> = (0..rng.usize(0..3)).map(|_| light(rng)).collect();
    let mut parents = vec![root];
    for _ in 0..rng.usize(1..8) {
        let mut node = transform(rng);
        if rng.u8(..4) > 0 {
            let mesh = meshes[rng.usize(..meshes.len())];
            node["mesh"] = json!(mesh);
            let has = |name: &str| builder.json["meshes"][mesh]["primitives"][0].pointer(name).cloned();
            if has("/attributes/JOINTS_0").is_some() {
                node["skin"] = json!(skin);
            }
            let targets = has("/targets").and_then(|targets| Some(targets.as_array()?.len()));
            if let (Some(targets), true) = (targets, rng.bool()) {
                node["weights"] = (0..targets).map(|_| json!(rng.f32())).collect();
            }
        } else if rng.bool() {
            node["camera"] = camera(builder, rng).into();
        } else if !lights.is_empty() {
            node["extensions"] = json!({"KHR_lights_punctual": {"light": rng.usize(..lights.len())}});
        }
        let node = builder.push("nodes", node);
        add_child(builder, parents[rng.usize(..parents.len())], node);
        parents.push(node);
    }
    if !lights.is_empty() {
        builder.json["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
    }
    if rng.bool() {
        builder.json.as_object_mut().expect("an object").remove("scene");
    }
}

fn add_child(builder: &mut Builder, parent: usize, child: usize) {
    let node = &mut builder.json["nodes"][parent];
    if node.get("children").is_none() {
        node["children"] = json!([]);
    }
    node["children"].as_array_mut().expect("an array").push(child.into());
}

fn transform(rng: &mut Rng) -> Value {
    match rng.u8(..3) {
        0 => json!({}),
        1 => {
            let angle = rng.f64();
            let scale = if rng.bool() { [1.0, -2.0, 0.5] } else { [1.0; 3] };
            let rotation = [0.0, (angle / 2.0).sin(), 0.0, (angle / 2.0).cos()];
            json!({"translation": [rng.f32(), -1e3, 4], "rotation": rotation, "scale": scale})
        }
        _ => json!({"matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, rng.f32(), -7, 0.5, 1]}),
    }
}

fn camera(builder: &mut Builder, rng: &mut Rng) -> usize {
    let camera = if rng.bool() {
        let mut lens = json!({"yfov": 0.1 + rng.f32() * 2.0, "znear": 0.01});
        if rng.bool() {
            lens["zfar"] = json!(100);
            lens["aspectRatio"] = json!(1.5);
        }
        json!({"type": "perspective", "perspective": lens})
    } else {
        json!({"type": "orthographic", "orthographic": {"xmag": 1.5, "ymag": 2, "znear": 0, "zfar": 50}})
    };
    builder.push("cameras", camera)
}

fn light(rng: &mut Rng) -> Value {
    let mut light = json!({"type": (["directional", "point", "spot"][rng.usize(..3)]), "intensity": rng.f32() * 9.0});
    if light["type"] == "spot" {
        light["spot"] = if rng.bool() { json!({}) } else { json!({"innerConeAngle": 0.1, "outerConeAngle": 1.5}) };
    }
    if light["type"] != "directional" && rng.bool() {
        light["range"] = json!(20);
    }
    if rng.bool() {
        light["color"] = json!([rng.f32(), 1, 0]);
    }
    light
}

/// An animation of what nodes have: each property of a node once.
fn add_animation(builder: &mut Builder, rng: &mut Rng) {
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let nodes = builder.json["nodes"].as_array().expect("an array").clone();
    for (node, json) in nodes.iter().enumerate() {
        let mut paths = vec![];
        if json.get("matrix").is_none() {
            paths.extend([("translation", 3), ("rotation", 4), ("scale", 3)]);
        }
        let targets = json.get("mesh").and_then(Value::as_u64).map(|mesh| {
            let targets = &builder.json["meshes"][mesh as usize]["primitives"][0]["targets"];
            targets.as_array().map_or(0, Vec::len)
        });
        if let Some(targets @ 1..) = targets {
            paths.push(("weights", targets));
        }
        for (path, width) in paths.into_iter().filter(|_| rng.u8(..3) == 0).collect::<Vec<_>>() {
            let interpolation = ["LINEAR", "STEP", "CUBICSPLINE"][rng.usize(..3)];
            let keys = rng.usize(2..5);
            let times: Vec<_> = (0..keys).map(|key| [key as f32 * 0.5]).collect();
            let values = keys * if interpolation == "CUBICSPLINE" { 3 } else { 1 };
            let mut number = || rng.f32() * 2.0 - 1.0;
            let output = match (path, width) {
                ("weights", targets) => builder.floats(&(0..values * targets).map(|_| [number()]).collect::<Vec<_>>()),
                ("rotation", _) => builder.floats(&vec![[0.0, 0.6, 0.0, 0.8]; values]),
                _ => builder.floats(&(0..values).map(|_| [number(), 0.5, 2.0]).collect::<Vec<_>>()),
            };
            let sampler = json!({"input": builder.floats(&times), "output": output, "interpolation": interpolation});
            samplers.push(sampler);
            channels.push(json!({"sampler": samplers.len() - 1, "target": {"node": node, "path": path}}));
        }
    }
    if !channels.is_empty() {
        builder.push("animations", json!({"samplers": samplers, "channels": channels}));
    }
}
