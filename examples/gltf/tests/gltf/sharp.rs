//! Images keep their pixels, however many sizes of images a file has: those that share a texture array look as those
//! with one of their own.

use image::{Rgba, RgbaImage};
use libtest_mimic::Failed;
use serde_json::json;

use crate::fixture::{AT_REST, Drawn, draw_builder, expect};
use crate::generate::builder::Builder;
use crate::generate::shapes::square;
use gltf_scene::LoadOptions;

pub const CASES: &[crate::Case] = &[
    ("nearest_pixels_are_sharp_beside_images_of_many_sizes", nearest),
    ("images_that_share_an_array_look_as_those_with_their_own", shared),
];

/// Sizes that the images of tests share arrays with, far beside the picture.
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

fn shared() -> Result<(), Failed> {
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
        let own = draw(&format!("{name}, own array"), &[])?;
        let shared = draw(&format!("{name}, shared array"), &OTHER_SIZES)?;
        let different = own.difference(&shared);
        // Where two pixels are as near, either is right: a few at the edges of pixels.
        expect(different < 40, || format!("{name}: {different} pixels differ"))?;
        let [darkest, brightest] = own.extremes([0.1, 0.9], [0.2, 0.8]);
        expect(brightest - darkest > 100, || "the picture is empty".to_owned())?;
    }
    Ok(())
}
