mod generate;
mod oracle;
fn main() {
    use generate::static_scenes as s;
    let d = std::path::PathBuf::from(std::env::args().nth(1).unwrap());
    for (n, b) in [
        ("square", s::textured_square()),
        ("grid", s::metallic_roughness_grid()),
        ("alpha", s::alpha_modes()),
        ("lights", s::lights_and_cameras()),
        ("tree", s::hierarchy(false)),
        ("flat", s::hierarchy(true)),
    ] {
        std::fs::write(d.join(format!("{n}.glb")), b.glb()).unwrap();
    }
}
