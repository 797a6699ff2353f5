//! Leaves that cross each other: what covers what, against rays in f64.

use std::io::{self, Cursor};

use drawloom::Granularity;
use drawloom::backend::Picture;
use drawloom::glam::{DVec3, EulerRot, Quat, Vec3};
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Deferred, Deformation, DeformationCpuShader, Draws, Format, MaskedEntryPoints,
    PassInputs, RenderProcess, ShaderObject, VertexInput,
};
use drawloom::quality::Quality;
use drawloom::raster::Real;
use drawloom::scene::{
    Blend, Camera, LayerMask, LevelOfDetail, Material, Mesh, Projection, RenderObject, Scene, StaticGroup, Topology,
    VERTEX_COLOR, Vertex,
};
use drawloom_testing::scenes::{cube, culled, sized, with_meshes};
use fastrand::Rng;
use image::{ImageFormat, Rgb, RgbImage};
use libtest_mimic::Failed;

use super::{CELLS, mask_material, on_each_backend};
use crate::fixture::{Fixture, half_floats};

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

pub(super) fn any_order() -> Result<(), Failed> {
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

/// Draws depth with a vertex and a fragment shader of its own for masked objects.
struct OwnPrePass;

impl RenderProcess for OwnPrePass {
    fn name(&self) -> &str {
        "own pre-pass"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_depth("depth", Format::Depth32Float);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws {
            shader: "
                @vertex
                fn vertex(in: VertexInput) -> @invariant @builtin(position) vec4<f32> {
                    return clip_position(relative_position(drawn_object(in.instance), in.position));
                }

                struct Corner {
                    @invariant @builtin(position) position: vec4<f32>,
                    @location(0) uv: vec2<f32>,
                    @location(1) @interpolate(flat) material: u32,
                }

                @vertex
                fn masked_vertex(in: VertexInput) -> Corner {
                    let object = drawn_object(in.instance);
                    let position = clip_position(relative_position(object, in.position));
                    return Corner(position, bounded_uv(in.uv), object.material);
                }

                @fragment
                fn masked_fragment(in: Corner) {
                    if is_cut_out(materials[in.material], in.uv) {
                        discard;
                    }
                }
            ",
            fragment: None,
            masked: Some(MaskedEntryPoints { vertex: "masked_vertex", fragment: "masked_fragment" }),
            ..CommandDraws::default()
        })
    }
}

/// A pre-pass of the engine's, whose depth the shipped geometry buffer must match.
pub(super) fn own_pre_pass() -> Result<(), Failed> {
    let mut scene = leaf_objects(&Leaf::crossing(20))?;
    let stone = scene.add(Material::default())?;
    let mesh = scene.add(cube())?;
    scene.add_object(RenderObject::new(mesh, stone, DVec3::ZERO))?;
    let deferred = || colored().depth_pre_pass(true);
    let drawn = |deferred: Deferred| Fixture::with(2, |builder| builder.pipeline(deferred))?.draw(&scene);
    let expected = drawn(deferred())?;
    if drawn(deferred().replace("depth pre-pass", OwnPrePass))? != expected {
        return Err("the engine's pre-pass changes the picture".into());
    }
    Ok(())
}

