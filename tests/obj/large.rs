//! Files with far more of one thing than a modeller writes are loaded whole. Each of them once took time in proportion to the square of its
//! size.

use std::fmt::Write;

use drawloom::demo;
use drawloom_testing::slow_cases;
use libtest_mimic::Trial;

use crate::folder::{Folder, TRIANGLE};
use crate::trial;

const CASES: [(&str, fn()); 4] = [
    ("large::coincident_triangles", coincident_triangles),
    ("large::groups", groups),
    ("large::material_names", material_names),
    ("large::polygon", polygon),
];

pub fn trials() -> Vec<Trial> {
    let names = CASES.map(|(name, _)| name);
    CASES.map(|(name, case)| trial(name, case).with_ignored_flag(slow_cases::leave_out(&names, name))).into()
}

/// All of them lie in each other, so no box separates them for the default camera's rays.
fn coincident_triangles() {
    const COUNT: usize = 80_000;
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(COUNT));
    let mut imported = Folder::new().with("a.obj", text).load().unwrap();
    assert_eq!((imported.triangles, imported.scene.as_scene_ref().object_count()), (COUNT, 1));
    demo::add_camera_and_lights(&mut imported.scene);
    assert_eq!(imported.scene.cameras.len(), 1);
}

fn groups() {
    const COUNT: usize = 1_000_000;
    let mut text = String::from("v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    (0..COUNT).for_each(|group| writeln!(text, "g {group}\nf 1 2 3").unwrap());
    let imported = Folder::new().with("a.obj", text).load().unwrap();
    assert_eq!((imported.triangles, imported.degenerate_triangles), (COUNT, 0));
}

/// Each is used once, and half of them are defined, each with a colour of its own.
fn material_names() {
    const COUNT: usize = 40_000;
    let (mut text, mut library) = (format!("mtllib a.mtl\n{TRIANGLE}"), String::new());
    for name in 0..COUNT {
        writeln!(text, "usemtl {name}\nf 1 2 3").unwrap();
        if name % 2 == 0 {
            writeln!(library, "newmtl {name}\nKd 0.{:03} 0.{:03} 0.5", name % 200, name / 200).unwrap();
        }
    }
    let imported = Folder::new().with("a.obj", text).with("a.mtl", library).load().unwrap();
    assert_eq!(imported.triangles, COUNT + 1);
    assert!(imported.warning_counts.values().sum::<usize>() >= COUNT / 2, "{:?}", imported.warning_counts);
}

fn polygon() {
    const CORNERS: usize = 1_000_000;
    let mut text = String::new();
    for corner in 0..CORNERS {
        let (sine, cosine) = (corner as f64 / CORNERS as f64 * std::f64::consts::TAU).sin_cos();
        writeln!(text, "v {} {} 0", cosine * 1e4, sine * 1e4).unwrap();
    }
    text.push('f');
    (1..=CORNERS).for_each(|corner| write!(text, " {corner}").unwrap());
    let imported = Folder::new().with("a.obj", text).load().unwrap();
    assert_eq!(imported.triangles + imported.degenerate_triangles, CORNERS - 2);
    assert!(imported.triangles > CORNERS / 2, "{}", imported.triangles);
}
