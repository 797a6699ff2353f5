//! NaN, infinities, subnormals, zeros of both signs and the ends of f32, in every number that a scene has.

use drawloom::FrameError;
use drawloom::backend::BackendError;
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{
    Bounds, Camera, Light, Material, Mesh, Projection, RenderObject, Scene, SceneError, Texture, Topology, Vertex,
};
use drawloom::view::RejectionReason;
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::signs::told;
use crate::special::{SPECIAL, SPECIAL_PLACES};
use crate::stage::{Drawn, Outcome, Studio};

pub const CASES: &[Case] = &[
    ("an_objects_numbers", objects),
    ("a_cameras_numbers", cameras),
    ("a_lights_numbers", lights),
    ("ambient_and_background", surroundings),
    ("a_materials_numbers", materials),
    ("a_vertexs_numbers", vertices),
];

/// What is to become of a scene with a number in it that is none, or hardly.
enum Expected {
    /// It is drawn, and nothing is left out.
    Drawn,
    /// It is drawn without what has that number.
    Without(RejectionReason),
    /// It is refused because of its camera.
    InvalidCamera,
    /// It is refused because of its camera's place.
    OutOfReach,
    /// It is refused because of a colour.
    InvalidColor,
}

/// What is to become of a scene with a special number somewhere.
type Rule<T> = (&'static str, fn(&mut Stand, T), fn(T) -> Expected);

/// A witness on the left that must be seen whatever the subject on the right is like, and every kind of light on the subject.
struct Stand {
    scene: Scene,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
}

const WITNESS: [f64; 3] = [0.0, 0.75, 0.125];

/// Where the witness and the subject are seen.
const WITNESS_PIXEL: [usize; 2] = [14, 16];
const SUBJECT_PIXEL: [usize; 2] = [33, 16];

impl Stand {
    fn new() -> Result<Self, Failed> {
        Self::with(square(Topology::TriangleList), Material { diffuse: Vec3::splat(0.5), ..Material::default() }, None)
    }

    /// With another subject.
    fn with(mesh: Mesh, material: Material, texture: Option<Texture>) -> Result<Self, Failed> {
        let mut scene = Scene::new();
        scene.cameras = vec![sized(Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z), [48, 32])];
        scene.ambient = Vec3::splat(0.25);
        let glow = Material { diffuse: Vec3::ZERO, emission: Vec3::new(0.0, 0.75, 0.125), ..Material::default() };
        let glow = scene.add(glow)?;
        let own = scene.add(square(Topology::TriangleList))?;
        scene.add_object(RenderObject::new(own, glow, DVec3::new(-1.75, 0.0, -5.0)))?;
        let texture = texture.map(|texture| scene.add(texture)).transpose()?;
        let (mesh, material) = (scene.add(mesh)?, scene.add(Material { texture, ..material })?);
        scene.add_object(RenderObject::new(mesh, material, DVec3::new(1.75, 0.0, -5.0)))?;
        let (position, intensity) = (DVec3::new(1.0, 1.0, -3.5), Vec3::ONE);
        let (direction, casts_shadow) = (Vec3::NEG_Z, true);
        scene.lights = vec![
            Light::Point { position, intensity, range: 10.0 },
            Light::Spot {
                position,
                direction,
                intensity,
                range: 9.0,
                inner_angle: 0.3,
                outer_angle: 0.9,
                casts_shadow,
            },
            Light::Hemispherical { position, direction, intensity, range: 8.0, casts_shadow },
            Light::Directional { direction, illuminance: Vec3::splat(0.5), casts_shadow },
        ];
        let parts = scene.as_scene_ref();
        let (positions, orientations) = (parts.positions.to_vec(), parts.orientations.to_vec());
        let (scales, bounds) = (parts.scales.to_vec(), parts.bounds.to_vec());
        Ok(Self { scene, positions, orientations, scales, bounds })
    }

    fn subject(&mut self) -> (&mut DVec3, &mut Quat, &mut Vec3, &mut Bounds) {
        (&mut self.positions[1], &mut self.orientations[1], &mut self.scales[1], &mut self.bounds[1])
    }

    fn camera(&mut self) -> &mut Camera {
        &mut self.scene.cameras[0]
    }

    /// Draws it as an engine would that keeps its own objects.
    fn outcome(&self, studio: &mut Studio) -> Result<Outcome, Failed> {
        let Self { scene, positions, orientations, scales, bounds } = self;
        studio.outcome(&drawloom::scene::SceneRef { positions, orientations, scales, bounds, ..scene.as_scene_ref() })
    }

    /// Whether the witness is where it belongs.
    fn check_witness(&self, drawn: &Drawn) -> Result<(), Failed> {
        let Some(look) = &drawn.look else { return Ok(()) };
        let [x, y] = WITNESS_PIXEL;
        let found = look.radiance(x, y);
        let is_right = found.into_iter().zip(WITNESS).all(|(found, expected)| (found - expected).abs() < 1e-3);
        if is_right { Ok(()) } else { Err(format!("the witness is {found:?}").into()) }
    }
}

