//! The camera: how the face reaches the picture, how large a pixel is, and how the head moved between the frames.

pub mod head_motion;
pub mod projection;
pub mod scale;

pub use head_motion::{HeadMotion, RigidMotion, StillPoint};
pub use projection::{Camera, Ray};
pub use scale::{Scale, ScaleError};
