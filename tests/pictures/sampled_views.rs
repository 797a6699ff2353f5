//! Views whose pictures other views show: mirrors, mirrors in mirrors, portals, and screens that all cameras see.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend, WgpuSubmission};
use drawloom::command::Selection;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::{
    CommandDraws, CpuShader, Declare, Deferred, Draws, InjectionPoint, ObjectCpuShader, ObjectPixel, PassInputs,
    RenderProcess, ShaderObject, VARYINGS, VertexInput, VertexOutput,
};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{
    Camera, ClipPlane, LayerMask, Light, Material, Projection, RenderObject, Scene, Topology, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer};
use drawloom_testing::scenes::{cube, sized, square};
use image::RgbImage;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::{Distance, as_image, assert_alike};

pub const CASES: &[Case] = &[
    ("a_mirror_shows_the_mirrored_scene", mirror),
    ("a_mirror_shows_the_same_in_software", mirror_in_software),
    ("mirrors_in_mirrors_end_where_no_camera_is_added", mirrors),
    ("a_portal_shows_what_is_at_its_exit", portal),
    ("two_cameras_see_their_own_reflections", two_cameras),
    ("a_screen_shows_the_same_to_every_camera", screen),
    ("screens_that_show_each_other_are_an_error_that_names_their_views", screens_in_each_other),
];

const SIZE: [u32; 2] = [96, 64];
/// The objects that are drawn with the picture of another view.
pub const SURFACE: LayerMask = LayerMask::layer(7);
const WORLD: LayerMask = LayerMask::layer(0);

/// Draws the objects of a layer with the picture of another view, at the same position of the picture or mirrored.
/// Black where there is no such view.
#[derive(Clone, Copy)]
pub struct Surface {
    name: &'static str,
    view: &'static str,
    mirrors: bool,
}

impl RenderProcess for Surface {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.also_views(ViewKind::Reflection);
        declare.at(InjectionPoint::AfterLighting);
        declare.samples_view(ViewKind::Reflection, self.view, "radiance");
        declare.draws_over("radiance");
        declare.matches_depth("depth");
    }

    fn draws(&self) -> Draws<'_> {
        let (shader, selection) = if self.mirrors {
            (include_str!("sampled_views/mirror.wgsl"), Selection::ALL.in_layers(SURFACE))
        } else {
            (include_str!("sampled_views/window.wgsl"), Selection::ALL.in_layers(SURFACE))
        };
        Draws::Commands(CommandDraws { shader, selection, ..CommandDraws::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::objects(*self))
    }
}

impl<R: Real> ObjectCpuShader<R> for Surface {
    fn vertex(&self, pass: &PassInputs<'_, R>, object: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexOutput<R> {
        let clip = pass.view.clip_position(object.relative_position(vertex.position));
        VertexOutput { clip, varyings: [R::zero(); VARYINGS] }
    }

    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &ObjectPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let [width, height] = pass.sampled[0].size();
        let [x, y] = pixel.coordinates;
        let x = if self.mirrors { width.saturating_sub(1 + x) } else { x };
        targets[0] = pass.sampled[0].load([x.min(width - 1), y.min(height - 1)], 0);
        true
    }
}

fn fixture(surface: Surface) -> Result<Fixture, Failed> {
    Fixture::with(2, |builder| builder.pipeline(Deferred::to_picture()).process(surface))
}

fn submitted(fixture: &mut Fixture, scene: &Scene) -> Result<WgpuSubmission, Failed> {
    let recorded = fixture.record(scene)?;
    fixture.submit(recorded)
}

pub const MIRROR: Surface = Surface { name: "mirror surface", view: "mirror", mirrors: true };
const WINDOW: Surface = Surface { name: "window surface", view: "window", mirrors: false };

/// Cubes in front of the plane z = -4 and behind it, in light that travels along the plane.
fn world(positions: &[(Vec3, DVec3)]) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    let mesh = scene.add(cube())?;
    for (color, position) in positions {
        let material = scene.add(Material { diffuse: *color, ..Material::default() })?;
        let mut object = RenderObject::new(mesh, material, *position);
        (object.scale, object.layers) = (Vec3::splat(0.4), WORLD);
        scene.add_object(object)?;
    }
    let direction = Vec3::new(0.6, -0.8, 0.0);
    scene.lights.push(Light::Directional { direction, illuminance: Vec3::splat(3.0), casts_shadow: false });
    scene.ambient = Vec3::splat(0.2);
    scene.background = Vec3::new(0.1, 0.2, 0.4);
    let camera = Camera::looking_at("main", DVec3::new(0.5, 0.4, 2.0), DVec3::new(0.0, 0.0, -4.0));
    let projection = Projection::Perspective { field_of_view: 0.5 };
    scene.cameras = vec![Camera { projection, ..sized(camera, SIZE) }];
    Ok(scene)
}

