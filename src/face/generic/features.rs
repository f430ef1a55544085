//! The drawn lines of the left half of the face: the edge flow a modeller would give it, as curves in the plane of the picture.
//!
//! Every curve runs through its control points; the pieces between two knots are cut into segments of equal length in space.
//! Curves meet where they name the same point. All numbers are mm, x ≥ 0, from the measured proportions of adult faces.

/// A drawn line, and how finely it is cut.
pub(super) struct Curve {
    /// Name, for looking up its vertices.
    pub id: &'static str,
    /// Control points (x, y), mm.
    pub through: &'static [[f64; 2]],
    /// `(index of the control point where the piece ends, how it is cut)`; the first piece starts at control point 0.
    /// None: every control point is a vertex.
    pub pieces: &'static [(usize, Cut)],
}

/// How a piece of a curve is cut into segments.
#[derive(Clone, Copy)]
pub(super) enum Cut {
    /// That many segments of equal length.
    Even(usize),
    /// One segment more, shifted by half a segment but for the ends: beside an even row it makes equilateral triangles.
    Staggered(usize),
}

use Cut::{Even, Staggered};

/// Vertices of the whole face that lie on the midline, and of one half beside it: 30 + 2 · 291 = 612.
pub(super) const ON_MIDLINE: usize = 30;
/// See [`ON_MIDLINE`].
pub(super) const BESIDE_MIDLINE: usize = 291;

/// Number of rows of the forehead above the brow, `forehead_1` lowest.
pub(super) const FOREHEAD_ROWS: [&str; 5] = ["forehead_5", "forehead_4", "forehead_3", "forehead_2", "forehead_1"];

