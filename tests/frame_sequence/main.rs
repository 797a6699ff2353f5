//! Ranges of frames of the example `frame`: each is what it is in the whole sequence, and none is drawn twice.

#[path = "../../examples/frame/arguments.rs"]
#[expect(dead_code, reason = "only sequences are drawn here")]
mod arguments;
#[path = "../../examples/frame/camera_path.rs"]
mod camera_path;
#[path = "../../examples/frame/pipeline.rs"]
#[expect(dead_code, reason = "the tests open no adapter")]
mod pipeline;
#[path = "../../examples/frame/sequence.rs"]
mod sequence;

use std::error::Error;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
#[cfg(unix)]
use std::process::Command;

use arguments::{Arguments, Frames};
use camera_path::CameraPath;
use drawloom::backend::WgpuBackend;
use drawloom::glam::DVec3;
use drawloom::scene::{Camera, Material, RenderObject, Scene};
use drawloom_testing::demo::{self, UpAxis};
use drawloom_testing::scenes::cube;
use proptest::prelude::*;
use sequence::{Sequence, file_of};

use tempfile::TempDir;

const PATH: &str = "# A flight around the cube.\n0 4 2 0 0 0 0\n5 0 2 4 0 0 0 # behind\n\n9 -4 2 0 0 0.5 0\n";

/// A cube of one colour, and a camera that a path moves.
fn scene() -> Result<Scene, Box<dyn Error>> {
    let mut scene = Scene::new();
    let (mesh, material) = (scene.add(cube())?, scene.add(Material::default())?);
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    demo::add_camera_and_lights(&mut scene);
    scene.cameras[0].size = [48, 27];
    Ok(scene)
}

/// The frames of a range, which go into a folder.
fn sequence(folder: &Path, name: &str, more: &[&str]) -> Result<(Arguments, Sequence), Box<dyn Error>> {
    let (path, out) = (folder.join("path.txt"), folder.join(name));
    fs::write(&path, PATH)?;
    let files = ["frame", "--path", path.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let arguments = Arguments::checked(files.iter().chain(more))?;
    let Frames::Range(frames) = arguments.frames.clone() else { return Err("no range".into()) };
    let sequence = Sequence::new(&arguments, frames)?;
    Ok((arguments, sequence))
}

/// Draws a range of frames into a folder, as a process would.
fn draw(folder: &Path, range: &str) -> Result<(), Box<dyn Error>> {
    let (arguments, sequence) = sequence(folder, "shot-###.png", &["--backend", "software", "--frames", range])?;
    sequence.draw(&arguments, scene()?, no_adapter)
}

/// A machine without an adapter.
fn no_adapter() -> Result<WgpuBackend, Box<dyn Error>> {
    Err("no graphics adapter found".into())
}

/// The pictures in a folder, by name.
fn pictures(folder: &Path) -> io::Result<Vec<(String, Vec<u8>)>> {
    let files = fs::read_dir(folder)?.collect::<Result<Vec<_>, _>>()?;
    let mut pictures = Vec::new();
    for path in files.into_iter().map(|file| file.path()).filter(|path| path.extension() == Some("png".as_ref())) {
        pictures.push((path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(&path)?));
    }
    pictures.sort();
    Ok(pictures)
}

#[test]
fn frames_that_are_drawn_apart_are_those_of_the_whole_sequence() -> Result<(), Box<dyn Error>> {
    let [whole, parts] = [TempDir::new()?, TempDir::new()?];
    draw(whole.path(), "0..10")?;
    for range in ["7..10", "0..1", "1..3", "3..7"] {
        draw(parts.path(), range)?;
    }
    let expected = pictures(whole.path())?;
    let names: Vec<_> = expected.iter().map(|(name, _)| name.as_str()).collect();
    let numbers: Vec<_> = (0..10).map(|frame| format!("shot-00{frame}.png")).collect();
    assert_eq!(names, numbers);
    assert!(expected.windows(2).all(|pair| pair[0].1 != pair[1].1), "the camera does not move");
    assert!(pictures(parts.path())? == expected);
    Ok(())
}

#[test]
fn a_sequence_goes_on_where_it_was_interrupted() -> Result<(), Box<dyn Error>> {
    let folder = TempDir::new()?;
    draw(folder.path(), "0..4")?;
    let before = pictures(folder.path())?;
    // One is missing, and one is not what would be drawn.
    fs::remove_file(folder.path().join("shot-001.png"))?;
    fs::write(folder.path().join("shot-002.png"), "kept")?;
    draw(folder.path(), "0..4")?;
    let after = pictures(folder.path())?;
    assert_eq!(after[2].1, b"kept");
    assert!([0, 1, 3].into_iter().all(|frame| after[frame] == before[frame]));
    Ok(())
}

#[test]
fn without_an_adapter_only_an_explicit_backend_draws() -> Result<(), Box<dyn Error>> {
    let folder = TempDir::new()?;
    for more in [&["--frames", "0..2"][..], &["--frames", "0..2", "--backend", "wgpu"]] {
        let (arguments, sequence) = sequence(folder.path(), "shot-###.png", more)?;
        let error = sequence.draw(&arguments, scene()?, no_adapter).unwrap_err().to_string();
        assert!(error.contains("no graphics adapter found; --backend software"), "{error}");
        assert!(pictures(folder.path())?.is_empty());
    }
    draw(folder.path(), "0..2")?;
    // Nothing is left that needs an adapter.
    let (arguments, sequence) = sequence(folder.path(), "shot-###.png", &["--frames", "0..2"])?;
    sequence.draw(&arguments, scene()?, no_adapter)
}

/// Names that are wrong for some frames only are found before any frame is drawn.
#[test]
fn each_numbered_file_is_checked_beforehand() -> Result<(), Box<dyn Error>> {
    let folder = TempDir::new()?;
    fs::create_dir(folder.path().join("shot-007.png"))?;
    let error = sequence(folder.path(), "shot-###.png", &["--frames", "5..9"]).err().expect("a folder is no picture");
    assert!(error.to_string().contains("shot-007.png cannot be written: it names a folder"), "{error}");
    // Of 255 bytes, which is the most that file systems take, and of 256.
    let name = format!("#{}.png", "a".repeat(250));
    sequence(folder.path(), &name, &["--frames", "8..10"])?;
    let error = sequence(folder.path(), &name, &["--frames", "8..11"]).err().expect("the name is too long");
    assert!(error.to_string().contains("/10aaa"), "{error}");
    Ok(())
}

#[cfg(unix)]
#[test]
fn a_numbered_name_that_is_not_unicode_is_refused() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let folder = TempDir::new().unwrap();
    let parse = |name: &[u8]| {
        let out = folder.path().join(OsStr::from_bytes(name)).into_os_string();
        let arguments = ["frame", "--frames", "0..9", "--path", "path.txt", "--out"].map(OsString::from);
        Arguments::checked(arguments.into_iter().chain([out]))
    };
    let error = parse(b"shot-\xe9-#.png").err().expect("it is not Unicode").to_string();
    assert!(error.contains("must be Unicode"), "{error}");
    fs::create_dir(folder.path().join(OsStr::from_bytes(b"\xe9"))).unwrap();
    let out = parse(b"\xe9/#.png").unwrap_or_else(|error| panic!("the folder may be any: {error}")).out.unwrap();
    assert_eq!(file_of(out.path(), 3), folder.path().join(OsStr::from_bytes(b"\xe9/3.png")));
}

