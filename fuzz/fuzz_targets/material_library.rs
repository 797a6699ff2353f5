//! Material libraries: an import has valid materials, those that the OBJ file uses and no others, and all warnings are
//! counted.

#![no_main]

use std::io;

use drawloom::scene::Material;
use drawloom_fuzz::imports::import;
use libfuzzer_sys::fuzz_target;

/// Four materials, and faces without one.
const FILE: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n\
    usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl red\nf 1 2 3\nusemtl two words\nf 1 2 3\n";

/// A TGA of one half-transparent pixel.
const TEXTURE: &[u8] = &[0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 32, 8, 200, 100, 50, 128];

fuzz_target!(|library: &[u8]| {
    let fetch = |name: &str| match name {
        "a.mtl" => Ok(library.to_vec()),
        "a.tga" => Ok(TEXTURE.to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    import(FILE, fetch, |imported| {
        let mut names: Vec<_> =
            imported.scene.assets().iter::<Material>().map(|(_, material)| &*material.name).collect();
        names.sort_unstable();
        let is_known = |name: &&str| ["a", "b", "red", "two words", "default"].contains(name);
        assert!(names.len() == 5 && names.iter().all(is_known), "{names:?}");
        assert_eq!((imported.scene.object_count(), imported.triangles), (5, 5));
    });
});
