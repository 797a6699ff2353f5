//! Random valid files are drawn whole, and random changes of them never panic, hang, or take more than the limits.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use drawloom_gltf::{GltfLimits, LoadOptions};
use fastrand::Rng;
use libtest_mimic::Failed;
use serde_json::Value;

use crate::fixture::{AT_REST, expect, folder, load_memory};
use crate::generate::builder::Builder;
use crate::generate::grammar::random_file;
use crate::generate::mutations::mutated;
use crate::invariants::{SMALL_LIMITS, check_error, check_world};

pub const CASES: &[crate::Case] =
    &[("random_valid_files_are_drawn_whole", valid), ("random_changes_of_files_are_drawn_or_refused_by_name", changed)];

const FILES: u64 = 200;
const CHANGES: u64 = 4000;

/// What valid files have beyond what is drawn.
const LEFT_OUT: [&str; 9] = [
    "has the mode Points, not triangles",
    "has the mode Lines, not triangles",
    "which are no whole triangles",
    "has no triangles",
    "the extension ACME_unheard_of is ignored",
    "its height is kept",
    "ends at",
    "derived from the picture, not by MikkTSpace",
    "the scene has nothing to draw",
];

fn valid() -> Result<(), Failed> {
    for seed in 0..FILES {
        let builder = random_file(seed);
        for time in [None, Some(0.7), Some(9.0)] {
            let options = LoadOptions { time: time.filter(|_| has_animation(&builder)), ..AT_REST };
            let name = format!("{seed}.glb");
            let world = load_memory(&name, builder.glb(), &options).map_err(|error| format!("seed {seed}: {error}"))?;
            let unexpected = world.warnings.iter().find(|it| !LEFT_OUT.iter().any(|known| it.contains(known)));
            expect(unexpected.is_none(), || format!("seed {seed}: {unexpected:?}"))?;
            expect(world.object_count() == object_count(&builder.json), || {
                format!("seed {seed}: {} objects, not {}", world.object_count(), object_count(&builder.json))
            })?;
            check_world(&world, &GltfLimits::DEFAULT)?;
        }
    }
    Ok(())
}

fn has_animation(builder: &Builder) -> bool {
    builder.json.get("animations").is_some()
}

/// Counts objects: one for each primitive with a triangle of each node's mesh. All nodes are below the root.
fn object_count(json: &Value) -> usize {
    let nodes = json["nodes"].as_array().expect("nodes");
    let of_node = |node: &Value| -> usize {
        let Some(mesh) = node["mesh"].as_u64() else { return 0 };
        let primitives = json["meshes"][mesh as usize]["primitives"].as_array().expect("primitives");
        primitives.iter().filter(|primitive| has_triangle(json, primitive)).count()
    };
    nodes.iter().map(of_node).sum()
}

fn has_triangle(json: &Value, primitive: &Value) -> bool {
    let counted = primitive.get("indices").unwrap_or(&primitive["attributes"]["POSITION"]);
    let count = json["accessors"][counted.as_u64().expect("an index") as usize]["count"].as_u64().expect("a count");
    primitive.get("mode").is_none_or(|mode| mode.as_u64() >= Some(4)) && count >= 3
}

fn changed() -> Result<(), Failed> {
    let (mut loaded, mut refused) = (0, 0);
    for seed in 0..CHANGES {
        let mut rng = Rng::with_seed(seed);
        let bytes = mutated(&random_file(seed % 40), &mut rng);
        let (time, limits) = (rng.bool().then(|| rng.f64() * 3.0), SMALL_LIMITS);
        let options = LoadOptions { time, limits, ..AT_REST };
        let check = || match load_memory("changed.glb", bytes.clone(), &options) {
            Ok(world) => check_world(&world, &limits).map(|()| true),
            Err(error) => check_error(&error, "changed.glb").map(|()| false),
        };
        match catch_unwind(AssertUnwindSafe(check)) {
            Ok(Ok(true)) => loaded += 1,
            Ok(Ok(false)) => refused += 1,
            Ok(Err(failed)) => {
                let path = keep(&bytes)?;
                return Err(format!("seed {seed}: {failed}; see {path}").into());
            }
            Err(_) => return Err(format!("seed {seed}: it panics; see {}", keep(&bytes)?).into()),
        }
    }
    expect(loaded > 1000 && refused > 100, || format!("{loaded} are drawn and {refused} refused: little is tested"))
}

/// Keeps a file that fails, to look at.
fn keep(bytes: &[u8]) -> Result<String, Failed> {
    let path = folder("property").join("changed.glb");
    std::fs::write(&path, bytes)?;
    Ok(Path::display(&path).to_string())
}
