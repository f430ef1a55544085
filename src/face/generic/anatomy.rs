//! What gives the generic face its meaning: where its landmarks, muscles and regions lie.

use super::super::muscle::Side;

/// A landmark of one half, or of the midline.
pub(super) struct Place {
    /// Short name without the side.
    pub id: &'static str,
    /// Name for people; `{}` stands for the side.
    pub name: &'static str,
    /// How to recognise it on a photograph.
    pub hint: &'static str,
    /// (x, y) of its vertex on the left half, mm.
    pub at: [f64; 2],
    /// Numbers of the same place on the right and the left in the 68-point markup of iBUG 300-W, from 1, where it has the place.
    pub in_68: Option<[u8; 2]>,
    /// Vertices of the same place on the right and the left of the 468-vertex tracking mesh of MediaPipe, from 0.
    pub in_468: [u16; 2],
}

/// One entry of the placing order: a place, and the side of the person on which it is placed.
pub(super) type Placing = (usize, Option<Side>);

const R: Option<Side> = Some(Side::Right);
const L: Option<Side> = Some(Side::Left);

/// The order in which an annotator places the landmarks, from the surest places to the vaguest, left to right in the picture.
pub(super) const PLACING_ORDER: [Placing; 32] = [
    (1, R),
    (2, R),
    (0, R),
    (3, R),
    (0, L),
    (2, L),
    (1, L),
    (3, L), // eyes
    (6, R),
    (5, R),
    (4, R),
    (4, L),
    (5, L),
    (6, L), // brows
    (7, None),
    (8, None),
    (9, R),
    (9, L),
    (10, None), // nose
    (11, R),
    (12, R),
    (13, None),
    (12, L),
    (11, L),
    (14, None),
    (15, None), // mouth
    (16, None),
    (17, R),
    (18, R),
    (19, None),
    (18, L),
    (17, L), // contour
];

