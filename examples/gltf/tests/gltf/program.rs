//! The program as a user runs it.

use std::fs;
use std::io::Read;
use std::process::{Command, Output, Stdio};

use libtest_mimic::Failed;
use serde_json::json;

use crate::fixture::{expect, folder};
use crate::generate::deforming::bending_tube;

pub const CASES: &[crate::Case] = &[("the_program_writes_a_picture_or_says_what_is_wrong", program)];

fn program() -> Result<(), Failed> {
    let folder = folder("program");
    let (scene, picture) = (folder.join("scene.glb"), folder.join("picture.png"));
    fs::write(&scene, bending_tube(None).glb())?;
    let run = |file: &std::path::Path, more: &[&str]| -> Result<Output, Failed> {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gltf_scene"));
        Ok(command.arg(file).arg("--picture").arg(&picture).args(more).output()?)
    };
    let output = run(&scene, &["--time", "1.5", "--size", "64", "48"])?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    expect(output.status.success() && said.contains("1 objects") && said.contains("\"bend\" at 1.5 s"), || said)?;
    let size = image::image_dimensions(&picture)?;
    expect(size == (64, 48), || format!("{size:?}"))?;

    let fails = |output: Output, expected: &str| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        expect(output.status.code() == Some(2) && said.contains(expected), || format!("{:?}: {said}", output.status))
    };
    fails(run(&folder, &[])?, "is not a regular file")?;
    fails(run(&folder.join("none.glb"), &[])?, "none.glb cannot be read")?;
    fails(run(&scene, &["--camera", "3"])?, "has the index 3 of 1 cameras")?;
    fails(run(&scene, &["--limit", "nonsense=3"])?, "none of scene_bytes, json_values")?;
    fails(run(&scene, &["--limit", "geometry_bytes"])?, "expected NAME=VALUE")?;
    fails(run(&scene, &["--limit", "geometry_bytes=100"])?, "`GltfLimits::geometry_bytes` is 100")?;
    let mut compressed = bending_tube(None);
    let primitive = &mut compressed.json["meshes"][0]["primitives"][0];
    primitive["extensions"]["KHR_draco_mesh_compression"] = json!({"bufferView": 0, "attributes": {}});
    let positions = primitive["attributes"]["POSITION"].as_u64().map_or(0, |index| index as usize);
    compressed.json["accessors"][positions].as_object_mut().map(|accessor| accessor.remove("bufferView"));
    let of_compressed = folder.join("compressed.glb");
    fs::write(&of_compressed, compressed.glb())?;
    fails(run(&of_compressed, &[])?, "nothing of it can be drawn")?;
    fails(run(&of_compressed, &[])?, "primitive 0 is compressed with KHR_draco_mesh_compression")?;

    // What is not listed is counted, also of a file that is refused.
    let unlisted = "more warnings are not listed";
    fails(run(&of_compressed, &["--limit", "warnings=0"])?, unlisted)?;

    // Nobody reads what it prints.
    fs::remove_file(&picture)?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_gltf_scene"));
    let arguments = ["--animation", "7", "--time", "1", "--size", "64", "48"];
    command.arg(&scene).arg("--picture").arg(&picture).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn()?;
    drop(child.stdout.take());
    let mut said = String::new();
    child.stderr.take().ok_or("its errors are piped")?.read_to_string(&mut said)?;
    let status = child.wait()?;
    expect(status.success() && picture.exists() && said.contains("there is no animation 7"), || said)
}
