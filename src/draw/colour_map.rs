//! Colour maps: a number between 0 and 1 becomes a colour whose brightness or hue rises evenly with it.

use serde::{Deserialize, Serialize};

/// Colour of what was not measured: no colour of any map, so that it cannot be read as a value.
pub const NOT_MEASURED: [u8; 3] = [184, 184, 188];

/// Darker grey of the hatching over [`NOT_MEASURED`].
pub const HATCHING: [u8; 3] = [148, 148, 154];

/// The two strokes of the hatching over values below their noise. They lie side by side, so that one of them stands out on any colour.
pub const NOISE_HATCHING: [[u8; 3]; 2] = [[16, 16, 20], [250, 250, 252]];

/// Which colours stand for the values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ColourMap {
    /// Dark blue, green, yellow; even in brightness and readable without colour vision (van der Walt and Smith 2015). The default.
    #[default]
    Viridis,
    /// Dark blue to yellow, the same to people with and without red-green vision (Nuñez, Anderton and Renslow 2018).
    Cividis,
    /// Blue, grey, red: for values of either sign, 0 in the middle (Moreland 2009).
    CoolWarm,
}

impl ColourMap {
    /// All maps, in the order of a menu.
    pub const ALL: [Self; 3] = [Self::Viridis, Self::Cividis, Self::CoolWarm];

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "Viridis",
            Self::Cividis => "Cividis",
            Self::CoolWarm => "Cool to warm",
        }
    }

    /// Whether the map has a neutral middle, for values of either sign.
    pub fn is_diverging(self) -> bool {
        self == Self::CoolWarm
    }

    /// The colour at `t` (0 to 1, clamped), 8-bit sRGB; [`NOT_MEASURED`] where `t` is not a number.
    ///
    /// Straight lines between every third of the 256 published colours: nowhere more than 3/255 from them.
    pub fn at(self, t: f64) -> [u8; 3] {
        if t.is_nan() {
            return NOT_MEASURED;
        }
        let table = match self {
            Self::Viridis => &VIRIDIS,
            Self::Cividis => &CIVIDIS,
            Self::CoolWarm => &COOL_WARM,
        };
        let place = t.clamp(0.0, 1.0) * (table.len() - 1) as f64;
        let below = (place as usize).min(table.len() - 2);
        let share = place - below as f64;
        std::array::from_fn(|c| {
            let (a, b) = (f64::from(table[below][c]), f64::from(table[below + 1][c]));
            (a + (b - a) * share).round() as u8
        })
    }

    /// The colour of `value` on a range, or [`NOT_MEASURED`] without a value. An empty range is all at its lower end.
    pub fn of(self, value: Option<f64>, [low, high]: [f64; 2]) -> [u8; 3] {
        value.map_or(NOT_MEASURED, |v| self.at(if high > low { (v - low) / (high - low) } else { 0.0 }))
    }
}

// Entries 0, 3, …, 255 of the tables published with matplotlib (viridis, cividis: CC0).

#[rustfmt::skip]
const VIRIDIS: [[u8; 3]; 86] = [
    [68, 1, 84], [69, 5, 89], [70, 10, 93], [71, 14, 97], [71, 19, 101], [72, 23, 105], [72, 27, 109],
    [72, 31, 112], [72, 35, 116], [72, 38, 119], [71, 42, 122], [71, 46, 124], [70, 50, 126], [69, 53, 129],
    [68, 57, 131], [67, 61, 132], [66, 64, 134], [65, 68, 135], [63, 71, 136], [62, 74, 137], [61, 78, 138],
    [59, 81, 139], [58, 84, 140], [56, 88, 140], [55, 91, 141], [53, 94, 141], [52, 97, 141], [50, 100, 142],
    [49, 103, 142], [48, 106, 142], [46, 109, 142], [45, 112, 142], [44, 114, 142], [43, 117, 142], [42, 120, 142],
    [41, 123, 142], [39, 126, 142], [38, 129, 142], [37, 131, 142], [36, 134, 142], [35, 137, 142], [34, 140, 141],
    [33, 143, 141], [32, 146, 140], [31, 148, 140], [31, 151, 139], [31, 154, 138], [30, 157, 137], [31, 160, 136],
    [31, 162, 135], [33, 165, 133], [34, 168, 132], [37, 171, 130], [39, 173, 129], [42, 176, 127], [46, 179, 124],
    [50, 182, 122], [55, 184, 120], [59, 187, 117], [64, 189, 114], [70, 192, 111], [76, 194, 108], [82, 197, 105],
    [88, 199, 101], [94, 201, 98], [101, 203, 94], [108, 205, 90], [115, 208, 86], [122, 209, 81], [129, 211, 77],
    [137, 213, 72], [144, 215, 67], [152, 216, 62], [160, 218, 57], [168, 219, 52], [176, 221, 47], [184, 222, 41],
    [192, 223, 37], [200, 224, 32], [208, 225, 28], [216, 226, 25], [223, 227, 24], [231, 228, 25], [239, 229, 28],
    [246, 230, 32], [253, 231, 37],
];

