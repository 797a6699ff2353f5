//! What is made of a file is bounded, and not only what is read of it: small files that would grow are refused at once,
//! by the name of the limit.

use drawloom_gltf::{GltfLimits, LoadOptions};
use libtest_mimic::Failed;
use serde_json::{Value, json};

use crate::fixture::{AT_REST, expect, load_memory};
use crate::generate::builder::{Builder, glb, png};
use crate::generate::deforming::{bending_tube, morphing_sphere};
use crate::generate::static_scenes::textured_square;
use crate::invariants::check_world;

pub const CASES: &[crate::Case] = &[
    ("small_files_that_would_grow_are_refused_by_the_name_of_the_limit", growing),
    ("images_beyond_a_limit_are_left_out_by_its_name", images),
    ("images_that_cannot_be_decoded_count_as_what_is_read_of_them", unreadable_images),
    ("lights_beyond_a_limit_are_left_out_and_counted", lights),
    ("a_limit_that_is_just_enough_changes_nothing", just_enough),
    ("sparse_accessors_have_as_many_zeros_as_their_values_allow", sparse),
    ("hierarchies_may_be_deep_and_round", hierarchies),
    ("warnings_are_counted_and_listed_up_to_a_limit", warnings),
    ("options_of_any_numbers_load_a_file_or_say_what_is_wrong", options),
];

