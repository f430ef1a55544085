//! Where the lines of the left half of the generic face run: points in the plane of the picture, from the measured proportions of adult faces.
//!
//! All numbers are mm, x ≥ 0. What is given here stays; what lies between follows by fairing (see [`super::fairing`]).

/// A place in the plane of the picture, mm.
pub(super) type Place = [f64; 2];

/// Columns of the grid of one half, from the midline to the side.
pub(super) const COLUMNS: usize = 9;
/// Rows of the grid, from the top of the forehead to the chin.
pub(super) const ROWS: usize = 18;
/// The row that runs along the brow.
pub(super) const BROW: usize = 6;
/// The part of the grid that the rings round the eye replace: first and last column, first and last row.
pub(super) const EYE: Block = Block { columns: [2, 7], rows: [BROW, 10] };
/// The part that the rings round the mouth replace.
pub(super) const MOUTH: Block = Block { columns: [0, 4], rows: [13, 17] };
/// The part round which a ring outlines the back and the wing of the nose.
pub(super) const NOSE: Block = Block { columns: [0, 2], rows: [8, 13] };

/// A rectangle of the grid.
#[derive(Clone, Copy)]
pub(super) struct Block {
    /// First and last column.
    pub columns: [usize; 2],
    /// First and last row.
    pub rows: [usize; 2],
}

/// Segments of the rim of one half: hairline, side, jaw.
pub(super) const RIM_SEGMENTS: [usize; 3] = [8, 6, 6];
/// Segments of the line between the grid and the rim.
pub(super) const INNER_RIM_SEGMENTS: usize = 31;

/// Grid vertices whose place is drawn: row, first column, places. Above the brow the rows lie evenly along the fibres.
pub(super) const DRAWN: [(usize, usize, &[Place]); 16] = [
    (
        0,
        0,
        &[
            [0.0, 63.0],
            [6.4, 63.0],
            [13.0, 62.9],
            [21.2, 62.4],
            [29.6, 61.2],
            [38.2, 59.0],
            [46.2, 55.2],
            [53.2, 49.6],
            [58.6, 42.6],
            [62.0, 38.0],
        ],
    ),
    (
        BROW,
        0,
        &[
            [0.0, 23.5],
            [5.8, 24.6],
            [12.0, 26.0],
            [20.4, 28.0],
            [29.2, 29.3],
            [38.0, 29.0],
            [48.4, 25.6],
            [58.0, 19.0],
            [63.0, 15.6],
            [66.8, 13.2],
        ],
    ),
    (7, 0, &[[0.0, 13.6], [5.2, 14.4], [10.6, 15.4]]),
    (7, 7, &[[60.0, 9.8], [64.2, 8.0], [67.2, 6.4]]),
    (8, 0, &[[0.0, 4.0], [4.5, 4.6], [10.0, 4.8]]),
    (8, 7, &[[60.8, 0.2], [64.4, -0.6], [67.2, -1.6]]),
    (9, 0, &[[0.0, -9.0], [4.2, -9.2], [10.3, -6.6]]),
    (9, 7, &[[58.8, -10.2], [63.2, -10.2], [66.8, -10.4]]),
    (
        10,
        0,
        &[
            [0.0, -15.8],
            [4.7, -15.8],
            [12.6, -16.0],
            [19.0, -20.4],
            [26.6, -23.0],
            [35.2, -24.0],
            [44.4, -23.0],
            [53.4, -19.4],
            [60.0, -18.6],
            [65.8, -19.0],
        ],
    ),
    (11, 0, &[[0.0, -22.5], [5.6, -23.2], [15.8, -25.0]]),
    (12, 0, &[[0.0, -29.0], [6.8, -30.8], [18.2, -36.0]]),
    (
        13,
        0,
        &[
            [0.0, -45.0],
            [7.0, -46.0],
            [15.4, -46.6],
            [24.4, -48.6],
            [33.0, -53.0],
            [40.0, -52.0],
            [46.0, -50.6],
            [51.6, -49.2],
            [56.8, -47.8],
            [61.0, -46.6],
        ],
    ),
    (14, 4, &[[38.0, -60.6]]),
    (15, 4, &[[39.4, -69.8], [45.0, -68.4], [49.8, -66.6], [53.6, -64.8], [56.8, -63.0], [59.2, -61.0]]),
    (16, 4, &[[37.6, -79.0]]),
    (
        17,
        0,
        &[
            [0.0, -92.6],
            [7.8, -93.2],
            [15.8, -92.8],
            [24.2, -91.0],
            [32.0, -86.8],
            [38.4, -85.2],
            [43.4, -82.4],
            [47.4, -79.4],
            [50.6, -76.2],
            [53.4, -72.4],
        ],
    ),
];

