//! The report of the example `frame`: it counts what a scene has, and the elements of its file and of its frames that
//! were left out.

#[path = "../examples/frame/arguments.rs"]
#[expect(dead_code, reason = "a report needs few of them")]
mod arguments;
#[path = "../examples/frame/content.rs"]
mod content;
#[path = "../examples/frame/report.rs"]
#[expect(dead_code, reason = "no backend refuses to draw here")]
mod report;

use std::error::Error;
use std::fs;
use std::sync::Arc;
use std::time::Duration;

use arguments::{Arguments, BackendName};
use content::Content;
use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::RenderObject;
use drawloom::task::Scheduler;
use drawloom_testing::demo;
use report::Report;
use serde_json::{Value, json};
use tempfile::TempDir;

#[test]
fn a_report_counts_what_is_drawn_and_by_kind_what_is_left_out() -> Result<(), Box<dyn Error>> {
    let folder = TempDir::new()?;
    let (file, written) = (folder.path().join("a.obj"), folder.path().join("report.json"));
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    // A triangle without area, two unknown statements of one file, and two malformed lines.
    fs::write(&file, format!("{square}f 1 1 2\nF 1 2 3\nfo 1 2 3\nf 1 2 9\nv 0 0 x\n"))?;
    let mut imported = drawloom_obj::load(&file)?;
    let mut content = Content::of_file(&imported);
    demo::add_camera_and_lights(&mut imported.scene);
    let scene = &mut imported.scene;
    let square = scene.objects().next().ok_or("the square is missing")?;
    let square = scene.object(square)?;
    // Farther than positions reach.
    scene.add_object(RenderObject { position: DVec3::X * 1e30, ..square })?;
    content.count(scene);

    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1)?))?;
    let statistics = renderer.record(scene.as_scene_ref())?.statistics().clone();
    let [written_text, file_text] = [&written, &file].map(|path| path.to_str().unwrap());
    let arguments = Arguments::checked(["frame", file_text, "--backend", "null", "--report", written_text])?;
    let measured = [5, 1, 9].map(|milliseconds| (Duration::from_millis(milliseconds), statistics.clone()));
    let report = Report::new("none".to_owned(), BackendName::Null, &arguments, 1, &measured).with_content(content);
    report.write(arguments.report.as_ref().ok_or("no file")?)?;

    let found: Value = serde_json::from_str(&fs::read_to_string(&written)?)?;
    let warnings = json!({ "file with ignored statements": 1, "malformed line": 2 });
    // Both objects have the square, whose triangles share no vertices, as the file has no normals.
    let expected = json!({ "triangles": 4, "vertices": 12, "degenerate_triangles": 1, "warnings": warnings });
    assert_eq!(found["content"], expected);
    let scene_issues = json!([{ "kind": "object too far from the origin", "count": 1, "first": 1 }]);
    assert_eq!(found["scene_issues"], scene_issues);
    assert_eq!((&found["objects"], &found["frames"], &found["cpu_ms"]["median"]), (&json!(2), &json!(3), &json!(5.0)));
    assert_eq!(found["views"][0]["visible"], json!(1));

    let table = report.to_string();
    for line in [
        "objects  2 of 4 triangles and 12 vertices",
        "rejected: 1 × object too far from the origin, the first is number 1",
    ] {
        assert!(table.lines().any(|found| found == line), "{line:?} is not in:\n{table}");
    }
    Ok(())
}