/// The places that [`PLACING_ORDER`] names by index.
pub(super) const PLACES: [Place; 20] = [
    Place {
        id: "eye_inner",
        name: "Inner corner of the {} eye",
        hint: "Where upper and lower lid meet beside the nose; include the pink corner, whose tip is the place.",
        at: [18.4, 0.0],
        in_68: Some([40, 43]),
        in_468: [133, 362],
    },
    Place {
        id: "eye_outer",
        name: "Outer corner of the {} eye",
        hint: "Where upper and lower lid meet towards the temple; follow the lid margins, not the lashes.",
        at: [44.6, 1.0],
        in_68: Some([37, 46]),
        in_468: [33, 263],
    },
    Place {
        id: "eye_top",
        name: "Top of the {} eye opening",
        hint: "Highest place of the upper lid margin, above the pupil; not the lashes and not the fold above.",
        at: [31.0, 6.1],
        in_68: None,
        in_468: [159, 386],
    },
    Place {
        id: "eye_bottom",
        name: "Bottom of the {} eye opening",
        hint: "Lowest place of the lower lid margin, below the pupil.",
        at: [32.5, -4.9],
        in_68: None,
        in_468: [145, 374],
    },
    Place {
        id: "brow_inner",
        name: "Inner end of the {} brow",
        hint: "Where the hair of the brow begins beside the root of the nose, halfway between its edges.",
        at: [12.0, 26.0],
        in_68: Some([22, 23]),
        in_468: [107, 336],
    },
    Place {
        id: "brow_mid",
        name: "Middle of the {} brow",
        hint: "Above the outer rim of the iris, halfway between the lower and the upper edge of the brow.",
        at: [38.0, 29.0],
        in_68: Some([20, 25]),
        in_468: [105, 334],
    },
    Place {
        id: "brow_outer",
        name: "Outer end of the {} brow",
        hint: "Where the hair of the brow ends towards the temple.",
        at: [58.0, 19.0],
        in_68: Some([18, 27]),
        in_468: [70, 300],
    },
    Place {
        id: "nose_saddle",
        name: "Saddle of the nose",
        hint: "Deepest place of the root of the nose, on the midline a little above the line through the inner eye corners.",
        at: [0.0, 4.0],
        in_68: Some([28, 28]),
        in_468: [168, 168],
    },
    Place {
        id: "nose_tip",
        name: "Tip of the nose",
        hint: "The place of the nose nearest to the camera; often the brightest spot.",
        at: [0.0, -29.0],
        in_68: Some([31, 31]),
        in_468: [4, 4],
    },
    Place {
        id: "nose_wing",
        name: "{} wing of the nose",
        hint: "Outermost place of the wing of the nostril, where it meets the cheek.",
        at: [18.2, -36.0],
        in_68: Some([32, 36]),
        in_468: [129, 358],
    },
    Place {
        id: "subnasale",
        name: "Root of the upper lip",
        hint: "Where the wall between the nostrils meets the upper lip, on the midline.",
        at: [0.0, -45.0],
        in_68: Some([34, 34]),
        in_468: [2, 2],
    },
    Place {
        id: "mouth_corner",
        name: "{} corner of the mouth",
        hint: "Outermost place where the red of the upper and the lower lip meet.",
        at: [25.35, -69.0],
        in_68: Some([49, 55]),
        in_468: [61, 291],
    },
    Place {
        id: "lip_peak",
        name: "{} peak of the upper lip",
        hint: "Highest place of the red of the upper lip, on one side of the groove below the nose.",
        at: [5.6, -58.9],
        in_68: Some([51, 53]),
        in_468: [37, 267],
    },
    Place {
        id: "upper_lip",
        name: "Upper edge of the upper lip",
        hint: "The dip between the two peaks, on the midline where the red begins.",
        at: [0.0, -60.2],
        in_68: Some([52, 52]),
        in_468: [0, 0],
    },
    Place {
        id: "upper_lip_inner",
        name: "Lower edge of the upper lip",
        hint: "On the midline where the upper lip ends; with a closed mouth the middle of the line between the lips.",
        at: [0.0, -66.3],
        in_68: Some([63, 63]),
        in_468: [13, 13],
    },
    Place {
        id: "lower_lip",
        name: "Lower edge of the lower lip",
        hint: "On the midline where the red of the lower lip ends.",
        at: [0.0, -77.0],
        in_68: Some([58, 58]),
        in_468: [17, 17],
    },
    Place {
        id: "forehead_top",
        name: "Top of the forehead",
        hint: "On the midline where the hair begins; with thin hair the highest wrinkle of a raised brow plus a finger's width.",
        at: [0.0, 75.0],
        in_68: None,
        in_468: [10, 10],
    },
    Place {
        id: "temple",
        name: "{} temple",
        hint: "On the outline of the face, a little below the height of the outer end of the brow.",
        at: [70.2, 13.0],
        in_68: Some([1, 17]),
        in_468: [162, 389],
    },
    Place {
        id: "jaw",
        name: "{} corner of the jaw",
        hint: "Where the outline of the face turns from the ear towards the chin, a little below the height of the mouth.",
        at: [57.4, -76.0],
        in_68: Some([5, 13]),
        in_468: [172, 397],
    },
    Place {
        id: "chin",
        name: "Bottom of the chin",
        hint: "Lowest place of the outline of the chin, on the midline.",
        at: [0.0, -110.5],
        in_68: Some([9, 9]),
        in_468: [152, 152],
    },
];

/// A pair of muscles, given on the left half.
pub(super) struct Pair {
    /// Short name without the side.
    pub id: &'static str,
    /// Latin name.
    pub latin: &'static str,
    /// FACS action unit.
    pub action_unit: u8,
    /// (x, y) of the fixed end, mm.
    pub attachment: [f64; 2],
    /// (x, y) of the moving end, mm.
    pub insertion: [f64; 2],
    /// Half the width of the band of fibres, mm.
    pub half_width: f64,
    /// Half the angle of the zone of convergent fibres, degrees.
    pub zone_half_angle: Option<f64>,
}

