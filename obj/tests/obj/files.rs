//! What is no regular file, or is too large, is refused, whichever file names it.

use std::fs::File;
use std::io;
use std::path::Path;
use std::process::Command;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use drawloom_obj::{Imported, ObjError, ObjLimits, ObjWarning};
use image::{ImageFormat, Rgba, RgbaImage};
use libtest_mimic::Trial;

use crate::folder::{Folder, TRIANGLE};
use crate::trial;

/// A test that has not ended by then hangs.
const DEADLINE: Duration = Duration::from_secs(60);

pub fn trials() -> Vec<Trial> {
    // Other systems have no such files.
    let on_unix = |name: &str, test: fn()| trial(format!("files::{name}"), test).with_ignored_flag(!cfg!(unix));
    vec![
        on_unix("a_fifo_is_refused_without_waiting_for_a_writer", a_fifo_is_refused),
        on_unix("a_device_is_refused", a_device_is_refused),
        on_unix("a_sparse_file_of_10_gb_is_refused", a_sparse_file_is_refused),
        trial("files::a_library_that_cannot_be_read_is_named_once", a_library_that_cannot_be_read)
            .with_ignored_flag(!cfg!(target_os = "linux")),
        trial("files::what_is_missing_behind_the_end_of_a_texture_is_no_limit", behind_the_end_of_a_texture),
        trial("files::every_limit_is_named_with_its_value", every_limit_is_named_with_its_value),
        trial(
            "files::a_file_of_one_long_line_is_an_error_that_says_so",
            a_file_of_one_long_line_is_an_error_that_says_so,
        ),
        trial("files::libraries_share_a_limit", libraries_share_a_limit),
        trial("files::textures_share_a_limit", textures_share_a_limit),
        trial("files::what_is_decoded_is_bounded_whatever_comes_of_it", what_is_decoded_is_bounded),
    ]
}

/// A folder whose scene uses a library and a texture.
fn folder() -> Folder {
    let folder = Folder::new().with("a.obj", format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}"));
    folder.with("a.mtl", "newmtl one\nKd 1 0 0\nmap_Kd a.png\n").with_image("a.png", &RgbaImage::new(20, 10))
}

/// What comes of the scene, if anything does.
fn load(folder: Folder, limits: ObjLimits) -> Result<Imported, ObjError> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        // Nobody receives what comes after the deadline.
        let _ = sender.send(folder.load_within(&limits));
    });
    receiver.recv_timeout(DEADLINE).expect("the import hangs")
}

/// Loads the scene after one of its files was replaced. Returns why this file cannot be used.
fn reason(name: &str, limits: ObjLimits, replace: impl FnOnce(&Path)) -> String {
    let folder = folder();
    let path = folder.0.join(name);
    std::fs::remove_file(&path).unwrap();
    replace(&path);
    reason_of(name, load(folder, limits))
}

fn reason_of(name: &str, result: Result<Imported, ObjError>) -> String {
    match (name, result.map(|imported| imported.warnings)) {
        ("a.obj", Err(ObjError::Unreadable { source, .. })) => source.to_string(),
        ("a.png", Ok(warnings)) => match &warnings[..] {
            [ObjWarning::UnusableTexture { reason, .. }] => reason.clone(),
            _ => panic!("{warnings:?}"),
        },
        ("a.mtl", Ok(warnings)) => match &warnings[..] {
            [ObjWarning::MissingLibrary { reason, .. }, ObjWarning::UndefinedMaterial { .. }] => reason.clone(),
            _ => panic!("{warnings:?}"),
        },
        (_, result) => panic!("{name}: {result:?}"),
    }
}

const FILES: [&str; 3] = ["a.obj", "a.mtl", "a.png"];

fn a_fifo_is_refused() {
    for name in FILES {
        let reason = reason(name, ObjLimits::default(), |path| {
            assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
        });
        assert_eq!(reason, "it is not a regular file", "{name}");
    }
}

fn a_device_is_refused() {
    for name in FILES {
        let reason = reason(name, ObjLimits::default(), |path| {
            #[cfg(unix)]
            std::os::unix::fs::symlink("/dev/zero", path).unwrap();
            assert!(path.exists());
        });
        assert_eq!(reason, "it is not a regular file", "{name}");
    }
}

