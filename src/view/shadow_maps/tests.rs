//! Tests of the cameras of shadow maps.

use glam::Vec2;
use proptest::prelude::*;

use super::*;
use crate::view::RenderView;

fn sun() -> Light {
    let direction = Vec3::new(0.3, -0.8, -0.5).normalize();
    Light::Directional { direction, illuminance: Vec3::ONE, casts_shadow: true }
}

proptest! {
    /// All that a main camera sees within the maximum distance is in the map of its cascade that the sun has for that
    /// camera, before its far plane, and so far inside that the filter reads no pixel outside. So is what the camera
    /// sees that draws a tile or is jittered.
    #[test]
    fn a_cascade_covers_what_main_cameras_see_of_its_slice(
        placements in prop::collection::vec((prop::array::uniform3(-1e4..1e4_f64), 1.0..160_f32), 1..3),
        tile in prop_oneof![Just(None), prop::array::uniform2(0..3_u32).prop_map(Some)],
        jitter in prop_oneof![Just(None), prop::array::uniform2(-0.5..0.5_f32).prop_map(Some)],
        pixel in prop::array::uniform2(prop_oneof![-1.0..1.0_f32, Just(-1.0), Just(1.0)]),
        share in 0.0..1.0_f32,
        is_at_an_end in any::<bool>(),
        cascades in 1..=ShadowMaps::MAX_CASCADES,
        split_lambda in 0.0..=1.0_f32,
        filter in 0..=ShadowMaps::MAX_FILTER,
        side in 24..200_u32,
    ) {
        let maps = ShadowMaps { cascades, split_lambda, filter, side, ..ShadowMaps::default() };
        let cameras: Vec<_> = placements
            .into_iter()
            .map(|(position, degrees)| Camera {
                projection: Projection::Perspective { field_of_view: degrees.to_radians() },
                ..Camera::looking_at("main", DVec3::from(position), DVec3::ZERO)
            })
            .map(|camera| tile.map_or(camera.clone(), |tile| camera.tile(tile, 3)))
            .map(|camera| jitter.map_or(camera.clone(), |offset| camera.jittered(offset.into())))
            .collect();
        let of_sun = maps.cameras("sun", &sun(), &cameras);
        prop_assert_eq!(of_sun.len(), cascades as usize * cameras.len());
        let [near, far] = [cameras[0].near.max(maps.max_distance * 1e-3), maps.max_distance].map(f64::from);
        let end = |cascade: u32| {
            let share = f64::from(cascade) / f64::from(cascades);
            let [equal_ratio, equal_depth] = [near * (far / near).powf(share), near + (far - near) * share];
            equal_depth + (equal_ratio - equal_depth) * f64::from(split_lambda)
        };
        let slice = (share * cascades as f32) as u32;
        let [begin, end] = [if slice == 0 { 0.0 } else { end(slice) }, end(slice + 1)];
        let distance = if is_at_an_end { end } else { begin + (end - begin) * f64::from(share) } as f32;
        let outside = if cascades == 1 { 0.0 } else { (2.0 * filter as f32 + 1.0) / side as f32 };
        // The part of a pixel that a jitter shows beyond the edge of the picture.
        let beyond = if jitter.is_some() { 1.0 / cameras[0].size[1] as f32 } else { 0.0 };
        for (camera, of_camera) in cameras.iter().zip(of_sun.chunks(cascades as usize)) {
            let map = RenderView::new(&of_camera[slice as usize]);
            let [right, up, forward] = RenderView::new(camera).picture_axes();
            let seen = (right * pixel[0] + up * pixel[1] + forward) * distance;
            let point = camera.position + seen.as_dvec3() - map.camera.position;
            let clip = map.clip_from_relative() * point.as_vec3().extend(1.0);
            prop_assert!(clip.truncate().truncate().abs().max_element() <= 1.0 - outside + beyond + 1e-4, "{clip}");
            prop_assert!((-1e-4..=1.0 + 1e-4).contains(&clip.z), "{clip}");
        }
    }

    /// What draws a part of a picture, or a jittered one, has the maps of the whole picture.
    #[test]
    fn tiles_and_jittered_cameras_have_the_same_maps(
        position in prop::array::uniform3(-1e6..1e6_f64),
        towards in prop::array::uniform3(-1.0..1.0_f64),
        is_orthographic in any::<bool>(),
        shift in prop_oneof![Just([0.0; 2]), prop::array::uniform2(-2.0..2.0_f32)],
        jitters in prop::array::uniform3(prop::array::uniform2(-0.5..0.5_f32)),
        count in 1..5_u32,
        cascades in 1..=ShadowMaps::MAX_CASCADES,
    ) {
        let position = DVec3::from(position);
        let camera = Camera { far: 100.0, ..Camera::looking_at("main", position, position + DVec3::from(towards)) };
        let camera = match is_orthographic {
            true => Camera { projection: Projection::Orthographic { height: 7.0 }, ..camera },
            false => Camera { shift: shift.into(), ..camera },
        };
        let maps = ShadowMaps { cascades, ..ShadowMaps::default() };
        let tiles = (0..count * count).map(|tile| camera.tile([tile % count, tile / count], count));
        let jittered = jitters.map(|jitter| camera.jittered(jitter.into()));
        let of_tile = jitters.map(|jitter| camera.tile([0, 0], count).jittered(jitter.into()));
        let cameras: Vec<_> = tiles.chain(jittered).chain(of_tile).collect();
        prop_assert_eq!(maps.cameras("sun", &sun(), &cameras).len(), cascades as usize);
        let of_whole = maps.cameras("sun", &sun(), &[camera.jittered(Vec2::ZERO)]);
        prop_assert_eq!(maps.cameras("sun", &sun(), &cameras), of_whole);
        // Without a shift, they are those of the camera itself.
        if is_orthographic || shift == [0.0; 2] {
            prop_assert_eq!(maps.cameras("sun", &sun(), &[camera]), maps.cameras("sun", &sun(), &cameras));
        }
    }
}

