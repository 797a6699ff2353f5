//! The scene, as entities.

use bevy_asset::Assets;
use bevy_camera::visibility::NoCpuCulling;
use bevy_camera::{
    Camera, Camera3d, ClearColor, ManualTextureViewHandle, PerspectiveProjection, Projection, RenderTarget,
};
use bevy_color::{Color, LinearRgba};
use bevy_ecs::component::Component;
use bevy_ecs::query::With;
use bevy_ecs::system::{Local, Query};
use bevy_ecs::world::World;
use bevy_light::{DirectionalLight, GlobalAmbientLight};
use bevy_math::{DVec3, UVec2, Vec3};
use bevy_mesh::{Mesh, Mesh3d};
use bevy_pbr::{MeshMaterial3d, StandardMaterial};
use bevy_render::renderer::RenderDevice;
use bevy_render::texture::{ManualTextureView, ManualTextureViews};
use bevy_render::view::{Msaa, Tonemapping};
use bevy_shape::Cuboid;
use bevy_transform::components::Transform;
use drawloom::wgpu;

use super::Mode;
use crate::layout::{self, Layout, PICTURE};

/// An object that moves.
#[derive(Component)]
pub struct Moving;

/// In lux. The default exposure makes it as bright as Drawloom's light.
const ILLUMINANCE: f32 = 9_000.0;
/// In candela per square metre.
const AMBIENT: f32 = 300.0;

/// Moves all objects.
pub fn advance(mut objects: Query<&mut Transform, With<Moving>>, mut frame: Local<u32>) {
    let step = DVec3::from_array(layout::step(*frame)).as_vec3();
    *frame += 1;
    objects.par_iter_mut().for_each(|mut transform| transform.translation += step);
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
    let spawn = |(index, position)| spawn_camera(world, index, position, device);
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
            Moving,
            Mesh3d(meshes[Layout::mesh(object)].clone()),
            MeshMaterial3d(materials[Layout::material(object)].clone()),
            Transform::from_translation(DVec3::from_array(position).as_vec3()),
        )
    };
    let objects = layout.positions().enumerate().map(object);
    match mode {
        Mode::DeviceCulling => {
            world.spawn_batch(objects.map(|object| (object, NoCpuCulling)).collect::<Vec<_>>());
        }
        Mode::Default | Mode::Pipelined => {
            world.spawn_batch(objects.collect::<Vec<_>>());
        }
    }
}

fn spawn_camera(world: &mut World, index: usize, position: [f64; 3], device: &RenderDevice) -> wgpu::Texture {
    let format = wgpu::TextureFormat::Rgba8UnormSrgb;
    let texture = device.wgpu_device().create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width: PICTURE, height: PICTURE, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let handle = ManualTextureViewHandle(index as u32);
    let target = ManualTextureView { texture_view: view.into(), size: UVec2::splat(PICTURE), view_format: format };
    world.resource_mut::<ManualTextureViews>().insert(handle, target);
    world.spawn((
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
        Tonemapping::Reinhard,
        Transform::from_translation(DVec3::from_array(position).as_vec3()).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    texture
}
