//! The muscles of a subject as files: `fit.json`, `activations.csv`, `profiles.csv`, `profiles.svg`, `fields.csv`.

use std::fmt::Write as _;

use serde::Serialize;

use super::csv::{numbers, quoted};
use super::report::{Circumstances, Origin};
use super::subjects::Across;
use crate::draw::line_chart::{Axis, Bar, BarChart, COLOURS, HEADING, LineChart, Series, Style, Value, sheet};
use crate::draw::numbers::significant;
use crate::face::FaceModel;
use crate::fit::HeldOut;
use crate::fit::activations::{Activation, Standing, UnitStrength};
use crate::fit::selection::Selection;
use crate::muscle_field::fibres::muscle_name;
use crate::muscle_field::fields::fields;
use crate::muscle_field::profiles::{Curve, Part, Profile, Way, profile_of_laws};
use crate::muscle_field::subjects::{Carried, Other};
use crate::muscle_field::{Analysis, Ladder, LawRow, Question};
use crate::pipeline::Outcome;
use crate::project::Project;

/// Header of [`activations`].
pub const ACTIVATIONS_HEADER: &str = "muscle,action_unit,activation_N,low_N,high_N";

/// Header of [`profiles_csv`].
pub const PROFILES_HEADER: &str = "muscle,way,source,vertex,at_mm,along_fibre_N,sigma_N";

/// Header of [`fields_csv`].
pub const FIELDS_HEADER: &str = "vertex,muscle,fitted,along_fibre_N,law_N,left_N,sigma_N";

/// What is told of one subject.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// What was marked.
    pub project: &'a Project,
    /// The face.
    pub face: &'a FaceModel,
    /// What the chain made of it.
    pub outcome: &'a Outcome,
    /// The muscles.
    pub analysis: &'a Analysis,
    /// The ladder, if it was built.
    pub ladder: Option<&'a Ladder>,
    /// The picture of the last frame, where it is there.
    pub last_frame: Option<&'a image::RgbImage>,
    /// Other subjects that the laws were tried on.
    pub others: &'a [Other],
}

#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    origin: Origin<'a>,
    face: &'a str,
    force_unit: &'static str,
    question: &'a Question,
    samples: usize,
    muscles_fitted: Vec<&'a str>,
    set_explains_the_field: bool,
    best: Option<String>,
    second_lobe_pays: Option<bool>,
    laws: Vec<Law<'a>>,
    r_squared_of_all_muscles: f64,
    activations: Vec<Muscle<'a>>,
    action_units: Vec<UnitStrength>,
    hard_to_tell_apart: Vec<(&'a str, Vec<&'a str>)>,
    smallest_set: SmallestSet<'a>,
    ladder: Option<&'a Ladder>,
    tried_on: Vec<TriedOn<'a>>,
    across_subjects: Option<Across>,
    remarks: &'a [String],
    timings_ms: std::collections::BTreeMap<&'static str, f64>,
}

#[derive(Serialize)]
struct Law<'a> {
    label: String,
    kind: &'static str,
    held_out_error: Option<f64>,
    /// Squared held-out error above the best law's, and its standard error.
    worse_than_best_by: Option<[f64; 2]>,
    #[serde(flatten)]
    row: &'a LawRow,
}

#[derive(Serialize)]
struct Muscle<'a> {
    muscle: &'a str,
    #[serde(flatten)]
    activation: Activation,
}

#[derive(Serialize)]
struct SmallestSet<'a> {
    muscles: Vec<&'a str>,
    #[serde(flatten)]
    selection: &'a Selection,
}

#[derive(Serialize)]
struct TriedOn<'a> {
    project: &'a str,
    #[serde(flatten)]
    carried: &'a Carried,
}

impl<'a> Subject<'a> {
    /// Id of a muscle by its index in the analysis.
    fn id(&self, fibre: usize) -> &'a str {
        &self.face.muscles()[self.analysis.fibres[fibre].muscle].id
    }

    /// Name for people.
    fn name(&self, fibre: usize) -> String {
        muscle_name(&self.face.muscles()[self.analysis.fibres[fibre].muscle])
    }

    fn units(&self) -> Vec<u8> {
        let muscles = self.face.muscles();
        self.analysis.fibres.iter().map(|f| muscles[f.muscle].action_unit).collect()
    }
}

