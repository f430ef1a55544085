//! Studies: scenes whose truth is known, against which the chain is measured.

pub mod scene;
pub mod twin;

pub use twin::{Twin, TwinError, TwinSettings};