/// Draws with each number, by each rule, and the same scene as it should be after each.
fn check<T: Copy + std::fmt::Debug>(studio: &mut Studio, numbers: &[T], rules: &[Rule<T>]) -> Result<(), Failed> {
    for (name, put, expected) in rules {
        for &number in numbers {
            let mut stand = Stand::new()?;
            put(&mut stand, number);
            // A camera that sees other things is no witness.
            let has_witness = !name.starts_with("camera");
            check_one(studio, &stand, expected(number), has_witness)
                .map_err(|failed| told(&format!("{name} = {number:?}"), failed))?;
        }
        let whole = Stand::new()?;
        check_one(studio, &whole, Expected::Drawn, true).map_err(|failed| told(&format!("after {name}"), failed))?;
    }
    Ok(())
}

fn check_one(studio: &mut Studio, stand: &Stand, expected: Expected, has_witness: bool) -> Result<(), Failed> {
    match (stand.outcome(studio)?, expected) {
        (Outcome::Drawn(drawn), expected @ (Expected::Drawn | Expected::Without(_))) => {
            // It says that something is drawn less well than asked, not that it is left out.
            let left_out = drawn.rejections.iter().filter(|told| told.reason != RejectionReason::CoarseEdges);
            let told: Vec<_> = left_out.map(|told| told.reason).collect();
            let wanted = if let Expected::Without(reason) = expected { vec![reason] } else { Vec::new() };
            if told != wanted {
                return Err(format!("left out: {told:?}").into());
            }
            if has_witness { stand.check_witness(&drawn) } else { Ok(()) }
        }
        (Outcome::Refused(FrameError::Scene(SceneError::InvalidCamera { camera, .. })), Expected::InvalidCamera)
            if camera == "main" =>
        {
            Ok(())
        }
        (Outcome::Refused(FrameError::Backend(BackendError::ViewOutOfReach { .. })), Expected::OutOfReach) => Ok(()),
        (Outcome::Refused(FrameError::Scene(SceneError::InvalidColor { .. })), Expected::InvalidColor) => Ok(()),
        (Outcome::Refused(error), _) => Err(format!("it was refused: {error}").into()),
        (Outcome::NotSubmitted(error), _) => Err(format!("it was not submitted: {error}").into()),
        (Outcome::Drawn(drawn), _) => Err(format!("it was drawn, without {:?}", drawn.rejections).into()),
    }
}

/// How far places may be from the origin.
fn is_within_reach(number: f64) -> bool {
    number.abs() < drawloom::view::FixedPosition::MAX_COORDINATE
}

