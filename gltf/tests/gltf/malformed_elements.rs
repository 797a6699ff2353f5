//! Scenes with one element that is malformed: it is named, and all else is drawn.

use drawloom_gltf::LoadOptions;
use libtest_mimic::Failed;
use serde_json::{Value, json};

use crate::fixture::{AT_REST, expect, load_memory};
use crate::generate::builder::Builder;
use crate::generate::deforming::{bending_tube, morphing_sphere};
use crate::generate::static_scenes::{lights_and_cameras, textured_square};

pub const CASES: &[crate::Case] = &[("what_is_wrong_is_named_and_all_else_is_drawn", named)];

type Malformed = (fn() -> Builder, fn(&mut Builder), &'static str);

/// A scene, how it is changed, and what the warning says.
const CHANGES: &[Malformed] = &[
    (
        textured_square,
        |it| it.json["accessors"][0]["count"] = json!(5),
        "accessor 0 is out of range: it ends at byte 60 of buffer view 1, which has 48",
    ),
    (textured_square, |it| it.json["accessors"][0]["byteOffset"] = json!(1_u64 << 45), "accessor 0 is out of range"),
    (textured_square, |it| it.json["accessors"][0]["count"] = json!(1_u64 << 50), "accessor 0 is out of range"),
    (
        textured_square,
        |it| it.json["accessors"][0]["type"] = json!("VEC2"),
        "accessor 0 is a vector of 2 of F32, but the positions of mesh 0 primitive 0 must be of 3 components",
    ),
    (
        textured_square,
        |it| it.json["accessors"][3]["componentType"] = json!(5126),
        "accessor 3 is a scalar of F32, but the indices of mesh 0 primitive 0 must be of unsigned integers",
    ),
    (
        textured_square,
        |it| it.json["accessors"][0]["componentType"] = json!(7),
        "accessor 0 has the `componentType` 7, which is not known",
    ),
    (
        textured_square,
        |it| it.json["accessors"][1]["count"] = json!(3),
        "normals of mesh 0 primitive 0 has 3 values, but 4 vertices",
    ),
    (
        textured_square,
        |it| {
            let [indices, values] = [it.view(&[0, 1, 2, 3, 0]), it.view(&[0; 60])];
            let indices = json!({"bufferView": indices, "componentType": 5121});
            it.json["accessors"][0]["sparse"] =
                json!({"count": 5, "indices": indices, "values": {"bufferView": values}});
        },
        "accessor 0 has more sparse values than values",
    ),
    (textured_square, |it| it.json["bufferViews"][1]["byteLength"] = json!(99_999), "buffer view 1 is out of range"),
    (
        textured_square,
        |it| it.json["bufferViews"][1]["byteStride"] = json!(4),
        "accessor 0 has elements of 12 bytes, 4 bytes apart",
    ),
    (
        textured_square,
        |it| it.json["bufferViews"][1]["buffer"] = json!(3),
        "buffer view 1 has the index 3 of 1 buffers",
    ),
    (
        textured_square,
        |it| set_float(it, 1, 4, f32::NAN),
        "the positions of mesh 0 primitive 0 (accessor 0) has a number that is not finite at index 1",
    ),
    (textured_square, |it| set_word(it, 4, 2, 77), "mesh 0 primitive 0 has the index 77 of 4 vertices"),
    (textured_square, |it| it.json["accessors"][3]["count"] = json!(5), "has 5 corners, which are no whole triangles"),
    (textured_square, |it| it.json["nodes"][0]["children"] = json!([0]), "node 0 is its own ancestor"),
    (
        textured_square,
        |it| {
            it.json["nodes"][0]["children"] = json!([1]);
            it.json["nodes"][1]["children"] = json!([0]);
        },
        "node 0 is its own ancestor",
    ),
    (
        textured_square,
        |it| {
            it.json["nodes"][0]["children"] = json!([2]);
            it.json["nodes"][1]["children"] = json!([2]);
        },
        "node 2 is a child twice",
    ),
    (
        textured_square,
        |it| it.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(9),
        "mesh 0 primitive 0 has the index 9 of 4 accessors",
    ),
    (textured_square, |it| it.json["nodes"][0]["children"] = json!([9]), "node 0 has the index 9 of 3 nodes"),
    (
        textured_square,
        |it| it.json["nodes"][0]["translation"] = json!([1e39, 0, 0]),
        "node 0 has a transform that is more than 4e9 m",
    ),
    (
        textured_square,
        |it| it.json["nodes"][0]["translation"] = json!([1e12, 0, 0]),
        "node 0 has a transform that is more than 4e9 m",
    ),
    (
        textured_square,
        |it| it.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]),
        "node 0 has a transform that has a rotation without a direction",
    ),
    (
        textured_square,
        |it| it.json["nodes"][0]["matrix"] = json!([1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
        "node 0 has a transform that is not affine",
    ),
    (
        textured_square,
        |it| it.json["nodes"][0]["scale"] = json!([1e38, 1, 1]),
        "node 0 has a transform that is not finite in the world",
    ),
    (
        textured_square,
        |it| it.json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = json!(-1),
        "material 0 has a metallicFactor of -1, and is drawn with 0",
    ),
    (
        textured_square,
        |it| it.json["materials"][0]["emissiveFactor"] = json!([1e39, 0, 0]),
        "material 0 has a emissiveFactor that is negative or very great",
    ),
    (textured_square, |it| it.json["images"][0] = json!({}), "image 0 has neither a URI nor a buffer view"),
    (textured_square, |it| it.json["images"][0] = json!({"uri": "none.png"}), "none.png cannot be read"),
    (textured_square, |it| it.json["images"][0]["bufferView"] = json!(1), "image 0 cannot be decoded"),
    (textured_square, |it| it.binary[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]), "image 0 "),
    (textured_square, |it| it.json["cameras"][0]["perspective"]["yfov"] = json!(-7), "camera 0 has a field of view"),
    (
        textured_square,
        |it| it.json["cameras"][0]["perspective"]["zfar"] = json!(0.01),
        "camera 0 has planes that are not 0 < near < far",
    ),
    (lights_and_cameras, |it| light(it, 0)["intensity"] = json!(-1), "light 0 has a colour or an intensity"),
    (
        lights_and_cameras,
        |it| *light(it, 0) = json!({"type": "area", "intensity": 0}),
        "light 0 does not shine: light 0 has a `type` that is not known",
    ),
    (lights_and_cameras, |it| light(it, 0)["range"] = json!(0), "light 0 has the range 0"),
    (
        lights_and_cameras,
        |it| light(it, 1)["spot"]["innerConeAngle"] = json!(0.5),
        "light 1 has a cone of the angles 0.5 and 0.4",
    ),
    (
        lights_and_cameras,
        |it| {
            light(it, 1).as_object_mut().map(|light| light.remove("spot"));
        },
        "light 1 has no `spot`",
    ),
    (bending_tube_at_rest, |it| set_joint(it, 0, 3), "mesh 0 primitive 0 has the index 3 of 3 joints of skin 0"),
    (
        bending_tube_at_rest,
        |it| it.json["accessors"][6]["count"] = json!(2),
        "skin 0 has 2 inverse bind matrices, but 3 joints",
    ),
    (bending_tube_at_rest, |it| it.json["skins"][0]["joints"] = json!([]), "skin 0 has no joints"),
    (bending_tube_at_rest, |it| set_number(it, 6, 3, 0.5), "skin 0 has an inverse bind matrix 0 that is not affine"),
    (
        bending_tube_at_rest,
        |it| {
            let index = it.json["nodes"].as_array().map_or(0, Vec::len);
            it.push("nodes", json!({"children": [index]}));
            it.json["skins"][0]["joints"][2] = json!(index);
        },
        "one of whose joints is in no place",
    ),
    (bending_tube_at_rest, |it| set_number(it, 5, 0, -1.0), "mesh 0 primitive 0 has a negative weight at vertex 0"),
    (
        bending_tube_at_rest,
        |it| set_number(it, 7, 0, 5.0),
        "animation 0 (bend) channel 0 has no times, or ones that do not increase",
    ),
    (
        bending_tube_at_rest,
        |it| it.json["accessors"][8]["count"] = json!(2),
        "animation 0 (bend) channel 0 has 8 numbers, but 12 for 3 times",
    ),
    (
        bending_tube_at_rest,
        |it| it.json["animations"][0]["channels"][0]["target"]["path"] = json!("weights"),
        "animates morph weights of node 2, which has none",
    ),
    (
        morphing_sphere_at_rest,
        |it| it.json["meshes"][0]["weights"] = json!([1]),
        "mesh 0 has 1 morph weights, but 2 morph targets",
    ),
    (
        morphing_sphere_at_rest,
        |it| it.json["accessors"][0]["count"] = json!(7),
        "positions of morph target 0 of mesh 0 primitive 0 has 7 values",
    ),
];