#[rustfmt::skip]
const CIVIDIS: [[u8; 3]; 86] = [
    [0, 34, 78], [0, 37, 83], [0, 39, 88], [0, 41, 93], [0, 43, 98], [0, 45, 104], [0, 47, 109],
    [0, 49, 112], [5, 51, 113], [15, 53, 112], [22, 55, 112], [28, 57, 111], [33, 59, 110], [38, 61, 110],
    [42, 63, 109], [46, 65, 109], [50, 67, 109], [53, 69, 108], [57, 72, 108], [60, 74, 108], [63, 76, 108],
    [66, 78, 108], [69, 80, 108], [72, 82, 108], [75, 84, 108], [78, 86, 108], [81, 88, 109], [84, 90, 109],
    [86, 92, 109], [89, 94, 110], [92, 97, 110], [94, 99, 111], [97, 101, 111], [100, 103, 112], [102, 105, 112],
    [105, 107, 113], [108, 109, 114], [110, 111, 115], [113, 114, 116], [115, 116, 117], [118, 118, 118], [120, 120, 119],
    [123, 122, 120], [126, 124, 120], [128, 127, 120], [131, 129, 121], [134, 131, 121], [137, 133, 120], [140, 136, 120],
    [143, 138, 120], [146, 140, 120], [148, 142, 119], [151, 145, 119], [154, 147, 118], [157, 149, 118], [160, 152, 117],
    [163, 154, 116], [166, 156, 116], [169, 159, 115], [172, 161, 114], [175, 164, 113], [179, 166, 112], [182, 169, 111],
    [185, 171, 109], [188, 174, 108], [191, 176, 107], [194, 179, 105], [197, 181, 104], [200, 184, 102], [204, 186, 100],
    [207, 189, 98], [210, 192, 96], [213, 194, 94], [217, 197, 92], [220, 200, 89], [223, 202, 87], [226, 205, 84],
    [230, 208, 81], [233, 211, 78], [237, 213, 74], [240, 216, 70], [243, 219, 66], [247, 222, 62], [251, 225, 56],
    [254, 228, 52], [254, 232, 56],
];