fn objects(studio: &mut Studio) -> Result<(), Failed> {
    let place = |number: f64| match number {
        _ if !number.is_finite() => Expected::Without(RejectionReason::InvalidTransform),
        _ if is_within_reach(number) => Expected::Drawn,
        _ => Expected::Without(RejectionReason::OutOfReach),
    };
    check(
        studio,
        &SPECIAL_PLACES,
        &[
            ("position.x", |stand, number| stand.subject().0.x = number, place),
            ("position.z", |stand, number| stand.subject().0.z = number, place),
        ],
    )?;
    let orientation = |number: f32| {
        if number.abs() < 0.01 { Expected::Drawn } else { Expected::Without(RejectionReason::InvalidTransform) }
    };
    let scale = |number: f32| match number {
        _ if !number.is_finite() => Expected::Without(RejectionReason::InvalidTransform),
        _ if number.abs() == f32::MAX => Expected::Without(RejectionReason::InvalidBounds),
        _ => Expected::Drawn,
    };
    let radius = |number: f32| {
        let is_fine = (0.0..1.0).contains(&number);
        if is_fine { Expected::Drawn } else { Expected::Without(RejectionReason::InvalidBounds) }
    };
    let center = |number: f32| {
        if number.abs() < 1.0 { Expected::Drawn } else { Expected::Without(RejectionReason::InvalidBounds) }
    };
    check(
        studio,
        &SPECIAL,
        &[
            ("orientation.x", |stand, number| stand.subject().1.x = number, orientation),
            ("orientation.w", |stand, number| *stand.subject().1 = Quat::from_xyzw(0.0, 1.0, 0.0, number), orientation),
            ("scale.x", |stand, number| stand.subject().2.x = number, scale),
            ("scale", |stand, number| *stand.subject().2 = Vec3::splat(number), scale),
            ("bounds.radius", |stand, number| stand.subject().3.radius = number, radius),
            ("bounds.center.y", |stand, number| stand.subject().3.center.y = number, center),
        ],
    )
}

fn cameras(studio: &mut Studio) -> Result<(), Failed> {
    check(
        studio,
        &SPECIAL_PLACES,
        &[("camera's position.y", |stand, number| stand.camera().position.y = number, {
            |number: f64| match number {
                _ if !number.is_finite() => Expected::InvalidCamera,
                _ if is_within_reach(number) => Expected::Drawn,
                _ => Expected::OutOfReach,
            }
        })],
    )?;
    let small = |number: f32| if number.abs() < 0.01 { Expected::Drawn } else { Expected::InvalidCamera };
    check(
        studio,
        &SPECIAL,
        &[
            ("camera's orientation.x", |stand, number| stand.camera().orientation.x = number, small),
            (
                "camera's near",
                |stand, number| stand.camera().near = number,
                |number| {
                    // Behind it there is nothing; but it is a distance.
                    if number == f32::MAX || number == 1e-20 { Expected::Drawn } else { Expected::InvalidCamera }
                },
            ),
            (
                "camera's far",
                |stand, number| stand.camera().far = number,
                |number| {
                    if number > 0.05 { Expected::Drawn } else { Expected::InvalidCamera }
                },
            ),
            (
                "camera's field of view",
                |stand, number| stand.camera().projection = Projection::Perspective { field_of_view: number },
                |_| Expected::InvalidCamera,
            ),
            (
                "camera's height",
                |stand, number| {
                    stand.camera().far = 100.0;
                    stand.camera().projection = Projection::Orthographic { height: number };
                },
                |number| if number == f32::MAX { Expected::Drawn } else { Expected::InvalidCamera },
            ),
        ],
    )
}

/// Changes the lights that have a place; the sun has none.
fn change(stand: &mut Stand, one: usize, by: impl Fn(&mut DVec3, &mut Vec3, &mut f32)) {
    if let Light::Point { position, intensity, range }
    | Light::Spot { position, intensity, range, .. }
    | Light::Hemispherical { position, intensity, range, .. } = &mut stand.scene.lights[one]
    {
        by(position, intensity, range);
    }
}

