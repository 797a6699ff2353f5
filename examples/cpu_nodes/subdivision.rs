//! Catmull-Clark subdivision of a cage, as weights: each vertex of the surface is a sum of the cage's points, whatever
//! these are in a frame.

use std::collections::HashMap;

/// The points of the cage.
pub const POINTS: usize = 32;

/// How much of each point of the cage.
pub type Weights = [f32; POINTS];

/// A surface over the cage.
pub struct Surface {
    pub positions: Vec<Weights>,
    /// Two directions along the surface at each vertex; their cross product points outwards.
    pub tangents: Vec<[Weights; 2]>,
    /// Counter-clockwise.
    pub quads: Vec<[u32; 4]>,
}

impl Surface {
    /// The surface of a cage with these faces after this number of steps.
    pub fn new(cage: &[[u32; 4]], steps: usize) -> Self {
        let point = |index: usize| std::array::from_fn(|other| if other == index { 1.0 } else { 0.0 });
        let mut positions: Vec<Weights> = (0..POINTS).map(point).collect();
        let mut quads = cage.to_vec();
        for _ in 0..steps {
            (positions, quads) = refine(&positions, &quads);
        }
        let tangents = tangents(&positions, &quads);
        Self { positions, tangents, quads }
    }

    /// The quads as triangles.
    pub fn indices(&self) -> Vec<u32> {
        self.quads.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect()
    }
}

fn sum<'a>(weights: impl IntoIterator<Item = (f32, &'a Weights)>) -> Weights {
    let mut sum = [0.0; POINTS];
    for (factor, weights) in weights {
        sum.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += factor * weight);
    }
    sum
}

/// One step: a point for each face, one for each edge, and each vertex moved. The vertices come first, then faces, then
/// edges.
fn refine(vertices: &[Weights], quads: &[[u32; 4]]) -> (Vec<Weights>, Vec<[u32; 4]>) {
    let faces: Vec<_> = quads.iter().map(|quad| sum(quad.map(|corner| (0.25, &vertices[corner as usize])))).collect();
    // Of each edge its number, its ends, and the faces beside it.
    let mut edges: Vec<([u32; 2], Vec<usize>)> = Vec::new();
    let mut known = HashMap::new();
    let mut edge_of = |one: u32, other: u32, face: usize| {
        let ends = [one.min(other), one.max(other)];
        let edge = *known.entry(ends).or_insert_with(|| {
            edges.push((ends, Vec::new()));
            edges.len() - 1
        });
        edges[edge].1.push(face);
        (vertices.len() + faces.len() + edge) as u32
    };
    let mut refined = Vec::new();
    for (face, quad) in quads.iter().enumerate() {
        let sides = [0, 1, 2, 3].map(|corner| edge_of(quad[corner], quad[(corner + 1) % 4], face));
        let middle = (vertices.len() + face) as u32;
        refined.extend([0, 1, 2, 3].map(|corner| [quad[corner], sides[corner], middle, sides[(corner + 3) % 4]]));
    }
    let mut around: Vec<(Vec<(f32, &Weights)>, f32)> = vec![(Vec::new(), 0.0); vertices.len()];
    for (quad, face) in quads.iter().zip(&faces) {
        quad.iter().for_each(|corner| {
            let (parts, faces) = &mut around[*corner as usize];
            parts.push((1.0, face));
            *faces += 1.0;
        });
    }
    for (ends, _) in &edges {
        for end in ends {
            around[*end as usize].0.extend(ends.map(|end| (1.0, &vertices[end as usize])));
        }
    }
    let moved = around.iter().zip(vertices).map(|((parts, faces), vertex)| {
        // (F + 2R + (n − 3) P) / n, with the means F of the n faces and R of the n edges' middles: R is half of the
        // ends' mean.
        let scaled = parts.iter().map(|(factor, part)| (factor / (faces * faces), *part));
        sum(scaled.chain([((faces - 3.0) / faces, vertex)]))
    });
    let edge_points = edges.iter().map(|(ends, beside)| {
        let ends = ends.iter().map(|end| (0.25, &vertices[*end as usize]));
        sum(ends.chain(beside.iter().map(|face| (0.25, &faces[*face]))))
    });
    let refined_vertices = moved.chain(faces.iter().copied()).chain(edge_points).collect();
    (refined_vertices, refined)
}

/// Two directions at each vertex: the neighbours in their order around it, weighted by the cosine and the sine of their
/// angle.
fn tangents(positions: &[Weights], quads: &[[u32; 4]]) -> Vec<[Weights; 2]> {
    // For each vertex, from one neighbour to the next one, counter-clockwise.
    let mut next: Vec<HashMap<u32, u32>> = vec![HashMap::new(); positions.len()];
    for quad in quads {
        for corner in 0..4 {
            next[quad[corner] as usize].insert(quad[(corner + 1) % 4], quad[(corner + 3) % 4]);
        }
    }
    let of_vertex = |next: &HashMap<u32, u32>| {
        let Some(&first) = next.keys().min() else { return [[0.0; POINTS]; 2] };
        let mut neighbours = vec![first];
        while let Some(&neighbour) = neighbours.last().and_then(|last| next.get(last)).filter(|next| **next != first) {
            neighbours.push(neighbour);
        }
        let turn = std::f32::consts::TAU / neighbours.len() as f32;
        let weighted = |function: fn(f32) -> f32| {
            let parts = neighbours.iter().enumerate();
            sum(parts.map(|(number, neighbour)| (function(number as f32 * turn), &positions[*neighbour as usize])))
        };
        [weighted(f32::cos), weighted(f32::sin)]
    };
    next.iter().map(of_vertex).collect()
}
