//! Meshes that CPU nodes fill with what is no mesh.

use std::ops::Range;

use drawloom::glam::{DVec3, Vec3};
use drawloom::graph::NodeError;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, GeneratedBuffer, Material, Mesh, RenderObject, Scene, Topology, Vertex};
use drawloom::task::Worker;
use drawloom::view::IssueReason;
use drawloom::{CpuNode, FrameInputs, NodeAccesses, NodeContext};
use drawloom_testing::scenes::{sized, square};

use crate::Fixture;

/// Fills the indices of triangles.
struct Fill<'a> {
    vertices: &'a GeneratedBuffer<Vertex>,
    indices: [&'a GeneratedBuffer<u32>; 2],
    /// Of each buffer: whether one of them is not that of a vertex.
    is_wrong: [bool; 2],
}

impl CpuNode for Fill<'_> {
    fn name(&self) -> &str {
        "fill indices"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.fills(self.vertices).fills(self.indices[0]).fills(self.indices[1]);
    }

    fn run(&self, frame: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]];
        for (vertex, position) in frame.fill(self.vertices, 0)?.iter_mut().zip(corners) {
            *vertex = Vertex { position, normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
        }
        for (indices, is_wrong) in self.indices.into_iter().zip(self.is_wrong) {
            frame.fill(indices, 0)?.copy_from_slice(&[0, 1, if is_wrong { 3 } else { 2 }]);
        }
        Ok(())
    }
}

#[test]
fn objects_with_a_mesh_that_is_filled_wrongly_are_counted_until_it_is_filled_well() {
    let vertices = GeneratedBuffer::new("vertices", 3);
    let indices = [GeneratedBuffer::new("first", 3), GeneratedBuffer::new("second", 3)];
    let mut scene = Scene::new();
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::Z * 4.0, DVec3::ZERO), [16, 16])];
    let material = scene.add(Material::default()).unwrap();
    let other = scene.add(square(Topology::TriangleList)).unwrap();
    // Two meshes have one name.
    let meshes = indices.each_ref().map(|indices| {
        let corners = [Vec3::NEG_ONE, Vec3::ONE];
        scene.add(Mesh::generated("made", Topology::TriangleList, corners, &vertices, indices).unwrap()).unwrap()
    });
    for mesh in [other, meshes[1], meshes[0], other, meshes[1]] {
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
    }
    let mut fixture = Fixture::new(2, |builder| builder.pipeline(Deferred::to_picture()));
    let (none, [first, second]) = ((0, 0), [(1, 2), (2, 1)]);
    let mut frame = |is_wrong: [bool; 2], (count, first): (usize, usize)| {
        let node = Fill { vertices: &vertices, indices: indices.each_ref(), is_wrong };
        let recorded = fixture
            .renderer
            .record_with(FrameInputs { nodes: &[&node], ..FrameInputs::new(scene.as_scene_ref()) })
            .unwrap();
        let scene_issues = recorded.statistics().scene_issues.clone();
        let found: Vec<_> = scene_issues.iter().map(|known| (known.reason, known.count, known.first)).collect();
        let expected = (count > 0).then_some((IssueReason::UndrawableMesh, count, first));
        assert_eq!(found, expected.into_iter().collect::<Vec<_>>(), "{is_wrong:?}");
        assert!(scene_issues.iter().all(|known| known.name.as_deref() == Some("made")));
        fixture.submitter.submit(recorded).unwrap();
    };
    // Each frame counts what the one before has drawn.
    frame([true, false], none);
    frame([true, true], first);
    frame([false, true], (3, 1));
    frame([false, false], second);
    frame([false, false], none);
}
