//! Studies: scenes whose truth is known, against which the chain is measured, and the charts' numbers.
//!
//! A [`Kind`] of study makes a [`runner::Plan`], a list of cases; each case gives rows of one [`table`]. A plan runs over all cores or one,
//! can be stopped at any moment, and goes on from its [`journal`]. [`points`] and [`cells`] are what charts show of a table.

pub mod accuracy;
pub mod activation_trial;
pub mod applied;
pub mod artist;
pub mod artist_laws;
pub mod artist_marks;
pub mod cells;
pub mod face_fit;
pub mod journal;
pub mod kind;
pub mod ladder;
pub mod law_marks;
pub mod law_trial;
pub mod laws;
pub mod machine;
pub mod marking_trial;
pub mod membrane_truth;
pub mod people;
pub mod points;
pub mod runner;
pub mod scaling;
pub mod scene;
pub mod sheet;
pub mod stability;
pub mod table;
pub mod truth_trial;
pub mod twin;
pub mod wish;
mod yardstick;

pub use kind::{Kind, Options};
pub use membrane_truth::{MembraneFace, MembraneSettings, MembraneTruth};
pub use table::Run;
pub use twin::{TrueCrossing, Twin, TwinError, TwinSettings};
pub use wish::Wish;