fn lights(studio: &mut Studio) -> Result<(), Failed> {
    const POINT: usize = 0;
    const SPOT: usize = 1;
    const HEMISPHERE: usize = 2;
    let place = |number: f64| match number {
        _ if !number.is_finite() => Expected::Without(RejectionReason::InvalidLight),
        _ if is_within_reach(number) => Expected::Drawn,
        _ => Expected::Without(RejectionReason::LightOutOfReach),
    };
    check(
        studio,
        &SPECIAL_PLACES,
        &[
            ("point light's position", |stand, number| change(stand, POINT, |place, _, _| place.x = number), place),
            ("spot light's position", |stand, number| change(stand, SPOT, |place, _, _| place.y = number), place),
            ("hemisphere's position", |stand, number| change(stand, HEMISPHERE, |place, _, _| place.z = number), place),
        ],
    )?;
    let color = |number: f32| {
        let is_fine = number >= 0.0 && number.is_finite();
        if is_fine { Expected::Drawn } else { Expected::Without(RejectionReason::InvalidLight) }
    };
    let whole_color = |number: f32| match number {
        0.0 => Expected::Without(RejectionReason::DarkLight),
        _ if number > 0.0 && number.is_finite() => Expected::Drawn,
        _ => Expected::Without(RejectionReason::InvalidLight),
    };
    let range = |number: f32| {
        let is_fine = number > 0.0 && number.is_finite();
        if is_fine { Expected::Drawn } else { Expected::Without(RejectionReason::InvalidLight) }
    };
    let direction = |number: f32| {
        if number.abs() < 0.01 { Expected::Drawn } else { Expected::Without(RejectionReason::InvalidLight) }
    };
    check(
        studio,
        &SPECIAL,
        &[
            ("point light's red", |stand, number| change(stand, POINT, |_, color, _| color.x = number), color),
            ("spot light's red", |stand, number| change(stand, SPOT, |_, color, _| color.x = number), color),
            ("hemisphere's red", |stand, number| change(stand, HEMISPHERE, |_, color, _| color.x = number), color),
            (
                "point light's all",
                |stand, number| change(stand, POINT, |_, color, _| *color = Vec3::splat(number)),
                whole_color,
            ),
            (
                "sun's illuminance",
                |stand, number| {
                    if let Light::Directional { illuminance, .. } = &mut stand.scene.lights[3] {
                        *illuminance = Vec3::splat(number);
                    }
                },
                whole_color,
            ),
            ("point light's range", |stand, number| change(stand, POINT, |_, _, range| *range = number), range),
            ("spot light's range", |stand, number| change(stand, SPOT, |_, _, range| *range = number), range),
            ("hemisphere's range", |stand, number| change(stand, HEMISPHERE, |_, _, range| *range = number), range),
            (
                "directions",
                |stand, number| {
                    stand.scene.lights.truncate(3);
                    stand.scene.lights.swap_remove(0);
                    if let Light::Spot { direction, .. } = &mut stand.scene.lights[1] {
                        direction.x = number;
                    }
                },
                direction,
            ),
            (
                "sun's direction",
                |stand, number| {
                    if let Light::Directional { direction, .. } = &mut stand.scene.lights[3] {
                        direction.y = number;
                    }
                },
                direction,
            ),
            (
                "inner angle",
                |stand, number| {
                    if let Light::Spot { inner_angle, .. } = &mut stand.scene.lights[SPOT] {
                        *inner_angle = number;
                    }
                },
                |number| {
                    if (0.0..0.1).contains(&number) {
                        Expected::Drawn
                    } else {
                        Expected::Without(RejectionReason::InvalidLight)
                    }
                },
            ),
            (
                "outer angle",
                |stand, number| {
                    if let Light::Spot { outer_angle, .. } = &mut stand.scene.lights[SPOT] {
                        *outer_angle = number;
                    }
                },
                |_| Expected::Without(RejectionReason::InvalidLight),
            ),
        ],
    )
}

fn surroundings(studio: &mut Studio) -> Result<(), Failed> {
    let color = |number: f32| {
        if number >= 0.0 && number.is_finite() { Expected::Drawn } else { Expected::InvalidColor }
    };
    check(
        studio,
        &SPECIAL,
        &[
            ("ambient", |stand, number| stand.scene.ambient.y = number, color),
            ("background", |stand, number| stand.scene.background.z = number, color),
            (
                "both",
                |stand, number| {
                    (stand.scene.ambient, stand.scene.background) = (Vec3::splat(number), Vec3::splat(number));
                },
                color,
            ),
        ],
    )
}

/// Puts a number into a material.
type Put = fn(&mut Material, f32);

