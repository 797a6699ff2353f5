//! Cameras that are derived from others: in mirrors, through portals, and of tiles. Each is drawn as a main camera.

use drawloom::glam::{DMat3, DVec3, Quat};
use drawloom::scene::{Camera, ClipPlane, Projection, ViewKind};
use libtest_mimic::Failed;

use crate::Case;
use crate::capture::{Capture, assert_alike};
use crate::error_table::{EXTREMES, Extreme, TOUCHING, UNIT_ROUNDOFF};
use crate::harness::Harness;
use crate::markers::{BLUE, GREEN, Marker, MarkerScene, RED, camera, with_context};
use crate::oracle::View;
use crate::placement::expect_placed;

pub const CASES: &[Case] = &[
    ("mirrors_show_what_a_reflected_ray_hits", mirrors),
    ("tiles_of_mirrors_and_mirrors_in_tiles_show_the_same", mirrored_tiles),
    ("mirrors_that_the_camera_touches_show_what_a_reflected_ray_hits", touched_mirrors),
    ("portals_show_what_a_ray_through_them_hits", portals),
    ("portals_in_portals_show_what_a_ray_through_all_of_them_hits", portals_in_portals),
    ("portals_that_the_camera_touches_show_what_a_ray_through_them_hits", touched_portals),
    ("tiles_are_the_parts_of_the_whole_picture", tiles),
];

const SIZE: [u32; 2] = [48, 32];

/// A camera somewhere, with a near plane that fits the scale.
pub fn camera_at(extreme: &Extreme) -> Camera {
    let near = (0.05 * extreme.scale) as f32;
    Camera { position: extreme.position, near, ..camera(SIZE) }
}

/// The camera as one whose picture the harness reads.
pub fn as_main(camera: Camera) -> Camera {
    Camera { kind: ViewKind::Main, ..camera }
}

/// Right, up and forward.
pub fn axes(camera: &Camera) -> [DVec3; 3] {
    let turn = camera.orientation.as_dquat().normalize();
    [DVec3::X, DVec3::Y, DVec3::NEG_Z].map(|axis| turn * axis)
}

/// A plane at a distance in front of a camera, or beside it, that reflects towards it.
fn plane_before(camera: &Camera, normal: DVec3, distance: f64) -> ClipPlane {
    let normal = normal.as_vec3().normalize();
    ClipPlane { point: camera.position - normal.as_dvec3().normalize() * distance, normal }
}

/// What a ray of the camera hits that a mirror reflects.
fn mirrored(camera: &Camera, plane: ClipPlane) -> View {
    let normal = plane.normal.as_dvec3().normalize();
    let on_plane = plane.point - camera.position;
    let reflect = |direction: DVec3| direction - normal * (2.0 * normal.dot(direction));
    let view = View::of(camera).turned(reflect);
    let origin = normal * (2.0 * normal.dot(on_plane));
    // Left and right are swapped.
    View { origin, right: -view.right, near: 0.0, clip_plane: Some([on_plane, normal]), ..view }
}

/// Markers in front of the clip plane of a camera and across it, and one behind it that hides all if it is drawn. Those
/// in front are so far apart that depth distinguishes them, by t² ÷ (180 · f · D): at 3 m 0.6 m, from 3.1 mm before the
/// plane and with a focal length of 27.7 pixels.
fn markers_at_plane(seen_by: &Camera, plane: ClipPlane, scale: f64) -> Vec<Marker> {
    let [right, up, forward] = axes(seen_by);
    let normal = plane.normal.as_dvec3().normalize();
    let behind = -normal.dot(seen_by.position - plane.point);
    // How far along the axis the plane is, and how far the camera is from it.
    let begin = behind / normal.dot(forward);
    let mut markers = vec![
        Marker::before(seen_by, begin + 2.0 * scale, 0.6 * scale).moved(seen_by, -0.3 * scale, 0.2 * scale),
        Marker::before(seen_by, begin + 3.0 * scale, 1.7 * scale)
            .moved(seen_by, 0.35 * scale, 0.1 * scale)
            .colored(RED),
    ];
    if behind > 0.1 * scale {
        markers.push(Marker { double_sided: true, ..Marker::before(seen_by, 0.5 * begin, 9.0 * scale) });
    }
    let on_plane = |point: DVec3| point - normal * normal.dot(point - plane.point);
    let along = forward - normal * normal.dot(forward);
    let across = if along.length() > 0.5 {
        let aside = on_plane(seen_by.position - up * (0.2 * scale) - right * (1.2 * scale));
        let facing = Marker { double_sided: true, ..Marker::before(seen_by, 1.0, 1.5 * scale) };
        Marker { position: aside + along.normalize() * (4.0 * scale), ..facing }
    } else {
        let tilted = seen_by.orientation * Quat::from_rotation_y(1.2);
        let facing = Marker::before(seen_by, begin, 0.8 * scale).moved(seen_by, -0.3 * scale, -0.3 * scale);
        Marker { position: on_plane(facing.position), orientation: tilted.normalize(), double_sided: true, ..facing }
    };
    markers.push(across.colored(BLUE));
    markers
}