type Change = fn(&mut Builder);
/// A file, what is changed in it, and a part of what is then said.
type ChangedFile = (fn() -> Builder, Change, &'static str);

/// Files of a few kilobytes, with the limits that a user has not changed.
fn growing() -> Result<(), Failed> {
    let changes: [ChangedFile; 16] = [
        (textured_square, |it| zeros(it, 0, 177_999_999), "zero_bytes"),
        (textured_square, |it| zeros(it, 0, 1 << 40), "zero_bytes"),
        (textured_square, |it| zeros(it, 0, 9_000_000_000_000_000), "zero_bytes"),
        (textured_square, |it| zeros(it, 3, 1 << 28), "zero_bytes"),
        // Sparse: four values of many are there.
        (
            textured_square,
            |it| {
                let (indices, values) = (it.view(&[0, 1, 2, 3]), it.view(&[0; 48]));
                zeros(it, 0, 100_000_000);
                let (indices, values) =
                    (json!({"bufferView": indices, "componentType": 5121}), json!({"bufferView": values}));
                it.json["accessors"][0]["sparse"] = json!({"count": 4, "indices": indices, "values": values});
            },
            "zero_bytes",
        ),
        // Sparse accessors that say that many values are there.
        (
            textured_square,
            |it| {
                let (indices, values) = (it.view(&[0, 1, 2, 3]), it.view(&[0; 48]));
                zeros(it, 0, 100_000_000);
                let (indices, values) =
                    (json!({"bufferView": indices, "componentType": 5121}), json!({"bufferView": values}));
                let sparse = json!({"count": 4, "indices": indices, "values": values});
                it.json["accessors"][0]["sparse"] = sparse.clone();
                it.json["accessors"][2]["sparse"] = sparse;
                it.json["accessors"][2]["sparse"]["count"] = json!(100_000_000);
            },
            "zero_bytes",
        ),
        // Each below the limit, and all together above.
        (
            textured_square,
            |it| {
                zeros(it, 0, 100_000);
                let primitive = json!({"attributes": {"POSITION": 0}, "indices": 3});
                it.json["meshes"][0]["primitives"] = (0..300).map(|_| primitive.clone()).collect();
            },
            "zero_bytes",
        ),
        // A target takes 36 bytes for each vertex.
        (
            textured_square,
            |it| {
                zeros(it, 0, 100_000);
                let primitive = &mut it.json["meshes"][0]["primitives"][0];
                *primitive = json!({"attributes": {"POSITION": 0}, "indices": 3});
                primitive["targets"] = (0..500).map(|_| json!({"NORMAL": 0})).collect();
            },
            "zero_bytes",
        ),
        // Primitives times nodes.
        (
            textured_square,
            |it| {
                let primitive = it.json["meshes"][0]["primitives"][0].clone();
                it.json["meshes"][0]["primitives"] = (0..1500).map(|_| primitive.clone()).collect();
                (0..1500).for_each(|_| _ = it.root(json!({"mesh": 0})));
            },
            "objects",
        ),
        // Joints times nodes.
        (
            || bending_tube(None),
            |it| {
                let joints: Vec<_> = (0..3000).map(|joint| joint % 3).collect();
                it.json["skins"][0] = json!({"joints": joints});
                (0..1000).for_each(|_| _ = it.root(json!({"mesh": 0, "skin": 0})));
            },
            "pose_bytes",
        ),
        // The same where no vertex has joints.
        (
            || bending_tube(None),
            |it| {
                leave_out_vertex_joints(it);
                let joints: Vec<_> = (0..3000).map(|joint| joint % 3).collect();
                it.json["skins"][0] = json!({"joints": joints});
                (0..1000).for_each(|_| _ = it.root(json!({"mesh": 0, "skin": 0})));
            },
            "pose_bytes",
        ),
        // The joints of a skin alone, which one node has.
        (
            || bending_tube(None),
            |it| {
                leave_out_vertex_joints(it);
                it.json["skins"][0] = json!({"joints": vec![0; 250_000]});
            },
            "pose_bytes",
        ),
        // Joints of a mesh without a skin, below a skewed node.
        (
            || bending_tube(None),
            |it| {
                let joints: Vec<[u8; 8]> = vec![[0xff; 8]; 31 * 25];
                let view = it.view(joints.as_flattened());
                let primitive = &it.json["meshes"][0]["primitives"][0];
                let accessor = primitive["attributes"]["JOINTS_0"].as_u64().map_or(0, |index| index as usize);
                it.json["accessors"][accessor]["componentType"] = json!(5123);
                it.json["accessors"][accessor]["bufferView"] = json!(view);
                let skewed = json!([1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
                (0..100).for_each(|_| _ = it.root(json!({"mesh": 0, "matrix": skewed})));
            },
            "pose_bytes",
        ),
        // Weights times nodes.
        (
            || morphing_sphere(None),
            |it| {
                let targets: Vec<_> = (0..10_000).map(|_| json!({"POSITION": 0})).collect();
                let primitive = json!({"attributes": {"POSITION": 0}, "targets": targets});
                it.json["meshes"][0] = json!({"primitives": [primitive]});
                it.json["accessors"][0]["count"] = json!(3);
                (0..4000).for_each(|_| _ = it.root(json!({"mesh": 0})));
            },
            "pose_bytes",
        ),
        // The same where the targets move nothing.
        (
            || morphing_sphere(None),
            |it| {
                it.json["meshes"][0]["primitives"][0]["targets"] = vec![json!({}); 10_000].into();
                (0..4000).for_each(|_| _ = it.root(json!({"mesh": 0})));
            },
            "pose_bytes",
        ),
        // Keyframes for each channel again.
        (
            || bending_tube(None),
            |it| {
                let times = it.json["animations"][0]["samplers"][0]["input"].as_u64().map_or(0, |index| index as usize);
                it.json["accessors"][times]["count"] = json!(1 << 25);
                it.json["accessors"][times].as_object_mut().map(|accessor| accessor.remove("bufferView"));
            },
            "zero_bytes",
        ),
    ];
    for (number, (scene, change, expected)) in changes.into_iter().enumerate() {
        let mut builder = scene();
        change(&mut builder);
        refused(number, builder.glb(), GltfLimits::DEFAULT, expected)?;
    }
    // What is large in the file, with limits below that.
    let builder = textured_square();
    let limits = |change: fn(&mut GltfLimits)| {
        let mut limits = GltfLimits::DEFAULT;
        change(&mut limits);
        limits
    };
    let uri = format!("data:application/octet-stream;base64,{}", "AAAA".repeat(builder.binary.len() / 3 + 1));
    refused(20, builder.gltf(&uri), limits(|it| it.buffer_bytes = 100), "buffer_bytes")?;
    refused(21, builder.glb(), limits(|it| it.json_values = 50), "json_values")?;
    refused(22, builder.glb(), limits(|it| it.geometry_bytes = 100), "geometry_bytes")?;
    refused(23, builder.glb(), limits(|it| it.objects = 0), "objects")?;
    let moving = limits(|it| it.keyframe_bytes = 60);
    refused(24, bending_tube(None).glb(), moving, "keyframe_bytes")?;
    let posed = limits(|it| it.pose_bytes = 191);
    refused(25, bending_tube(None).glb(), posed, "pose_bytes")?;
    let path = crate::fixture::folder("limits").join("scene.glb");
    std::fs::write(&path, builder.glb())?;
    let options = LoadOptions { limits: limits(|it| it.scene_bytes = 1000), ..AT_REST };
    let error = crate::fixture::load_file(&path, &options).err().map(|error| error.to_string()).unwrap_or_default();
    expect(error.contains("`GltfLimits::scene_bytes` is 1000"), || error)
}

fn refused(number: usize, bytes: Vec<u8>, limits: GltfLimits, expected: &str) -> Result<(), Failed> {
    let options = LoadOptions { limits, time: Some(0.5), ..AT_REST };
    let error = load_memory("growing.glb", bytes, &options).err().map(|error| error.to_string());
    let error = error.ok_or_else(|| format!("{number}: it is drawn"))?;
    expect(error.contains(&format!("`GltfLimits::{expected}` is")), || format!("{number}: {error}, not {expected}"))
}

/// Makes an accessor one of zeros.
fn zeros(it: &mut Builder, accessor: usize, count: u64) {
    it.json["accessors"][accessor]["count"] = json!(count);
    it.json["accessors"][accessor].as_object_mut().map(|accessor| accessor.remove("bufferView"));
}

fn leave_out_vertex_joints(it: &mut Builder) {
    let attributes = &mut it.json["meshes"][0]["primitives"][0]["attributes"];
    attributes.as_object_mut().map(|attributes| ["JOINTS_0", "WEIGHTS_0"].map(|name| attributes.remove(name)));
}

fn images() -> Result<(), Failed> {
    // A file of a few hundred bytes per megapixel: one colour.
    let large = png(&image::RgbaImage::new(2000, 1000));
    let deep = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let image = image::DynamicImage::from(image::ImageBuffer::<image::Rgba<u16>, _>::new(300, 100));
        image.write_to(&mut bytes, image::ImageFormat::Png)?;
        bytes.into_inner()
    };
    let limits = GltfLimits { texture_bytes: 300 * 100 * 12 - 1, ..GltfLimits::DEFAULT };
    left_out(&large, limits, "image 1 takes 8000000 bytes or more, and `GltfLimits::texture_bytes` is 359999")?;
    left_out(&deep, limits, "image 1 takes 360000 bytes or more, and `GltfLimits::texture_bytes` is 359999")?;
    // What another format is converted from is there meanwhile, and what a decoder of JPEGs keeps.
    let rgb = image::DynamicImage::from(image::RgbImage::new(300, 100));
    let encoded = |image: &image::DynamicImage, format: image::ImageFormat| -> Result<Vec<u8>, Failed> {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write_to(&mut bytes, format)?;
        Ok(bytes.into_inner())
    };
    let jpeg = encoded(&rgb, image::ImageFormat::Jpeg)?;
    // As far as the headers go, which is all that is read before the limit is checked.
    let progressive = {
        let mut jpeg = jpeg.clone();
        let frame = jpeg.windows(2).position(|pair| pair == [0xff, 0xc0]).ok_or("there is a frame")?;
        jpeg[frame + 1] = 0xc2;
        jpeg
    };
    let of_progressive = 300 * 100 * 3 + 320 * 128 * 8 + jpeg.len() as u64;
    let limits = GltfLimits { texture_bytes: of_progressive - 1, ..GltfLimits::DEFAULT };
    left_out(&progressive, limits, &format!("image 1 takes {of_progressive} bytes or more, and"))?;
    let converted = [
        (encoded(&rgb, image::ImageFormat::Png)?, 300 * 100 * 7),
        (encoded(&rgb.to_luma8().into(), image::ImageFormat::Png)?, 300 * 100 * 5),
        (jpeg, 300 * 100 * 7),
    ];
    for (image, bytes) in converted {
        let limits = GltfLimits { texture_bytes: bytes - 1, ..GltfLimits::DEFAULT };
        left_out(&image, limits, &format!("image 1 takes {bytes} bytes or more, and `GltfLimits::texture_bytes` is"))?;
        let world = load_memory(
            "images.glb",
            with_image(&image).glb(),
            &LoadOptions { limits: GltfLimits { texture_bytes: bytes, ..GltfLimits::DEFAULT }, ..AT_REST },
        )?;
        expect(world.warnings.is_empty(), || format!("{:?}", world.warnings))?;
    }
    let limits = GltfLimits { texture_file_bytes: 1000, ..GltfLimits::DEFAULT };
    left_out(&large, limits, "`GltfLimits::texture_file_bytes` is 1000")?;
    let limits = GltfLimits { all_textures_bytes: 100_000, ..GltfLimits::DEFAULT };
    left_out(&large, limits, "`GltfLimits::all_textures_bytes` is 100000")?;
    // The greatest size that a header can say.
    let mut huge = large.clone();
    huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let crc = crc32(&huge[12..29]);
    huge[29..33].copy_from_slice(&crc.to_be_bytes());
    left_out(&huge, GltfLimits::DEFAULT, "image 1 ")?;
    // Too long for a texture: it is reduced, and that is said.
    let long = png(&image::RgbaImage::from_pixel(16384, 4, image::Rgba([0, 255, 0, 255])));
    left_out(&long, GltfLimits::DEFAULT, "image 1 of 16384x4 pixels is reduced to 8192x2")?;
    // Both are there meanwhile.
    let bytes = 16384 * 4 * 4 + 8192 * 2 * 4;
    let enough = GltfLimits { texture_bytes: bytes, ..GltfLimits::DEFAULT };
    left_out(&long, enough, "image 1 of 16384x4 pixels is reduced to 8192x2")?;
    let less = GltfLimits { texture_bytes: bytes - 1, ..GltfLimits::DEFAULT };
    left_out(&long, less, "image 1 takes 327680 bytes or more, and `GltfLimits::texture_bytes` is 327679")
}

/// The bytes of a file are read before it turns out to be no image.
fn unreadable_images() -> Result<(), Failed> {
    let mut builder = textured_square();
    let nonsense = builder.view(&[7; 40_000]);
    for number in 0..6 {
        let source = builder.push("images", json!({"name": format!("no image {number}"), "bufferView": nonsense}));
        let texture = builder.push("textures", json!({"source": source}));
        let material = builder.push("materials", json!({"emissiveTexture": {"index": texture}}));
        let mut primitive = builder.json["meshes"][0]["primitives"][0].clone();
        primitive["material"] = json!(material);
        builder.json["meshes"][0]["primitives"].as_array_mut().ok_or("there are primitives")?.push(primitive);
    }
    let limits = GltfLimits { all_textures_bytes: 150_000, ..GltfLimits::DEFAULT };
    let world = load_memory("images.glb", builder.glb(), &LoadOptions { limits, ..AT_REST })?;
    let count = |reason: &str| world.warnings.iter().filter(|warning| warning.contains(reason)).count();
    let counts = [count("cannot be decoded"), count("`GltfLimits::all_textures_bytes` is 150000")];
    expect(counts == [3, 3] && count("(no image ") == 6, || format!("{:?}", world.warnings))
}

/// Nodes have a light, or a dark one.
fn lights() -> Result<(), Failed> {
    let mut builder = textured_square();
    builder.json["extensions"]["KHR_lights_punctual"]["lights"] = json!([
        {"name": "lamp", "type": "point"}, {"type": "point", "intensity": 0},
    ]);
    builder.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    let mut shine = |light: usize| builder.root(json!({"extensions": {"KHR_lights_punctual": {"light": light}}}));
    // Dark lights take nothing.
    let nodes = [1, 0, 1, 0, 0, 1, 0].map(&mut shine);
    let load = |lights: u64| {
        let limits = GltfLimits { lights, ..GltfLimits::DEFAULT };
        load_memory("lights.glb", builder.glb(), &LoadOptions { limits, ..AT_REST })
    };
    let light_count = |world: &drawloom_gltf::World| world.as_scene_ref(&world.columns()).lights.len();
    let whole = load(u64::MAX)?;
    let count = light_count(&whole);
    expect(count >= 4 && whole.warnings.is_empty(), || format!("{count} lights, {:?}", whole.warnings))?;
    let enough = load(count as u64)?;
    expect(light_count(&enough) == count && enough.warnings.is_empty(), || format!("{:?}", enough.warnings))?;
    let first = |node: usize| format!("light 0 (lamp) of node {}", nodes[node]);
    let beyond = [
        (1, format!("{} is left out", first(6))),
        (2, format!("2 lights are left out, and {} is the first of them", first(4))),
    ];
    for (left_out, named) in beyond {
        let limit = count - left_out;
        let less = load(limit as u64)?;
        let expected = format!("{named}: `GltfLimits::lights` is {limit}");
        let is_named = less.warnings == [expected.as_str()];
        expect(light_count(&less) == limit && is_named, || format!("{:?}, not {expected:?}", less.warnings))?;
    }
    Ok(())
}

/// Draws a scene with a second image.
fn left_out(image: &[u8], limits: GltfLimits, expected: &str) -> Result<(), Failed> {
    let world = load_memory("images.glb", with_image(image).glb(), &LoadOptions { limits, ..AT_REST })?;
    let is_named = world.warnings.len() == 1 && world.warnings[0].contains(expected);
    expect(is_named && world.object_count() == 1, || format!("{:?}, not {expected:?}", world.warnings))?;
    Ok(check_world(&world, &limits)?)
}

/// A scene with a second image.
fn with_image(image: &[u8]) -> Builder {
    let mut builder = textured_square();
    let view = builder.view(image);
    let source = builder.push("images", json!({"bufferView": view}));
    let texture = builder.push("textures", json!({"source": source}));
    builder.json["materials"][0]["emissiveTexture"] = json!({"index": texture});
    builder
}

/// As PNG has it.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}

/// A limit is what a scene takes, and less by one is too little.
fn just_enough() -> Result<(), Failed> {
    // Positions, normals and coordinates of 4 vertices; vertices of 32 bytes; 6 indices.
    let of_geometry = 4 * (12 + 12 + 8) + 4 * 32 + 6 * 4;
    let enough =
        GltfLimits { geometry_bytes: of_geometry, objects: 1, zero_bytes: 0, pose_bytes: 0, ..GltfLimits::DEFAULT };
    let options = LoadOptions { limits: enough, ..AT_REST };
    let world = load_memory("enough.glb", textured_square().glb(), &options)?;
    expect(world.warnings.is_empty() && world.object_count() == 1, || format!("{:?}", world.warnings))?;
    check_world(&world, &enough)?;
    let less = GltfLimits { geometry_bytes: of_geometry - 1, ..enough };
    refused(0, textured_square().glb(), less, "geometry_bytes")
}

/// A sparse accessor of many zeros is no attack, if the file has many of its values.
fn sparse() -> Result<(), Failed> {
    const REPLACED: usize = 10_000;
    let mut builder = textured_square();
    let indices = builder.view(bytemuck::cast_slice(&(0..REPLACED as u32).collect::<Vec<_>>()));
    let values = builder.view(&[0; 12 * REPLACED]);
    let (indices, values) = (json!({"bufferView": indices, "componentType": 5125}), json!({"bufferView": values}));
    let sparse = json!({"count": REPLACED, "indices": indices, "values": values});
    for (count, is_drawn) in [(64 * REPLACED, true), (64 * REPLACED + (4 << 20) / 12 + 1, false)] {
        let accessor = json!({"componentType": 5126, "type": "VEC3", "count": count, "sparse": sparse});
        let accessor = builder.push("accessors", accessor);
        builder.json["meshes"][0]["primitives"] = json!([{"attributes": {"POSITION": accessor}}]);
        match load_memory("sparse.glb", builder.glb(), &AT_REST) {
            Ok(world) => expect(is_drawn && world.object_count() == 1, || format!("{count} values are drawn"))?,
            Err(error) => {
                let is_named = error.to_string().contains("`GltfLimits::zero_bytes` is 4194304");
                expect(!is_drawn && is_named, || error.to_string())?;
            }
        }
    }
    Ok(())
}

fn hierarchies() -> Result<(), Failed> {
    const DEPTH: usize = 20_000;
    let mut builder = textured_square();
    let first = builder.json["nodes"].as_array().map_or(0, Vec::len);
    let nodes = builder.json["nodes"].as_array_mut().ok_or("there are nodes")?;
    nodes.extend((0..DEPTH).map(|depth| json!({"children": [first + depth + 1]})));
    nodes.push(json!({"mesh": 0}));
    builder.json["scenes"][0]["nodes"] = json!([0, 1, 2, first]);
    let world = load_memory("deep.glb", builder.glb(), &AT_REST)?;
    expect(world.object_count() == 2 && world.warnings.is_empty(), || format!("{:?}", world.warnings))?;

    // In circles, of which some are in the scene.
    let rounds: [(Value, Value, &str); 4] = [
        (json!([first]), json!([]), "is its own ancestor"),
        (json!([first + 1]), json!([first]), "is its own ancestor"),
        (json!([first + 1, first + 1]), json!([]), "is a child twice"),
        (json!([0, first + 1]), json!([0]), "is a child twice"),
    ];
    for (of_one, of_other, expected) in rounds {
        let mut builder = textured_square();
        let nodes = builder.json["nodes"].as_array_mut().ok_or("there are nodes")?;
        nodes.extend([json!({"mesh": 0, "children": of_one}), json!({"mesh": 0, "children": of_other})]);
        builder.json["scenes"][0]["nodes"] = json!([0, 1, 2, first, first + 1]);
        let world = load_memory("round.glb", builder.glb(), &AT_REST)?;
        let is_named = world.warnings.iter().any(|warning| warning.contains(expected));
        expect(is_named && world.object_count() >= 1, || format!("{:?}, not {expected:?}", world.warnings))?;
        check_world(&world, &GltfLimits::DEFAULT)?;
    }

    // A child of two parents is where one that only the first of them has is.
    let positions = |children_of_other: Value| {
        let mut builder = textured_square();
        for (x, children) in [(1, json!([first + 2])), (2, children_of_other)] {
            builder.root(json!({"translation": [x, 0, 0], "children": children}));
        }
        builder.push("nodes", json!({"mesh": 0}));
        let world = load_memory("parents.glb", builder.glb(), &AT_REST)?;
        let columns = world.columns();
        Ok::<_, Failed>(world.as_scene_ref(&columns).positions.to_vec())
    };
    let (below_both, below_first) = (positions(json!([first + 2]))?, positions(json!([]))?);
    expect(below_both == below_first, || format!("{below_both:?}, not {below_first:?}"))
}

fn warnings() -> Result<(), Failed> {
    let mut builder = textured_square();
    (0..500).for_each(|number| _ = builder.root(json!({"mesh": 100 + number})));
    let whole = load_memory("warnings.glb", builder.glb(), &AT_REST)?;
    expect(whole.warnings.len() == 100 && whole.unlisted_warnings >= 400, || format!("{}", whole.unlisted_warnings))?;
    let limits = GltfLimits { warnings: 0, ..GltfLimits::DEFAULT };
    let none = load_memory("warnings.glb", builder.glb(), &LoadOptions { limits, ..AT_REST })?;
    expect(none.warnings.is_empty() && none.unlisted_warnings >= 500, || format!("{}", none.unlisted_warnings))?;
    let mut json = builder.json.clone();
    json["buffers"] = json!([{"byteLength": 0}]);
    let error = load_memory("warnings.glb", glb(&json, &[]), &LoadOptions { limits, ..AT_REST });
    let error = error.err().ok_or("it is drawn")?;
    expect(error.warnings.is_empty() && error.unlisted_warnings >= 500, || format!("{}", error.unlisted_warnings))?;
    let error = error.to_string();
    expect(error.contains("node 3 has no mesh"), || format!("the first loss is not named: {error}"))
}

/// Times, indices and sizes that no file and no picture has.
fn options() -> Result<(), Failed> {
    let file = bending_tube(None).glb();
    for time in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, -0.0] {
        let options = LoadOptions { time: Some(time), ..AT_REST };
        let world = load_memory("times.glb", file.clone(), &options).map_err(|error| format!("{time}: {error}"))?;
        check_world(&world, &GltfLimits::DEFAULT).map_err(|error| format!("{time}: {error}"))?;
    }
    for size in [[0, 0], [0, 9], [9, 0], [1, u32::MAX], [u32::MAX, 1]] {
        for file in [&file, &textured_square().glb()] {
            let options = LoadOptions { size, ..AT_REST };
            load_memory("sizes.glb", file.clone(), &options).map_err(|error| format!("{size:?}: {error}"))?;
        }
    }
    let options = LoadOptions { animation: usize::MAX, time: Some(1.0), ..AT_REST };
    let world = load_memory("animation.glb", file.clone(), &options)?;
    expect(world.warnings.iter().any(|it| it.contains("there is no animation")), || format!("{:?}", world.warnings))?;
    let options = LoadOptions { camera: Some(usize::MAX), ..AT_REST };
    let refused = load_memory("camera.glb", file, &options).err().map(|error| error.to_string());
    expect(refused.as_ref().is_some_and(|it| it.contains("has the index")), || format!("{refused:?}"))
}