#[test]
fn wrong_paths_are_named_with_the_line_or_the_frame() {
    for (text, problem) in [
        ("", "no keyframe"),
        ("0 1 2 3 4 5", "line 1: expected a frame and six numbers, found 5 numbers"),
        ("# x\n\n0 1 2 3 4 5 x", "line 3: \"x\": "),
        ("-1 1 2 3 4 5 6", "line 1: frame \"-1\""),
        ("0 1 2 3 4 5 inf", "line 1: the numbers must be finite"),
        ("0 1 2 3 1 2 3", "line 1: the camera's position and target must differ"),
        ("3 1 2 3 4 5 6\n3 1 2 3 4 5 7", "line 2: frame 3 does not come after"),
    ] {
        let error = CameraPath::parse(text).unwrap_err();
        assert!(error.contains(problem), "{text:?}: {error}");
    }
    // Position and target pass through each other.
    let crossing = CameraPath::parse("0 0 0 0 4 0 0\n4 4 0 0 0 0 0").unwrap();
    assert_eq!(crossing.at(2).unwrap_err(), "frame 2: the camera's position and target must differ");
}

#[cfg(unix)]
#[test]
fn a_path_that_may_have_no_end_or_is_too_large_is_refused() {
    let folder = TempDir::new().unwrap();
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for path in [&pipe, Path::new("/dev/zero")] {
        assert_eq!(CameraPath::load(path).unwrap_err(), "it is not a regular file", "{}", path.display());
    }
    // It takes no space on the disk.
    let large = folder.path().join("large");
    fs::File::create(&large).unwrap().set_len(CameraPath::MAX_BYTES + 1).unwrap();
    assert_eq!(CameraPath::load(&large).unwrap_err(), "it has more than 67108864 bytes");
}

