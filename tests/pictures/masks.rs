//! Masks: where they have a surface, what is seen through their holes, and in the distance; on wgpu and in software.

mod leaves;

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::{Blend, Camera, Material, Mesh, Projection, RenderObject, Scene, Texture, Topology, Vertex};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::{cube, sized, square};
use fastrand::Rng;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw_on_processor, half_floats};

pub const CASES: &[Case] = &[
    ("the_nearest_leaf_covers_the_others_in_any_order", leaves::any_order),
    ("an_object_of_many_leaves_looks_like_many_objects", leaves::one_object),
    ("glass_before_a_mask_covers_it_and_glass_behind_shows_through_its_holes", glass),
    ("masks_keep_their_share_of_pixels_in_the_distance", in_the_distance),
    ("an_alpha_of_the_cutoff_is_a_surface", at_the_cutoff),
    ("a_mask_that_changes_looks_like_one_that_was_so_from_the_beginning", leaves::changing),
    ("the_order_of_faces_in_an_obj_file_does_not_decide_which_leaf_covers_which", leaves::leaves_of_a_file),
    ("what_is_behind_a_hole_is_drawn_with_occlusion_culling", behind_a_hole),
    (
        "masks_look_the_same_culled_by_triangle_in_static_groups_and_deformed",
        leaves::culled_in_static_groups_and_deformed,
    ),
    ("a_process_of_the_engine_draws_masks_by_entry_points_of_their_own", leaves::own_pre_pass),
    ("coarse_levels_of_masks_have_holes", leaves::coarse_levels),
];

/// A mask of 4 × 4 cells, rows from top to bottom.
pub const CELLS: [[bool; 4]; 4] =
    [[false, true, true, false], [true, true, false, true], [true, false, true, true], [false, true, true, true]];

/// White, with alpha by cell; as large as a layer of a texture array, so that no filter moves the edges of cells.
pub fn mask_texture() -> Result<Texture, Failed> {
    const SIDE: usize = 256;
    let alpha = |x: usize, y: usize| if CELLS[y * 4 / SIDE][x * 4 / SIDE] { 255 } else { 0 };
    let pixels = (0..SIDE * SIDE).flat_map(|index| [255, 255, 255, alpha(index % SIDE, index / SIDE)]).collect();
    Ok(Texture::new("cells", SIDE as u32, SIDE as u32, pixels)?)
}

/// A white mask of these cells, drawn from both sides.
pub fn mask_material(scene: &mut Scene) -> Result<Material, Failed> {
    let texture = Some(scene.add(mask_texture()?)?);
    Ok(Material { diffuse: Vec3::ONE, texture, alpha_cutoff: Some(0.5), double_sided: true, ..Material::default() })
}

/// The radiance of the first view on each backend.
fn on_each_backend(deferred: &Deferred, scene: &Scene) -> Result<[(&'static str, Picture); 3], Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.pipeline(deferred.clone()))?;
    let recorded = fixture.record(scene)?;
    let by_wgpu = fixture.submit(recorded)?.read(0, "radiance")?;
    let scheduler = || Scheduler::new(2).map(Arc::new);
    let workers = scheduler()?;
    let single = (SoftwareBackend::new(Arc::clone(&workers)), workers);
    let single = draw_on_processor(single, deferred.clone(), scene, "radiance")?;
    let double = (SoftwareBackend::reference(), scheduler()?);
    let double = draw_on_processor(double, deferred.clone(), scene, "radiance")?;
    Ok([("wgpu", by_wgpu), ("f32", single), ("f64", double)])
}

/// A camera that looks straight at squares whose cells are as wide as a fifth of the picture.
fn cell_camera() -> Camera {
    let projection = Projection::Orthographic { height: 2.5 };
    sized(
        Camera { projection, near: 0.5, far: 20.0, ..Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO) },
        [20; 2],
    )
}

/// The radiance in the middle of a cell.
fn at_cell(picture: &Picture, row: usize, column: usize) -> [f64; 3] {
    half_floats(picture)[(4 + row * 4) * 20 + 4 + column * 4]
}

