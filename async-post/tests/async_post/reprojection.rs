//! Where a late layer is looked up: compared with geometry in f64, which shares no code with the shaders.

use drawloom::RendererBuilder;
use drawloom::backend::{Picture, SoftwareBackend, WgpuBackend};
use drawloom::glam::{DQuat, DVec2, DVec3, Quat, Vec2, Vec3};
use drawloom::process::{Deferred, Format};
use drawloom::scene::{Camera, ClipPlane, Material, Projection, RenderObject, Scene};
use drawloom_async_post::{AsyncPost, AsyncStep, LayerReprojection, LayerSettings, StepFrame, StepSource};
use drawloom_testing::random::Random;
use drawloom_testing::scenes::{cube, sized};
use half::f16;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{DrawingBackend, Engine};

pub const ON_ADAPTER: &[Case] = &[
    ("a_layer_is_looked_up_where_the_surface_was", looked_up::<WgpuBackend>),
    ("a_layer_without_reprojection_stays_in_its_place", in_place::<WgpuBackend>),
];

pub const IN_SOFTWARE: &[Case] = &[
    ("software_a_layer_is_looked_up_where_the_surface_was", looked_up::<SoftwareBackend>),
    ("software_a_layer_without_reprojection_stays_in_its_place", in_place::<SoftwareBackend>),
];

/// A layer whose red and green are the coordinates in the layer, from (0, 0) to (1, 1): between pixels, too.
struct TextureCoordinates;

const LAYER: [u32; 2] = [256, 128];

impl AsyncStep for TextureCoordinates {
    fn name(&self) -> &str {
        "texture coordinates"
    }

    fn compute(&self, _frame: &StepFrame<'_>) -> Picture {
        let [width, height] = LAYER;
        let coordinate = |index: u32, count: u32| f16::from_f64((f64::from(index) + 0.5) / f64::from(count));
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
        let bytes = pixels.flat_map(|[x, y]| {
            let channels = [coordinate(x, width), coordinate(y, height), f16::ONE, f16::ONE];
            channels.into_iter().flat_map(f16::to_le_bytes)
        });
        Picture { width, height, format: Format::Rgba16Float, bytes: bytes.collect() }
    }
}

fn engine<B: DrawingBackend>(reprojection: LayerReprojection) -> Result<Engine<B>, Failed> {
    let layer = LayerSettings { reprojection, ..LayerSettings::default() };
    Engine::new(TextureCoordinates, StepSource::whole("depth"), |builder: RendererBuilder<B>, post: &AsyncPost| {
        builder.pipeline(Deferred::new().post(post.layer(layer)))
    })
}

/// Black cubes all around a point in the world.
fn scene(middle: DVec3, random: &mut Random) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(cube())?;
    let material = scene.add(Material { diffuse: Vec3::ZERO, ..Material::default() })?;
    for _ in 0..200 {
        let position = middle + random.direction() * random.between(3.0, 25.0);
        let orientation = Quat::from_axis_angle(random.direction().as_vec3().normalize(), 1.0);
        let cube = RenderObject { orientation, ..RenderObject::new(mesh, material, position) };
        scene.add_object(RenderObject { scale: random.vector(0.3, 1.5), ..cube })?;
    }
    scene.background = Vec3::ZERO;
    scene.ambient = Vec3::ZERO;
    Ok(scene)
}

/// Perspective on and off centre, with an oblique near plane, and parallel projection.
fn camera_of(kind: usize, position: DVec3, orientation: Quat) -> Camera {
    let camera = Camera { orientation, ..sized(Camera::looking_at("main", position, position + DVec3::X), [60, 40]) };
    let camera = Camera { position, ..camera };
    let ahead = position + (orientation * Vec3::NEG_Z).as_dvec3() * 0.7;
    let normal = (orientation * Vec3::new(0.3, 0.1, -0.9)).normalize();
    match kind {
        0 => camera,
        1 => Camera { shift: Vec2::new(0.7, -0.4), ..camera },
        2 => Camera { clip_plane: Some(ClipPlane { point: ahead, normal }), ..camera },
        _ => Camera { projection: Projection::Orthographic { height: 12.0 }, far: 40.0, ..camera },
    }
}

fn axes_of(camera: &Camera) -> DQuat {
    camera.orientation.as_dquat().normalize()
}

