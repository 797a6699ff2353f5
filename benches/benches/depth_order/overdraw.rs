//! The overdraw and the draws of scenes by the order of their objects.

use std::error::Error;
use std::sync::Arc;
use std::thread::available_parallelism;

use drawloom::quality::DepthPrecision;
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom_benches::city;
use drawloom_benches::clouds::around_one;
use drawloom_benches::table::Table;
use drawloom_testing::demo;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::across_meshes::AcrossMeshes;
use crate::fragment_counter::{Counts, FragmentCounter};
use crate::{Extent, ORDERS};

/// Cameras around a cloud.
const CLOUD_CAMERAS: usize = 4;

/// The counts of a scene in one order, over all of its cameras.
#[derive(Serialize)]
pub struct Row {
    scene: String,
    order: &'static str,
    cameras: usize,
    fragments: u64,
    covered: u64,
    /// Fragments ÷ covered pixels.
    overdraw: f64,
    /// The mean of the cameras.
    draws_per_frame: f64,
}

#[derive(Clone, Copy)]
enum Order {
    /// `Quality::opaque_order`.
    SortKey(DepthPrecision),
    AcrossMeshes(AcrossMeshes),
}

/// Counts the fragments and draws of all scenes in all orders.
///
/// # Errors
/// Returns an error if a frame cannot be drawn, or if the order changes which pixels are covered.
pub fn measure(extent: &Extent, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let scheduler = Arc::new(Scheduler::new(available_parallelism()?.get())?);
    let orders = ORDERS.map(|(name, key)| (name, Order::SortKey(key))).into_iter();
    let orders: Vec<_> =
        orders.chain(AcrossMeshes::ALL.map(|order| (order.name(), Order::AcrossMeshes(order)))).collect();
    let scenes = scenes(extent)?;
    progress.inc_length((scenes.iter().map(|(_, scene)| scene.cameras.len()).sum::<usize>() * orders.len()) as u64);

    let mut rows = Vec::new();
    for (name, scene) in &scenes {
        progress.set_message(name.clone());
        let mut totals = vec![Counts::default(); orders.len()];
        let mut counter = FragmentCounter::new(&scheduler)?;
        for camera in &scene.cameras {
            let camera = Camera { size: extent.picture, ..camera.clone() };
            let mut covered = None;
            for (total, (order_name, order)) in totals.iter_mut().zip(&orders) {
                let counts = match order {
                    Order::SortKey(key) => counter.count(scene, &camera, *key)?,
                    Order::AcrossMeshes(order) => order.count(&scheduler, scene, &camera)?,
                };
                if *covered.get_or_insert(counts.covered) != counts.covered {
                    return Err(format!("{name}, {order_name}: the order changes the covered pixels").into());
                }
                *total += counts;
                progress.inc(1);
            }
        }
        rows.extend(totals.iter().zip(&orders).map(|(total, (order, _))| Row {
            scene: name.clone(),
            order,
            cameras: scene.cameras.len(),
            fragments: total.fragments,
            covered: total.covered,
            overdraw: total.overdraw(),
            draws_per_frame: total.draws as f64 / scene.cameras.len() as f64,
        }));
    }
    Ok(rows)
}

fn scenes(extent: &Extent) -> Result<Vec<(String, Scene)>, Box<dyn Error>> {
    let mut colonnade = demo::colonnade()?;
    let outside = demo::camera(colonnade.as_scene_ref());
    colonnade.cameras.push(outside);
    let mut scenes = vec![
        ("colonnade".to_owned(), colonnade),
        (format!("city, {}", extent.city), city::new(extent.city, extent.picture)?),
    ];
    for objects in extent.clouds {
        scenes.push((format!("cloud, {objects}"), around_one(CLOUD_CAMERAS, objects)?));
    }
    Ok(scenes)
}

/// Prints a line for each order, and two columns for each scene.
pub fn print(rows: &[Row]) {
    let mut scenes: Vec<_> = rows.iter().map(|row| row.scene.as_str()).collect();
    scenes.dedup();
    let [first, second, third, fourth] = scenes[..] else { unreachable!("there are four scenes") };
    let mut table = Table::new(&["opaque order", first, "draws", second, "draws", third, "draws", fourth, "draws"]);
    let orders = rows.len() / scenes.len();
    for index in 0..orders {
        let of_scene = |scene: usize| &rows[scene * orders + index];
        let overdraw = |scene: usize| format!("{:.2}", of_scene(scene).overdraw);
        let draws = |scene: usize| format!("{:.0}", of_scene(scene).draws_per_frame);
        table.row([
            of_scene(0).order.to_owned(),
            overdraw(0),
            draws(0),
            overdraw(1),
            draws(1),
            overdraw(2),
            draws(2),
            overdraw(3),
            draws(3),
        ]);
    }
    table.print();
}
