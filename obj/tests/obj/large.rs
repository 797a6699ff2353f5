//! Files with far more of one thing than a modeller writes are loaded whole, in time and memory in proportion to their
//! size. Each of them once took time in proportion to the square of its size.
//!
//! Time is counted in instructions, by callgrind, so the count is the same on a busy machine. This binary starts itself
//! to load a single file, alone.

use std::alloc::System;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::{env, fs};

use drawloom_obj::Imported;
use drawloom_testing::demo;
use drawloom_testing::slow_cases;
use libtest_mimic::Trial;
use stats_alloc::{INSTRUMENTED_SYSTEM, StatsAlloc};

use crate::folder::{Folder, TRIANGLE};
use crate::trial;

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// A kind of file that can be as large as one likes.
struct Large {
    name: &'static str,
    /// Writes a file with this much of it.
    write: fn(usize) -> Folder,
    /// How much is loaded whole.
    count: usize,
    check: fn(&mut Imported, usize),
}

const FILES: [Large; 4] = [
    Large {
        name: "coincident_triangles",
        write: coincident_triangles,
        count: 80_000,
        check: |imported, count| {
            assert_eq!((imported.triangles, imported.scene.as_scene_ref().object_count()), (count, 1));
            demo::add_camera_and_lights(&mut imported.scene);
            assert_eq!(imported.scene.cameras.len(), 1);
        },
    },
    Large {
        name: "groups",
        write: groups,
        count: 1_000_000,
        check: |imported, count| assert_eq!((imported.triangles, imported.degenerate_triangles), (count, 0)),
    },
    Large {
        name: "material_names",
        write: material_names,
        count: 40_000,
        check: |imported, count| {
            assert_eq!(imported.triangles, count + 1);
            assert!(imported.warning_counts.values().sum::<usize>() >= count / 2, "{:?}", imported.warning_counts);
        },
    },
    Large {
        name: "polygon",
        write: polygon,
        count: 1_000_000,
        check: |imported, count| {
            assert_eq!(imported.triangles + imported.degenerate_triangles, count - 2);
            assert!(imported.triangles > count / 2, "{}", imported.triangles);
        },
    },
];

/// The file that this process loads alone, where it started itself.
const ALONE: &str = "DRAWLOOM_LOAD_ALONE";

/// How much of its thing the smallest file has. What a process does before and after counts there, and is subtracted
/// from the others.
const FEW: usize = 8;
/// How much a file has whose time and memory are compared with those of a file of four times as much. For n·log n steps
/// the quotient of the times is 4·(1 + log 4 / log 500) = 4.9; for n² it is 16, and for the root of n³ it is 8.
const SOME: usize = 500;
const MAX_QUOTIENT: f64 = 5.0;
/// The most bytes that are allocated in all for each byte of a file, whether at the same time or one after another.
/// Groups of one triangle take most: 165 bytes for each byte of their short text.
const MAX_BYTES_PER_BYTE: f64 = 200.0;

pub fn trials() -> Vec<Trial> {
    let whole = |file: Large| {
        let name = format!("large::{}", file.name);
        trial(name, move || (file.check)(&mut load((file.write)(file.count).0.as_path()), file.count))
            .with_ignored_flag(!slow_cases::are_enabled())
    };
    let proportional = |file: Large| {
        trial(format!("large::{}_in_proportion", file.name), move || {
            let [few, some, more] = [FEW, SOME, 4 * SOME].map(|count| Cost::of(&(file.write)(count).0));
            let quotient = |of: fn(&Cost) -> u64| (of(&more) - of(&few)) as f64 / (of(&some) - of(&few)) as f64;
            let (time, memory) = (quotient(|cost| cost.instructions), quotient(|cost| cost.allocated));
            assert!(
                time <= MAX_QUOTIENT,
                "four times as much takes {time} times as many instructions: {some:?}, {more:?}"
            );
            assert!(
                memory <= MAX_QUOTIENT,
                "four times as much takes {memory} times as many bytes: {some:?}, {more:?}"
            );
            let bytes = (more.allocated - few.allocated) as f64 / (more.text - few.text) as f64;
            assert!(bytes <= MAX_BYTES_PER_BYTE, "{bytes} bytes for each byte of the file: {more:?}");
        })
        .with_ignored_flag(callgrind_is_missing())
    };
    FILES.into_iter().map(whole).chain(FILES.into_iter().map(proportional)).collect()
}

/// Loads the file for which another process of this binary has started this one, and says what it has allocated.
/// Returns whether there is one.
pub fn load_alone() -> bool {
    let Some(folder) = env::var_os(ALONE) else { return false };
    drop(load(Path::new(&folder)));
    println!("{}", ALLOCATOR.stats().bytes_allocated);
    true
}

fn load(folder: &Path) -> Imported {
    drawloom_obj::load(folder.join("a.obj")).unwrap()
}

/// What it takes to load a file.
#[derive(Debug)]
struct Cost {
    instructions: u64,
    /// The bytes that were allocated, those that were freed since included.
    allocated: u64,
    /// The bytes of the files.
    text: u64,
}

impl Cost {
    fn of(folder: &Path) -> Self {
        let output = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg(env::current_exe().unwrap())
            .env(ALONE, folder)
            .output()
            .unwrap();
        let [allocated, counts] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
        assert!(output.status.success(), "{counts}");
        let collected = counts.lines().find_map(|line| line.split("Collected :").nth(1)).unwrap();
        let files = fs::read_dir(folder).unwrap().map(|file| file.unwrap().metadata().unwrap());
        Self {
            instructions: collected.trim().parse().unwrap(),
            allocated: allocated.trim().parse().unwrap(),
            text: files.filter(fs::Metadata::is_file).map(|file| file.len()).sum(),
        }
    }
}

/// Whether the trials that count instructions are ignored.
fn callgrind_is_missing() -> bool {
    let is_missing = Command::new("valgrind").arg("--version").output().is_err();
    assert!(!is_missing || env::var_os("DRAWLOOM_REQUIRE_VALGRIND").is_none(), "valgrind is required and missing");
    is_missing
}

/// All of them lie in each other, so no box separates them for the default camera's rays.
fn coincident_triangles(count: usize) -> Folder {
    Folder::new().with("a.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(count)))
}

fn groups(count: usize) -> Folder {
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    (0..count).for_each(|group| writeln!(text, "g {group}\nf 1 2 3").unwrap());
    Folder::new().with("a.obj", text)
}

/// Each is used once, and half of them are defined, each with a colour of its own.
fn material_names(count: usize) -> Folder {
    let (mut text, mut library) = (format!("mtllib a.mtl\n{TRIANGLE}"), String::new());
    for name in 0..count {
        writeln!(text, "usemtl {name}\nf 1 2 3").unwrap();
        if name % 2 == 0 {
            writeln!(library, "newmtl {name}\nKd 0.{:03} 0.{:03} 0.5", name % 200, name / 200).unwrap();
        }
    }
    Folder::new().with("a.obj", text).with("a.mtl", library)
}

/// One polygon, around a circle.
fn polygon(count: usize) -> Folder {
    let mut text = String::new();
    for corner in 0..count {
        let (sine, cosine) = (corner as f64 / count as f64 * std::f64::consts::TAU).sin_cos();
        writeln!(text, "v {} {} 0", cosine * 1e4, sine * 1e4).unwrap();
    }
    text.push('f');
    (1..=count).for_each(|corner| write!(text, " {corner}").unwrap());
    Folder::new().with("a.obj", text)
}