/// Half the picture's width and height: at a distance of 1 in perspective.
fn half_of(camera: &Camera) -> DVec2 {
    let half = match camera.projection {
        Projection::Perspective { field_of_view } => (f64::from(field_of_view) * 0.5).tan(),
        Projection::Orthographic { height } => f64::from(height) * 0.5,
        _ => unreachable!("no other projection is tried"),
    };
    DVec2::new(half * f64::from(camera.size[0]) / f64::from(camera.size[1]), half)
}

/// What a pixel shows.
enum Shown {
    At(DVec3),
    InDirection(DVec3),
}

/// Where what is at a depth in a pixel, at `clip`, is in the world.
fn shown(camera: &Camera, clip: DVec2, depth: f64) -> Shown {
    let (axes, half, shift) = (axes_of(camera), half_of(camera), camera.shift.as_dvec2());
    let near = f64::from(camera.near);
    if matches!(camera.projection, Projection::Orthographic { .. }) {
        let far = f64::from(camera.far);
        let distance = far - depth * (far - near);
        return Shown::At(camera.position + axes * (clip * half).extend(-distance));
    }
    let ray = |clip: DVec2| axes * ((clip + shift) * half).extend(-1.0);
    let toward = ray(clip);
    let inverse_distance = match camera.clip_plane {
        None => depth / near,
        Some(plane) => {
            // Depth is 1 - a normal · ray - a offset ÷ distance, and a the inverse of the largest normal · ray of the
            // corners.
            let normal = plane.normal.as_dvec3().normalize();
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(DVec2::from);
            let largest = corners.map(|corner| normal.dot(ray(corner))).into_iter().fold(0.0, f64::max);
            let offset = normal.dot(camera.position - plane.point);
            (depth - 1.0 + normal.dot(toward) / largest) * largest / -offset
        }
    };
    if inverse_distance > 0.0 {
        Shown::At(camera.position + toward / inverse_distance)
    } else {
        Shown::InDirection(toward)
    }
}

/// Where a camera shows something, in clip space; `None` if that is behind it.
fn projected(camera: &Camera, shown: &Shown) -> Option<DVec2> {
    let inverse = axes_of(camera).inverse();
    let is_parallel = matches!(camera.projection, Projection::Orthographic { .. });
    let local = match shown {
        Shown::At(position) => inverse * (*position - camera.position),
        Shown::InDirection(_) if is_parallel => return None,
        Shown::InDirection(direction) => inverse * *direction,
    };
    let across = DVec2::new(local.x, local.y) / half_of(camera);
    if is_parallel {
        return Some(across);
    }
    (local.z < 0.0).then(|| across / -local.z - camera.shift.as_dvec2())
}

/// The layer and the results are half floats, of up to 1, which are rounded by 2⁻¹² each, or 2⁻¹¹ by a device that
/// truncates; the device blends pixels with weights of 8 bits or more, which is 2⁻⁹ of a pixel.
const TOLERANCE: f64 = 1.0 / 1024.0;

fn looked_up<B: DrawingBackend>() -> Result<(), Failed> {
    let mut random = Random::new();
    // Of pixels that the layer shows, does not show, that are behind its camera, and infinitely far away.
    let mut counts = [0; 4];
    let modes = [LayerReprojection::ByDepth, LayerReprojection::ByDepthOrSamePlace, LayerReprojection::ByDepthOrNone];
    for mode in modes {
        let mut engine = engine::<B>(mode)?;
        for round in 0..8 {
            let middle = [DVec3::ZERO, DVec3::new(3e6, -2e5, 7e6)][round % 2];
            let mut scene = scene(middle, &mut random)?;
            let direction = random.direction().as_vec3().normalize();
            let orientation = Quat::from_rotation_arc(Vec3::NEG_Z, direction);
            let angle = [0.02, 0.4, 0.9, 3.0][round / 2] as f32;
            let turn = Quat::from_axis_angle(random.direction().as_vec3().normalize(), angle);
            let move_by = random.direction() * random.between(0.0, 1.0);
            let before = camera_of(random.below(4), middle, orientation);
            let now = camera_of(random.below(4), middle + move_by, (turn * orientation).normalize());
            scene.cameras = vec![before.clone()];
            engine.draw_and_wait(&scene, &["main"])?;
            scene.cameras = vec![now.clone()];
            let frame = engine.draw(&scene)?;
            let picture = B::read(&frame.submission, 0, "picture")?;
            let depth = B::read(&frame.submission, 0, "depth")?;
            check(mode, [&before, &now], &picture, &depth, &mut counts)?;
        }
        engine.check_no_errors()?;
    }
    if counts.iter().any(|count| *count < 300) {
        return Err(format!("too few pixels of a kind: {counts:?}").into());
    }
    Ok(())
}

