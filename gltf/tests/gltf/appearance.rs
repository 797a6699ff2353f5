//! How surfaces, lights and cameras look, by the colours of regions.

use drawloom::glam::Vec3;
use drawloom_gltf::LoadOptions;
use libtest_mimic::Failed;
use serde_json::{Value, json};

use crate::fixture::{AT_REST, Drawn, SIZE, draw_builder, draw_world, expect, expect_color, load_bytes};
use crate::generate::builder::Builder;
use crate::generate::shapes::{Shape, sphere, square};
use crate::generate::static_scenes::{
    alpha_modes, four_colors, lights_and_cameras, metallic_roughness_grid, textured_square,
};

pub const CASES: &[crate::Case] = &[
    ("a_texture_is_the_right_way_up", texture),
    ("spheres_look_metallic_rough_and_bumpy", metallic_roughness),
    ("holes_are_cut_out_glass_is_blended_and_backs_are_left_out", alpha),
    ("lights_have_colors_and_cones_and_cameras_differ", lights_and_camera),
    ("without_lights_and_cameras_the_scene_is_lit_and_framed", defaults),
    ("unlit_emission_occlusion_and_vertex_colors_count", factors),
    ("textures_are_transformed_and_wrapped", wrapping),
    ("strips_and_fans_and_no_indices_are_lists_of_triangles", topologies),
    ("images_of_six_sizes_are_drawn", sizes),
];

fn texture() -> Result<(), Failed> {
    let drawn = draw_builder("texture", &textured_square(), &AT_REST)?;
    // Blue and red are mixed into the background by nothing: the square covers it.
    let dominant = |x: f32, y: f32| drawn.at(x, y).map(|channel| channel > 150);
    let corners = [dominant(0.4, 0.3), dominant(0.6, 0.3), dominant(0.4, 0.7), dominant(0.6, 0.7)];
    let expected = [[true, false, false], [false, true, false], [false, false, true], [true, true, false]];
    expect(corners == expected, || format!("{corners:?}"))
}

