//! Culling the triangles of meshes that request it.

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::quality::{Quality, TransformPrecision};
use drawloom::raster::CulledTriangles;
use drawloom::scene::{Changes, Mesh, Projection, Scene, SceneRef, Topology};
use drawloom::task::Scheduler;
use drawloom::view::RenderView;
use drawloom::{FrameStatistics, Granularity, Renderer};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::{as_list, cube, culled, field, square, with_meshes};

use crate::renderer;

/// A frame's statistics, and the renderer with its draw lists.
fn frame(scene: &Scene, workers: usize, granularity: Granularity) -> (FrameStatistics, Renderer<NullBackend>) {
    let (mut renderer, submitter) = renderer(workers, granularity);
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let submitted = submitter.submit(recorded).unwrap();
    let culled: usize = submitted.statistics.views.iter().map(|view| view.culled_triangles.culled()).sum();
    let (mut drawn, mut all) = (0, 0);
    for pass in &submitted.submission.passes {
        drawn += pass.triangles;
        let list = renderer.draw_list(&pass.process, pass.view);
        all += list.map_or(0, |list| {
            list.batches.iter().map(|batch| batch.count as usize * triangles_of(scene, batch.mesh)).sum()
        });
    }
    assert_eq!(drawn, all - culled, "all other triangles are drawn");
    (submitted.statistics, renderer)
}

fn triangles_of(scene: &Scene, slot: u32) -> usize {
    let mut meshes = scene.assets().iter::<drawloom::scene::Mesh>();
    meshes.find(|(handle, _)| handle.index() == slot).unwrap().1.triangle_count()
}

#[test]
fn remaining_triangles_match_the_views_culling_of_each_object() {
    let scene = with_meshes(field(400), culled);
    for (workers, granularity) in
        [(1, Granularity::Adaptive), (2, Granularity::Chunk(7)), (3, Granularity::PerDraw), (2, Granularity::PerCamera)]
    {
        let (statistics, renderer) = frame(&scene, workers, granularity);
        for (index, camera) in scene.cameras.iter().enumerate() {
            let view = RenderView::new(camera);
            let mut expected = CulledTriangles::default();
            for process in ["geometry buffer", "transparency"] {
                let list = renderer.draw_list(process, index).unwrap();
                for (index, batch) in list.batches.iter().enumerate() {
                    assert_eq!(batch.count, 1, "each object is a batch of its own");
                    let mut kept = Vec::new();
                    let object = list.objects[batch.first as usize] as usize;
                    expected += view.cull_triangles(&scene.as_scene_ref(), object, &mut kept);
                    let all = triangles_of(&scene, batch.mesh) * 3;
                    match list.remaining(index) {
                        Some(remaining) => {
                            let remaining = remaining.start as usize..remaining.end as usize;
                            assert_eq!(list.remaining_indices()[remaining], kept[..]);
                            assert!(kept.len() < all);
                        }
                        None => assert_eq!(kept.len(), all, "drawn whole"),
                    }
                }
            }
            assert_eq!(statistics.views[index].culled_triangles, expected);
            assert!(expected.back_facing > 0 && expected.triangles > expected.culled());
        }
    }
}

#[test]
fn meshes_that_do_not_request_it_are_not_culled() {
    let (statistics, renderer) = frame(&field(400), 2, Granularity::Adaptive);
    assert!(statistics.views.iter().all(|view| view.culled_triangles == CulledTriangles::default()));
    assert!(!renderer.stage_graph_to_dot().unwrap().contains("triangles"));
    // No object has this one.
    let mut unused = field(400);
    unused.add(culled(&cube())).unwrap();
    let (_, mut renderer) = frame(&unused, 2, Granularity::Adaptive);
    assert!(!renderer.stage_graph_to_dot().unwrap().contains("triangles"));
    let added = unused.assets().iter::<Mesh>().find(|(_, mesh)| mesh.culls_triangles()).unwrap().0;
    let mut meshes = unused.as_scene_ref().meshes.to_vec();
    meshes[3] = added;
    let changes = Changes::Objects(&[3]);
    drop(renderer.record(SceneRef { meshes: &meshes, changes, ..unused.as_scene_ref() }).unwrap());
    assert!(renderer.stage_graph_to_dot().unwrap().contains("triangles"));

    let some = with_meshes(field(400), |mesh| if mesh.name() == "cube" { culled(mesh) } else { mesh.clone() });
    let (statistics, renderer) = frame(&some, 2, Granularity::Adaptive);
    let list = renderer.draw_list("geometry buffer", 0).unwrap();
    let merged = list.batches.iter().enumerate().filter(|(index, _)| list.remaining(*index).is_none());
    assert!(merged.clone().count() > 0 && merged.clone().any(|(_, batch)| batch.count > 1));
    assert!(statistics.views[0].culled_triangles.back_facing > 0 && statistics.views[0].batches > list.batches.len());
}

#[test]
fn the_request_may_change_between_frames() {
    let (mut renderer, submitter) = renderer(2, Granularity::Adaptive);
    let mut scene = field(200);
    let mut culled_in = |scene: &Scene| {
        let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        submitted.statistics.views.iter().map(|view| view.culled_triangles.culled()).sum::<usize>()
    };
    assert_eq!(culled_in(&scene), 0);
    for _ in 0..2 {
        scene = with_meshes(scene, culled);
        let first = culled_in(&scene);
        assert!(first > 0);
        assert_eq!(culled_in(&scene), first);
        scene = with_meshes(scene, as_list);
        assert_eq!(culled_in(&scene), 0);
    }
}

#[test]
fn absolute_transforms_and_paraboloids_cull_no_triangles() {
    let scene = with_meshes(everything(), culled);
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let absolute = Quality { transforms: TransformPrecision::Absolute, ..Quality::balanced() };
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(absolute);
    let (mut renderer, _) = builder.build(scheduler).unwrap();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    assert!(recorded.statistics().views.iter().all(|view| view.culled_triangles.triangles == 0));

    let (statistics, _) = frame(&scene, 2, Granularity::Adaptive);
    let culled =
        |name: &str| statistics.views.iter().find(|view| view.name.contains(name)).unwrap().culled_triangles.culled();
    assert!(culled("main") > 0);
    let paraboloid = scene
        .lights
        .iter()
        .position(|light| matches!(light, drawloom::scene::Light::Hemispherical { casts_shadow: true, .. }));
    assert_eq!(culled(&format!("shadow of light {}", paraboloid.unwrap())), 0);
    assert!(scene.cameras.iter().all(|camera| camera.projection != Projection::Paraboloid));
}

#[test]
fn a_culled_strip_becomes_an_equivalent_list() {
    let strip = square(Topology::TriangleStrip);
    let requesting = culled(&strip);
    assert!(requesting.culls_triangles() && !strip.culls_triangles());
    assert_eq!((requesting.topology(), requesting.triangle_count()), (Topology::TriangleList, strip.triangle_count()));
    assert!(requesting.triangles().eq(strip.triangles()));
}
