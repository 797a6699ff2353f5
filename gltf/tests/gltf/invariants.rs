//! What holds of every file, whatever is in it: of the world that it is loaded as, and of the error that refuses it.
//! The fuzz target `gltf` checks it, too.

use std::cell::RefCell;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::scene::Mesh;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_gltf::{GltfLimits, LoadError, World};

/// Little, so that small files reach every limit.
pub const SMALL_LIMITS: GltfLimits = GltfLimits {
    scene_bytes: 64 << 10,
    json_values: 4000,
    buffer_bytes: 32 << 10,
    geometry_bytes: 256 << 10,
    zero_bytes: 16 << 10,
    keyframe_bytes: 16 << 10,
    pose_bytes: 16 << 10,
    objects: 100,
    lights: 4,
    texture_file_bytes: 16 << 10,
    texture_bytes: 64 << 10,
    all_textures_bytes: 256 << 10,
    warnings: 5,
};

/// Checks a world: it is within limits, has finite numbers and indices that are in range, and Drawloom draws it.
///
/// # Errors
/// If it does not hold.
pub fn check_world(world: &World, limits: &GltfLimits) -> Result<(), String> {
    let columns = world.columns();
    let scene = world.as_scene_ref(&columns);
    expect(world.warnings.len() as u64 <= limits.warnings, || "too many warnings are listed".to_owned())?;
    for name in world.warnings.iter().chain(&world.animations) {
        check_text(name)?;
    }
    expect(world.object_count() as u64 <= limits.objects, || format!("{} objects", world.object_count()))?;
    let mut geometry = 0;
    for (_, mesh) in scene.assets.iter::<Mesh>() {
        check_text(mesh.name())?;
        let (vertices, indices) = (mesh.vertices(), mesh.indices());
        geometry += (size_of_val(vertices) + size_of_val(indices)) as u64;
        let is_finite = vertices.iter().all(|vertex| vertex.position.iter().all(|number| number.is_finite()));
        expect(is_finite, || format!("{} is not finite", mesh.name()))?;
        let is_in_range = indices.iter().all(|&index| (index as usize) < vertices.len());
        expect(is_in_range && indices.len().is_multiple_of(3), || format!("{} has wrong indices", mesh.name()))?;
    }
    expect(geometry <= limits.geometry_bytes, || format!("{geometry} bytes of geometry"))?;
    let resources = world.resource_bytes();
    // A matrix and a number are there without a file that has any.
    let greatest = limits.pose_bytes + limits.geometry_bytes + limits.all_textures_bytes + 68;
    expect(resources <= greatest, || format!("{resources} bytes of textures, joints and morph targets"))?;
    for (bounds, (position, scale)) in scene.bounds.iter().zip(scene.positions.iter().zip(scene.scales)) {
        let is_finite = bounds.is_valid() && position.is_finite() && scale.is_finite();
        expect(is_finite, || format!("{bounds:?} at {position}, scaled by {scale}"))?;
    }
    NULL.with_borrow_mut(|(renderer, submitter)| {
        let recorded = renderer.record(scene).map_err(|error| format!("Drawloom draws it not: {error}"))?;
        submitter.submit(recorded).map_err(|error| format!("Drawloom draws it not: {error}"))?;
        Ok(())
    })
}

/// Checks what is said of a file that is refused.
///
/// # Errors
/// If it does not name the file, or has a [forbidden](is_forbidden) character.
pub fn check_error(error: &LoadError, file: &str) -> Result<(), String> {
    let text = error.to_string();
    expect(text.starts_with(file) && text.len() > file.len() + 10, || format!("{text:?} does not say what is wrong"))?;
    error.warnings.iter().chain([&text]).try_for_each(|text| check_text(text))
}

/// # Errors
/// If it has a [forbidden](is_forbidden) character, or is long.
pub fn check_text(text: &str) -> Result<(), String> {
    let forbidden = text.chars().find(|character| is_forbidden(*character));
    expect(forbidden.is_none(), || format!("{text:?} has the character {forbidden:?}"))?;
    expect(text.len() < 2000, || format!("{text:?} is long"))
}

/// Whether no message may have a character: terminals obey it, it breaks lines, or it turns the direction of text.
pub fn is_forbidden(character: char) -> bool {
    const OTHERS: [char; 14] = [
        '\u{2028}', '\u{2029}', '\u{61c}', '\u{200e}', '\u{200f}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}',
        '\u{202e}', '\u{2066}', '\u{2067}', '\u{2068}', '\u{2069}',
    ];
    character.is_control() || OTHERS.contains(&character)
}

fn expect(holds: bool, otherwise: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(otherwise()) }
}

thread_local! {
    static NULL: RefCell<(Renderer<NullBackend>, Submitter<NullBackend>)> = RefCell::new(null_renderer());
}

fn null_renderer() -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let scheduler = Arc::new(Scheduler::new(1).expect("one worker"));
    Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler).expect("a null backend")
}
