//! OBJ files that the project generates: an interior, a hall of many objects, and small ones that other loaders stumble
//! over.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use drawloom::glam::DVec3;
use drawloom_output::{OutputError, OutputFile};

/// A file and its material library.
pub struct ObjFile {
    pub text: String,
    pub library: String,
    pub objects: usize,
    pub triangles: usize,
}

impl ObjFile {
    /// Writes both into a folder.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn write_to(&self, folder: &Path) -> Result<PathBuf, OutputError> {
        let path = folder.join("generated.obj");
        OutputFile::new(folder.join("generated.mtl"))?.write_all(&self.library)?;
        OutputFile::new(&path)?.write_all(&self.text)?;
        Ok(path)
    }
}

/// A room of 4 × 3 × 4 m around x = z = 0, open towards +Z: a red wall on the left, a green one on the right, a lamp of
/// 1 × 0.8 m in the ceiling, a block and a slab.
pub fn interior() -> ObjFile {
    let mut writer = Writer::new();
    let corner = |x: f64, y: f64, z: f64| DVec3::new(2.0 * x, 3.0 * y, 2.0 * z);
    writer.object("floor", "plaster");
    writer.face(&[corner(-1.0, 0.0, 1.0), corner(1.0, 0.0, 1.0), corner(1.0, 0.0, -1.0), corner(-1.0, 0.0, -1.0)]);
    writer.object("ceiling", "plaster");
    writer.face(&[corner(-1.0, 1.0, -1.0), corner(1.0, 1.0, -1.0), corner(1.0, 1.0, 1.0), corner(-1.0, 1.0, 1.0)]);
    writer.object("back", "plaster");
    writer.face(&[corner(-1.0, 0.0, -1.0), corner(1.0, 0.0, -1.0), corner(1.0, 1.0, -1.0), corner(-1.0, 1.0, -1.0)]);
    writer.object("left", "red");
    writer.face(&[corner(-1.0, 0.0, 1.0), corner(-1.0, 0.0, -1.0), corner(-1.0, 1.0, -1.0), corner(-1.0, 1.0, 1.0)]);
    writer.object("right", "green");
    writer.face(&[corner(1.0, 0.0, -1.0), corner(1.0, 0.0, 1.0), corner(1.0, 1.0, 1.0), corner(1.0, 1.0, -1.0)]);
    writer.object("lamp", "lamp");
    let lamp = |x: f64, z: f64| DVec3::new(0.5 * x, 2.99, 0.4 * z);
    writer.face(&[lamp(-1.0, -1.0), lamp(1.0, -1.0), lamp(1.0, 1.0), lamp(-1.0, 1.0)]);
    writer.object("block", "plaster");
    writer.block(DVec3::new(0.7, 0.5, 0.6), DVec3::splat(0.5), 0.3);
    writer.object("slab", "plaster");
    writer.block(DVec3::new(-0.7, 1.0, -0.6), DVec3::new(0.5, 1.0, 0.5), -0.35);
    let library = "newmtl plaster\nKd 0.7 0.68 0.65\nnewmtl red\nKd 0.6 0.08 0.06\nnewmtl green\nKd 0.1 0.5 0.12\n\
        newmtl lamp\nKd 0.8 0.8 0.8\nKe 12 9 5\n";
    writer.finish(library)
}

/// A nave along x, 60 × 10 × 12 m: two rows of columns, arches between them, and a vault in segments. The texture of
/// its columns is missing.
pub fn hall() -> ObjFile {
    let mut writer = Writer::new();
    let bays = -7..=7;
    let along = |bay: i32| 4.0 * f64::from(bay);
    for (row, z) in [("left", -3.0), ("right", 3.0)] {
        for column in -8..=7 {
            writer.object(&format!("{row} column {column}"), "stone");
            writer.column(DVec3::new(along(column) + 2.0, 0.0, z));
        }
        for bay in bays.clone() {
            writer.object(&format!("{row} arch {bay}"), "marble");
            writer.arch(DVec3::new(along(bay), 5.0, z));
        }
    }
    for bay in bays {
        writer.object(&format!("floor {bay}"), if bay % 2 == 0 { "marble" } else { "slate" });
        let corner = |x: f64, z: f64| DVec3::new(along(bay) + 2.0 * x, 0.0, 6.0 * z);
        writer.face(&[corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)]);
        writer.object(&format!("vault {bay}"), "plaster");
        let rim = |x: f64, step: usize| {
            let (sin, cos) = (PI * step as f64 / 24.0).sin_cos();
            DVec3::new(along(bay) + 2.0 * x, 6.0 + 4.0 * sin, 6.0 * cos)
        };
        for step in 0..24 {
            writer.face(&[rim(-1.0, step), rim(-1.0, step + 1), rim(1.0, step + 1), rim(1.0, step)]);
        }
    }
    let library = "newmtl stone\nKd 0.6 0.55 0.5\nmap_Kd stone.png\nnewmtl marble\nKd 0.8 0.8 0.78\nnewmtl slate\nKd 0.2 0.22 0.25\n\
        newmtl plaster\nKd 0.7 0.68 0.6\n";
    writer.finish(library)
}

