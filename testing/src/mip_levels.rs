//! Targets with mip levels that other processes, other views and later frames sample, and an oracle of what those see.

mod atlas;
mod oracle;
mod processes;

use std::collections::HashMap;

use drawloom::glam::DVec3;
use drawloom::scene::{Camera, Redraw, Scene, ViewKind};

pub use atlas::{ATLAS_FORMATS, ATLAS_SIZES, Shown, atlas_name, atlas_scene, check_atlas, with_atlases};
use oracle::{Chain, Level};
pub use processes::{OUTPUTS, with_mip_levels};
use processes::{OVERLAY, pattern, sampled_level};

/// Frames in which views come, go, change their size and are drawn now and then. The main view is the first.
fn frames() -> Vec<Scene> {
    let camera = |name: &str, size: [u32; 2]| Camera {
        kind: ViewKind::Reflection,
        size,
        ..Camera::looking_at(name, DVec3::Z, DVec3::ZERO)
    };
    let mut cameras = vec![
        Camera { kind: ViewKind::Main, ..camera("main", [37, 23]) },
        camera("wall/0", [12, 7]),
        camera("mirror", [21, 9]),
        camera("wall/1", [12, 7]),
    ];
    cameras.extend((0..6).map(|face| camera(&format!("probe/{face}"), [5, 5])));
    let index_of = |cameras: &[Camera], name: &str| cameras.iter().position(|camera| camera.name == name).unwrap();
    let mut frames = Vec::new();
    for frame in 0..13 {
        match frame {
            3 => {
                let mirror = index_of(&cameras, "mirror");
                cameras[mirror].size = [16, 1];
            }
            4 => drop(cameras.remove(index_of(&cameras, "wall/1"))),
            5 => drop(cameras.remove(index_of(&cameras, "mirror"))),
            6 => cameras.insert(1, camera("mirror", [16, 1])),
            7 => {
                let mirror = index_of(&cameras, "mirror");
                cameras[mirror].redraw = Redraw::Interval(3);
                cameras[0].size = [64, 31];
            }
            10 => cameras.push(camera("wall/1", [12, 7])),
            11 => cameras.insert(2, camera("main/mirror", [3, 40])),
            _ => {}
        }
        let mut scene = Scene::new();
        scene.cameras = cameras.clone();
        frames.push(scene);
    }
    frames
}

/// What a backend drew in a frame.
pub struct DrawnFrame {
    /// Of each view, whether the frame drew it; otherwise its targets hold what an earlier frame drew.
    pub is_drawn: Vec<bool>,
    /// The pixels of the [`OUTPUTS`] of the first view.
    pub outputs: [Vec<[f64; 4]>; 3],
}

/// Draws frames with `draw` and compares them with the oracle. Filters between pixels and levels may err by
/// `filter_error`.
///
/// # Errors
/// If a frame cannot be drawn, or differs.
pub fn check<E: ToString>(
    filter_error: f64,
    mut draw: impl FnMut(usize, &Scene) -> Result<DrawnFrame, E>,
) -> Result<(), String> {
    let mut held: HashMap<String, Chain> = HashMap::new();
    for (frame, scene) in frames().iter().enumerate() {
        let drawn = draw(frame, scene).map_err(|error| format!("frame {frame}: {}", error.to_string()))?;
        let size_of = |camera: &Camera| camera.size.map(|pixels| pixels as usize);
        let reflection = |reader: &str, name: &str| {
            let find = |name: &str| {
                scene.cameras.iter().find(|camera| camera.kind == ViewKind::Reflection && camera.name == name)
            };
            find(&format!("{reader}/{name}")).or_else(|| find(name))
        };
        let previous = |camera: &Camera| {
            let known = held.get(&camera.name).filter(|known| known.0[0].size == size_of(camera));
            known.cloned().unwrap_or_else(|| Chain::zeros(size_of(camera)))
        };
        let (mut next, mut without_overlay) = (HashMap::new(), None);
        for (index, camera) in scene.cameras.iter().enumerate() {
            let own = previous(camera);
            let mirror = reflection(&camera.name, "mirror").map_or_else(|| Chain::zeros([1, 1]), previous);
            let size = size_of(camera);
            let level = Level::new(size, |pixel| {
                pattern(size[0], pixel) + own.loaded(pixel, 1) * 0.25 + mirror.loaded(pixel, 2) * 0.25
            });
            let chain = match held.get(&camera.name).filter(|_| !drawn.is_drawn[index]) {
                Some(held) => held.clone(),
                None => Chain::of(Level::new(size, |pixel| level.at(pixel) + OVERLAY)),
            };
            if index == 0 {
                without_overlay = Some(Chain::of(level));
            }
            next.insert(camera.name.clone(), chain);
        }
        held = next;
        let now = |name: &str| {
            reflection("main", name).map_or_else(|| Chain::zeros([1, 1]), |camera| held[&camera.name].clone())
        };
        let (own, late) = (without_overlay.ok_or("no view")?, &held["main"]);
        let (mirror, wall, probe) = (
            now("mirror"),
            [now("wall/0"), now("wall/1")],
            [0, 1, 2, 3, 4, 5].map(|face| now(&format!("probe/{face}"))),
        );
        let [width, height] = size_of(&scene.cameras[0]);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let level = |chain: &Chain| x / 3 % chain.0.len();
            let uv = [(x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64];
            let last = probe[0].0.len() - 1;
            let expected = [
                [
                    own.loaded([x, y], level(&own)),
                    mirror.loaded([x, y], level(&mirror)),
                    mirror.sampled(uv, sampled_level(x)),
                    own.0.len() as f64,
                ],
                [wall[x % 2].loaded([x, y], level(&wall[0])), probe[y % 6].loaded([0, 0], last), last as f64, 0.0],
                [late.loaded([x, y], level(late)), 0.0, 0.0, 0.0],
            ];
            for (output, (name, expected)) in OUTPUTS.into_iter().zip(expected).enumerate() {
                let found = drawn.outputs[output].get(y * width + x).ok_or("too few pixels")?;
                for channel in 0..4 {
                    // Each level is rounded to half floats, by some devices downwards.
                    let error = if (output, channel) == (0, 2) { filter_error } else { 0.0 } + 0.008;
                    if (found[channel] - expected[channel]).abs() > error {
                        return Err(format!(
                            "frame {frame}: {name:?} has {found:?} at ({x}, {y}) instead of {expected:?}"
                        ));
                    }
                }
            }
        }
    }
    Ok(())
}
