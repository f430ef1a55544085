//! The way of the skin through a film: its frames are read on a thread of their own while the skin is followed through the frame before.

use std::ops::ControlFlow;
use std::sync::mpsc;

use image::RgbImage;

use super::{Followed, follow};
use crate::face::FaceModel;
use crate::frames::Between;
use crate::frames::between::BetweenError;
use crate::marking::gray::Gray;
use crate::marking::tracking::Prepared;
use crate::pipeline::Outcome;

/// Follows the skin through the frames of a film between the first and the last, as [`follow`] does.
///
/// `picture` is the first frame as it was taken from the film, `first` the same prepared; `stop` is asked before each frame whether to
/// give up, and `seen` is told how many frames were taken.
///
/// # Errors
/// The film cannot be read, is another one, or the work was stopped.
pub fn follow_film(
    between: &Between,
    picture: &RgbImage,
    face: &FaceModel,
    outcome: &Outcome,
    first: &Prepared,
    stop: &(dyn Fn() -> bool + Sync),
    mut seen: impl FnMut(usize),
) -> Result<Followed, BetweenError> {
    // One frame waits while another is in hand.
    let (sender, receiver) = mpsc::sync_channel(0);
    std::thread::scope(|scope| {
        let reader = scope.spawn(move || {
            between.each(picture, &|| stop(), &mut |image| match sender.send(image) {
                Ok(()) => ControlFlow::Continue(()),
                Err(_) => ControlFlow::Break(()),
            })
        });
        let mut count = 0;
        let frames = receiver.into_iter().take_while(|_| !stop()).filter_map(|image: RgbImage| {
            count += 1;
            seen(count);
            Gray::of(&image).map(Prepared::of).filter(|p| p.size() == first.size())
        });
        let followed = follow(face, outcome, first, frames);
        let read = reader.join().unwrap_or_else(|_| Err(BetweenError::BrokeOff { path: between.film.clone() }));
        read.map(|()| followed)
    })
}
