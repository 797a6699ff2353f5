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
    let changed = SceneRef { changes: Changes::Objects(&[3, 300, 310, 602]), ..scene.as_scene_ref() };
    table.begin_frame(&changed);
    table.describe(&changed, 0..table.changed_word_count());
    table.finish();
    table.end_frame();
    assert_eq!(runs(&table, before, 1), [(0, 8), (296, 312), (600, 603)]);
    assert_eq!(runs(&table, before, 288), [(0, 8), (296, 312), (600, 603)]);
    assert_eq!(runs(&table, before, 289), [(0, 603)]);
    assert_eq!(runs(&table, 0, 1), [(0, 603)]);
    assert_eq!(runs(&table, table.epoch(), 1), []);
}
