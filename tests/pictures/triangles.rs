//! Leaving out triangles that nobody sees changes no byte, whichever way frames are recorded.

use drawloom::backend::WgpuBackend;
use drawloom::glam::DVec3;
use drawloom::scene::{RenderObject, Scene};
use libtest_mimic::Failed;

use crate::Case;
use crate::references::colonnade;
use crate::scenes::everything::everything;
use crate::scenes::{as_list, culled, field, with_meshes};
use crate::techniques::{device, drawn_anew, pictures, studio_of, technique, techniques};

pub const CASES: &[Case] = &[
    ("culled_triangles_change_no_byte_by_any_technique", any_technique),
    ("culled_triangles_change_no_byte_while_ways_are_measured", measured),
];

const SCENES: [fn() -> Result<Scene, Failed>; 3] = [|| Ok(everything()), || Ok(field(300)), small_colonnade];

fn small_colonnade() -> Result<Scene, Failed> {
    let mut scene = colonnade()?;
    scene.cameras[0].size = [160, 90];
    Ok(scene)
}

/// Moves what looks and something that is looked at: the draws stay the same, the triangles left of them do not.
fn change(scene: &mut Scene) -> Result<(), Failed> {
    for camera in &mut scene.cameras {
        camera.position += DVec3::new(0.7, 0.3, -0.4);
    }
    let first = scene.objects().next().ok_or("there are objects")?;
    let object = scene.object(first)?;
    scene.replace_object(first, RenderObject { position: object.position + DVec3::Y * 0.2, ..object })?;
    Ok(())
}

fn any_technique() -> Result<(), Failed> {
    for scene in SCENES {
        // Of lists only: what a strip's triangles are rounded to is not what a list's are.
        let mut whole = with_meshes(scene()?, as_list);
        let mut expected = Vec::new();
        for _ in 0..FRAMES {
            expected.push(drawn_anew(&whole)?);
            change(&mut whole)?;
        }
        for (record, encode) in techniques()? {
            let (mut studio, mut asking) = (technique(record, encode)?, with_meshes(scene()?, culled));
            for (frame, expected) in expected.iter().enumerate() {
                let recorded = studio.record(&asking)?;
                let culled: usize = recorded.statistics().views.iter().map(|view| view.triangles.culled()).sum();
                if culled == 0 || pictures(&studio, recorded, &asking)? != *expected {
                    return Err(format!("frame {frame} differs with {record:?}, {encode:?}; {culled} culled").into());
                }
                change(&mut asking)?;
            }
        }
    }
    Ok(())
}

const FRAMES: usize = 4;

fn measured() -> Result<(), Failed> {
    let (device, queue) = device()?;
    let mut studio = studio_of(WgpuBackend::new(device, queue)?)?;
    let scene = with_meshes(everything(), as_list);
    let expected = drawn_anew(&scene)?;
    let some = with_meshes(scene, |mesh| if mesh.name() == "cube" { culled(mesh) } else { mesh.clone() });
    for frame in 0..40 {
        let recorded = studio.record(&some)?;
        if pictures(&studio, recorded, &some)? != expected {
            return Err(format!("frame {frame} differs: {:?}", studio.renderer.backend().passes()).into());
        }
    }
    Ok(())
}
