//! One element with which something is wrong loses itself, by name, and nothing else: neither at rest nor while an
//! animation is drawn.

use drawloom::scene::Light;
use drawloom_gltf::LoadOptions;
use libtest_mimic::Failed;
use serde_json::{Value, json};

use crate::fixture::{AT_REST, expect, load_memory};
use crate::generate::builder::Builder;
use crate::generate::deforming::{bending_tube, morphing_sphere};
use crate::generate::static_scenes::{lights_and_cameras, textured_square};

pub const CASES: &[crate::Case] = &[
    ("what_animations_have_is_checked_when_it_is_needed", animations),
    ("one_element_loses_itself_only", elements),
    ("cones_of_lights_are_drawn_as_the_nearest_that_can_be", cones),
    ("compressed_meshes_are_named", compressed),
];

type Change = fn(&mut Builder);
/// A file, what is changed in it, and a part of what is then said.
type ChangedFile = (fn() -> Builder, Change, &'static str);

/// A channel or a sampler is wrong: the other channels move their nodes.
fn animations() -> Result<(), Failed> {
    let changes: [(Change, &str); 16] = [
        (|it| channel(it)["target"]["path"] = json!("visible"), "animates \"visible\""),
        (|it| channel(it)["target"]["path"] = json!(3), "has a `path` that is not a string"),
        (|it| channel(it)["target"] = json!({"node": 1}), "has no `path`"),
        (|it| channel(it)["target"] = json!([]), "has a `target` that is not an object"),
        (|it| *channel(it) = json!({}), "has no `target`"),
        (|it| *channel(it) = json!("rotation"), "has no `target`"),
        (|it| channel(it)["target"]["node"] = json!(99), "has the index 99 of"),
        (|it| channel(it)["sampler"] = json!(99), "has the index 99 of 3 samplers"),
        (|it| channel(it)["sampler"] = json!(-1), "has a `sampler` that is not a whole number"),
        (|it| channel(it)["target"]["path"] = json!("weights"), "animates morph weights of node"),
        (|it| sampler(it)["input"] = json!(99), "has the index 99 of"),
        (|it| sampler(it)["output"] = json!({}), "has a `output` that is not a whole number"),
        (
            |it| sampler(it)["output"] = json!(0),
            "but the values of animation 0 (bend) channel 0 must be of 4 components",
        ),
        (|it| sampler(it)["interpolation"] = json!("BEZIER"), "has an `interpolation` that is not known"),
        (|it| sampler(it)["interpolation"] = json!("CUBICSPLINE"), "has 12 numbers, but 36 for 3 times"),
        (
            |it| {
                // Rotations without a direction.
                let view = it.view(&[0; 48]);
                let output = sampler(it)["output"].as_u64().map_or(0, |index| index as usize);
                it.json["accessors"][output]["bufferView"] = json!(view);
            },
            "has a rotation without a direction at 0.5 s",
        ),
    ];
    let moving = LoadOptions { time: Some(0.5), ..AT_REST };
    let moved = |bytes: Vec<u8>, options: &LoadOptions| -> Result<_, Failed> {
        let world = load_memory("animation.glb", bytes, options)?;
        let bounds = world.as_scene_ref(&world.columns()).bounds[0];
        Ok((world.warnings, bounds))
    };
    let (_, at_rest) = moved(bending_tube(None).glb(), &AT_REST)?;
    for (number, (change, expected)) in changes.into_iter().enumerate() {
        let mut builder = bending_tube(None);
        change(&mut builder);
        let (_, bounds) = moved(builder.glb(), &AT_REST)?;
        expect(bounds == at_rest, || format!("{number}: it moves at rest"))?;
        let (warnings, bounds) = moved(builder.glb(), &moving)?;
        let is_named = warnings.iter().any(|warning| warning.contains(expected));
        expect(is_named, || format!("{number}: {warnings:?}, not {expected:?}"))?;
        expect(bounds != at_rest, || format!("{number}: the other channels move nothing"))?;
    }
    Ok(())
}

fn channel(it: &mut Builder) -> &mut Value {
    &mut it.json["animations"][0]["channels"][0]
}

fn sampler(it: &mut Builder) -> &mut Value {
    &mut it.json["animations"][0]["samplers"][0]
}

/// A second element, which is wrong, beside those of a scene.
fn elements() -> Result<(), Failed> {
    let changes: [ChangedFile; 24] = [
        (
            textured_square,
            |it| image(it, json!({"uri": "nowhere.png"})),
            "image 1 (nowhere.png) is left out: nowhere.png cannot be read",
        ),
        (textured_square, |it| image(it, json!({"uri": "https://example.com/a.png"})), "has a scheme other than data"),
        (
            textured_square,
            |it| image(it, json!({"uri": "data:image/png;base64,iVBORw0KGgo="})),
            "image 1 cannot be decoded",
        ),
        (
            textured_square,
            |it| image(it, json!({"uri": "data:image/gif;base64,R0lGODlhAQABAAAAACw="})),
            "image 1 cannot be decoded",
        ),
        (textured_square, |it| image(it, json!({"bufferView": 99})), "image 1 has the index 99"),
        (textured_square, |it| image(it, json!({"uri": 5})), "image 1 has a `uri` that is not a string"),
        (textured_square, |it| image(it, json!({})), "image 1 has neither a URI nor a buffer view"),
        (textured_square, |it| second(it, json!({"attributes": {"POSITION": 99}})), "primitive 1 is not drawn"),
        (textured_square, |it| second(it, json!({"attributes": []})), "primitive 1 is not drawn"),
        (textured_square, |it| second(it, json!(5)), "primitive 1 has no `attributes`"),
        (textured_square, |it| second(it, json!({"attributes": {"NORMAL": 1}})), "primitive 1 has no positions"),
        (textured_square, |it| second(it, json!({"attributes": {"POSITION": 0}, "mode": 0})), "the mode Points"),
        (
            textured_square,
            |it| second(it, json!({"attributes": {"POSITION": 0}, "indices": 2})),
            "must be of 1 components",
        ),
        (textured_square, |it| attribute(it, "NORMAL", 3), "is drawn without its normals: accessor 3 is a scalar"),
        (textured_square, |it| attribute(it, "TEXCOORD_0", 99), "is drawn without its texture coordinates"),
        (textured_square, |it| attribute(it, "COLOR_0", 3), "is drawn without its colours"),
        (textured_square, |it| attribute(it, "TANGENT", 0), "is drawn without its tangents"),
        (
            textured_square,
            |it| it.json["meshes"][0]["primitives"][0]["material"] = json!(9),
            "with the default material",
        ),
        (textured_square, |it| _ = it.root(json!({"mesh": 44})), "has the index 44 of 1 meshes"),
        (
            textured_square,
            |it| _ = it.root(json!({"mesh": 0, "translation": [1e300, 0, 0]})),
            "from the world's origin",
        ),
        (
            textured_square,
            |it| _ = it.root(json!({"extensions": {"KHR_lights_punctual": {"light": 9}}})),
            "has no light",
        ),
        (tube, |it| it.json["skins"][0]["joints"] = json!([0, 1, 99]), "meshes are drawn without skin 0"),
        (tube, |it| it.json["skins"][0]["inverseBindMatrices"] = json!(0), "meshes are drawn without skin 0"),
        (
            sphere,
            |it| it.json["meshes"][0]["primitives"][0]["targets"][0] = json!({"POSITION": 99}),
            "does not change positions",
        ),
    ];
    for (number, (scene, change, expected)) in changes.into_iter().enumerate() {
        let mut builder = scene();
        change(&mut builder);
        let world =
            load_memory("element.glb", builder.glb(), &AT_REST).map_err(|error| format!("{number}: {error}"))?;
        let is_named = world.warnings.iter().any(|warning| warning.contains(expected));
        let kept = world.object_count() == 1 && world.cameras == 1 && world.warnings.len() == 1;
        expect(is_named && kept, || format!("{number}: {:?}, not {expected:?}", world.warnings))?;
    }
    Ok(())
}

fn tube() -> Builder {
    bending_tube(None)
}

fn sphere() -> Builder {
    morphing_sphere(None)
}

/// A second image, which the material shows, too.
fn image(it: &mut Builder, image: Value) {
    let source = it.push("images", image);
    let texture = it.push("textures", json!({"source": source}));
    it.json["materials"][0]["emissiveTexture"] = json!({"index": texture});
}

/// A second primitive.
fn second(it: &mut Builder, primitive: Value) {
    it.json["meshes"][0]["primitives"].as_array_mut().expect("primitives").push(primitive);
}

fn attribute(it: &mut Builder, name: &str, accessor: usize) {
    it.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
}

fn cones() -> Result<(), Failed> {
    let half_right = std::f64::consts::FRAC_PI_6;
    let cases: [(Value, [f32; 2], bool); 9] = [
        (json!({"innerConeAngle": half_right, "outerConeAngle": half_right}), [half_right as f32; 2], true),
        (json!({"innerConeAngle": 0.9, "outerConeAngle": 0.4}), [0.4, 0.4], true),
        (json!({"innerConeAngle": -1, "outerConeAngle": 0.4}), [0.0, 0.4], true),
        (json!({"innerConeAngle": 0, "outerConeAngle": 3}), [0.0, std::f32::consts::FRAC_PI_2], true),
        (json!({"innerConeAngle": 1e30, "outerConeAngle": 1e30}), [std::f32::consts::FRAC_PI_2; 2], true),
        (json!({"innerConeAngle": 0, "outerConeAngle": 0}), [0.0, 5e-4], true),
        (json!({"innerConeAngle": "wide"}), [0.0, std::f32::consts::FRAC_PI_4], true),
        (json!({"outerConeAngle": std::f64::consts::FRAC_PI_2}), [0.0, std::f32::consts::FRAC_PI_2], false),
        (json!({"innerConeAngle": 0.3, "outerConeAngle": 0.4}), [0.3, 0.4], false),
    ];
    for (spot, [inner, outer], is_warned) in cases {
        let mut builder = lights_and_cameras();
        builder.json["extensions"]["KHR_lights_punctual"]["lights"][1]["spot"] = spot.clone();
        let world = load_memory("cone.glb", builder.glb(), &AT_REST)?;
        let columns = world.columns();
        let cone = world.as_scene_ref(&columns).lights.iter().find_map(|light| match *light {
            Light::Spot { inner_angle, outer_angle, .. } => Some([inner_angle, outer_angle]),
            _ => None,
        });
        let Some([drawn_inner, drawn_outer]) = cone else { return Err(format!("{spot}: the lamp is lost").into()) };
        // Cosines of f32 differ from 6e-8 on, so angles may have to differ by the root of twice that where cosines are
        // flat.
        let is_near = (drawn_inner - inner).abs() < 4e-4 && (drawn_outer - outer).abs() < 1e-6;
        let can_fade = drawn_inner.cos() > drawn_outer.cos();
        expect(is_near && can_fade, || format!("{spot}: {drawn_inner} and {drawn_outer}"))?;
        let warnings = world.warnings.iter().filter(|it| it.contains("light 1")).count();
        expect((warnings > 0) == is_warned, || format!("{spot}: {:?}", world.warnings))?;
        expect(world.as_scene_ref(&columns).lights.len() == 2, || "the other lamp is lost".to_owned())?;
    }
    Ok(())
}

fn compressed() -> Result<(), Failed> {
    let mut builder = textured_square();
    // Compressed beside data that are not.
    let draco = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    builder.json["meshes"][0]["primitives"][0]["extensions"] = draco.clone();
    builder.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression", "KHR_lights_punctual"]);
    let world = load_memory("draco.glb", builder.glb(), &AT_REST)?;
    expect(world.object_count() == 1 && world.warnings.len() == 1, || format!("{:?}", world.warnings))?;

    // A second primitive without data.
    let accessor = builder.push("accessors", json!({"componentType": 5126, "count": 4, "type": "VEC3"}));
    second(&mut builder, json!({"attributes": {"POSITION": accessor}, "extensions": draco}));
    let world = load_memory("draco.glb", builder.glb(), &AT_REST)?;
    let expected = "primitive 1 is compressed with KHR_draco_mesh_compression";
    let is_named = world.warnings.iter().any(|warning| warning.contains(expected));
    expect(world.object_count() == 1 && is_named, || format!("{:?}", world.warnings))?;

    // Only that.
    let primitives = builder.json["meshes"][0]["primitives"].as_array_mut().ok_or("there are primitives")?;
    primitives.remove(0);
    refused(&builder, "primitive 0 is compressed with KHR_draco_mesh_compression")?;
    builder.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    refused(&builder, "it requires the extension KHR_draco_mesh_compression, which this loader does not know")?;

    let mut builder = textured_square();
    let view = builder.json["accessors"][0]["bufferView"].as_u64().map_or(0, |view| view as usize);
    builder.json["bufferViews"][view]["buffer"] = json!(1);
    builder.json["bufferViews"][view]["extensions"] = json!({"EXT_meshopt_compression": {"buffer": 0}});
    builder.json["buffers"] = json!([]);
    let mut json = builder.json.clone();
    json["buffers"] = json!([{"byteLength": builder.binary.len()}, {"byteLength": 48}]);
    let error = load_memory("meshopt.glb", crate::generate::builder::glb(&json, &builder.binary), &AT_REST).err();
    let error = error.map(|error| error.to_string()).unwrap_or_default();
    expect(error.contains("buffer view 1 is compressed with EXT_meshopt_compression"), || error)
}

fn refused(builder: &Builder, expected: &str) -> Result<(), Failed> {
    let error = load_memory("draco.glb", builder.glb(), &AT_REST).err().map(|error| error.to_string());
    expect(error.as_ref().is_some_and(|error| error.contains(expected)), || format!("{error:?}, not {expected:?}"))
}
