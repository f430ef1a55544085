//! What the user has chosen to see on the height map.

use super::palette::{ColourCurve, Palette};
use super::quantity::{Direction, Layer, Quantity};
use super::range::{ColourRange, RangeMode, round_down};
use super::surface::Relief;
use crate::draw::colour_map::ColourMap;

/// How standard errors are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ErrorDisplay {
    /// Not at all.
    #[default]
    Off,
    /// A bar from value − error to value + error on each measured vertex.
    Bars,
    /// A translucent surface one standard error above the values and one below.
    Shells,
}

impl ErrorDisplay {
    /// In the order of the chooser.
    pub const ALL: [Self; 3] = [Self::Off, Self::Bars, Self::Shells];

    /// Words of the chooser.
    pub fn label(self) -> &'static str {
        match self {
            Self::Off => "No ± shown",
            Self::Bars => "± bars",
            Self::Shells => "± shells",
        }
    }
}

/// Millimetres of height for one unit of the value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Exaggeration {
    /// The upper end of the colour range stands [`FULL_HEIGHT_MM`] high or a little less.
    #[default]
    Auto,
    /// The user's.
    Fixed(f64),
}

/// Height of the upper end of the range under [`Exaggeration::Auto`], mm: half the height of a forehead, so that peaks hide little.
pub const FULL_HEIGHT_MM: f64 = 40.0;

impl Exaggeration {
    /// mm per unit for this range.
    pub fn mm_per_unit(self, range: ColourRange) -> f64 {
        match self {
            Self::Auto => round_down(FULL_HEIGHT_MM / range.high.abs().max(range.low.abs()).max(1e-12)),
            Self::Fixed(mm) => mm,
        }
    }
}

/// "height ×100 mm/N".
pub fn exaggeration_text(mm_per_unit: f64, unit: &str) -> String {
    let factor = significant(mm_per_unit, 2);
    match unit {
        "N" => format!("height ×{factor} mm/N"),
        "mm" => format!("height ×{factor}"),
        "" => format!("height ×{factor} mm per unit"),
        _ => format!("height ×{factor} mm per relative unit"),
    }
}

/// A number with that many significant digits, without an exponent.
pub fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "–".to_owned() };
    }
    let decimals = (digits - 1 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.decimals$}");
    if all_zeros(&text) {
        return fixed(0.0, 2);
    }
    // 0.0996 to two digits is 0.10, not 0.100.
    let carried = text.parse::<f64>().is_ok_and(|v| v.abs().log10().floor() > value.abs().log10().floor());
    let text = if carried && decimals > 0 { format!("{value:.*}", decimals - 1) } else { text };
    if text.starts_with('-') { text.replacen('-', "−", 1) } else { text }
}

/// "−0.12": with so many decimals, and without a sign before nothing but zeros.
pub fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if all_zeros(rest) => rest.to_owned(),
        Some(rest) => format!("−{rest}"),
        None => text,
    }
}

fn all_zeros(text: &str) -> bool {
    text.chars().all(|c| matches!(c, '-' | '0' | '.'))
}

