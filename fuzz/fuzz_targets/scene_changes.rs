//! Changes between frames: after any of them, reported in any way, a renderer draws what a new renderer draws.

#![no_main]

use std::sync::{Arc, LazyLock};

use arbitrary::Arbitrary;
use drawloom::scene::{Changes, SceneRef};
use drawloom::task::Scheduler;
use drawloom_fuzz::scenes::{AnyScene, Change, Drawer, World, quality};
use libfuzzer_sys::fuzz_target;

const MAX_FRAMES: usize = 6;
const MAX_CHANGES: usize = 6;

#[derive(Arbitrary, Debug)]
struct Input {
    scene: AnyScene,
    quality: u8,
    frames: Vec<Step>,
}

/// A frame: what changed since the one before, and how that is reported.
#[derive(Arbitrary, Debug)]
struct Step {
    changes: Vec<Change>,
    report: Report,
    /// Draws with another quality from this frame on.
    quality: Option<u8>,
    outcome: Outcome,
    /// Compares the pictures with those of a new renderer.
    is_compared: bool,
}

#[derive(Arbitrary, Debug)]
enum Report {
    Unknown,
    /// The objects that changed, some of them twice.
    Objects {
        repeated: u8,
    },
    /// Ranges around them.
    Ranges {
        margin: u8,
    },
}

#[derive(Arbitrary, Debug, PartialEq)]
enum Outcome {
    Drawn,
    /// All is well, which most frames are.
    AlsoDrawn,
    /// Recorded, and never submitted.
    Dropped,
    /// Refused, for it has no camera.
    Failed,
}

static SCHEDULERS: LazyLock<[Arc<Scheduler>; 2]> =
    LazyLock::new(|| [1, 2].map(|workers| Arc::new(Scheduler::new(workers).unwrap())));

fuzz_target!(|input: Input| {
    let mut world = World::new(&input.scene);
    let mut choice = input.quality;
    let [one, two] = &*SCHEDULERS;
    let mut kept = Drawer::with_quality(two, quality(choice));
    // The scene as it is may be one that cannot be drawn.
    let _ = kept.draw(world.as_scene_ref());
    let count = input.frames.len().min(MAX_FRAMES);
    for (index, step) in input.frames[..count].iter().enumerate() {
        world.begin_changes();
        step.changes.iter().take(MAX_CHANGES).for_each(|change| world.apply(change));
        if let Some(new) = step.quality {
            choice = new;
            kept.renderer.set_quality(quality(choice)).unwrap();
        }
        let changed = world.changed();
        let objects: Vec<_> = changed.iter().chain(changed.iter().take(repeated(&step.report))).copied().collect();
        let margin = if let Report::Ranges { margin } = step.report { u32::from(margin) } else { 0 };
        let ranges: Vec<_> = changed.iter().map(|&object| object.saturating_sub(margin)..object + margin + 1).collect();
        let changes = match step.report {
            Report::Unknown => Changes::Unknown,
            Report::Objects { .. } => Changes::Objects(&objects),
            Report::Ranges { .. } => Changes::Ranges(&ranges),
        };
        let scene = SceneRef { changes, ..world.as_scene_ref() };
        match step.outcome {
            Outcome::Failed => assert!(kept.renderer.record(SceneRef { cameras: &[], ..scene }).is_err()),
            Outcome::Dropped => drop(kept.renderer.record(scene)),
            Outcome::Drawn | Outcome::AlsoDrawn if step.is_compared => {
                // Static groups change the order of what lies at the same depth.
                let scene = SceneRef { static_groups: &[], ..scene };
                let found = kept.draw(scene).map(|frame| frame.pictures());
                let mut new = Drawer::with_quality(one, quality(choice));
                let expected = new.draw(SceneRef { changes: Changes::Unknown, ..scene }).map(|frame| frame.pictures());
                assert!(found == expected, "frame {index}: {:?} and {:?}", found.err(), expected.err());
            }
            Outcome::Drawn | Outcome::AlsoDrawn => {
                // As above.
                let _ = kept.draw(scene);
            }
        }
    }
});

fn repeated(report: &Report) -> usize {
    if let Report::Objects { repeated } = report { usize::from(*repeated) } else { 0 }
}
