//! Culling the triangles of the project's own scene.

use drawloom::glam::DVec3;
use drawloom::raster::CulledTriangles;
use drawloom::scene::{Camera, Projection, ViewKind};
use drawloom::view::RenderView;
use drawloom_testing::demo;

#[test]
fn most_triangles_of_a_scene_are_culled_at_any_picture_size() {
    let scene = demo::colonnade().unwrap();
    for size in [[960, 540], [1920, 1080], [3840, 2160]] {
        let view = RenderView::new(&Camera { size, ..scene.cameras[0].clone() });
        let scene = scene.as_scene_ref();
        let mut total = CulledTriangles::default();
        for object in 0..scene.object_count() {
            let mut remaining = Vec::new();
            let culled = view.cull_triangles(&scene, object, &mut remaining);
            assert_eq!(remaining.len() / 3 + culled.culled(), culled.triangles);
            total += culled;
        }
        // The larger the picture, the fewer triangles cover no pixel centre.
        let visible = total.triangles - total.off_screen - total.zero_size;
        assert!(
            total.back_facing * 5 > visible * 2 && total.off_screen > 0 && total.zero_size > 0,
            "{size:?} {total:?}"
        );
        assert!(size[0] > 960 || total.share() > 0.7, "{total:?}");
    }
}

#[test]
fn back_facing_triangles_are_culled_in_perspective_and_orthographic_views() {
    let scene = demo::colonnade().unwrap();
    let scene = scene.as_scene_ref();
    let center = scene.positions[0];
    let camera = Camera::looking_at("near", center + DVec3::new(3.0, 40.0, 5.0), center);
    for projection in [camera.projection, Projection::Orthographic { height: 60.0 }, Projection::Paraboloid] {
        let kind = if projection == Projection::Paraboloid { ViewKind::Shadow } else { ViewKind::Main };
        let view = RenderView::new(&Camera { projection, kind, far: 1000.0, ..camera.clone() });
        let mut kept = Vec::new();
        let culled: usize =
            (0..scene.object_count()).map(|object| view.cull_triangles(&scene, object, &mut kept).culled()).sum();
        assert_eq!(culled > 0, projection != Projection::Paraboloid, "{projection:?}");
    }
}
