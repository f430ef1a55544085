//! The panels. Each reads the scene and its own view, and pushes commands.

pub mod forces;
pub mod frames;
pub mod menu;
pub mod status;
