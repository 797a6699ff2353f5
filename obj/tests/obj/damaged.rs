//! Files that are damaged, or in another encoding: what can be read is read, and what is left out is said.

use drawloom::glam::Vec3;
use drawloom::scene::Material;
use drawloom_obj::{Imported, ObjLimits, ObjWarning};
use libtest_mimic::Trial;

use crate::folder::{Folder, TRIANGLE, colors, load, mesh};
use crate::trial;

pub fn trials() -> Vec<Trial> {
    vec![
        trial("damaged::a_malformed_line_is_left_out_and_the_others_are_read", a_malformed_line_is_left_out),
        trial("damaged::one_bad_element_loses_no_other", one_bad_element_loses_no_other),
        trial("damaged::a_number_ends_where_it_stops_being_one", a_number_ends_where_it_stops_being_one),
        trial("damaged::a_file_may_end_anywhere", a_file_may_end_anywhere),
        trial("damaged::unknown_statements_are_counted_and_named", unknown_statements_are_counted_and_named),
        trial("damaged::what_is_not_drawn_is_said", what_is_not_drawn_is_said),
        trial("damaged::colors_that_are_none_are_replaced", colors_that_are_none_are_replaced),
        trial("damaged::names_in_any_encoding_match", names_in_any_encoding_match),
        trial("damaged::utf_16_and_cr_are_read", utf_16_and_cr_are_read),
        trial("damaged::warnings_are_capped_and_counted", warnings_are_capped_and_counted),
        trial("damaged::control_characters_do_not_reach_messages", control_characters_do_not_reach_messages),
        trial("damaged::a_file_whose_name_turns_text_is_found", a_file_whose_name_turns_text_is_found),
    ]
}

fn a_malformed_line_is_left_out() {
    let bad = [
        ("v 1 x 0", "`x` is not a number"),
        ("v 1", "a vertex needs 3 coordinates and has 1"),
        ("vn 1", "a normal needs 3 numbers and has 1"),
        ("vt", "texture coordinates need a number and have none"),
        ("f 1 2 99", "a face refers to vertex 99, but there are 3 so far"),
        ("f 1 2 3/4/5/6", "`3/4/5/6` is not a corner of a face"),
    ];
    for (line, reason) in bad {
        let imported = load(&format!("{TRIANGLE}{line}\n"));
        let reason = format!("{reason}; the line was left out");
        assert_eq!(imported.warnings, [ObjWarning::Line { line: 5, reason }], "{line}");
        assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 0));
    }
    // A malformed vertex counts, so that faces refer to those behind it, and a triangle of it is left out.
    let imported = load("v 0 0 x\nv 0 0 0\nv 2 0 0\nv 0 2 0\nf 2 3 4\nf 1 2 3\nf -4 -3 -2\n");
    assert_eq!((imported.triangles, imported.degenerate_triangles), (1, 2));
    assert_eq!(mesh(&imported, 0).vertices()[1].position, [1.0, -1.0, 0.0]);
    // So do a malformed normal and malformed texture coordinates.
    let imported = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn x\nvn 0 3 4\nvt x\nvt 0.5 0.25\nf 1/1/1 2/2/2 3/2/2\n");
    let vertices = mesh(&imported, 0).vertices();
    assert_eq!((vertices[0].normal, vertices[0].uv), ([0.0, 0.0, 1.0], [0.0, 0.0]));
    assert_eq!((vertices[1].normal, vertices[1].uv), ([0.0, 0.6, 0.8], [0.5, 0.75]));
}

