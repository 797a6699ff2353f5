//! Textures: a file is decoded within the limits of an import, or a warning says why it is not.

#![no_main]

use std::io;

use drawloom::scene::{Blend, Texture};
use drawloom_fuzz::imports::import;
use libfuzzer_sys::fuzz_target;

const FILE: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n";

/// The extension matters for files without a magic number.
const LIBRARIES: [&[u8]; 4] = [
    b"newmtl a\nmap_Kd a.png\nnewmtl b\nmap_d a.png",
    b"newmtl a\nmap_Kd a.jpg\nnewmtl b\nmap_d a.jpg",
    b"newmtl a\nmap_Kd a.tga\nnewmtl b\nmap_d a.tga",
    b"newmtl a\nmap_Kd a.bmp\nnewmtl b\nmap_d a.bmp",
];

// The last byte chooses the library, so that a file with a byte behind it is a seed.
fuzz_target!(|input: &[u8]| {
    let Some((choice, texture)) = input.split_last() else {
        return;
    };
    let library = LIBRARIES[usize::from(*choice) % LIBRARIES.len()];
    let fetch = |name: &str| match name.rsplit_once('.') {
        Some((_, "mtl")) => Ok(library.to_vec()),
        Some(_) => Ok(texture.to_vec()),
        None => Err(io::ErrorKind::NotFound.into()),
    };
    import(FILE, fetch, |imported| {
        let scene = imported.scene.as_scene_ref();
        let [colors, mask] = [0, 1].map(|object| scene.assets.get(scene.materials[object]).unwrap());
        let unusable = imported.warning_counts.get("unusable texture").copied().unwrap_or(0);
        // A mask that is opaque everywhere is no texture.
        let missing = usize::from(colors.texture.is_none()) + usize::from(mask.texture.is_none());
        assert!(missing >= unusable && (colors.texture.is_some() || unusable >= 1), "{:?}", imported.warnings);
        // What a mask hides is blended, or cut out.
        assert!(mask.texture.is_none() || (mask.blend == Blend::Alpha) != mask.alpha_cutoff.is_some(), "{mask:?}");
        assert!(scene.assets.iter::<Texture>().count() <= 2);
    });
});
