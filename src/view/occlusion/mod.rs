//! Occlusion culling: objects that larger ones hide are removed from a view (S 9.6).

mod occluder_meshes;
mod occlusion_camera;
mod occlusion_culler;

pub use occluder_meshes::OccluderMeshes;
pub use occlusion_culler::OcclusionCuller;