fn check_mirror(
    harness: &mut Harness,
    column: &str,
    camera: &Camera,
    plane: ClipPlane,
    scale: f64,
) -> Result<(), Failed> {
    let reflected = as_main(camera.reflected("mirror", plane));
    let markers = markers_at_plane(&reflected, plane, scale);
    let mut scene = MarkerScene::new(reflected, markers)?;
    scene.view = Some(mirrored(camera, plane));
    let context = format!("{:e} m before {plane:?}", plane.distance(camera.position));
    expect_placed(harness, ("mirror", column, &context), &scene, 2).map(drop)
}

/// The tiles of a mirror's picture, and what mirrors show of tiles, whose columns follow each other from the right.
fn mirrored_tiles(harness: &mut Harness) -> Result<(), Failed> {
    const COUNT: u32 = 3;
    for extreme in EXTREMES {
        let camera = camera_at(&extreme);
        let [right, up, forward] = axes(&camera);
        let plane = plane_before(&camera, right * 0.5 + up * 0.3 - forward, 0.7 * extreme.scale);
        let reflected = camera.reflected("mirror", plane);
        let markers = markers_at_plane(&reflected, plane, extreme.scale);
        let whole = Camera { size: SIZE.map(|side| side * COUNT), ..camera.clone() };
        for [column, row] in [[1, 1], [0, 1], [2, 0], [1, 2]] {
            let of_mirror = reflected.tile([column, row], COUNT);
            let of_tile = camera.tile([COUNT - 1 - column, row], COUNT).reflected("mirror", plane);
            for (context, tile) in [("a tile of a mirror", of_mirror), ("a mirror in a tile", of_tile)] {
                let mut scene = MarkerScene::new(as_main(tile), markers.clone())?;
                let corner = [column, row].map(f64::from);
                let corner = [corner[0] * f64::from(SIZE[0]), corner[1] * f64::from(SIZE[1])];
                scene.view = Some(View { corner, ..mirrored(&whole, plane) });
                let context = format!("{context}: {column} {row}");
                expect_placed(harness, ("mirror", extreme.name, &context), &scene, 0)?;
            }
        }
    }
    Ok(())
}

fn mirrors(harness: &mut Harness) -> Result<(), Failed> {
    for extreme in EXTREMES {
        let camera = camera_at(&extreme);
        let [right, up, forward] = axes(&camera);
        for lean in [DVec3::ZERO, right * 0.5 + up * 0.3, up * 2.0 - right * 0.4] {
            let plane = plane_before(&camera, lean - forward, 0.7 * extreme.scale);
            check_mirror(harness, extreme.name, &camera, plane, extreme.scale)?;
            check_parallel_mirror(harness, &extreme, plane)?;
        }
    }
    Ok(())
}

/// Without perspective there is no clip plane: the mirror's camera sees what is behind the mirror, too.
fn check_parallel_mirror(harness: &mut Harness, extreme: &Extreme, plane: ClipPlane) -> Result<(), Failed> {
    let height = (5.0 * extreme.scale) as f32;
    let projection = Projection::Orthographic { height };
    let camera = Camera { projection, far: height * 20.0, ..camera_at(extreme) };
    let reflected = as_main(camera.reflected("mirror", plane));
    let mut scene = MarkerScene::new(reflected.clone(), spread(&reflected, extreme.scale))?;
    scene.view = Some(View { near: f64::from(camera.near), clip_plane: None, ..mirrored(&camera, plane) });
    expect_placed(harness, ("mirror", extreme.name, "without perspective"), &scene, 9).map(drop)
}

/// Distances of a camera from what it touches, in metres; its near plane is at 5 cm.
const TOUCHING_DISTANCES: [f64; 9] = [0.0, 1e-300, 1e-15, 1e-9, 1e-6, 1e-4, 3.1e-3, 3.2e-3, 2e-2];

fn touched_mirrors(harness: &mut Harness) -> Result<(), Failed> {
    for distance in TOUCHING_DISTANCES {
        let camera = camera(SIZE);
        let [right, up, forward] = axes(&camera);
        for (lean, away) in [(DVec3::ZERO, 1.0), (right * 0.5 + up * 0.3, 1.0), (up - right * 0.2, 0.2)] {
            let plane = plane_before(&camera, lean - forward * away, distance);
            check_mirror(harness, TOUCHING, &camera, plane, 1.0)?;
        }
    }
    // Far away, f64 distinguishes no smaller distance from 0.
    for extreme in &EXTREMES[..2] {
        let camera = camera_at(extreme);
        let [right, up, forward] = axes(&camera);
        let plane = plane_before(&camera, up - right * 0.2 - forward * 0.2, 0.0);
        check_mirror(harness, TOUCHING, &camera, plane, 1.0)?;
    }
    Ok(())
}