#[rustfmt::skip]
const COOL_WARM: [[u8; 3]; 86] = [
    [59, 76, 192], [62, 81, 197], [66, 87, 201], [69, 92, 206], [73, 97, 210], [76, 102, 214], [80, 107, 218],
    [84, 112, 222], [88, 117, 225], [91, 122, 229], [95, 127, 232], [99, 132, 235], [103, 136, 238], [107, 141, 240],
    [111, 146, 243], [115, 150, 245], [119, 154, 247], [123, 159, 249], [128, 163, 250], [132, 167, 252], [136, 171, 253],
    [140, 175, 254], [144, 178, 254], [148, 182, 255], [152, 185, 255], [157, 189, 255], [161, 192, 255], [165, 195, 254],
    [169, 198, 253], [173, 201, 253], [177, 203, 252], [181, 205, 250], [185, 208, 249], [188, 210, 247], [192, 212, 245],
    [196, 213, 243], [199, 215, 240], [203, 216, 238], [206, 218, 235], [210, 219, 232], [213, 219, 229], [216, 220, 226],
    [219, 220, 222], [222, 220, 219], [225, 218, 214], [228, 217, 210], [231, 215, 206], [234, 213, 201], [236, 211, 197],
    [238, 208, 192], [240, 205, 187], [242, 203, 183], [243, 200, 178], [244, 197, 173], [245, 193, 169], [246, 190, 164],
    [247, 186, 159], [247, 183, 155], [247, 179, 150], [247, 175, 145], [247, 170, 140], [247, 166, 136], [246, 162, 131],
    [245, 157, 126], [244, 152, 122], [243, 148, 117], [241, 143, 113], [240, 138, 108], [238, 132, 104], [236, 127, 99],
    [233, 122, 95], [231, 116, 91], [228, 110, 86], [226, 105, 82], [223, 99, 78], [220, 93, 74], [216, 86, 70],
    [213, 80, 66], [209, 73, 63], [205, 66, 59], [202, 59, 55], [197, 51, 52], [193, 43, 48], [189, 31, 45],
    [184, 18, 42], [180, 4, 38],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Contrast of two colours as WCAG 2.2 defines it, 1 to 21.
    fn contrast(a: [u8; 3], b: [u8; 3]) -> f64 {
        let linear = |c: u8| {
            let c = f64::from(c) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let light = |[r, g, b]: [u8; 3]| 0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b) + 0.05;
        let (a, b) = (light(a), light(b));
        if a > b { a / b } else { b / a }
    }

    #[test]
    fn the_hatching_of_noise_stands_out_on_every_colour_the_brightest_above_all() {
        // 3:1 is what WCAG asks of signs that carry a meaning; black on white has 21.
        assert!((contrast([0; 3], [255; 3]) - 21.0).abs() < 1e-9);
        for map in ColourMap::ALL {
            for k in 0..=1000 {
                let colour = map.at(f64::from(k) / 1000.0);
                let best = NOISE_HATCHING.iter().map(|ink| contrast(*ink, colour)).fold(0.0, f64::max);
                assert!(best > 4.0, "{map:?} {k}: {best}");
            }
        }
        let brightest = ColourMap::Viridis.at(1.0);
        assert!(contrast(NOISE_HATCHING[0], brightest) > 12.0 && contrast(NOISE_HATCHING[1], brightest) < 1.5);
    }

    fn near(a: [u8; 3], b: [u8; 3]) -> bool {
        a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1)
    }

    #[test]
    fn anchors_are_the_published_ones() {
        // viridis: #440154, #21918c, #fde725; cividis: #00224e, #7d7c78, #fee838; coolwarm: #3b4cc0, #dddcdc, #b40426.
        assert_eq!(ColourMap::Viridis.at(0.0), [68, 1, 84]);
        assert!(near(ColourMap::Viridis.at(0.5), [33, 145, 140]));
        assert_eq!(ColourMap::Viridis.at(1.0), [253, 231, 37]);
        assert_eq!(ColourMap::Cividis.at(0.0), [0, 34, 78]);
        assert!(near(ColourMap::Cividis.at(0.5), [125, 124, 120]));
        assert_eq!(ColourMap::Cividis.at(1.0), [254, 232, 56]);
        assert_eq!(ColourMap::CoolWarm.at(0.0), [59, 76, 192]);
        assert!(near(ColourMap::CoolWarm.at(0.5), [221, 220, 220]));
        assert_eq!(ColourMap::CoolWarm.at(1.0), [180, 4, 38]);
    }

    #[test]
    fn brightness_never_falls_along_viridis_and_cividis() {
        for map in [ColourMap::Viridis, ColourMap::Cividis] {
            let brightness = |i: u32| {
                let [r, g, b] = map.at(f64::from(i) / 200.0).map(f64::from);
                0.2126 * r + 0.7152 * g + 0.0722 * b
            };
            // Rounding to whole numbers moves it by half a level at most.
            assert!((1..=200).all(|i| brightness(i) > brightness(i - 1) - 0.5), "{}", map.name());
        }
    }

    #[test]
    fn outside_and_nothing_have_an_answer() {
        assert_eq!(ColourMap::Viridis.at(-3.0), ColourMap::Viridis.at(0.0));
        assert_eq!(ColourMap::Viridis.at(f64::INFINITY), ColourMap::Viridis.at(1.0));
        assert_eq!(ColourMap::Viridis.at(f64::NAN), NOT_MEASURED);
        assert_eq!(ColourMap::Viridis.of(None, [0.0, 1.0]), NOT_MEASURED);
        assert_eq!(ColourMap::Viridis.of(Some(2.0), [2.0, 2.0]), ColourMap::Viridis.at(0.0));
        assert_eq!(ColourMap::Viridis.of(Some(3.0), [1.0, 3.0]), ColourMap::Viridis.at(1.0));
    }
}
