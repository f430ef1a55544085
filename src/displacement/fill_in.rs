//! What becomes of vertices that nobody marked: a harmonic fill between the marks.
