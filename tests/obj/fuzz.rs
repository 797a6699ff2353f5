//! Fuzzing: reading a randomly changed file returns a scene, or an error that names the file.

use std::io;

use drawloom::demo;
use drawloom::scene::obj;
use libtest_mimic::Trial;
use proptest::prelude::{Just, Strategy, any, prop_oneof};
use proptest::test_runner::{Config, TestRunner};

use crate::trial;

pub const FILE: &str = "mtllib a.mtl\no one\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 1 0 0\nv 0 1 0.5\nv 2 2 -1e3\nvt 0 0\nvt 1 0.5\n\
    vn 0 0 1\nusemtl red\nf 1/1/1 2/2/1 3/1/1 4/2/1\ng two\nusemtl glow\nf -5//-1 -4//1 -3//1 \\\n -2 5/1\nl 1 2\np 3\n";
pub const LIBRARY: &str = "newmtl red\nKd 1 0 0\nd 0.5\nmap_Kd -s 1 1 1 a.png\nnewmtl glow\nKe 1 1 1\nTr 0\n";
const SNIPPETS: [&str; 14] = [
    "f 1 2 3\n",
    "f -1 -2 -3\n",
    "f 1/1/1 2//1 3\n",
    "v 0 0 0\n",
    "v nan 1e39 inf\n",
    "vn 0 0 0\n",
    "\\\n",
    "l 1 2 3\n",
    "-9223372036854775808",
    "/",
    "usemtl\n",
    "Ke 1e38 0 0\n",
    "#",
    "9223372036854775807",
];

pub fn trials() -> Vec<Trial> {
    vec![
        trial("fuzz::changed_files_never_panic", changed_files_never_panic),
        trial("fuzz::arbitrary_bytes_never_panic", arbitrary_bytes_never_panic),
    ]
}

#[derive(Clone, Debug)]
enum Change {
    Byte(u8),
    Remove(usize),
    Insert(&'static str),
}

fn changes() -> impl Strategy<Value = Vec<(usize, Change)>> {
    let change = prop_oneof![
        any::<u8>().prop_map(Change::Byte),
        (1..20_usize).prop_map(Change::Remove),
        (0..SNIPPETS.len()).prop_flat_map(|snippet| Just(Change::Insert(SNIPPETS[snippet]))),
    ];
    proptest::collection::vec((any::<usize>(), change), 1..8)
}

fn change(text: &str, changes: &[(usize, Change)]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for (position, change) in changes {
        let position = position % (bytes.len() + 1);
        let end = match change {
            Change::Byte(_) => position + 1,
            Change::Remove(count) => position + count,
            Change::Insert(_) => position,
        };
        let new: &[u8] = match change {
            Change::Byte(byte) => &[*byte],
            Change::Remove(_) => &[],
            Change::Insert(snippet) => snippet.as_bytes(),
        };
        bytes.splice(position..end.min(bytes.len()), new.iter().copied());
    }
    bytes
}

fn read(file: &[u8], library: &[u8]) {
    let fetch = |name: &str| match name {
        "a.mtl" => Ok(library.to_vec()),
        "a.png" => Ok(vec![0x89, b'P', b'N', b'G', 0, 0, 0]),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    match obj::read("a.obj", file, fetch) {
        Ok(mut imported) => {
            demo::add_camera_and_lights(&mut imported.scene);
            assert!(imported.triangles > 0 && imported.scene.cameras.len() == 1);
        }
        Err(error) => assert!(error.to_string().contains("a.obj")),
    }
}

fn changed_files_never_panic() {
    let mut runner = TestRunner::new(Config { cases: 800, failure_persistence: None, ..Config::default() });
    let result = runner.run(&(changes(), changes()), |(of_file, of_library)| {
        read(&change(FILE, &of_file), LIBRARY.as_bytes());
        read(FILE.as_bytes(), &change(LIBRARY, &of_library));
        Ok(())
    });
    result.unwrap();
}

fn arbitrary_bytes_never_panic() {
    let mut runner = TestRunner::new(Config { cases: 400, failure_persistence: None, ..Config::default() });
    let snippets = proptest::collection::vec((0..SNIPPETS.len()).prop_map(|snippet| SNIPPETS[snippet]), 0..30);
    let bytes = proptest::collection::vec(any::<u8>(), 0..200);
    let result = runner.run(&(snippets, bytes), |(snippets, bytes)| {
        read(snippets.concat().as_bytes(), &bytes);
        read(&bytes, snippets.concat().as_bytes());
        Ok(())
    });
    result.unwrap();
}