/// The last row: the chin.
pub(super) const CHIN_ROW: [Place; COLUMNS + 1] = [
    [0.0, -98.6],
    [7.6, -98.9],
    [15.2, -98.4],
    [22.8, -96.8],
    [29.6, -94.0],
    [35.8, -91.6],
    [40.8, -89.0],
    [45.2, -85.6],
    [49.0, -81.8],
    [52.0, -78.0],
];

/// The line of the nose inside [`NOSE`], from its top on the midline outwards, down along the back, round the wing and to the columella.
pub(super) const NOSE_LINE: [Place; 10] = [
    [0.0, -2.5],
    [3.4, -2.6],
    [6.4, -2.6],
    [7.0, -9.6],
    [8.2, -17.0],
    [10.6, -25.4],
    [13.4, -34.2],
    [11.8, -42.2],
    [5.2, -41.4],
    [0.0, -37.8],
];

/// A line through points, cut into segments of equal length in space between the points that are named.
pub(super) struct Line {
    /// Control points.
    pub through: &'static [Place],
    /// `(index of the control point where the piece ends, number of segments)`; the first piece starts at control point 0.
    pub pieces: &'static [(usize, usize)],
}

/// Rings round the eye from the outermost inwards: each an upper line from the nose to the temple, and a lower one back.
pub(super) const EYE_RINGS: [[Line; 2]; 3] = [
    [
        Line {
            through: &[
                [12.7, 0.6],
                [13.0, 9.4],
                [16.4, 15.4],
                [24.0, 18.4],
                [33.0, 19.4],
                [43.0, 17.8],
                [50.6, 13.4],
                [54.8, 7.2],
                [56.0, 0.4],
            ],
            pieces: &[(8, 9)],
        },
        Line {
            through: &[
                [56.0, 0.4],
                [54.4, -6.6],
                [49.8, -12.4],
                [42.0, -15.8],
                [33.4, -16.8],
                [25.0, -15.4],
                [18.0, -11.6],
                [13.6, -6.0],
                [12.7, 0.6],
            ],
            pieces: &[(8, 9)],
        },
    ],
    [
        Line {
            through: &[[14.8, 0.2], [17.0, 5.8], [22.8, 10.2], [31.0, 11.8], [39.0, 10.8], [45.6, 7.2], [49.6, 0.8]],
            pieces: &[(3, 4), (6, 5)],
        },
        Line {
            through: &[[49.6, 0.8], [46.4, -5.0], [40.4, -8.8], [32.5, -10.2], [24.6, -9.0], [18.2, -5.6], [14.8, 0.2]],
            pieces: &[(3, 5), (6, 4)],
        },
    ],
    [
        Line {
            through: &[[18.4, 0.0], [20.8, 2.0], [25.2, 4.8], [31.0, 6.1], [36.8, 5.3], [41.3, 3.3], [44.6, 1.0]],
            pieces: &[(3, 4), (6, 5)],
        },
        Line {
            through: &[[44.6, 1.0], [42.0, -1.8], [38.0, -4.0], [32.5, -4.9], [26.5, -4.1], [22.0, -2.1], [18.4, 0.0]],
            pieces: &[(3, 5), (6, 4)],
        },
    ],
];

/// Half rings round the mouth from the outermost inwards: each an upper line from the midline to the corner, and a lower one back.
pub(super) const MOUTH_RINGS: [[Line; 2]; 3] = [
    [
        Line {
            through: &[
                [0.0, -52.5],
                [6.3, -52.2],
                [12.6, -53.4],
                [19.2, -56.2],
                [25.4, -60.4],
                [30.0, -65.0],
                [31.6, -69.8],
            ],
            pieces: &[(6, 6)],
        },
        Line {
            through: &[[31.6, -69.8], [28.4, -76.4], [21.6, -81.4], [13.8, -84.2], [6.6, -85.0], [0.0, -84.8]],
            pieces: &[(5, 6)],
        },
    ],
    [
        Line {
            through: &[[0.0, -60.2], [5.6, -58.9], [12.0, -60.8], [19.2, -64.3], [25.35, -69.0]],
            pieces: &[(1, 1), (4, 5)],
        },
        Line {
            through: &[[25.35, -69.0], [19.5, -73.2], [13.0, -76.0], [6.5, -77.1], [0.0, -77.0]],
            pieces: &[(4, 6)],
        },
    ],
    [
        Line { through: &[[0.0, -66.3], [5.5, -66.0], [11.5, -66.5], [17.0, -67.4], [21.3, -68.5]], pieces: &[(4, 6)] },
        Line { through: &[[21.3, -68.5], [16.8, -69.0], [11.2, -69.0], [5.5, -68.7], [0.0, -68.6]], pieces: &[(4, 6)] },
    ],
];