/// The mirror's plane, and the cubes in front of it.
pub const PLANE: ClipPlane = ClipPlane { point: DVec3::new(0.0, 0.0, -4.0), normal: Vec3::Z };
const NEAR: [(Vec3, DVec3); 2] =
    [(Vec3::X, DVec3::new(-0.9, 0.3, -1.5)), (Vec3::new(1.0, 0.8, 0.1), DVec3::new(0.8, -0.5, -2.6))];

/// Adds a square of 2.4 m at the plane.
fn add_surface(scene: &mut Scene, position: DVec3, orientation: Quat) -> Result<(), Failed> {
    let mesh = scene.add(square(Topology::TriangleList))?;
    let material = scene.add(Material { diffuse: Vec3::ZERO, ..Material::default() })?;
    let mut object = RenderObject::new(mesh, material, position);
    (object.layers, object.orientation, object.scale) = (SURFACE, orientation, Vec3::splat(1.2));
    scene.add_object(object)?;
    Ok(())
}

/// A mirror in front of a green cube, which is between the mirrored camera and the mirror.
pub fn mirror_scene() -> Result<Scene, Failed> {
    let hidden = (Vec3::Y, DVec3::new(0.1, 0.1, -6.0));
    let mut scene = world(&[NEAR[0], NEAR[1], hidden])?;
    add_surface(&mut scene, PLANE.point, Quat::IDENTITY)?;
    Ok(scene)
}

/// The picture by a camera, and whether each of its pixels shows the square.
fn inside_of_surface(camera: &Camera, position: DVec3) -> impl Fn(u32, u32) -> bool + '_ {
    let view = drawloom::view::RenderView::new(camera);
    let [right, up, forward] = view.picture_axes().map(|axis| axis.as_dvec3());
    move |x, y| {
        let [width, height] = camera.size.map(f64::from);
        // A pixel from the edge may be covered or not.
        [(-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0), (2.0, 2.0)].into_iter().all(|(dx, dy)| {
            let across = (f64::from(x) + dx) / width * 2.0 - 1.0;
            let above = 1.0 - (f64::from(y) + dy) / height * 2.0;
            let ray = right * across + up * above + forward;
            let hit = camera.position + ray * ((position.z - camera.position.z) / ray.z) - position;
            hit.x.abs() < 1.2 && hit.y.abs() < 1.2
        })
    }
}

/// The picture with what is not inside made black. Fails if fewer pixels than this are inside.
fn masked_of(picture: &Picture, inside: impl Fn(u32, u32) -> bool, min_count: usize) -> Result<RgbImage, Failed> {
    let mut image = as_image(picture)?;
    let mut count = 0;
    for (x, y, color) in image.enumerate_pixels_mut() {
        if inside(x, y) {
            count += 1;
        } else {
            *color = image::Rgb([0; 3]);
        }
    }
    if count < min_count { Err(format!("only {count} pixels show the surface").into()) } else { Ok(image) }
}

fn assert_alike_inside(one: &Picture, other: &Picture, inside: impl Fn(u32, u32) -> bool) -> Result<(), Failed> {
    let distance = Distance::between(&masked_of(one, &inside, 400)?, &masked_of(other, &inside, 400)?)?;
    if distance.is_within_bound() {
        Ok(())
    } else {
        Err(format!("the surface shows something else: {distance:?}").into())
    }
}

/// What the mirror shows, without a mirror: the cubes are mirrored themselves.
fn mirrored_world() -> Result<Scene, Failed> {
    let mirrored = NEAR.map(|(color, position)| (color, DVec3::new(position.x, position.y, -8.0 - position.z)));
    world(&mirrored)
}

fn mirror() -> Result<(), Failed> {
    let mut scene = mirror_scene()?;
    let camera = scene.cameras[0].clone();
    scene.cameras.push(camera.reflected("mirror", PLANE));
    scene.cameras[1].layers = WORLD;
    // The cubes in front of the mirror hide parts of it, so they are not drawn by the camera itself.
    let mut expected = mirrored_world()?;
    expected.cameras = vec![camera.clone()];
    let mut fixture = fixture(MIRROR)?;
    let submission = submitted(&mut fixture, &scene)?;
    let found = submission.read(0, "picture")?;
    let direct = submitted(&mut fixture, &without_surface(&scene)?)?.read(0, "picture")?;
    let expected = submitted(&mut fixture, &expected)?.read(0, "picture")?;
    let inside = inside_of_surface(&camera, PLANE.point);
    // Where the camera sees a cube in front of the mirror, it sees the cube.
    let shows_mirror = |x, y| inside(x, y) && pixel(&direct, x, y) == pixel(&direct, 0, 0);
    assert_alike_inside(&found, &expected, shows_mirror)?;
    let reflects = |x, y| shows_mirror(x, y) && pixel(&expected, x, y) != pixel(&expected, 0, 0);
    // That is not the background alone.
    masked_of(&found, reflects, 150).map(|_| ())
}

