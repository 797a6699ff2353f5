//! Materials beyond a buffer.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{Bounds, Material, MaterialType, Mesh, RenderObject, Scene, SceneRef, Topology};
use drawloom::view::IssueReason;
use drawloom_testing::scenes::{field, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Device, Options, binding, expect_same, expect_scene_issues, renderer, small};

pub const CASES: &[Case] = &[
    ("materials_beyond_a_buffer_are_left_out", Device::ALL, beyond_a_buffer),
    ("values_beyond_a_buffer_are_left_out", Device::ALL, values),
    ("a_material_that_is_replaced_is_left_out_while_its_values_are_too_large", Device::ALL, replaced),
];

/// A row of squares, each with a material of its own, of which some have values. As many slots as there are squares.
fn row(count: usize, values: impl Fn(usize) -> bool) -> Result<Scene, Failed> {
    let mut scene = Scene::new();
    scene.cameras = small(field(0)).cameras;
    scene.ambient = Vec3::ONE;
    let mesh = scene.add(square(Topology::TriangleList))?;
    for number in 0..count {
        let diffuse = Vec3::new(number as f32 / count as f32, 0.5, 1.0);
        let values = values(number).then(|| WIDE.values([number as f32; 64]));
        let material =
            scene.add(Material { name: format!("number {number}"), diffuse, values, ..Material::default() })?;
        let position = DVec3::new(number as f64 - count as f64 / 2.0, 0.0, 0.0);
        scene.add_object(RenderObject::new(mesh, material, position))?;
    }
    Ok(scene)
}

/// 256 bytes for each material.
const WIDE: MaterialType<[f32; 64]> = MaterialType::new("wide");

/// The objects that are drawn, of a scene in which each has the material of its own index.
fn only<'a>(scene: SceneRef<'a>, columns: &'a mut Columns, drawn: impl Fn(usize) -> bool) -> SceneRef<'a> {
    *columns = Columns::default();
    for object in (0..scene.object_count()).filter(|object| drawn(*object)) {
        columns.positions.push(scene.positions[object]);
        columns.orientations.push(scene.orientations[object]);
        columns.scales.push(scene.scales[object]);
        columns.bounds.push(scene.bounds[object]);
        columns.meshes.push(scene.meshes[object]);
        columns.materials.push(scene.materials[object]);
    }
    let Columns { positions, orientations, scales, bounds, meshes, materials } = columns;
    SceneRef { positions, orientations, scales, bounds, meshes, materials, layers: &[], ..scene }
}

#[derive(Default)]
struct Columns {
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

fn beyond_a_buffer(device: Device) -> Result<(), Failed> {
    // Few objects have room where few materials have, so that most materials have no object.
    let scene = row(40, |_| false)?;
    let mut columns = [Columns::default(), Columns::default()];
    let [some, drawn] = &mut columns;
    let scene = only(scene.as_scene_ref(), some, |object| !(2..30).contains(&object));
    for capacity in [12, 29, 31, 36, 39, 40] {
        let options = Options { limits: binding(capacity * 64), ..Options::default() };
        // Those with materials below the capacity.
        let expected = only(scene, drawn, |object| slot_of(scene, object) < capacity);
        let left_out = scene.object_count() - expected.object_count();
        let mut frames = renderer(device, options)?;
        let scene_issues = expect_same(&mut *frames, device, options, [scene, expected])?;
        let first = (0..scene.object_count()).find(|object| slot_of(scene, *object) >= capacity).unwrap_or(0);
        let name = format!("number {}", slot_of(scene, first));
        let expected = [(IssueReason::MaterialLimit, left_out, first, Some(name.as_str()))];
        expect_scene_issues(&scene_issues, &expected[..usize::from(left_out > 0)])
            .map_err(|failed| format!("{capacity}: {failed:?}"))?;
    }
    Ok(())
}

/// The slot of an object's material: rows add them in order.
fn slot_of(scene: SceneRef<'_>, object: usize) -> usize {
    scene.materials[object].index() as usize
}

fn values(device: Device) -> Result<(), Failed> {
    // Every third material has values, of which 16 have room: those of slots up to 15.
    let scene = row(30, |number| number % 3 == 0)?;
    let scene = scene.as_scene_ref();
    let options = Options { limits: binding(64 * 64), ..Options::default() };
    let mut columns = Columns::default();
    let expected = only(scene, &mut columns, |object| object % 3 != 0 || object < 16);
    let scene_issues = expect_same(&mut *renderer(device, options)?, device, options, [scene, expected])?;
    expect_scene_issues(&scene_issues, &[(IssueReason::MaterialLimit, 4, 18, Some("number 18"))])
}

fn replaced(device: Device) -> Result<(), Failed> {
    let options = Options { limits: binding(64 * 64), ..Options::default() };
    let mut scene = row(30, |_| false)?;
    let mut frames = renderer(device, options)?;
    let slot = scene.as_scene_ref().materials[20];
    for is_wide in [false, true, true, false] {
        let material = scene.assets().get(slot)?.clone();
        let values = is_wide.then(|| WIDE.values([1.0; 64]));
        scene.replace(slot, Material { values, ..material })?;
        let mut columns = Columns::default();
        let scene = scene.as_scene_ref();
        let expected = only(scene, &mut columns, |object| object != 20 || !is_wide);
        let scene_issues = expect_same(&mut *frames, device, options, [scene, expected])?;
        let expected = [(IssueReason::MaterialLimit, 1, 20, Some("number 20"))];
        expect_scene_issues(&scene_issues, &expected[..usize::from(is_wide)])?;
    }
    Ok(())
}
