//! The colours of vertices, which multiply diffuse colours.

use std::f64::consts::FRAC_PI_2;
use std::io;
use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Blend, Camera, Material, Mesh, Projection, RenderObject, Scene, Topology, VERTEX_COLOR, Vertex};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw_on_processor, half_floats};

pub const CASES: &[Case] = &[
    ("vertex_colors_are_interpolated_and_multiply_diffuse_colors", interpolated),
    ("meshes_without_colors_look_the_same_with_vertex_colors", without_colors),
    ("vertex_colors_of_an_obj_file_are_drawn", of_an_obj_file),
];

/// The camera is this far in front of the squares, and sees as much to each side.
const DISTANCE: f64 = 4.0;
const SIZE: [u32; 2] = [64, 64];
const DIFFUSE: Vec3 = Vec3::new(0.75, 0.5, 0.25);
const AMBIENT: Vec3 = Vec3::new(0.5, 1.0, 2.0);
const OPACITY: f32 = 0.5;

/// The colour of a square at a point from its middle, from -1 to 1 in both directions.
fn color_at([x, y]: [f64; 2]) -> [f64; 3] {
    [0.5 + 0.5 * x, 0.5 - 0.25 * y, 0.25]
}

/// A square with colours.
fn colored_square() -> Result<Mesh, Failed> {
    let mesh = square(Topology::TriangleList);
    let color = |vertex: &Vertex| {
        let [x, y, _] = vertex.position.map(f64::from);
        color_at([x, y]).map(|channel| channel as f32)
    };
    let colors: Vec<_> = mesh.vertices().iter().map(color).collect();
    Ok(mesh.with_attribute(VERTEX_COLOR, &colors)?)
}

/// The positions of an opaque square with colours, a blended one, and an opaque one without colours.
const MIDDLES: [[f64; 2]; 3] = [[-2.0, 2.0], [2.0, 2.0], [-2.0, -2.0]];

fn squares() -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let camera = Camera::looking_at("main", DVec3::Z * DISTANCE, DVec3::ZERO);
    let projection = Projection::Perspective { field_of_view: FRAC_PI_2 as f32 };
    scene.cameras = vec![sized(Camera { projection, ..camera }, SIZE)];
    (scene.ambient, scene.background) = (AMBIENT, Vec3::ZERO);
    let material = Material { diffuse: DIFFUSE, ..Material::default() };
    let opaque = scene.add(material.clone())?;
    let blended = scene.add(Material { blend: Blend::Alpha, opacity: OPACITY, ..material })?;
    let meshes = [colored_square()?, colored_square()?, square(Topology::TriangleList)];
    for ((mesh, material), [x, y]) in meshes.into_iter().zip([opaque, blended, opaque]).zip(MIDDLES) {
        let mesh = scene.add(mesh)?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::new(x, y, 0.0)))?;
    }
    Ok(scene)
}

/// The radiance of a pixel: each square reflects the ambient light.
fn expected([column, row]: [u32; 2]) -> [f64; 3] {
    let side = f64::from(SIZE[0]);
    let x = (f64::from(column) + 0.5) / side * 2.0 * DISTANCE - DISTANCE;
    let y = DISTANCE - (f64::from(row) + 0.5) / side * 2.0 * DISTANCE;
    let squares = MIDDLES.map(|middle| [x - middle[0], y - middle[1]]);
    let is_inside = |point: &[f64; 2]| point.iter().all(|coordinate| coordinate.abs() < 1.0);
    let shares = match squares.iter().position(is_inside) {
        None => [0.0; 3],
        Some(0) => color_at(squares[0]),
        Some(1) => color_at(squares[1]).map(|channel| channel * f64::from(OPACITY)),
        Some(_) => [1.0; 3],
    };
    let full = DIFFUSE * AMBIENT;
    [0, 1, 2].map(|channel| shares[channel] * f64::from(full[channel]))
}

fn draw_in_software(deferred: Deferred, scene: &Scene, target: &str) -> Result<Picture, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    draw_on_processor((SoftwareBackend::new(Arc::clone(&scheduler)), scheduler), deferred, scene, target)
}

fn draw(deferred: Deferred, scene: &Scene, target: &str) -> Result<Picture, Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred))?;
    let recorded = fixture.record(scene)?;
    Ok(fixture.submit(recorded)?.read(0, target)?)
}

fn interpolated() -> Result<(), Failed> {
    let scene = squares()?;
    // Half floats have a step of 1/2,048 below 1, and blending rounds twice.
    let bound = 2.0 / 2_048.0;
    for pre_pass in [false, true] {
        let deferred = Deferred::to_picture().depth_pre_pass(pre_pass).vertex_colors(true);
        let reference = (SoftwareBackend::reference(), Arc::new(Scheduler::new(2)?));
        let pictures = [
            draw(deferred.clone(), &scene, "radiance")?,
            draw_in_software(deferred.clone(), &scene, "radiance")?,
            draw_on_processor(reference, deferred, &scene, "radiance")?,
        ];
        for (backend, picture) in ["wgpu", "software", "reference"].into_iter().zip(pictures) {
            for (index, found) in half_floats(&picture).into_iter().enumerate() {
                let coordinates = [index as u32 % SIZE[0], index as u32 / SIZE[0]];
                let expected = expected(coordinates);
                let error = [0, 1, 2].map(|channel| (found[channel] - expected[channel]).abs());
                if error.into_iter().fold(0.0, f64::max) > bound {
                    return Err(format!("{backend}, {coordinates:?}: {found:?} instead of {expected:?}").into());
                }
            }
        }
    }
    Ok(())
}

fn without_colors() -> Result<(), Failed> {
    let scene = everything();
    let [with, without] = [true, false].map(|colors| Deferred::to_picture().vertex_colors(colors));
    for (found, expected) in [
        (draw(with.clone(), &scene, "picture")?, draw(without.clone(), &scene, "picture")?),
        (draw_in_software(with, &scene, "picture")?, draw_in_software(without, &scene, "picture")?),
    ] {
        // A white that is interpolated may be less than 1 by a rounding, which no more than rounds a byte the other
        // way.
        let pairs = found.bytes.iter().zip(&expected.bytes);
        let worst = pairs.map(|(one, other)| one.abs_diff(*other)).max();
        if worst > Some(1) {
            return Err(format!("the pictures differ by {worst:?}").into());
        }
    }
    Ok(())
}

/// Of a triangle that is red, green and blue at its corners, each corner is the brightest in its channel.
fn of_an_obj_file() -> Result<(), Failed> {
    let text = "v -1 -1 0 1 0 0\nv 1 -1 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n";
    let mut scene = drawloom_obj::read("triangle.obj", text.as_bytes(), |_| Err(io::ErrorKind::NotFound.into()))?.scene;
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 2.0, DVec3::ZERO), SIZE)];
    scene.ambient = Vec3::ONE;
    let found = half_floats(&draw(Deferred::new().vertex_colors(true), &scene, "radiance")?);
    let brightest = |channel: usize| {
        let (index, _) =
            found.iter().enumerate().max_by(|(_, one), (_, other)| one[channel].total_cmp(&other[channel]))?;
        Some([index % SIZE[0] as usize, index / SIZE[0] as usize])
    };
    let [Some(red), Some(green), Some(blue)] = [0, 1, 2].map(brightest) else { return Err("no pixels".into()) };
    let is_placed = red[0] < blue[0] && blue[0] < green[0] && blue[1] < red[1] && blue[1] < green[1];
    if is_placed { Ok(()) } else { Err(format!("red {red:?}, green {green:?}, blue {blue:?}").into()) }
}
