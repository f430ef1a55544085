//! What the user has chosen to see on the height map.

use super::palette::{ColourCurve, Palette};
use super::quantity::{Direction, Layer, Quantity};
use super::range::{ColourRange, RangeMode, round_down};
use super::surface::Relief;
use crate::draw::colour_map::ColourMap;
pub use crate::draw::numbers::{fixed, significant, with_error};

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
}
