//! Which expression a scene of known truth shows: a named one, or muscles drawn by a seed.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::expression::{Actuators, Basic, Dose, Expression};

/// What a scene shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Action units 1 and 2 alone.
    BrowRaise,
    /// One of the six.
    Basic(Basic),
    /// One to five actuators by chance, each at 0.3 to 1, the jaw shut.
    Random,
}

impl Wish {
    /// All, the brow raise first.
    pub const ALL: [Self; 8] = [
        Self::BrowRaise,
        Self::Basic(Basic::ALL[0]),
        Self::Basic(Basic::ALL[1]),
        Self::Basic(Basic::ALL[2]),
        Self::Basic(Basic::ALL[3]),
        Self::Basic(Basic::ALL[4]),
        Self::Basic(Basic::ALL[5]),
        Self::Random,
    ];

    /// The word used in files and on the command line.
    pub fn word(self) -> String {
        match self {
            Self::BrowRaise => "brow_raise".to_owned(),
            Self::Basic(basic) => basic.name().to_lowercase(),
            Self::Random => "random".to_owned(),
        }
    }

    /// The expression; of [`Self::Random`] the seed's.
    pub fn expression(self, actuators: &Actuators, seed: u64) -> Expression {
        match self {
            Self::BrowRaise => {
                let doses = [1, 2].map(|action_unit| Dose { action_unit, activation: 1.0 });
                Expression::of_action_units("Brow raise", &doses, actuators)
            }
            Self::Basic(basic) => Expression::basic(basic, actuators),
            Self::Random => random(actuators, seed),
        }
    }
}

fn random(actuators: &Actuators, seed: u64) -> Expression {
    let mut random = Pcg64::seed_from_u64(seed ^ 0x6d75_7363);
    let mut left: Vec<&str> = actuators.all.iter().filter(|a| !a.loads.is_empty()).map(|a| a.id.as_str()).collect();
    let count = random.random_range(1..=5_usize).min(left.len());
    let activations = (0..count).map(|_| {
        let chosen = left.swap_remove(random.random_range(0..left.len()));
        (chosen.to_owned(), random.random_range(0.3..=1.0))
    });
    Expression { name: format!("Muscles by chance, seed {seed}"), activations: activations.collect(), jaw_deg: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::ActuatorSettings;
    use crate::face;
    use crate::muscle::{LawKind, MuscleLaw};

    #[test]
    fn words_differ_and_chance_is_a_seed_s() {
        let face = face::generic();
        let law = MuscleLaw::default_of(LawKind::Anatomical);
        let all = Actuators::of(&face, face.mesh().positions(), &law, ActuatorSettings::default()).unwrap();
        let words: std::collections::BTreeSet<String> = Wish::ALL.iter().map(|w| w.word()).collect();
        assert_eq!(words.len(), Wish::ALL.len());
        let counts: Vec<usize> = (0..60)
            .map(|seed| {
                let expression = Wish::Random.expression(&all, seed);
                assert_eq!(expression, Wish::Random.expression(&all, seed));
                assert!(expression.check().is_none() && all.loads(&expression).unknown.is_empty());
                assert!(expression.activations.values().all(|a| (0.3..=1.0).contains(a)));
                expression.activations.len()
            })
            .collect();
        assert!((1..=5).all(|n| counts.contains(&n)));
        // Two muscles of each brow.
        assert_eq!(Wish::BrowRaise.expression(&all, 0).activations.len(), 4);
    }
}
