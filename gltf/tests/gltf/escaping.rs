//! No character of a file that does more than show reaches a terminal or a report, wherever in the file it is.

use drawloom_gltf::{GltfLimits, LoadOptions};
use libtest_mimic::Failed;
use serde_json::{Value, json};

use crate::fixture::{AT_REST, expect, load_memory};
use crate::generate::builder::{Builder, glb};
use crate::generate::deforming::{bending_tube, morphing_sphere};
use crate::generate::static_scenes::{alpha_modes, lights_and_cameras, textured_square};
use crate::invariants::{check_text, check_world};

pub const CASES: &[crate::Case] = &[
    ("names_are_escaped_wherever_they_are", names),
    ("strings_are_escaped_wherever_they_are", strings),
    ("images_without_a_name_are_called_by_their_uri", images),
    ("long_names_are_cut", long),
];

/// A title of a window, a colour, an 8-bit control, ends of lines, and all that turns the direction of text.
const ATTACK: &str = "m\u{1b}]0;title\u{7}\u{1b}[31m\u{9b}2J\r\n\u{2028}\u{2029}\u{61c}\u{200e}\u{200f}\u{202a}\u{202b}\
                      \u{202c}\u{202d}\u{202e}\u{2066}\u{2067}\u{2068}\u{2069}";

/// Every element has a name, and something is wrong with it.
fn names() -> Result<(), Failed> {
    let mut seen = 0;
    for scene in [lights_and_cameras, alpha_modes, || bending_tube(None), || morphing_sphere(None)] {
        let scene: fn() -> Builder = scene;
        let whole = scene();
        for kind in
            ["meshes", "nodes", "materials", "cameras", "skins", "animations", "accessors", "bufferViews", "images"]
        {
            for wrong in [json!(null), json!({}), json!(-1), json!("x"), json!([99])] {
                let mut builder = scene();
                let Some(elements) = builder.json[kind].as_array_mut() else { continue };
                for element in elements {
                    let members = element.as_object_mut().ok_or("it is an object")?;
                    members.values_mut().for_each(|value| *value = wrong.clone());
                    members.insert("name".to_owned(), json!(ATTACK));
                }
                seen += check(&builder, &whole)?;
            }
        }
    }
    expect(seen > 20, || format!("the names are seen {seen} times, so little is tested"))
}

/// Every string of a file is replaced by an attack, and every name of a member that is free.
fn strings() -> Result<(), Failed> {
    let mut seen = 0;
    for scene in [lights_and_cameras, alpha_modes, || bending_tube(None), || morphing_sphere(None)] {
        let scene: fn() -> Builder = scene;
        let whole = scene();
        let mut number = 0;
        loop {
            let mut builder = scene();
            builder.json["images"] = json!([{"uri": "none.png"}]);
            builder.json["textures"] = json!([{"source": 0}]);
            builder.json["materials"][0]["emissiveTexture"] = json!({"index": 0});
            builder.json["extensionsRequired"] = json!(["KHR_texture_transform"]);
            builder.json["nodes"][0]["name"] = json!("a node");
            let attributes = &mut builder.json["meshes"][0]["primitives"][0]["attributes"];
            attributes[ATTACK] = json!(0);
            let mut left = number;
            replace(&mut builder.json, &mut left);
            if left > 0 {
                break;
            }
            seen += check(&builder, &whole)?;
            number += 1;
        }
    }
    expect(seen > 20, || format!("the strings are seen {seen} times, so little is tested"))
}

/// Replaces one string: `left` counts down to it.
fn replace(json: &mut Value, left: &mut i32) {
    match json {
        Value::String(text) => {
            if *left == 0 {
                *text = ATTACK.to_owned();
            }
            *left -= 1;
        }
        Value::Array(values) => values.iter_mut().for_each(|value| replace(value, left)),
        Value::Object(members) => members.values_mut().for_each(|value| replace(value, left)),
        _ => {}
    }
}

/// Loads a file at rest and in motion. Returns how often what it says has the attack, escaped.
fn check(builder: &Builder, whole: &Builder) -> Result<usize, Failed> {
    let mut json = builder.json.clone();
    json["buffers"] = json!([{"byteLength": whole.binary.len()}]);
    let mut seen = 0;
    for time in [None, Some(0.5)] {
        let options = LoadOptions { time, ..AT_REST };
        let texts = match load_memory("escaped.glb", glb(&json, &whole.binary), &options) {
            Ok(world) => {
                check_world(&world, &GltfLimits::DEFAULT)?;
                [world.warnings.clone(), world.animations.clone()].concat()
            }
            Err(error) => [error.warnings.clone(), vec![error.to_string()]].concat(),
        };
        texts.iter().try_for_each(|text| check_text(text))?;
        let is_escaped = |text: &&String| text.contains("m\\u{1b}]0;title\\u{7}");
        seen += texts.iter().filter(is_escaped).count();
    }
    Ok(seen)
}

fn images() -> Result<(), Failed> {
    let images = [
        (json!({"uri": "sky\u{1b}[31m.png"}), "image 0 (sky\\u{1b}[31m.png) is left out"),
        (json!({"uri": "sky.png", "name": "the sky"}), "image 0 (the sky) is left out"),
        (json!({"uri": "data:image/png;base64,AAAA"}), "image 0 is left out"),
        (json!({"uri": "x".repeat(1000)}), &format!("image 0 ({}…) is left out", "x".repeat(80))),
    ];
    for (image, expected) in images {
        let mut builder = textured_square();
        builder.json["images"] = json!([image]);
        let world = load_memory("no such folder/images.glb", builder.glb(), &AT_REST)?;
        let is_named = world.warnings.len() == 1 && world.warnings[0].starts_with(expected);
        expect(is_named, || format!("{:?}, not {expected:?}", world.warnings))?;
    }
    Ok(())
}

fn long() -> Result<(), Failed> {
    let mut builder = bending_tube(None);
    let name = "a long name ".repeat(100_000);
    for kind in ["meshes", "nodes", "skins", "animations", "materials"] {
        builder.json[kind][0]["name"] = json!(name);
    }
    builder.json["meshes"][0]["primitives"][0]["attributes"][&name] = json!(0);
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual", name]);
    let world = load_memory("long.glb", builder.glb(), &AT_REST)?;
    expect(world.warnings.len() == 2, || format!("{:?}", world.warnings))?;
    Ok(check_world(&world, &GltfLimits::DEFAULT)?)
}