/// "0.140 ± 0.021": the value with as many decimals as its error has to two digits.
pub fn with_error(value: f64, error: Option<f64>) -> String {
    match error.filter(|e| *e >= 1e-6 && e.is_finite()) {
        Some(error) => {
            let decimals = (1 - error.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{} ± {error:.decimals$}", fixed(value, decimals))
        }
        None => significant(value, 3),
    }
}

/// The choices of the height map; plain data, kept by the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapOptions {
    /// What is drawn.
    pub quantity: Quantity,
    /// Direction of [`Quantity::Along`].
    pub direction: Direction,
    /// Index of the chosen muscle of the face.
    pub muscle: Option<usize>,
    /// Who decides the colour range.
    pub range: RangeMode,
    /// Colours of values that have one sign; of both signs it is blue to red.
    pub colours: ColourMap,
    /// How values are spread over the colours.
    pub curve: ColourCurve,
    /// How high a unit stands.
    pub exaggeration: Exaggeration,
    /// What the heights stand on.
    pub relief: Relief,
    /// How standard errors are drawn.
    pub errors: ErrorDisplay,
    /// Edges of the mesh.
    pub wireframe: bool,
    /// Light from the upper left; without it colours are exactly the bar's.
    pub shading: bool,
    /// Lines of equal value at the ticks of the colour bar.
    pub contours: bool,
    /// A marker on each known vertex, by its state.
    pub markers: bool,
    /// Vertices that carry the border's reaction.
    pub border: bool,
    /// Hatching where the force is below two standard errors.
    pub below_noise: bool,
    /// A plane at the median standard error.
    pub noise_floor: bool,
    /// Forces as arrows.
    pub arrows: bool,
    /// The chosen muscle's fibre.
    pub fibre: bool,
    /// Base grid and axes.
    pub axes: bool,
    /// Fit the view to what is known rather than to the whole face.
    pub fit_known: bool,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self {
            quantity: Quantity::default(),
            direction: Direction::default(),
            muscle: None,
            range: RangeMode::default(),
            colours: ColourMap::Viridis,
            curve: ColourCurve::default(),
            exaggeration: Exaggeration::default(),
            relief: Relief::default(),
            errors: ErrorDisplay::default(),
            wireframe: true,
            shading: true,
            contours: true,
            markers: true,
            border: true,
            below_noise: false,
            noise_floor: false,
            arrows: false,
            fibre: false,
            axes: true,
            fit_known: true,
        }
    }
}

impl MapOptions {
    /// Another quantity is shown: a locked range and a fixed height belonged to the one before, maybe in another unit.
    pub fn begin_quantity(&mut self) {
        if matches!(self.range, RangeMode::Locked(_)) {
            self.range = RangeMode::Auto;
        }
        self.exaggeration = Exaggeration::Auto;
    }

    /// The palette of a layer on a range.
    pub fn palette(&self, layer: &Layer, range: ColourRange) -> Palette {
        let map = if layer.signed { ColourMap::CoolWarm } else { self.colours };
        Palette { map, range, curve: self.curve, signed: layer.signed }
    }

    /// Whether standard errors can be drawn: only forces have them, and only where there are heights.
    pub fn errors_apply(&self, layer: &Layer) -> bool {
        layer.sigma.is_some() && self.relief != Relief::FaceColoured
    }
}

/// Median of the standard errors of the vertices that may set the range: the height of the noise floor.
pub fn noise_floor(layer: &Layer) -> Option<f64> {
    let sigma = layer.sigma.as_ref()?;
    let mut known: Vec<f64> = (0..layer.values.len())
        .filter(|&v| layer.values[v].is_some() && layer.sets_range[v])
        .filter_map(|v| sigma.get(v).copied().filter(|s| s.is_finite()))
        .collect();
    known.sort_by(f64::total_cmp);
    known.get(known.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exaggeration_is_a_round_number_and_is_printed_with_its_unit() {
        let mm = Exaggeration::Auto.mm_per_unit(ColourRange::new(0.0, 0.4));
        assert!((mm - 100.0).abs() < 1e-9, "40 mm at 0.4 N");
        assert_eq!(exaggeration_text(mm, "N"), "height ×100 mm/N");
        assert_eq!(exaggeration_text(0.15, "relative"), "height ×0.15 mm per relative unit");
        assert_eq!(Exaggeration::Fixed(12.0).mm_per_unit(ColourRange::new(0.0, 0.4)), 12.0);
    }

    #[test]
    fn numbers_show_the_digits_that_they_carry() {
        assert_eq!(significant(0.1446, 3), "0.145");
        assert_eq!(significant(-1234.5, 3), "−1234");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(significant(0.0996, 2), "0.10");
        assert_eq!(significant(f64::NAN, 2), "–");
        assert_eq!(with_error(0.1446, Some(0.0213)), "0.145 ± 0.021");
        assert_eq!(with_error(-0.1446, None), "−0.145");
        assert_eq!(with_error(-0.0001, Some(0.5)), "0.00 ± 0.50");
        assert_eq!(significant(-7.1e-15, 3), "0.00");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(-0.126, 2), "−0.13");
    }
}
