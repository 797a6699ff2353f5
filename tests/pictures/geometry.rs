//! The geometry buffer gives the same picture however it is drawn and stored.

use drawloom::backend::Picture;
use drawloom::process::{Deferred, Format, GeometryFormats};
use drawloom::scene::{Projection, Scene};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::image_distance::{Distance, as_image};
use crate::references::small_colonnade;

pub const CASES: &[Case] = &[
    ("a_depth_pre_pass_changes_no_byte", depth_pre_pass),
    ("shares_of_the_materials_change_no_byte", shares),
    ("shares_are_recorded_as_processes_of_their_own", shares_are_processes),
    ("normals_diffuse_and_radiance_can_have_other_formats", formats),
    ("formats_that_lack_channels_are_refused_by_name", unsuitable),
];

/// Scenes with mirrored objects and strips, perspective and orthographic, and one with pairs of objects at one
/// position.
fn scenes() -> Result<Vec<(&'static str, Scene)>, Failed> {
    let mut boxes = field(400);
    for camera in &mut boxes.cameras {
        camera.size = [96, 54];
    }
    let mut flat = field(400);
    for camera in &mut flat.cameras {
        camera.size = [96, 54];
        (camera.projection, camera.far) = (Projection::Orthographic { height: 20.0 }, 100.0);
    }
    let mut twice = everything();
    twice.duplicate_objects(2);
    Ok(vec![
        ("colonnade", small_colonnade()?),
        ("field", boxes),
        ("field without perspective", flat),
        ("everything twice", twice),
    ])
}

/// Without shadow maps, which do not use the geometry buffer.
fn deferred() -> Deferred {
    Deferred::to_picture().shadow_maps(None)
}

fn drawn(deferred: Deferred, scene: &Scene) -> Result<Vec<Picture>, Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred))?;
    let recorded = fixture.record(scene)?;
    let submission = fixture.submit(recorded)?;
    let targets = ["picture", "depth", "normal", "diffuse"];
    let views = 0..scene.cameras.len();
    views.flat_map(|view| targets.map(|target| Ok(submission.read(view, target)?))).collect()
}

/// Fails if one of these pipelines draws another picture of any scene than the default one.
fn expect_same(others: &[Deferred]) -> Result<(), Failed> {
    for (name, scene) in scenes()? {
        let expected = drawn(deferred(), &scene)?;
        for (index, other) in others.iter().enumerate() {
            if drawn(other.clone(), &scene)? != expected {
                return Err(format!("{name} differs with pipeline {index}").into());
            }
        }
    }
    Ok(())
}

fn depth_pre_pass() -> Result<(), Failed> {
    expect_same(&[deferred().depth_pre_pass(true)])
}

fn shares() -> Result<(), Failed> {
    let mut others: Vec<_> = [1, 2, 7].into_iter().map(|shares| deferred().geometry_shares(shares)).collect();
    others.push(deferred().geometry_shares(3).depth_pre_pass(true));
    expect_same(&others)
}

fn shares_are_processes() -> Result<(), Failed> {
    let scene = small_colonnade()?;
    let mut whole = Fixture::with(2, |builder| builder.pipeline(deferred()))?;
    let recorded = whole.record(&scene)?;
    let passes = recorded.queues()[0].passes.len();
    drop(recorded);
    let drawn_by = |fixture: &Fixture, process: &str| -> Result<Vec<u32>, Failed> {
        Ok(fixture.renderer.draw_list(process, 0).ok_or("it draws no commands")?.objects.clone())
    };
    let mut all = drawn_by(&whole, "geometry buffer")?;
    all.sort_unstable();
    for shares in [2, 3, 7] {
        let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred().geometry_shares(shares)))?;
        let recorded = fixture.record(&scene)?;
        if recorded.queues()[0].passes.len() != passes + shares as usize - 1 {
            return Err(format!("{shares} shares: {} passes", recorded.queues()[0].passes.len()).into());
        }
        drop(recorded);
        let mut together = Vec::new();
        for share in 1..=shares {
            let drawn = drawn_by(&fixture, &format!("geometry buffer {share} of {shares}"))?;
            if drawn.is_empty() {
                return Err(format!("share {share} of {shares} draws nothing").into());
            }
            together.extend(drawn);
        }
        together.sort_unstable();
        if together != all {
            return Err(format!("{shares} shares draw other objects than one").into());
        }
    }
    Ok(())
}

/// The allowed distance from the default's picture: the root mean square error over the picture, and in the worst tile.
type Bound = (GeometryFormats, f64, f64);

fn formats() -> Result<(), Failed> {
    let usual = GeometryFormats::default();
    let bounds: [Bound; 7] = [
        (GeometryFormats { normal: Format::Rgba16Float, ..usual }, 0.0, 0.0),
        (GeometryFormats { normal: Format::Rgba8Unorm, ..usual }, 0.003, 0.01),
        (GeometryFormats { normal: Format::Rgba8Srgb, ..usual }, 0.004, 0.015),
        (GeometryFormats { diffuse: Format::Rgba8Unorm, ..usual }, 0.003, 0.005),
        (GeometryFormats { diffuse: Format::Rgba16Float, ..usual }, 0.003, 0.005),
        // Every added light rounds to a byte once more.
        (GeometryFormats { radiance: Format::Rgba8Unorm, ..usual }, 0.012, 0.02),
        (GeometryFormats { radiance: Format::Rgba8Srgb, ..usual }, 0.012, 0.02),
    ];
    for (name, scene) in [("everything", everything()), ("colonnade", small_colonnade()?)] {
        let picture = |formats| as_image(&drawn(deferred().formats(formats), &scene)?[0]);
        let expected = picture(usual)?;
        for (formats, root_mean_square, worst_tile) in bounds {
            let distance = Distance::between(&picture(formats)?, &expected)?;
            if distance.root_mean_square > root_mean_square || distance.worst_tile > worst_tile {
                return Err(format!("{name}, {formats:?}: {distance:?}").into());
            }
        }
    }
    Ok(())
}

fn unsuitable() -> Result<(), Failed> {
    let usual = GeometryFormats::default();
    let with = |target, format| match target {
        "normal" => GeometryFormats { normal: format, ..usual },
        "diffuse" => GeometryFormats { diffuse: format, ..usual },
        "depth" => GeometryFormats { depth: format, ..usual },
        _ => GeometryFormats { radiance: format, ..usual },
    };
    for (target, unsuitable) in [
        ("normal", &[Format::R32Float, Format::Depth32Float][..]),
        ("diffuse", &[Format::R32Float, Format::Rg16Float, Format::Depth32Float]),
        ("radiance", &[Format::R32Float, Format::Rg16Float, Format::Rgba32Float, Format::Depth32Float]),
        ("depth", &[Format::R32Float, Format::Stencil8]),
    ] {
        for &format in unsuitable {
            let deferred = Deferred::to_picture().formats(with(target, format));
            let error = Fixture::with(1, |builder| builder.pipeline(deferred)).err().ok_or("it should be refused")?;
            let text = error.message().unwrap_or_default();
            for part in ["geometry buffer", target, &format!("{format:?}")] {
                if !text.contains(part) {
                    return Err(format!("{text:?} should name {part:?}").into());
                }
            }
        }
    }
    Ok(())
}
