//! The six basic expressions as action units of the Facial Action Coding System.

use super::actuator::Actuators;
use super::preset::Expression;

/// One of the six expressions that people of all cultures name alike (Ekman).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Basic {
    /// AU 1 + 2 + 5 + 26.
    Surprise,
    /// AU 6 + 12 + 25.
    Happy,
    /// AU 1 + 4 + 7 + 15 + 17.
    Sad,
    /// AU 4 + 5 + 7 + 17 + 23.
    Anger,
    /// AU 4 + 6 + 7 + 9 + 10 + 15 + 17.
    Disgust,
    /// AU 1 + 2 + 4 + 5 + 20 + 25 + 26, and 7 on one skin.
    Fear,
}

/// How much of an action unit an expression has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dose {
    /// FACS number.
    pub action_unit: u8,
    /// Activation of every actuator that makes it, 0 to 2.
    pub activation: f64,
}

const fn dose(action_unit: u8, activation: f64) -> Dose {
    Dose { action_unit, activation }
}

impl Basic {
    /// All six, in the order of the plates.
    pub const ALL: [Self; 6] = [Self::Surprise, Self::Happy, Self::Sad, Self::Anger, Self::Disgust, Self::Fear];

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Surprise => "Surprise",
            Self::Happy => "Happy",
            Self::Sad => "Sad",
            Self::Anger => "Anger",
            Self::Disgust => "Disgust",
            Self::Fear => "Fear",
        }
    }

    /// Its action units, and how far the jaw opens (AU 26), degrees; `tissues` says whether lids and the corners of the mouth are softer and
    /// stiffer than skin ([`super::tissue`]), which wants other doses than one skin everywhere.
    ///
    /// Which units: OpenDBM's table and the FACS manual's, which agree but for disgust (9 + 15 + 16 and 10 + 17 + 4; here all but 16) and
    /// fear (7 in the first alone, and here on one skin alone). How much of each: what makes the generic face's picture be named rightly,
    /// with displacements in the measured ranges. Lips part (AU 25) by the depressor of the lower lip (AU 16).
    pub fn recipe(self, tissues: bool) -> (&'static [Dose], f64) {
        let ([one_skin, on_tissues], jaw_deg) = self.recipes();
        (if tissues { on_tissues } else { one_skin }, jaw_deg)
    }

    /// The doses on one skin everywhere and with tissues of their own, and the jaw.
    fn recipes(self) -> ([&'static [Dose]; 2], f64) {
        const SURPRISE: [&[Dose]; 2] =
            [&[dose(1, 1.0), dose(2, 1.0), dose(5, 0.3)], &[dose(1, 1.0), dose(2, 1.0), dose(5, 0.5)]];
        const HAPPY: [&[Dose]; 2] =
            [&[dose(6, 0.35), dose(12, 1.0), dose(16, 0.4)], &[dose(6, 0.5), dose(12, 1.15), dose(16, 0.75)]];
        const SAD: [&[Dose]; 2] = [
            &[dose(1, 1.1), dose(4, 0.5), dose(7, 0.3), dose(15, 0.9), dose(17, 0.7)],
            &[dose(1, 1.1), dose(4, 0.5), dose(7, 0.3), dose(15, 0.75), dose(17, 0.7)],
        ];
        const ANGER: [&[Dose]; 2] = [
            &[dose(4, 0.8), dose(5, 0.9), dose(7, 0.75), dose(17, 0.7), dose(23, 1.0)],
            &[dose(4, 1.0), dose(5, 1.0), dose(7, 0.75), dose(17, 0.8), dose(23, 0.6)],
        ];
        const DISGUST: [&[Dose]; 2] = [
            &[dose(4, 0.7), dose(6, 0.3), dose(7, 0.2), dose(9, 1.3), dose(10, 0.4), dose(15, 0.8), dose(17, 1.4)],
            &[dose(4, 0.6), dose(6, 0.5), dose(7, 0.5), dose(9, 1.4), dose(10, 0.5), dose(15, 0.6), dose(17, 1.6)],
        ];
        const FEAR: [&[Dose]; 2] = [
            &[dose(1, 1.0), dose(2, 0.4), dose(4, 0.6), dose(5, 1.0), dose(7, 0.3), dose(16, 0.3), dose(20, 1.0)],
            &[dose(1, 1.0), dose(2, 0.8), dose(4, 0.6), dose(5, 1.0), dose(16, 0.5), dose(20, 1.0)],
        ];
        match self {
            Self::Surprise => (SURPRISE, 16.0),
            Self::Happy => (HAPPY, 0.0),
            Self::Sad => (SAD, 0.0),
            Self::Anger => (ANGER, 0.0),
            Self::Disgust => (DISGUST, 0.0),
            Self::Fear => (FEAR, 5.0),
        }
    }
}

impl Expression {
    /// One of the six on a face: every actuator that makes one of its action units, by the dose for the skin that they pull on.
    pub fn basic(basic: Basic, actuators: &Actuators) -> Self {
        let (doses, jaw_deg) = basic.recipe(actuators.tissues);
        let mut expression = Self::of_action_units(basic.name(), doses, actuators);
        expression.jaw_deg = jaw_deg;
        expression
    }

    /// An expression of any action units; those that no actuator makes are left out.
    pub fn of_action_units(name: &str, doses: &[Dose], actuators: &Actuators) -> Self {
        let dosed = |unit| doses.iter().find(|d| d.action_unit == unit).map(|d| d.activation);
        let some = actuators.all.iter().filter_map(|a| Some((a.id.clone(), dosed(a.action_unit)?)));
        Self { name: name.to_owned(), activations: some.collect(), jaw_deg: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::ActuatorSettings;
    use crate::face;
    use crate::muscle::{LawKind, MuscleLaw};

    #[test]
    fn every_dose_moves_something_on_both_choices_of_muscles_and_lies_in_range() {
        let own = face::generic();
        let waters = own.with_preset("waters").unwrap();
        for (face, lacks) in [(&*own, &[][..]), (&waters, &[16_u8, 20][..])] {
            let law = MuscleLaw::default_of(LawKind::Anatomical);
            let rest = face.mesh().positions();
            let mut actuators = Actuators::of(face, rest, &law, ActuatorSettings::default()).unwrap();
            for (basic, tissues) in Basic::ALL.into_iter().flat_map(|b| [(b, false), (b, true)]) {
                actuators.tissues = tissues;
                let (doses, jaw) = basic.recipe(tissues);
                for dose in doses {
                    let made = actuators.all.iter().any(|a| a.action_unit == dose.action_unit);
                    assert!(made || lacks.contains(&dose.action_unit), "{basic:?} {dose:?}");
                }
                let expression = Expression::basic(basic, &actuators);
                assert_eq!(expression.check(), None);
                assert_eq!(expression.jaw_deg, jaw);
                assert_eq!(expression.mirrored(), expression, "{basic:?} is the same on both sides");
            }
        }
    }
}