/// Files that loaders stumble over, by name: some are damaged, others are rare. Those without triangles come last.
pub const UNUSUAL: [(&str, &str); 16] = [
    ("nameless", "v 0 0 0\nv 1 0 0\nv 0 1 0\n\nf -3 -2 -1\n"),
    ("vertex_beyond_the_last", "v 0 0 0\nv 1 0 0\nv 0 1 0\no One\nf 1 2 3\no Two\nf 1 2 7\n"),
    (
        "every_kind_of_corner",
        "v 0 1 0\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 1\nvn 0 0 1\no a\nf 1 2 3 4\no b\nf 1/1 2/1 3/1 4/1\no c\nf 1//1 2//1 3//1\no d\nf 1/1/1 2/1/1 3/1/1\n",
    ),
    ("vertex_colours", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 nan 0 1\nf 1 2 3\n"),
    ("coordinates_that_are_missing", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/2 3/3\n"),
    ("normals_that_are_missing", "v 10 20 30\nv 15 5 25\nv 1 5 10\nv 5 15 20\nf 1//1 2//2 4//4\n"),
    ("a_face_in_the_name_of_a_group", "v 10 20 30\nv 15 5 25\nv 1 5 10\ng the f 1 2 3 thing\nf 1 2 3\n"),
    ("a_library_that_is_missing", "mtllib nowhere.mtl\nusemtl stone\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ("a_corner_too_few", "s 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1// 2//\nf 1// 2// 3//\n"),
    ("a_group_without_a_face", "g one\nv 1 4 5\nv 1 2 3\nv 4 5 6\n\ng two\nusemtl stone\nf 1 2 3\n"),
    (
        "a_polygon_over_several_lines",
        "usemtl \nv 0 0 0\nv 2 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 \\\n 3 4 \\\n5 6\n",
    ),
    ("nothing", ""),
    ("a_comment", "# Nothing else.\n"),
    ("points", "o Cloud\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"),
    ("lines", "o Frame\nv 0 0 0\nv 1 0 0\nv 0 1 0\nl 1 2\nl 2 3\nl 3 1\n"),
    ("a_face_in_a_name_alone", "g the f 1 2 3 thing\nv 388 778 347"),
];

struct Writer {
    text: String,
    vertices: usize,
    objects: usize,
    triangles: usize,
}

impl Writer {
    fn new() -> Self {
        Self { text: String::from("mtllib generated.mtl\n"), vertices: 0, objects: 0, triangles: 0 }
    }

    fn object(&mut self, name: &str, material: &str) {
        self.line(format_args!("o {name}\nusemtl {material}"));
        self.objects += 1;
    }

    /// A planar convex polygon, counterclockwise.
    fn face(&mut self, corners: &[DVec3]) {
        for DVec3 { x, y, z } in corners {
            self.line(format_args!("v {x:.6} {y:.6} {z:.6}"));
        }
        let count = corners.len();
        let indices: String = (1..=count).map(|corner| format!(" {}", self.vertices + corner)).collect();
        self.line(format_args!("f{indices}"));
        self.vertices += count;
        self.triangles += count - 2;
    }

    /// A box of half the size `half` that is turned around y.
    fn block(&mut self, center: DVec3, half: DVec3, turn: f64) {
        let corner = |x: f64, y: f64, z: f64| {
            let (sin, cos) = turn.sin_cos();
            let DVec3 { x, y, z } = half * DVec3::new(x, y, z);
            center + DVec3::new(x * cos + z * sin, y, z * cos - x * sin)
        };
        for side in [-1.0, 1.0] {
            let across = [(-1.0, -side), (1.0, -side), (1.0, side), (-1.0, side)];
            self.face(&across.map(|(a, b)| corner(side, a, b)));
            self.face(&across.map(|(a, b)| corner(b, side, a)));
            self.face(&across.map(|(a, b)| corner(a, b, side)));
        }
    }

    /// A column of revolution, 5 m high, with a foot and a head.
    fn column(&mut self, foot: DVec3) {
        const SIDES: usize = 32;
        const PROFILE: [(f64, f64); 13] = [
            (0.60, 0.0),
            (0.60, 0.3),
            (0.50, 0.4),
            (0.42, 0.5),
            (0.41, 1.0),
            (0.40, 1.8),
            (0.39, 2.6),
            (0.38, 3.4),
            (0.37, 4.2),
            (0.42, 4.4),
            (0.52, 4.6),
            (0.60, 4.7),
            (0.60, 5.0),
        ];
        let point = |(radius, height): (f64, f64), side: usize| {
            let (sin, cos) = (TAU * side as f64 / SIDES as f64).sin_cos();
            foot + DVec3::new(radius * cos, height, -radius * sin)
        };
        for ring in PROFILE.windows(2) {
            for side in 0..SIDES {
                self.face(&[
                    point(ring[0], side),
                    point(ring[0], side + 1),
                    point(ring[1], side + 1),
                    point(ring[1], side),
                ]);
            }
        }
    }

    /// Half a ring of square section over 4 m, which stands in the plane of x and y.
    fn arch(&mut self, middle: DVec3) {
        const STEPS: usize = 16;
        let point = |radius: f64, z: f64, step: usize| {
            let (sin, cos) = (PI * step as f64 / STEPS as f64).sin_cos();
            middle + DVec3::new(radius * cos, 0.5 * radius * sin, z)
        };
        let section = [(1.6, -0.3), (2.0, -0.3), (2.0, 0.3), (1.6, 0.3), (1.6, -0.3)];
        for step in 0..STEPS {
            for side in section.windows(2) {
                let [(radius, z), (next_radius, next_z)] = [side[0], side[1]];
                self.face(&[
                    point(radius, z, step),
                    point(radius, z, step + 1),
                    point(next_radius, next_z, step + 1),
                    point(next_radius, next_z, step),
                ]);
            }
        }
    }

    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        writeln!(self.text, "{line}").expect("a string takes everything");
    }

    fn finish(self, library: &str) -> ObjFile {
        let Self { text, objects, triangles, .. } = self;
        ObjFile { text, library: library.into(), objects, triangles }
    }
}
