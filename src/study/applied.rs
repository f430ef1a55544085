//! What a method of a study would change in a project: its choices for the chain, and a sentence that says so.

use super::table::pairs;
use crate::displacement::regularised::WeightRule;
use crate::displacement::{DepthRule, UnmarkedRule};
use crate::forces::{SkinModel, SpringRule};
use crate::muscle::LawKind;
use crate::project::{FieldWay, MuscleWay, Settings};

/// A project's choices with a method of a study in place.
#[derive(Clone, Debug, PartialEq)]
pub struct Applied {
    /// The choices.
    pub settings: Settings,
    /// What they change: "Depth: slide on surface (now frozen depth)."
    pub words: String,
}

/// The choices of the chain that a method and its setting stand for; none where they are no choice of a project, as an integrator is none.
///
/// A choice is told by the method's name or by a pair of its setting: `depth`, `springs`, `skin`, `unmarked`. A project is solved on its own mesh: what runs
/// on a finer one cannot be applied.
pub fn applied(method: &str, setting: &str, now: &Settings) -> Option<Applied> {
    if pairs(setting).contains(&("mesh", "finer")) {
        return None;
    }
    let mut settings = now.clone();
    let mut changes: Vec<(&str, String, String)> = Vec::new();
    let mut known = false;
    for choice in choices(method, setting) {
        known = true;
        let (what, old, new) = match choice {
            Choice::Depth(rule) => {
                let old = std::mem::replace(&mut settings.depth, rule);
                ("Depth", depth_words(old), depth_words(rule))
            }
            Choice::Springs(rule) => {
                let old = std::mem::replace(&mut settings.springs, rule);
                ("Width of springs", springs_words(old), springs_words(rule))
            }
            Choice::Skin(model) => {
                let old = std::mem::replace(&mut settings.skin_model, model);
                ("Skin", old.label().to_lowercase(), model.label().to_lowercase())
            }
            Choice::Unmarked(rule) => {
                let old = std::mem::replace(&mut settings.unmarked, rule);
                ("Unmarked points", unmarked_words(old), unmarked_words(rule))
            }
            Choice::Field(way) => {
                let old = std::mem::replace(&mut settings.field, way);
                ("Way to the forces", field_words(old), field_words(way))
            }
        };
        if old != new {
            changes.push((what, old, new));
        }
    }
    let words = if changes.is_empty() {
        "The project is solved so already.".to_owned()
    } else {
        changes.iter().map(|(what, old, new)| format!("{what}: {new} (now {old}).")).collect::<Vec<_>>().join(" ")
    };
    known.then_some(Applied { settings, words })
}

enum Choice {
    Depth(DepthRule),
    Springs(SpringRule),
    Skin(SkinModel),
    Unmarked(UnmarkedRule),
    Field(FieldWay),
}

fn choices(method: &str, setting: &str) -> Vec<Choice> {
    let within = |text: &str| {
        let mm = text.trim().strip_suffix("mm")?.trim().parse::<f64>().ok()?;
        (mm.is_finite() && mm > 0.0).then_some(Choice::Unmarked(UnmarkedRule::Inferred { reach_mm: mm }))
    };
    let by_name = match method {
        "Frozen depth" => Some(Choice::Depth(DepthRule::FixedDepth)),
        "Slide on surface" => Some(Choice::Depth(DepthRule::SlideOnSurface)),
        "Held at rest" => Some(Choice::Unmarked(UnmarkedRule::Held)),
        other => other.strip_prefix("Inferred within").and_then(within).or_else(|| way(other).map(Choice::Field)),
    };
    let by_pair = |(name, value): (&str, &str)| match (name, value) {
        ("depth", "fixed" | "frozen") => Some(Choice::Depth(DepthRule::FixedDepth)),
        ("depth", "slide") => Some(Choice::Depth(DepthRule::SlideOnSurface)),
        ("depth", "height") => Some(Choice::Depth(DepthRule::KeepHeight)),
        ("depth", "half") => Some(Choice::Depth(DepthRule::HalfWay)),
        ("springs", "strip") => Some(Choice::Springs(SpringRule::Strip)),
        ("springs", "one for all" | "uniform") => Some(Choice::Springs(SpringRule::Uniform)),
        ("skin", word) => {
            let named = |m: &SkinModel| m.label().to_lowercase() == word;
            SkinModel::ALL.into_iter().find(named).map(Choice::Skin)
        }
        ("unmarked", "held") => Some(Choice::Unmarked(UnmarkedRule::Held)),
        ("unmarked", "inferred") => Some(Choice::Unmarked(UnmarkedRule::default())),
        _ => None,
    };
    by_name.into_iter().chain(pairs(setting).into_iter().filter_map(by_pair)).collect()
}

