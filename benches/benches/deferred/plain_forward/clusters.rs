//! Clustered forward shading (Olsson et al. 2012), binned on the CPU (Persson 2013): the picture is divided into tiles,
//! and each tile by distance. Each cluster has a list of the lights that reach it, and a pixel loops over that of its
//! cluster.

use std::array;
use std::error::Error;
use std::ops::Range;

use drawloom::process::ILLUMINATION_SHADER;
use drawloom::scene::SceneRef;
use drawloom::view::internal::GpuLight;
use drawloom::wgpu;

use super::device::{Device, SurfacePipeline};
use super::picture::{Picture, SeenLight};
use super::visible_scene::VisibleScene;
use super::{Lighting, LightingCounts};

/// Pixels across a tile.
const TILE: u32 = 16;
/// Divisions by distance, between the nearest and the farthest point that a light reaches.
const SLICES: u32 = 16;
/// Memory for the lists: clusters per light.
const MAX_CLUSTERS_PER_LIGHT: usize = 1_024;

pub struct Clusters {
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    grid: wgpu::Buffer,
    first_lights: wgpu::Buffer,
    cluster_lights: wgpu::Buffer,
    capacity: usize,
    /// Kept over all frames: a cluster, and a light that reaches it.
    pairs: Vec<[u32; 2]>,
    /// The beginning of each cluster's list, and the end of the last.
    firsts: Vec<u32>,
    lists: Vec<u32>,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Grid {
    columns: u32,
    rows: u32,
    slices: u32,
    tile: f32,
    nearest: f32,
    slices_per_log: f32,
    padding: [u32; 2],
}

impl Clusters {
    pub fn new(device: &Device, scene: &SceneRef<'_>) -> Self {
        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        let layout = device.layout(&[wgpu::BufferBindingType::Uniform, storage, storage]);
        let [columns, rows] = device.size.map(|pixels| pixels.div_ceil(TILE));
        let clusters = (columns * rows * SLICES) as usize;
        let capacity = (scene.lights.len() * MAX_CLUSTERS_PER_LIGHT).max(1);
        let grid = device.buffer(wgpu::BufferUsages::UNIFORM, size_of::<Grid>());
        let first_lights = device.buffer(wgpu::BufferUsages::STORAGE, (clusters + 1) * size_of::<u32>());
        let cluster_lights = device.buffer(wgpu::BufferUsages::STORAGE, capacity * size_of::<u32>());
        let shader = [device.surface_shader(), ILLUMINATION_SHADER, include_str!("clustered.wgsl")].concat();
        Self {
            pipeline: device.surface_pipeline(&SurfacePipeline { shader: &shader, layout: Some(&layout), adds: false }),
            group: device.group(&layout, &[&grid, &first_lights, &cluster_lights]),
            grid,
            first_lights,
            cluster_lights,
            capacity,
            pairs: Vec::new(),
            firsts: Vec::new(),
            lists: Vec::new(),
        }
    }