pub(super) fn one_object() -> Result<(), Failed> {
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

/// Two leaves of one object, a red one before a blue one, whose mask has the values that a program leaves in its holes
/// and in its leaves.
pub(super) fn leaves_of_a_file() -> Result<(), Failed> {
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
    let imported =
        drawloom_obj::read("a.obj", format!("mtllib a.mtl\no tree\nusemtl leaf\n{faces}").as_bytes(), fetch)?;
    if !imported.warnings.is_empty() || imported.scene.object_count() != 1 {
        return Err(format!("{:?}", imported.warnings).into());
    }
    let mut scene = imported.scene;
    (scene.ambient, scene.cameras) = (Vec3::ONE, vec![leaf_camera()]);
    Ok(scene)
}

/// The pictures of a renderer that draws each scene in turn equal those of a renderer for each.
pub(super) fn changing() -> Result<(), Failed> {
    let leaves = Leaf::crossing(12);
    let mut scene = leaf_objects(&leaves)?;
    let mut kept = Fixture::with(2, |builder| builder.pipeline(colored()))?;
    let material = scene.assets().iter::<Material>().next().map(|(handle, material)| (handle, material.clone()));
    let (handle, mask) = material.ok_or("there is a material")?;
    let solid = Material { alpha_cutoff: None, ..mask.clone() };
    let glass = Material { blend: Blend::Alpha, opacity: 0.5, ..mask.clone() };
    let other = Material { texture: None, opacity: 0.2, ..mask.clone() };
    let mut pictures: Vec<Picture> = Vec::new();
    for material in [&mask, &solid, &glass, &other, &mask, &solid] {
        scene.replace(handle, material.clone())?;
        let found = kept.draw(&scene)?;
        let expected = Fixture::with(1, |builder| builder.pipeline(colored()))?.draw(&scene)?;
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

/// Moves no vertex of any object.
struct Still;

impl Deformation for Still {
    fn name(&self) -> &str {
        "still"
    }

    fn layers(&self) -> LayerMask {
        LayerMask::ALL
    }

    fn declare(&self, _: &mut Declare) {}

    fn shader(&self) -> &str {
        "fn deform(in: VertexInput, object: Object) -> VertexInput { return in; }"
    }

    fn cpu_shader(&self, process: CpuShader) -> Option<CpuShader> {
        Some(process.deformed(Still))
    }
}

impl<R: Real> DeformationCpuShader<R> for Still {
    fn deform(&self, _: &PassInputs<'_, R>, _: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexInput<R> {
        *vertex
    }
}

pub(super) fn culled_in_static_groups_and_deformed() -> Result<(), Failed> {
    let leaves = Leaf::crossing(30);
    let plain = leaf_objects(&leaves)?;
    let expected = Fixture::with(2, |builder| builder.pipeline(colored()))?.draw(&plain)?;
    let culled = with_meshes(leaf_objects(&leaves)?, culled);
    let mut in_static_groups = leaf_objects(&leaves)?;
    let objects: Vec<_> = in_static_groups.objects().collect();
    in_static_groups.static_groups = vec![StaticGroup::new("leaves", in_static_groups.object_set(objects)?)];
    for deferred in [colored(), colored().depth_pre_pass(true)] {
        let expected = on_each_backend(&deferred, &plain)?;
        if on_each_backend(&deferred.deformation(Still), &plain)? != expected {
            return Err("a deformation that moves nothing changes the picture".into());
        }
    }
    for (what, scene) in [("triangle culling", culled), ("a static group", in_static_groups)] {
        let mut fixture = Fixture::with(2, |builder| builder.pipeline(colored()).granularity(Granularity::Chunk(7)))?;
        for frame in 0..4 {
            if fixture.draw(&scene)? != expected {
                return Err(format!("{what} changes frame {frame}").into());
            }
        }
    }
    Ok(())
}

/// Leaves of four triangles each, whose coarse level has two.
pub(super) fn coarse_levels() -> Result<(), Failed> {
    let leaves = Leaf::crossing(40);
    let corners = |leaf: &Leaf| {
        let corners = leaf.corners(DVec3::ZERO);
        let position = leaf.center.as_vec3().to_array();
        let middle = Vertex { position, uv: [0.5; 2], ..corners[0] };
        [corners, vec![middle]].concat()
    };
    let indices = |pattern: &[u32]| {
        (0..40).flat_map(|leaf| pattern.iter().map(move |corner| leaf * 5 + corner)).collect::<Vec<_>>()
    };
    let (fine, coarse) = (indices(&[0, 1, 4, 1, 3, 4, 3, 2, 4, 2, 0, 4]), indices(&[0, 1, 2, 2, 1, 3]));
    let colors: Vec<_> = leaves.iter().flat_map(|leaf| [leaf.color; 5]).collect();
    let vertices = leaves.iter().flat_map(corners).collect();
    let mesh = Mesh::new("leaves", Topology::TriangleList, vertices, fine)?.with_attribute(VERTEX_COLOR, &colors)?;
    let mut scene = white_room();
    let material = mask_material(&mut scene)?;
    let material = scene.add(material)?;
    let mesh = scene.add(mesh.with_levels([LevelOfDetail::new(coarse, 1e-3)])?)?;
    scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
    for (level_of_detail, triangles) in [(0.0, 160), (10.0, 80)] {
        let quality = Quality { level_of_detail, ..Quality::balanced() };
        let mut fixture = Fixture::with(2, |builder| builder.pipeline(colored()).quality(quality))?;
        let recorded = fixture.record(&scene)?;
        let drawn = recorded.statistics().views[0].levels_of_detail.map_or(160, |levels| levels.triangles);
        if drawn != triangles {
            return Err(format!("{drawn} triangles are drawn, not {triangles}").into());
        }
        expect_nearest(&leaves, &fixture.submit(recorded)?.read(0, "radiance")?)?;
    }
    Ok(())
}
