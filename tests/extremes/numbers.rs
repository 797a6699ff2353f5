//! NaN, infinities, subnormals, zeros of both signs and the limits of f32, in every number of a scene.

use drawloom::FrameError;
use drawloom::backend::BackendError;
use drawloom::glam::{DVec3, Quat, Vec2, Vec3};
use drawloom::scene::{
    Bounds, Camera, ClipPlane, Light, Material, Mesh, Projection, RenderObject, Scene, SceneError, Texture, Topology,
    Vertex, WholePicture,
};
use drawloom::view::IssueReason;
use drawloom_testing::scenes::{sized, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::harness::{Drawn, Harness, Outcome};
use crate::markers::with_context;
use crate::special::{SPECIAL, SPECIAL_POSITIONS};

pub const CASES: &[Case] = &[
    ("special_numbers_in_an_object", objects),
    ("special_numbers_in_a_camera", cameras),
    ("special_numbers_in_a_light", lights),
    ("special_numbers_in_ambient_and_background", surroundings),
    ("special_numbers_in_a_material", materials),
    ("special_numbers_in_a_vertex", vertices),
];

/// The expected outcome for a scene with a special number.
enum Expected {
    /// It is drawn completely.
    Drawn,
    /// It is drawn without the item that has the number.
    Without(IssueReason),
    /// It is refused because of its camera.
    InvalidCamera,
    /// It is refused because of its camera's position.
    OutOfReach,
    /// It is refused because of a colour.
    InvalidColor,
}

/// A name, a function that sets a number in a scene, and one that returns the expected outcome.
type Rule<T> = (&'static str, fn(&mut TestScene, T), fn(T) -> Expected);

/// A control object on the left, which must be visible for every subject on the right, and every kind of light on
/// the subject.
struct TestScene {
    scene: Scene,
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
}

const CONTROL: [f64; 3] = [0.0, 0.75, 0.125];

/// The pixels of the control and the subject.
const CONTROL_PIXEL: [usize; 2] = [14, 16];
const SUBJECT_PIXEL: [usize; 2] = [33, 16];

impl TestScene {
    fn new() -> Result<Self, Failed> {
        Self::with(square(Topology::TriangleList), Material { diffuse: Vec3::splat(0.5), ..Material::default() }, None)
    }

    /// The same scene with another subject.
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
            Light::Point { position, intensity, range: 10.0, casts_shadow: false },
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

    /// Draws the scene from separate columns, as an engine with its own storage does.
    fn outcome(&self, harness: &mut Harness) -> Result<Outcome, Failed> {
        let Self { scene, positions, orientations, scales, bounds } = self;
        harness.outcome(&drawloom::scene::SceneRef { positions, orientations, scales, bounds, ..scene.as_scene_ref() })
    }

    /// Fails unless the control is visible.
    fn check_control(&self, drawn: &Drawn) -> Result<(), Failed> {
        let Some(capture) = &drawn.capture else { return Ok(()) };
        let [x, y] = CONTROL_PIXEL;
        let found = capture.radiance(x, y);
        let is_right = found.into_iter().zip(CONTROL).all(|(found, expected)| (found - expected).abs() < 1e-3);
        if is_right { Ok(()) } else { Err(format!("the control is {found:?}").into()) }
    }
}

/// Draws the scene with each number by each rule, and the unchanged scene after each rule.
fn check<T: Copy + std::fmt::Debug>(harness: &mut Harness, numbers: &[T], rules: &[Rule<T>]) -> Result<(), Failed> {
    for (name, set, expected) in rules {
        for &number in numbers {
            let mut test = TestScene::new()?;
            set(&mut test, number);
            // A changed camera may not see the control.
            let has_control = !name.starts_with("camera");
            check_one(harness, &test, expected(number), has_control)
                .map_err(|failed| with_context(&format!("{name} = {number:?}"), failed))?;
        }
        let whole = TestScene::new()?;
        check_one(harness, &whole, Expected::Drawn, true)
            .map_err(|failed| with_context(&format!("after {name}"), failed))?;
    }
    Ok(())
}

fn check_one(harness: &mut Harness, test: &TestScene, expected: Expected, has_control: bool) -> Result<(), Failed> {
    match (test.outcome(harness)?, expected) {
        (Outcome::Drawn(drawn), expected @ (Expected::Drawn | Expected::Without(_))) => {
            // `CoarseEdges` means lower quality, and not that something is left out.
            let left_out = drawn.scene_issues.iter().filter(|issue| issue.reason != IssueReason::CoarseEdges);
            let reasons: Vec<_> = left_out.map(|issue| issue.reason).collect();
            let expected_reasons = if let Expected::Without(reason) = expected { vec![reason] } else { Vec::new() };
            if reasons != expected_reasons {
                return Err(format!("left out: {reasons:?}").into());
            }
            if has_control { test.check_control(&drawn) } else { Ok(()) }
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
        (Outcome::Drawn(drawn), _) => Err(format!("it was drawn, without {:?}", drawn.scene_issues).into()),
    }
}

/// Whether a coordinate is within the reach of positions.
fn is_within_reach(number: f64) -> bool {
    number.abs() < drawloom::view::internal::FixedPosition::MAX_COORDINATE
}

fn objects(harness: &mut Harness) -> Result<(), Failed> {
    let position = |number: f64| match number {
        _ if !number.is_finite() => Expected::Without(IssueReason::InvalidTransform),
        _ if is_within_reach(number) => Expected::Drawn,
        _ => Expected::Without(IssueReason::OutOfReach),
    };
    check(
        harness,
        &SPECIAL_POSITIONS,
        &[
            ("position.x", |test, number| test.subject().0.x = number, position),
            ("position.z", |test, number| test.subject().0.z = number, position),
        ],
    )?;
    let orientation = |number: f32| {
        if number.abs() < 0.01 { Expected::Drawn } else { Expected::Without(IssueReason::InvalidTransform) }
    };
    let scale = |number: f32| match number {
        _ if !number.is_finite() => Expected::Without(IssueReason::InvalidTransform),
        _ if number.abs() == f32::MAX => Expected::Without(IssueReason::InvalidBounds),
        _ => Expected::Drawn,
    };
    let radius = |number: f32| {
        let is_valid = (0.0..1.0).contains(&number);
        if is_valid { Expected::Drawn } else { Expected::Without(IssueReason::InvalidBounds) }
    };
    let center = |number: f32| {
        if number.abs() < 1.0 { Expected::Drawn } else { Expected::Without(IssueReason::InvalidBounds) }
    };
    check(
        harness,
        &SPECIAL,
        &[
            ("orientation.x", |test, number| test.subject().1.x = number, orientation),
            ("orientation.w", |test, number| *test.subject().1 = Quat::from_xyzw(0.0, 1.0, 0.0, number), orientation),
            ("scale.x", |test, number| test.subject().2.x = number, scale),
            ("scale", |test, number| *test.subject().2 = Vec3::splat(number), scale),
            ("bounds.radius", |test, number| test.subject().3.radius = number, radius),
            ("bounds.center.y", |test, number| test.subject().3.center.y = number, center),
        ],
    )
}

fn cameras(harness: &mut Harness) -> Result<(), Failed> {
    check(
        harness,
        &SPECIAL_POSITIONS,
        &[("camera's position.y", |test, number| test.camera().position.y = number, {
            |number: f64| match number {
                _ if !number.is_finite() => Expected::InvalidCamera,
                _ if is_within_reach(number) => Expected::Drawn,
                _ => Expected::OutOfReach,
            }
        })],
    )?;
    check(
        harness,
        &SPECIAL_POSITIONS,
        &[(
            "camera's clip plane's point",
            |test, number| {
                let point = DVec3::new(0.0, 0.0, number);
                test.camera().clip_plane = Some(ClipPlane { point, normal: Vec3::NEG_Z });
            },
            |number: f64| if number.is_finite() { Expected::Drawn } else { Expected::InvalidCamera },
        )],
    )?;
    check(
        harness,
        &SPECIAL_POSITIONS,
        &[(
            "position of a camera's whole picture",
            |test, number| {
                let projection = test.camera().projection;
                let position = DVec3::new(0.0, number, 0.0);
                test.camera().whole = Some(WholePicture { projection, shift: Vec2::ZERO, position });
            },
            |number: f64| if number.is_finite() { Expected::Drawn } else { Expected::InvalidCamera },
        )],
    )?;
    let small = |number: f32| if number.abs() < 0.01 { Expected::Drawn } else { Expected::InvalidCamera };
    check(
        harness,
        &SPECIAL,
        &[
            ("camera's orientation.x", |test, number| test.camera().orientation.x = number, small),
            (
                "camera's near",
                |test, number| test.camera().near = number,
                |number| {
                    // A valid distance, although nothing is beyond it.
                    if number == f32::MAX || number == 1e-20 { Expected::Drawn } else { Expected::InvalidCamera }
                },
            ),
            (
                "camera's far",
                |test, number| test.camera().far = number,
                |number| {
                    if number > 0.05 { Expected::Drawn } else { Expected::InvalidCamera }
                },
            ),
            (
                "camera's field of view",
                |test, number| test.camera().projection = Projection::Perspective { field_of_view: number },
                |_| Expected::InvalidCamera,
            ),
            (
                "camera's shift",
                |test, number| test.camera().shift.x = number,
                |number| if number.abs() <= 65_536.0 { Expected::Drawn } else { Expected::InvalidCamera },
            ),
            (
                "shift of a camera's whole picture",
                |test, number| {
                    let Camera { projection, position, .. } = *test.camera();
                    let shift = Vec2::new(0.0, number);
                    test.camera().whole = Some(WholePicture { projection, shift, position });
                },
                |number| if number.abs() <= 65_536.0 { Expected::Drawn } else { Expected::InvalidCamera },
            ),
            (
                "field of view of a camera's whole picture",
                |test, number| {
                    let projection = Projection::Perspective { field_of_view: number };
                    let position = test.camera().position;
                    test.camera().whole = Some(WholePicture { projection, shift: Vec2::ZERO, position });
                },
                |_| Expected::InvalidCamera,
            ),
            (
                "height of a camera's whole picture",
                |test, number| {
                    let (position, shift) = (test.camera().position, Vec2::ZERO);
                    test.camera().far = 100.0;
                    test.camera().projection = Projection::Orthographic { height: 4.0 };
                    let projection = Projection::Orthographic { height: number };
                    test.camera().whole = Some(WholePicture { projection, shift, position });
                },
                |number| if number == f32::MAX { Expected::Drawn } else { Expected::InvalidCamera },
            ),
            (
                "camera's clip plane's normal",
                |test, number| {
                    let normal = Vec3::new(0.0, number, -1.0);
                    test.camera().clip_plane = Some(ClipPlane { point: DVec3::ZERO, normal });
                },
                small,
            ),
            (
                "camera's height",
                |test, number| {
                    test.camera().far = 100.0;
                    test.camera().projection = Projection::Orthographic { height: number };
                },
                |number| if number == f32::MAX { Expected::Drawn } else { Expected::InvalidCamera },
            ),
        ],
    )
}

/// Changes a light that has a position.
fn change(test: &mut TestScene, light: usize, by: impl Fn(&mut DVec3, &mut Vec3, &mut f32)) {
    if let Light::Point { position, intensity, range, .. }
    | Light::Spot { position, intensity, range, .. }
    | Light::Hemispherical { position, intensity, range, .. } = &mut test.scene.lights[light]
    {
        by(position, intensity, range);
    }
}

fn lights(harness: &mut Harness) -> Result<(), Failed> {
    const POINT: usize = 0;
    const SPOT: usize = 1;
    const HEMISPHERE: usize = 2;
    let position = |number: f64| match number {
        _ if !number.is_finite() => Expected::Without(IssueReason::InvalidLight),
        _ if is_within_reach(number) => Expected::Drawn,
        _ => Expected::Without(IssueReason::LightOutOfReach),
    };
    check(
        harness,
        &SPECIAL_POSITIONS,
        &[
            (
                "point light's position",
                |test, number| change(test, POINT, |position, _, _| position.x = number),
                position,
            ),
            (
                "spot light's position",
                |test, number| change(test, SPOT, |position, _, _| position.y = number),
                position,
            ),
            (
                "hemisphere's position",
                |test, number| change(test, HEMISPHERE, |position, _, _| position.z = number),
                position,
            ),
        ],
    )?;
    let color = |number: f32| {
        let is_valid = number >= 0.0 && number.is_finite();
        if is_valid { Expected::Drawn } else { Expected::Without(IssueReason::InvalidLight) }
    };
    let whole_color = |number: f32| match number {
        0.0 => Expected::Without(IssueReason::DarkLight),
        _ if number > 0.0 && number.is_finite() => Expected::Drawn,
        _ => Expected::Without(IssueReason::InvalidLight),
    };
    let range = |number: f32| {
        let is_valid = number > 0.0 && number.is_finite();
        if is_valid { Expected::Drawn } else { Expected::Without(IssueReason::InvalidLight) }
    };
    let direction = |number: f32| {
        if number.abs() < 0.01 { Expected::Drawn } else { Expected::Without(IssueReason::InvalidLight) }
    };
    check(
        harness,
        &SPECIAL,
        &[
            ("point light's red", |test, number| change(test, POINT, |_, color, _| color.x = number), color),
            ("spot light's red", |test, number| change(test, SPOT, |_, color, _| color.x = number), color),
            ("hemisphere's red", |test, number| change(test, HEMISPHERE, |_, color, _| color.x = number), color),
            (
                "point light's all",
                |test, number| change(test, POINT, |_, color, _| *color = Vec3::splat(number)),
                whole_color,
            ),
            (
                "sun's illuminance",
                |test, number| {
                    if let Light::Directional { illuminance, .. } = &mut test.scene.lights[3] {
                        *illuminance = Vec3::splat(number);
                    }
                },
                whole_color,
            ),
            ("point light's range", |test, number| change(test, POINT, |_, _, range| *range = number), range),
            ("spot light's range", |test, number| change(test, SPOT, |_, _, range| *range = number), range),
            ("hemisphere's range", |test, number| change(test, HEMISPHERE, |_, _, range| *range = number), range),
            (
                "directions",
                |test, number| {
                    test.scene.lights.truncate(3);
                    test.scene.lights.swap_remove(0);
                    if let Light::Spot { direction, .. } = &mut test.scene.lights[1] {
                        direction.x = number;
                    }
                },
                direction,
            ),
            (
                "sun's direction",
                |test, number| {
                    if let Light::Directional { direction, .. } = &mut test.scene.lights[3] {
                        direction.y = number;
                    }
                },
                direction,
            ),
            (
                "inner angle",
                |test, number| {
                    if let Light::Spot { inner_angle, .. } = &mut test.scene.lights[SPOT] {
                        *inner_angle = number;
                    }
                },
                |number| {
                    if (0.0..0.1).contains(&number) {
                        Expected::Drawn
                    } else {
                        Expected::Without(IssueReason::InvalidLight)
                    }
                },
            ),
            (
                "outer angle",
                |test, number| {
                    if let Light::Spot { outer_angle, .. } = &mut test.scene.lights[SPOT] {
                        *outer_angle = number;
                    }
                },
                |_| Expected::Without(IssueReason::InvalidLight),
            ),
        ],
    )
}

fn surroundings(harness: &mut Harness) -> Result<(), Failed> {
    let color = |number: f32| {
        if number >= 0.0 && number.is_finite() { Expected::Drawn } else { Expected::InvalidColor }
    };
    check(
        harness,
        &SPECIAL,
        &[
            ("ambient", |test, number| test.scene.ambient.y = number, color),
            ("background", |test, number| test.scene.background.z = number, color),
            (
                "both",
                |test, number| {
                    (test.scene.ambient, test.scene.background) = (Vec3::splat(number), Vec3::splat(number));
                },
                color,
            ),
        ],
    )
}

/// Sets a number in a material.
type SetMaterial = fn(&mut Material, f32);

fn materials(harness: &mut Harness) -> Result<(), Failed> {
    let setters: [(&str, SetMaterial); 6] = [
        ("diffuse.x", |material, number| material.diffuse.x = number),
        ("diffuse", |material, number| material.diffuse = Vec3::splat(number)),
        ("emission.y", |material, number| material.emission.y = number),
        ("emission", |material, number| material.emission = Vec3::splat(number)),
        ("opacity", |material, number| material.opacity = number),
        ("alpha cutoff", |material, number| material.alpha_cutoff = Some(number)),
    ];
    for (name, set) in setters {
        for blend in [
            drawloom::scene::Blend::None,
            drawloom::scene::Blend::Alpha,
            drawloom::scene::Blend::Additive,
            drawloom::scene::Blend::Subtractive,
        ] {
            for number in SPECIAL {
                let context = format!("{name} = {number:e}, {blend:?}");
                let mut material = Material { blend, ..Material::default() };
                set(&mut material, number);
                let max = if ["opacity", "alpha cutoff"].contains(&name) { 1.0 } else { f32::MAX };
                let is_valid = (0.0..=max).contains(&number);
                let test = TestScene::with(square(Topology::TriangleList), material.clone(), None);
                match (test, is_valid) {
                    (Ok(test), true) => {
                        check_one(harness, &test, Expected::Drawn, true)
                            .map_err(|failed| with_context(&context, failed))?;
                    }
                    (Err(_), false) => {
                        let error = Scene::new().add(material).err();
                        if !matches!(error, Some(SceneError::InvalidMaterial { .. })) {
                            return Err(format!("{context}: {error:?}").into());
                        }
                    }
                    (Ok(_), false) => return Err(format!("{context}: it was accepted").into()),
                    (Err(failed), true) => return Err(with_context(&context, failed)),
                }
            }
        }
    }
    Ok(())
}

/// Sets a number in a vertex.
type SetVertex = fn(&mut Vertex, f32);

fn vertices(harness: &mut Harness) -> Result<(), Failed> {
    let red = || Texture::new("red", 4, 4, [255, 0, 0, 255].repeat(16));
    let setters: [(&str, SetVertex); 7] = [
        ("uv.u", |vertex, number| vertex.uv[0] = number),
        ("uv", |vertex, number| vertex.uv = [number; 2]),
        ("uv, all but one", |vertex, number| vertex.uv = if vertex.uv == [0.0; 2] { [0.5; 2] } else { [number; 2] }),
        ("normal.x", |vertex, number| vertex.normal[0] = number),
        ("normal", |vertex, number| vertex.normal = [0.0, 0.0, number.abs()]),
        ("normal, all", |vertex, number| vertex.normal = [number, number, number]),
        ("position.z", |vertex, number| vertex.position[2] = number),
    ];
    for (name, set) in setters {
        for number in SPECIAL {
            let context = format!("{name} = {number:e}");
            let plain = square(Topology::TriangleList);
            let mut changed = plain.vertices().to_vec();
            changed.iter_mut().for_each(|vertex| set(vertex, number));
            let mesh = Mesh::new("changed", plain.topology(), changed, plain.indices().to_vec());
            let mesh = match mesh {
                Err(SceneError::NonFiniteVertex { vertex: 0, .. }) if !number.is_finite() => continue,
                Err(SceneError::NonFiniteVertex { vertex: 1, .. }) if !number.is_finite() => continue,
                Err(error) => return Err(format!("{context}: {error}").into()),
                Ok(_) if !number.is_finite() => return Err(format!("{context}: it was accepted").into()),
                Ok(mesh) => mesh,
            };
            let is_far = name.starts_with("position") && number.abs() == f32::MAX;
            let expected = if is_far { Expected::Without(IssueReason::InvalidBounds) } else { Expected::Drawn };
            let test = TestScene::with(mesh, Material { double_sided: true, ..Material::default() }, Some(red()?))?;
            check_one(harness, &test, expected, true).map_err(|failed| with_context(&context, failed))?;
            if is_far {
                continue;
            }
            let Outcome::Drawn(Drawn { capture: Some(capture), .. }) = test.outcome(harness)? else { continue };
            let [x, y] = SUBJECT_PIXEL;
            let [r, g, b] = capture.radiance(x, y);
            // Ambient light reaches it, and the texture is red everywhere.
            if !(r >= 0.19 && g < 1e-3 && b < 1e-3) {
                return Err(format!("{context}: the subject is {:?}", [r, g, b]).into());
            }
        }
    }
    Ok(())
}