fn one_bad_element_loses_no_other() {
    let elements = [
        // Objects too far or too large for numbers of 32 bits, and one whose middle is no number.
        "o far\nv 1e300 0 0\nv 1e300 1e299 0\nv 1e300 0 1e299\nf -1 -2 -3\n",
        "o large\nv -3e38 0 0\nv 3e38 0 0\nv 0 3e38 0\nf -1 -2 -3\n",
        "o nowhere\nv inf 0 0\nv -inf 0 0\nv 0 nan 0\nf -1 -2 -3\n",
        "o flat\nv 0 0 0\nv 0 0 0\nv 0 0 0\nf -1 -2 -3\n",
        // A face, a material, a library, a texture.
        "f 0 0 0\n",
        "f 1 2\n",
        "usemtl missing\nf 1 2 3\n",
        "mtllib missing.mtl\nusemtl wood\nf 1 2 3\n",
        "vn nan nan nan\nvt inf\nf 1/1/1 2/1/1 3/1/1\n",
        "cstype bezier\nsurf 0 1 0 1 1 2 3\n",
    ];
    for element in elements {
        for text in [format!("{TRIANGLE}{element}"), format!("{TRIANGLE}{element}{TRIANGLE}")] {
            let imported = load(&text);
            assert!(imported.triangles > 0 && imported.triangles >= text.matches(TRIANGLE).count(), "{text}");
            assert!(!imported.warnings.is_empty() || imported.degenerate_triangles > 0, "{text}");
        }
    }
}

fn a_number_ends_where_it_stops_being_one() {
    let imported = load("v 0 0 0\nv 3.1+e2 0 0\nv 0 2;0 0\nf 1 2 3\n");
    assert_eq!(mesh(&imported, 0).vertices()[1].position, [1.55, -1.0, 0.0]);
    let reason = |word: &str, number: &str| format!("`{word}` is not a number and was read as {number}");
    let expected = [(2, reason("3.1+e2", "3.1")), (3, reason("2;0", "2"))];
    assert_eq!(imported.warnings, expected.map(|(line, reason)| ObjWarning::Line { line, reason }));
}

fn a_file_may_end_anywhere() {
    let text = format!("{TRIANGLE}vn 0 0 1\nvt 0.5 0.5\nv 1 1 0\nf 1/1/1 2/1/1 4/1/1 # last\n");
    for end in TRIANGLE.len()..=text.len() {
        let imported = load(&text[..end]);
        assert!((1..=2).contains(&imported.triangles), "{}", &text[..end]);
        let is_in_face = text[TRIANGLE.len()..end].contains("\nf ");
        let face = text[..end].lines().count();
        let is_of_face = |warning: &ObjWarning| match warning {
            ObjWarning::Line { line, .. } => *line == face,
            ObjWarning::NotDrawn { points, lines, surfaces: 0 } => points + lines == 1,
            _ => false,
        };
        let is_said = imported.warnings.iter().any(is_of_face);
        assert!(!is_in_face || imported.triangles == 2 || is_said, "{} {:?}", &text[..end], imported.warnings);
    }
    let cut = load(&text[..text.len() - "/1/1 # last\n".len() - 1]);
    assert_eq!((cut.triangles, cut.warnings), (1, vec![ObjWarning::NotDrawn { points: 0, lines: 1, surfaces: 0 }]));
}

fn unknown_statements_are_counted_and_named() {
    let text = format!("{TRIANGLE}F 1 3 4\nfo 1 2 3\nF 1 2 3\ncall other.obj\nMTLLIB a.mtl\ns off\n");
    let imported = load(&text);
    let [ObjWarning::IgnoredStatements { keywords, others: 0, .. }] = &imported.warnings[..] else {
        panic!("{:?}", imported.warnings);
    };
    let named: Vec<_> =
        keywords.iter().map(|known| (known.keyword.as_str(), known.statements, known.first_line)).collect();
    assert_eq!(named, [("F", 2, 5), ("fo", 1, 6), ("call", 1, 8), ("MTLLIB", 1, 9)]);
    let message = imported.warnings[0].to_string();
    let names = "2 × `F` from line 5 on, `fo` in line 6, `call` in line 8, `MTLLIB` in line 9 left out";
    assert!(message.ends_with(names), "{message}");
}

