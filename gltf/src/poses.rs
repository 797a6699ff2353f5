//! The shapes of deformed objects: a palette of joints, morph targets, and how much each of them counts.

use drawloom::glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Mat4, Quat, Vec3};
use drawloom::scene::Bounds;

use crate::attributes::Pose;
use crate::element::Element;
use crate::error::Problem;
use crate::limits::Limit;
use crate::primitives::Primitive;
use crate::transforms::decompose;

/// The palettes and morph data of all objects.
#[derive(Debug, Default)]
pub(crate) struct Poses {
    /// From the shape of a mesh to that of an object, for each joint of each object.
    pub(crate) palette: Vec<Mat4>,
    /// The morph targets of all primitives, and the weights of all objects.
    pub(crate) morphs: Vec<f32>,
}

/// An object in its pose.
pub(crate) struct Posed {
    pub(crate) position: DVec3,
    pub(crate) orientation: Quat,
    pub(crate) scale: Vec3,
    pub(crate) bounds: Bounds,
    /// `None` if the mesh has the object's shape.
    pub(crate) pose: Option<Pose>,
}

/// A primitive of a node, and what moves it.
pub(crate) struct Posing<'a> {
    pub(crate) primitive: &'a Primitive,
    pub(crate) node: Element<'a>,
    /// From the node to the world.
    pub(crate) world: DAffine3,
    /// From the mesh as it was modelled to the world, for each joint of its skin, and where the first joint is.
    pub(crate) skin: Option<(&'a [DAffine3], DVec3)>,
    /// Of each morph target.
    pub(crate) weights: &'a [f32],
    pub(crate) limit: &'a Limit,
}

impl Poses {
    /// Poses a primitive of a node: by its skin, its morph weights and the node's transform.
    ///
    /// # Errors
    /// If a pose is not finite, or a limit is exceeded.
    pub(crate) fn pose(&mut self, posing: &Posing<'_>) -> Result<Posed, Problem> {
        let (primitive, world) = (posing.primitive, posing.world);
        let skin = posing.skin.filter(|_| primitive.joints.is_some());
        let placed = decompose(&world);
        let (position, orientation, scale) =
            (placed.translation, placed.rotation.as_quat().normalize(), placed.scale.as_vec3());
        let (position, matrices, is_mirrored) = match skin {
            Some((joints, origin)) => {
                let to_origin = DAffine3::from_translation(-origin);
                let matrices: Vec<_> = joints.iter().map(|joint| to_origin * *joint).collect();
                let is_mirrored = matrices.first().is_some_and(|first| first.matrix3.determinant() < 0.0);
                (origin, matrices, is_mirrored)
            }
            None if placed.is_skewed => {
                let linear = DAffine3::from_mat3(world.matrix3);
                (position, vec![linear; joint_count(primitive)], placed.scale.x < 0.0)
            }
            None if !primitive.targets.reach.is_empty() => {
                let unchanged = vec![DAffine3::IDENTITY; joint_count(primitive)];
                let posed = self.posed(posing, &unchanged)?;
                return Ok(Posed { position, orientation, scale, ..posed });
            }
            None => {
                let bounds = primitive.mesh.bounds();
                return Ok(Posed { position, orientation, scale, bounds, pose: None });
            }
        };
        // Which side of a triangle is its front depends on the object's scale.
        let mirror = DVec3::new(if is_mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
        let to_object = DAffine3::from_mat3(DMat3::from_diagonal(mirror));
        let matrices: Vec<_> = matrices.into_iter().map(|matrix| to_object * matrix).collect();
        let posed = self.posed(posing, &matrices)?;
        Ok(Posed { position, orientation: DQuat::IDENTITY.as_quat(), scale: mirror.as_vec3(), ..posed })
    }

    /// An object at the world's origin.
    fn posed(&mut self, posing: &Posing<'_>, matrices: &[DAffine3]) -> Result<Posed, Problem> {
        let Posing { primitive, ref node, weights, limit, .. } = *posing;
        let (targets, mesh) = (&primitive.targets, &primitive.mesh);
        let bytes = matrices.len() * size_of::<Mat4>() + targets.reach.len() * size_of::<f32>();
        limit.take(node, bytes as u64, 1)?;
        let weights = targets.weights(weights);
        let pose = Pose {
            first_joint: self.palette.len() as u32,
            first_weight: self.morphs.len() as u32,
            first_target: targets.first,
            target_count: targets.reach.len() as u32,
            vertex_count: mesh.vertices().len() as u32,
        };
        let matrices: Vec<_> = matrices.iter().map(|matrix| DMat4::from(*matrix).as_mat4()).collect();
        let reach: Vec3 = targets.reach.iter().zip(&weights).map(|(reach, weight)| *reach * weight.abs()).sum();
        let whole = [(0, mesh.corners())].into();
        // A vertex is in the convex hull of where its joints bring it.
        let boxes = primitive.joints.as_ref().map_or(&whole, |joints| &joints.boxes);
        let corners = boxes.iter().flat_map(|(joint, [low, high])| {
            let (low, high, matrix) = (*low - reach, *high + reach, matrices[*joint as usize]);
            (0..8).map(move |corner| {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                matrix.transform_point3(Vec3::new(pick(0), pick(1), pick(2)))
            })
        });
        let mut bounds = Bounds::around(corners);
        // What the device rounds.
        bounds.radius *= 1.001;
        if !bounds.center.is_finite() || !bounds.radius.is_finite() {
            let reason = "brings its mesh beyond the range of numbers";
            return Err(Problem::Transform { node: node.to_string(), reason });
        }
        self.palette.extend(matrices);
        self.morphs.extend(weights);
        Ok(Posed { position: DVec3::ZERO, orientation: Quat::IDENTITY, scale: Vec3::ONE, bounds, pose: Some(pose) })
    }
}

/// How many joints the palette must have for the vertices of a primitive without a skin.
fn joint_count(primitive: &Primitive) -> usize {
    primitive.joints.as_ref().map_or(1, |joints| joints.greatest as usize + 1)
}
