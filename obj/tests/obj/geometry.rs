//! Vertices and faces, and files that are not OBJ.

use drawloom::glam::{DVec3, Vec3};
use drawloom_obj::{Imported, ObjError, ObjWarning};
use libtest_mimic::Trial;

use crate::folder::{Folder, TRIANGLE, colors, load, mesh};
use crate::trial;

pub fn trials() -> Vec<Trial> {
    vec![
        trial("geometry::a_concave_polygon_is_triangulated", a_concave_polygon_is_triangulated),
        trial("geometry::a_relative_index_counts_back", a_relative_index_counts_back),
        trial("geometry::lines_and_points_are_left_out", lines_and_points_are_left_out),
        trial("geometry::triangles_without_area_are_left_out", triangles_without_area_are_left_out),
        trial("geometry::a_model_without_area_is_reported", a_model_without_area_is_reported),
        trial("geometry::bad_normals_and_coordinates_are_replaced", bad_normals_and_coordinates_are_replaced),
        trial("geometry::faces_with_and_without_normals_mix", faces_with_and_without_normals_mix),
        trial("geometry::a_face_without_normals_has_a_face_normal", a_face_without_normals_has_a_face_normal),
        trial("geometry::the_origin_of_an_object_is_its_centre", the_origin_of_an_object_is_its_centre),
        trial("geometry::colors_of_vertices_are_read", colors_of_vertices_are_read),
        trial("geometry::a_far_face_does_not_flatten_a_small_one", a_far_face_does_not_flatten_a_small_one),
        trial("geometry::details_of_any_size_are_kept", details_of_any_size_are_kept),
        trial("geometry::a_large_convex_polygon_is_covered", a_large_convex_polygon_is_covered),
        trial(
            "geometry::malformed_lines_are_reported_with_their_number",
            malformed_lines_are_reported_with_their_number,
        ),
        trial("geometry::a_file_that_is_not_text_is_an_error", a_file_that_is_not_text_is_an_error),
        trial("geometry::an_unreadable_file_is_an_error", an_unreadable_file_is_an_error),
    ]
}

fn a_concave_polygon_is_triangulated() {
    // An L. A fan around its first corner would cross its outline.
    let text = "v 0 2 0\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nf 4 5 6 1 2 3\n";
    for text in [text.to_owned(), text.replace("f 4 5 6 1 2 3", "f 6 1 2 \\\n3 4 5 # the same")] {
        let imported = load(&text);
        assert_eq!((imported.triangles, imported.warnings.len()), (4, 0));
        assert!((area(&imported) - 3.0).abs() < 1e-5, "{}", area(&imported));
    }
    let crossed = load("v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 2 0\nf 1 2 3 4\n");
    assert!(matches!(crossed.warnings[..], [ObjWarning::FannedPolygons { polygons: 1, .. }]), "{:?}", crossed.warnings);
}

fn area(imported: &Imported) -> f32 {
    let mesh = mesh(imported, 0);
    let triangles = mesh.indices().chunks(3).map(|corners| {
        let [a, b, c] = [0, 1, 2].map(|corner| Vec3::from(mesh.vertices()[corners[corner] as usize].position));
        (b - a).cross(c - a).length() / 2.0
    });
    triangles.sum()
}

fn a_relative_index_counts_back() {
    let imported = load("v 9 9 9\nv 0 0 0\nv 2 0 0\nv 0 2 0\nf -3 -2 -1\nv 7 7 7\n");
    assert_eq!(imported.triangles, 1);
    assert_eq!(imported.scene.as_scene_ref().positions, [DVec3::new(1.0, 1.0, 0.0)]);
}

fn colors_of_vertices_are_read() {
    let imported = load("v 0 0 0\nv 1 0 0 0.5 1 0\nv 0 1 0 0.02 0 0.2 # the third\nf 1 2 3\nv 5 5 5 1 0 0\n");
    assert!(imported.warnings.is_empty(), "{:?}", imported.warnings);
    let expected = [[1.0; 3], [0.214_041_14, 1.0, 0.0], [0.001_547_987_6, 0.0, 0.033_104_766]];
    let found = colors(&imported);
    let errors =
        found.iter().flatten().zip(expected.iter().flatten()).map(|(found, expected)| (found - expected).abs());
    assert!(found.len() == 3 && errors.fold(0.0, f32::max) < 1e-7, "{found:?}");

    // A corner has the colour of its position, wherever that is in the file, also where faces share none of their
    // vertices.
    let text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 1 1 0 1 1 0\nf 4 3 2\nf 3 1 2\n";
    let found = load(text);
    let expected =
        [[1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(colors(&found), expected);

    // White vertices are those of a mesh without colours, and a weight is no colour.
    for text in ["v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "v 0 0 0 1\nv 1 0 0 1\nv 0 1 0 2\nf 1 2 3\n", TRIANGLE] {
        let plain = load(text);
        assert!(colors(&plain).is_empty() && plain.warnings.is_empty(), "{text}");
    }
}

fn lines_and_points_are_left_out() {
    let imported = load(&format!("{TRIANGLE}l 1 2 3\nl 1 2\np 1 2\nf 1 2\nf 3\ncurv 0 1 1 2\n"));
    assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 0));
    assert_eq!(imported.warnings, [ObjWarning::NotDrawn { points: 3, lines: 3, surfaces: 1 }]);
}