fn what_is_not_drawn_is_said() {
    let smooth = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\ns 1\nf 1 2 3\nf 1//1 2//1 3//1\ns off\nf 1 2 3\n";
    assert_eq!(load(smooth).warnings, [ObjWarning::NotSmoothed { faces: 1 }]);
    let library = "newmtl one\nKs 1 1 1\nillum 2\nmap_bump a.png\nnorm a.png\nmap_Ke a.png\nTf 0 1 0\n";
    let text = format!("mtllib a.mtl\nusemtl one\n{TRIANGLE}");
    let imported = Folder::new().with("a.obj", text).with("a.mtl", library).load().unwrap();
    let message = imported.warnings[0].to_string();
    for keyword in ["Ks", "map_bump", "norm", "map_Ke", "Tf"] {
        assert!(message.contains(&format!("`{keyword}` in line ")), "{message}");
    }
    assert!(!message.contains("illum"), "{message}");
}

fn colors_that_are_none_are_replaced() {
    let imported = load("v 0 0 0 2 -1 1\nv 1 0 0 0 NaN 0\nv 0 1 0 255 0 0.5\nf 1 2 3\n");
    assert_eq!(imported.warnings, [ObjWarning::ReplacedColors { vertices: 3 }]);
    let [red, white, pink] = colors(&imported)[..] else { panic!("three vertices have a colour") };
    assert_eq!((red, white, [pink[0], pink[1]]), ([1.0, 0.0, 1.0], [1.0; 3], [1.0, 0.0]));
}

fn diffuse(imported: &Imported) -> Vec<Vec3> {
    let object = |object| imported.scene.object(object).unwrap().material;
    let materials = imported.scene.objects().map(object);
    materials.map(|material| imported.scene.assets().get(material).unwrap().diffuse).collect()
}

fn names_in_any_encoding_match() {
    // Two names in Shift-JIS, of which the first ends with the byte of a backslash, and one in Latin-1.
    let names: [&[u8]; 3] = [b"\x95\x5c", b"\x97\xa0", b"fa\xe7ade"];
    let mut text = b"# caf\xe9\nmtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n".to_vec();
    let mut library = Vec::new();
    for (name, color) in names.into_iter().zip(["1 0 0", "0 1 0", "0 0 1"]) {
        text.extend([b"usemtl ", name, b"\nf 1 2 3\n"].concat());
        library.extend([b"newmtl ", name, b"\nKd ", color.as_bytes(), b"\n"].concat());
    }
    let imported = Folder::new().with("a.obj", text).with("a.mtl", library).load().unwrap();
    assert_eq!(diffuse(&imported), [Vec3::X, Vec3::Y, Vec3::Z]);
    // The comment is not text either, but nothing of it is read.
    let [
        ObjWarning::NotUnicode { lines: 3, first_line: 6, .. },
        ObjWarning::NotUnicode { file, lines: 3, first_line: 1 },
    ] = &imported.warnings[..]
    else {
        panic!("{:?}", imported.warnings);
    };
    assert_eq!(file, "a.mtl");
    // A name in UTF-8 is that of a library in Latin-1.
    let text = format!("mtllib a.mtl\nusemtl façade\n{TRIANGLE}");
    let imported = Folder::new().with("a.obj", text).with("a.mtl", b"newmtl fa\xe7ade\nKd 0 0 1\n").load().unwrap();
    assert_eq!(diffuse(&imported), [Vec3::Z]);
}

fn utf_16_and_cr_are_read() {
    let text = format!("mtllib a.mtl\nusemtl façade\n{TRIANGLE}");
    let library = "newmtl façade\nKd 0 0 1\n";
    let utf_16 = |text: &str, to_bytes: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(to_bytes).collect::<Vec<u8>>();
    let encode = |number: usize, text: &str| match number {
        0 => text.replace('\n', "\r").into_bytes(),
        1 => text.replace('\n', "\r\n").into_bytes(),
        2 => utf_16(&format!("\u{feff}{text}"), u16::to_le_bytes),
        3 => utf_16(&format!("\u{feff}{text}"), u16::to_be_bytes),
        4 => utf_16(text, u16::to_le_bytes),
        _ => utf_16(&text.replace('\n', "\r\n"), u16::to_be_bytes),
    };
    for number in 0..6 {
        for text in [text.as_bytes().to_vec(), encode(number, &text)] {
            let imported = Folder::new().with("a.obj", text).with("a.mtl", encode(number, library)).load().unwrap();
            assert_eq!((diffuse(&imported), imported.warnings), (vec![Vec3::Z], vec![]), "encoding {number}");
        }
    }
}