fn bending_tube_at_rest() -> Builder {
    bending_tube(None)
}

fn morphing_sphere_at_rest() -> Builder {
    let mut builder = morphing_sphere(None);
    builder.json.as_object_mut().map(|json| json.remove("animations"));
    builder
}

fn light(it: &mut Builder, index: usize) -> &mut Value {
    &mut it.json["extensions"]["KHR_lights_punctual"]["lights"][index]
}

/// Changes a number of four bytes in a buffer view.
fn set_word(it: &mut Builder, view: usize, index: usize, word: u32) {
    let offset = it.json["bufferViews"][view]["byteOffset"].as_u64().unwrap_or(0) as usize;
    it.binary[offset + index * 4..][..4].copy_from_slice(&word.to_le_bytes());
}

fn set_float(it: &mut Builder, view: usize, index: usize, number: f32) {
    set_word(it, view, index, number.to_bits());
}

/// Changes a number of an accessor.
fn set_number(it: &mut Builder, accessor: usize, index: usize, number: f32) {
    let view = it.json["accessors"][accessor]["bufferView"].as_u64().unwrap_or(0) as usize;
    set_float(it, view, index, number);
}

/// Changes a joint of the first vertex.
fn set_joint(it: &mut Builder, index: usize, joint: u8) {
    let view = it.json["accessors"][4]["bufferView"].as_u64().unwrap_or(0) as usize;
    let offset = it.json["bufferViews"][view]["byteOffset"].as_u64().unwrap_or(0) as usize;
    it.binary[offset + index] = joint;
}

fn named() -> Result<(), Failed> {
    let mut problems = Vec::new();
    for (number, (scene, change, expected)) in CHANGES.iter().enumerate() {
        let mut builder = scene();
        let whole = load_memory("malformed", builder.glb(), &MOVING)?;
        change(&mut builder);
        let problem = match load_memory("malformed", builder.glb(), &MOVING) {
            Ok(world) => {
                let is_named = world.warnings.iter().any(|warning| warning.contains(expected));
                let is_drawn = world.object_count() == whole.object_count();
                let wrong = !is_named || !is_drawn || world.cameras != whole.cameras;
                wrong.then(|| format!("{} objects, {:?}", world.object_count(), world.warnings))
            }
            // Nothing of the one object is left.
            Err(error) => {
                let text = error.to_string();
                let is_named = text.contains(expected) && text.contains("nothing of it can be drawn");
                (!is_named).then_some(text)
            }
        };
        problems.extend(problem.map(|problem| format!("{number}: {problem}, not {expected:?}")));
    }
    expect(problems.is_empty(), || problems.join("\n"))
}

const MOVING: LoadOptions = LoadOptions { time: Some(0.5), ..AT_REST };
