//! Nodes that are declared wrongly, fail or panic. Each error names the node, and the next frame is that of an engine
//! without them.

use drawloom::glam::DVec3;
use drawloom::graph::GraphProblem;
use drawloom::scene::{Changes, NodeColumn, SceneError, SceneRef, WrittenColumns};
use drawloom::{FrameData, FrameError, FrameInputs, NodeAccesses};
use drawloom_testing::scenes::field;

use crate::{TestNode, lent, renderer};

fn idle(name: &str, declare: impl Fn(&mut NodeAccesses) + Send + Sync + 'static) -> TestNode<'static> {
    TestNode::new(name, declare, |_, _| Ok(()))
}

/// The error of a frame with these nodes. Checks that the next frame draws what one without them draws.
fn error_of(nodes: &[TestNode<'_>]) -> FrameError {
    let scene = field(500);
    let mut found = None;
    for workers in [1, 2, 4] {
        let (mut renderer, submitter) = renderer(workers);
        let expected = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        let error = renderer
            .record_with(FrameInputs { nodes: &lent(nodes), ..FrameInputs::new(scene.as_scene_ref()) })
            .map(drop)
            .unwrap_err();
        let next = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        assert_eq!(next.submission.passes, expected.submission.passes);
        assert_eq!(next.statistics.views, expected.statistics.views);
        found = Some(error);
    }
    found.unwrap()
}

fn problem_of(nodes: &[TestNode<'_>]) -> GraphProblem {
    match error_of(nodes) {
        FrameError::Nodes(problem) => problem,
        other => panic!("{other}"),
    }
}

#[test]
fn nodes_that_make_no_graph_are_named() {
    let circle = [
        idle("one", |accesses| _ = accesses.reads("b").writes("a")),
        idle("two", |accesses| _ = accesses.reads("a").writes("b")),
    ];
    assert_eq!(problem_of(&circle), GraphProblem::Cycle { nodes: vec!["one".to_owned(), "two".to_owned()] });
    let unwritten = [idle("one", |accesses| _ = accesses.reads("a"))];
    let error = problem_of(&unwritten).to_string();
    assert_eq!(error, "nothing writes \"a\" before it is read by \"one\"");
    let writers = ["one", "two"].map(|name| idle(name, |accesses| _ = accesses.writes("a")));
    let error = problem_of(&writers).to_string();
    assert!(error.starts_with("\"one\" and \"two\" both write \"a\""), "{error}");
    let writers = ["one", "two"].map(|name| idle(name, |accesses| _ = accesses.writes(FrameData::Transforms)));
    assert!(matches!(problem_of(&writers), GraphProblem::UnorderedWriters { .. }));
    let same = ["one", "one"].map(|name| idle(name, |_| ()));
    assert_eq!(problem_of(&same), GraphProblem::DuplicateNode { name: "one".to_owned() });
}

#[test]
fn a_node_that_is_named_like_a_stage_is_told_so() {
    // Also those that these frames do without, and the names that stages of a view and of a pass have in the graph.
    for stage in [
        "objects",
        "visibility",
        "finish",
        "triangles",
        "cull list",
        "levels",
        "occlusion",
        "bin",
        "record static groups",
        "compact, view 0 \"front\"",
        "geometry buffer, view 0 \"front\", record",
    ] {
        let expected = format!("node {stage:?} has the name of a stage of the frame");
        assert_eq!(error_of(&[idle(stage, |_| ())]).to_string(), expected);
        // Whatever stands beside it.
        assert_eq!(error_of(&[idle("other", |_| ()), idle(stage, |_| ())]).to_string(), expected);
    }
}

#[test]
fn a_node_cannot_come_before_what_it_needs_of_the_stages() {
    let late = idle("late", |accesses| _ = accesses.reads(FrameData::VisibleObjects).writes(FrameData::Transforms));
    let GraphProblem::Cycle { nodes } = problem_of(&[late]) else { panic!("no cycle") };
    assert!(nodes.contains(&"late".to_owned()) && nodes.contains(&"objects".to_owned()), "{nodes:?}");
}

#[test]
fn a_declaration_that_no_node_can_make_is_refused() {
    let refused = |declare: fn(&mut NodeAccesses)| error_of(&[idle("node", declare)]).to_string();
    assert_eq!(
        refused(|accesses| _ = accesses.writes(FrameData::DrawLists)),
        "node \"node\" writes Frame(DrawLists), which only stages write"
    );
    assert_eq!(
        refused(|accesses| _ = accesses.after("nobody")),
        "node \"node\" runs after \"nobody\", which is no node of the frame"
    );
}

#[test]
fn a_node_that_fails_or_panics_is_named() {
    let fails = |item| {
        TestNode::new(
            "sea",
            |_| (),
            move |_, items| if items.contains(&item) { Err("it is dry".into()) } else { Ok(()) },
        )
    };
    for item in [0, 7] {
        match error_of(&[idle("first", |_| ()), fails(item).with_width(9)]) {
            FrameError::Failed { stage, source } => {
                assert_eq!((stage.as_str(), source.to_string().as_str()), ("sea", "it is dry"));
            }
            other => panic!("{other}"),
        }
    }
    let panics = [
        TestNode::new("sea", |_| (), |_, _| panic!("it boils")),
        TestNode::new("sea", |_| panic!("it boils"), |_, _| Ok(())),
    ];
    for node in panics {
        match error_of(&[node]) {
            FrameError::Panicked { stage, message } => {
                assert_eq!((stage.as_str(), message.as_str()), ("sea", "it boils"));
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn what_is_not_declared_is_not_there() {
    let node = TestNode::new(
        "spy",
        |_| (),
        |frame, _| {
            drop(frame.visible_objects(0)?);
            Ok(())
        },
    );
    let error = error_of(&[node]).to_string();
    assert_eq!(error, "spy failed: the node does not declare that it reads Frame(VisibleObjects)");
    let node = TestNode::new(
        "spy",
        |accesses| _ = accesses.reads(FrameData::VisibleObjects),
        |frame, _| {
            drop(frame.draw_list("geometry buffer", 0)?);
            Ok(())
        },
    );
    let error = error_of(&[node]).to_string();
    assert_eq!(error, "spy failed: the node does not declare that it reads Frame(DrawLists)");
}

#[test]
fn a_column_is_not_written_after_it_was_read() {
    let scene = field(300);
    let scene = scene.as_scene_ref();
    let mut positions: Vec<DVec3> = scene.positions.to_vec();
    let column = NodeColumn::new(&mut positions);
    let written = WrittenColumns { positions: Some(&column), ..WrittenColumns::default() };
    let late = TestNode::new(
        "late",
        |accesses| _ = accesses.reads(FrameData::VisibleObjects),
        |_, _| {
            drop(column.write(1)?);
            Ok(())
        },
    );
    let (mut renderer, _submitter) = renderer(2);
    let error = renderer
        .record_with(FrameInputs { nodes: &[&late], ..FrameInputs::new(SceneRef { written, ..scene }) })
        .map(drop)
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("late failed: chunk 1 of the column has been read"), "{error}");
}

/// The error of a frame with this column of positions, of which nodes change the first.
fn error_of_column(objects: usize, changes: Changes<'_>) -> FrameError {
    let scene = field(300);
    let scene = scene.as_scene_ref();
    let (mut renderer, _submitter) = renderer(2);
    drop(renderer.record(scene).unwrap());
    let mut positions: Vec<DVec3> = scene.positions[..objects].to_vec();
    let column = NodeColumn::new(&mut positions);
    let written = WrittenColumns { positions: Some(&column), ..WrittenColumns::default() };
    let node = TestNode::new(
        "move",
        |accesses| _ = accesses.writes(FrameData::Transforms),
        |_, _| {
            column.write(0)?[0] += DVec3::Y;
            Ok(())
        },
    );
    renderer
        .record_with(FrameInputs { nodes: &[&node], ..FrameInputs::new(SceneRef { written, changes, ..scene }) })
        .map(drop)
        .unwrap_err()
}

#[test]
fn a_column_of_another_length_and_a_change_without_a_report_are_named() {
    let error = error_of_column(299, Changes::Unknown);
    assert!(matches!(error, FrameError::Scene(SceneError::UnequalSlices { positions: 299, .. })), "{error}");
    if cfg!(debug_assertions) {
        let error = error_of_column(300, Changes::NONE);
        assert!(matches!(error, FrameError::Scene(SceneError::UnreportedChange { object: 0 })), "{error}");
    }
}