fn triangles_without_area_are_left_out() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 0\nv 2 0 0\nv nan 0 0\nv inf 0 0\nv 1e300 0 0\n";
    for bad in ["f 1 1 2", "f 1 2 4", "f 1 2 5", "f 1 2 6", "f 1 2 7", "f 1 2 8"] {
        let imported = load(&format!("{vertices}f 1 2 3\n{bad}\n"));
        assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 1), "{bad}");
    }
    // A polygon with a corner that is not finite is left out as a whole, with all its triangles, and does not count as
    // one that intersects itself.
    for vertex in ["nan 0 0", "0 inf 0"] {
        let imported = load(&format!("{TRIANGLE}v {vertex}\nv -1 1 0\nf 1 2 3 4 5\n"));
        assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 3), "{vertex}");
        assert_eq!(imported.warning_counts.len(), 0, "{vertex}: {:?}", imported.warnings);
    }
    // A mesh from end to end of what 32 bits can represent has no bounding sphere.
    let imported = load(&format!("{TRIANGLE}v -3.4e38 3.4e38 0\nv 3.4e38 0 3.4e38\nv 0 -3.4e38 -3.4e38\nf 4 5 6\n"));
    assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 1));
    let edge = f32::MAX / 2.0;
    let imported = load(&format!("v -{edge} {edge} {edge}\nv {edge} -{edge} {edge}\nv 0 {edge} -{edge}\nf 1 2 3\n"));
    assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 0));
    // Collinear, but for rounding.
    let imported = load(&format!("{TRIANGLE}v 0.1 0.3 0.7\nv 0.2 0.6 1.4\nv 0.3 0.9 2.1\nf 4 5 6\n"));
    assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 1));
    // Small is not degenerate.
    let imported = load("v 0 0 0\nv 1e-12 0 0\nv 0 1e-12 0\nf 1 2 3\n");
    assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 0));
}

fn a_model_without_area_is_reported() {
    let imported = load(&format!("{TRIANGLE}o thin\nf 1 2 1\n"));
    let expected = ObjWarning::EmptyModel { model: String::from("thin"), degenerate_triangles: 1 };
    assert_eq!((imported.warnings, imported.scene.object_count()), (vec![expected], 1));
    let error = Folder::new().with("a.obj", "v 0 0 0\nf 1 1 1\n").load().unwrap_err();
    assert!(matches!(error, ObjError::NoTriangles { degenerate_triangles: 1, .. }), "{error}");
    let error = Folder::new().with("a.obj", "").load().unwrap_err();
    assert!(error.to_string().contains("a.obj` has no triangle to draw"), "{error}");
    let curves = Folder::new().with("a.obj", "mtllib no.mtl\nv 0 0 0\ncurv2 1 1\nsurfaces 3\n").load().unwrap_err();
    assert!(matches!(curves, ObjError::NoTriangles { surfaces: 1, .. }), "{curves}");
    let kinds: Vec<_> = curves.warnings().iter().map(ObjWarning::kind).collect();
    let ignored = "file with ignored statements";
    assert_eq!(kinds, [ignored, "points, lines or surfaces", "missing material library", "model without triangles"]);
}

fn bad_normals_and_coordinates_are_replaced() {
    let imported = load(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nvn nan 0 1\nvn 0 3 4\nvt nan 1\nvt 0.5 1e200\nvt 0.5 0.25\n\
         f 1/1/1 2/2/2 3/3/3\n",
    );
    let vertices = mesh(&imported, 0).vertices();
    let normals: Vec<_> = vertices.iter().map(|vertex| vertex.normal).collect();
    assert_eq!(normals, [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]);
    let uvs: Vec<_> = vertices.iter().map(|vertex| vertex.uv).collect();
    assert_eq!(uvs, [[0.0, 0.0], [0.0, 0.0], [0.5, 0.75]]);
    let expected =
        [ObjWarning::ReplacedNormals { normals: 2 }, ObjWarning::ReplacedTextureCoordinates { coordinates: 2 }];
    assert_eq!(imported.warnings, expected);
}

