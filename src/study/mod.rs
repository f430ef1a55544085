//! Studies: scenes whose truth is known, against which the chain is measured.

pub mod activation_trial;
pub mod artist;
pub mod artist_laws;
pub mod face_fit;
pub mod law_trial;
pub mod laws;
pub mod marking_trial;
pub mod people;
pub mod scene;
pub mod twin;

pub use twin::{TrueCrossing, Twin, TwinError, TwinSettings};
