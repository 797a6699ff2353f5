//! Which objects a backend has to upload.

use drawloom::scene::{Changes, SceneRef};
use drawloom::view::ObjectTable;
use drawloom_testing::scenes::field;

/// The first object of each run, and the one after its last.
fn runs(table: &ObjectTable, epoch: u64, gap: usize) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    table.for_each_change(0..table.block_count(), epoch, gap, |run| runs.push((run.start, run.end)));
    runs
}

#[test]
fn neighbours_that_changed_are_one_run() {
    let scene = field(603);
    let mut table = ObjectTable::default();
    table.update(&scene.as_scene_ref());
    assert_eq!(runs(&table, 0, 1), [(0, 603)]);

    let before = table.epoch();
    draw(&mut table, &SceneRef { changes: Changes::Objects(&[3, 300, 301, 310, 602]), ..scene.as_scene_ref() });
    assert_eq!(runs(&table, before, 1), [(3, 4), (300, 302), (310, 311), (602, 603)], "one by one");
    assert_eq!(runs(&table, before, 291), [(3, 4), (300, 311), (602, 603)]);
    assert_eq!(runs(&table, before, 297), [(3, 603)]);
    assert_eq!(runs(&table, 0, 1), [(0, 603)]);
    assert_eq!(runs(&table, table.epoch(), 1), []);

    draw(&mut table, &SceneRef { changes: Changes::Objects(&[20]), ..scene.as_scene_ref() });
    assert_eq!(runs(&table, before, 1), [(0, 8), (16, 24), (296, 312), (600, 603)], "whole packets");
    assert_eq!(runs(&table, before, 288), [(0, 312), (600, 603)]);
    assert_eq!(runs(&table, before, 289), [(0, 603)]);
    assert_eq!(runs(&table, before + 1, 1), [(20, 21)]);
    let mut second_block = Vec::new();
    table.for_each_change(1..2, before, 1, |run| second_block.push(run));
    assert_eq!(second_block.first(), Some(&(296..312)));
    assert_eq!(second_block.len(), 1);

    draw(&mut table, &SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() });
    assert_eq!(runs(&table, before + 1, 1), [(16, 24)], "changes of an earlier frame");
}

#[test]
fn what_changed_before_a_frame_without_changes_is_not_lost() {
    let scene = field(603);
    let mut table = ObjectTable::default();
    table.update(&scene.as_scene_ref());
    draw(&mut table, &SceneRef { changes: Changes::NONE, ..scene.as_scene_ref() });
    assert_eq!(runs(&table, 0, 1), [(0, 603)]);
}

/// Describes what changed in a frame.
fn draw(table: &mut ObjectTable, scene: &SceneRef<'_>) {
    table.begin_frame(scene);
    table.describe(scene, 0..table.changed_block_count());
    table.finish();
    table.end_frame();
}