/// What a study calls a way to the field: what [`applied`] reads.
pub(super) fn method(way: FieldWay) -> String {
    let words = match way {
        FieldWay::Direct => Vec::new(),
        FieldWay::Regularised { weight } => vec![weight.label().to_lowercase()],
        FieldWay::Muscles(MuscleWay { law, most, shape, .. }) => {
            let most = most.map(|n| if n == u8::MAX { FEWEST.to_owned() } else { format!("{AT_MOST}{n}") });
            let words: Vec<String> = law.map(|l| l.label().to_owned()).into_iter().chain(most).collect();
            let words: Vec<String> = words.into_iter().chain(shape.then(|| SHAPED.to_owned())).collect();
            if words.is_empty() { vec![ALL.to_owned()] } else { words }
        }
    };
    let alone = matches!(way, FieldWay::Muscles(MuscleWay { alone: true, .. }));
    let first = format!("{}{}", way.label(), if alone { ALONE } else { "" });
    std::iter::once(first).chain(words).collect::<Vec<_>>().join(", ")
}

const ALONE: &str = " alone";
const ALL: &str = "all";
const SHAPED: &str = "its shape found";
const FEWEST: &str = "smallest set";
const AT_MOST: &str = "at most ";

/// The way that [`method`] calls so; muscles are weighed by the discrepancy.
fn way(method: &str) -> Option<FieldWay> {
    let (first, words) = method.split_once(", ").unwrap_or((method, ""));
    let muscles = FieldWay::Muscles(MuscleWay::default()).label();
    if first == FieldWay::Direct.label() && words.is_empty() {
        return Some(FieldWay::Direct);
    }
    if let Some(weight) = WeightRule::ALL.into_iter().find(|w| w.label().to_lowercase() == words) {
        let regularised = FieldWay::Regularised { weight };
        return (first == regularised.label()).then_some(regularised);
    }
    let mut found = MuscleWay { alone: first.ends_with(ALONE), law: None, most: None, ..MuscleWay::default() };
    if first.strip_suffix(ALONE).unwrap_or(first) != muscles || words.is_empty() {
        return None;
    }
    for word in words.split(", ").filter(|w| *w != ALL) {
        match LawKind::ALL.into_iter().find(|l| l.label() == word) {
            Some(law) => found.law = Some(law),
            None if word == SHAPED => found.shape = true,
            None if word == FEWEST => found.most = Some(u8::MAX),
            None => found.most = Some(word.strip_prefix(AT_MOST)?.parse().ok()?),
        }
    }
    Some(FieldWay::Muscles(found))
}

fn depth_words(rule: DepthRule) -> String {
    match rule {
        DepthRule::FixedDepth => "frozen, as the thesis",
        DepthRule::SlideOnSurface => "on the first frame's surface",
        DepthRule::KeepHeight => "at its height above the skull",
        DepthRule::HalfWay => "half way to its height above the skull",
    }
    .to_owned()
}

fn springs_words(rule: SpringRule) -> String {
    match rule {
        SpringRule::Strip => "each its own strip of skin",
        SpringRule::Uniform => "one for all, as the thesis",
    }
    .to_owned()
}

fn unmarked_words(rule: UnmarkedRule) -> String {
    match rule {
        UnmarkedRule::Inferred { reach_mm } => format!("filled in between marks within {reach_mm} mm"),
        UnmarkedRule::Held => "held where they were, as the thesis".to_owned(),
    }
}

