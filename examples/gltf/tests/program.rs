//! The program as a user runs it.
//!
//! Without an adapter it is reported as ignored. With `DRAWLOOM_REQUIRE_ADAPTER=1` a missing adapter fails it. The file
//! and the picture stay in `target/tmp/gltf_scene`, to look at.

use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use libtest_mimic::{Arguments, Failed, Trial};
use serde_json::{Value, json};

fn main() {
    let no_adapter = drawloom_gltf::draw::open_device().is_err();
    let required = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let program = Trial::test("the_program_writes_a_picture_or_says_what_is_wrong", program);
    libtest_mimic::run(&Arguments::from_args(), vec![program.with_ignored_flag(no_adapter && !required)]).exit();
}

/// A triangle that an animation moves, and a camera, with the buffer beside the file.
fn scene(folder: &Path) -> Result<Value, Failed> {
    let positions = [-1.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0, 0.0];
    let (times, translations) = ([0.0_f32, 2.0], [0.0_f32, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let numbers = positions.iter().chain(&times).chain(&translations);
    fs::write(folder.join("scene.bin"), numbers.flat_map(|number| number.to_le_bytes()).collect::<Vec<_>>())?;
    Ok(json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 68, "uri": "scene.bin"}],
        "bufferViews": [{"buffer": 0, "byteLength": 68}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, 0, 0], "max": [1, 2, 0]},
            {"bufferView": 0, "byteOffset": 36, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [2]},
            {"bufferView": 0, "byteOffset": 44, "componentType": 5126, "count": 2, "type": "VEC3"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 1, 6]}],
        "scenes": [{"nodes": [0, 1]}],
        "scene": 0,
        "animations": [{
            "name": "bend",
            "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
            "samplers": [{"input": 1, "output": 2}],
        }],
    }))
}

/// An empty folder.
fn folder() -> Result<PathBuf, Failed> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf_scene");
    // It may be there from an earlier run.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder)?;
    Ok(folder)
}

/// # Errors
/// If it does not hold.
fn expect(holds: bool, otherwise: impl FnOnce() -> String) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(otherwise().into()) }
}

fn program() -> Result<(), Failed> {
    let folder = folder()?;
    let (file, picture) = (folder.join("scene.gltf"), folder.join("picture.png"));
    let scene = scene(&folder)?;
    fs::write(&file, scene.to_string())?;
    let run = |file: &Path, more: &[&str]| -> Result<Output, Failed> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gltf_scene"));
        Ok(command.arg(file).arg("--picture").arg(&picture).args(more).output()?)
    };
    let output = run(&file, &["--time", "1.5", "--size", "64", "48"])?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    expect(output.status.success() && said.contains("1 objects") && said.contains("\"bend\" at 1.5 s"), || said)?;
    let size = image::image_dimensions(&picture)?;
    expect(size == (64, 48), || format!("{size:?}"))?;
    let pixels = image::open(&picture)?.into_rgba8();
    expect(pixels.pixels().any(|pixel| pixel != pixels.get_pixel(0, 0)), || "the picture is empty".to_owned())?;

    let fails = |output: Output, expected: &str| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        expect(output.status.code() == Some(2) && said.contains(expected), || format!("{:?}: {said}", output.status))
    };
    fails(run(&folder, &[])?, "is not a regular file")?;
    fails(run(&folder.join("none.glb"), &[])?, "none.glb cannot be read")?;
    fails(run(&file, &["--camera", "3"])?, "has the index 3 of 1 cameras")?;
    fails(run(&file, &["--limit", "nonsense=3"])?, "none of scene_bytes, json_values")?;
    fails(run(&file, &["--limit", "geometry_bytes"])?, "expected NAME=VALUE")?;
    fails(run(&file, &["--limit", "geometry_bytes=100"])?, "`GltfLimits::geometry_bytes` is 100")?;
    let mut compressed = scene;
    let extension = json!({"bufferView": 0, "attributes": {}});
    compressed["meshes"][0]["primitives"][0]["extensions"] = json!({"KHR_draco_mesh_compression": extension});
    compressed["accessors"][0].as_object_mut().map(|accessor| accessor.remove("bufferView"));
    let of_compressed = folder.join("compressed.gltf");
    fs::write(&of_compressed, compressed.to_string())?;
    fails(run(&of_compressed, &[])?, "nothing of it can be drawn")?;
    fails(run(&of_compressed, &[])?, "primitive 0 is compressed with KHR_draco_mesh_compression")?;

    // What is not listed is counted, also of a file that is refused.
    let unlisted = "more warnings are not listed";
    fails(run(&of_compressed, &["--limit", "warnings=0"])?, unlisted)?;

    // Nobody reads what it prints.
    fs::remove_file(&picture)?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_gltf_scene"));
    let arguments = ["--animation", "7", "--time", "1", "--size", "64", "48"];
    command.arg(&file).arg("--picture").arg(&picture).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn()?;
    drop(child.stdout.take());
    let mut said = String::new();
    child.stderr.take().ok_or("its errors are piped")?.read_to_string(&mut said)?;
    let status = child.wait()?;
    expect(status.success() && picture.exists() && said.contains("there is no animation 7"), || said)
}
