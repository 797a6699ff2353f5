//! Limits of imports, and of what their messages quote.

use std::io;

use drawloom::scene::Assets;
use drawloom::task::Scheduler;
use drawloom::text::excerpt;
use drawloom_obj::{Imported, ObjError, ObjLimits, ObjWarning, read_within};
use libtest_mimic::Failed;
use std::sync::Arc;

use super::NumberCase;
use crate::fixture::{ensure, refused, same};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "imports_within_any_limits",
        numbers: &[
            "drawloom_obj::ObjLimits::all_textures_bytes",
            "drawloom_obj::ObjLimits::decoded_bytes",
            "drawloom_obj::ObjLimits::library_bytes",
            "drawloom_obj::ObjLimits::line_bytes",
            "drawloom_obj::ObjLimits::scene_bytes",
            "drawloom_obj::ObjLimits::texture_bytes",
            "drawloom_obj::ObjLimits::texture_file_bytes",
            "drawloom_obj::ObjLimits::warnings",
            "drawloom_obj::read",
            "drawloom_obj::read_within",
        ],
        check: limits,
    },
    NumberCase { name: "excerpts_of_any_length", numbers: &["text::excerpt"], check: excerpts },
    NumberCase { name: "loads_of_any_priority", numbers: &["scene::AssetLoader::load"], check: loads },
];

fn excerpts() -> Result<(), Failed> {
    for (count, expected) in [(0, "…"), (3, "é\\u{a}表…"), (4, "é\\u{a}表b"), (usize::MAX, "é\\u{a}表b")] {
        same(excerpt("é\n表b", count).as_str(), expected, format_args!("the first {count} characters"))?;
    }
    same(excerpt("", 0).as_str(), "", "nothing")
}

const SCENE: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl one\nf 1/1 2/1 3/1\nnonsense\nnonsense\n";
const LIBRARY: &str = "newmtl one\nmap_Kd a.png\n";

fn read(limits: &ObjLimits) -> Result<Imported, ObjError> {
    let file = |name: &str| match name {
        "a.mtl" => Ok(LIBRARY.as_bytes().to_vec()),
        "a.png" => Ok(png()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    read_within("a.obj", SCENE.as_bytes(), file, limits)
}

/// Four grey pixels.
fn png() -> Vec<u8> {
    let mut bytes = io::Cursor::new(Vec::new());
    let pixels = image::RgbaImage::from_pixel(2, 2, image::Rgba([200; 4]));
    pixels.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

type Set = fn(&mut ObjLimits, u64);

fn limits() -> Result<(), Failed> {
    let fields: [(&str, Set); 7] = [
        ("scene_bytes", |limits, value| limits.scene_bytes = value),
        ("line_bytes", |limits, value| limits.line_bytes = value),
        ("library_bytes", |limits, value| limits.library_bytes = value),
        ("texture_file_bytes", |limits, value| limits.texture_file_bytes = value),
        ("texture_bytes", |limits, value| limits.texture_bytes = value),
        ("all_textures_bytes", |limits, value| limits.all_textures_bytes = value),
        ("decoded_bytes", |limits, value| limits.decoded_bytes = value),
    ];
    let usual = ObjLimits::default();
    let expected = read(&usual)?;
    same(expected.triangles, 1, "triangles")?;
    let mut all = usual;
    for (name, set) in fields {
        for none in [u64::MAX, u64::MAX - 1, 1 << 63, u64::MAX / 2] {
            let mut limits = usual;
            set(&mut limits, none);
            same(read(&limits)?.triangles, 1, format_args!("triangles with {name} = {none}"))?;
            set(&mut all, none);
        }
        for little in [0, 1] {
            let mut limits = usual;
            set(&mut limits, little);
            match (name, read(&limits)) {
                // Longer lines are left out, with a warning; here those are all.
                ("line_bytes", imported) => ensure(imported.is_err(), "there is nothing left")?,
                (_, Ok(imported)) => {
                    // What a material names is left out, with a warning.
                    let names = |warning: &ObjWarning| warning.to_string().contains(name);
                    ensure(imported.warnings.iter().any(names), format_args!("{name}: {:?}", imported.warnings))?;
                }
                (_, refused_import) => refused(refused_import, name)?,
            }
        }
    }
    all.warnings = usize::MAX;
    let imported = read(&all)?;
    same((imported.triangles, imported.warnings.len()), (1, expected.warnings.len()), "without limits")?;
    let imported = read(&ObjLimits { warnings: 0, ..usual })?;
    same((imported.warnings.len(), &imported.warning_counts), (0, &expected.warning_counts), "counted")
}

fn loads() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(1)?);
    let mut assets = Assets::default();
    let loader = assets.loader(&scheduler);
    for priority in [i32::MIN, -1, i32::MAX, 0] {
        let load = || Ok::<_, io::Error>(drawloom::scene::Material::default());
        let handle = loader.load("a material", priority, load);
        same(assets.receive(&loader).count, 1, "it arrives")?;
        assets.set_priority(handle, priority)?;
    }
    Ok(())
}
