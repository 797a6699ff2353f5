//! Which `map_d` cuts holes, and which is blended.

use std::io::Cursor;

use drawloom::scene::{Blend, Material};
use drawloom_obj::{Imported, ObjLimits, ObjWarning};
use image::codecs::jpeg::JpegEncoder;
use image::{GrayImage, Luma, Rgba, RgbaImage};
use libtest_mimic::Trial;

use crate::folder::{Folder, TRIANGLE};
use crate::trial;

pub fn trials() -> Vec<Trial> {
    vec![
        trial("masks::black_and_white_cut_holes", black_and_white_cut_holes),
        trial("masks::blurred_edges_cut_holes_and_wide_transitions_blend", blurred_edges),
        trial("masks::the_noise_of_jpeg_cuts_holes", noise_of_jpeg),
        trial("masks::single_gray_texels_do_not_blend_a_mask", single_gray_texels),
        trial("masks::white_hides_nothing_and_black_hides_all", white_and_black),
        trial("masks::glass_is_blended", glass_is_blended),
        trial("masks::a_transparent_material_with_a_mask_is_blended", transparent_materials),
        trial("masks::the_alpha_of_colours_counts_only_as_a_mask", alpha_of_colors),
        trial("masks::a_mask_that_is_scaled_down_cuts_holes", scaled_down),
    ]
}

/// What a mask makes of a material.
#[derive(Debug, PartialEq)]
enum Kind {
    Opaque,
    Masked,
    Blended,
}

const BOTH: &str = "newmtl one\nmap_Kd a.png\nmap_d mask.png\n";

fn import(library: &str, mask_name: &str, mask: &[u8], limits: &ObjLimits) -> Imported {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
    let folder = Folder::new().with("a.obj", text).with("a.mtl", library).with(mask_name, mask);
    folder.with_image("a.png", &RgbaImage::from_pixel(2, 2, Rgba([0, 90, 0, 255]))).load_within(limits).unwrap()
}

fn material(imported: &Imported) -> Material {
    imported.scene.assets().iter::<Material>().find(|(_, material)| material.name == "one").unwrap().1.clone()
}

fn kind_of(material: &Material) -> Kind {
    match (material.blend, material.alpha_cutoff) {
        (Blend::None, None) => Kind::Opaque,
        (Blend::None, Some(0.5)) => Kind::Masked,
        (Blend::Alpha, None) => Kind::Blended,
        other => panic!("{other:?}"),
    }
}

fn png(image: &GrayImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    image.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    bytes
}

fn loaded(image: &GrayImage) -> Imported {
    import(BOTH, "mask.png", &png(image), &ObjLimits::default())
}

fn kind(image: &GrayImage) -> Kind {
    kind_of(&material(&loaded(image)))
}

/// A leaf with teeth, whose edge is `width` texels wide; `hole` and `solid` are its values.
fn leaf(side: u32, width: f64, [hole, solid]: [f64; 2]) -> GrayImage {
    GrayImage::from_fn(side, side, |x, y| {
        let [x, y] = [x, y].map(|texel| f64::from(texel) + 0.5 - f64::from(side) / 2.0);
        let radius = f64::from(side) * (0.3 + 0.08 * (y.atan2(x) * 7.0).sin());
        let inside = ((radius - x.hypot(y)) / width.max(1e-9) + 0.5).clamp(0.0, 1.0);
        Luma([(hole + (solid - hole) * inside).round() as u8])
    })
}

fn black_and_white_cut_holes() {
    for side in [1, 2, 3, 8, 31, 200] {
        let half = GrayImage::from_fn(side.max(2), side, |x, _| Luma([if x < side.max(2) / 2 { 0 } else { 255 }]));
        let imported = loaded(&half);
        let material = material(&imported);
        assert_eq!((kind_of(&material), material.opacity, imported.warnings), (Kind::Masked, 1.0, vec![]), "{side}");
    }
    assert_eq!(kind(&leaf(64, 0.0, [0.0, 255.0])), Kind::Masked);
    // Holes alone, of one texel among many.
    let pinhole = GrayImage::from_fn(90, 90, |x, y| Luma([if (x, y) == (70, 20) { 0 } else { 255 }]));
    assert_eq!(kind(&pinhole), Kind::Masked);
}