fn field_words(way: FieldWay) -> String {
    let label = way.label().to_lowercase();
    match way {
        FieldWay::Direct => format!("{label}, as the thesis"),
        FieldWay::Regularised { weight } => format!("{label}, weight by {}", weight.label().to_lowercase()),
        FieldWay::Muscles(MuscleWay { law, most, alone, shape, .. }) => {
            let alone = if alone { " alone" } else { "" };
            let most = match most {
                None => String::new(),
                Some(u8::MAX) => ", the fewest that explain the motion".to_owned(),
                Some(n) => format!(", at most {n}"),
            };
            let law = law.map_or("the law that leaves least", LawKind::label);
            let shape = if shape { ", its shape found" } else { "" };
            format!("{label}{alone}, {law}{shape}{most}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_method_is_a_choice_by_its_name_or_its_setting_and_an_integrator_is_none() {
        let now = Settings::default();
        let slide = applied("Slide on surface", "distance_mm=300", &now).unwrap();
        assert_eq!(slide.settings.depth, DepthRule::SlideOnSurface);
        assert_eq!(slide.words, "Depth: on the first frame's surface (now frozen, as the thesis).");
        let half = applied("Direct", "depth=half", &now).unwrap();
        assert_eq!(half.settings.depth, DepthRule::HalfWay);
        assert_eq!(applied("Direct", "depth=height", &now).unwrap().settings.depth, DepthRule::KeepHeight);
        let rest = Settings { depth: now.depth, ..slide.settings };
        assert_eq!(rest, now);
        let several = applied("Direct", "springs=one for all; unmarked=held", &now).unwrap();
        assert_eq!((several.settings.springs, several.settings.unmarked), (SpringRule::Uniform, UnmarkedRule::Held));
        let skin = applied("Direct", "skin=membrane", &now).unwrap();
        assert_eq!(skin.settings.skin_model, SkinModel::Membrane);
        assert_eq!(skin.words, "Skin: membrane (now springs).");
        let reach = applied("Inferred within 25 mm", "marked_percent=80", &now).unwrap();
        assert_eq!(reach.settings.unmarked, UnmarkedRule::Inferred { reach_mm: 25.0 });
        assert_eq!(applied("Frozen depth", "", &now).unwrap().words, "The project is solved so already.");
        let smooth = applied("Regularised, evidence", "rules=as the scene", &now).unwrap();
        assert_eq!(smooth.settings.field, FieldWay::Regularised { weight: WeightRule::Evidence });
        assert_eq!(smooth.words, "Way to the forces: regularised, weight by evidence (now direct, as the thesis).");
        assert_eq!(applied("Direct", "rules=as the scene", &smooth.settings).unwrap().settings.field, FieldWay::Direct);
        let muscles = applied("Muscles, at most 2", "depth=height; mesh=own", &now).unwrap();
        let law = None;
        let of = |law, most, alone| FieldWay::Muscles(MuscleWay { law, most, alone, ..MuscleWay::default() });
        assert_eq!(muscles.settings.field, of(law, Some(2), false));
        assert_eq!(muscles.settings.depth, DepthRule::KeepHeight);
        assert!(muscles.words.starts_with(
            "Way to the forces: muscles, the law that leaves least, at most 2 (now direct, as the thesis)."
        ));
        let named = |name: &str| applied(name, "rules=as the scene", &now).unwrap().settings.field;
        assert_eq!(named("Muscles, all"), of(law, None, false));
        assert_eq!(named("Muscles alone, all"), of(law, None, true));
        assert_eq!(named("Muscles, smallest set"), of(law, Some(u8::MAX), false));
        let sheet = Some(LawKind::WatersSheet);
        assert_eq!(named("Muscles, Waters sheet"), of(sheet, None, false));
        assert_eq!(named("Muscles alone, Waters sheet, at most 3"), of(sheet, Some(3), true));
        for most in [None, Some(2), Some(u8::MAX)] {
            for (law, alone) in [(None, false), (sheet, false), (None, true), (sheet, true)] {
                assert_eq!(named(&method(of(law, most, alone))), of(law, most, alone));
                let shaped = FieldWay::Muscles(MuscleWay { law, most, alone, shape: true, ..MuscleWay::default() });
                assert_eq!(named(&method(shaped)), shaped);
            }
        }
        assert_eq!(applied("Muscles", "rules=as the scene", &now), None);
        assert_eq!(applied("Muscles, of nobody", "rules=as the scene", &now), None);
        assert_eq!(applied("Direct", "depth=height; mesh=finer", &now), None);
        assert_eq!(applied("Implicit Euler", "step_ms=1; stiffness=1", &now), None);
        assert_eq!(applied("Inferred within −3 mm", "", &now), None);
    }
}
