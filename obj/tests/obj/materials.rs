//! Materials, textures and lights.

use std::cell::RefCell;
use std::collections::BTreeMap;

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Blend, Light, Material, Texture};
use drawloom_obj::{Imported, ObjLimits, ObjWarning};
use drawloom_testing::demo;
use image::{Rgba, RgbaImage};
use libtest_mimic::Trial;

use crate::folder::{Folder, TRIANGLE, load, mesh};
use crate::trial;

pub fn trials() -> Vec<Trial> {
    vec![
        trial("materials::a_texture_is_not_flipped", a_texture_is_not_flipped),
        trial("materials::a_missing_texture_is_reported", a_missing_texture_is_reported),
        trial("materials::a_large_texture_is_scaled_down", a_large_texture_is_scaled_down),
        trial("materials::a_texture_is_shared", a_texture_is_shared),
        trial("materials::every_texture_is_read_once", every_texture_is_read_once),
        trial("materials::every_material_says_what_its_texture_lacks", every_material_says_what_its_texture_lacks),
        trial("materials::long_names_are_cut_or_refused", long_names_are_cut_or_refused),
        trial("materials::a_texture_is_found_behind_options_quotes_and_comments", a_texture_is_found),
        trial("materials::a_mask_becomes_the_alpha_of_a_blended_material", a_mask_becomes_the_alpha),
        trial("materials::colours_are_enlarged_to_their_mask_within_limits", colours_are_enlarged_within_limits),
        trial("materials::a_mask_that_hides_nothing_does_not_blend", a_mask_that_hides_nothing_does_not_blend),
        trial("materials::d_wins_over_tr", d_wins_over_tr),
        trial("materials::a_missing_library_is_reported", a_missing_library_is_reported),
        trial("materials::an_undefined_material_is_reported", an_undefined_material_is_reported),
        trial("materials::a_colour_of_one_number_is_gray", a_colour_of_one_number_is_gray),
        trial("materials::opacity_0_everywhere_is_treated_as_opaque", opacity_0_everywhere_is_treated_as_opaque),
        trial("materials::opacity_0_of_one_material_is_kept", opacity_0_of_one_material_is_kept),
        trial("materials::an_emissive_plane_is_a_hemispherical_light", an_emissive_plane_is_a_hemispherical_light),
        trial("materials::an_emissive_body_is_a_point_light", an_emissive_body_is_a_point_light),
        trial(
            "materials::demo_lights_are_added_to_a_scene_without_lights",
            demo_lights_are_added_to_a_scene_without_lights,
        ),
    ]
}

/// A triangle of one material, as its library defines it.
fn load_material(library: &str) -> (Material, Imported) {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
    let imported = Folder::new().with("a.obj", text).with("a.mtl", library).load().unwrap();
    (named(&imported, "one"), imported)
}

fn named(imported: &Imported, name: &str) -> Material {
    let mut materials = imported.scene.assets().iter::<Material>().map(|(_, material)| material);
    materials.find(|material| material.name == name).unwrap().clone()
}

fn red_above_blue() -> RgbaImage {
    RgbaImage::from_fn(2, 2, |_, y| if y == 0 { Rgba([255, 0, 0, 255]) } else { Rgba([0, 0, 255, 255]) })
}

fn a_texture_is_not_flipped() {
    let text =
        format!("mtllib a.mtl\nusemtl one\nvt 0 1\nvt 0 0\nvt 1 0\n{}", TRIANGLE.replace("f 1 2 3", "f 1/1 2/2 3/3"));
    let library = "newmtl one\nKd 0 0 0\nmap_Kd -clamp on textures\\a picture.png\n";
    let folder = Folder::new().with("a.obj", text).with("a.mtl", library);
    let imported = folder.with_image("textures/a picture.png", &red_above_blue()).load().unwrap();
    let material = named(&imported, "one");
    // A black diffuse colour with a texture becomes white.
    assert_eq!(material.diffuse, Vec3::ONE);
    let texture: &Texture = imported.scene.assets().get(material.texture.unwrap()).unwrap();
    assert_eq!((texture.width(), texture.height()), (2, 2));
    assert_eq!(texture.pixels()[..4], [255, 0, 0, 255]);
    let uvs: Vec<_> = mesh(&imported, 0).vertices().iter().map(|vertex| vertex.uv).collect();
    assert_eq!(uvs, [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]]);
    assert_eq!(imported.warnings.len(), 1, "{:?}", imported.warnings);
    assert!(imported.warnings[0].to_string().contains("-clamp"));
}