fn glass() -> Result<(), Failed> {
    let [red, green, pane] = [Vec3::X, Vec3::Y, Vec3::Z];
    // From far to near: a pane, a red mask, a pane, a green mask that is turned by half a turn, and a pane.
    let distances = [-2.0, -1.0, 0.0, 1.0, 2.0];
    let mut first = None;
    for order in [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [3, 0, 4, 1, 2]] {
        let mut scene = Scene::new();
        (scene.ambient, scene.cameras) = (Vec3::ONE, vec![cell_camera()]);
        let mesh = scene.add(square(Topology::TriangleList))?;
        let mask = mask_material(&mut scene)?;
        for index in order {
            let material = match index {
                1 => Material { diffuse: red, ..mask.clone() },
                3 => Material { diffuse: green, ..mask.clone() },
                _ => Material { diffuse: pane, blend: Blend::Alpha, opacity: 0.5, ..Material::default() },
            };
            let material = scene.add(material)?;
            let object = RenderObject::new(mesh, material, DVec3::Z * distances[index]);
            let orientation = if index == 3 { Quat::from_rotation_z(std::f32::consts::PI) } else { Quat::IDENTITY };
            scene.add_object(RenderObject { orientation, ..object })?;
        }
        let pictures = on_each_backend(&Deferred::to_picture(), &scene)?;
        for (backend, picture) in &pictures {
            for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
                let over = |radiance: Vec3| radiance * 0.5 + pane * 0.5;
                let behind = if CELLS[row][column] { red } else { over(Vec3::ZERO) };
                let middle = over(behind);
                let expected = over(if CELLS[3 - row][3 - column] { green } else { middle });
                let found = at_cell(picture, row, column);
                let near = found
                    .iter()
                    .zip(expected.to_array())
                    .all(|(found, expected)| (found - f64::from(expected)).abs() < 1e-3);
                if !near {
                    return Err(format!("{backend}, {order:?}, cell {row} {column}: {found:?}, not {expected}").into());
                }
            }
        }
        if *first.get_or_insert_with(|| pictures.clone()) != pictures {
            return Err(format!("the order {order:?} changes the picture").into());
        }
    }
    Ok(())
}

/// Squares of a random mask, so far away that a pixel is as wide as many of its texels. Each pixel is covered with the
/// probability of a cell of the mask, so the number of covered ones is within five standard deviations of their mean.
fn in_the_distance() -> Result<(), Failed> {
    const SIDE: u32 = 64;
    for share in [0.1, 0.3, 0.7] {
        let mut random = Rng::with_seed(9);
        // Cells of 8 x 8 texels, so that it makes little difference that filters round their corners.
        let cells: Vec<_> =
            std::iter::repeat_with(|| if random.f64() < share { 255 } else { 0 }).take(64 * 64).collect();
        let alpha = |texel: usize| cells[texel / 512 / 8 * 64 + texel % 512 / 8];
        let pixels = (0..512 * 512).flat_map(|texel| [255, 255, 255, alpha(texel)]).collect();
        let texture = Texture::new("noise", 512, 512, pixels)?;
        // 10, 316 and 828 texels a pixel. The last two lie as the golden ratio, so that pixels show different cells.
        for repetitions in [1.3, 39.55, 103.55] {
            let mut scene = Scene::new();
            scene.ambient = Vec3::ONE;
            let projection = Projection::Orthographic { height: 2.0 };
            let camera =
                Camera { projection, near: 0.5, far: 20.0, ..Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO) };
            scene.cameras = vec![sized(camera, [SIDE; 2])];
            let texture = Some(scene.add(texture.clone())?);
            let mesh = square(Topology::TriangleList);
            let scaled = |vertex: &Vertex| Vertex { uv: vertex.uv.map(|value| value * repetitions), ..*vertex };
            let indices = mesh.triangles().flatten().collect();
            let vertices = mesh.vertices().iter().map(scaled).collect();
            let mesh = scene.add(Mesh::new("far", Topology::TriangleList, vertices, indices)?)?;
            let mask = Material { diffuse: Vec3::ONE, texture, alpha_cutoff: Some(0.5), ..Material::default() };
            let material = scene.add(mask)?;
            scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
            for (backend, picture) in on_each_backend(&Deferred::to_picture(), &scene)? {
                let covered = half_floats(&picture).iter().filter(|color| color[0] > 0.5).count() as f64;
                let count = f64::from(SIDE * SIDE);
                let deviation = (count * share * (1.0 - share)).sqrt();
                if (covered - count * share).abs() > 5.0 * deviation {
                    return Err(format!("{backend}: {covered} of {count} at {share}, {repetitions} times").into());
                }
            }
        }
    }
    Ok(())
}

