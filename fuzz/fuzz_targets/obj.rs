//! OBJ files: an import is a valid scene with as many triangles as a naive count of the faces allows, or an error that
//! names the file.

#![no_main]

use std::io;

use drawloom_fuzz::imports::{check_frame, import};
use drawloom_obj::Imported;
use drawloom_testing::demo;
use libfuzzer_sys::fuzz_target;

const LIBRARY: &[u8] = b"newmtl red\nKd 1 0 0\nd 0.5\nmap_Kd a.png\nnewmtl glow\nKe 1 1 1\n";

fuzz_target!(|file: &[u8]| {
    let fetch = |name: &str| match name {
        "a.mtl" => Ok(LIBRARY.to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    import(file, fetch, |imported| {
        check_triangles(file, imported);
        let scene = imported.scene.as_scene_ref();
        let camera = demo::camera(scene);
        let lights = demo::lights(scene, &camera);
        check_frame(imported, camera, &lights);
    });
});

fn check_triangles(file: &[u8], imported: &Imported) {
    let found = imported.triangles + imported.degenerate_triangles;
    // A corner takes a digit and a space in any encoding.
    assert!(found <= file.len() / 2, "{found} triangles in {} bytes", file.len());
    // In plain text each face is a line of its own.
    let is_plain = file.iter().all(|byte| matches!(byte, b' '..=b'~' | b'\n') && *byte != b'\\');
    if is_plain {
        let expected = triangles(file);
        let is_said = !imported.warnings.is_empty();
        assert!(found == expected || found < expected && is_said, "{found} of {expected} triangles");
    }
}

/// The triangles of all faces: one for each corner but two.
fn triangles(file: &[u8]) -> usize {
    let of_line = |line: &[u8]| {
        let statement = line.split(|&byte| byte == b'#').next().unwrap_or_default();
        let mut words = statement.split(|&byte| byte == b' ').filter(|word| !word.is_empty());
        if words.next() == Some(b"f".as_slice()) { words.count().saturating_sub(2) } else { 0 }
    };
    file.split(|&byte| byte == b'\n').map(of_line).sum()
}