/// The scene without its last two objects: the hidden cube and the surface.
fn without_surface(scene: &Scene) -> Result<Scene, Failed> {
    let mut direct = world(&NEAR)?;
    direct.cameras = vec![scene.cameras[0].clone()];
    Ok(direct)
}

fn mirror_in_software() -> Result<(), Failed> {
    let mut scene = mirror_scene()?;
    let camera = scene.cameras[0].clone();
    scene.cameras.push(camera.reflected("mirror", PLANE));
    scene.cameras[1].layers = WORLD;
    let found = submitted(&mut fixture(MIRROR)?, &scene)?.read(0, "picture")?;
    let scheduler = Arc::new(Scheduler::new(1)?);
    let builder = Renderer::builder(SoftwareBackend::new(Arc::clone(&scheduler)));
    let (mut renderer, submitter) = builder.pipeline(Deferred::to_picture()).process(MIRROR).build(scheduler)?;
    let submission = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
    assert_alike(&found, &submission.read(0, "picture")?)?;
    // Without the camera the mirror is black, on both.
    scene.cameras.pop();
    let found = submitted(&mut fixture(MIRROR)?, &scene)?.read(0, "picture")?;
    let submission = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission;
    assert_alike(&found, &submission.read(0, "picture")?)?;
    let inside = inside_of_surface(&scene.cameras[0], PLANE.point);
    let blacks = (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y))).filter(|&(x, y)| inside(x, y));
    let blacks = blacks.filter(|&(x, y)| pixel(&found, x, y) == [0; 3]).count();
    if blacks > 300 { Ok(()) } else { Err(format!("{blacks} pixels of the mirror are black").into()) }
}

/// Two mirrors that face each other: each further camera shows a mirror in a mirror more.
fn mirrors() -> Result<(), Failed> {
    let mut scene = world(&NEAR)?;
    add_surface(&mut scene, PLANE.point, Quat::IDENTITY)?;
    let behind = ClipPlane { point: DVec3::new(0.0, 0.0, 4.0), normal: Vec3::NEG_Z };
    add_surface(&mut scene, behind.point, Quat::from_rotation_y(std::f32::consts::PI))?;
    let mut fixture = fixture(MIRROR)?;
    let (mut camera, mut blacks) = (scene.cameras[0].clone(), Vec::new());
    for depth in 0..5 {
        let submission = submitted(&mut fixture, &scene)?;
        let picture = submission.read(0, "picture")?;
        let every = (0..SIZE[0]).flat_map(|x| (0..SIZE[1]).map(move |y| (x, y)));
        blacks.push(every.filter(|&(x, y)| pixel(&picture, x, y) == [0; 3]).count());
        let plane = if depth % 2 == 0 { PLANE } else { behind };
        camera = camera.reflected("mirror", plane);
        // Backwards, so that the order of the cameras is not that of the views.
        scene.cameras.insert(1, camera.clone());
    }
    if blacks.is_sorted_by(|one, next| one > next) && blacks[4] > 0 {
        Ok(())
    } else {
        Err(format!("black pixels by the number of mirrors: {blacks:?}").into())
    }
}

fn portal() -> Result<(), Failed> {
    // The entry is where the mirror was; the exit is 50 m away and looks to the right.
    let exit = (DVec3::new(50.0, 0.0, 0.0), Quat::from_rotation_y(std::f32::consts::FRAC_PI_2));
    let entry = (PLANE.point, Quat::IDENTITY);
    let at_exit = |local: DVec3| exit.0 + exit.1.as_dquat() * local;
    let (red, yellow) = (at_exit(DVec3::new(-0.5, 0.2, 3.0)), at_exit(DVec3::new(0.6, -0.3, 2.0)));
    let between = at_exit(DVec3::new(0.0, 0.0, -2.0));
    let mut scene = world(&[(Vec3::X, red), (Vec3::new(1.0, 0.8, 0.1), yellow), (Vec3::Y, between)])?;
    scene.lights.clear();
    scene.ambient = Vec3::ONE;
    add_surface(&mut scene, entry.0, entry.1)?;
    let camera = scene.cameras[0].clone();
    scene.cameras.push(camera.through_portal("window", entry, exit));
    let mut fixture = fixture(WINDOW)?;
    let found = submitted(&mut fixture, &scene)?.read(0, "picture")?;
    // What is d metres out of the exit is seen d metres behind the entry, turned by half a turn.
    let behind_entry = |local: DVec3| entry.0 + DVec3::new(-local.x, local.y, -local.z);
    let positions = [(Vec3::X, DVec3::new(-0.5, 0.2, 3.0)), (Vec3::new(1.0, 0.8, 0.1), DVec3::new(0.6, -0.3, 2.0))];
    let mut expected = world(&positions.map(|(color, local)| (color, behind_entry(local))))?;
    expected.lights.clear();
    expected.ambient = Vec3::ONE;
    let expected = submitted(&mut fixture, &expected)?.read(0, "picture")?;
    let inside = inside_of_surface(&camera, entry.0);
    assert_alike_inside(&found, &expected, &inside)?;
    let background = pixel(&expected, 0, 0);
    masked_of(&expected, |x, y| inside(x, y) && pixel(&expected, x, y) != background, 150).map(|_| ())
}