fn at_the_cutoff() -> Result<(), Failed> {
    let plain = |alpha: u8| Texture::new("plain", 3, 3, [255, 255, 255, alpha].repeat(9));
    // Alpha of the texture if there is one, opacity, cutoff, and whether there is a surface.
    let cases = [
        (Some(255), 1.0, 1.0, true),
        (Some(254), 1.0, 1.0, false),
        (Some(0), 1.0, 0.0, true),
        (Some(0), 1.0, 1e-3, false),
        (Some(255), 0.5, 0.5, true),
        (Some(255), 0.49, 0.5, false),
        (Some(128), 1.0, 0.5, true),
        (Some(127), 1.0, 0.5, false),
        (None, 1.0, 1.0, true),
        (None, 0.3, 0.25, true),
        (None, 0.2, 0.25, false),
    ];
    let mut scene = Scene::new();
    scene.ambient = Vec3::ONE;
    let projection = Projection::Orthographic { height: 2.0 };
    let camera = Camera { projection, near: 0.5, far: 20.0, ..Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO) };
    scene.cameras = vec![sized(camera, [cases.len() as u32 * 6, 6])];
    let mesh = scene.add(square(Topology::TriangleStrip))?;
    for (index, (alpha, opacity, cutoff, _)) in cases.into_iter().enumerate() {
        let texture = alpha.map(|alpha| scene.add(plain(alpha)?)).transpose()?;
        let mask = Material { diffuse: Vec3::ONE, texture, opacity, alpha_cutoff: Some(cutoff), ..Material::default() };
        let material = scene.add(mask)?;
        let x = 2.0 * index as f64 - (cases.len() as f64 - 1.0);
        scene.add_object(RenderObject::new(mesh, material, DVec3::X * x))?;
    }
    for (backend, picture) in on_each_backend(&Deferred::to_picture(), &scene)? {
        for (pixel, color) in half_floats(&picture).iter().enumerate() {
            let case = cases[pixel % (cases.len() * 6) / 6];
            if (color[0] > 0.5) != case.3 {
                return Err(format!("{backend}: {case:?} at pixel {pixel}").into());
            }
        }
    }
    Ok(())
}

/// A wall that fills the picture, with the mask's holes, and cubes behind it.
fn behind_a_hole() -> Result<(), Failed> {
    let mut scene = Scene::new();
    (scene.ambient, scene.background) = (Vec3::ONE, Vec3::new(0.0, 0.0, 1.0));
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 4.0, DVec3::ZERO), [160, 120])];
    let mask = Material { double_sided: false, ..mask_material(&mut scene)? };
    let stone = scene.add(Material { diffuse: Vec3::X, ..Material::default() })?;
    let (wall, mesh) = (scene.add(mask.clone())?, scene.add(cube())?);
    let object = RenderObject::new(mesh, wall, DVec3::ZERO);
    let wall_object = scene.add_object(RenderObject { scale: Vec3::new(4.0, 4.0, 0.1), ..object })?;
    for index in 0..100 {
        let position = DVec3::new(f64::from(index % 10) - 4.5, f64::from(index / 10) - 4.5, -4.0);
        let object = RenderObject::new(mesh, stone, position);
        scene.add_object(RenderObject { scale: Vec3::splat(0.3), ..object })?;
    }
    let drawn = |scene: &Scene, occlusion: Option<u32>| -> Result<_, Failed> {
        let quality = Quality { occlusion, ..Quality::balanced() };
        let mut fixture = Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).quality(quality))?;
        let recorded = fixture.record(scene)?;
        let occluded = recorded.statistics().views[0].occluded;
        Ok((fixture.submit(recorded)?.read(0, "picture")?, occluded))
    };
    let (without, _) = drawn(&scene, None)?;
    for tile in Quality::OCCLUSION_TILE_SIZES {
        let (with, occluded) = drawn(&scene, Some(tile))?;
        if with != without || occluded > 0 {
            return Err(format!("{occluded} cubes are culled behind a wall with holes, with tiles of {tile}").into());
        }
    }
    let is_red = |pixel: &[u8]| pixel[0] > 100 && pixel[1] < 50;
    if without.bytes.chunks_exact(4).filter(|pixel| is_red(pixel)).count() < 100 {
        return Err("no cube is seen through the holes".into());
    }
    // A wall without holes hides them.
    let solid = scene.add(Material { alpha_cutoff: None, ..mask })?;
    scene.replace_object(wall_object, RenderObject { material: solid, ..scene.object(wall_object)? })?;
    if drawn(&scene, Some(4))?.1 == 0 {
        return Err("nothing is culled behind a wall without holes".into());
    }
    Ok(())
}
