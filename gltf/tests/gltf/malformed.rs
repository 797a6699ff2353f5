//! Malformed containers and URIs.

use std::fs;

use libtest_mimic::Failed;
use serde_json::json;

use crate::fixture::{AT_REST, expect, folder, load_bytes, load_file};
use crate::generate::builder::Builder;
use crate::generate::static_scenes::textured_square;

pub const CASES: &[crate::Case] = &[
    ("containers_that_are_wrong_are_named", containers),
    ("what_is_left_out_is_a_warning", warnings),
    ("halves_of_surrogate_pairs_in_names_lose_no_file", surrogates),
    ("uris_lead_only_below_the_folder", uris),
];

type Change = fn(&mut Builder);

fn containers() -> Result<(), Failed> {
    let builder = textured_square();
    let whole = builder.glb();
    let deep = [b"[".repeat(100_000), b"]".repeat(100_000)].concat();
    let cases: [(&[u8], &str); 9] = [
        (b"", "it is not glTF 2.0"),
        (b"glTF", "its header is cut off"),
        (b"{}", "no `asset`, and so no version"),
        (b"[1, 2]", "no `asset`, and so no version"),
        (b"{\"asset\": {\"version\": \"2.0\"}", "its JSON is cut off"),
        (b"{\"asset\": {\"version\": \"2.0\"}} {}", "trailing characters"),
        (&whole[..60], "its JSON chunk has"),
        (&[b"\xff\xfe".as_slice(), b"{\0}\0"].concat(), "is UTF-16, as its byte order mark says"),
        (&deep, "no `asset`, and so no version"),
    ];
    for (bytes, expected) in cases {
        let error = load_bytes("containers", bytes, &AT_REST).err().map(|error| error.to_string()).unwrap_or_default();
        expect(error.contains(expected), || format!("{error:?}, not {expected:?}"))?;
    }
    Ok(())
}

fn warnings() -> Result<(), Failed> {
    let changes: [(Change, &str); 7] = [
        (
            |it| it.json["extensionsUsed"] = json!(["KHR_materials_sheen"]),
            "the extension KHR_materials_sheen is ignored",
        ),
        (
            |it| it.json["meshes"][0]["primitives"][0]["mode"] = json!(1),
            "mesh 0 primitive 0 has the mode Lines, not triangles, and is not drawn",
        ),
        (
            |it| it.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_2"] = json!(2),
            "mesh 0 primitive 0: its attribute TEXCOORD_2 is ignored",
        ),
        (|it| it.json["cameras"][0]["perspective"]["aspectRatio"] = json!(1), "camera 0: its height is kept"),
        (
            |it| it.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = json!(3),
            "material 0 uses texture coordinates 3",
        ),
        (|it| it.json["scenes"][0]["nodes"] = json!([]), "the scene has nothing to draw"),
        (|it| (0..8).for_each(|_| it.sun(1.0)), "only the first 8 directional lights and cones cast shadows"),
    ];
    for (change, expected) in changes {
        let mut builder = textured_square();
        change(&mut builder);
        let warnings = load_bytes("warnings", &builder.glb(), &AT_REST)?.warnings;
        expect(warnings.iter().any(|warning| warning.contains(expected)), || {
            format!("{warnings:?}, not {expected:?}")
        })?;
    }
    Ok(())
}

/// JSON can escape what UTF-8 cannot have.
fn surrogates() -> Result<(), Failed> {
    let names = [
        ("\\ud800", "\u{fffd}"),
        ("a\\uDFFFb", "a\u{fffd}b"),
        ("\\ud800\\ud800\\udc00", "\u{fffd}\u{10000}"),
        ("\\udc00\\ud800", "\u{fffd}\u{fffd}"),
        ("\\uD83D\\uDE00", "\u{1f600}"),
        ("\\\\ud800", "\\ud800"),
        ("\\u00e9\\ud900", "\u{e9}\u{fffd}"),
        ("\\\"\\udabc\\\"", "\"\u{fffd}\""),
    ];
    for (escaped, name) in names {
        let mut builder = textured_square();
        builder.json["images"][0] = json!({"name": "NAME", "uri": "no such image.png"});
        let glb = builder.gltf("");
        let text = String::from_utf8(glb)?.replace("NAME", escaped).replace("\"uri\":\"\"", "\"uri\":\"data:,\"");
        let world = load_bytes("surrogates", text.as_bytes(), &AT_REST);
        let warnings = world.map_or_else(|error| error.warnings, |world| world.warnings);
        let expected = format!("image 0 ({name}) is left out");
        let is_named = warnings.iter().any(|warning| warning.contains(&expected));
        expect(is_named, || format!("{escaped}: {warnings:?}, not {expected:?}"))?;
    }
    // What is cut off is an error of JSON.
    for text in ["\\", "\\u", "\\ud80", "\\ud800", "\\ud800\\u", "\\ud800\\udc0"] {
        let text = format!("{{\"asset\": {{\"version\": \"2.0\"}}, \"a\": \"{text}");
        let error = load_bytes("surrogates", text.as_bytes(), &AT_REST).err().map(|error| error.to_string());
        let error = error.ok_or("it is drawn")?;
        expect(error.contains("its JSON is cut off"), || error)?;
    }
    Ok(())
}

fn uris() -> Result<(), Failed> {
    let folder = folder("uris");
    fs::create_dir_all(folder.join("scene"))?;
    fs::write(folder.join("secret.bin"), [0; 4096])?;
    fs::create_dir_all(folder.join("scene/folder.bin"))?;
    let absolute = folder.join("secret.bin").display().to_string();
    // Of 4,097 characters, and of 4,096, of which some are escaped.
    let (too_long, long) = (format!("{}.bin", "x".repeat(4093)), format!("{}.bin", "%78".repeat(4092)));
    let uris = [
        ("../secret.bin", "leads out of the file's folder"),
        ("%2e%2e/secret.bin", "leads out of the file's folder"),
        (&absolute, "leads out of the file's folder"),
        ("https://example.com/buffer.bin", "has a scheme other than data"),
        ("folder.bin", "is not a regular file"),
        ("%ff.bin", "is not UTF-8"),
        (&too_long, "is longer than a path can be"),
        (&long, "cannot be read"),
        ("data:nonsense", "buffer 0 has a URI that cannot be followed"),
    ];
    for (uri, expected) in uris {
        let path = folder.join("scene/scene.gltf");
        fs::write(&path, textured_square().gltf(uri))?;
        let error = load_file(&path, &AT_REST).err().map(|error| error.to_string()).unwrap_or_default();
        let is_named = error.contains(expected) && error.contains("nothing of it can be drawn");
        expect(is_named, || format!("{uri}: {error:?}, not {expected:?}"))?;
    }
    Ok(())
}
