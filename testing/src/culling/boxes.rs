//! Objects whose boxes almost touch a frustum, and objects anywhere, culled through the whole path from scene to
//! result.

use std::array::from_fn;
use std::ops::Range;

use drawloom::glam::{DMat3, DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::quality::CullingVolume;
use drawloom::scene::{Bounds, Material, Mesh, Scene, SceneError, SceneRef, Topology, Vertex};
use drawloom::view::internal::{FixedPosition, Frustum, ObjectTable, VisibleSet};

use super::cameras::{any_camera, magnitude};
use super::oracle::{Classification, Oracle};
use super::spheres::{any_along, any_aside, any_planes};
use super::tally::Tallies;
use crate::random::Random;

/// The volumes that are tested, in the order of the tallies.
pub const VOLUMES: [CullingVolume; 3] = [CullingVolume::Sphere, CullingVolume::Box, CullingVolume::OrientedBox];

/// The tallies of each volume.
#[derive(Clone, Copy, Debug, Default)]
pub struct BoxTallies {
    pub volumes: [Tallies; 3],
    /// Objects that the table rejected: there should be none.
    pub rejected: u64,
}

impl BoxTallies {
    pub fn add(&mut self, other: &Self) {
        self.volumes.iter_mut().zip(&other.volumes).for_each(|(volume, other)| volume.add(other));
        self.rejected += other.rejected;
    }
}

/// Meshes to make objects of.
pub struct Shapes {
    scene: Scene,
    meshes: Vec<Handle<Mesh>>,
    material: Handle<Material>,
}

impl Shapes {
    /// Boxes of all proportions, some of them flat, thin or points, around the origin of object space and far from it.
    ///
    /// # Errors
    /// Returns an error if the scene refuses a mesh or the material.
    pub fn new() -> Result<Self, SceneError> {
        let (mut random, mut scene, mut meshes) = (Random::new(), Scene::new(), Vec::new());
        for number in 0..64 {
            let half = Vec3::from_array(from_fn(|_| match random.below(6) {
                0 => 0.0,
                _ if number % 8 == 5 => 0.0,
                _ => magnitude(&mut random, -2.0, 0.0) as f32,
            }));
            let center = match number % 4 {
                0 => Vec3::ZERO,
                1 => (random.direction() * 100.0).as_vec3(),
                _ => (random.direction() * magnitude(&mut random, -3.0, 0.5)).as_vec3(),
            };
            let vertices = [-1.0, 1.0, 1.0].map(|sign| {
                let position = (center + half * sign).to_array();
                Vertex { position, ..Vertex::default() }
            });
            meshes.push(scene.add(Mesh::new("box", Topology::TriangleList, vertices.into(), vec![0, 1, 2])?)?);
        }
        let material = scene.add(Material::default())?;
        Ok(Self { scene, meshes, material })
    }

    fn mesh(&self, handle: Handle<Mesh>) -> &Mesh {
        self.scene.assets().get(handle).expect("no mesh was removed")
    }
}

/// The objects that are tested with one camera.
#[derive(Default)]
struct Objects {
    positions: Vec<DVec3>,
    orientations: Vec<Quat>,
    scales: Vec<Vec3>,
    bounds: Vec<Bounds>,
    meshes: Vec<Handle<Mesh>>,
    materials: Vec<Handle<Material>>,
}

impl Objects {
    fn as_scene_ref<'a>(&'a self, shapes: &'a Shapes) -> SceneRef<'a> {
        SceneRef {
            positions: &self.positions,
            orientations: &self.orientations,
            scales: &self.scales,
            bounds: &self.bounds,
            meshes: &self.meshes,
            materials: &self.materials,
            layers: &[],
            columns: &[],
            ..shapes.scene.as_scene_ref()
        }
    }
}

/// The oracle's verdicts on an object and its volumes, and whether the object was placed to touch a plane.
#[derive(Clone, Copy)]
struct Case {
    is_tangent: bool,
    /// The classification of the object itself, by its mesh's box.
    object: Classification,
    /// The verdicts on the tested volumes. A volume contains the object, so it is `Outside` only if the object is.
    volumes: [Classification; 3],
}

/// Tests one camera with [`ObjectTable::BLOCK_SIZE`] objects for each number of `batches`.
pub fn try_batches(shapes: &Shapes, batches: Range<usize>) -> BoxTallies {
    let mut tallies = BoxTallies::default();
    let mut tables = VOLUMES.map(|volume| {
        let mut table = ObjectTable::default();
        table.configure(volume);
        table
    });
    for batch in batches {
        let mut random = Random::stream((1 << 40) + batch as u64);
        let camera = any_camera(&mut random);
        let (oracle, frustum) = (Oracle::new(&camera), Frustum::new(&camera));
        let mut objects = Objects::default();
        let cases: Vec<_> = (0..ObjectTable::BLOCK_SIZE)
            .map(|entry| objects.add(shapes, &oracle, entry % 4 != 0, &mut random))
            .collect();
        for (volume, table) in tables.iter_mut().enumerate() {
            table.update(&objects.as_scene_ref(shapes));
            tallies.rejected += table.scene_issues().list().iter().map(|issue| issue.count as u64).sum::<u64>();
            let block = table.block(0);
            for first in (0..ObjectTable::BLOCK_SIZE).step_by(VisibleSet::OBJECTS_PER_WORD) {
                let visible = block.visible(&frustum, VOLUMES[volume], first..first + VisibleSet::OBJECTS_PER_WORD);
                for (bit, case) in cases[first..][..VisibleSet::OBJECTS_PER_WORD].iter().enumerate() {
                    // It must be visible if the object is inside, and may be culled if its volume is outside.
                    let classification = match (case.object, case.volumes[volume]) {
                        (Classification::Inside, _) => Classification::Inside,
                        (_, Classification::Outside) => Classification::Outside,
                        _ => Classification::Touching,
                    };
                    tallies.volumes[volume].of(case.is_tangent).count(classification, visible >> bit & 1 == 1);
                }
            }
        }
    }
    tallies
}

impl Objects {
    fn add(&mut self, shapes: &Shapes, oracle: &Oracle, is_tangent: bool, random: &mut Random) -> Case {
        let handle = shapes.meshes[random.below(shapes.meshes.len())];
        let mesh = shapes.mesh(handle);
        let orientation = match random.below(8) {
            0 => Quat::IDENTITY,
            _ => Quat::from_axis_angle(random.direction().as_vec3().normalize(), random.between(-3.2, 3.2) as f32),
        };
        let scale = any_scale(random);
        let solid = Solid::new(mesh, orientation, scale);
        let normals = oracle.normals();
        let reaches = normals.map(|normal| solid.reach(normal));
        let step = f64::from(random.below(9) as i32 - 4) * f64::from(f32::EPSILON);
        let touching_position = is_tangent.then(|| {
            // The point at the random distance is the object's origin, or the centre of its bounding sphere.
            let anchor = if random.below(2) == 0 { solid.center } else { DVec3::ZERO };
            // Up to four steps of f32 nearer or farther than the position at which it touches.
            let reaches = normals.map(|normal| {
                let reach = solid.reach(normal) - normal.dot(anchor);
                reach + step * reach.abs()
            });
            let touching = oracle.touching(any_planes(random), reaches, any_along(random), any_aside(random));
            oracle.world(touching * (1.0 + if random.below(2) == 0 { step } else { 0.0 }) - anchor)
        });
        // The touching position of a large object may be out of reach.
        let touching_position = touching_position.filter(|&position| FixedPosition::new(position).is_some());
        let position =
            touching_position.unwrap_or_else(|| oracle.world(random.direction() * magnitude(random, -2.0, 7.0)));

        let bounds = mesh.bounds();
        let has_own_bounds = random.below(8) == 0;
        let relative = oracle.relative(position);
        let size =
            solid.center.abs().element_sum() + solid.half_axes.iter().map(|axis| axis.abs().element_sum()).sum::<f64>();
        let object = oracle.classify(relative, reaches, size);
        let radius = f64::from(bounds.radius) * scale.abs().as_dvec3().max_element();
        let center = relative + solid.center;
        let around = |reach: &dyn Fn(DVec3) -> f64| oracle.classify(center, normals.map(reach), size + radius);
        let sphere = around(&|_| radius);
        let half = solid.half_axes.iter().fold(DVec3::ZERO, |half, axis| half + axis.abs());
        // The sphere is tested first: an object is outside of a plane if either volume is.
        let either = |classification| if sphere == Classification::Outside { sphere } else { classification };
        let world = either(around(&|normal| normal.abs().dot(half)));
        let mut volumes = [sphere, world, either(object)];
        if has_own_bounds {
            // The oracle does not know how much larger the engine's bounds are.
            volumes = [Classification::Touching; 3];
        }

        self.positions.push(position);
        self.orientations.push(orientation);
        self.scales.push(scale);
        self.bounds.push(if has_own_bounds { Bounds { radius: bounds.radius * 1.5, ..bounds } } else { bounds });
        self.meshes.push(handle);
        self.materials.push(shapes.material);
        Case { is_tangent: touching_position.is_some(), object, volumes }
    }
}

/// A mesh's box, turned and scaled, relative to the object's position.
struct Solid {
    corners: [DVec3; 8],
    /// The centre of the sphere around the mesh.
    center: DVec3,
    half_axes: [DVec3; 3],
}

impl Solid {
    fn new(mesh: &Mesh, orientation: Quat, scale: Vec3) -> Self {
        let turn = DMat3::from_quat(orientation.as_dquat().normalize());
        let scale = scale.as_dvec3();
        let ends = mesh.corners().map(Vec3::as_dvec3);
        let corners = from_fn(|corner: usize| {
            let end = |axis: usize| ends[corner >> axis & 1][axis];
            turn * (scale * DVec3::new(end(0), end(1), end(2)))
        });
        let half = (ends[1] - ends[0]) * 0.5 * scale;
        let half_axes = [turn.x_axis * half.x, turn.y_axis * half.y, turn.z_axis * half.z];
        Self { corners, center: turn * (scale * mesh.bounds().center.as_dvec3()), half_axes }
    }

    /// The extent in a direction: that of the farthest corner.
    fn reach(&self, normal: DVec3) -> f64 {
        self.corners.iter().map(|corner| corner.dot(normal)).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// A scale from a millionth to ten million, mirrored or not, or a degenerate one: zero, subnormal, very small or very
/// uneven.
fn any_scale(random: &mut Random) -> Vec3 {
    let even = magnitude(random, -6.0, 7.0) as f32;
    let signs = Vec3::from_array([(); 3].map(|()| if random.below(4) == 0 { -1.0 } else { 1.0 }));
    let mut scale = match random.below(4) {
        0 => Vec3::from_array([(); 3].map(|()| magnitude(random, -6.0, 7.0) as f32)),
        1 => Vec3::new(1e6, 1.0, 1.0) * (even.min(10.0)),
        _ => Vec3::splat(even),
    };
    match random.below(16) {
        0 => scale[random.below(3)] = 0.0,
        1 => scale[random.below(3)] = 1e-40,
        2 => scale = Vec3::splat(1e-20),
        3 => scale = Vec3::splat([0.0, 1e20, 1e-40, 1.0][random.below(4)]),
        _ => (),
    }
    scale * signs
}
