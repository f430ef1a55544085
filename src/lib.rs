//! Frontalis measures the muscle forces of a facial expression from the first and the last frame of a video.

pub mod face;

pub mod camera;
