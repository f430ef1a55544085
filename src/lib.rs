//! Frontalis measures the muscle forces of a facial expression from the first and the last frame of a video.

pub mod face;

pub mod camera;

pub mod frames;

pub mod skin;

pub mod customize;

pub mod displacement;

pub mod forces;

pub mod project;

pub mod pipeline;

pub mod draw;

#[cfg(feature = "gui")]
pub mod gui;