fn two_cameras() -> Result<(), Failed> {
    let mut scene = mirror_scene()?;
    let other = Camera::looking_at("other", DVec3::new(-0.7, 0.2, 1.5), DVec3::new(0.1, 0.0, -4.0));
    scene.cameras.push(sized(other, SIZE));
    let mut alone = Vec::new();
    for index in 0..2 {
        let mut of_one = mirror_scene()?;
        let camera = scene.cameras[index].clone();
        of_one.cameras = vec![camera.clone(), camera.reflected("mirror", PLANE)];
        alone.push(submitted(&mut fixture(MIRROR)?, &of_one)?.read(0, "picture")?);
    }
    let reflections: Vec<_> = scene.cameras.iter().map(|camera| camera.reflected("mirror", PLANE)).collect();
    // The order is another one than that of the cameras that see them.
    scene.cameras.extend(reflections.into_iter().rev());
    let submission = submitted(&mut fixture(MIRROR)?, &scene)?;
    for (index, alone) in alone.iter().enumerate() {
        assert_alike(alone, &submission.read(index, "picture")?)?;
    }
    Ok(())
}

/// A camera that is no other camera's child, and a screen that shows its picture.
fn screen_scene() -> Result<Scene, Failed> {
    let mut scene = world(&NEAR)?;
    add_surface(&mut scene, PLANE.point, Quat::IDENTITY)?;
    let camera = Camera::looking_at("window", DVec3::new(-3.0, 1.0, -2.0), NEAR[1].1);
    scene.cameras.push(Camera { kind: ViewKind::Reflection, layers: WORLD, ..sized(camera, SIZE) });
    scene.cameras.push(Camera { name: "other".to_owned(), ..scene.cameras[0].clone() });
    Ok(scene)
}

fn screen() -> Result<(), Failed> {
    let scene = screen_scene()?;
    // Where the screen is, its picture is that of its camera.
    let mut fixture = fixture(WINDOW)?;
    let submission = submitted(&mut fixture, &scene)?;
    let (main, other) = (submission.read(0, "picture")?, submission.read(2, "picture")?);
    assert_alike(&main, &other)?;
    let mut direct = world(&NEAR)?;
    direct.cameras = vec![Camera { kind: ViewKind::Main, ..scene.cameras[1].clone() }];
    let expected = submitted(&mut fixture, &direct)?.read(0, "picture")?;
    let mut unhidden = world(&NEAR)?;
    unhidden.cameras = vec![scene.cameras[0].clone()];
    let unhidden = submitted(&mut fixture, &unhidden)?.read(0, "picture")?;
    let inside = inside_of_surface(&scene.cameras[0], PLANE.point);
    let shows_screen = |x, y| inside(x, y) && pixel(&unhidden, x, y) == pixel(&unhidden, 0, 0);
    assert_alike_inside(&main, &expected, shows_screen)
}

/// Both screens are drawn in both cameras' pictures.
fn screens_in_each_other() -> Result<(), Failed> {
    let mut scene = screen_scene()?;
    let other = Surface { name: "other surface", view: "other window", mirrors: false };
    let camera = Camera { name: "other window".to_owned(), ..scene.cameras[1].clone() };
    scene.cameras.push(camera);
    let mut fixture = Fixture::with(2, |builder| {
        builder.pipeline(Deferred::to_picture()).process(WINDOW).process(After { process: other, after: WINDOW.name })
    })?;
    match fixture.renderer.record(scene.as_scene_ref()) {
        Err(error @ FrameError::CircularViews(_))
            if error.to_string().contains("\\\"window") && error.to_string().contains("other window") =>
        {
            Ok(())
        }
        Err(error) => Err(format!("another error: {error}").into()),
        Ok(_) => Err("the frame was drawn".into()),
    }
}

/// A process that comes after another one.
struct After {
    process: Surface,
    after: &'static str,
}

impl RenderProcess for After {
    fn name(&self) -> &str {
        self.process.name()
    }

    fn declare(&self, declare: &mut Declare) {
        self.process.declare(declare);
        declare.after(self.after);
    }

    fn draws(&self) -> Draws<'_> {
        self.process.draws()
    }
}
