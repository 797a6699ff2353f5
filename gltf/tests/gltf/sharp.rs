//! Images keep their pixels, however many sizes of images a file has.

use drawloom_gltf::LoadOptions;
use image::{Rgba, RgbaImage};
use libtest_mimic::Failed;
use serde_json::json;

use crate::fixture::{AT_REST, Drawn, draw_builder, expect};
use crate::generate::builder::Builder;
use crate::generate::shapes::square;

pub const CASES: &[crate::Case] = &[
    ("nearest_pixels_are_sharp_beside_images_of_many_sizes", nearest),
    ("images_look_the_same_beside_images_of_many_sizes", beside_others),
    ("edges_of_odd_sizes_have_nothing_of_the_opposite_ones", odd_edges),
];

/// The sizes of images on objects far beside the picture.
const OTHER_SIZES: [[u32; 2]; 6] = [[9, 9], [300, 1], [1, 300], [90, 90], [7, 2], [33, 64]];

/// A square for each sampler, side by side.
fn squares(image: &RgbaImage, samplers: &[serde_json::Value], repeats: f32, others: &[[u32; 2]]) -> Builder {
    let mut builder = Builder::new();
    builder.json["extensionsUsed"] = json!(["KHR_materials_unlit", "KHR_texture_transform"]);
    let mut add = |image: &RgbaImage, sampler: &serde_json::Value, repeats: f32, x: f32| {
        let texture = builder.texture(image);
        let sampler = builder.push("samplers", sampler.clone());
        builder.json["textures"][texture]["sampler"] = json!(sampler);
        let transform = json!({"scale": [repeats, repeats], "offset": [-0.25 * (repeats - 1.0), 0]});
        let material = builder.push(
            "materials",
            json!({
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": texture, "extensions": {"KHR_texture_transform": transform}},
                },
                "extensions": {"KHR_materials_unlit": {}},
            }),
        );
        let mesh = builder.mesh(&square(), Some(material));
        builder.root(json!({"mesh": mesh, "translation": [x, 0, 0]}));
    };
    for (number, sampler) in samplers.iter().enumerate() {
        let x = (number as f32 - (samplers.len() as f32 - 1.0) / 2.0) * 2.1;
        add(image, sampler, repeats, x);
    }
    for (number, &[width, height]) in others.iter().enumerate() {
        let other = RgbaImage::from_pixel(width, height, Rgba([255, 0, 255, 255]));
        add(&other, &json!({}), 1.0, 1000.0 + number as f32 * 5.0);
    }
    builder.camera_at([0.0, 0.0, 2.6]);
    builder
}

fn nearest() -> Result<(), Failed> {
    const SIDE: u32 = 4;
    let is_white = |x: u32, y: u32| (x * 7 + y * 3 + x * y).is_multiple_of(3);
    let image =
        RgbaImage::from_fn(SIDE, SIDE, |x, y| if is_white(x, y) { Rgba([255; 4]) } else { Rgba([0, 0, 0, 255]) });
    let sampler = json!({"magFilter": 9728, "minFilter": 9728});
    let builder = squares(&image, &[sampler], 1.0, &OTHER_SIZES);
    let drawn = draw_builder("sharp", &builder, &LoadOptions { size: [400, 400], ..AT_REST })?;
    // The square is 2 m wide, and the picture as high as the camera sees at its distance.
    let half = 1.0 / (2.0 * 2.6 * 0.4_f32.tan());
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        // Nearly up to the edges of a pixel: FXAA blends one pixel of the picture.
        for (right, down) in [(0.5, 0.5), (0.08, 0.5), (0.92, 0.5), (0.5, 0.08), (0.5, 0.92)] {
            let [u, v] = [(x as f32 + right) / SIDE as f32, (y as f32 + down) / SIDE as f32];
            let color = drawn.at(0.5 + (u * 2.0 - 1.0) * half, 0.5 + (v * 2.0 - 1.0) * half);
            let is_right = color.iter().all(|&channel| if is_white(x, y) { channel > 200 } else { channel < 20 });
            expect(is_right, || format!("pixel {x}, {y} is {color:?} at {right}, {down} in it"))?;
        }
    }
    Ok(())
}