    /// Puts the lights of each cluster next to each other, in the order of lights.
    fn sort_pairs(&mut self, clusters: usize) {
        let Self { pairs, firsts, lists, .. } = self;
        firsts.clear();
        firsts.resize(clusters + 1, 0);
        pairs.iter().for_each(|&[cluster, _]| firsts[cluster as usize] += 1);
        let mut end = 0;
        for first in firsts.iter_mut() {
            end += std::mem::replace(first, end);
        }
        lists.resize(pairs.len(), 0);
        for &[cluster, light] in pairs.iter() {
            let next = &mut firsts[cluster as usize];
            lists[*next as usize] = light;
            *next += 1;
        }
        // Each entry is now where its list ends, which is where the next begins.
        firsts.rotate_right(1);
        firsts[0] = 0;
    }
}

impl Lighting for Clusters {
    fn prepare(&mut self, queue: &wgpu::Queue, scene: &VisibleScene) -> Result<(), Box<dyn Error>> {
        let view = scene.view.as_ref().ok_or("there is no view")?;
        let picture = Picture::new(view);
        let slices = Slices::new(view.near, scene.lights.iter().map(|light| picture.seen(light)));
        let [columns, rows] = [view.width as u32, view.height as u32].map(|pixels| pixels.div_ceil(TILE));
        self.pairs.clear();
        for (index, light) in scene.lights.iter().enumerate() {
            visit_clusters(&picture, light, &slices, [columns, rows], |cluster| {
                self.pairs.push([cluster, index as u32])
            });
        }
        if self.pairs.len() > self.capacity {
            return Err("the lists of clusters do not fit into their buffer".into());
        }
        self.sort_pairs((columns * rows * SLICES) as usize);
        let Slices { nearest, per_log, .. } = slices;
        let grid = Grid {
            columns,
            rows,
            slices: SLICES,
            tile: TILE as f32,
            nearest,
            slices_per_log: per_log,
            padding: [0; 2],
        };
        queue.write_buffer(&self.grid, 0, bytemuck::bytes_of(&grid));
        queue.write_buffer(&self.first_lights, 0, bytemuck::cast_slice(&self.firsts));
        queue.write_buffer(&self.cluster_lights, 0, bytemuck::cast_slice(&self.lists));
        Ok(())
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, scene: &VisibleScene, index_count: u32) -> LightingCounts {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(2, &self.group, &[]);
        pass.draw_indexed(0..index_count, 0, 0..scene.drawn.len() as u32);
        LightingCounts { draws: 1, commands: scene.drawn.len() }
    }
}

/// Divisions by distance, each longer than the one before by the same factor.
struct Slices {
    nearest: f32,
    per_log: f32,
    /// Where each slice begins, and where the last ends.
    begins: [f32; SLICES as usize + 1],
}

impl Slices {
    /// Covers the distances that lights reach.
    fn new(near: f32, lights: impl Iterator<Item = SeenLight>) -> Self {
        let (nearest, farthest) = lights.fold((f32::INFINITY, near), |(nearest, farthest), light| {
            (nearest.min(light.center[2] - light.radius), farthest.max(light.center[2] + light.radius))
        });
        let nearest = nearest.clamp(near, farthest);
        // Slightly more, so that the farthest point is in the last slice.
        let length = (farthest / nearest).ln().max(1e-3) * 1.001;
        let per_log = SLICES as f32 / length;
        Self { nearest, per_log, begins: array::from_fn(|slice| nearest * (slice as f32 / per_log).exp()) }
    }

    fn of(&self, distance: f32) -> u32 {
        (((distance / self.nearest).ln() * self.per_log) as u32).min(SLICES - 1)
    }
}

/// Calls `visit` for each cluster that a light may reach: for each slice and each row of tiles, the columns within
/// the sphere's extent there.
fn visit_clusters(
    picture: &Picture,
    light: &GpuLight,
    slices: &Slices,
    [columns, rows]: [u32; 2],
    mut visit: impl FnMut(u32),
) {
    let SeenLight { center: [x, y, z], radius } = picture.seen(light);
    let (near, far) = ((z - radius).max(picture.near), z + radius);
    if far <= near {
        return;
    }
    for slice in slices.of(near) as usize..=slices.of(far) as usize {
        let distances = [slices.begins[slice].max(near), slices.begins[slice + 1].min(far)];
        let extent_squared = radius * radius - squared_distance(z, distances);
        if extent_squared <= 0.0 {
            continue;
        }
        let extent = extent_squared.sqrt();
        for row in tiles(picture, 1, [y - extent, y + extent], distances, rows) {
            let width_squared = extent_squared - squared_distance(y, row_interval(picture, row, distances));
            if width_squared <= 0.0 {
                continue;
            }
            let width = width_squared.sqrt();
            let first = (slice as u32 * rows + row) * columns;
            for column in tiles(picture, 0, [x - width, x + width], distances, columns) {
                visit(first + column);
            }
        }
    }
}

/// The tiles of an axis that an interval covers between two distances; none if it is outside of the picture.
fn tiles(picture: &Picture, axis: usize, interval: [f32; 2], distances: [f32; 2], count: u32) -> Range<u32> {
    let [begin, end] = picture.pixels(axis, interval, distances).map(|pixel| pixel / TILE as f32);
    // Negative numbers become 0.
    (begin.floor() as u32).min(count)..(end.ceil() as u32).min(count)
}

/// The interval, in metres, that a row of tiles covers between two distances.
fn row_interval(picture: &Picture, row: u32, [near, far]: [f32; 2]) -> [f32; 2] {
    let across = |row: u32| ((row * TILE) as f32 / picture.size[1] * 2.0 - 1.0) * picture.half[1];
    let (low, high) = (across(row), across(row + 1));
    [(low * near).min(low * far), (high * near).max(high * far)]
}

/// The square of a number's distance from an interval.
fn squared_distance(number: f32, [low, high]: [f32; 2]) -> f32 {
    let outside = (low - number).max(number - high).max(0.0);
    outside * outside
}