fn faces_with_and_without_normals_mix() {
    let imported = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 1 0\nvt 1 1\nf 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\n");
    let mesh = mesh(&imported, 0);
    let corners: Vec<_> = mesh.indices().iter().map(|&index| mesh.vertices()[index as usize]).collect();
    let of = |face: usize| (corners[face * 3].normal, corners[face * 3].uv);
    assert_eq!(of(0), ([0.0, 0.0, 1.0], [0.0, 0.0]));
    assert_eq!(of(1), ([0.0, 0.0, 1.0], [1.0, 0.0]));
    assert_eq!(of(2), ([0.0, 1.0, 0.0], [0.0, 0.0]));
    assert_eq!(imported.warnings, []);
    let dangling = load(&TRIANGLE.replace("f 1 2 3", "f 1/7 2//9 3"));
    assert_eq!(dangling.warnings, [ObjWarning::DanglingCorners { corners: 2 }]);
}

fn a_face_without_normals_has_a_face_normal() {
    // Two faces share an edge.
    let imported = load(&format!("{TRIANGLE}v 0 0 -1\nf 1 4 2\n"));
    let mesh = mesh(&imported, 0);
    let normals: Vec<_> = mesh.indices().iter().map(|&index| mesh.vertices()[index as usize].normal).collect();
    assert_eq!(normals[..3], [[0.0, 0.0, 1.0]; 3]);
    assert_eq!(normals[3..], [[0.0, -1.0, 0.0]; 3]);
}

fn the_origin_of_an_object_is_its_centre() {
    let imported = load("v 1000000 5 0\nv 1000000.25 5 0\nv 1000000 5.5 0\nf 1 2 3\n");
    assert_eq!(imported.scene.as_scene_ref().positions, [DVec3::new(1_000_000.125, 5.25, 0.0)]);
    assert_eq!(mesh(&imported, 0).vertices()[0].position, [-0.125, -0.25, 0.0]);
    let bounds = mesh(&imported, 0).bounds();
    assert!(bounds.center.length() < 1e-6 && bounds.radius < 0.3);
}

/// The areas of all triangles in the world, the smallest first.
fn areas(imported: &Imported) -> Vec<f64> {
    let scene = imported.scene.as_scene_ref();
    let mut areas = Vec::new();
    for mesh in scene.meshes.iter().map(|mesh| scene.assets.get(*mesh).unwrap()) {
        let position = |index: u32| Vec3::from(mesh.vertices()[index as usize].position).as_dvec3();
        for corners in mesh.indices().as_chunks::<3>().0 {
            let [a, b, c] = corners.map(position);
            areas.push((b - a).cross(c - a).length() / 2.0);
        }
    }
    areas.sort_by(f64::total_cmp);
    areas
}

fn a_far_face_does_not_flatten_a_small_one() {
    let far = "v 1000000 0 0\nv 1000001 0 0\nv 1000000 1 0\n";
    let small = "v 0 0 0\nv 0.01 0 0\nv 0.01 0.01 0\nv 0 0.01 0\n";
    // One model, and two.
    for name in ["", "o small\n"] {
        let imported = load(&format!("{far}{small}f 1 2 3\n{name}f 4 5 6 7\n"));
        assert_eq!((imported.triangles, imported.degenerate_triangles), (3, 0));
        let areas = areas(&imported);
        let expected = [5e-5, 5e-5, 0.5];
        assert!(areas.iter().zip(expected).all(|(area, expected)| (area / expected - 1.0).abs() < 1e-5), "{areas:?}");
        let mut positions = imported.scene.as_scene_ref().positions.to_vec();
        positions.sort_by(|one, other| one.x.total_cmp(&other.x));
        assert_eq!(positions, [DVec3::new(0.005, 0.005, 0.0), DVec3::new(1_000_000.5, 0.5, 0.0)]);
    }
}

