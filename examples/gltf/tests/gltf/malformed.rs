//! Malformed containers and URIs, and files that are changed at random: errors, no panic and no hang.

use std::fs;

use libtest_mimic::Failed;
use serde_json::json;

use crate::fixture::{AT_REST, expect, folder, load_bytes, load_file};
use crate::generate::builder::{Builder, glb};
use crate::generate::deforming::bending_tube;
use crate::generate::static_scenes::{lights_and_cameras, textured_square};
use gltf_scene::LoadOptions;

pub const CASES: &[crate::Case] = &[
    ("containers_that_are_wrong_are_named", containers),
    ("what_is_left_out_is_a_warning", warnings),
    ("uris_lead_only_below_the_folder", uris),
    ("files_that_are_cut_off_or_changed_never_panic", changed),
];

type Change = fn(&mut Builder);

const MOVING: LoadOptions = LoadOptions { time: Some(0.5), ..AT_REST };

fn containers() -> Result<(), Failed> {
    let builder = textured_square();
    let whole = builder.glb();
    let with_header = |length: u32| [&whole[..8], &length.to_le_bytes(), &whole[12..]].concat();
    let short = json!({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 10}]});
    let missing = serde_json::to_vec(&short)?;
    let many = json!({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 1}, {"byteLength": 1}]});
    let deep = [b"[".repeat(100_000), b"]".repeat(100_000)].concat();
    let cases: [(&[u8], &str); 9] = [
        (b"", "it is not glTF 2.0"),
        (b"glTF", "its header is cut off"),
        (b"{}", "missing field `asset`"),
        (&with_header(3), "its header is cut off"),
        (&with_header(u32::MAX), "it is not glTF 2.0"),
        (&glb(&short, &[0; 4]), "buffer 0 has 4 bytes, but the file says 10"),
        (&missing, "buffer 0 has neither a URI nor a binary chunk"),
        (&glb(&many, &[0; 4]), "buffer 1 has neither a URI nor a binary chunk"),
        (&deep, "it is not glTF 2.0"),
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
            "mesh 0 primitive 0 of mode Lines has no triangles, and is not drawn",
        ),
        (
            |it| it.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_2"] = json!(2),
            "ignored are its texture coordinates 2",
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

fn uris() -> Result<(), Failed> {
    let folder = folder("uris");
    fs::create_dir_all(folder.join("scene"))?;
    fs::write(folder.join("secret.bin"), [0; 4096])?;
    fs::create_dir_all(folder.join("scene/folder.bin"))?;
    let absolute = folder.join("secret.bin").display().to_string();
    let uris = [
        ("../secret.bin", "leads out of the file's folder"),
        ("%2e%2e/secret.bin", "leads out of the file's folder"),
        (&absolute, "leads out of the file's folder"),
        ("https://example.com/buffer.bin", "has a scheme other than data"),
        ("folder.bin", "is not a regular file"),
        ("%ff.bin", "is not UTF-8"),
        ("data:nonsense", "buffer 0 has a URI that cannot be followed"),
    ];
    for (uri, expected) in uris {
        let path = folder.join("scene/scene.gltf");
        fs::write(&path, textured_square().gltf(uri))?;
        let error = load_file(&path, &AT_REST).err().map(|error| error.to_string()).unwrap_or_default();
        expect(error.contains(expected), || format!("{uri}: {error:?}, not {expected:?}"))?;
    }
    Ok(())
}

fn changed() -> Result<(), Failed> {
    let path = folder("changed").join("scene.glb");
    let mut loaded = 0;
    for scene in [textured_square, lights_and_cameras, small_skin] {
        let whole = scene().glb();
        // A generator of numbers that is the same on every run.
        let mut state = 1_u64;
        let mut next = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        for round in 0..1500 {
            let mut bytes = whole.clone();
            if round % 4 == 0 {
                bytes.truncate(next(whole.len()));
            } else {
                for _ in 0..=round % 3 {
                    let at = next(bytes.len());
                    // Digits stay digits, so that the JSON stays JSON.
                    bytes[at] = if bytes[at].is_ascii_digit() {
                        b'0' + next(10) as u8
                    } else if round % 2 == 0 {
                        next(256) as u8
                    } else {
                        bytes[at]
                    };
                }
            }
            fs::write(&path, &bytes)?;
            let result = std::panic::catch_unwind(|| load_file(&path, &MOVING).is_ok());
            match result {
                Ok(is_loaded) => loaded += usize::from(is_loaded),
                Err(_) => return Err(format!("round {round}: it panics; see {}", path.display()).into()),
            }
        }
    }
    expect(loaded > 200, || format!("only {loaded} changed files are loaded, so little is tested"))
}

/// The tube, with few vertices.
fn small_skin() -> Builder {
    bending_tube(None)
}