/// Compares where each pixel was looked up with where its surface was.
fn check(
    mode: LayerReprojection,
    [before, now]: [&Camera; 2],
    picture: &Picture,
    depth: &Picture,
    counts: &mut [usize; 4],
) -> Result<(), Failed> {
    let size = DVec2::new(f64::from(picture.width), f64::from(picture.height));
    for (index, (pixel, depth)) in picture.bytes.chunks_exact(8).zip(depth.bytes.chunks_exact(4)).enumerate() {
        let found = [0, 2].map(|byte| f16::from_le_bytes([pixel[byte], pixel[byte + 1]]).to_f64());
        let found = DVec2::from(found);
        let there = f16::from_le_bytes([pixel[4], pixel[5]]).to_f64();
        let depth = f64::from(f32::from_le_bytes(depth.try_into()?));
        let center = DVec2::new((index as u32 % picture.width) as f64, (index as u32 / picture.width) as f64) + 0.5;
        let clip = (center / size * 2.0 - 1.0) * DVec2::new(1.0, -1.0);
        let shown = shown(now, clip, depth);
        let place = |clip: DVec2| clip * DVec2::new(0.5, -0.5) + 0.5;
        let projected = projected(before, &shown);
        let is_near_edge = |clip: DVec2| (clip.abs().max_element() - 1.0).abs() < 0.01;
        if projected.is_some_and(is_near_edge) {
            continue;
        }
        let within = projected.filter(|clip| clip.abs().max_element() < 1.0);
        counts[if within.is_some() {
            0
        } else if projected.is_some() {
            1
        } else {
            2
        }] += 1;
        counts[3] += usize::from(matches!(shown, Shown::InDirection(_)));
        let expected = match (within, projected, mode) {
            (Some(within), ..) => Some(place(within)),
            (_, _, LayerReprojection::ByDepthOrNone) => None,
            (None, Some(beside), LayerReprojection::ByDepth) => Some(place(beside)),
            _ => Some(place(clip)),
        };
        // The layer's outer pixels have no neighbours to be blended with.
        let half_pixel = DVec2::new(0.5 / f64::from(LAYER[0]), 0.5 / f64::from(LAYER[1]));
        let expected = expected.map(|place| place.clamp(half_pixel, 1.0 - half_pixel));
        let is_right = match expected {
            Some(expected) => there == 1.0 && (found - expected).abs().max_element() < TOLERANCE,
            None => there == 0.0 && found == DVec2::ZERO,
        };
        if !is_right {
            let pixel = center - 0.5;
            return Err(format!("{mode:?}, {pixel}: {found} instead of {expected:?}\n{before:?}\n{now:?}").into());
        }
    }
    Ok(())
}

fn in_place<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = engine::<B>(LayerReprojection::None)?;
    let mut scene = scene(DVec3::ZERO, &mut Random::new())?;
    for turn in [0.0, 1.0] {
        scene.cameras = vec![camera_of(0, DVec3::ZERO, Quat::from_rotation_y(turn))];
        engine.draw_and_wait(&scene, &["main"])?;
    }
    let picture = B::read(&engine.draw(&scene)?.submission, 0, "picture")?;
    let texels = picture;
    for y in 0..texels.height {
        for x in 0..texels.width {
            let start = (y * texels.width + x) as usize * 8;
            let found = [0, 2].map(|byte| f16::from_le_bytes([0, 1].map(|next| texels.bytes[start + byte + next])));
            let found = DVec2::from(found.map(f16::to_f64));
            let expected = (DVec2::new(f64::from(x), f64::from(y)) + 0.5)
                / DVec2::new(f64::from(texels.width), f64::from(texels.height));
            if (found - expected).abs().max_element() > TOLERANCE {
                return Err(format!("pixel {x}, {y} is looked up at {found}").into());
            }
        }
    }
    engine.check_no_errors()
}