fn a_missing_texture_is_reported() {
    let (material, imported) = load_material("newmtl one\nKd 0.5 0.25 0\nmap_Kd textures/no.png\n");
    assert_eq!((material.diffuse, material.texture), (Vec3::new(0.5, 0.25, 0.0), None));
    let [ObjWarning::UnusableTexture { texture, material, .. }] = &imported.warnings[..] else {
        panic!("{:?}", imported.warnings);
    };
    assert_eq!((texture.as_str(), material.as_str()), ("textures/no.png", "one"));
    // A file that is not an image, with the extension of no image format.
    let (material, imported) = load_material("newmtl one\nKd 0 0 0\nmap_Kd a.mtl\n");
    assert_eq!((material.diffuse, material.texture), (Vec3::ZERO, None));
    assert_eq!(imported.warnings.len(), 1);
}

fn a_large_texture_is_scaled_down() {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
    let wide = RgbaImage::new(Texture::MAX_SIZE + 1, 2);
    let folder = Folder::new().with("a.obj", text).with("a.mtl", "newmtl one\nmap_Kd wide.png\n");
    let imported = folder.with_image("wide.png", &wide).load().unwrap();
    let texture = imported.scene.assets().get(named(&imported, "one").texture.unwrap()).unwrap();
    assert_eq!((texture.width(), texture.height()), (Texture::MAX_SIZE, 2));
    let expected =
        ObjWarning::ScaledTexture { texture: String::from("wide.png"), width: Texture::MAX_SIZE + 1, height: 2 };
    assert_eq!(imported.warnings, [expected]);
}

fn a_texture_is_shared() {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}usemtl two\nf 3 2 1\n");
    let library = "newmtl one\nmap_Kd a.png\nnewmtl two\nKd 0.5 0.5 0.5\nmap_Kd a.png\n";
    let folder = Folder::new().with("a.obj", text).with("a.mtl", library).with_image("a.png", &red_above_blue());
    let imported = folder.load().unwrap();
    assert_eq!(imported.scene.assets().iter::<Texture>().count(), 1);
    assert_eq!(named(&imported, "one").texture, named(&imported, "two").texture);
    assert_eq!(named(&imported, "two").diffuse, Vec3::splat(0.5));
    // Other ways to name the same file, and a mask that hides nothing.
    let library = "newmtl one\nmap_Kd a.png # red\nnewmtl two\nmap_Kd \"a.png\"\nmap_d white.png\n";
    let folder = folder.with("a.mtl", library).with_image("white.png", &RgbaImage::from_pixel(1, 1, Rgba([255; 4])));
    let imported = folder.load().unwrap();
    assert_eq!(imported.scene.assets().iter::<Texture>().count(), 1);
    assert_eq!(named(&imported, "one").texture, named(&imported, "two").texture);
}

fn every_texture_is_read_once() {
    let (mut text, mut library) = (String::from("mtllib a.mtl\n"), String::new());
    text += "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for index in 0..50 {
        text += &format!("usemtl {index}\nf 1 2 3\n");
        let (folder, name) = (["", "./", "in/../"][index / 3 % 3], ["a.png", "broken.png", "no.png"][index % 3]);
        library += &format!("newmtl {index}\nmap_Kd {folder}{name} #{index}\nmap_d {folder}mask.png #{index}\n");
    }
    let mut picture = std::io::Cursor::new(Vec::new());
    red_above_blue().write_to(&mut picture, image::ImageFormat::Png).unwrap();
    let reads = RefCell::new(BTreeMap::new());
    let fetch = |name: &str| {
        *reads.borrow_mut().entry(name.to_owned()).or_insert(0) += 1;
        match name {
            "a.mtl" => Ok(library.clone().into_bytes()),
            "a.png" | "mask.png" => Ok(picture.get_ref().clone()),
            "broken.png" => Ok(picture.get_ref()[..40].to_vec()),
            _ => Err(std::io::ErrorKind::NotFound.into()),
        }
    };
    let imported = drawloom_obj::read("a.obj", text.as_bytes(), fetch).unwrap();
    // That of colours and mask, and that of the mask alone.
    assert_eq!(imported.scene.assets().iter::<Texture>().count(), 2);
    assert_eq!(imported.warning_counts["unusable texture"], 33);
    let expected = [("a.mtl", 1), ("a.png", 1), ("broken.png", 1), ("mask.png", 2), ("no.png", 1)];
    // A name with its comment is the likeliest one, and there is no such file.
    let reads = reads.borrow();
    let named = reads.iter().filter(|(name, _)| !name.contains('#')).map(|(name, count)| (name.as_str(), *count));
    assert_eq!(named.collect::<Vec<_>>(), expected);
    assert!(reads.iter().all(|(name, &count)| !name.contains('#') || count == 1), "{reads:?}");
}

