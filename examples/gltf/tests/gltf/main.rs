//! Loading and drawing of small generated glTF files.
mod generate;
mod oracle;
fn main() {
    use generate::deforming as f;
    use generate::static_scenes as s;
    let d = std::path::PathBuf::from(std::env::args().nth(1).unwrap());
    for (n, b) in [
        ("square", s::textured_square()),
        ("grid", s::metallic_roughness_grid()),
        ("alpha", s::alpha_modes()),
        ("lights", s::lights_and_cameras()),
        ("tree", s::hierarchy(false)),
        ("flat", s::hierarchy(true)),
        ("tube", f::bending_tube(None)),
        ("tubeflat", f::bending_tube(Some(1.5))),
        ("morph", f::morphing_sphere(None)),
        ("morphflat", f::morphing_sphere(Some(1.5))),
        ("inter", f::interpolations(None)),
        ("interflat", f::interpolations(Some(1.5))),
    ] {
        std::fs::write(d.join(format!("{n}.glb")), b.glb()).unwrap();
    }
}