fn beside_others() -> Result<(), Failed> {
    let image = RgbaImage::from_fn(8, 8, |x, y| {
        let bright = if (x + y).is_multiple_of(3) { 255 } else { 40 };
        Rgba([bright, (x * 36) as u8, (y * 36) as u8, 255])
    });
    let mut samplers = Vec::new();
    for (wrap_s, wrap_t) in [(10497, 33071), (33071, 33648), (33648, 10497)] {
        for (magnified, minified) in [(9728, 9984), (9729, 9987)] {
            samplers.push(json!({"wrapS": wrap_s, "wrapT": wrap_t, "magFilter": magnified, "minFilter": minified}));
        }
    }
    samplers.extend([
        json!({"minFilter": 9729}),
        json!({"minFilter": 9985}),
        json!({"magFilter": 9729, "minFilter": 9986}),
    ]);
    for (name, repeats) in [("magnified", 1.6), ("minified", 40.0)] {
        let size = LoadOptions { size: [960, 100], ..AT_REST };
        let draw = |name: &str, others: &[[u32; 2]]| -> Result<Drawn, Failed> {
            draw_builder(name, &squares(&image, &samplers, repeats, others), &size)
        };
        let alone = draw(&format!("{name}, alone"), &[])?;
        let beside = draw(&format!("{name}, beside others"), &OTHER_SIZES)?;
        let different = alone.difference(&beside);
        expect(different == 0, || format!("{name}: {different} pixels differ"))?;
        let [darkest, brightest] = alone.extremes([0.1, 0.9], [0.2, 0.8]);
        expect(brightest - darkest > 100, || "the picture is empty".to_owned())?;
    }
    Ok(())
}

/// Images of 5 by 7 pixels, white on the left or above, and black elsewhere. Where they are clamped or mirrored at
/// their right or lower edge they are black, in the first two mip levels and between those.
fn odd_edges() -> Result<(), Failed> {
    const SIZE: [f32; 2] = [960.0, 100.0];
    let image = |is_white: fn(u32, u32) -> bool| {
        RgbaImage::from_fn(5, 7, |x, y| if is_white(x, y) { Rgba([255; 4]) } else { Rgba([0, 0, 0, 255]) })
    };
    let images = [image(|x, _| x < 2), image(|_, y| y < 2)];
    let filters = [(9985, 1.0), (9987, 1.0), (9987, 0.7), (9987, 0.3)];
    let cases: Vec<_> = [33071, 33648].into_iter().flat_map(|wrap| filters.map(|filter| (wrap, filter))).collect();
    let sampler = |&(wrap, (filter, _)): &(u32, (u32, f32))| json!({"wrapS": wrap, "wrapT": wrap, "minFilter": filter});
    let samplers: Vec<_> = cases.iter().map(sampler).collect();
    // A metre in pixels of the picture.
    let metre = SIZE[1] / (2.0 * 2.6 * 0.4_f32.tan());
    for (others, axis) in [[].as_slice(), &OTHER_SIZES].into_iter().flat_map(|others| [(others, 0), (others, 1)]) {
        let mut builder = squares(&images[axis], &samplers, 1.0, others);
        for (number, (_, (_, level))) in cases.iter().enumerate() {
            // Twice the image along one axis, so that the edge is in the middle. The other axis chooses the mip level.
            let minified = level.exp2() * 2.0 * metre / [7.0, 5.0][axis];
            let scale = if axis == 0 { [2.0, minified] } else { [minified, 2.0] };
            builder.json["materials"][number]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
                json!({"KHR_texture_transform": {"scale": scale}});
        }
        let size = LoadOptions { size: SIZE.map(|side| side as u32), ..AT_REST };
        let drawn = draw_builder("odd edges", &builder, &size)?;
        for (number, case) in cases.iter().enumerate() {
            let center = [(number as f32 - (cases.len() as f32 - 1.0) / 2.0) * 2.1, 0.0];
            // From texture coordinates along one axis to the picture.
            let region = |axis: usize, from: f32, to: f32| {
                [from, to].map(|at| 0.5 + (center[axis] + at - 1.0) * metre / SIZE[axis])
            };
            let along = |from: f32, to: f32| match axis {
                0 => drawn.extremes(region(0, from, to), region(1, 0.3, 1.7)),
                _ => drawn.extremes(region(0, 0.3, 1.7), region(1, from, to)),
            };
            let ([_, edge], [opposite, _]) = (along(0.9, 1.1), along(0.06, 0.2));
            expect(edge < 10 && opposite > 600, || {
                format!("{case:?}, axis {axis}, {} others: {edge} at the edge, opposite {opposite}", others.len())
            })?;
        }
    }
    Ok(())
}