fn metallic_roughness() -> Result<(), Failed> {
    let drawn = draw_builder("metal", &metallic_roughness_grid(), &LoadOptions { size: [480, 270], ..AT_REST })?;
    // Columns of spheres, in the picture.
    let center = |column: usize| 0.5 + (column as f32 - 2.0) * 0.16;
    let [darkest, brightest] = drawn.extremes([center(0) - 0.04, center(0) + 0.04], [0.27, 0.43]);
    expect(darkest < 150 && brightest > 600, || format!("smooth metal is {darkest} to {brightest}"))?;
    // A highlight of smooth metal is small; rough metal has none that is as bright.
    let is_bright = |column: usize| {
        let points = (0..40).flat_map(|y| (0..40).map(move |x| (x, y)));
        let at =
            |(x, y): (i32, i32)| drawn.at(center(column) + (x - 20) as f32 * 0.002, 0.35 + (y - 20) as f32 * 0.004);
        points.filter(|&point| at(point).iter().sum::<i32>() > 450).count()
    };
    let [smooth, rough] = [is_bright(0), is_bright(3)];
    expect(smooth > 0 && rough > 5 * smooth, || format!("{smooth} and {rough} points are bright"))?;
    let middle = |column: usize, y: f32| drawn.at(center(column), y).iter().sum::<i32>();
    let [metal, painted] = [middle(0, 0.36), middle(0, 0.66)];
    expect(painted > metal + 200, || format!("metal reflects {metal}, and paint {painted}"))?;
    // The bumps of the lower row: without them brightness changes slowly along the equator.
    let along =
        |y: f32| (0..24).map(|step| drawn.at(center(1) - 0.03 + step as f32 * 0.0025, y)[2]).collect::<Vec<_>>();
    let turns = |values: &[i32]| {
        let signs: Vec<_> =
            values.windows(2).map(|pair| (pair[1] - pair[0]).signum()).filter(|sign| *sign != 0).collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    let bumps = turns(&along(0.65));
    expect(bumps >= 2, || format!("brightness turns {bumps} times: {:?}", along(0.65)))
}

fn alpha() -> Result<(), Failed> {
    let world = load_bytes("alpha", &alpha_modes().glb(), &AT_REST)?;
    expect(world.warnings.is_empty(), || format!("{:?}", world.warnings))?;
    let drawn = draw_world("alpha", &world)?;
    let center = |index: f32| 0.5 + (index - 1.0) * 0.2375;
    let wall = drawn.at(0.85, 0.2);
    expect(wall.iter().all(|channel| *channel > 200), || format!("the wall is {wall:?}"))?;
    // Its hole shows the wall, where the sun shines on it.
    expect_color(&drawn, [center(0.0), 0.5], wall)?;
    let [red, green, blue] = drawn.at(center(0.0) - 0.08, 0.36);
    expect(green > 150 && red < 80 && blue < 80, || format!("around the hole it is {:?}", [red, green, blue]))?;
    let [red, green, _] = drawn.at(center(1.0) + 0.05, 0.5);
    expect(red > 150 && green > 60 && green < wall[1] - 20, || format!("the glass is {red}, {green}"))?;
    // The sun shines straight ahead, so in perspective the shadow on the wall is nearer to the middle than the square.
    // It has the hole, too.
    let shadow = drawn.at(0.385, 0.423);
    expect(shadow.iter().all(|channel| *channel < 110), || format!("the shadow is {shadow:?}"))?;
    expect_color(&drawn, [0.385, 0.5], wall)?;
    // A single-sided square is not seen from behind, and neither is its shadow.
    expect_color(&drawn, [center(2.0), 0.5], wall)
}

fn lights_and_camera() -> Result<(), Failed> {
    let builder = lights_and_cameras();
    let drawn = draw_builder("lights", &builder, &AT_REST)?;
    let [red, green, _] = drawn.at(0.28, 0.5);
    expect(red > 150 && red > 2 * green, || format!("the point light is {red}, {green}"))?;
    let [red, green, _] = drawn.at(0.72, 0.5);
    expect(green > 150 && green > 2 * red, || format!("the cone is {red}, {green}"))?;
    let [_, beside, _] = drawn.at(0.88, 0.5);
    expect(beside < 100, || format!("beside the cone it is {beside}"))?;
    // In the parallel camera the cone is in the middle, and the wall covers all.
    let square_picture = LoadOptions { camera: Some(1), size: [96, 96], ..AT_REST };
    let drawn = draw_builder("lights", &builder, &square_picture)?;
    let [red, green, _] = drawn.at(0.5, 0.5);
    expect(green > 150 && green > 2 * red, || format!("the cone is {red}, {green}"))?;
    // Two metres high are two thirds of the cone's radius: 0.4 rad at 2 m.
    let radius = 2.0 * 0.4_f32.tan() / 4.0;
    let [inside, outside] = [drawn.at(0.5 + radius * 0.6, 0.5)[1], drawn.at(0.5 + radius * 1.1, 0.5)[1]];
    expect(inside > 150 && outside < 100, || format!("inside {inside}, outside {outside}"))?;
    expect(drawn.at(0.01, 0.01)[0] > 30, || "the wall is not there".to_owned())
}

fn defaults() -> Result<(), Failed> {
    let mut builder = Builder::new();
    let material = builder
        .push("materials", json!({"pbrMetallicRoughness": {"baseColorFactor": [0, 0.3, 0, 1], "metallicFactor": 0}}));
    let mesh = builder.mesh(&sphere(24, 16), Some(material));
    // Somewhere, and large.
    builder.root(json!({"mesh": mesh, "translation": [1e4, -3e3, 50], "scale": [400, 400, 400]}));
    let drawn = draw_builder("defaults", &builder, &AT_REST)?;
    let [red, green, _] = drawn.at(0.5, 0.5);
    expect(green > 60 && red < green / 2, || format!("the middle is {red}, {green}"))?;
    // It shines from the upper right.
    let [lit, dark] = [drawn.at(0.6, 0.3)[1], drawn.at(0.4, 0.75)[1]];
    expect(lit > dark + 15, || format!("the upper right is {lit}, and the lower left {dark}"))?;
    // It fills most of the height, and nothing of it is cut off.
    let is_green = |y: f32| drawn.at(0.5, y)[1] > 60;
    expect(is_green(0.15) && is_green(0.85) && !is_green(0.01) && !is_green(0.99), || "it is not framed".to_owned())
}

/// A square of a material, lit by a sun that shines straight onto it.
fn square_of(material: Value, change: impl FnOnce(&mut Builder, &mut Value)) -> Builder {
    let mut builder = Builder::new();
    let material = builder.push("materials", material);
    let mut primitive = builder.primitive(&square(), Some(material));
    change(&mut builder, &mut primitive);
    let mesh = builder.push("meshes", json!({"primitives": [primitive]}));
    builder.root(json!({"mesh": mesh}));
    builder.camera_at([0.0, 0.0, 4.0]);
    builder.sun(1.0);
    builder
}

fn factors() -> Result<(), Failed> {
    let middle = |name: &str, builder: &Builder| -> Result<[i32; 3], Failed> {
        Ok(draw_builder(name, builder, &AT_REST)?.at(0.4, 0.4))
    };
    let gray = json!({"baseColorFactor": [0.2, 0.2, 0.2, 1.0], "metallicFactor": 0.0});
    let plain = middle("plain", &square_of(json!({"pbrMetallicRoughness": gray}), |_, _| ()))?;
    let unlit = json!({"pbrMetallicRoughness": gray, "extensions": {"KHR_materials_unlit": {}}});
    let mut unlit = square_of(unlit, |_, _| ());
    unlit.json["extensionsUsed"] = json!(["KHR_materials_unlit", "KHR_lights_punctual"]);
    let unlit = middle("unlit", &unlit)?;
    expect(unlit[0] > plain[0] + 40, || format!("unlit {unlit:?}, lit {plain:?}"))?;

    let emission = json!({"pbrMetallicRoughness": gray, "emissiveFactor": [0.0, 0.0, 0.2]});
    let emitted = middle("emission", &square_of(emission.clone(), |_, _| ()))?;
    expect(emitted[2] > plain[2] + 60 && (emitted[0] - plain[0]).abs() < 12, || format!("{emitted:?}, {plain:?}"))?;
    let mut strong = emission;
    strong["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}});
    let mut strong = square_of(strong, |_, _| ());
    strong.json["extensionsUsed"] = json!(["KHR_materials_emissive_strength", "KHR_lights_punctual"]);
    let strong = middle("strong emission", &strong)?;
    expect(strong[2] > emitted[2] + 20, || format!("{strong:?}, {emitted:?}"))?;

    // Without a sun, occlusion darkens all that there is.
    let mut occluded = square_of(json!({"pbrMetallicRoughness": {"metallicFactor": 0.0}}), |_, _| ());
    occluded.json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(1e-6);
    let open = middle("open", &occluded)?;
    let texture = occluded.texture(&image::RgbaImage::from_pixel(4, 4, image::Rgba([0, 255, 255, 255])));
    occluded.json["materials"][0]["occlusionTexture"] = json!({"index": texture, "strength": 0.8});
    let occluded = middle("occlusion", &occluded)?;
    expect(occluded[0] < open[0] * 2 / 3, || format!("{occluded:?}, {open:?}"))?;

    let colored = square_of(json!({"pbrMetallicRoughness": {"metallicFactor": 0.0}}), |builder, primitive| {
        primitive["attributes"]["COLOR_0"] = builder.floats(&[[0.0, 1.0, 0.0]; 4]).into();
    });
    let colored = middle("vertex colors", &colored)?;
    expect(colored[1] > 100 && colored[0] < 60, || format!("{colored:?}"))
}

fn wrapping() -> Result<(), Failed> {
    let draw = |name: &str, sampler: Value, uvs: [[f32; 2]; 4], transform: Option<Value>| -> Result<Drawn, Failed> {
        let material = json!({
            "pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorTexture": {"index": 0, "texCoord": 1}},
            "extensions": {"KHR_materials_unlit": {}},
        });
        let mut builder = square_of(material, |builder, primitive| {
            primitive["attributes"]["TEXCOORD_1"] = builder.floats(&uvs).into();
        });
        builder.texture(&four_colors(64));
        builder.push("samplers", sampler);
        builder.json["textures"][0]["sampler"] = json!(0);
        builder.json["extensionsUsed"] = json!(["KHR_materials_unlit", "KHR_texture_transform", "KHR_lights_punctual"]);
        if let Some(transform) = transform {
            let info = &mut builder.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
            info["extensions"] = json!({"KHR_texture_transform": transform});
        }
        draw_builder(name, &builder, &AT_REST)
    };
    let (red, green, blue) = ([true, false, false], [false, true, false], [false, false, true]);
    let at = |drawn: &Drawn, x: f32| drawn.at(x, 0.4).map(|channel| channel > 150);
    let shown = |drawn: &Drawn| [0.54, 0.64].map(|x| at(drawn, x));
    // Twice the image from left to right, its upper half from top to bottom.
    let twice = [[0.0, 0.5], [2.0, 0.5], [2.0, 0.0], [0.0, 0.0]];
    let mode = |mode: u32| json!({"wrapS": mode, "wrapT": 33071, "magFilter": 9728});
    // At u = 1.25 and u = 1.84.
    let expected = [("repeat", 10497, [red, green]), ("mirror", 33648, [green, red]), ("clamp", 33071, [green, green])];
    for (name, number, expected) in expected {
        let drawn = draw(name, mode(number), twice, None)?;
        expect(shown(&drawn) == expected, || format!("{name}: {:?}", shown(&drawn)))?;
        // The left half shows the image as it is.
        expect(drawn.at(0.36, 0.4)[0] > 150, || format!("{name}: the left is {:?}", drawn.at(0.36, 0.4)))?;
    }
    // A quarter turn counter-clockwise around the upper left, moved down by one: what was on the left is below.
    let once = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let turn = json!({"rotation": std::f32::consts::FRAC_PI_2, "offset": [0, 1]});
    let drawn = draw("turned", mode(10497), once, Some(turn))?;
    let ends = [0.36, 0.64].map(|x| at(&drawn, x));
    expect(ends == [blue, red], || format!("turned: {ends:?}"))
}

fn topologies() -> Result<(), Failed> {
    let draw = |name: &str, order: &[usize], mode: u32, indices: Option<&[u32]>| -> Result<Drawn, Failed> {
        let whole = square();
        let pick = |values: &[[f32; 3]]| order.iter().map(|&index| values[index]).collect::<Vec<_>>();
        let shape = Shape { positions: pick(&whole.positions), normals: pick(&whole.normals), ..Shape::default() };
        let mut builder = square_of(json!({}), |builder, primitive| {
            *primitive = json!({
                "attributes": {"POSITION": builder.floats(&shape.positions), "NORMAL": builder.floats(&shape.normals)},
                "material": 0, "mode": mode,
            });
            if let Some(indices) = indices {
                primitive["indices"] = builder.indices(indices).into();
            }
        });
        builder.json["materials"][0]["pbrMetallicRoughness"] = json!({"metallicFactor": 0.0});
        draw_builder(name, &builder, &AT_REST)
    };
    let list = draw("list", &[0, 1, 2, 3], 4, Some(&[0, 1, 2, 0, 2, 3]))?;
    expect(list.at(0.5, 0.4)[0] > 100 && list.at(0.45, 0.55)[0] > 100, || "the square is not there".to_owned())?;
    let others = [
        draw("no indices", &[0, 1, 2, 0, 2, 3], 4, None)?,
        draw("strip", &[0, 1, 3, 2], 5, None)?,
        draw("fan", &[0, 1, 2, 3], 6, Some(&[0, 1, 2, 3]))?,
    ];
    let different = others.map(|other| list.difference(&other));
    expect(different == [0; 3], || format!("{different:?} pixels differ"))
}

fn sizes() -> Result<(), Failed> {
    let mut builder = Builder::new();
    let colors = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [0, 255, 255], [255, 0, 255]];
    for (index, [red, green, blue]) in colors.into_iter().enumerate() {
        let side = [3, 64, 17, 100, 1, 32][index];
        let texture =
            builder.texture(&image::RgbaImage::from_pixel(side, side * 2, image::Rgba([red, green, blue, 255])));
        let material = json!({
            "pbrMetallicRoughness": {"baseColorTexture": {"index": texture}},
            "extensions": {"KHR_materials_unlit": {}},
        });
        let material = builder.push("materials", material);
        let mesh = builder.mesh(&square(), Some(material));
        builder.root(json!({"mesh": mesh, "translation": Vec3::new(index as f32 * 2.0 - 5.0, 0.0, 0.0).to_array()}));
    }
    builder.json["extensionsUsed"] = json!(["KHR_materials_unlit"]);
    builder.camera_at([0.0, 0.0, 9.0]);
    let drawn = draw_builder("sizes", &builder, &AT_REST)?;
    let [width, height] = SIZE.map(|side| side as f32);
    for (index, color) in colors.into_iter().enumerate() {
        let x = 0.5 + (index as f32 * 2.0 - 5.0) / (2.0 * 9.0 * 0.4_f32.tan()) * height / width;
        let shown = drawn.at(x, 0.5).map(|channel| if channel > 128 { 255 } else { 0 });
        expect(shown == color, || format!("image {index} is {:?}", drawn.at(x, 0.5)))?;
    }
    Ok(())
}
