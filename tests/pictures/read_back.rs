//! Parts of targets, read back without waiting.

use std::time::{Duration, Instant};

use drawloom::backend::BackendError;
use drawloom::command::Selection;
use drawloom::glam::DVec3;
use drawloom::process::{ClearColor, CommandDraws, Declare, Deferred, Draws, Format, RenderProcess};
use drawloom::scene::{Blend, Camera, Material, RenderObject, Scene, Topology};
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[
    ("the_object_under_the_cursor_is_read_back", picking),
    ("rectangles_are_those_of_their_frame", of_their_frame),
    ("rectangles_outside_and_frames_that_are_dropped_are_refused", refused),
];

/// The index of the nearest object of each pixel, and 99 where there is none.
struct ObjectIndex;

impl RenderProcess for ObjectIndex {
    fn name(&self) -> &str {
        "object index"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("object index", Format::R32Uint, ClearColor::Value([99.0, 0.0, 0.0, 0.0]));
        declare.clears_depth("depth of object index", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            struct Corner {
                @builtin(position) position: vec4<f32>,
                @location(0) @interpolate(flat) object: u32,
            }

            @vertex
            fn vertex(in: VertexInput) -> Corner {
                let object = drawn_object(in.instance);
                return Corner(clip_position(relative_position(object, in.position)), object.index);
            }

            @fragment
            fn fragment(in: Corner) -> @location(0) u32 {
                return in.object;
            }
        ";
        Draws::Commands(CommandDraws { shader, selection: Selection::ALL, ..CommandDraws::default() })
    }
}

/// Squares from left to right: object 1 before object 0, nothing, and a blended one.
fn squares() -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO), [96, 32])];
    let mesh = scene.add(square(Topology::TriangleList))?;
    let [opaque, blended] =
        [Blend::None, Blend::Alpha].map(|blend| Material { blend, opacity: 0.5, ..Material::default() });
    let (opaque, blended) = (scene.add(opaque)?, scene.add(blended)?);
    for (position, material) in
        [(DVec3::X * -4.0, opaque), (DVec3::new(-4.0, 0.0, 0.5), opaque), (DVec3::X * 4.0, blended)]
    {
        scene.add_object(RenderObject::new(mesh, material, position))?;
    }
    Ok(scene)
}

fn picking() -> Result<(), Failed> {
    let mut fixture = Fixture::with(2, |builder| {
        builder.pipeline(Deferred::to_picture()).process(ObjectIndex).output("object index")
    })?;
    let scene = squares()?;
    for (cursor, expected) in [([26, 16], 1_u32), ([48, 16], 99), ([70, 16], 2), ([95, 31], 99)] {
        let mut recorded = fixture.record(&scene)?;
        let under_cursor = recorded.read_back(0, "object index", cursor, [1, 1])?;
        if under_cursor.try_read()?.is_some() {
            return Err("read before the frame was submitted".into());
        }
        fixture.submit(recorded)?;
        // As an engine does, which asks once a frame.
        let deadline = Instant::now() + Duration::from_secs(20);
        let pixel = loop {
            match under_cursor.try_read()? {
                Some(pixel) => break pixel,
                None if Instant::now() > deadline => return Err("the pixel never came".into()),
                None => std::thread::yield_now(),
            }
        };
        let found = u32::from_le_bytes(pixel.bytes[..4].try_into()?);
        if found != expected || under_cursor.read()? != pixel {
            return Err(format!("object {found} at {cursor:?} instead of {expected}").into());
        }
    }
    Ok(())
}

fn of_their_frame() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let mut scene = squares()?;
    scene.cameras.push(Camera { name: "second".to_owned(), ..scene.cameras[0].clone() });
    let mut kept = Vec::new();
    for frame in 0..4 {
        scene.background = drawloom::glam::Vec3::splat(frame as f32 * 0.2);
        let mut recorded = fixture.record(&scene)?;
        let rectangles = [([0, 0], [96, 32]), ([3, 5], [70, 20]), ([95, 31], [1, 1])];
        let read_backs = rectangles.map(|(origin, size)| recorded.read_back(1, "picture", origin, size));
        let whole = fixture.submit(recorded)?.read(1, "picture")?;
        kept.push((whole, rectangles, read_backs));
    }
    // Later frames have been drawn into the same target since.
    for (whole, rectangles, read_backs) in kept {
        for (([x, y], [width, height]), read_back) in rectangles.into_iter().zip(read_backs) {
            let rows = (y..y + height).map(|row| (row * whole.width + x) as usize * 4);
            let expected: Vec<u8> =
                rows.flat_map(|start| whole.bytes[start..start + width as usize * 4].to_vec()).collect();
            let found = read_back?.read()?;
            if found.bytes != expected || [found.width, found.height] != [width, height] {
                return Err(format!("the rectangle of {width}x{height} at {x}, {y} is another frame's").into());
            }
        }
    }
    Ok(())
}

fn refused() -> Result<(), Failed> {
    let mut fixture = Fixture::new()?;
    let scene = squares()?;
    let mut recorded = fixture.record(&scene)?;
    let outside = [
        ("picture", [0, 0], [97, 32]),
        ("picture", [96, 0], [1, 1]),
        ("picture", [0, 0], [0, 1]),
        ("picture", [u32::MAX, 0], [2, 1]),
        ("depth", [0, 0], [1, 1]),
    ];
    for (target, origin, size) in outside {
        match recorded.read_back(0, target, origin, size) {
            Err(BackendError::InvalidReadBack { whole: [96, 32], .. }) => {}
            Err(error) => return Err(format!("{target} {origin:?} {size:?}: {error}").into()),
            Ok(_) => return Err(format!("{target} {origin:?} {size:?} is not refused").into()),
        }
    }
    for (view, target) in [(0, "unknown"), (7, "picture")] {
        if !matches!(recorded.read_back(view, target, [0, 0], [1, 1]), Err(BackendError::UnknownTarget { .. })) {
            return Err(format!("{target} of view {view} is not refused").into());
        }
    }
    let depth = recorded.read_back(0, "depth", [0, 0], [96, 32])?;
    fixture.submit(recorded)?;
    depth.read()?;

    let mut dropped = fixture.record(&scene)?;
    let never = dropped.read_back(0, "picture", [0, 0], [1, 1])?;
    if !matches!(never.read(), Err(BackendError::NotSubmitted)) {
        return Err("a frame that is not submitted was read".into());
    }
    drop(dropped);
    match (never.try_read(), never.read()) {
        (Err(BackendError::NotSubmitted), Err(BackendError::NotSubmitted)) => Ok(()),
        other => Err(format!("a dropped frame: {other:?}").into()),
    }
}
