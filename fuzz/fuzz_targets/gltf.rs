//! glTF files: a file is loaded as a world that can be drawn and is within the limits, or refused with an error that
//! names the file.

#![no_main]

use drawloom_fuzz::gltf_worlds::check;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|file: &[u8]| {
    // At rest, and while its first animation is drawn: one does not prepare the other.
    check(file, None);
    check(file, Some(0.25));
});