const fn pair(
    id: &'static str,
    latin: &'static str,
    action_unit: u8,
    attachment: [f64; 2],
    insertion: [f64; 2],
    half_width: f64,
) -> Pair {
    Pair { id, latin, action_unit, attachment, insertion, half_width, zone_half_angle: None }
}

impl Pair {
    const fn zone(self, half_angle_deg: f64) -> Self {
        Self { zone_half_angle: Some(half_angle_deg), ..self }
    }
}

/// The nine pairs that make the six basic expressions, as far as muscles of the skin make them.
///
/// Source: cadaver and imaging studies of each muscle (frontalis: Costin 2015, Frank 2019; corrugator: Yang and Kim 2013;
/// zygomaticus: 51 cadavers), the others from the fibre coordinates of a finite element face.
pub(super) const MUSCLES: [Pair; 9] = [
    pair("frontalis_medial", "Musculus frontalis, pars medialis", 1, [12.0, 72.0], [14.0, 25.0], 13.0),
    pair("frontalis_lateral", "Musculus frontalis, pars lateralis", 2, [50.0, 62.0], [40.0, 28.0], 14.0),
    pair("corrugator", "Musculus corrugator supercilii", 4, [9.0, 16.5], [26.0, 30.0], 6.0),
    pair("levator_alae_nasi", "Musculus levator labii superioris alaeque nasi", 9, [10.0, -4.0], [17.0, -42.0], 5.0),
    pair("levator_labii", "Musculus levator labii superioris", 10, [26.0, -15.0], [20.0, -52.0], 8.0),
    pair("zygomaticus_major", "Musculus zygomaticus major", 12, [52.0, -22.0], [28.0, -66.0], 5.0),
    pair("risorius", "Musculus risorius", 20, [55.0, -62.0], [28.0, -67.0], 6.0),
    pair("depressor_anguli_oris", "Musculus depressor anguli oris", 15, [31.0, -96.0], [28.0, -69.0], 7.0),
    pair("depressor_labii", "Musculus depressor labii inferioris", 16, [20.0, -97.0], [12.0, -77.0], 7.0),
];

/// The nine pairs of Waters' face, which the thesis compares against: muscles of convergent fibres that act in a zone.
///
/// Ends and zones: the muscle file of Waters' program, brought to millimetres by the lines of eyes and mouth, chin, top and width
/// of that face. It states no widths: those of the same anatomical muscle are taken, and a third of the two bands for the three
/// strands of the frontalis.
pub(super) const WATERS_MUSCLES: [Pair; 9] = [
    pair("zygomaticus_major", "Musculus zygomaticus major", 12, [59.0, -21.0], [24.0, -66.0], 5.0).zone(45.0),
    pair("angular_depressor", "Musculus depressor anguli oris", 15, [39.0, -93.0], [24.0, -66.0], 7.0).zone(65.0),
    pair("frontalis_inner", "Musculus frontalis, pars medialis", 1, [5.5, 55.0], [7.5, 18.0], 9.0).zone(35.0),
    pair("frontalis_major", "Musculus frontalis, pars intermedia", 2, [35.0, 57.0], [37.0, 21.0], 9.0).zone(65.0),
    pair("frontalis_outer", "Musculus frontalis, pars lateralis", 2, [56.0, 47.0], [48.0, 23.0], 9.0).zone(45.0),
    pair("labii_nasi", "Musculus levator labii superioris", 10, [24.0, -7.0], [27.0, -46.0], 8.0).zone(35.0),
    pair("inner_labii_nasi", "Musculus levator labii superioris alaeque nasi", 9, [10.0, -4.0], [15.0, -31.0], 5.0)
        .zone(35.0),
    pair("lateral_corrugator", "Musculus corrugator supercilii", 4, [0.0, 13.0], [18.0, 33.0], 6.0).zone(45.0),
    pair("secondary_frontalis", "Musculus frontalis, pars medialis secunda", 1, [15.0, 35.0], [9.0, 10.0], 9.0)
        .zone(45.0),
];
