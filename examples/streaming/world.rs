//! The tiles around the camera.

use std::collections::HashMap;
use std::error::Error;
use std::sync::Arc;

use drawloom::glam::{DVec3, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    AssetLoader, Light, LoadError, Material, Mesh, ObjectHandle, RenderObject, Scene, SceneError, Texture, Topology,
    Vertex,
};
use drawloom::task::Scheduler;

use crate::flight::Flight;
use crate::land::WATER;
use crate::plants::Plants;
use crate::tile::{self, SIDE, TileIndex};

/// The land around the camera, as the engine knows it: tiles that are drawn, or on their way.
pub struct World {
    pub scene: Scene,
    loader: AssetLoader,
    tiles: HashMap<TileIndex, Tile>,
    tile_of_mesh: HashMap<Handle<Mesh>, TileIndex>,
    plants: Plants,
    water: ObjectHandle,
    made: u64,
}

struct Tile {
    mesh: Handle<Mesh>,
    texture: Handle<Texture>,
    material: Handle<Material>,
    objects: Vec<ObjectHandle>,
    is_nearby: bool,
}

impl World {
    /// In metres. Haze hides where the tiles end.
    const RADIUS: f64 = 440.0;
    /// In metres. Land that is farther is half hidden by haze.
    const NEARBY: f64 = 250.0;
    /// Tiles behind the camera stay for so long, so that it may turn a little.
    const BEHIND: f64 = 90.0;
    /// The most tiles that the engine begins in a frame.
    const TILES_PER_FRAME: usize = 3;

    /// # Errors
    /// If the scene refuses something.
    pub fn new(scheduler: &Arc<Scheduler>, sky: Vec3) -> Result<Self, SceneError> {
        let mut scene = Scene::new();
        scene.lights = vec![Light::Directional {
            direction: Vec3::new(0.55, -0.42, 0.72).normalize(),
            illuminance: Vec3::new(3.6, 3.1, 2.5),
            casts_shadow: false,
        }];
        scene.ambient = Vec3::new(0.34, 0.42, 0.55);
        scene.background = sky;
        let plants = Plants::new(&mut scene)?;
        let water = scene.add(water()?)?;
        let material = scene.add(Material {
            name: "water".to_owned(),
            diffuse: Vec3::new(0.03, 0.10, 0.16),
            emission: sky * 0.10,
            ..Material::default()
        })?;
        let water = scene.add_object(RenderObject::new(water, material, DVec3::ZERO))?;
        let loader = scene.assets().loader(scheduler);
        Ok(Self { scene, loader, tiles: HashMap::new(), tile_of_mesh: HashMap::new(), plants, water, made: 0 })
    }

    /// Takes what has arrived, begins tiles ahead of the camera, and drops those behind it. Returns what could not be
    /// made.
    ///
    /// # Errors
    /// If the scene refuses something.
    pub fn update(&mut self, flight: &Flight, time: f64) -> Result<Vec<LoadError>, Box<dyn Error>> {
        let arrivals = self.scene.receive(&self.loader);
        arrivals.meshes.iter().try_for_each(|mesh| self.plant(*mesh))?;
        let camera = flight.camera(time);
        let forward = camera.orientation.as_dquat() * DVec3::NEG_Z;
        let near = Nearness { position: camera.position, forward };
        self.drop_tiles(&near)?;
        let mut missing = self.missing(&near);
        missing.sort_by_key(|(priority, tile)| (-priority, *tile));
        for (priority, tile) in missing.into_iter().take(Self::TILES_PER_FRAME) {
            self.begin(tile, priority)?;
        }
        for (&index, tile) in &mut self.tiles {
            tile.is_nearby = near.offset(index).length() < Self::NEARBY;
            let priority = near.priority(index);
            // Those on their way have none yet.
            let _ = self.scene.set_priority(tile.mesh, priority);
            let _ = self.scene.set_priority(tile.texture, priority - 150);
        }
        let mut water = self.scene.object(self.water)?;
        water.position = DVec3::new(camera.position.x, f64::from(WATER), camera.position.z);
        self.scene.replace_object(self.water, water)?;
        Ok(arrivals.errors)
    }

    /// The bytes of all tiles that were begun.
    pub fn made_bytes(&self) -> u64 {
        self.made
    }

    /// The number of tiles of the last update that are near, and not made yet.
    pub fn pending_nearby(&self) -> usize {
        let is_pending = |tile: &&Tile| self.scene.assets().is_pending(tile.mesh);
        self.tiles.values().filter(|tile| tile.is_nearby).filter(is_pending).count()
    }