/// The text of `fit.json`.
pub fn fit_json(subject: &Subject<'_>, circumstances: &Circumstances) -> String {
    let analysis = subject.analysis;
    let of_best = analysis.best.and_then(|b| analysis.laws[b].held_out.as_ref());
    let ids = |set: &[usize]| set.iter().map(|&f| subject.id(f)).collect::<Vec<_>>();
    let activations = analysis.activations.muscles.iter().enumerate();
    let confusable = analysis.activations.confusable.iter();
    let report = Report {
        origin: Origin::of(subject.project, circumstances),
        face: subject.face.name(),
        force_unit: subject.outcome.unit(),
        question: &analysis.question,
        samples: analysis.samples.len(),
        muscles_fitted: ids(&analysis.set),
        set_explains_the_field: analysis.explains,
        best: analysis.best.map(|b| analysis.laws[b].label()),
        second_lobe_pays: analysis.second_lobe_pays(),
        laws: analysis.laws.iter().map(|row| law(row, of_best)).collect(),
        r_squared_of_all_muscles: analysis.activations.r_squared,
        activations: activations.map(|(f, a)| Muscle { muscle: subject.id(f), activation: *a }).collect(),
        action_units: analysis.activations.by_unit(&subject.units()),
        hard_to_tell_apart: confusable
            .map(|c| (subject.id(c.muscle), c.with.iter().map(|(f, _)| subject.id(*f)).collect()))
            .collect(),
        smallest_set: SmallestSet { muscles: ids(&analysis.selection.chosen), selection: &analysis.selection },
        ladder: subject.ladder,
        tried_on: subject.others.iter().map(|o| TriedOn { project: &o.name, carried: &o.carried }).collect(),
        across_subjects: (!subject.others.is_empty()).then(|| Across::of(subject)),
        remarks: &circumstances.remarks,
        timings_ms: circumstances.timings_ms.iter().copied().collect(),
    };
    serde_json::to_string_pretty(&report).unwrap_or_default() + "\n"
}

fn law<'a>(row: &'a LawRow, best: Option<&HeldOut>) -> Law<'a> {
    let held_out = row.held_out.as_ref();
    Law {
        label: row.label(),
        kind: row.law.kind().name(),
        held_out_error: held_out.map(|h| h.error),
        worse_than_best_by: held_out.zip(best).map(|(h, best)| h.excess_over(best)),
        row,
    }
}

/// `activations.csv`: one row a muscle; without a measured force in its reach its numbers are `NaN`.
pub fn activations(subject: &Subject<'_>) -> String {
    let mut text = format!("{ACTIVATIONS_HEADER}\n");
    for (f, one) in subject.analysis.activations.muscles.iter().enumerate() {
        let muscle = &subject.face.muscles()[subject.analysis.fibres[f].muscle];
        let _ = write!(text, "{},{}", quoted(&muscle.id), muscle.action_unit);
        let told = matches!(one.standing, Standing::Active | Standing::AtZero);
        let row = [one.strength_n, one.low_n, one.high_n];
        numbers(&mut text, row.into_iter().map(|x| if told { x } else { f64::NAN }));
        text.push('\n');
    }
    text
}

/// The profiles along and across every muscle whose law was fitted, with every law's curve.
pub fn profiles(subject: &Subject<'_>) -> Vec<(usize, Profile)> {
    let analysis = subject.analysis;
    let cut = |&f: &usize| {
        let one = move |way| profile_of_laws(subject.face.mesh(), subject.outcome, analysis, f, way, Part::AlongFibre);
        Way::ALL.into_iter().filter_map(one).map(move |p| (f, p))
    };
    analysis.set.iter().flat_map(cut).collect()
}

/// `profiles.csv`: `source` is `observed` (believed vertices), `not_fitted` (other known ones) or the name of a law.
pub fn profiles_csv(subject: &Subject<'_>, profiles: &[(usize, Profile)]) -> String {
    let mut text = format!("{PROFILES_HEADER}\n");
    for (f, profile) in profiles {
        let begin = format!("{},{}", quoted(subject.id(*f)), profile.way.name());
        let names: Vec<String> = subject.analysis.laws.iter().map(LawRow::label).collect();
        observed_rows(&mut text, &begin, profile);
        curve_rows(&mut text, &begin, profile, &names);
    }
    text
}

