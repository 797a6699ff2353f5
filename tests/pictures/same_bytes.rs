//! The same bytes for every number of workers and every granularity.

use drawloom::Granularity;
use drawloom::scene::{Blend, Material, Scene};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::references::{colonnade, cornell, sponza};
use crate::studio::Studio;

pub const CASES: &[Case] = &[
    ("same_bytes_of_the_projects_own_scene", || same_for_all(&colonnade()?)),
    ("same_bytes_of_a_field_of_boxes", || same_for_all(&field(1500))),
    ("same_bytes_of_coincident_copies", || {
        let mut scene = opaque(colonnade()?)?;
        let once = Studio::new()?.draw(&scene)?;
        scene.duplicate_objects(3);
        if Studio::new()?.draw(&scene)? != once {
            return Err("copies at the same place change the picture".into());
        }
        same_for_all(&scene)
    }),
];

pub const CASES_OF_SHARED_SCENES: &[Case] =
    &[("same_bytes_of_cornell", || same_for_all(&cornell()?)), ("same_bytes_of_sponza", || same_for_all(&sponza()?))];

/// Without what adds up: glass before glass at the same place is darker.
fn opaque(mut scene: Scene) -> Result<Scene, Failed> {
    let materials: Vec<_> =
        scene.assets().iter::<Material>().map(|(handle, material)| (handle, material.clone())).collect();
    for (handle, material) in materials {
        scene.replace(handle, Material { blend: Blend::None, ..material })?;
    }
    Ok(scene)
}

fn same_for_all(scene: &Scene) -> Result<(), Failed> {
    let mut first = None;
    for workers in [1, 2, 4] {
        for granularity in
            [Granularity::PerCamera, Granularity::PerDraw, Granularity::Chunk(5), Granularity::Chunk(256)]
        {
            let mut studio = Studio::cut(workers, granularity)?;
            let picture = studio.draw(scene)?;
            let processes = ["shadow casters", "geometry buffer", "transparency"];
            let views = 0..scene.cameras.len() + scene.lights.iter().filter(|light| light.casts_shadow()).count();
            let list = |process, view| studio.renderer.draw_list(process, view).map(|list| list.clone());
            let lists: Vec<_> = views.map(|view| processes.map(|process| list(process, view))).collect();
            let (one_picture, one_lists) = first.get_or_insert_with(|| (picture.clone(), lists.clone()));
            if *one_lists != lists {
                return Err(format!("commands or batches differ with {workers} workers, {granularity:?}").into());
            }
            if *one_picture != picture {
                return Err(format!("pictures differ with {workers} workers, {granularity:?}").into());
            }
        }
    }
    Ok(())
}
