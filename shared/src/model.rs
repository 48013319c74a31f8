//! The domain's nouns and the local model: what both sides mean by a HIP sample, an update and a box, and how they compute it.

pub mod architecture;
pub mod contact;
pub mod correction;
pub mod dynamics;
pub mod geometry;
pub mod history;
pub mod local_model;
pub mod params;
pub mod sample;
pub mod settings;
pub mod tool;
pub mod update;
