//! Where the bytes of a file are: in a binary chunk, in files beside it, in URIs.

use std::fs;

use libtest_mimic::Failed;
use serde_json::json;

use crate::fixture::{AT_REST, Drawn, draw_world, expect, expect_color, folder, load_file};
use crate::generate::builder::png;
use crate::generate::static_scenes::{four_colors, textured_square};

pub const CASES: &[crate::Case] = &[
    ("buffers_and_images_in_files_and_uris_are_as_in_a_glb", files_and_uris),
    ("compact_and_sparse_accessors_are_as_floats", compact),
];

fn files_and_uris() -> Result<(), Failed> {
    let builder = textured_square();
    let folder = folder("sources");
    let draw = |name: &str, bytes: &[u8]| -> Result<Drawn, Failed> {
        fs::write(folder.join(name), bytes)?;
        let world = load_file(&folder.join(name), &AT_REST)?;
        expect(world.warnings.is_empty(), || format!("{:?}", world.warnings))?;
        draw_world("sources", &world)
    };
    let expected = draw("whole.glb", &builder.glb())?;
    expect(expected.at(0.4, 0.3)[0] > 150, || "the square is not there".to_owned())?;

    fs::create_dir_all(folder.join("parts and more"))?;
    fs::write(folder.join("parts and more/buffer.bin"), &builder.binary)?;
    fs::write(folder.join("colors.png"), png(&four_colors(64)))?;
    let mut beside = textured_square();
    beside.json["images"] = json!([{"uri": "colors.png"}]);
    let in_files = draw("files.gltf", &beside.gltf("parts%20and%20more/buffer.bin"))?;
    expect(in_files.difference(&expected) == 0, || "files beside it make another picture".to_owned())?;

    let encoded: String = builder.binary.iter().map(|byte| format!("%{byte:02x}")).collect();
    let in_uri = draw("uri.gltf", &builder.gltf(&format!("data:application/octet-stream,{encoded}")))?;
    expect(in_uri.difference(&expected) == 0, || "a data URI makes another picture".to_owned())?;
    let encoded = format!("data:application/octet-stream;base64,{}", base64(&builder.binary));
    let in_base64 = draw("base64.gltf", &builder.gltf(&encoded))?;
    expect(in_base64.difference(&expected) == 0, || "base64 makes another picture".to_owned())?;

    let rgb = image::DynamicImage::from(four_colors(64)).into_rgb8();
    rgb.save_with_format(folder.join("colors.jpg"), image::ImageFormat::Jpeg)?;
    beside.json["images"] = json!([{"uri": "./colors.jpg"}]);
    let jpeg = draw("jpeg.gltf", &beside.gltf("parts%20and%20more/buffer.bin"))?;
    expect_color(&jpeg, [0.42, 0.35], expected.at(0.42, 0.35))?;
    expect_color(&jpeg, [0.58, 0.65], expected.at(0.58, 0.65))
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |chunk: &[u8]| {
        let byte = |index: usize| u32::from(chunk.get(index).copied().unwrap_or(0));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        let digit = |index: usize| char::from(DIGITS[(bits >> (18 - 6 * index) & 63) as usize]);
        (0..4).map(|index| if index <= chunk.len() { digit(index) } else { '=' }).collect::<String>()
    };
    bytes.chunks(3).map(digits).collect()
}

fn compact() -> Result<(), Failed> {
    let expected = textured_square();
    let mut builder = textured_square();
    let attributes = builder.json["meshes"][0]["primitives"][0]["attributes"].clone();
    let accessor = |name: &str| attributes[name].as_u64().map_or(0, |index| index as usize);
    // Texture coordinates as normalised bytes, every 4 bytes; normals as zeros of which four are replaced.
    let uvs = builder.view(&[0, 255, 9, 9, 255, 255, 9, 9, 255, 0, 9, 9, 0, 0, 9, 9]);
    builder.json["bufferViews"][uvs]["byteStride"] = json!(4);
    builder.json["accessors"][accessor("TEXCOORD_0")] =
        json!({"bufferView": uvs, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC2"});
    let numbers = builder.view(&[0, 1, 2, 3]);
    let values = builder.view(bytemuck::cast_slice(&[[0.0_f32, 0.0, 1.0]; 4]));
    builder.json["accessors"][accessor("NORMAL")] = json!({
        "componentType": 5126, "count": 4, "type": "VEC3", "sparse": {
            "count": 4, "indices": {"bufferView": numbers, "componentType": 5121}, "values": {"bufferView": values},
        },
    });
    let indices = builder.view(&[0, 1, 2, 0, 2, 3]);
    let of_indices = builder.json["meshes"][0]["primitives"][0]["indices"].as_u64().map_or(0, |index| index as usize);
    builder.json["accessors"][of_indices] =
        json!({"bufferView": indices, "componentType": 5121, "count": 6, "type": "SCALAR"});
    let [one, other] = [("floats", &expected), ("compact", &builder)]
        .map(|(name, builder)| crate::fixture::draw_builder(name, builder, &AT_REST));
    let different = one?.difference(&other?);
    expect(different == 0, || format!("{different} pixels differ"))
}
