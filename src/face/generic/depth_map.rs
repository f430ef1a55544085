//! Depth of the mean face over the plane of the picture: a coarse measured grid, and the details that fall between its points.
//!
//! Only `+ − × ÷ √` are used here and in the rest of the generator, so that every machine computes the same face to the last bit.

/// Distance between the columns and between the rows of [`GRID`], mm.
const STEP: f64 = 10.0;
/// Height of the first row of [`GRID`], mm.
const TOP: f64 = 90.0;

/// z (mm) of a mean face at y = 90, 80, … −120 (rows) and |x| = 0, 10, … 70 (columns).
///
/// Source: mean of a face scan database, sampled every 10 mm. The eye is filled in with the surface of the closed lids; what lies
/// behind the jaw, where the scan has no front surface, continues the slope of its neighbours (the mesh ends before it).
const GRID: [[f64; 8]; 22] = [
    [-20.0, -21.4, -25.2, -32.2, -43.9, -64.6, -90.0, -120.0],
    [-8.6, -9.8, -12.9, -18.4, -27.7, -42.3, -66.7, -100.0],
    [-0.5, -1.4, -3.9, -8.5, -16.5, -28.8, -47.2, -88.9],
    [5.2, 4.5, 2.6, -1.4, -8.5, -19.5, -35.7, -62.1],
    [9.1, 8.5, 6.7, 3.0, -3.5, -13.1, -28.0, -51.7],
    [12.2, 11.8, 10.3, 6.5, 0.2, -8.8, -23.0, -46.2],
    [15.0, 14.9, 13.6, 10.3, 4.5, -4.9, -20.2, -43.7],
    [15.6, 15.0, 13.4, 10.2, 6.5, -0.2, -17.8, -43.0],
    [14.5, 10.2, 5.1, 4.7, 3.1, -2.4, -16.0, -42.3],
    [17.7, 6.7, -0.7, 4.2, 0.4, -8.5, -18.5, -39.7],
    [25.4, 15.0, 3.6, 2.5, -0.3, -7.2, -16.6, -36.4],
    [33.3, 23.1, 8.6, 4.3, 1.6, -3.1, -12.6, -35.7],
    [38.8, 33.1, 10.7, 7.3, 3.7, -1.8, -12.0, -41.8],
    [33.6, 19.2, 10.7, 8.6, 4.7, -2.3, -15.0, -55.1],
    [23.3, 21.2, 14.6, 9.2, 4.1, -4.7, -19.5, -73.8],
    [26.6, 24.2, 17.8, 10.7, 2.9, -7.7, -24.4, -85.0],
    [23.2, 21.7, 13.4, 8.4, 1.3, -11.3, -30.5, -92.0],
    [20.2, 19.3, 13.7, 6.2, -2.0, -16.4, -43.0, -100.0],
    [17.9, 16.0, 11.1, 3.3, -7.8, -27.2, -62.0, -110.0],
    [17.9, 16.4, 10.1, -0.8, -20.8, -67.7, -95.0, -125.0],
    [10.9, 9.0, -0.5, -36.7, -58.0, -71.1, -100.0, -130.0],
    [-8.0, -12.0, -27.0, -58.0, -75.0, -90.0, -110.0, -140.0],
];

/// A smooth hill or dent of limited extent: `height · (1 − r²)²` with `r² = (Δx/rx)² + (Δy/ry)² < 1`, the same on both sides.
struct Bump {
    at: [f64; 2],
    radii: [f64; 2],
    height: f64,
}

const fn bump(at: [f64; 2], radii: [f64; 2], height: f64) -> Bump {
    Bump { at, radii, height }
}

