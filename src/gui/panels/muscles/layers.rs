//! The values of both maps: what was observed, and beside it what a law says or leaves, or what several subjects have in common.

use nalgebra::Point3;

use super::{Second, Shown};
use crate::draw::words::sentence;
use crate::gui::Stamp;
use crate::gui::height_map::range::range_of;
use crate::gui::height_map::{ColourRange, Layer, RangeMode};
use crate::muscle_field::Analysis;
use crate::muscle_field::fields::{Fields, fields};
use crate::muscle_field::maps::{Maps, MapsError, of_subjects};
use crate::muscle_field::profiles::Part;
use crate::muscle_field::subjects::Seen;

/// The values of both maps, kept until the answer or a choice changes.
#[derive(Debug)]
pub(super) struct Layers {
    from: From,
    pub(super) observed: Layer,
    /// The right map; in one line why there is none.
    pub(super) second: Result<Layer, String>,
    /// Forces of all subjects, this one first, where there are others.
    pub(super) across: Option<Result<Maps, MapsError>>,
    pub(super) first: Vec<Point3<f64>>,
}

/// What the values were worked out from.
#[derive(Clone, Copy, Debug, PartialEq)]
struct From {
    stamp: Stamp,
    analysis: *const Analysis,
    part: Part,
    second: Second,
    law: usize,
    subjects: u64,
    other: Option<u64>,
}

impl Layers {
    /// Those kept, if they still hold.
    pub(super) fn of(shown: &Shown<'_>, part: Part, kept: Option<Self>) -> Self {
        let from = From {
            stamp: shown.scene.stamp,
            analysis: std::ptr::from_ref(shown.analysis),
            part,
            second: shown.second,
            law: shown.law,
            subjects: shown.subjects.revision(),
            other: shown.other.map(|(id, _)| id),
        };
        if let Some(layers) = kept.filter(|l| l.from == from) {
            return layers;
        }
        let (scene, analysis) = (shown.scene, shown.analysis);
        let Fields { observed, said, left, fitted } = fields(scene.outcome, scene.face, analysis, shown.law, part);
        let all = shown.everyone();
        let across = (all.len() > 1).then(|| of_subjects(&all, &analysis.question, part));
        let layer = |title: &str, values: Vec<Option<f64>>, sets_range: Vec<bool>| Layer {
            title: title.to_owned(),
            short: match part {
                Part::Magnitude => "Force",
                Part::AlongFibre => "Along fibres",
            },
            unit: scene.outcome.unit(),
            signed: part == Part::AlongFibre,
            values,
            sigma: None,
            sets_range,
        };
        let together = |title: &str, of: &dyn Fn(&Maps) -> Vec<Option<f64>>| match &across {
            Some(Ok(maps)) if maps.shared() == 0 => Err("No vertex counts on all subjects.".to_owned()),
            Some(Ok(maps)) => {
                let values = of(maps);
                let sets_range = vec![true; values.len()];
                let signed = match shown.second {
                    Second::Spread => false,
                    Second::Difference => true,
                    _ => part == Part::AlongFibre,
                };
                Ok(Layer { signed, ..layer(title, values, sets_range) })
            }
            Some(Err(why)) => Err(sentence(&why.to_string())),
            None => Err("Open another subject to compare with.".to_owned()),
        };
        let second = match shown.second {
            Second::Model => Ok(layer("Law", said, fitted.clone())),
            Second::Residual => Ok(layer("Left", left, fitted.clone())),
            Second::Mean => together("Mean", &|maps| maps.mean.clone()),
            Second::Spread => together("Spread", &|maps| maps.spread.clone()),
            Second::Difference => together("Difference", &|maps| maps.difference(shown.place_of_other())),
        };
        Self {
            from,
            observed: layer("Observed", observed, fitted),
            second,
            across,
            first: scene.outcome.first_from_eyes(scene.face),
        }
    }

    /// Whether components along the fibres are shown, and not lengths.
    pub(super) fn is_signed(&self) -> bool {
        self.observed.signed
    }

    /// The ranges of both maps: one, so that they can be seen beside each other; two where the second shows how subjects scatter or differ,
    /// which is little beside what was observed.
    pub(super) fn ranges(&self, mode: RangeMode) -> [ColourRange; 2] {
        let of = |layer: &Layer| range_of(RangeMode::Auto, layer, &|_| true);
        let own = if let RangeMode::Locked(range) = mode { range } else { of(&self.observed) };
        match (&self.second, self.from.second) {
            (Ok(second), Second::Spread | Second::Difference) => [own, of(second)],
            (Ok(second), Second::Mean) if !matches!(mode, RangeMode::Locked(_)) => {
                let theirs = of(second);
                [ColourRange::new(own.low.min(theirs.low), own.high.max(theirs.high)); 2]
            }
            _ => [own; 2],
        }
    }
}

impl<'a> Shown<'a> {
    /// All subjects whose forces are known, this one first.
    fn everyone(&self) -> Vec<Seen<'a>> {
        let (outcome, face) = (self.scene.outcome, self.scene.face);
        let own = Seen { name: "this project", face, outcome };
        std::iter::once(own).chain(self.subjects.others().map(|(_, other)| other.seen())).collect()
    }

    /// The place of the other subject that is chosen among all.
    pub(super) fn place_of_other(&self) -> usize {
        let chosen = self.other.map(|(id, _)| id);
        self.subjects.others().position(|(id, _)| Some(id) == chosen).map_or(1, |at| at + 1)
    }

    /// Their names in that order.
    pub(super) fn names(&self) -> Vec<&'a str> {
        self.everyone().iter().map(|s| s.name).collect()
    }
}