/// The lines. The first ten bound the half: midline, mouth opening, rim and eye opening.
pub(super) const CURVES: [Curve; 25] = [
    Curve {
        id: "midline_upper",
        through: &[
            [0.0, 74.5],
            [0.0, 66.0],
            [0.0, 57.5],
            [0.0, 49.0],
            [0.0, 40.5],
            [0.0, 32.0],
            [0.0, 23.5],
            [0.0, 16.5],
            [0.0, 10.0],
            [0.0, 4.0],
            [0.0, -2.5],
            [0.0, -9.0],
            [0.0, -15.5],
            [0.0, -22.5],
            [0.0, -29.0],
            [0.0, -35.5],
            [0.0, -40.8],
            [0.0, -45.0],
            [0.0, -52.5],
            [0.0, -60.2],
            [0.0, -63.3],
            [0.0, -66.3],
        ],
        pieces: &[],
    },
    Curve {
        id: "mouth_upper",
        through: &[[0.0, -66.3], [5.5, -66.0], [11.5, -66.5], [17.0, -67.4], [21.3, -68.5]],
        pieces: &[(4, Even(4))],
    },
    Curve {
        id: "mouth_lower",
        through: &[[21.3, -68.5], [16.8, -69.0], [11.2, -69.0], [5.5, -68.7], [0.0, -68.6]],
        pieces: &[(4, Even(4))],
    },
    Curve {
        id: "midline_lower",
        through: &[
            [0.0, -68.6],
            [0.0, -72.6],
            [0.0, -77.0],
            [0.0, -84.5],
            [0.0, -91.5],
            [0.0, -98.0],
            [0.0, -104.0],
            [0.0, -110.5],
        ],
        pieces: &[],
    },
    Curve {
        id: "jaw",
        through: &[
            [0.0, -110.5],
            [12.0, -109.5],
            [24.0, -106.0],
            [35.0, -99.8],
            [45.5, -90.6],
            [52.6, -83.2],
            [57.0, -76.0],
        ],
        pieces: &[(6, Even(7))],
    },
    Curve {
        id: "side",
        through: &[
            [57.0, -76.0],
            [59.7, -69.0],
            [62.0, -60.0],
            [64.6, -47.0],
            [66.6, -34.0],
            [68.2, -19.0],
            [69.0, -4.0],
            [68.6, 13.0],
        ],
        pieces: &[(7, Even(8))],
    },
    Curve {
        id: "temple",
        through: &[[68.6, 13.0], [67.7, 21.5], [66.0, 30.0], [63.5, 38.6], [60.0, 47.2], [54.8, 55.8]],
        pieces: &[],
    },
    Curve {
        id: "hairline",
        through: &[[54.8, 55.8], [47.6, 63.2], [37.0, 69.5], [25.0, 73.0], [12.0, 74.4], [0.0, 74.5]],
        pieces: &[(5, Even(6))],
    },
    Curve {
        id: "eye_upper",
        through: &[[18.4, 0.0], [20.8, 2.0], [25.2, 4.8], [31.0, 6.1], [36.8, 5.3], [41.3, 3.3], [44.6, 1.0]],
        pieces: &[(3, Even(4)), (6, Even(4))],
    },
    Curve {
        id: "eye_lower",
        through: &[[44.6, 1.0], [42.0, -1.8], [38.0, -4.0], [32.5, -4.9], [26.5, -4.1], [22.0, -2.1], [18.4, 0.0]],
        pieces: &[(3, Even(4)), (6, Even(4))],
    },
    Curve {
        id: "lid_fold",
        through: &[
            [13.9, -0.6],
            [17.4, 4.6],
            [23.6, 9.2],
            [31.0, 11.2],
            [39.0, 10.2],
            [45.4, 6.4],
            [49.8, 0.8],
            [46.2, -4.8],
            [40.0, -8.6],
            [32.5, -9.9],
            [24.6, -8.8],
            [18.0, -5.5],
            [13.9, -0.6],
        ],
        pieces: &[(3, Even(4)), (6, Even(4)), (9, Even(4)), (12, Even(4))],
    },
    Curve {
        id: "orbit",
        through: &[
            [10.0, -2.6],
            [11.2, 8.4],
            [18.5, 16.2],
            [29.5, 19.6],
            [42.0, 18.6],
            [52.0, 11.5],
            [56.8, 0.5],
            [52.5, -9.5],
            [44.0, -15.5],
            [33.0, -17.6],
            [23.0, -15.8],
            [14.8, -11.2],
            [10.0, -2.6],
        ],
        pieces: &[(3, Even(5)), (6, Even(5)), (9, Even(4)), (11, Even(3)), (12, Even(1))],
    },
    Curve {
        id: "brow",
        through: &[
            [0.0, 23.5],
            [5.8, 24.6],
            [12.0, 26.0],
            [20.0, 28.0],
            [29.0, 29.3],
            [38.0, 29.0],
            [49.0, 25.4],
            [58.0, 19.0],
            [64.0, 15.2],
            [68.6, 13.0],
        ],
        pieces: &[(2, Even(2)), (5, Even(4)), (7, Even(4)), (9, Even(3))],
    },
    Curve {
        id: "forehead_1",
        through: &[[0.0, 32.0], [12.0, 34.3], [25.0, 37.0], [38.0, 37.0], [50.0, 33.4], [60.0, 27.0], [67.7, 21.5]],
        pieces: &[(6, Staggered(12))],
    },
    Curve {
        id: "forehead_2",
        through: &[[0.0, 40.5], [12.0, 42.5], [25.0, 44.8], [38.0, 44.6], [50.0, 41.0], [60.0, 35.0], [66.0, 30.0]],
        pieces: &[(6, Even(11))],
    },
    Curve {
        id: "forehead_3",
        through: &[[0.0, 49.0], [12.0, 50.6], [25.0, 52.2], [38.0, 51.6], [49.0, 48.4], [57.2, 43.0], [63.5, 38.6]],
        pieces: &[(6, Staggered(10))],
    },
    Curve {
        id: "forehead_4",
        through: &[[0.0, 57.5], [12.0, 58.6], [24.0, 59.4], [36.0, 58.3], [46.0, 55.6], [53.6, 51.2], [60.0, 47.2]],
        pieces: &[(6, Even(9))],
    },
    Curve {
        id: "forehead_5",
        through: &[[0.0, 66.0], [12.0, 66.6], [23.0, 66.5], [34.0, 64.8], [43.5, 62.0], [49.5, 58.8], [54.8, 55.8]],
        pieces: &[(6, Staggered(8))],
    },
    Curve {
        id: "lip_upper",
        through: &[[0.0, -60.2], [5.6, -58.9], [12.0, -60.8], [19.2, -64.3], [25.35, -69.0]],
        pieces: &[(1, Even(1)), (4, Even(3))],
    },
    Curve {
        id: "lip_lower",
        through: &[[25.35, -69.0], [19.5, -73.2], [13.0, -76.0], [6.5, -77.1], [0.0, -77.0]],
        pieces: &[(4, Even(4))],
    },
    Curve {
        id: "mouth_surround_upper",
        through: &[
            [0.0, -52.5],
            [6.3, -51.9],
            [12.5, -52.9],
            [18.5, -55.5],
            [24.5, -60.2],
            [29.2, -65.0],
            [31.3, -70.0],
        ],
        pieces: &[(3, Even(3)), (6, Even(3))],
    },
    Curve {
        id: "mouth_surround_lower",
        through: &[[31.3, -70.0], [27.5, -76.2], [21.0, -81.0], [13.5, -83.8], [6.5, -84.6], [0.0, -84.5]],
        pieces: &[(5, Even(5))],
    },
    Curve {
        id: "nose_outline",
        through: &[
            [0.0, -45.0],
            [5.0, -45.4],
            [10.4, -45.2],
            [15.6, -42.2],
            [18.2, -36.0],
            [17.6, -29.0],
            [15.9, -21.8],
            [13.7, -14.8],
            [14.8, -11.2],
        ],
        pieces: &[(1, Even(1)), (2, Even(1)), (3, Even(1)), (4, Even(1)), (5, Even(1)), (6, Even(1)), (8, Even(1))],
    },
    Curve {
        id: "nose_ridge",
        through: &[[5.6, 4.6], [5.0, -3.5], [5.3, -11.2], [5.8, -18.4], [7.0, -25.4], [7.4, -32.0]],
        pieces: &[],
    },
    Curve { id: "nostril", through: &[[3.8, -41.0], [8.2, -38.4], [12.6, -40.4]], pieces: &[] },
];

/// Vertices that lie on no line but must be where they are.
pub(super) const POINTS: [[f64; 2]; 10] = [
    [8.2, -42.4],  // nostril
    [12.6, -34.0], // wing of the nose
    [6.4, -62.6],  // upper lip
    [6.2, -72.6],  // lower lip
    [12.4, -71.8],
    [9.0, 16.5],   // attachments of muscles: corrugator,
    [52.0, -22.0], // zygomaticus,
    [55.0, -62.0], // risorius,
    [30.0, -94.0], // depressor anguli oris,
    [20.0, -97.0], // depressor labii inferioris
];
