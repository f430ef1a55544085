//! How far marks can be trusted: against their neighbours, against the same hand a second time, and against another hand.
//!
//! ```text
//!  marks ─▶ gap (neighbours disagree, px and N)   worth (which mark would tell most)
//!        ─▶ repeats (the hand's own σ, blind)     agreement (two projects, point by point)
//! ```

pub mod agreement;
pub mod gap;
pub mod repeats;
pub mod worth;

pub use agreement::{Agreement, compare};
pub use gap::{Gap, gap};
pub use repeats::{HandError, hand_error};
pub use worth::{Worth, worth_marking};
