//! Masked objects: what covers what, against rays in f64, on wgpu and in software.

use std::io::{self, Cursor};
use std::sync::Arc;

use drawloom::Granularity;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{DVec3, EulerRot, Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::{
    Blend, Camera, Material, Mesh, Piece, Projection, RenderObject, Scene, Texture, Topology, VERTEX_COLOR, Vertex, obj,
};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::{cube, culled, sized, square, with_meshes};
use fastrand::Rng;
use image::{ImageFormat, Rgb, RgbImage};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, draw_on_processor, half_floats};

pub const CASES: &[Case] = &[
    ("the_nearest_leaf_covers_the_others_in_any_order", any_order),
    ("an_object_of_many_leaves_looks_like_many_objects", one_object),
    ("glass_before_a_mask_covers_it_and_glass_behind_shows_through_its_holes", glass),
    ("masks_keep_their_share_of_pixels_in_the_distance", in_the_distance),
    ("an_alpha_of_the_cutoff_is_a_surface", at_the_cutoff),
    ("a_mask_that_changes_looks_like_one_that_was_so_from_the_beginning", changing),
    ("the_order_of_faces_in_an_obj_file_does_not_decide_which_leaf_covers_which", leaves_of_a_file),
    ("what_is_behind_a_hole_is_drawn_with_occlusion_culling", behind_a_hole),
    ("masks_look_the_same_culled_by_triangle_and_in_pieces", culled_and_in_pieces),
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

const SIZE: [u32; 2] = [96, 72];

/// A leaf: a parallelogram that is cut out by the mask.
#[derive(Clone, Copy)]
struct Leaf {
    center: DVec3,
    /// From the centre to the midpoints of two edges.
    right: DVec3,
    up: DVec3,
    color: [f32; 3],
}

impl Leaf {
    /// Leaves of different colours in front of a camera at +Z, which cross each other.
    fn crossing(count: usize) -> Vec<Self> {
        let mut random = Rng::with_seed(55);
        let mut number = |most: f64| (random.f64() * 2.0 - 1.0) * most;
        let mut leaf = |index: usize| {
            let turn = Quat::from_euler(EulerRot::YXZ, number(3.0) as f32, number(1.0) as f32, number(3.0) as f32);
            let axis = |axis: Vec3| (turn * axis).as_dvec3();
            let center = DVec3::new(number(2.0), number(1.4), number(1.5));
            let color = [0, 1, 2].map(|channel| (1 + (index + 1) / 4_usize.pow(channel) % 4) as f32 / 4.0);
            Self { center, right: axis(Vec3::X) * 0.9, up: axis(Vec3::Y) * 0.6, color }
        };
        (0..count).map(&mut leaf).collect()
    }

    fn corners(&self, around: DVec3) -> Vec<Vertex> {
        let normal = self.right.cross(self.up).normalize().as_vec3().to_array();
        let corner = |x: f64, y: f64| Vertex {
            position: (self.center - around + self.right * x + self.up * y).as_vec3().to_array(),
            normal,
            uv: [x as f32 * 0.5 + 0.5, 0.5 - y as f32 * 0.5],
        };
        vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)]
    }

    /// The mesh of some leaves, in this order, around a point.
    fn mesh(leaves: &[Self], around: DVec3) -> Result<Mesh, Failed> {
        let vertices = leaves.iter().flat_map(|leaf| leaf.corners(around)).collect();
        let indices = (0..leaves.len() as u32).flat_map(|leaf| [0, 1, 2, 2, 1, 3].map(|corner| leaf * 4 + corner));
        let colors: Vec<_> = leaves.iter().flat_map(|leaf| [leaf.color; 4]).collect();
        Ok(Mesh::new("leaves", Topology::TriangleList, vertices, indices.collect())?
            .with_attribute(VERTEX_COLOR, &colors)?)
    }

    /// Where a ray meets its plane, and whether there is a surface.
    fn hit(&self, from: DVec3, along: DVec3) -> Option<(f64, bool)> {
        let across = self.right.cross(self.up);
        let share = (self.center - from).dot(across) / along.dot(across);
        let local = from + along * share - self.center;
        let [x, y] = [self.right, self.up].map(|axis| local.dot(axis) / axis.length_squared());
        let is_inside = share > 0.0 && x.abs() < 1.0 && y.abs() < 1.0;
        let cell = |share: f64| ((share * 4.0) as usize).min(3);
        is_inside.then(|| (share, CELLS[cell(0.5 - y * 0.5)][cell(x * 0.5 + 0.5)]))
    }
}

