//! The command line of the example `frame`: what cannot be written is refused before anything is drawn.

#[path = "../examples/frame/arguments.rs"]
#[expect(dead_code, reason = "nothing is drawn here")]
mod arguments;

use std::fs;
use std::path::PathBuf;

use arguments::{Arguments, Frames};
use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::Camera;
use drawloom_obj::ObjLimits;
use drawloom_testing::demo::UpAxis;

/// An empty folder of this process, which is removed on drop.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("drawloom-frame-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> String {
        self.0.join(name).to_str().unwrap().to_owned()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that cannot be removed is no failure.
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn parse(arguments: &[&str]) -> Result<Arguments, String> {
    let all = ["frame"].iter().chain(arguments);
    Arguments::checked(all).map_err(|error| error.to_string())
}

#[test]
fn a_picture_needs_a_folder_and_a_format() {
    let folder = Folder::new("picture");
    for name in ["a.png", "a.jpg", "a.jpeg", "a.tga", "a.bmp"] {
        parse(&["--out", &folder.file(name)]).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
    for (name, part) in [("a.gif", "ends in .gif"), ("a", "no extension"), ("missing/a.png", "is no folder")] {
        let error = parse(&["--out", &folder.file(name)]).err().unwrap_or_else(|| panic!("{name} is accepted"));
        assert!(error.contains(part) && error.contains(name), "{error}");
    }
    assert!(fs::read_dir(&folder.0).unwrap().next().is_none(), "the check leaves a file");
}

#[test]
fn every_other_file_needs_a_folder() {
    let folder = Folder::new("other");
    let missing = folder.file("missing/a");
    for name in ["--graph", "--html", "--timeline", "--report"] {
        let error = parse(&[name, &missing]).err().unwrap_or_else(|| panic!("{name} is accepted"));
        assert!(error.contains("missing/a") && error.contains("is no folder"), "{error}");
        parse(&[name, &folder.file("a")]).unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

#[test]
fn a_camera_near_a_small_part_of_a_large_scene_sees_it() {
    let placed = parse(&["--camera", "4,3,6,0,1.2,0"]).unwrap().camera.unwrap();
    let mut camera = Camera { near: 50.0, ..Camera::looking_at("main", DVec3::Z * 1e5, DVec3::ZERO) };
    placed.apply(&mut camera, UpAxis::Y);
    assert!(camera.position == DVec3::new(4.0, 3.0, 6.0) && camera.near < 0.01, "{camera:?}");
    // And a near plane that is nearer stays.
    let mut camera = Camera { near: 1e-4, ..camera };
    placed.apply(&mut camera, UpAxis::Y);
    assert_eq!(camera.near, 1e-4);
}

#[test]
fn the_axis_that_points_up_is_named() {
    let arguments = parse(&["a.obj", "--up", "z", "--camera", "0,-5,1,0,0,1"]).unwrap();
    let mut camera = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
    arguments.camera.unwrap().apply(&mut camera, arguments.up.axis());
    let directions = [Vec3::X, Vec3::Y, Vec3::NEG_Z].map(|direction| camera.orientation * direction);
    let expected = [Vec3::X, Vec3::Z, Vec3::Y];
    assert!(directions.iter().zip(expected).all(|(one, other)| one.abs_diff_eq(other, 1e-6)), "{directions:?}");
    let error = parse(&["--up", "z"]).err().expect("there is no file");
    assert!(error.contains("--up is for an OBJ file"), "{error}");
}

#[test]
fn every_limit_in_bytes_is_set_by_its_name() {
    let limits = parse(&["a.obj"]).unwrap().obj_limits();
    assert_eq!(limits, ObjLimits::default());
    let text = format!("{limits:?}");
    let fields: Vec<_> = text.split([' ', ':']).filter(|word| word.ends_with("_bytes")).collect();
    assert!(fields.contains(&"scene_bytes"), "{text}");
    for field in &fields {
        let limits = parse(&["a.obj", "--limit", &format!("{field}=7")]).unwrap().obj_limits();
        let text = format!("{limits:?}");
        assert_eq!((text.contains(&format!(" {field}: 7,")), text.matches(": 7,").count()), (true, 1), "{text}");
    }
    let limits = parse(&["a.obj", "--limit", "scene_bytes=1", "--limit", "line_bytes=2"]).unwrap().obj_limits();
    assert_eq!(limits, ObjLimits { scene_bytes: 1, line_bytes: 2, ..ObjLimits::default() });
    for (value, problem) in
        [("scene_bytes", "FIELD=BYTES"), ("scene_bytes=1k", "\"1k\""), ("bytes=1", "none of scene_bytes")]
    {
        let error = parse(&["a.obj", "--limit", value]).err().unwrap_or_else(|| panic!("{value} is accepted"));
        assert!(error.contains(problem), "{value}: {error}");
    }
    let error = parse(&["--limit", "scene_bytes=1"]).err().expect("there is no file");
    assert!(error.contains("--limit is for an OBJ file"), "{error}");
}

#[test]
fn without_a_name_the_picture_is_frame_png_if_there_is_one() {
    let picture = |arguments: &[&str]| parse(arguments).unwrap().out.map(|file| file.path().to_owned());
    assert_eq!(picture(&[]), Some("frame.png".into()));
    assert_eq!(picture(&["--backend", "null"]), None);
    let error = parse(&["--backend", "null", "--out", "a.png"]).err().expect("it draws none");
    assert!(error.contains("--out needs a picture"), "{error}");
}

#[test]
fn a_range_of_frames_needs_a_path_and_numbered_files() {
    let folder = Folder::new("range");
    let (numbered, single) = (folder.file("a-###.png"), folder.file("a.png"));
    let range = |arguments: &[&str]| parse(&[&["--frames", "4..9"], arguments].concat()).map(|parsed| parsed.frames);
    let path = ["--path", "flight.txt"];
    let [with_numbers, without] = [&numbered, &single].map(|file| ["--out", file.as_str()]);
    assert_eq!(range(&[path, with_numbers].concat()), Ok(Frames::Range(4..9)));
    for (arguments, problem) in [
        (with_numbers.to_vec(), "needs the --path"),
        (path.to_vec(), "needs an --out"),
        ([path, without].concat(), "needs an --out"),
        ([&path[..], &with_numbers, &["--explain"]].concat(), "are for a number of frames"),
        ([&path[..], &["--backend", "noop"]].concat(), "needs a backend that draws"),
    ] {
        let error = range(&arguments).unwrap_err();
        assert!(error.contains(problem), "{arguments:?}: {error}");
    }
    let error = parse(&["--path", "flight.txt"]).err().unwrap();
    assert!(error.contains("--path needs a range of frames"), "{error}");
    for (frames, problem) in
        [("0", "no frame"), ("5..5", "greater"), ("5..x", "\"x\""), ("..", "\"\""), ("1..1000001", "more")]
    {
        let error = parse(&["--frames", frames]).err().unwrap();
        assert!(error.contains(problem), "{frames}: {error}");
    }
    assert_eq!(parse(&["--frames", "1000000"]).unwrap().frames, Frames::Count(1_000_000));
}