#[test]
fn a_map_reaches_from_the_casters_to_the_end_of_its_slice() {
    let main = Camera { near: 1e-5, ..Camera::looking_at("main", DVec3::Y, DVec3::ZERO) };
    let is_near = |found: f32, expected: f64| (f64::from(found) / expected - 1.0).abs() < 1e-6;
    let mut limited = 0;
    for (cascades, split_lambda) in (1..=ShadowMaps::MAX_CASCADES).flat_map(|count| [(count, 0.5), (count, 1.0)]) {
        let maps =
            ShadowMaps { cascades, split_lambda, filter: 3, side: 100, max_distance: 0.01, ..ShadowMaps::default() };
        // A pixel on each side with one cascade, and with more of them 5 of 50 from the centre.
        let margin = if cascades == 1 { 1.04 } else { 1.0 / 0.9 };
        let radius = |cascade| {
            let slice = cascade_slice([1e-5, 0.01], split_lambda, cascade, cascades);
            visible_sphere(&main, slice).unwrap().1 * margin
        };
        let of_sun = maps.cameras("sun", &sun(), std::slice::from_ref(&main));
        for (cascade, map) in (0..).zip(&of_sun) {
            let (radius, largest) = (radius(cascade), radius(cascades - 1));
            let Projection::Orthographic { height } = map.projection else { panic!("it has perspective") };
            assert!(is_near(height, 2.0 * radius) && is_near(map.near, radius), "{map:?}");
            let casters = (16.0 * largest).min(128.0 * radius);
            assert!(is_near(map.far, casters + 3.0 * radius), "{} {casters} {radius}", map.far);
            limited += usize::from(16.0 * largest > 128.0 * radius);
        }
    }
    assert!((1..10).contains(&limited), "{limited} maps reach 128 of their radii");
    let (position, direction, intensity) = (DVec3::ZERO, Vec3::X, Vec3::ONE);
    let lamp = Light::Hemispherical { position, direction, intensity, range: 0.5, casts_shadow: true };
    assert_eq!(ShadowMaps::default().cameras("lamp", &lamp, &[])[0].far, 0.5);
}

#[test]
fn directional_maps_move_by_whole_pixels() {
    let maps = ShadowMaps { side: 64, cascades: 3, ..ShadowMaps::default() };
    let pixels_of_origin = |x: f64| {
        let camera = Camera::looking_at("main", DVec3::new(x, 1.0, 2.0), DVec3::new(x, 1.0, -9.0));
        let pixel = |map: &Camera| {
            let map = RenderView::new(map);
            let clip = map.clip_from_relative() * (-map.camera.position).as_vec3().extend(1.0);
            Vec2::new(clip.x, clip.y) * 32.0
        };
        maps.cameras("sun", &sun(), &[camera]).iter().map(pixel).collect::<Vec<_>>()
    };
    let first = pixels_of_origin(0.0);
    for step in 1..20 {
        for (now, first) in pixels_of_origin(f64::from(step) * 0.37).into_iter().zip(&first) {
            let moved = now - first;
            assert!((moved - moved.round()).abs().max_element() < 1e-3, "{moved}");
        }
    }
}

#[test]
fn a_main_camera_that_is_invalid_or_too_far_away_has_no_map_of_the_sun_and_others_have_theirs() {
    let main = || Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
    let invalid = [
        Camera { size: [0, 0], ..main() },
        Camera { projection: Projection::Perspective { field_of_view: f32::NAN }, ..main() },
        Camera { far: 0.0, ..main() },
        Camera { far: -1.0, ..main() },
        Camera { position: DVec3::X * 1e200, ..main() },
        Camera { position: DVec3::X * 1e11, ..main() },
    ];
    for cascades in 1..=ShadowMaps::MAX_CASCADES {
        let maps = ShadowMaps { cascades, ..ShadowMaps::default() };
        let of_sun = |cameras: &[Camera]| maps.cameras("sun", &sun(), cameras);
        let alone = of_sun(&[main()]);
        assert_eq!(alone.len(), cascades as usize);
        for (case, camera) in invalid.iter().cloned().enumerate() {
            assert!(of_sun(std::slice::from_ref(&camera)).is_empty(), "case {case} with {cascades} cascades");
            assert_eq!(of_sun(&[main(), camera]), alone, "case {case} with {cascades} cascades");
        }
    }
}