fn leaf_camera() -> Camera {
    let projection = Projection::Perspective { field_of_view: 1.0 };
    sized(Camera { projection, ..Camera::looking_at("main", DVec3::Z * 5.0, DVec3::ZERO) }, SIZE)
}

/// A scene of ambient light in which diffuse colours are radiances.
fn white_room() -> Scene {
    let mut scene = Scene::new();
    scene.ambient = Vec3::ONE;
    scene.cameras = vec![leaf_camera()];
    scene
}

fn leaf_objects(leaves: &[Leaf]) -> Result<Scene, Failed> {
    let mut scene = white_room();
    let material = mask_material(&mut scene)?;
    let material = scene.add(material)?;
    for leaf in leaves {
        let mesh = scene.add(Leaf::mesh(&[*leaf], leaf.center)?)?;
        scene.add_object(RenderObject::new(mesh, material, leaf.center))?;
    }
    Ok(scene)
}

/// The pipeline, whose objects have the colours of their vertices.
fn colored() -> Deferred {
    Deferred::to_picture().vertex_colors(true)
}

/// The radiance of the first view on each backend.
fn on_each_backend(deferred: &Deferred, scene: &Scene) -> Result<[(&'static str, Picture); 3], Failed> {
    let mut fixture = Fixture::with(2, |builder| builder.deferred(deferred.clone()))?;
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

/// What rays through a pixel meet.
#[derive(Default)]
struct Seen {
    /// Pixels of which rounding does not decide: those of leaves, and those seen through a hole of a nearer one.
    leaves: usize,
    through_holes: usize,
    unsure: usize,
}

/// Fails if a pixel of the leaves' picture is not that of the nearest surface on its ray.
fn expect_nearest(leaves: &[Leaf], picture: &Picture) -> Result<Seen, Failed> {
    let (camera, mut seen) = (leaf_camera(), Seen::default());
    let half_height = 0.5_f64.tan();
    let [width, height] = SIZE.map(f64::from);
    let nearest = |x: f64, y: f64| {
        let right = (x / width * 2.0 - 1.0) * half_height * width / height;
        let along = DVec3::new(right, (1.0 - y / height * 2.0) * half_height, -1.0);
        let hit = |(index, leaf): (usize, &Leaf)| {
            leaf.hit(camera.position, along).map(|(share, solid)| (share, solid, index))
        };
        let mut hits: Vec<_> = leaves.iter().enumerate().filter_map(hit).collect();
        hits.sort_by(|one, other| one.0.total_cmp(&other.0));
        let first = hits.iter().position(|(_, solid, _)| *solid);
        let is_alone = first.is_none_or(|first| {
            hits[first + 1..].iter().all(|(share, solid, _)| !solid || share - hits[first].0 > 1e-3)
        });
        (first.map(|first| hits[first].2), first.unwrap_or(hits.len()) > 0, is_alone)
    };
    for ((x, y), found) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).zip(half_floats(picture)) {
        let at = |right: f64, down: f64| nearest(f64::from(x) + 0.5 + right, f64::from(y) + 0.5 + down);
        let (leaf, has_hole, mut is_sure) = at(0.0, 0.0);
        // Farther than a rasterizer moves corners, and than a filter rounds the corners of cells.
        for (right, down) in [(0.1, 0.1), (-0.1, 0.1), (0.1, -0.1), (-0.1, -0.1)] {
            let (other, _, is_alone) = at(right, down);
            is_sure &= other == leaf && is_alone;
        }
        if !is_sure {
            seen.unsure += 1;
            continue;
        }
        seen.leaves += usize::from(leaf.is_some());
        seen.through_holes += usize::from(has_hole);
        let expected = leaf.map_or([0.0; 3], |leaf| leaves[leaf].color.map(f64::from));
        // Half floats have 11 bits.
        if found.iter().zip(expected).any(|(found, expected)| (found - expected).abs() > expected / 1024.0) {
            return Err(format!("({x}, {y}) is {found:?} and should be {expected:?}, of leaf {leaf:?}").into());
        }
    }
    if seen.leaves < 1500 || seen.through_holes < 500 || seen.unsure > 2500 {
        let Seen { leaves, through_holes, unsure } = seen;
        return Err(format!("too few pixels to compare: {leaves}, {through_holes}, {unsure}").into());
    }
    Ok(seen)
}

fn any_order() -> Result<(), Failed> {
    let leaves = Leaf::crossing(40);
    let mut shuffled = leaves.clone();
    Rng::with_seed(1).shuffle(&mut shuffled);
    let mut first: Option<[(&str, Picture); 3]> = None;
    // The reversed and the shuffled order, and what may change the picture no more than order does.
    let others =
        [(1, colored()), (2, colored()), (1, colored().depth_pre_pass(true)), (2, colored().geometry_shares(3))];
    for (order, deferred) in [(0, colored())].into_iter().chain(others) {
        let ordered = match order {
            0 => leaves.clone(),
            1 => leaves.iter().rev().copied().collect(),
            _ => shuffled.clone(),
        };
        let pictures = on_each_backend(&deferred, &leaf_objects(&ordered)?)?;
        let expected = first.get_or_insert_with(|| pictures.clone());
        for ((backend, picture), (_, expected)) in pictures.iter().zip(&*expected) {
            if order == 0 {
                expect_nearest(&leaves, picture).map_err(|failed| format!("{backend}: {failed:?}"))?;
            }
            if picture != expected {
                return Err(format!("{backend}: order {order} or another pipeline changes the picture").into());
            }
        }
    }
    Ok(())
}

fn one_object() -> Result<(), Failed> {
    let mut leaves = Leaf::crossing(40);
    for scale in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0)] {
        let mut first = None;
        for order in 0..3 {
            let mirrored = |leaf: &Leaf| {
                let mirror = |vector: DVec3| vector * scale.as_dvec3();
                Leaf { center: mirror(leaf.center), right: mirror(leaf.right), up: mirror(leaf.up), ..*leaf }
            };
            let placed: Vec<_> = leaves.iter().map(mirrored).collect();
            let mut scene = white_room();
            let material = mask_material(&mut scene)?;
            let (mesh, material) = (scene.add(Leaf::mesh(&leaves, DVec3::ZERO)?)?, scene.add(material)?);
            scene.add_object(RenderObject { scale, ..RenderObject::new(mesh, material, DVec3::ZERO) })?;
            let pictures = on_each_backend(&colored(), &scene)?;
            for (backend, picture) in &pictures {
                expect_nearest(&placed, picture).map_err(|failed| format!("{backend}, order {order}: {failed:?}"))?;
            }
            if *first.get_or_insert_with(|| pictures.clone()) != pictures {
                return Err(format!("order {order} changes the picture").into());
            }
            Rng::with_seed(order).shuffle(&mut leaves);
        }
    }
    Ok(())
}