/// The rim: hairline from the midline to the temple, side to the corner of the jaw, jaw to the chin.
pub(super) const RIM: [Line; 3] = [
    Line {
        through: &[
            [0.0, 75.0],
            [13.0, 74.9],
            [26.0, 73.6],
            [38.0, 70.4],
            [48.4, 65.0],
            [56.8, 57.0],
            [63.0, 46.8],
            [67.2, 35.4],
            [69.4, 24.4],
            [70.2, 13.0],
        ],
        pieces: &[(9, RIM_SEGMENTS[0])],
    },
    Line {
        through: &[
            [70.2, 13.0],
            [71.2, -3.0],
            [71.4, -18.0],
            [68.8, -34.0],
            [65.2, -48.0],
            [62.0, -62.0],
            [57.4, -76.0],
        ],
        pieces: &[(6, RIM_SEGMENTS[1])],
    },
    Line {
        through: &[
            [57.4, -76.0],
            [52.0, -84.8],
            [44.6, -92.2],
            [35.0, -99.8],
            [24.0, -106.0],
            [12.0, -109.6],
            [0.0, -110.5],
        ],
        pieces: &[(6, RIM_SEGMENTS[2])],
    },
];

impl Line {
    /// The places of the vertices along the line, the ends of its pieces among them exactly; `length` measures a step in space.
    pub(super) fn cut(&self, length: impl Fn(Place, Place) -> f64) -> Vec<Place> {
        let mut places = vec![self.through[0]];
        let mut start = 0;
        for &(end, segments) in self.pieces {
            let fine = self.between(start, end);
            let inner = (1..segments).map(|k| at_fraction(&fine, k as f64 / segments as f64, &length));
            places.extend(inner);
            places.push(self.through[end]);
            start = end;
        }
        places
    }

    /// A fine polyline from one control point to another: cubic, tangents by chord length.
    fn between(&self, start: usize, end: usize) -> Vec<Place> {
        const FINE: usize = 32;
        let mut fine = vec![self.through[start]];
        for i in start..end {
            let (a, b) = (self.through[i], self.through[i + 1]);
            let chord = distance(a, b);
            let (ta, tb) = (self.tangent(i), self.tangent(i + 1));
            for k in 1..=FINE {
                let t = k as f64 / FINE as f64;
                let (t2, t3) = (t * t, t * t * t);
                fine.push([0, 1].map(|j| {
                    a[j] + (3.0 * t2 - 2.0 * t3) * (b[j] - a[j])
                        + chord * ((t3 - 2.0 * t2 + t) * ta[j] + (t3 - t2) * tb[j])
                }));
            }
        }
        fine
    }

    /// Derivative by chord length at a control point.
    fn tangent(&self, i: usize) -> Place {
        let p = self.through;
        let slope = |a: Place, b: Place| [0, 1].map(|j| (b[j] - a[j]) / distance(a, b));
        match (i.checked_sub(1).map(|b| p[b]), p.get(i + 1)) {
            (Some(a), Some(&b)) => {
                let (left, right) = (distance(a, p[i]), distance(p[i], b));
                let (s, r) = (slope(a, p[i]), slope(p[i], b));
                [0, 1].map(|j| (s[j] * right + r[j] * left) / (left + right))
            }
            (Some(a), None) => slope(a, p[i]),
            (None, Some(&b)) => slope(p[i], b),
            (None, None) => [0.0, 0.0],
        }
    }
}

fn distance(a: Place, b: Place) -> f64 {
    ((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])).sqrt()
}

/// The place at a fraction of the length of a polyline.
pub(super) fn at_fraction(fine: &[Place], fraction: f64, length: impl Fn(Place, Place) -> f64) -> Place {
    let lengths: Vec<f64> = fine.windows(2).map(|w| length(w[0], w[1])).collect();
    let mut left = fraction * lengths.iter().sum::<f64>();
    for (w, &length) in fine.windows(2).zip(&lengths) {
        if left <= length {
            let t = left / length;
            return [0, 1].map(|j| w[0][j] + t * (w[1][j] - w[0][j]));
        }
        left -= length;
    }
    fine[fine.len() - 1]
}