fn a_sparse_file_is_refused() {
    let limits = [("scene_bytes", 1_u64 << 30), ("library_bytes", 64 << 20), ("texture_file_bytes", 256 << 20)];
    for (name, (field, limit)) in FILES.into_iter().zip(limits) {
        let reason = reason(name, ObjLimits::default(), |path| File::create(path).unwrap().set_len(10 << 30).unwrap());
        assert_eq!(reason, format!("it takes 10737418240 bytes or more, and `ObjLimits::{field}` is {limit}"));
    }
}

/// The name has a space, so it might be a list of names, too.
fn a_library_that_cannot_be_read() {
    let folder = Folder::new().with("a.obj", format!("mtllib my file.mtl\nusemtl one\n{TRIANGLE}"));
    // The memory at address 0.
    #[cfg(unix)]
    std::os::unix::fs::symlink("/proc/self/mem", folder.0.join("my file.mtl")).unwrap();
    let reason = reason_of("a.mtl", load(folder, ObjLimits::default()));
    assert!(reason.starts_with("Input/output error"), "{reason}");
}

/// Pixels, or a segment, that the header says to be behind the end.
fn behind_the_end_of_a_texture() {
    let bmp_header = [40_u32, 1, 1, 24 << 16 | 1, 0, 4, 0, 0, 0, 0].map(u32::to_le_bytes).concat();
    let bmp = [b"BM\x46\0\0\0\0\0\0\0\xff\xff\xff\xff", &bmp_header[..], &[0; 16]].concat();
    for bytes in [&bmp[..], b"\xff\xd8\xff\xe0\xff\xff"] {
        let limits = ObjLimits { texture_file_bytes: 100, ..ObjLimits::default() };
        let reason = reason("a.png", limits, |path| std::fs::write(path, bytes).unwrap());
        assert!(!reason.contains("ObjLimits"), "{reason}");
    }
}

fn every_limit_is_named_with_its_value() {
    let default = ObjLimits::default;
    let scene_bytes = std::fs::metadata(folder().0.join("a.obj")).unwrap().len();
    let library_bytes = std::fs::metadata(folder().0.join("a.mtl")).unwrap().len();
    let texture_file_bytes = std::fs::metadata(folder().0.join("a.png")).unwrap().len();
    for (name, field, needed, with) in [
        (
            "a.obj",
            "scene_bytes",
            scene_bytes,
            (|bytes| ObjLimits { scene_bytes: bytes, ..ObjLimits::default() }) as fn(u64) -> ObjLimits,
        ),
        ("a.mtl", "library_bytes", library_bytes, |bytes| ObjLimits { library_bytes: bytes, ..ObjLimits::default() }),
        ("a.png", "texture_file_bytes", texture_file_bytes, |bytes| ObjLimits {
            texture_file_bytes: bytes,
            ..ObjLimits::default()
        }),
        ("a.png", "texture_bytes", 800, |bytes| ObjLimits { texture_bytes: bytes, ..ObjLimits::default() }),
        ("a.png", "all_textures_bytes", 800, |bytes| ObjLimits { all_textures_bytes: bytes, ..ObjLimits::default() }),
    ] {
        assert_eq!(load(folder(), with(needed)).unwrap().warnings, [], "{field}");
        let reason = reason_of(name, load(folder(), with(needed - 1)));
        let expected = format!("it takes {needed} bytes or more, and `ObjLimits::{field}` is {}", needed - 1);
        assert!(reason.ends_with(&expected), "{reason}");
    }
    let error = load(folder(), ObjLimits { scene_bytes: 9, ..default() }).unwrap_err();
    let ObjError::Unreadable { file, source } = error else { panic!("{error}") };
    assert!(file.ends_with("a.obj"));
    assert_eq!(source.kind(), io::ErrorKind::FileTooLarge);
    let long = ObjLimits { line_bytes: 11, ..default() };
    let warnings = load(folder(), long).unwrap().warnings;
    assert!(matches!(warnings[0], ObjWarning::LongLines { lines: 1, first_line: 1, limit: 11, .. }), "{warnings:?}");
}

fn a_file_of_one_long_line_is_an_error_that_says_so() {
    let folder = Folder::new().with("a.obj", vec![0; 1000]);
    let error = folder.load_within(&ObjLimits { line_bytes: 999, ..ObjLimits::default() }).unwrap_err();
    assert!(error.to_string().ends_with("line 1: the line has more bytes than `ObjLimits::line_bytes`"), "{error}");
}

