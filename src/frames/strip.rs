//! A film at a glance: small pictures along it, how much moves, and the two frames proposed.

use std::ops::ControlFlow;

use image::RgbImage;
use image::imageops;

use super::film::{Film, FilmError};
use super::motion::{COMPARED_PX, Motion, Watch};

/// Small pictures along a film.
pub const THUMBNAILS: usize = 48;

/// Longer side of a small picture, px.
pub const THUMBNAIL_PX: u32 = 144;

/// What one frame adds to the strip.
pub struct Seen {
    /// Its index.
    pub index: usize,
    /// Its small picture, for those that have one.
    pub thumbnail: Option<RgbImage>,
    /// What changed since the frame before, grey levels; absent where frames are passed over in a very long film.
    pub speed: Option<f64>,
}

/// A film looked through.
#[derive(Debug)]
pub struct Scan {
    /// How much moves, and the two frames proposed.
    pub motion: Motion,
    /// Frames that can be read.
    pub count: usize,
    /// Why it is not all of them.
    pub broken: Option<FilmError>,
}

/// Looks through a film, one frame in memory at a time.
///
/// # Errors
/// [`FilmError::Stopped`], and any other where not even two frames can be read; a film that is damaged later is looked through up to there.
pub fn scan(film: &mut Film, stop: &dyn Fn() -> bool, seen: &mut dyn FnMut(Seen)) -> Result<Scan, FilmError> {
    let (frames, by) = (film.len(), film.divisor(THUMBNAIL_PX));
    let frame_s = film.time_s(frames.saturating_sub(1)).map(|t| t / (frames - 1).max(1) as f64);
    let mut watch = Watch::new(frames);
    let mut count = 0;
    let done = film.each(0, by, stop, &mut |index, image| {
        count = index + 1;
        let speed = watch.wants(index).then(|| {
            let side = image.width().max(image.height());
            let part = |s: u32| (s * COMPARED_PX / side).max(1);
            watch.see(&imageops::thumbnail(&image, part(image.width()), part(image.height())))
        });
        let thumbnail = has_thumbnail(index, frames).then_some(image);
        seen(Seen { index, thumbnail, speed });
        ControlFlow::Continue(())
    });
    let broken = match done {
        Err(e) if count < 2 || matches!(e, FilmError::Stopped) => return Err(e),
        done => done.err(),
    };
    Ok(Scan { motion: watch.finish(frame_s, &film.key_frames()), count, broken })
}

/// Whether a frame is one of those with a small picture: evenly spaced, the first among them.
fn has_thumbnail(index: usize, frames: usize) -> bool {
    let place = |i: usize| i * THUMBNAILS / frames.max(1);
    index == 0 || place(index) != place(index - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_has_its_thumbnails_its_motion_and_its_proposal() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/film/brow_raise.mp4");
        let mut film = Film::open(path.as_ref(), &|| false).unwrap();
        let mut thumbnails = Vec::new();
        let scan = scan(&mut film, &|| false, &mut |seen| thumbnails.extend(seen.thumbnail)).unwrap();
        assert_eq!((scan.count, thumbnails.len()), (24, 24));
        assert!(scan.broken.is_none());
        // Made of 8 frames at rest, 7 between, 9 raised.
        assert!(scan.motion.moved && scan.motion.first < 8 && scan.motion.last >= 14, "{:?}", scan.motion);
        assert_eq!((0..1000).filter(|&i| has_thumbnail(i, 1000)).count(), THUMBNAILS);
        assert_eq!((0..5).filter(|&i| has_thumbnail(i, 5)).count(), 5);
    }
}
