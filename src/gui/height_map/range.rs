//! The range of the colours: following the data, following what is in view, or locked by the user.

use super::quantity::Layer;
use crate::draw::robust_range::automatic_range;
pub use crate::draw::robust_range::round_up;

/// Who decides the ends of the colour bar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum RangeMode {
    /// All measured vertices, border and fixtures left out; rounded outwards. A few values far above the rest are cut off.
    #[default]
    Auto,
    /// As [`Self::Auto`], of the vertices inside the canvas.
    InView,
    /// The user; kept when the data change.
    Locked(ColourRange),
}

/// The values at the two ends of the colour bar; `low < high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColourRange {
    /// At the lower end.
    pub low: f64,
    /// At the upper end.
    pub high: f64,
}

impl ColourRange {
    /// Orders the ends and keeps them apart.
    pub fn new(a: f64, b: f64) -> Self {
        let (low, high) = if a <= b { (a, b) } else { (b, a) };
        let least = 1e-9_f64.max(low.abs().max(high.abs()) * 1e-6);
        Self { low, high: high.max(low + least) }
    }

    /// Where a value stands on the bar: 0 at the lower end, 1 at the upper, beyond them outside.
    pub fn position(&self, value: f64) -> f64 {
        (value - self.low) / (self.high - self.low)
    }

    /// How many of the values lie below and above.
    pub fn clipped(&self, values: &[Option<f64>]) -> (usize, usize) {
        let slack = (self.high - self.low) * 1e-9;
        values.iter().flatten().fold((0, 0), |(below, above), &v| {
            (below + usize::from(v < self.low - slack), above + usize::from(v > self.high + slack))
        })
    }
}

/// The range for a layer; `in_view` says which vertices lie inside the canvas.
///
/// Magnitudes start at zero; signed values run as far below zero as above it, so that the middle colour means zero.
pub fn range_of(mode: RangeMode, layer: &Layer, in_view: &dyn Fn(usize) -> bool) -> ColourRange {
    let wanted: &dyn Fn(usize) -> bool = match mode {
        RangeMode::Locked(range) => return range,
        RangeMode::Auto => &|_| true,
        RangeMode::InView => in_view,
    };
    let known = layer.values.iter().enumerate().filter(|&(v, _)| wanted(v));
    let known = known.filter_map(|(v, x)| Some(((*x)?, layer.sets_range.get(v).copied().unwrap_or(true))));
    let [low, high] = automatic_range(known, layer.signed);
    ColourRange::new(low, high)
}

/// The nearest of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten, not above the value: for factors that are printed.
pub fn round_down(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powi(value.log10().floor() as i32);
    let digits = value / power;
    [8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0].into_iter().find(|g| *g <= digits + 1e-9).unwrap_or(1.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(signed: bool, values: &[Option<f64>]) -> Layer {
        Layer {
            title: String::new(),
            short: "",
            unit: "N",
            signed,
            values: values.to_vec(),
            sigma: None,
            sets_range: vec![true; values.len()],
        }
    }

    #[test]
    fn magnitudes_start_at_zero_and_signed_values_are_centred_on_it() {
        let everything = |_: usize| true;
        let auto = range_of(RangeMode::Auto, &layer(false, &[Some(0.13), None, Some(0.37)]), &everything);
        assert_eq!((auto.low, auto.high), (0.0, 0.4));
        let auto = range_of(RangeMode::Auto, &layer(true, &[Some(-0.37), Some(0.1)]), &everything);
        assert_eq!((auto.low, auto.high), (-0.4, 0.4));
        assert!((auto.position(0.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_locked_range_stays_when_the_data_change() {
        let locked = RangeMode::Locked(ColourRange::new(0.1, 0.5));
        for data in [&[Some(3.0)][..], &[Some(-9.0), None], &[]] {
            let range = range_of(locked, &layer(false, data), &|_| true);
            assert_eq!((range.low, range.high), (0.1, 0.5));
        }
    }

    #[test]
    fn the_view_and_the_border_limit_what_counts() {
        let mut l = layer(false, &[Some(9.0), Some(0.2), Some(0.7)]);
        l.sets_range[0] = false;
        assert!((range_of(RangeMode::Auto, &l, &|_| true).high - 0.8).abs() < 1e-12);
        assert!((range_of(RangeMode::InView, &l, &|v| v == 1).high - 0.2).abs() < 1e-12);
        // Nothing but border in view: it must do.
        assert!((range_of(RangeMode::InView, &l, &|v| v == 0).high - 10.0).abs() < 1e-12);
        assert_eq!(ColourRange::new(0.0, 0.5).clipped(&l.values), (0, 2));
    }

    #[test]
    fn one_wild_vertex_does_not_spoil_the_colours_of_the_others() {
        let mut values: Vec<Option<f64>> = (1..=99).map(|v| Some(f64::from(v) / 250.0)).collect();
        values.push(Some(40.0));
        let range = range_of(RangeMode::Auto, &layer(false, &values), &|_| true);
        // The 98th of a hundred is 0.392.
        assert_eq!((range.low, range.high), (0.0, 0.4));
        assert_eq!(range.clipped(&values), (0, 1));
    }

    #[test]
    fn nothing_known_gives_a_range_that_can_be_drawn() {
        let range = range_of(RangeMode::Auto, &layer(false, &[None, None]), &|_| true);
        assert!(range.high > range.low);
        let flat = ColourRange::new(2.0, 2.0);
        assert!(flat.position(2.0).is_finite());
        assert!((round_down(0.031) - 0.03).abs() < 1e-12);
    }
}
