//! Pictures have the same bytes for every number of workers and every granularity.

use drawloom::backend::WgpuBackend;
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Blend, Material, Scene};
use drawloom::{Granularity, RendererBuilder};
use drawloom_testing::obj_files::{hall, interior};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;
use crate::references::{colonnade, cornell, generated, small, sponza};

pub const CASES: &[Case] = &[
    ("same_bytes_of_the_projects_own_scene", || same_for_all(&colonnade()?)),
    ("same_bytes_of_a_field_of_boxes", || same_for_all(&field(1500))),
    ("same_bytes_of_an_interior", || same_for_all(&small(generated(&interior())?))),
    ("same_bytes_of_a_hall", || same_for_all(&small(generated(&hall())?))),
    ("same_bytes_of_coincident_copies", || {
        let mut scene = opaque(colonnade()?)?;
        scene.cameras[0].size = [160, 90];
        let draw = |scene: &Scene| Fixture::with(2, with_coarse_edges)?.draw(scene);
        let once = draw(&scene)?;
        scene.duplicate_objects(3);
        if draw(&scene)? != once {
            return Err("copies at the same position change the picture".into());
        }
        same_for_all(&scene)
    }),
];

pub const CASES_OF_SHARED_SCENES: &[Case] =
    &[("same_bytes_of_cornell", || same_for_all(&cornell()?)), ("same_bytes_of_sponza", || same_for_all(&sponza()?))];

/// The scene without blending: two panes of glass at the same position would be darker than one.
fn opaque(mut scene: Scene) -> Result<Scene, Failed> {
    let materials: Vec<_> =
        scene.assets().iter::<Material>().map(|(handle, material)| (handle, material.clone())).collect();
    for (handle, material) in materials {
        scene.replace(handle, Material { blend: Blend::None, ..material })?;
    }
    Ok(scene)
}

/// The deferred pipeline, with long edges in the shadow maps of lamps: subdivided meshes take as many draws, but
/// seconds less time for each renderer.
fn with_coarse_edges(builder: RendererBuilder<WgpuBackend>) -> RendererBuilder<WgpuBackend> {
    let balanced = Quality::balanced();
    let quality = Quality { shadows: ShadowQuality { widest_edge: 20.0, ..balanced.shadows }, ..balanced };
    builder.pipeline(Deferred::to_picture()).quality(quality)
}

/// Numbers of workers, with ways to split a pass.
const RUNS: [(usize, Granularity); 7] = [
    (1, Granularity::PerCamera),
    (1, Granularity::Chunk(5)),
    (2, Granularity::PerCamera),
    (2, Granularity::PerDraw),
    (2, Granularity::Chunk(256)),
    (4, Granularity::PerDraw),
    (4, Granularity::Chunk(5)),
];

fn same_for_all(scene: &Scene) -> Result<(), Failed> {
    let mut first = None;
    for (workers, granularity) in RUNS {
        let mut fixture = Fixture::with(workers, |builder| with_coarse_edges(builder).granularity(granularity))?;
        let picture = fixture.draw(scene)?;
        let processes = ["shadow casters", "geometry buffer", "transparency"];
        let views = 0..scene.cameras.len() + scene.lights.iter().filter(|light| light.casts_shadow()).count();
        let list = |process, view| fixture.renderer.draw_list(process, view).map(|list| list.clone());
        let lists: Vec<_> = views.map(|view| processes.map(|process| list(process, view))).collect();
        let (first_picture, first_lists) = first.get_or_insert_with(|| (picture.clone(), lists.clone()));
        if *first_lists != lists {
            return Err(format!("commands or batches differ with {workers} workers, {granularity:?}").into());
        }
        if *first_picture != picture {
            return Err(format!("pictures differ with {workers} workers, {granularity:?}").into());
        }
    }
    Ok(())
}
