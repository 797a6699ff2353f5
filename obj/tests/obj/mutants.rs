//! Mutants: files that were damaged at random give a scene or an error in bounded time, and what a scene lacks is said.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use drawloom_obj::{ObjError, ObjWarning};
use drawloom_testing::demo;
use drawloom_testing::obj_files::UNUSUAL;
use drawloom_testing::shared_scenes;
use libtest_mimic::Trial;

use crate::folder::Folder;
use crate::trial;

/// A test that has not ended by then hangs.
const DEADLINE: Duration = Duration::from_secs(60);
const MUTANTS: usize = 300;

/// A file with most statements, in several spellings.
const FILE: &str = "mtllib a.mtl\no one\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 1 0 0\nv 0 1 0.5\nv 2 2 -1e3\nvt 0 0\nvt 1 0.5\n\
    vn 0 0 1\nusemtl red\nf 1/1/1 2/2/1 3/1/1 4/2/1\ng two\nusemtl glow\nf -5//-1 -4//1 -3//1 \\\n -2 5/1\nl 1 2\np 3\n";
/// Its library, which names a picture.
const LIBRARY: &str = "newmtl red\nKd 1 0 0\nd 0.5\nmap_Kd -s 1 1 1 a.png\nnewmtl glow\nKe 1 1 1\nTr 0\n";
/// A picture that ends too early.
const PICTURE: [u8; 7] = [0x89, b'P', b'N', b'G', 0, 0, 0];

/// A folder where malformed and unusual files are kept with their mutants, for other programs to read.
const KEEP: &str = "DRAWLOOM_KEEP_MUTANTS";

pub fn trials() -> Vec<Trial> {
    vec![
        trial("mutants::of_an_own_file", of_an_own_file),
        trial("mutants::of_unusual_files", of_unusual_files),
        trial("mutants::of_malformed_files", of_malformed_files)
            .with_ignored_flag(shared_scenes::are_optional_and_missing()),
    ]
}

fn of_an_own_file() {
    let folder = Folder::new().with("a.obj", FILE).with("a.mtl", LIBRARY).with("a.png", PICTURE);
    check_mutants(&folder.0, &[folder.0.join("a.obj"), folder.0.join("a.mtl")]);
}

fn of_unusual_files() {
    let folder = Folder::new();
    let to = folder_of_mutants("unusual", &folder);
    let seeds = UNUSUAL.map(|(name, text)| {
        let path = to.join(format!("{name}.obj"));
        fs::write(&path, text).unwrap();
        path
    });
    check_mutants(&to, &seeds);
}

fn of_malformed_files() {
    let folder = Folder::new();
    let to = folder_of_mutants("malformed", &folder);
    let mut seeds = Vec::new();
    for group in ["tobj", "trimesh"] {
        for entry in fs::read_dir(shared_scenes::folder().join("malformed").join(group)).unwrap() {
            let path = entry.unwrap().path();
            fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
            seeds.push(path);
        }
    }
    seeds.sort();
    check_mutants(&to, &seeds);
}

/// A folder of this name in [`KEEP`], or the temporary one if that is not set.
fn folder_of_mutants(name: &str, temporary: &Folder) -> PathBuf {
    let Some(kept) = std::env::var_os(KEEP) else { return temporary.0.clone() };
    let folder = PathBuf::from(kept).join(name);
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Writes mutants of the seeds into the folder, which has the files that they name, and loads each. A mutant of a
/// library is loaded by an OBJ file.
fn check_mutants(folder: &Path, seeds: &[PathBuf]) {
    let mut random = fastrand::Rng::with_seed(22);
    let seeds: Vec<_> = seeds.iter().map(|path| (path, fs::read(path).unwrap())).collect();
    for number in 0..MUTANTS {
        let (path, seed) = &seeds[number % seeds.len()];
        let mutant = mutate(seed, &mut random);
        let is_library = path.extension().is_some_and(|extension| extension == "mtl");
        let scene = folder.join(format!("mutant-{number}.obj"));
        if is_library {
            fs::write(folder.join(format!("mutant-{number}.mtl")), &mutant).unwrap();
            fs::write(&scene, format!("mtllib mutant-{number}.mtl\n{}", crate::folder::TRIANGLE)).unwrap();
        } else {
            fs::write(&scene, &mutant).unwrap();
        }
        check(&scene, folder);
    }
}

fn mutate(seed: &[u8], random: &mut fastrand::Rng) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..random.usize(1..8) {
        let position = random.usize(0..=bytes.len());
        let end = (position + random.usize(1..40)).min(bytes.len());
        match random.usize(0..8) {
            0 => bytes.truncate(position),
            1 => drop(bytes.drain(position..end)),
            2 => bytes.extend_from_within(position..end),
            3 => bytes.insert(position, random.u8(..)),
            4 => bytes
                .splice(position..position, [b"\0", b"\r", b"\\", b"/"][random.usize(0..4)].iter().copied())
                .for_each(drop),
            5 => bytes.splice(position..position, b" 99999999999 nan -1e39 ".iter().copied()).for_each(drop),
            6 => bytes[position..end].iter_mut().for_each(|byte| *byte ^= 0x80),
            _ => bytes[position..end].reverse(),
        }
    }
    bytes
}

fn check(scene: &Path, folder: &Path) {
    let (sender, receiver) = mpsc::channel();
    let path = scene.to_owned();
    thread::spawn(move || {
        // Nobody receives what comes after the deadline, nor anything from a panic.
        let _ = sender.send(drawloom_obj::load(path));
    });
    let loaded = receiver.recv_timeout(DEADLINE).unwrap_or_else(|_| panic!("{} hangs or panics", scene.display()));
    match loaded {
        Ok(mut imported) => {
            demo::add_camera_and_lights(&mut imported.scene);
            assert!(imported.triangles > 0 && imported.scene.cameras.len() == 1, "{}", scene.display());
            let found = imported.triangles + imported.degenerate_triangles;
            let expected = triangles_of_other_lines(&fs::read(scene).unwrap(), &imported.warnings);
            assert!(found >= expected, "{}: {found} of {expected} triangles", scene.display());
        }
        Err(ObjError::Refused { reason, .. }) => panic!("{}: {reason}", scene.display()),
        Err(error) => assert!(error.to_string().contains(&folder.display().to_string()), "{error}"),
    }
}

/// The triangles of all statements that are faces as they stand there, but those that a warning names by the number of
/// their last line.
fn triangles_of_other_lines(bytes: &[u8], warnings: &[ObjWarning]) -> usize {
    let is_named =
        |number| warnings.iter().any(|warning| matches!(warning, ObjWarning::Line { line, .. } if *line == number));
    let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
    let (mut statement, mut triangles) = (String::new(), 0);
    for (number, line) in (1..).zip(text.replace("\r\n", "\n").split(['\n', '\r'])) {
        statement += line;
        let is_comment = statement.trim_start().starts_with('#');
        if !is_comment && statement.ends_with('\\') {
            // It goes on in the next line.
            statement.pop();
            statement.push(' ');
            continue;
        }
        let mut words = statement.split_ascii_whitespace();
        if words.next() == Some("f") && !is_named(number) {
            triangles += words.take_while(|word| !word.contains('#')).count().saturating_sub(2);
        }
        statement.clear();
    }
    triangles
}
