//! Measures the objects that occlusion culling finds for a camera, and its cost.

use std::time::Instant;

use drawloom::quality::Quality;
use drawloom::scene::{Blend, Camera, SceneRef};
use drawloom::view::RenderView;
use drawloom::view::internal::{ObjectTable, OccluderMeshes, OcclusionCuller, VisibleSet};
use drawloom_benches::statistics::median;
use drawloom_benches::table::Table;
use drawloom_testing::samples::Samples;
use serde::Serialize;

use crate::naive;

/// A camera at one tile size, or the totals of all cameras.
#[derive(Clone, Default, Serialize)]
pub struct Row {
    pub camera: String,
    /// The side of a tile in pixels.
    pub side: u32,
    /// Objects in the frustum.
    #[serde(rename = "seen")]
    pub in_frustum: usize,
    /// The hidden objects in the frustum: alone they would cover a sample, but among the others they do not.
    pub truly_hidden: usize,
    /// The truly hidden objects that were culled.
    pub found: usize,
    /// Visible objects that were culled.
    pub false_hidden: usize,
    pub naive_found: usize,
    pub naive_false: usize,
    /// The number of drawn convex parts of occluders.
    pub parts: usize,
    /// Selection and projection of occluders, in microseconds.
    pub choose_us: f64,
    /// Drawing of the coarse depth buffer on one core, in microseconds.
    pub draw_us: f64,
    /// Test of one object, in nanoseconds.
    pub object_ns: f64,
}

impl Row {
    /// A row for each tile size: sums over all cameras, and mean times.
    pub fn totals(rows: &[Self]) -> Vec<Self> {
        let total = |side: u32| {
            let rows = rows.iter().filter(|row| row.side == side);
            let count = rows.clone().count() as f64;
            let sum = |figure: fn(&Self) -> usize| rows.clone().map(figure).sum();
            let mean = |figure: fn(&Self) -> f64| rows.clone().map(figure).sum::<f64>() / count;
            Self {
                camera: "all".to_owned(),
                side,
                in_frustum: sum(|row| row.in_frustum),
                truly_hidden: sum(|row| row.truly_hidden),
                found: sum(|row| row.found),
                false_hidden: sum(|row| row.false_hidden),
                naive_found: sum(|row| row.naive_found),
                naive_false: sum(|row| row.naive_false),
                parts: sum(|row| row.parts),
                choose_us: mean(|row| row.choose_us),
                draw_us: mean(|row| row.draw_us),
                object_ns: mean(|row| row.object_ns),
            }
        };
        Quality::OCCLUSION_TILE_SIZES.into_iter().map(total).collect()
    }
}

/// A camera, and the objects in its frustum.
pub struct CameraCase<'a> {
    scene: &'a SceneRef<'a>,
    view: RenderView,
    table: ObjectTable,
    meshes: OccluderMeshes,
    in_frustum: Vec<bool>,
    truth: Samples,
}

impl<'a> CameraCase<'a> {
    pub fn new(scene: &'a SceneRef<'a>, camera: &Camera) -> Self {
        let count = scene.object_count();
        let mut table = ObjectTable::default();
        table.update(scene);
        let mut meshes = OccluderMeshes::default();
        meshes.sync(scene.assets, table.used_meshes());
        let view = RenderView::new(camera);
        let sees = |object: usize| {
            let bounds = table.block(object / ObjectTable::BLOCK_SIZE).spheres.get(object % ObjectTable::BLOCK_SIZE);
            view.frustum.intersects_sphere(bounds.center, bounds.radius)
        };
        let in_frustum: Vec<_> = (0..count).map(sees).collect();
        let truth = Samples::new(scene, camera, 0.25, |object| in_frustum[object]);
        Self { scene, view, table, meshes, in_frustum, truth }
    }

    /// Culls with tiles of `side` pixels.
    pub fn measure(&self, side: u32, rounds: usize) -> Row {
        let Self { scene, view, table, meshes, in_frustum, truth } = self;
        let count = in_frustum.len();
        let mut occlusion = OcclusionCuller::default();
        let mut visible = VisibleSet::default();
        let mut times: [Vec<f64>; 3] = Default::default();
        for _ in 0..rounds {
            visible.reset(count);
            for (word, sees) in in_frustum.chunks(VisibleSet::OBJECTS_PER_WORD).enumerate() {
                let bits = sees.iter().enumerate().fold(0, |bits, (bit, &sees)| bits | u64::from(sees) << bit);
                visible.replace(word, u64::MAX, bits);
            }
            occlusion.reset(view, side);
            let start = Instant::now();
            occlusion.select_occluders(scene, table, &visible, meshes, |_, draw| draw.state.blend() == Blend::None);
            let chosen = Instant::now();
            (0..occlusion.strip_count()).for_each(|strip| occlusion.draw_occluders(strip));
            let drawn = Instant::now();
            visible.remove_hidden(0..count, |first, in_frustum| occlusion.hidden(scene, table, first, in_frustum));
            let spans = [chosen - start, drawn - chosen, drawn.elapsed()];
            times.iter_mut().zip(spans).for_each(|(times, span)| times.push(span.as_secs_f64()));
        }
        let is_visible = |object: usize| {
            visible.word(object / VisibleSet::OBJECTS_PER_WORD) >> (object % VisibleSet::OBJECTS_PER_WORD) & 1 == 1
        };
        let hidden: Vec<_> = (0..count).map(|object| in_frustum[object] && !is_visible(object)).collect();
        let naive = naive::hidden(scene, &view.camera, side, in_frustum);
        let number = |of: &dyn Fn(usize) -> bool| (0..count).filter(|&object| of(object)).count();
        let is_truly_hidden = |object: usize| truth.alone[object] && !truth.shown[object];
        let in_frustum_count = number(&|object| in_frustum[object]);
        let [choose, draw, test] = times.map(median);
        Row {
            camera: view.name().to_owned(),
            side,
            in_frustum: in_frustum_count,
            truly_hidden: number(&is_truly_hidden),
            found: number(&|object| is_truly_hidden(object) && hidden[object]),
            false_hidden: number(&|object| truth.shown[object] && hidden[object]),
            naive_found: number(&|object| is_truly_hidden(object) && naive[object]),
            naive_false: number(&|object| truth.shown[object] && naive[object]),
            parts: occlusion.part_count(),
            choose_us: choose * 1e6,
            draw_us: draw * 1e6,
            object_ns: test * 1e9 / in_frustum_count.max(1) as f64,
        }
    }
}

pub fn print(rows: &[Row]) {
    let headings = [
        "camera",
        "1/k",
        "in frustum",
        "hidden",
        "found",
        "false",
        "naive found",
        "naive false",
        "select µs",
        "draw µs",
        "ns per object",
    ];
    let mut table = Table::new(&headings);
    let percent = |part: usize, whole: usize| format!("{:.1}", part as f64 / whole.max(1) as f64 * 100.0);
    for row in rows {
        table.row([
            row.camera.clone(),
            row.side.to_string(),
            row.in_frustum.to_string(),
            row.truly_hidden.to_string(),
            percent(row.found, row.truly_hidden),
            row.false_hidden.to_string(),
            percent(row.naive_found, row.truly_hidden),
            row.naive_false.to_string(),
            format!("{:.0}", row.choose_us),
            format!("{:.0}", row.draw_us),
            format!("{:.0}", row.object_ns),
        ]);
    }
    table.print();
}