/// What leads out of a portal is its +Z.
type Portal = (DVec3, Quat);

/// How directions are turned from one portal to another.
fn turn_through(entry: Portal, exit: Portal) -> DMat3 {
    let [of_entry, of_exit] = [entry.1, exit.1].map(|turn| DMat3::from_quat(turn.as_dquat().normalize()));
    // To the right of the entry is to the left of the exit, and into the one is out of the other.
    of_exit * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0)) * of_entry.transpose()
}

/// What a ray of the camera hits that enters one portal and leaves another.
fn through(camera: &Camera, entry: Portal, exit: Portal) -> View {
    let turn = turn_through(entry, exit);
    let view = View::of(camera).turned(|direction| turn * direction);
    let clip_plane = Some([DVec3::ZERO, DMat3::from_quat(exit.1.as_dquat().normalize()).z_axis]);
    View { reference: exit.0, origin: turn * (camera.position - entry.0), near: 0.0, clip_plane, ..view }
}

fn check_portal(
    harness: &mut Harness,
    column: &str,
    camera: &Camera,
    [entry, exit]: [Portal; 2],
    scale: f64,
) -> Result<(), Failed> {
    let derived = as_main(camera.through_portal("window", entry, exit));
    let plane = ClipPlane { point: exit.0, normal: (exit.1.as_dquat() * DVec3::Z).as_vec3().normalize() };
    let markers = markers_at_plane(&derived, plane, scale);
    let mut scene = MarkerScene::new(derived, markers)?;
    scene.view = Some(through(camera, entry, exit));
    let context = format!("from {entry:?} to {exit:?}, from {}", camera.position);
    expect_placed(harness, ("portal", column, &context), &scene, 2).map(drop)
}

/// A portal at a distance before a camera that leans by some angles.
fn portal_before(camera: &Camera, distance: f64, [x, y]: [f32; 2]) -> Portal {
    let orientation = (camera.orientation * Quat::from_rotation_x(x) * Quat::from_rotation_y(y)).normalize();
    (camera.position - orientation.as_dquat().normalize() * DVec3::Z * distance, orientation)
}

const EXIT: Quat = Quat::from_xyzw(0.5, -0.1, 0.7, 0.5);

fn portals(harness: &mut Harness) -> Result<(), Failed> {
    for extreme in EXTREMES {
        let Extreme { name, position, scale } = extreme;
        for lean in [[0.0, 0.0], [0.3, -0.5], [-0.9, 0.2]] {
            // Both far away, one near the origin and the other far away.
            for (entered, left) in
                [(position, position * -0.7), (DVec3::ZERO, position), (position, DVec3::ONE * scale)]
            {
                let camera = camera_at(&Extreme { position: entered, ..extreme });
                let entry = portal_before(&camera, 0.7 * scale, lean);
                check_portal(harness, name, &camera, [entry, (left, EXIT.normalize())], scale)?;
            }
        }
    }
    Ok(())
}

/// A camera that looks through portals many times over: each adds what it rounds.
fn portals_in_portals(harness: &mut Harness) -> Result<(), Failed> {
    const DEPTH: usize = 4;
    for Extreme { name, position, scale } in EXTREMES {
        let main = camera_at(&Extreme { name, position, scale });
        // The exit is behind the camera, almost parallel: each portal shows the next one.
        let entry = portal_before(&main, 0.7 * scale, [0.1, 0.05]);
        let orientation = entry.1 * Quat::from_rotation_y(std::f32::consts::PI) * Quat::from_rotation_x(0.03);
        let exit = (entry.0 + entry.1.as_dquat().normalize() * DVec3::Z * scale, orientation.normalize());
        let (mut camera, mut view) = (main.clone(), View::of(&main));
        let turn = turn_through(entry, exit);
        for _ in 0..DEPTH {
            let origin = turn * (view.origin + (view.reference - entry.0));
            view = View { reference: exit.0, origin, ..view.turned(|axis| turn * axis) };
            camera = camera.through_portal("window", entry, exit);
        }
        view = View { near: 0.0, clip_plane: through(&main, entry, exit).clip_plane, ..view };
        let plane = ClipPlane { point: exit.0, normal: (exit.1.as_dquat() * DVec3::Z).as_vec3().normalize() };
        let markers = markers_at_plane(&camera, plane, 3.0 * scale);
        let mut scene = MarkerScene::new(as_main(camera), markers)?;
        scene.view = Some(view);
        // Each of the cameras is rounded: by far less than the pixel that the oracle leaves out.
        scene.expect(harness, &format!("{name}, {DEPTH} portals deep"), 2)?;
    }
    Ok(())
}