/// A triangle far away makes the scene large, but what is near to the camera covers the same pixels as without the
/// triangle.
#[test]
fn a_far_triangle_hides_nothing_of_a_near_cube() -> Result<(), Box<dyn Error>> {
    let cube = "v -1 0 -1\nv 1 0 -1\nv 1 2 -1\nv -1 2 -1\nv -1 0 1\nv 1 0 1\nv 1 2 1\nv -1 2 1\n\
        f 5 6 7 8\nf 2 1 4 3\nf 6 2 3 7\nf 1 5 8 4\nf 8 7 3 4\nf 1 2 6 5\n";
    let far_triangle = "v 1e5 0 0\nv 100001 0 0\nv 1e5 1 0\nf 9 10 11\n";
    // Whether each pixel differs from the upper left one, which is background.
    let covered = |text: &str| -> Result<Vec<bool>, Box<dyn Error>> {
        let folder = TempDir::new()?;
        let file = folder.path().join("a.obj");
        fs::write(&file, text)?;
        let mut scene = drawloom_obj::load(&file)?.scene;
        demo::add_camera_and_lights(&mut scene);
        scene.cameras[0].size = [48, 27];
        let (mut arguments, _) = sequence(folder.path(), "#.png", &["--backend", "software", "--frames", "0..1"])?;
        let path = folder.path().join("near.txt");
        fs::write(&path, "0 4 3 6 0 1.2 0")?;
        arguments.path = Some(path);
        Sequence::new(&arguments, 0..1)?.draw(&arguments, scene, no_adapter)?;
        let picture = image::open(folder.path().join("0.png"))?.to_rgb8();
        Ok(picture.pixels().map(|pixel| pixel != picture.get_pixel(0, 0)).collect())
    };
    let alone = covered(cube)?;
    let share = alone.iter().filter(|covered| **covered).count() as f64 / alone.len() as f64;
    assert!((0.05..0.5).contains(&share), "{share} of the picture");
    assert!(covered(&(cube.to_owned() + far_triangle))? == alone);
    Ok(())
}

#[test]
fn the_number_of_a_frame_takes_the_place_of_its_signs() {
    for (pattern, frame, name) in [
        ("out/shot-####.png", 7, "out/shot-0007.png"),
        ("a##b.png", 12345, "a12345b.png"),
        ("#1-##.png", 3, "#1-03.png"),
        ("é#.png", 9, "é9.png"),
        ("#", 1, "1"),
        ("still.png", 1, "still.png"),
    ] {
        assert_eq!(file_of(Path::new(pattern), frame), PathBuf::from(name), "{pattern}");
    }
}

proptest! {
    /// The curve goes through its keyframes, rests outside of them, and is a straight line where they are.
    #[test]
    fn a_camera_passes_its_keyframes(
        gaps in prop::collection::vec(1..50_u32, 1..6),
        points in prop::collection::vec(prop::array::uniform3(-100.0..100.0_f64), 6),
        share in 0.0..1.0_f64,
    ) {
        let frames: Vec<u32> = gaps.iter().scan(3, |frame, gap| { *frame += gap; Some(*frame) }).collect();
        let line = |frame: u32, [x, y, z]: [f64; 3]| format!("{frame} {x} {y} {z} {x} {y} {}\n", z + 1.0);
        let text: String = frames.iter().zip(&points).map(|(&frame, &point)| line(frame, point)).collect();
        let path = CameraPath::parse(&text).unwrap();
        let camera = |[x, y, z]: [f64; 3]| arguments::CameraPosition::new(DVec3::new(x, y, z), DVec3::new(x, y, z + 1.0)).unwrap();
        for (&frame, &point) in frames.iter().zip(&points) {
            prop_assert_eq!(path.at(frame).unwrap(), camera(point));
        }
        prop_assert_eq!(path.at(0).unwrap(), camera(points[0]));
        prop_assert_eq!(path.at(9999).unwrap(), camera(points[frames.len() - 1]));

        let along = |frame: u32| [f64::from(frame), 2.0 * f64::from(frame), 0.0];
        let text: String = frames.iter().map(|&frame| line(frame, along(frame))).collect();
        let (first, last) = (frames[0], *frames.last().unwrap());
        let between = first + (share * f64::from(last - first)) as u32;
        let text_between = line(between, along(between));
        let expected = CameraPath::parse(&text_between).unwrap().at(between).unwrap();
        let found = CameraPath::parse(&text).unwrap().at(between).unwrap();
        let position = |placed: &arguments::CameraPosition| {
            let mut camera = Camera::looking_at("", DVec3::X, DVec3::ZERO);
            placed.apply(&mut camera, UpAxis::Y);
            camera.position
        };
        prop_assert!(position(&found).distance(position(&expected)) < 1e-9, "{found:?} {expected:?}");
    }
}
