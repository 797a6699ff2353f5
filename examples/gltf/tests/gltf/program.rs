//! The program as a user runs it.

use std::fs;
use std::process::{Command, Output};

use libtest_mimic::Failed;

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
        expect(output.status.code() == Some(1) && said.contains(expected), || format!("{:?}: {said}", output.status))
    };
    fails(run(&folder, &[])?, "is not a regular file")?;
    fails(run(&folder.join("none.glb"), &[])?, "none.glb cannot be read")?;
    fails(run(&scene, &["--camera", "3"])?, "has the index 3 of 1 cameras")?;
    let output = run(&scene, &["--time", "1", "--animation", "7"])?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    expect(output.status.success() && said.contains("there is no animation 7"), || said)
}