fn libraries_share_a_limit() {
    let folder = Folder::new().with("a.obj", format!("mtllib a.mtl b.mtl c.mtl\nusemtl b\n{TRIANGLE}"));
    let folder = folder.with("a.mtl", "newmtl a\nKd 1\n").with("b.mtl", "newmtl b\nKd 1\n").with("c.mtl", "newmtl c\n");
    let warnings = folder.load_within(&ObjLimits { library_bytes: 30, ..ObjLimits::default() }).unwrap().warnings;
    let [ObjWarning::MissingLibrary { library, reason }] = &warnings[..] else { panic!("{warnings:?}") };
    assert_eq!(library, "c.mtl");
    assert_eq!(reason, "it takes 9 bytes or more, 28 are taken, and `ObjLimits::library_bytes` is 30");
}

fn textures_share_a_limit() {
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}usemtl two\nf 3 2 1\n");
    let folder =
        Folder::new().with("a.obj", text).with("a.mtl", "newmtl one\nmap_Kd a.png\nnewmtl two\nmap_Kd b.png\n");
    let folder = folder.with_image("a.png", &RgbaImage::new(9, 9)).with_image("b.png", &RgbaImage::new(9, 9));
    let warnings = folder.load_within(&ObjLimits { all_textures_bytes: 647, ..ObjLimits::default() }).unwrap().warnings;
    let [ObjWarning::UnusableTexture { texture, reason, .. }] = &warnings[..] else { panic!("{warnings:?}") };
    assert_eq!(texture, "b.png");
    assert_eq!(reason, "it takes 324 bytes or more, 324 are taken, and `ObjLimits::all_textures_bytes` is 647");
}

/// Loads ten materials with these statements, in which `{}` is the number of the material and of a copy of
/// `picture.png`. All that is decoded may take this number of bytes. Returns the number of the first material whose
/// texture lacks because of that.
fn first_over_limit(statements: &str, picture: &[u8], decoded_bytes: usize) -> Option<usize> {
    let (mut text, mut library) = (format!("mtllib a.mtl\n{TRIANGLE}"), String::new());
    let mut folder = Folder::new().with_image("a.png", &RgbaImage::from_pixel(10, 10, Rgba([255; 4])));
    for number in 0..10 {
        text += &format!("usemtl {number}\nf 1 2 3\n");
        library += &format!("newmtl {number}\n{}\n", statements.replace("{}", &number.to_string()));
        folder = folder.with(&format!("{number}.png"), picture);
    }
    let limits = ObjLimits { decoded_bytes: decoded_bytes as u64, ..ObjLimits::default() };
    let imported = load(folder.with("a.obj", text).with("a.mtl", library), limits).unwrap();
    let unusable = imported.warnings.iter().filter_map(|warning| match warning {
        ObjWarning::UnusableTexture { material, reason, .. } => Some((material, reason)),
        _ => None,
    });
    let mut over =
        unusable.filter(|(_, reason)| reason.contains(&format!("`ObjLimits::decoded_bytes` is {decoded_bytes}")));
    over.next().map(|(material, _)| material.parse().unwrap())
}

fn what_is_decoded_is_bounded() {
    let encoded = |picture: &RgbaImage| {
        let mut file = io::Cursor::new(Vec::new());
        picture.write_to(&mut file, ImageFormat::Png).unwrap();
        file.into_inner()
    };
    let white = RgbaImage::from_pixel(10, 10, Rgba([255; 4]));
    let (opaque, half) = (encoded(&white), encoded(&RgbaImage::from_pixel(10, 10, Rgba([255, 255, 255, 99]))));
    // Without the end of the pixels.
    let damaged = &opaque[..opaque.len() - 20];
    let damaged_bytes = damaged.len() + 400;
    assert_eq!(first_over_limit("map_Kd {}.png", damaged, 4 * damaged_bytes), Some(4));
    assert_eq!(first_over_limit("map_Kd {}.png", damaged, 10 * damaged_bytes), None);
    // The colours are decoded once more for each mask, even if it turns out to hide nothing.
    for mask in [opaque.as_slice(), &half] {
        let pair = opaque.len() + 400 + mask.len() + 400;
        assert_eq!(first_over_limit("map_Kd a.png\nmap_d {}.png", mask, 4 * pair), Some(4));
        assert_eq!(first_over_limit("map_Kd a.png\nmap_d {}.png", mask, 10 * pair), None);
    }
    // What is no picture is read, too.
    assert_eq!(first_over_limit("map_Kd {}.png", &[7; 5000], 21_000), Some(4));
}
