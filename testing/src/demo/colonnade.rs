//! The Cornell box in a colonnade at dusk.

mod architecture;
mod cornell_box;
mod fires;
mod glass;
mod glows;
mod lamp;
mod layout;
mod lights;
mod mesh_builder;
mod quasirandom;
mod scene;
mod shared_assets;
mod site;
#[cfg(test)]
mod tests;

pub use scene::colonnade;