fn blurred_edges() {
    for (width, expected) in [(1.0, Kind::Masked), (2.0, Kind::Masked), (16.0, Kind::Blended)] {
        assert_eq!(kind(&leaf(96, width, [0.0, 255.0])), expected, "{width}");
    }
    // From one side of the picture to the other.
    assert_eq!(kind(&GrayImage::from_fn(64, 64, |x, _| Luma([(x * 4) as u8]))), Kind::Blended);
    // The edge between the last column and the first, because textures repeat.
    let across = |x: u32| [90, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 170][x as usize];
    assert_eq!(kind(&GrayImage::from_fn(16, 16, |x, _| Luma([across(x)]))), Kind::Masked);
}

fn noise_of_jpeg() {
    for quality in [60, 75, 90, 100] {
        for (image, expected) in [
            (leaf(128, 0.0, [0.0, 255.0]), Kind::Masked),
            (leaf(128, 2.0, [0.0, 255.0]), Kind::Masked),
            (leaf(128, 30.0, [0.0, 255.0]), Kind::Blended),
            (GrayImage::from_pixel(32, 32, Luma([128])), Kind::Blended),
            (GrayImage::from_pixel(32, 32, Luma([255])), Kind::Opaque),
        ] {
            let mut jpeg = Vec::new();
            image.write_with_encoder(JpegEncoder::new_with_quality(&mut jpeg, quality)).unwrap();
            let library = BOTH.replace("mask.png", "mask.jpg");
            let imported = import(&library, "mask.jpg", &jpeg, &ObjLimits::default());
            assert_eq!((kind_of(&material(&imported)), imported.warnings), (expected, vec![]), "{quality}");
        }
    }
    let noisy = |low: u8, high: u8| {
        GrayImage::from_fn(40, 40, |x, y| Luma([if x < 20 { (x * 7 + y * 3) as u8 % 16 + low } else { high }]))
    };
    assert_eq!(kind(&noisy(0, 240)), Kind::Masked);
    assert_eq!(kind(&noisy(20, 240)), Kind::Blended, "it has no holes");
    assert_eq!(kind(&noisy(0, 200)), Kind::Blended, "it is not solid");
}

fn single_gray_texels() {
    let with = |side: u32, gray: &[(u32, u32)]| {
        GrayImage::from_fn(side, side, |x, y| match (x, y) {
            place if gray.contains(&place) => Luma([128]),
            (0, _) | (_, 0) => Luma([0]),
            _ => Luma([255]),
        })
    };
    // One in 64 may be anywhere, and all that are near the border's holes.
    assert_eq!(kind(&with(8, &[(4, 4)])), Kind::Masked);
    assert_eq!(kind(&with(8, &[(4, 4), (5, 4)])), Kind::Blended);
    assert_eq!(kind(&with(8, &[(4, 4), (2, 2), (1, 6), (7, 1)])), Kind::Masked);
    assert_eq!(kind(&with(16, &[(4, 4), (9, 9), (4, 9), (9, 4)])), Kind::Masked);
    assert_eq!(kind(&with(16, &[(4, 4), (9, 9), (4, 9), (9, 4), (7, 7)])), Kind::Blended);
    assert_eq!(kind(&with(4, &[(2, 2)])), Kind::Masked, "it is near the border");
}

fn white_and_black() {
    for value in [240, 254, 255] {
        let imported = loaded(&GrayImage::from_pixel(5, 4, Luma([value])));
        assert_eq!((kind_of(&material(&imported)), imported.warnings), (Kind::Opaque, vec![]), "{value}");
    }
    for value in [0, 15] {
        let imported = loaded(&GrayImage::from_pixel(5, 4, Luma([value])));
        let expected = vec![ObjWarning::InvisibleMaterial { material: String::from("one") }];
        assert_eq!((kind_of(&material(&imported)), imported.warnings), (Kind::Masked, expected), "{value}");
    }
}

