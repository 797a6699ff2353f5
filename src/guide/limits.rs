//! What Drawloom is not for, and what it does not do.
//!
//! - **Frames that wait for the device.** Drawloom makes the CPU part of a frame fast. If the device is busy all the
//!   time, the CPU part is not what takes long: the inspector shows short frames far apart. Choose a cheaper
//!   [`Quality`](crate::quality::Quality), or another pipeline.
//! - **Few draws.** Below some hundred objects a plain loop on one thread is as fast. Drawloom then runs on one thread
//!   too, and costs about the same.
//! - **Culling and draws by the device itself.** Visibility is found on the CPU, where its jobs are many and cheap.
//!   Engines with millions of objects that never leave the device's memory want a renderer that culls there.
//! - **The web.** Threads are needed, and wgpu's native backends: Vulkan, Metal and DX12.
//! - **A game engine.** There is no window, input, sound, physics, asset pipeline or scene file of its own. `examples/`
//!   shows how such parts are joined to it.
//! - **Physically based materials out of the box.** The shipped materials are diffuse, emissive and textured.
//!   `drawloom-gltf` has metallic and rough ones as an engine's own material type.
//! - **Ray tracing and global illumination.** An engine can add passes for both.
//! - **Streaming by itself.** Meshes and textures are uploaded within the frame that first draws them, which takes long
//!   for many at once, unless an engine [sets a budget](crate::backend::WgpuBackend::stream_resources). Which parts of
//!   a world are loaded is its own decision: see `examples/streaming`. Mip levels and levels of detail are streamed
//!   with their texture and mesh, not one by one.
//! - **More than a device can hold.** Objects, lights and materials beyond the device's largest buffers, and meshes
//!   that none of them holds, are left out, counted and [named](crate::view::SceneIssue); everything else is drawn.
//!   With the limits that every device has, a scene has two million objects, as many materials, and 1.6 million lights
//!   in a view; request the limits of the adapter for more.
//! - **Few changes of bindings with textures of many sizes.** Textures of one [class](crate::scene::TextureClass) are
//!   layers of an array, and six arrays are bound together; materials that need others are drawn apart. Of the 16
//!   textures and samplers that a shader has on every device, 10 and 9 are left for a process's own: the targets that it
//!   samples, and its resources.
//! - **More than one frame in flight on the device's queue, by itself.** The engine decides when it submits, and how
//!   many frames it keeps.
//! - **Recursion by itself.** A mirror in a mirror, or a portal in a portal, is as deep as the engine has cameras for
//!   it. Each has one clip plane, and none without perspective. A directional light's shadow maps cover what main
//!   cameras see, not what only mirrors show.
//! - **Any number of shadow maps.** A frame has as many as a texture has layers, 256 on most devices: a point light
//!   takes six, and a directional one a cascade for each main camera. Lights beyond that shine without a shadow, and
//!   are counted: see [`ShadowMaps`](crate::view::ShadowMaps).
