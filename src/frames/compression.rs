//! What a picture owes to other frames of its film: coders save bits by carrying skin over from frame to frame.

/// How a picture was compressed, as far as is known.
///
/// A frame that a coder predicts from others shows their texture, moved in blocks by whole quarters of a pixel, and corrected only where the
/// difference is worth the bits. Skin is too faint to be: its texture stays behind while the face moves on, and what compares two such
/// frames finds the coder's motion, not the skin's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// By itself: a key frame of a film, or a film whose every frame is a picture of its own.
    Intra,
    /// From other frames of its film.
    Inter,
    /// Nothing says.
    #[default]
    Unknown,
}

impl Compression {
    /// The words in files and on the screen; none where nothing is known.
    pub fn words(self) -> Option<&'static str> {
        match self {
            Self::Intra => Some("key frame"),
            Self::Inter => Some("predicted frame"),
            Self::Unknown => None,
        }
    }

    /// What the words say.
    pub fn of_words(words: &str) -> Option<Self> {
        [Self::Intra, Self::Inter].into_iter().find(|c| c.words() == Some(words))
    }
}