    /// The tiles that are needed, and not begun, with their priorities.
    fn missing(&self, near: &Nearness) -> Vec<(i32, TileIndex)> {
        let reach = (Self::RADIUS / SIDE).ceil() as i64;
        let center = TileIndex::at(near.position.x, near.position.z);
        let rows = -reach..=reach;
        let tiles =
            rows.clone().flat_map(|z| rows.clone().map(move |x| TileIndex { x: center.x + x, z: center.z + z }));
        let is_missing = |tile: &TileIndex| near.needs(*tile, 0.0) && !self.tiles.contains_key(tile);
        tiles.filter(is_missing).map(|tile| (near.priority(tile), tile)).collect()
    }

    fn begin(&mut self, index: TileIndex, priority: i32) -> Result<(), SceneError> {
        let name = |kind| format!("{kind} of tile {} {}", index.x, index.z);
        let mesh = self.loader.load(name("mesh"), priority, move || tile::mesh(index));
        // Land without colours is better than none.
        let texture = self.loader.load(name("texture"), priority - 150, move || tile::texture(index));
        // What is seen until the texture arrives.
        let diffuse = Vec3::ONE;
        let material = self.scene.add(Material {
            name: name("material"),
            diffuse,
            texture: Some(texture),
            ..Material::default()
        })?;
        let [x, z] = index.corner();
        let land = RenderObject::new(mesh, material, DVec3::new(x, 0.0, z));
        let objects = vec![self.scene.add_object(land)?];
        self.tile_of_mesh.insert(mesh, index);
        self.tiles.insert(index, Tile { mesh, texture, material, objects, is_nearby: false });
        self.made += tile::BYTES;
        Ok(())
    }

    /// Adds what stands on a tile whose mesh has arrived.
    fn plant(&mut self, mesh: Handle<Mesh>) -> Result<(), SceneError> {
        let Some(index) = self.tile_of_mesh.get(&mesh) else { return Ok(()) };
        let Some(tile) = self.tiles.get_mut(index) else { return Ok(()) };
        for plant in self.plants.on(*index) {
            tile.objects.push(self.scene.add_object(plant)?);
        }
        Ok(())
    }

    /// Drops the tiles that are not needed any more.
    fn drop_tiles(&mut self, near: &Nearness) -> Result<(), Box<dyn Error>> {
        let dropped: Vec<_> = self.tiles.extract_if(|index, _| !near.needs(*index, SIDE)).collect();
        for (_, tile) in dropped {
            for object in tile.objects {
                self.scene.remove_object(object)?;
            }
            self.tile_of_mesh.remove(&tile.mesh);
            // One that could not be made is gone already.
            let _ = self.scene.unload(tile.mesh);
            let _ = self.scene.unload(tile.texture);
            self.scene.remove(tile.material)?;
        }
        Ok(())
    }
}

/// How near tiles are to the camera.
struct Nearness {
    position: DVec3,
    forward: DVec3,
}

impl Nearness {
    /// Whether a tile is near, and not far behind. With a `margin` in metres, so that a tile at the limit does not come
    /// and go.
    fn needs(&self, tile: TileIndex, margin: f64) -> bool {
        let offset = self.offset(tile);
        let ahead = offset.dot(self.forward);
        let aside = (offset - self.forward * ahead).length();
        // The picture is about as wide as it is deep.
        offset.length() < World::RADIUS + margin
            && ahead > -World::BEHIND - margin
            && aside < 130.0 + 0.95 * ahead.max(0.0) + margin
    }

    /// The nearest tiles first.
    fn priority(&self, tile: TileIndex) -> i32 {
        let offset = self.offset(tile);
        let behind = (-offset.dot(self.forward)).max(0.0);
        -(offset.length() + behind) as i32
    }

    /// From the camera to a tile's centre, along the ground.
    fn offset(&self, tile: TileIndex) -> DVec3 {
        let [x, z] = tile.center();
        DVec3::new(x - self.position.x, 0.0, z - self.position.z)
    }
}

/// A square of water around the camera.
fn water() -> Result<Mesh, SceneError> {
    const REACH: f32 = 600.0;
    let corner =
        |[x, z]: [f32; 2]| Vertex { position: [x * REACH, 0.0, z * REACH], normal: [0.0, 1.0, 0.0], uv: [0.0; 2] };
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]].map(corner).to_vec();
    Mesh::new("water", Topology::TriangleList, corners, vec![0, 1, 2, 2, 1, 3])
}