/// What was observed on a profile, a row a vertex.
pub(super) fn observed_rows(text: &mut String, begin: &str, profile: &Profile) {
    for o in &profile.observed {
        let source = if o.believed { "observed" } else { "not_fitted" };
        let _ = write!(text, "{begin},{source},{}", o.vertex);
        numbers(text, [o.at_mm, o.value, o.sigma].into_iter());
        text.push('\n');
    }
}

/// The curves of a profile under their names.
pub(super) fn curve_rows(text: &mut String, begin: &str, profile: &Profile, names: &[String]) {
    for (name, curve) in names.iter().zip(&profile.curves) {
        for [at, value] in curve.points.iter().filter(|p| p[1].is_finite()) {
            let _ = write!(text, "{begin},{},", quoted(name));
            numbers(text, [*at, *value, f64::NAN].into_iter());
            text.push('\n');
        }
    }
}

/// `profiles.svg`: a row a muscle, along it and across it.
pub fn profiles_svg(subject: &Subject<'_>, profiles: &[(usize, Profile)]) -> String {
    let unit = subject.outcome.unit();
    let laws: Vec<&LawRow> = subject.analysis.laws.iter().collect();
    let chart = |(f, profile): &(usize, Profile)| {
        let fitted = laws.iter().zip(&profile.curves).enumerate().filter(|(_, (row, _))| row.fit.is_ok());
        let series = fitted.map(|(k, (row, curve))| {
            let best = subject.analysis.best == Some(k);
            let name = if best { format!("{} (best)", row.label()) } else { row.label() };
            line(name, k, if best { Style::Line } else { Style::Dashed }, curve)
        });
        profile_chart(&subject.name(*f), unit, profile, series.collect())
    };
    let heading = format!("{}: observed forces and laws", title(subject.project));
    let below = format!("{} vertices fitted; positive pulls to the bone", subject.analysis.samples.len());
    in_pairs(&profiles.iter().map(chart).collect::<Vec<_>>(), &heading, &below)
}

/// A model's curve, in the colour of that place.
pub(super) fn line(name: String, place: usize, style: Style, curve: &Curve) -> Series {
    Series {
        name,
        colour: COLOURS[place % (COLOURS.len() - 1)].into(),
        style,
        values: curve.points.iter().map(|p| Value::at(p[0], p[1])).collect(),
    }
}

/// The believed forces of a profile with their errors, and models' lines.
pub(super) fn profile_chart(muscle: &str, unit: &str, profile: &Profile, mut series: Vec<Series>) -> LineChart {
    let way = match profile.way {
        Way::Radial => "Along",
        Way::Lateral => "Across",
    };
    let believed = profile.observed.iter().filter(|o| o.believed);
    series.push(Series {
        name: "measured, ± one standard error".into(),
        colour: "#333333".into(),
        style: Style::Points,
        values: believed.map(|o| Value { error: Some(o.sigma), ..Value::at(o.at_mm, o.value) }).collect(),
    });
    LineChart {
        title: format!("{way} {muscle}"),
        x: Axis::linear(profile.way.axis()),
        y: Axis::linear(format!("force along the fibre, {unit}")),
        series,
        x_marks: match profile.way {
            Way::Radial => vec![(profile.insertion_mm, "insertion".into())],
            Way::Lateral => Vec::new(),
        },
        y_marks: Vec::new(),
    }
}

/// Charts in two columns on a sheet.
pub(super) fn in_pairs(charts: &[LineChart], heading: &str, below: &str) -> String {
    const SIZE: [f64; 2] = [560.0, 380.0];
    let place = |k: usize| [20.0 + SIZE[0] * (k % 2) as f64, HEADING + SIZE[1] * (k / 2) as f64];
    let drawn = charts.iter().enumerate().map(|(k, chart)| {
        let [x, y] = place(k);
        chart.draw([x, y, SIZE[0] - 20.0, SIZE[1] - 10.0])
    });
    let rows = charts.len().div_ceil(2).max(1) as f64;
    sheet([2.0 * SIZE[0] + 20.0, HEADING + rows * SIZE[1]], heading, below, &drawn.collect::<Vec<_>>())
}

