//! The scene, as entities.

use bevy_app::{App, Update};
use bevy_asset::Assets;
use bevy_camera::visibility::NoCpuCulling;
use bevy_camera::{
    Camera, Camera3d, ClearColor, ManualTextureViewHandle, PerspectiveProjection, Projection, RenderTarget,
};
use bevy_color::{Color, LinearRgba};
use bevy_ecs::component::Component;
use bevy_ecs::entity::Entity;
use bevy_ecs::query::With;
use bevy_ecs::resource::Resource;
use bevy_ecs::schedule::IntoScheduleConfigs;
use bevy_ecs::schedule::common_conditions::resource_exists;
use bevy_ecs::system::{Query, Res, ResMut};
use bevy_ecs::world::World;
use bevy_light::cluster::ClusterConfig;
use bevy_light::{DirectionalLight, GlobalAmbientLight};
use bevy_math::{DVec3, UVec2, Vec3};
use bevy_mesh::{Mesh, Mesh3d};
use bevy_pbr::{MeshMaterial3d, StandardMaterial};
use bevy_render::renderer::RenderDevice;
use bevy_render::texture::{ManualTextureView, ManualTextureViews};
use bevy_render::view::{DebandDither, Msaa, Tonemapping};
use bevy_shape::Cuboid;
use bevy_transform::components::Transform;
use drawloom::wgpu;

use super::Mode;
use crate::layout::{self, Layout, Motion};

/// An object that moves.
#[derive(Component)]
pub struct Moving;

/// A camera that turns.
#[derive(Component)]
pub struct Turning;

/// The number of the next frame in which something moves.
#[derive(Default, Resource)]
pub struct Frame(u32);

/// In lux. The default exposure makes it as bright as Drawloom's light.
const ILLUMINANCE: f32 = 9_000.0;
/// In candela per square metre.
const AMBIENT: f32 = 300.0;

/// Adds the systems that move objects and cameras. Nothing moves before [`start`].
pub fn add_systems(app: &mut App) {
    let systems = (move_objects, turn_cameras, count_frame).chain();
    app.add_systems(Update, systems.run_if(resource_exists::<Frame>));
}

/// Lets the next frame be frame 0.
pub fn start(world: &mut World) {
    world.init_resource::<Frame>();
}

fn move_objects(mut objects: Query<&mut Transform, With<Moving>>, frame: Res<Frame>) {
    let step = DVec3::from_array(layout::step(frame.0)).as_vec3();
    objects.par_iter_mut().for_each(|mut transform| transform.translation += step);
}

fn turn_cameras(mut cameras: Query<&mut Transform, With<Turning>>, frame: Res<Frame>) {
    cameras.iter_mut().for_each(|mut transform| transform.rotate_y(layout::angle(frame.0)));
}

fn count_frame(mut frame: ResMut<Frame>) {
    frame.0 += 1;
}

/// Adds all objects, cameras and the light to a world, and returns the texture of each camera.
pub fn spawn(world: &mut World, layout: &Layout, mode: Mode, device: &RenderDevice) -> Vec<wgpu::Texture> {
    spawn_objects(world, layout, mode);
    world.insert_resource(ClearColor(Color::BLACK));
    world.insert_resource(GlobalAmbientLight { brightness: AMBIENT, ..GlobalAmbientLight::default() });
    world.spawn((
        DirectionalLight { illuminance: ILLUMINANCE, shadow_maps_enabled: false, ..DirectionalLight::default() },
        Transform::default().looking_to(Vec3::from_array(layout::LIGHT), Vec3::Y),
    ));
    let spawn = |(index, position)| {
        let (camera, texture) = spawn_camera(world, layout.picture, (index, position), device);
        if layout.motion == Motion::Cameras {
            world.entity_mut(camera).insert(Turning);
        }
        texture
    };
    layout.cameras().enumerate().map(spawn).collect()
}

fn spawn_objects(world: &mut World, layout: &Layout, mode: Mode) {
    let mut assets = world.resource_mut::<Assets<Mesh>>();
    let meshes: Vec<_> = (0..layout::MESHES).map(|_| assets.add(Mesh::from(Cuboid::new(1.0, 1.0, 1.0)))).collect();
    let mut assets = world.resource_mut::<Assets<StandardMaterial>>();
    let material = |[red, green, blue]: [f32; 3]| StandardMaterial {
        base_color: Color::LinearRgba(LinearRgba::rgb(red, green, blue)),
        perceptual_roughness: 1.0,
        reflectance: 0.0,
        ..StandardMaterial::default()
    };
    let materials: Vec<_> = layout::MATERIALS.iter().map(|&diffuse| assets.add(material(diffuse))).collect();
    let object = |(object, position)| {
        (
            Mesh3d(meshes[Layout::mesh(object)].clone()),
            MeshMaterial3d(materials[Layout::material(object)].clone()),
            Transform::from_translation(DVec3::from_array(position).as_vec3()),
        )
    };
    let objects: Vec<_> = layout.positions().enumerate().map(object).collect();
    let entities: Vec<_> = world.spawn_batch(objects).collect();
    let moving = entities.iter().enumerate().filter(|&(object, _)| layout.moves(object));
    world.insert_batch(moving.map(|(_, &entity)| (entity, Moving)).collect::<Vec<_>>());
    if mode == Mode::DeviceCulling {
        world.insert_batch(entities.into_iter().map(|entity| (entity, NoCpuCulling)).collect::<Vec<_>>());
    }
}

/// Adds the camera of this index and position. Its picture is square.
fn spawn_camera(
    world: &mut World,
    side: u32,
    (index, position): (usize, [f64; 3]),
    device: &RenderDevice,
) -> (Entity, wgpu::Texture) {
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let texture = device.wgpu_device().create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let handle = ManualTextureViewHandle(index as u32);
    let target = ManualTextureView { texture_view: view.into(), size: UVec2::splat(side), view_format: format };
    world.resource_mut::<ManualTextureViews>().insert(handle, target);
    let camera = world.spawn((
        Camera3d::default(),
        Camera { order: index as isize, ..Camera::default() },
        RenderTarget::TextureView(handle),
        Projection::Perspective(PerspectiveProjection {
            fov: layout::FIELD_OF_VIEW,
            near: layout::NEAR,
            far: 10_000.0,
            ..PerspectiveProjection::default()
        }),
        Msaa::Off,
        ClusterConfig::Single,
        // The curve that is the nearest to Drawloom's, which is another fit of ACES.
        Tonemapping::AcesFitted,
        DebandDither::Disabled,
        Transform::from_translation(DVec3::from_array(position).as_vec3()).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    (camera.id(), texture)
}