fn details_of_any_size_are_kept() {
    // A plain of 20 km with a screw on it, and triangles that are each a ten-thousandth of the one before.
    let screw = "v 3000 4000 0\nv 3000.001 4000 0\nv 3000 4000.001 0\n";
    let plain = "v -1e4 -1e4 0\nv 1e4 -1e4 0\nv 1e4 1e4 0\nv -1e4 1e4 0\n";
    let imported = load(&format!("{plain}{screw}f 1 2 3 4\nf 5 6 7\n"));
    assert_eq!((imported.triangles, imported.degenerate_triangles), (3, 0));
    assert!((areas(&imported)[0] / 5e-7 - 1.0).abs() < 1e-3, "{:?}", areas(&imported));
    let triangle =
        |exponent| format!("v 1e{exponent} 0 0\nv 2e{exponent} 0 0\nv 1e{exponent} 1e{exponent} 0\nf -3 -2 -1\n");
    let imported = load(&(-30..=30).step_by(4).map(triangle).collect::<String>());
    assert_eq!((imported.triangles, imported.degenerate_triangles), (16, 0));
    // An object has at most two of them, as half its extent is less than two million sides of the smaller one.
    // Coordinates are 10⁴ sides or less then, and rounding to 24 bits moves a corner by at most 6·10⁻⁴ of a side. A
    // side changes by twice that, and an area by four times.
    for (area, exponent) in areas(&imported).into_iter().zip((-30..=30).step_by(4)) {
        let change = area / (0.5 * 10_f64.powi(2 * exponent)) - 1.0;
        assert!(change.abs() < 2.5e-3, "{area} of 1e{exponent}");
    }
}

fn a_large_convex_polygon_is_covered() {
    const CORNERS: usize = 5_000;
    let corner = |index: usize| (index as f64 / CORNERS as f64 * std::f64::consts::TAU).sin_cos();
    // Six decimals, so that some corners are concave by rounding.
    let vertices: String =
        (0..CORNERS).map(corner).map(|(sine, cosine)| format!("v {cosine:.6} {sine:.6} 0\n")).collect();
    let indices: String = (1..=CORNERS).map(|index| format!(" {index}")).collect();
    let imported = load(&format!("{vertices}f{indices}\n"));
    assert_eq!(imported.warnings, []);
    assert_eq!(imported.triangles + imported.degenerate_triangles, CORNERS - 2);
    assert!((f64::from(area(&imported)) - std::f64::consts::PI).abs() < 1e-5, "{}", area(&imported));
}

fn malformed_lines_are_reported_with_their_number() {
    for (text, part) in [
        ("v 1 2\n", "line 1: a vertex needs 3 coordinates and has 2"),
        ("v 1 2 x\n", "line 1: `x` is not a number"),
        ("v 1 2 3 0\n", "line 1: a vertex has the weight 0"),
        ("\n\nvn 1 2\n", "line 3: a normal needs 3 numbers and has 2"),
        ("vt\n", "line 1: texture coordinates need a number and have none"),
        ("f\n", "line 1: a face without a corner"),
        ("v 0 0 0\nf 1 2 3\n", "line 2: a face refers to vertex 2, but there are 1 so far"),
        ("v 0 0 0\nf 0 1 1\n", "line 2: a face refers to vertex 0"),
        ("v 0 0 0\nf -2 1 1\n", "line 2: a face refers to vertex -2"),
        ("v 0 0 0\nf 1/1/1/1 1 1\n", "line 2: `1/1/1/1` is not a corner of a face"),
        ("v 0 0 0\nf 1/a 1 1\n", "line 2: `1/a` is not a corner of a face"),
        ("v 0 0 0\nf //1 1 1\n", "line 2: `//1` is not a corner of a face"),
        ("v 0 0 0\nf 99999999999999999999 1 1\n", "is not a corner of a face"),
    ] {
        let error = Folder::new().with("a.obj", text).load().unwrap_err();
        assert!(matches!(error, ObjError::Malformed { .. }), "{text}");
        let message = error.to_string();
        assert!(message.contains(part) && message.contains("a.obj"), "{message}");
    }
    let weighted = load("v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 2\nf 1 2 3\n");
    assert_eq!(mesh(&weighted, 0).vertices()[1].position, [0.5, -0.5, 0.0]);
}

fn a_file_that_is_not_text_is_an_error() {
    let error = Folder::new().with("a.obj", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\xff\n").load().unwrap_err();
    assert!(matches!(error, ObjError::NotText { line: 1, .. }), "{error}");
    assert!(error.to_string().contains("a.obj"));
    // A byte order mark is allowed.
    assert_eq!(load(&format!("\u{feff}{TRIANGLE}")).triangles, 1);
}

fn an_unreadable_file_is_an_error() {
    let folder = Folder::new();
    for path in [folder.0.join("missing.obj"), folder.0.clone()] {
        let error = drawloom_obj::load(&path).unwrap_err();
        assert!(matches!(error, ObjError::Unreadable { .. }), "{error}");
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    }
}