/// The name of a project, or what stands for it.
pub(super) fn title(project: &Project) -> &str {
    if project.name.is_empty() { "Untitled" } else { &project.name }
}

/// Strengths as bars, a drawing of its own.
pub fn activations_svg(subject: &Subject<'_>) -> String {
    let analysis = subject.analysis;
    let bar = |(f, one): (usize, &Activation)| Bar {
        name: subject.name(f),
        value: one.strength_n,
        interval: [one.low_n, if one.high_n.is_finite() { one.high_n } else { one.low_n }],
        note: match one.standing {
            Standing::Active => significant(one.strength_n, 3),
            Standing::AtZero => format!("< {}", significant(one.high_n, 2)),
            Standing::Collinear => "not told".into(),
            Standing::Silent => "no data".into(),
        },
        pale: !analysis.selection.chosen.contains(&f),
    };
    let shown = analysis.activations.muscles.iter().enumerate().filter(|(_, a)| a.standing != Standing::Silent);
    let unit = format!("strength, {}, with 95 % interval", subject.outcome.unit());
    let chart = BarChart { title: String::new(), unit, bars: shown.map(bar).collect() };
    let below = "dark: in the smallest set that explains the field; muscles without a measured force in their reach are left out";
    let size = [760.0, HEADING + chart.height()];
    sheet(size, "Strengths of all muscles at once", below, &[chart.draw([20.0, HEADING - 10.0, 720.0])])
}

/// The ladder as a chart: numbers fitted against held-out error.
pub fn ladder_svg(ladder: &Ladder) -> String {
    let rung = |k: usize, style| {
        let rung = &ladder.rungs[k];
        let error = rung.held_out.as_ref()?.error;
        let value = Value { label: Some(rung.name.clone()), ..Value::at(rung.parameters as f64, error) };
        Some(Series { name: String::new(), colour: COLOURS[k % COLOURS.len()].into(), style, values: vec![value] })
    };
    let style = |k| if ladder.recommended == Some(k) { Style::Points } else { Style::Hollow };
    let series = (0..ladder.rungs.len()).filter_map(|k| rung(k, style(k))).collect();
    let chart = LineChart {
        title: String::new(),
        x: Axis::linear("numbers fitted"),
        y: Axis::linear("held-out error (1: as good as no muscle)"),
        series,
        x_marks: Vec::new(),
        y_marks: vec![(1.0, "no muscle".into())],
    };
    let size = [900.0, 460.0];
    let below = "error on patches of skin left out; filled: the recommended rung";
    sheet(size, "The ladder of models", below, &[chart.draw([20.0, HEADING, 860.0, 390.0])])
}

/// `fields.csv`: the signed components along the fibres at every known vertex; `NaN` where no muscle runs.
pub fn fields_csv(subject: &Subject<'_>) -> String {
    let (analysis, outcome) = (subject.analysis, subject.outcome);
    let law = analysis.best.unwrap_or(0);
    let fields = fields(outcome, subject.face, analysis, law, Part::AlongFibre);
    let along = crate::muscle_field::fibres::fibre_field(subject.face, &outcome.first);
    let mut text = format!("{FIELDS_HEADER}\n");
    for (v, state) in outcome.states.iter().enumerate().filter(|(_, s)| s.is_known()) {
        let muscle = along[v].as_ref().map_or("", |at| subject.face.muscles()[at.muscle].id.as_str());
        let _ = write!(text, "{v},{},{}", quoted(muscle), if fields.fitted[v] { "fitted" } else { state.word() });
        let or_nan = |x: Option<f64>| x.unwrap_or(f64::NAN);
        let sigma = outcome.measured().1.get(v).copied();
        let row = [fields.observed[v], fields.said[v], fields.left[v], sigma];
        numbers(&mut text, row.into_iter().map(or_nan));
        text.push('\n');
    }
    text
}

/// "0.42 N (0.31 to 0.53)".
pub(super) fn with_interval(value: f64, [low, high]: [f64; 2], unit: &str) -> String {
    format!("{} {unit} ({} to {})", significant(value, 3), significant(low, 2), significant(high, 2))
}
