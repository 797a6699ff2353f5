//! What the specification allows, or leaves open, is drawn: an application's own members, elements that nobody needs,
//! numbers in any form.

use drawloom_gltf::LoadOptions;
use libtest_mimic::Failed;
use serde_json::{Value, json};

use crate::fixture::{AT_REST, expect, load_memory};
use crate::generate::builder::{Builder, glb};
use crate::generate::deforming::bending_tube;
use crate::generate::static_scenes::{lights_and_cameras, textured_square};

pub const CASES: &[crate::Case] = &[
    ("valid_files_are_drawn_without_a_warning", valid),
    ("values_that_are_not_known_are_the_default_ones", unknown),
    ("text_of_other_forms_is_the_same_file", forms),
];

type Change = fn(&mut Builder);
/// A file, what is changed in it, and a part of what is then said.
type ChangedFile = (fn() -> Builder, Change, &'static str);

fn valid() -> Result<(), Failed> {
    let changes: [(fn() -> Builder, Change); 22] = [
        // Nobody needs these.
        (textured_square, |it| _ = it.push("accessors", json!({"count": -3, "type": []}))),
        (textured_square, |it| _ = it.push("bufferViews", json!({"buffer": 77, "byteLength": 1}))),
        (textured_square, |it| _ = it.push("images", json!({"uri": "nowhere.png"}))),
        (textured_square, |it| _ = it.push("skins", json!({"joints": [99]}))),
        (textured_square, |it| _ = it.push("materials", json!({"emissiveFactor": "red"}))),
        (textured_square, |it| _ = it.push("meshes", json!({"primitives": [{"attributes": {"POSITION": 99}}]}))),
        (textured_square, |it| _ = it.push("scenes", json!({"nodes": [99]}))),
        (textured_square, |it| _ = it.push("cameras", json!({"type": "fisheye"}))),
        // An application's own.
        (textured_square, |it| attributes(it)["_TEMPERATURE"] = json!(0)),
        (textured_square, |it| attributes(it)["_"] = json!(99)),
        (textured_square, |it| attributes(it)["_lower case\u{7}"] = json!("anything")),
        (textured_square, |it| it.json["nodes"][0]["extras"] = json!({"version": "1.0", "nodes": -1})),
        (textured_square, |it| it.json["fruit"] = json!(["apple"])),
        (textured_square, |it| it.json["materials"][0]["extensions"]["ACME_rust"] = json!({"rust": 1})),
        (textured_square, |it| it.json["asset"]["generator"] = json!("\u{1b}[31m")),
        // Left out, they have a default.
        (textured_square, |it| _ = it.json.as_object_mut().map(|json| json.remove("scene"))),
        (textured_square, |it| _ = it.json["accessors"][0].as_object_mut().map(|accessor| accessor.remove("min"))),
        (textured_square, |it| it.json["nodes"][0]["name"] = json!("")),
        // Channels that animate nothing, or what an extension says.
        (bending_tube_at_rest, |it| _ = target(it).as_object_mut().map(|target| target.remove("node"))),
        (bending_tube_at_rest, |it| *target(it) = json!({"path": "translation"})),
        (bending_tube_at_rest, |it| *target(it) = json!({"extensions": {}, "path": "scale"})),
        (lights_and_cameras, |it| it.json["nodes"][1]["skin"] = json!(null)),
    ];
    for (number, (scene, change)) in changes.into_iter().enumerate() {
        for time in [None, Some(0.5)] {
            let mut builder = scene();
            if builder.json.get("animations").is_none() && time.is_some() {
                continue;
            }
            change(&mut builder);
            let world = load_memory("valid.glb", builder.glb(), &LoadOptions { time, ..AT_REST });
            let world = world.map_err(|error| format!("{number}: {error}"))?;
            expect(world.warnings.is_empty() && world.object_count() > 0, || {
                format!("{number}: {:?}", world.warnings)
            })?;
        }
    }
    Ok(())
}

/// The validator warns of these, and takes the file.
fn unknown() -> Result<(), Failed> {
    let changes: [ChangedFile; 14] = [
        (textured_square, |it| primitive(it)["mode"] = json!(9), "has the mode 9, which is not known"),
        (textured_square, |it| sampled(it, "wrapS", 5), "sampler 0 has the wrapS 5, which is not known"),
        (textured_square, |it| sampled(it, "magFilter", 1), "sampler 0 has the magFilter 1, which is not known"),
        (textured_square, |it| sampled(it, "minFilter", 0), "sampler 0 has the minFilter 0, which is not known"),
        (
            textured_square,
            |it| it.json["materials"][0]["alphaMode"] = json!("GLASS"),
            "an `alphaMode` that is not known",
        ),
        (
            textured_square,
            |it| it.json["cameras"][0]["type"] = json!("fisheye"),
            "neither perspective nor orthographic",
        ),
        (textured_square, |it| it.json["cameras"][0]["perspective"]["yfov"] = json!(3.5), "is drawn as 3.14"),
        (textured_square, |it| it.json["textures"][0] = json!({}), "has no image of a format that is read"),
        (textured_square, |it| it.json["accessors"][3]["count"] = json!(5), "and is drawn without the last 2"),
        (textured_square, |it| it.json["scene"] = json!(7), "the first one is drawn"),
        (lights_and_cameras, |it| light(it)["type"] = json!("area"), "light 0 has a `type` that is not known"),
        (bending_tube_at_rest, |it| target(it)["path"] = json!("visible"), "animates \"visible\", which is not known"),
        (bending_tube_at_rest, |it| target(it)["path"] = json!("pointer"), "animates \"pointer\", which is not known"),
        (
            bending_tube_at_rest,
            |it| it.json["extensionsUsed"] = json!(["KHR_animation_pointer", "KHR_lights_punctual"]),
            "the extension KHR_animation_pointer is ignored",
        ),
    ];
    for (number, (scene, change, expected)) in changes.into_iter().enumerate() {
        // What is not needed at rest is named, too.
        for time in [None, Some(0.5)] {
            let mut builder = scene();
            change(&mut builder);
            let world = load_memory("unknown.glb", builder.glb(), &LoadOptions { time, ..AT_REST });
            let world = world.map_err(|error| format!("{number}: {error}"))?;
            let is_named = world.warnings.iter().any(|warning| warning.contains(expected));
            expect(is_named && world.object_count() > 0, || format!("{number} at {time:?}: {:?}", world.warnings))?;
        }
    }
    Ok(())
}

fn forms() -> Result<(), Failed> {
    let builder = textured_square();
    let mut json = builder.json.clone();
    json["buffers"] = json!([{"byteLength": builder.binary.len()}]);
    let binary = &builder.binary;
    let text = json.to_string();
    let chunk = |text: &str| glb_of_text(text.as_bytes(), binary);
    let deep = format!("{}{}", "[".repeat(5000), "]".repeat(5000));
    let unknown_chunk = [builder.glb(), 4_u32.to_le_bytes().to_vec(), b"ACME".to_vec(), vec![0; 4]].concat();
    let mut in_floats = json.clone();
    as_floats(&mut in_floats);
    let files: [(&str, Vec<u8>, Option<&str>); 9] = [
        ("numbers as fractions", glb(&in_floats, binary), None),
        (
            "numbers with exponents",
            chunk(&text.replace("\"count\":4", "\"count\":4e0").replace("5126", "51.26e2")),
            None,
        ),
        ("space around", chunk(&format!("\n\t {text} \r\n")), None),
        ("deep extras", chunk(&text.replacen('{', &format!("{{\"extras\":{deep},"), 1)), None),
        ("a deep extension", chunk(&text.replacen('{', &format!("{{\"extensions\":{{\"ACME\":{deep}}},"), 1)), None),
        ("a member twice", chunk(&text.replacen('{', "{\"nodes\":[{\"camera\":99}],\"asset\":7,", 1)), None),
        ("escapes", chunk(&text.replace("POSITION", "\\u0050OSITION")), None),
        ("a byte order mark", chunk(&format!("\u{feff}{text}")), Some("byte order mark")),
        ("a chunk of another type", unknown_chunk, Some("a chunk of the .glb is of another type")),
    ];
    for (name, bytes, warning) in files {
        let world = load_memory("form.glb", bytes, &AT_REST).map_err(|error| format!("{name}: {error}"))?;
        let warnings: Vec<_> = world.warnings.iter().filter(|it| !it.starts_with("the header says")).collect();
        let is_said = match warning {
            None => warnings.is_empty(),
            Some(warning) => warnings.len() == 1 && warnings[0].contains(warning),
        };
        expect(is_said && world.object_count() == 1 && world.cameras == 1, || format!("{name}: {warnings:?}"))?;
    }
    Ok(())
}

/// Writes whole numbers as `5126.0`.
fn as_floats(json: &mut Value) {
    match json {
        Value::Number(number) => *json = json!(number.as_f64().unwrap_or(0.0)),
        Value::Array(values) => values.iter_mut().for_each(as_floats),
        Value::Object(members) => members.values_mut().for_each(as_floats),
        _ => {}
    }
}

fn glb_of_text(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let word = |number: usize| (number as u32).to_le_bytes();
    let parts: [&[u8]; 9] = [
        b"glTF",
        &word(2),
        &word(28 + json.len() + binary.len()),
        &word(json.len()),
        b"JSON",
        &json,
        &word(binary.len()),
        b"BIN\0",
        binary,
    ];
    parts.concat()
}

fn bending_tube_at_rest() -> Builder {
    bending_tube(None)
}

fn primitive(it: &mut Builder) -> &mut Value {
    &mut it.json["meshes"][0]["primitives"][0]
}

fn attributes(it: &mut Builder) -> &mut Value {
    &mut primitive(it)["attributes"]
}

fn target(it: &mut Builder) -> &mut Value {
    &mut it.json["animations"][0]["channels"][0]["target"]
}

fn light(it: &mut Builder) -> &mut Value {
    &mut it.json["extensions"]["KHR_lights_punctual"]["lights"][0]
}

fn sampled(it: &mut Builder, member: &str, number: u32) {
    let sampler = it.push("samplers", json!({}));
    it.json["samplers"][sampler][member] = json!(number);
    it.json["textures"][0]["sampler"] = json!(sampler);
}
