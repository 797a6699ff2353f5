//! The colour of each group of nodes.

use std::hash::{DefaultHasher, Hash, Hasher};

use egui::Color32;
use egui::ecolor::Hsva;

/// The colour of a group of nodes, or of a span, by its name: the same in every frame and panel.
pub fn group_color(name: &str) -> Color32 {
    let mut hasher = DefaultHasher::new();
    name.hash(&mut hasher);
    let hash = hasher.finish();
    // In three shades, because close hues look the same.
    let (hue, shade) = ((hash % 360) as f32 / 360.0, (hash >> 32) % 3);
    Hsva::new(hue, 0.45 + 0.1 * shade as f32, 0.85 - 0.1 * shade as f32, 1.0).into()
}

/// The colour of text on a group's colour.
pub const ON_GROUP: Color32 = Color32::from_gray(16);

/// The colour of a worker that searches for work.
pub const SEARCHING: Color32 = Color32::from_gray(110);

/// The colour of a worker that sleeps.
pub const ASLEEP: Color32 = Color32::from_gray(38);

/// The colour of what deserves attention.
pub const ACCENT: Color32 = Color32::from_rgb(255, 146, 85);