/// A picture that was decoded for one material may be gone when another one needs it with a mask.
fn every_material_says_what_its_texture_lacks() {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}usemtl two\nf 1 2 3\nusemtl three\nf 1 2 3\n");
    let mut picture = std::io::Cursor::new(Vec::new());
    red_above_blue().write_to(&mut picture, image::ImageFormat::Png).unwrap();
    let reads = RefCell::new(0);
    let fetch = |name: &str| match name {
        "a.mtl" => {
            let masked = "map_Kd a.png\nmap_d mask.png";
            Ok(format!("newmtl one\nmap_Kd a.png\nnewmtl two\n{masked}\nnewmtl three\n{masked} # 3\n").into_bytes())
        }
        "mask.png" => Ok(picture.get_ref().clone()),
        "a.png" if reads.replace_with(|reads| *reads + 1) == 0 => Ok(picture.get_ref().clone()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    };
    let imported = drawloom_obj::read("a.obj", text.as_bytes(), fetch).unwrap();
    let lacking = imported.warnings.iter().map(|warning| match warning {
        ObjWarning::UnusableTexture { texture, material, .. } => (texture.as_str(), material.as_str()),
        _ => panic!("{warning:?}"),
    });
    assert_eq!(lacking.collect::<Vec<_>>(), [("a.png", "two"), ("a.png", "three")]);
}

fn long_names_are_cut_or_refused() {
    let long = "long".repeat(50_000);
    let faces = "usemtl one\nf 1 2 3\nusemtl two\nf 3 2 1\n".repeat(500);
    let text = format!("mtllib a.mtl\nmtllib {long}\nv 0 0 0\nv 1 0 0\nv 0 1 0\no {long}\n{faces}");
    let library = format!("newmtl one\nmap_Kd {long}.png\nnewmtl two\n");
    let imported = Folder::new().with("a.obj", text).with("a.mtl", library).load().unwrap();
    assert_eq!(imported.triangles, 1000);
    assert_eq!(mesh(&imported, 0).name().chars().count(), 161);
    let [ObjWarning::LibraryLine { line: 2, reason, .. }, ObjWarning::MissingLibrary { reason: library, .. }] =
        &imported.warnings[..]
    else {
        panic!("{:?}", imported.warnings);
    };
    assert_eq!(reason, "a texture was left out: the name has more than 4095 bytes");
    assert_eq!(library, "the name has more than 4095 bytes");
}