fn materials(studio: &mut Studio) -> Result<(), Failed> {
    let puts: [(&str, Put); 5] = [
        ("diffuse.x", |material, number| material.diffuse.x = number),
        ("diffuse", |material, number| material.diffuse = Vec3::splat(number)),
        ("emission.y", |material, number| material.emission.y = number),
        ("emission", |material, number| material.emission = Vec3::splat(number)),
        ("opacity", |material, number| material.opacity = number),
    ];
    for (name, put) in puts {
        for blend in [
            drawloom::scene::Blend::None,
            drawloom::scene::Blend::Alpha,
            drawloom::scene::Blend::Additive,
            drawloom::scene::Blend::Subtractive,
        ] {
            for number in SPECIAL {
                let what = format!("{name} = {number:e}, {blend:?}");
                let mut material = Material { blend, ..Material::default() };
                put(&mut material, number);
                let most = if name == "opacity" { 1.0 } else { f32::MAX };
                let is_fine = (0.0..=most).contains(&number);
                let stand = Stand::with(square(Topology::TriangleList), material.clone(), None);
                match (stand, is_fine) {
                    (Ok(stand), true) => {
                        check_one(studio, &stand, Expected::Drawn, true).map_err(|failed| told(&what, failed))?;
                    }
                    (Err(_), false) => {
                        let error = Scene::new().add(material).err();
                        if !matches!(error, Some(SceneError::InvalidMaterial { .. })) {
                            return Err(format!("{what}: {error:?}").into());
                        }
                    }
                    (Ok(_), false) => return Err(format!("{what}: it was taken").into()),
                    (Err(failed), true) => return Err(told(&what, failed)),
                }
            }
        }
    }
    Ok(())
}

/// Puts a number into a vertex.
type PutVertex = fn(&mut Vertex, f32);

fn vertices(studio: &mut Studio) -> Result<(), Failed> {
    let red = || Texture::new("red", 4, 4, [255, 0, 0, 255].repeat(16));
    let puts: [(&str, PutVertex); 7] = [
        ("uv.u", |vertex, number| vertex.uv[0] = number),
        ("uv", |vertex, number| vertex.uv = [number; 2]),
        ("uv, all but one", |vertex, number| vertex.uv = if vertex.uv == [0.0; 2] { [0.5; 2] } else { [number; 2] }),
        ("normal.x", |vertex, number| vertex.normal[0] = number),
        ("normal", |vertex, number| vertex.normal = [0.0, 0.0, number.abs()]),
        ("normal, all", |vertex, number| vertex.normal = [number, number, number]),
        ("position.z", |vertex, number| vertex.position[2] = number),
    ];
    for (name, put) in puts {
        for number in SPECIAL {
            let what = format!("{name} = {number:e}");
            let plain = square(Topology::TriangleList);
            let mut changed = plain.vertices().to_vec();
            changed.iter_mut().for_each(|vertex| put(vertex, number));
            let mesh = Mesh::new("changed", plain.topology(), changed, plain.indices().to_vec());
            let mesh = match mesh {
                Err(SceneError::NonFiniteVertex { vertex: 0, .. }) if !number.is_finite() => continue,
                Err(SceneError::NonFiniteVertex { vertex: 1, .. }) if !number.is_finite() => continue,
                Err(error) => return Err(format!("{what}: {error}").into()),
                Ok(_) if !number.is_finite() => return Err(format!("{what}: it was taken").into()),
                Ok(mesh) => mesh,
            };
            let is_far = name.starts_with("position") && number.abs() == f32::MAX;
            let expected = if is_far { Expected::Without(RejectionReason::InvalidBounds) } else { Expected::Drawn };
            let stand = Stand::with(mesh, Material { double_sided: true, ..Material::default() }, Some(red()?))?;
            check_one(studio, &stand, expected, true).map_err(|failed| told(&what, failed))?;
            if is_far {
                continue;
            }
            let Outcome::Drawn(Drawn { look: Some(look), .. }) = stand.outcome(studio)? else { continue };
            let [x, y] = SUBJECT_PIXEL;
            let [r, g, b] = look.radiance(x, y);
            // It is lit by the ambient light at least, and wherever the texture is read it is red.
            if !(r >= 0.19 && g < 1e-3 && b < 1e-3) {
                return Err(format!("{what}: the subject is {:?}", [r, g, b]).into());
            }
        }
    }
    Ok(())
}
