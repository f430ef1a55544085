//! The panels. Each reads the scene and its own view, and pushes commands.

pub mod forces;
pub mod frames;
pub mod history;
pub mod menu;
pub mod modals;
pub mod palette;
pub mod results;
pub mod sequence;
pub mod settings;
pub mod skin_table;
pub mod status;