fn touched_portals(harness: &mut Harness) -> Result<(), Failed> {
    let camera = camera(SIZE);
    for distance in TOUCHING_DISTANCES {
        for lean in [[0.0, 0.0], [0.3, -0.5], [-1.3, 0.1]] {
            let entry = portal_before(&camera, distance, lean);
            check_portal(harness, TOUCHING, &camera, [entry, (DVec3::ZERO, EXIT.normalize())], 1.0)?;
        }
    }
    for extreme in &EXTREMES[..2] {
        let camera = camera_at(extreme);
        let entry = portal_before(&camera, 0.0, [-1.3, 0.1]);
        check_portal(harness, TOUCHING, &camera, [entry, (extreme.position * -0.7, EXIT.normalize())], 1.0)?;
    }
    Ok(())
}

/// Markers all over the picture.
fn spread(camera: &Camera, scale: f64) -> Vec<Marker> {
    let grid = (0..9).map(|index| {
        let [column, row] = [index % 3 - 1, index / 3 - 1].map(f64::from);
        let distance = (4.0 + 0.4 * column - 0.2 * row) * scale;
        let color = [GREEN, RED, BLUE][(index % 3) as usize];
        Marker::before(camera, distance, 0.9 * scale)
            .moved(camera, column * 1.3 * scale, row * 0.9 * scale)
            .colored(color)
    });
    grid.collect()
}

fn tiles(harness: &mut Harness) -> Result<(), Failed> {
    let touching = Extreme { name: TOUCHING, position: DVec3::ZERO, scale: 1.0 };
    for extreme in EXTREMES.into_iter().chain([touching]) {
        let perspective = camera_at(&extreme);
        let height = (5.0 * extreme.scale) as f32;
        let parallel =
            Camera { projection: Projection::Orthographic { height }, far: height * 20.0, ..perspective.clone() };
        // A parallel picture cannot be divided into parts lower than a micrometre, and the parts of a small one are as
        // coarse as positions.
        let most = if extreme.scale < 1.0 { 64 } else { 4096 };
        let lowest = ((height * 1e6) as u32).min(most);
        for (main, many) in [(perspective, most), (parallel, lowest)] {
            // The near plane is at the nearest marker, but for what the shader rounds.
            let near = if extreme.name == TOUCHING { 3.4 * (1.0 - 40.0 * UNIT_ROUNDOFF) } else { main.near.into() };
            let main = Camera { near: near as f32, ..main };
            let markers = spread(&main, extreme.scale);
            let whole = Camera { size: SIZE.map(|side| side * 2), ..main.clone() };
            let whole = MarkerScene::new(whole, markers.clone())?;
            let bound = expect_placed(harness, ("tile", extreme.name, "all of them"), &whole, 9)?;
            let picture = whole.draw(harness)?.capture;
            for tile in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                let (drawn, bound_of_tile) = draw_tile(harness, extreme.name, &main, &markers, (tile, 2))?;
                let part = picture.as_ref().map(|whole| whole.part([0, 1].map(|axis| tile[axis] * SIZE[axis]), SIZE));
                // Both pictures have vertices in the wrong place.
                assert_alike(&format!("tile {tile:?}"), drawn.as_ref(), part.as_ref(), bound + bound_of_tile)
                    .map_err(|failed| with_context(extreme.name, failed))?;
            }
            for tile in [[many / 2 - 1, many / 2], [0, 0], [many - 1, many / 3]] {
                draw_tile(harness, extreme.name, &main, &markers, (tile, many))?;
            }
        }
    }
    Ok(())
}

/// Compares a tile with what rays of the whole picture hit. Returns it, and the largest bound of a corner's error, in
/// pixels.
fn draw_tile(
    harness: &mut Harness,
    column: &str,
    main: &Camera,
    markers: &[Marker],
    (tile, count): ([u32; 2], u32),
) -> Result<(Option<Capture>, f64), Failed> {
    let mut scene = MarkerScene::new(main.tile(tile, count), markers.to_vec())?;
    let corner = [0, 1].map(|axis| f64::from(tile[axis] * SIZE[axis]));
    let whole = Camera { size: SIZE.map(|side| side * count), ..main.clone() };
    scene.view = Some(View { corner, ..View::of(&whole) });
    let context = format!("tile {tile:?} of {count}, {:?}", main.projection);
    let bound = expect_placed(harness, ("tile", column, &context), &scene, 0)?;
    Ok((scene.draw(harness)?.capture, bound))
}
