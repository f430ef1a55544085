//! The window, used as a person uses it: found by the names that a screen reader reads, clicked, dragged, typed into,
//! and looked at.
#![cfg(feature = "gui")]

mod files;
mod marking;
mod pictures;
mod stage;
mod table_of_actions;
