//! A frame has the same bytes however it is distributed over workers.

use drawloom::backend::SoftwareBackend;
use drawloom::process::{Deferred, ToneMapping};
use drawloom::quality::{CullingVolume, Quality, ShadowQuality, VertexFormat};
use drawloom::scene::{Changes, Mesh, Scene, SceneRef};
use drawloom::{Granularity, RendererBuilder};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::leveled::{coarsest, distance_from_edges, halved, plates, whole};
use drawloom_testing::scenes::{as_list, culled, field, with_meshes};

use crate::{Fixture, deferred};

/// A field in pictures whose sizes are no multiples of a tile.
fn odd_field() -> Scene {
    let mut scene = field(300);
    scene.cameras[0].size = [131, 77];
    scene.cameras[1].size = [65, 64];
    scene
}

#[test]
fn workers_and_granularity_change_nothing() {
    for scene in [odd_field(), everything()] {
        let mut expected = Vec::new();
        let whole = Granularity::PerCamera;
        for (workers, granularity) in [(1, whole), (2, whole), (2, Granularity::Chunk(7)), (4, Granularity::Adaptive)] {
            let submission = Fixture::with_granularity(workers, granularity).draw(&scene);
            let found: Vec<_> = (0..scene.cameras.len())
                .flat_map(|view| ["depth", "normal", "radiance", "picture"].map(|target| (view, target)))
                .map(|(view, target)| submission.read(view, target).unwrap())
                .collect();
            if expected.is_empty() {
                expected = found;
            } else {
                assert!(found == expected, "{workers} workers, {granularity:?}");
            }
        }
    }
}

#[test]
fn a_frame_does_not_depend_on_those_before_it() {
    let (small, mut large) = (odd_field(), everything());
    large.cameras[0].size = [140, 90];
    let expected = [&small, &large].map(|scene| Fixture::with_granularity(2, Granularity::Adaptive).picture(scene));
    let mut fixture = Fixture::with_granularity(2, Granularity::Adaptive);
    for turn in [0, 0, 1, 0, 1, 1] {
        assert!(fixture.picture([&small, &large][turn]) == expected[turn], "{turn}");
    }
}

#[test]
fn a_mesh_is_drawn_in_the_first_frame_in_which_an_object_has_it() {
    let scene = everything();
    let expected = Fixture::with_granularity(2, Granularity::Adaptive).picture(&scene);
    let mut fixture = Fixture::with_granularity(2, Granularity::Adaptive);
    let last = scene.as_scene_ref().meshes;
    let mut meshes = vec![last[0]; last.len()];
    for object in 0..last.len() {
        meshes[object] = last[object];
        let changed = [object as u32];
        let changes = if object == 0 { Changes::Unknown } else { Changes::Objects(&changed) };
        let recorded = fixture.renderer.record(SceneRef { meshes: &meshes, changes, ..scene.as_scene_ref() }).unwrap();
        let picture = fixture.submitter.submit(recorded).unwrap().submission.read(0, "picture").unwrap();
        assert_eq!(picture == expected, meshes == last, "object {object}");
    }
}

#[test]
fn a_recorded_frame_draws_the_scene_as_it_was() {
    let scene = everything();
    let expected = Fixture::with_granularity(2, Granularity::Adaptive).picture(&scene);
    let mut fixture = Fixture::with_granularity(2, Granularity::Adaptive);
    let mut changed = everything();
    let recorded = fixture.renderer.record(changed.as_scene_ref()).unwrap();
    changed.lights.clear();
    let objects: Vec<_> = changed.objects().collect();
    objects.into_iter().for_each(|object| _ = changed.remove_object(object).unwrap());
    drop(changed);
    let submitted = fixture.submitter.submit(recorded).unwrap();
    assert!(submitted.submission.read(0, "picture").unwrap() == expected);
}

#[test]
fn occlusion_culling_changes_nothing() {
    for scene in [odd_field(), everything()] {
        let balanced = Quality::balanced();
        let shadows = ShadowQuality { side: 100, ..balanced.shadows };
        let quality = Quality { culling: CullingVolume::OrientedBox, shadows, ..balanced };
        let draw = |occlusion| {
            let quality = Quality { occlusion, ..quality };
            let maps = |builder: RendererBuilder<SoftwareBackend>| builder.pipeline(deferred()).quality(quality);
            Fixture::new(2, maps).picture(&scene)
        };
        let whole = draw(None);
        for tile_size in Quality::OCCLUSION_TILE_SIZES {
            assert!(draw(Some(tile_size)) == whole, "tiles of {tile_size}");
        }
    }
}

#[test]
fn triangle_culling_changes_nothing() {
    for scene in [odd_field, everything] {
        let list = with_meshes(scene(), as_list);
        let cullable = with_meshes(scene(), culled);
        for mut fixture in [Fixture::with_granularity(2, Granularity::Adaptive), Fixture::reference()] {
            let expected = fixture.picture(&list);
            let recorded = fixture.renderer.record(cullable.as_scene_ref()).unwrap();
            assert!(recorded.statistics().views[0].culled_triangles.culled() > 0);
            let submission = fixture.submitter.submit(recorded).unwrap().submission;
            assert!(submission.read(0, "picture").unwrap() == expected);
        }
    }
}

#[test]
fn levels_of_detail_draw_the_bytes_of_their_triangles() {
    let quality = |level_of_detail| {
        let shadows = ShadowQuality { side: 64, ..ShadowQuality::default() };
        Quality { level_of_detail, shadows, vertices: VertexFormat::Packed, ..Quality::balanced() }
    };
    for is_reference in [false, true] {
        let picture = |scene: &Scene, level_of_detail| {
            let mut fixture =
                if is_reference { Fixture::reference() } else { Fixture::with_granularity(2, Granularity::Adaptive) };
            fixture.renderer.set_quality(quality(level_of_detail)).unwrap();
            fixture.picture(scene)
        };
        for leveled in [halved, |mesh: &Mesh| culled(&halved(&as_list(mesh)))] {
            let scene = with_meshes(everything(), leveled);
            let (full, coarse) =
                (picture(&with_meshes(everything(), |mesh| whole(&leveled(mesh))), 0.0), picture(&scene, 1e9));
            assert!(coarse == picture(&with_meshes(with_meshes(everything(), leveled), coarsest), 0.0));
            assert!(full == picture(&scene, 0.0) && full != coarse);
        }
    }
}

#[test]
fn levels_of_detail_move_silhouettes_by_no_more_than_the_error() {
    let scene = plates();
    let width = scene.cameras[0].size[0] as usize;
    let picture = |level_of_detail: f32| {
        let quality = Quality { level_of_detail, ..Quality::balanced() };
        let deferred = Deferred::new().post(ToneMapping::default());
        let picture = Fixture::new(2, |builder| builder.pipeline(deferred).quality(quality)).picture(&scene);
        picture.bytes.as_chunks::<4>().0.to_vec()
    };
    let full = picture(0.0);
    for pixels in [4.0, 8.0] {
        let coarse = picture(pixels);
        let moved = distance_from_edges(&[&full], width, |pixel| coarse[pixel] != full[pixel]);
        assert!(
            moved >= 0.7 * f64::from(pixels) - 1.0 && moved <= f64::from(pixels) + 0.5,
            "{moved} pixels at {pixels}"
        );
    }
}