fn a_texture_is_found() {
    for (statement, warnings) in [
        ("map_Kd a leaf.png", 0),
        ("map_Kd \"a leaf.png\"", 0),
        ("map_Kd a leaf.png # from the garden", 0),
        ("map_Kd a\\ leaf.png", 0),
        ("map_Kd -s 2 2 2 \"a leaf.png\"", 1),
        ("map_Kd a leaf.png -s 2 2 2", 1),
        ("map_Kd -colorspace sRGB leaf.png", 1),
    ] {
        let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
        let folder = Folder::new().with("a.obj", text).with("a.mtl", format!("newmtl one\n{statement}\n"));
        let folder = folder.with_image("a leaf.png", &red_above_blue()).with_image("leaf.png", &red_above_blue());
        let imported = folder.load().unwrap();
        assert!(named(&imported, "one").texture.is_some(), "{statement}: {:?}", imported.warnings);
        assert_eq!(imported.warnings.len(), warnings, "{statement}: {:?}", imported.warnings);
    }
    // So is a library, also in a list that is longer than the name of a file may be.
    let list = format!("mtllib my\\ materials.mtl\nmtllib {}b.mtl", "a.mtl ".repeat(99));
    let folder = Folder::new().with("a.obj", format!("{list}\nusemtl two\n{TRIANGLE}")).with("a.mtl", "newmtl one\n");
    let folder = folder.with("b.mtl", "newmtl two\nKd 0 1 0").with("my materials.mtl", "newmtl two\nKd 1 0 0");
    assert_eq!(named(&folder.load().unwrap(), "two").diffuse, Vec3::Y);
    for statement in ["mtllib \"my materials.mtl\"", "mtllib my materials.mtl # all", "mtllib my\\ materials.mtl"] {
        let text = format!("{statement}\nusemtl one\n{TRIANGLE}");
        let imported =
            Folder::new().with("a.obj", text).with("my materials.mtl", "newmtl one\nKd 1 0 0").load().unwrap();
        assert_eq!((named(&imported, "one").diffuse, imported.warnings), (Vec3::X, vec![]), "{statement}");
    }
}

/// The alphas of the texture of material `one`, row by row.
fn alphas(imported: &Imported) -> Vec<u8> {
    let texture = imported.scene.assets().get(named(imported, "one").texture.unwrap()).unwrap();
    texture.pixels().chunks(4).map(|pixel| pixel[3]).collect()
}

fn load_masked(library: &str, colors: &RgbaImage, mask: &RgbaImage) -> Imported {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
    let folder = Folder::new().with("a.obj", text).with("a.mtl", library);
    folder.with_image("a.png", colors).with_image("mask.png", mask).load().unwrap()
}

fn a_mask_becomes_the_alpha() {
    let gray = RgbaImage::from_fn(1, 2, |_, y| Rgba([[40, 40, 40, 255], [255; 4]][y as usize]));
    let alpha = RgbaImage::from_fn(4, 4, |x, _| Rgba([9, 9, 9, if x < 2 { 0 } else { 200 }]));
    let both = "newmtl one\nmap_Kd a.png\nmap_d mask.png\n";
    for (mask, expected) in [(&gray, vec![40, 40, 255, 255]), (&alpha, [0, 0, 200, 200].repeat(4))] {
        let imported = load_masked(both, &red_above_blue(), mask);
        let material = named(&imported, "one");
        assert_eq!((material.blend, material.opacity, material.diffuse), (Blend::Alpha, 1.0, Vec3::ONE));
        assert_eq!(alphas(&imported), expected);
        let texture = imported.scene.assets().get(material.texture.unwrap()).unwrap();
        assert_eq!(texture.pixels()[..3], [255, 0, 0]);
        assert_eq!(imported.warnings, []);
    }
    // One colour, and the leaves in the mask.
    let leaves = load_masked(both, &RgbaImage::from_pixel(1, 1, Rgba([0, 90, 0, 255])), &alpha);
    assert_eq!(alphas(&leaves), [0, 0, 200, 200].repeat(4));
    let texture = leaves.scene.assets().get(named(&leaves, "one").texture.unwrap()).unwrap();
    assert!(texture.pixels().chunks(4).all(|pixel| pixel[..3] == [0, 90, 0]));
    // Without colours, or if they cannot be used.
    let alone = load_masked("newmtl one\nKd 0 1 0\nmap_d mask.png\n", &gray, &gray);
    assert_eq!((named(&alone, "one").diffuse, alphas(&alone)), (Vec3::Y, vec![40, 255]));
    let colors_missing = load_masked("newmtl one\nKd 0 1 0\nmap_Kd no.png\nmap_d mask.png\n", &gray, &gray);
    assert_eq!((named(&colors_missing, "one").diffuse, alphas(&colors_missing)), (Vec3::Y, vec![40, 255]));
    assert_eq!(colors_missing.warnings.len(), 1);
}