fn warnings_are_capped_and_counted() {
    let text = format!("mtllib a.mtl\nusemtl no\n{TRIANGLE}{}", "f 1 2 9\n".repeat(200_000));
    let library = "Kd x\n".repeat(1000);
    let folder = Folder::new().with("a.obj", text).with("a.mtl", library);
    let imported = folder.load().unwrap();
    assert_eq!(imported.warnings.len(), 100 + 100 + 1);
    assert_eq!(
        imported.warnings[99],
        ObjWarning::Line {
            line: 106,
            reason: String::from("a face refers to vertex 9, but there are 3 so far; the line was left out"),
        }
    );
    let counts: Vec<_> = imported.warning_counts.into_iter().collect();
    let expected =
        [("malformed line", 200_000), ("malformed line of a material library", 1000), ("undefined material", 1)];
    assert_eq!(counts, expected);
    let few = folder.load_within(&ObjLimits { warnings: 2, ..ObjLimits::default() }).unwrap();
    assert_eq!((few.warnings.len(), few.warning_counts["malformed line"]), (5, 200_000));
    // What a message quotes is short.
    let long = load(&format!("{TRIANGLE}f 1 2 {}\n{} 1\n", "x".repeat(100_000), "k".repeat(100_000)));
    assert_eq!(long.warnings.len(), 2);
    assert!(long.warnings.iter().all(|warning| warning.to_string().len() < 400));
}

fn control_characters_do_not_reach_messages() {
    // Ends of lines, and all that turns the direction of text.
    let others = "\u{2028}\u{2029}\u{61c}\u{200e}\u{200f}\u{202a}\u{202b}\u{202c}\u{202d}\u{202e}\u{2066}\u{2067}\
                  \u{2068}\u{2069}";
    let hostile = &format!("\u{1b}]0;title\u{7}\u{9b}31m\u{0}{others}.");
    let is_forbidden = |character: char| character.is_control() || others.contains(character);
    let text = format!(
        "mtllib {hostile}.mtl\nmtllib a.mtl\nusemtl {hostile}\n{TRIANGLE}o {hostile}\n{hostile} 1\nf 1 1 {hostile}\n"
    );
    let text = format!("{text}f 1 1 1\nusemtl one\nf 1 2 3\n");
    let library =
        format!("Kd {hostile}\n{hostile}\nnewmtl one\nmap_Kd {hostile}.png\nKd {hostile}\nmap_Kd -bm 1 {hostile}\n");
    let imported = Folder::new().with("a.obj", text).with("a.mtl", library).load().unwrap();
    assert!(imported.warnings.len() >= 8, "{:?}", imported.warnings);
    for warning in &imported.warnings {
        let message = warning.to_string();
        assert!(!message.contains(is_forbidden), "{message:?}");
    }
    let materials = imported.scene.assets().iter::<Material>();
    assert!(materials.map(|(_, material)| &material.name).all(|name| !name.chars().any(char::is_control)));
    let file = format!("{hostile}.obj");
    let error = drawloom_obj::read(&file, b"", |_| unreachable!()).unwrap_err();
    assert!(!error.to_string().contains(is_forbidden), "{error}");
}

/// Windows puts this mark in front of paths that are copied from its dialogs.
fn a_file_whose_name_turns_text_is_found() {
    let text = format!("mtllib \u{202a}a.mtl\nusemtl one\n{TRIANGLE}");
    let imported = Folder::new().with("a.obj", text).with("\u{202a}a.mtl", "newmtl one\nKd 1 0 0\n").load().unwrap();
    assert_eq!(imported.warnings, []);
}
