//! The window, used as a person uses it: found by the names that a screen reader reads, clicked, dragged, typed into,
//! and looked at.
#![cfg(feature = "gui")]
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod doubt;
mod expressions;
mod face;
mod files;
mod film;
mod guiding;
mod hand;
mod keys;
mod marking;
mod muscle_way;
mod muscles;
mod new_frames;
mod pictures;
mod replay;
mod snapping;
mod stage;
mod study;
mod subjects;
mod suggesting;
mod table_of_actions;
mod times;