/// Two leaves of one object, a red one before a blue one, whose mask has the values that a program leaves in its holes and in its leaves.
fn leaves_of_a_file() -> Result<(), Failed> {
    for [hole, leaf] in [[0, 255], [5, 247]] {
        let mut first = None;
        for is_red_first in [true, false] {
            let scene = two_leaves([hole, leaf], is_red_first)?;
            let pictures = on_each_backend(&Deferred::to_picture(), &scene)?;
            for (backend, picture) in &pictures {
                let colors = half_floats(picture);
                let (red, blue) = (colors[SIZE[0] as usize * 36 + 48], colors[SIZE[0] as usize * 6 + 48]);
                if !(red[0] > 0.5 && red[2] < 0.2 && blue[2] > 0.5 && blue[0] < 0.2) {
                    return Err(format!("{backend}: the middle is {red:?}, and above it is {blue:?}").into());
                }
            }
            if *first.get_or_insert_with(|| pictures.clone()) != pictures {
                return Err("the order of faces changes the picture".into());
            }
        }
    }
    Ok(())
}

/// An OBJ file of two leaves. The nearer, red one covers the middle of the picture; the blue one is larger.
fn two_leaves([hole, leaf]: [u8; 2], is_red_first: bool) -> Result<Scene, Failed> {
    let png = |pixel: &dyn Fn(u32, u32) -> [u8; 3]| -> Result<Vec<u8>, Failed> {
        let mut png = Vec::new();
        let image = RgbImage::from_fn(32, 16, |x, y| Rgb(pixel(x, y)));
        image.write_to(&mut Cursor::new(&mut png), ImageFormat::Png)?;
        Ok(png)
    };
    let colors = png(&|x, _| if x < 16 { [230, 20, 20] } else { [20, 20, 230] })?;
    let is_leaf = |x: u32, y: u32| (1..15).contains(&(x % 16)) && (1..15).contains(&y);
    let mask = png(&|x, y| if is_leaf(x, y) { [leaf; 3] } else { [hole; 3] })?;
    let face = |z: f64, half: f64, u: f64, first: usize| {
        let corners = [(-1.0, -1.0, 0.0, 0.0), (1.0, -1.0, 0.5, 0.0), (1.0, 1.0, 0.5, 1.0), (-1.0, 1.0, 0.0, 1.0)];
        let vertices = corners.map(|(x, y, s, t)| format!("v {} {} {z}\nvt {} {t}\n", x * half, y * half, u + s));
        let face: String = (first..first + 4).map(|corner| format!(" {corner}/{corner}")).collect();
        format!("{}f{face}\n", vertices.concat())
    };
    let (red, blue) = ((1.0, 1.0, 0.0), (-1.0, 3.5, 0.5));
    let [one, other] = if is_red_first { [red, blue] } else { [blue, red] };
    let faces = face(one.0, one.1, one.2, 1) + &face(other.0, other.1, other.2, 5);
    let fetch = |name: &str| match name {
        "a.mtl" => Ok(b"newmtl leaf\nmap_Kd leaf.png\nmap_d mask.png\n".to_vec()),
        "leaf.png" => Ok(colors.clone()),
        "mask.png" => Ok(mask.clone()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    let imported = obj::read("a.obj", format!("mtllib a.mtl\no tree\nusemtl leaf\n{faces}").as_bytes(), fetch)?;
    if !imported.warnings.is_empty() || imported.scene.object_count() != 1 {
        return Err(format!("{:?}", imported.warnings).into());
    }
    let mut scene = imported.scene;
    (scene.ambient, scene.cameras) = (Vec3::ONE, vec![leaf_camera()]);
    Ok(scene)
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

/// Squares of a random mask, so far away that a pixel is as wide as many of its texels. Each pixel is covered with the probability of a
/// cell of the mask, so the number of covered ones is within five standard deviations of their mean.
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

/// The pictures of a renderer that draws each scene in turn equal those of a renderer for each.
fn changing() -> Result<(), Failed> {
    let leaves = Leaf::crossing(12);
    let mut scene = leaf_objects(&leaves)?;
    let mut kept = Fixture::with(2, |builder| builder.deferred(colored()))?;
    let material = scene.assets().iter::<Material>().next().map(|(handle, material)| (handle, material.clone()));
    let (handle, mask) = material.ok_or("there is a material")?;
    let solid = Material { alpha_cutoff: None, ..mask.clone() };
    let glass = Material { blend: Blend::Alpha, opacity: 0.5, ..mask.clone() };
    let other = Material { texture: None, opacity: 0.2, ..mask.clone() };
    let mut pictures: Vec<Picture> = Vec::new();
    for material in [&mask, &solid, &glass, &other, &mask, &solid] {
        scene.replace(handle, material.clone())?;
        let found = kept.draw(&scene)?;
        let expected = Fixture::with(1, |builder| builder.deferred(colored()))?.draw(&scene)?;
        if found != expected || pictures.last() == Some(&found) {
            return Err(format!("{material:?} is not drawn in the frame in which it changes").into());
        }
        pictures.push(found);
    }
    if pictures[0] != pictures[4] || pictures[1] != pictures[5] {
        return Err("a material that is the same again looks different".into());
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
        let mut fixture = Fixture::with(2, |builder| builder.deferred(Deferred::to_picture()).quality(quality))?;
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

fn culled_and_in_pieces() -> Result<(), Failed> {
    let leaves = Leaf::crossing(30);
    let plain = leaf_objects(&leaves)?;
    let expected = Fixture::with(2, |builder| builder.deferred(colored()))?.draw(&plain)?;
    let culled = with_meshes(leaf_objects(&leaves)?, culled);
    let mut in_pieces = leaf_objects(&leaves)?;
    let objects: Vec<_> = in_pieces.objects().collect();
    in_pieces.pieces = vec![Piece::new("leaves", in_pieces.object_set(objects)?)];
    for (what, scene) in [("triangle culling", culled), ("a piece", in_pieces)] {
        let mut fixture = Fixture::with(2, |builder| builder.deferred(colored()).granularity(Granularity::Chunk(7)))?;
        for frame in 0..4 {
            if fixture.draw(&scene)? != expected {
                return Err(format!("{what} changes frame {frame}").into());
            }
        }
    }
    Ok(())
}