fn colours_are_enlarged_within_limits() {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
    let folder = Folder::new().with("a.obj", text).with("a.mtl", "newmtl one\nmap_Kd a.png\nmap_d mask.png\n");
    let folder = folder.with_image("a.png", &RgbaImage::from_pixel(8, 1, Rgba([0, 90, 0, 255])));
    let folder = folder.with_image("mask.png", &RgbaImage::from_fn(1, 8, |_, y| Rgba([0, 0, 0, y as u8 * 9])));
    let of_all = |bytes| ObjLimits { all_textures_bytes: bytes, ..ObjLimits::default() };
    let of_each = |bytes| ObjLimits { texture_bytes: bytes, ..ObjLimits::default() };
    for limits in [of_all(256), of_each(256)] {
        let imported = folder.load_within(&limits).unwrap();
        assert_eq!((alphas(&imported).len(), imported.warnings), (64, vec![]), "{limits:?}");
    }
    for limits in [of_all(255), of_each(255)] {
        let imported = folder.load_within(&limits).unwrap();
        let expected = ObjWarning::ScaledTexture { texture: String::from("mask.png"), width: 1, height: 8 };
        assert_eq!((alphas(&imported).len(), imported.warnings), (8, vec![expected]), "{limits:?}");
    }
}

fn a_mask_that_hides_nothing_does_not_blend() {
    let both = "newmtl one\nmap_Kd a.png\nmap_d mask.png\n";
    let white = RgbaImage::from_pixel(2, 2, Rgba([255; 4]));
    let imported = load_masked(both, &red_above_blue(), &white);
    assert_eq!((named(&imported, "one").blend, imported.warnings), (Blend::None, vec![]));
    let black = RgbaImage::from_pixel(2, 2, Rgba([0, 0, 0, 255]));
    let imported = load_masked(both, &red_above_blue(), &black);
    assert_eq!(imported.warnings, [ObjWarning::InvisibleMaterial { material: String::from("one") }]);
    let imported = load_masked(&both.replace("mask.png", "no.png"), &red_above_blue(), &black);
    assert_eq!(named(&imported, "one").blend, Blend::None);
    assert!(matches!(&imported.warnings[..], [ObjWarning::UnusableTexture { texture, .. }] if texture == "no.png"));
}

fn d_wins_over_tr() {
    let library = "newmtl one\nd 1\nTr 1\nnewmtl two\nd 0.5\nTr 0.5\n";
    let (material, imported) = load_material(library);
    assert_eq!((material.opacity, material.blend), (1.0, Blend::None));
    let [ObjWarning::LibraryLine { line: 3, reason, .. }] = &imported.warnings[..] else {
        panic!("{:?}", imported.warnings);
    };
    assert_eq!(reason, "`Tr 1` contradicts `d 1` and was left out");
}

fn a_missing_library_is_reported() {
    let imported = load(&format!("mtllib no.mtl\n{TRIANGLE}"));
    let [ObjWarning::MissingLibrary { library, .. }] = &imported.warnings[..] else {
        panic!("{:?}", imported.warnings);
    };
    assert_eq!(library, "no.mtl");
    let unnamed = load(&format!("mtllib\n{TRIANGLE}"));
    let [warning] = &unnamed.warnings[..] else { panic!("{:?}", unnamed.warnings) };
    assert_eq!(warning.to_string(), "material library `` cannot be read: there is no name");
    let object = imported.scene.objects().next().unwrap();
    let material = imported.scene.object(object).unwrap().material;
    let material = imported.scene.assets().get(material).unwrap();
    assert_eq!(*material, Material { double_sided: true, ..Material::default() });
}

fn an_undefined_material_is_reported() {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}usemtl no such one\nf 3 2 1\n");
    let imported = Folder::new().with("a.obj", text).with("a.mtl", "newmtl one\nKd 1 0 0\n").load().unwrap();
    assert_eq!(imported.warnings, [ObjWarning::UndefinedMaterial { material: String::from("no such one") }]);
    let diffuse = imported.scene.objects().map(|object| {
        let material = imported.scene.object(object).unwrap().material;
        imported.scene.assets().get(material).unwrap().diffuse
    });
    assert_eq!(diffuse.collect::<Vec<_>>(), [Vec3::X, Material::default().diffuse]);
}