/// What a grid of 10 mm cannot hold.
const DETAILS: [Bump; 15] = [
    bump([31.5, 11.5], [18.0, 4.8], -1.8),  // fold of the upper lid
    bump([31.5, 3.0], [13.0, 8.0], 1.2),    // the eyeball under the lids
    bump([31.0, -10.5], [15.0, 4.5], -0.8), // fold of the lower lid
    bump([33.0, 24.5], [26.0, 8.0], 1.2),   // ridge of the brow
    bump([0.0, -28.5], [9.0, 8.0], 0.6),    // tip of the nose
    bump([13.2, -36.4], [6.4, 8.0], 4.6),   // wing of the nose
    bump([19.5, -35.0], [4.5, 9.0], -1.8),  // crease behind the wing
    bump([8.2, -42.4], [4.5, 3.4], -4.5),   // nostril
    bump([0.0, -47.0], [9.0, 6.0], -1.6),   // root of the upper lip
    bump([0.0, -57.0], [4.8, 9.0], -2.2),   // philtrum
    bump([0.0, -63.0], [21.0, 4.5], 1.4),   // upper lip
    bump([0.0, -67.4], [27.0, 4.0], -4.2),  // between the lips
    bump([0.0, -73.0], [20.0, 5.8], 3.6),   // lower lip
    bump([0.0, -83.5], [21.0, 7.5], -2.8),  // fold above the chin
    bump([0.0, -98.5], [16.0, 11.0], 1.4),  // chin
];

/// z of the face at (x, y), all mm. Even in x, continuous with its slope; beyond the last column its slope goes on, beyond the
/// rows their edge is continued.
pub(super) fn depth(x: f64, y: f64) -> f64 {
    let x = x.abs();
    let row = ((TOP - y) / STEP).clamp(0.0, (GRID.len() - 1) as f64);
    let i = (row as usize).min(GRID.len() - 2);
    let value = |r: usize| along_row(&GRID[r], x / STEP);
    let (before, after) = (i.checked_sub(1).map(value), (i + 2 < GRID.len()).then(|| value(i + 2)));
    let z = monotone_cubic(before, value(i), value(i + 1), after, row - i as f64);
    z + DETAILS.iter().map(|b| b.height_at(x, y)).sum::<f64>()
}

impl Bump {
    fn height_at(&self, x: f64, y: f64) -> f64 {
        let (u, v) = ((x - self.at[0]) / self.radii[0], (y - self.at[1]) / self.radii[1]);
        let inside = (1.0 - u * u - v * v).max(0.0);
        self.height * inside * inside
    }
}

fn along_row(row: &[f64; 8], column: f64) -> f64 {
    if column > 7.0 {
        return row[7] + (column - 7.0) * (row[7] - row[6]);
    }
    let j = (column as usize).min(6);
    // Across the midline stands the mirror image of the first column.
    let before = if j == 0 { row[1] } else { row[j - 1] };
    monotone_cubic(Some(before), row[j], row[j + 1], row.get(j + 2).copied(), column - j as f64)
}

/// Cubic between `a` (t = 0) and `b` (t = 1) that never leaves the range of its neighbours.
///
/// Source: Fritsch and Butland 1984: the slope at a point is the harmonic mean of the slopes beside it, zero where they disagree.
fn monotone_cubic(before: Option<f64>, a: f64, b: f64, after: Option<f64>, t: f64) -> f64 {
    let slope = |left: f64, right: f64| if left * right > 0.0 { 2.0 * left * right / (left + right) } else { 0.0 };
    let middle = b - a;
    let at_a = before.map_or(middle, |p| slope(a - p, middle));
    let at_b = after.map_or(middle, |n| slope(middle, n - b));
    let (t2, t3) = (t * t, t * t * t);
    a + (3.0 * t2 - 2.0 * t3) * middle + (t3 - 2.0 * t2 + t) * at_a + (t3 - t2) * at_b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_points_away_from_details_are_met_exactly_on_both_sides() {
        for (x, y, z) in [(0.0, 60.0, 5.2), (30.0, 40.0, 6.5), (60.0, -20.0, -12.6), (40.0, -50.0, 4.1)] {
            assert!((depth(x, y) - z).abs() < 1e-12, "{x} {y}");
            assert!((depth(-x, y) - z).abs() < 1e-12, "{x} {y}");
        }
    }

    #[test]
    fn the_cubic_keeps_a_straight_line_straight_and_does_not_overshoot_a_step() {
        assert!((monotone_cubic(Some(0.0), 1.0, 2.0, Some(3.0), 0.25) - 1.25).abs() < 1e-12);
        for k in 0..=10 {
            let v = monotone_cubic(Some(0.0), 0.0, 1.0, Some(1.0), f64::from(k) / 10.0);
            assert!((0.0..=1.0).contains(&v));
        }
    }
}