#[test]
fn maps_are_named_after_their_light_and_what_they_show() {
    let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
    let names = |cascades: u32, light: Light| -> Vec<String> {
        let maps = ShadowMaps { cascades, ..ShadowMaps::default() };
        maps.cameras("light", &light, std::slice::from_ref(&main)).into_iter().map(|map| map.name).collect()
    };
    let lamp = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0, casts_shadow: true };
    assert_eq!(names(1, sun()), ["light"]);
    assert_eq!(names(3, sun()), ["light, cascade 1", "light, cascade 2", "light, cascade 3"]);
    let faces = ["light, +X", "light, -X", "light, +Y", "light, -Y", "light, +Z", "light, -Z"];
    assert_eq!(names(3, lamp), faces);
    let second = Camera { name: "second".to_owned(), position: DVec3::X, ..main.clone() };
    let maps = ShadowMaps { cascades: 2, ..ShadowMaps::default() };
    let names: Vec<_> = maps.cameras("sun", &sun(), &[main, second]).into_iter().map(|map| map.name).collect();
    let expected = ["sun, cascade 1", "sun, cascade 2", "sun for second, cascade 1", "sun for second, cascade 2"];
    assert_eq!(names, expected);
}

#[test]
fn a_light_has_all_its_maps_or_none() {
    let maps = ShadowMaps { cascades: 4, max_distance: 1e6, ..ShadowMaps::default() };
    let of_sun = |x: f64| {
        let main = Camera { far: 1e7, ..Camera::looking_at("main", DVec3::X * x, DVec3::ZERO) };
        maps.cameras("sun", &sun(), &[main]).len()
    };
    assert_eq!([of_sun(1.0), of_sun(-FixedPosition::MAX_COORDINATE * 0.9999)], [4, 0]);
}

#[test]
fn invalid_maps_have_no_cameras() {
    let good = ShadowMaps { cascades: 2, ..ShadowMaps::default() };
    let main = [Camera::looking_at("main", DVec3::Z, DVec3::ZERO)];
    let lamp = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0, casts_shadow: true };
    let counts = |maps: ShadowMaps| [sun(), lamp].map(|light| maps.cameras("light", &light, &main).len());
    assert_eq!(counts(good), [2, 6]);
    for maps in [
        ShadowMaps { side: 0, ..good },
        ShadowMaps { max_distance: -1.0, ..good },
        ShadowMaps { max_distance: f32::NAN, ..good },
        ShadowMaps { cascades: 0, ..good },
        ShadowMaps { cascades: u32::MAX, ..good },
        ShadowMaps { split_lambda: f32::NAN, ..good },
        ShadowMaps { bias: -1.0, ..good },
        ShadowMaps { filter: u32::MAX, ..good },
    ] {
        assert_eq!(counts(maps), [0, 0], "{maps:?}");
    }
}

#[test]
fn a_light_that_casts_no_shadow_has_no_map() {
    let maps = ShadowMaps::default();
    let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
    let map = |light: Light, cameras: &[Camera]| maps.cameras("map", &light, cameras);
    let point = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0, casts_shadow: false };
    assert_eq!(map(point, std::slice::from_ref(&main)), []);
    assert_eq!(map(sun(), &[]), []);
    let Light::Directional { direction, illuminance, .. } = sun() else { unreachable!() };
    let moon = Light::Directional { direction, illuminance, casts_shadow: false };
    assert_eq!(map(moon, &[main]), []);
}

/// A camera that sees something else than the picture that it drew a part of has maps of what it sees.
#[test]
fn a_changed_tile_has_maps_of_its_own() {
    let maps = ShadowMaps::default();
    let of_sun = |camera: &Camera| maps.cameras("sun", &sun(), std::slice::from_ref(camera));
    let perspective = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
    let projection = Projection::Orthographic { height: 7.0 };
    let plan = Camera { projection, far: 30.0, ..Camera::looking_at("plan", DVec3::Y * 9.0, DVec3::ZERO) };
    let wide = Projection::Perspective { field_of_view: 2.0 };
    let tile = |camera: &Camera| camera.tile([0, 0], 3);
    let changed = [
        Camera { projection: wide, ..tile(&perspective) },
        Camera { projection, ..tile(&perspective) },
        Camera { position: DVec3::X * 40.0, ..tile(&plan) },
        Camera { position: plan.position + DVec3::Y * 4.0, ..tile(&plan) },
        Camera { projection: Projection::Orthographic { height: 8.0 }, ..tile(&plan) },
    ];
    for camera in changed {
        let camera = Camera { far: 30.0, shift: Vec2::ZERO, ..camera };
        assert_eq!(of_sun(&camera), of_sun(&Camera { whole: None, ..camera.clone() }), "{camera:?}");
    }
    assert_ne!(of_sun(&tile(&plan)), of_sun(&Camera { whole: None, ..tile(&plan) }));
}