fn a_colour_of_one_number_is_gray() {
    let (material, imported) = load_material("newmtl one\nKd 0.25\n");
    assert_eq!(material.diffuse, Vec3::splat(0.25));
    assert_eq!(imported.warnings, []);
}

fn opacity_0_everywhere_is_treated_as_opaque() {
    let (material, imported) = load_material("newmtl one\nd 0\nnewmtl two\nTr 1\nnewmtl three\n");
    assert_eq!((material.opacity, material.blend), (1.0, Blend::None));
    assert_eq!(imported.warnings, [ObjWarning::InvertedOpacity { invisible: 2, materials: 2 }]);
}

fn opacity_0_of_one_material_is_kept() {
    let (material, imported) = load_material("newmtl one\nd 0\nnewmtl two\nd 1\n");
    assert_eq!((material.opacity, material.blend), (0.0, Blend::Alpha));
    assert_eq!(imported.warnings, [ObjWarning::InvisibleMaterial { material: String::from("one") }]);
    let (material, _) = load_material("newmtl one\nTr 0.25\n");
    assert_eq!((material.opacity, material.blend), (0.75, Blend::Alpha));
}

const EMISSIVE: &str = "newmtl glow\nKe 2 1 0.5\n";

fn an_emissive_plane_is_a_hemispherical_light() {
    let text = "mtllib a.mtl\nusemtl glow\nv 0 5 0\nv 3 5 0\nv 3 5 2\nv 0 5 2\n";
    // The winding faces up. A normal in the file takes precedence.
    for (face, normal) in [("f 4 3 2 1", Vec3::Y), ("f 4//1 3//1 2//1 1//1\n", Vec3::NEG_Y)] {
        let text = format!("{text}vn 0 -1 0\n{face}\n");
        let imported = Folder::new().with("a.obj", text).with("a.mtl", EMISSIVE).load().unwrap();
        let [Light::Hemispherical { position, direction, intensity, range, casts_shadow: true }] =
            imported.scene.lights[..]
        else {
            panic!("{:?}", imported.scene.lights);
        };
        assert!(direction.abs_diff_eq(normal, 1e-6), "{direction}");
        assert!(intensity.abs_diff_eq(Vec3::new(12.0, 6.0, 3.0), 1e-4), "{intensity}");
        let off = (position - DVec3::new(1.5, 5.0, 1.0)).dot(normal.as_dvec3());
        assert!(off > 0.0 && off < 0.01, "{position}");
        assert!(range > 3.0 && range < 100.0, "{range}");
    }
}

fn an_emissive_body_is_a_point_light() {
    let mut text = String::from("mtllib a.mtl\nusemtl glow\n");
    for corner in 0..8 {
        let side = |bit: u32| 10 + 2 * ((corner >> bit) & 1);
        text += &format!("v {} {} {}\n", side(0), side(1), side(2));
    }
    text += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let imported = Folder::new().with("a.obj", text).with("a.mtl", EMISSIVE).load().unwrap();
    let [Light::Point { position, intensity, .. }] = imported.scene.lights[..] else {
        panic!("{:?}", imported.scene.lights);
    };
    assert!(position.distance(DVec3::splat(11.0)) < 1e-6, "{position}");
    // A quarter of six sides of 4 m².
    assert!(intensity.abs_diff_eq(Vec3::new(12.0, 6.0, 3.0), 1e-4), "{intensity}");
}

fn demo_lights_are_added_to_a_scene_without_lights() {
    let mut imported = load(TRIANGLE);
    assert_eq!((imported.scene.lights.len(), imported.scene.cameras.len()), (0, 0));
    demo::add_camera_and_lights(&mut imported.scene);
    let [
        Light::Directional { illuminance: key, .. },
        Light::Directional { illuminance: fill, .. },
        Light::Point { .. },
    ] = imported.scene.lights[..]
    else {
        panic!("{:?}", imported.scene.lights);
    };
    assert!(key.x > key.z && fill.z > fill.x, "a warm key and a cool fill");
    assert!(imported.scene.ambient.min_element() > 0.0);
    assert!(imported.scene.background.z > imported.scene.background.x);
    assert_eq!(imported.scene.cameras[0].name, "main");
}