fn glass_is_blended() {
    for value in [16, 128, 239] {
        assert_eq!(kind(&GrayImage::from_pixel(9, 9, Luma([value]))), Kind::Blended, "{value}");
    }
    // A frame around glass, and glass with holes.
    let framed = |frame: u8| {
        let is_frame = |x: u32, y: u32| x % 24 < 3 || y % 24 < 3;
        GrayImage::from_fn(24, 24, |x, y| Luma([if is_frame(x, y) { frame } else { 100 }]))
    };
    assert_eq!([kind(&framed(255)), kind(&framed(0))], [Kind::Blended, Kind::Blended]);
}

fn transparent_materials() {
    let mask = png(&leaf(32, 0.0, [0.0, 255.0]));
    for (opacity, expected) in [("1", Kind::Masked), ("0.99", Kind::Blended), ("0.5", Kind::Blended)] {
        let imported = import(&format!("{BOTH}d {opacity}\n"), "mask.png", &mask, &ObjLimits::default());
        let material = material(&imported);
        assert_eq!((kind_of(&material), imported.warnings), (expected, vec![]), "{opacity}");
        assert_eq!(material.opacity, opacity.parse::<f32>().unwrap());
    }
    // Two materials share the texture, and differ in what they make of its alpha.
    let library = format!("{BOTH}newmtl two\nmap_Kd a.png\nmap_d mask.png\nd 0.5\n");
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}usemtl two\nf 3 2 1\n");
    let folder = Folder::new().with("a.obj", text).with("a.mtl", library).with("mask.png", &mask);
    let imported = folder.with_image("a.png", &RgbaImage::from_pixel(2, 2, Rgba([9; 4]))).load().unwrap();
    let materials: Vec<_> = imported.scene.assets().iter::<Material>().map(|(_, material)| material).collect();
    assert_eq!(materials[0].texture, materials[1].texture);
    assert_eq!([kind_of(materials[0]), kind_of(materials[1])], [Kind::Masked, Kind::Blended]);
}

fn alpha_of_colors() {
    let colors = RgbaImage::from_fn(16, 16, |x, _| Rgba([9, 99, 9, if x < 8 { 0 } else { 255 }]));
    let import = |library: &str| {
        let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
        let folder = Folder::new().with("a.obj", text).with("a.mtl", library).with_image("a.png", &colors);
        kind_of(&material(&folder.load().unwrap()))
    };
    assert_eq!(import("newmtl one\nmap_Kd a.png\nmap_d a.png\n"), Kind::Masked);
    assert_eq!(import("newmtl one\nmap_Kd a.png\n"), Kind::Opaque);
    assert_eq!(import("newmtl one\nmap_Kd a.png\nd 0.5\n"), Kind::Blended);
    assert_eq!(import("newmtl one\nKd 0 1 0\nmap_d a.png\n"), Kind::Masked);
}

/// The colours cannot take the mask's size within the limits.
fn scaled_down() {
    let mask = GrayImage::from_fn(1, 64, |_, y| Luma([if y < 32 { 0 } else { 255 }]));
    let limits = ObjLimits { all_textures_bytes: 2 * 64 * 4 - 1, ..ObjLimits::default() };
    let imported = import(BOTH, "mask.png", &png(&mask), &limits);
    let expected = ObjWarning::ScaledTexture { texture: String::from("mask.png"), width: 1, height: 64 };
    assert_eq!(imported.warnings, [expected]);
    let pixels = imported.scene.assets().get(material(&imported).texture.unwrap()).unwrap().pixels();
    assert_eq!(pixels.chunks(4).map(|pixel| pixel[3]).collect::<Vec<_>>(), [0, 0, 255, 255]);
    assert_eq!(kind_of(&material(&imported)), Kind::Masked);
}
