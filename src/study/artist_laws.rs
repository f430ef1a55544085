//! The four laws on artist-made fields: which field is explained by which muscles, and the tables of the outcome.

use std::fmt::Write;

use super::artist::ArtistField;
use super::laws::{self, Comparison, Difference};
use crate::face::FaceModel;
use crate::fit::Compare;
use crate::muscle::{Fibre, FibreError};

/// A field, the file that holds it, and the action units whose muscles are fitted to it.
#[derive(Clone, Copy, Debug)]
pub struct Made {
    /// Name for people.
    pub name: &'static str,
    /// Name of its file.
    pub file: &'static str,
    /// FACS numbers: the unit itself, or those of the expression for which the face has muscles.
    pub units: &'static [u8],
}

/// The fields of FACSHuman: seven action units and six expressions (units by FACS: anger 4 5 7 23, disgust 9 15 16, fear 1 2 4 5 7 20 26, happiness
/// 6 12, sadness 1 4 15, surprise 1 2 5 26).
pub const FIELDS: [Made; 13] = [
    Made { name: "AU 1", file: "1.target", units: &[1] },
    Made { name: "AU 2", file: "2.target", units: &[2] },
    Made { name: "AU 4", file: "4.target", units: &[4] },
    Made { name: "AU 9", file: "9.target", units: &[9] },
    Made { name: "AU 12", file: "12.target", units: &[12] },
    Made { name: "AU 15", file: "15.target", units: &[15] },
    Made { name: "AU 20", file: "20.target", units: &[20] },
    Made { name: "Anger", file: "01_Anger.target", units: &[4] },
    Made { name: "Disgust", file: "03_Disgust.target", units: &[9, 10, 15, 16] },
    Made { name: "Fear", file: "05_Fear.target", units: &[1, 2, 4, 20] },
    Made { name: "Happiness", file: "06_Happy.target", units: &[12] },
    Made { name: "Sadness", file: "07_Sadness.target", units: &[1, 4, 15] },
    Made { name: "Surprise", file: "08_Surprise.target", units: &[1, 2] },
];

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The forces F = −K X.
    Forces,
    /// Their parts in the surface.
    TangentialForces,
    /// The displacements themselves.
    Displacements,
}

impl Quantity {
    /// All.
    pub const ALL: [Self; 3] = [Self::Forces, Self::TangentialForces, Self::Displacements];

    /// Word of files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Forces => "force",
            Self::TangentialForces => "force_tangential",
            Self::Displacements => "displacement",
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::Forces => "Forces",
            Self::TangentialForces => "Forces, their part in the surface",
            Self::Displacements => "Displacements",
        }
    }

    fn unit(self) -> &'static str {
        if self == Self::Displacements { "mm" } else { "N" }
    }
}

/// One field, one quantity.
#[derive(Clone, Debug)]
pub struct Row {
    /// The field.
    pub made: Made,
    /// What is compared.
    pub quantity: Quantity,
    /// Number of muscles fitted.
    pub muscles: usize,
    /// How the laws did; none where the samples do not allow it.
    pub comparison: Option<Comparison>,
}

/// The laws on one field.
///
/// # Errors
/// A muscle that makes no fibre.
pub fn rows(face: &FaceModel, made: Made, field: &ArtistField) -> Result<Vec<Row>, FibreError> {
    let muscles = face.muscles().iter().filter(|m| made.units.contains(&m.action_unit));
    let fibres: Vec<Fibre> = muscles.map(|m| Fibre::of(m, &field.first, &field.normals)).collect::<Result<_, _>>()?;
    let (forces, displacements) = (field.samples().1, field.displacement_samples());
    let row = |quantity| {
        let comparison = match quantity {
            Quantity::Forces => laws::compare(&fibres, &forces, Compare::Vectors),
            Quantity::TangentialForces => laws::compare(&fibres, &forces, Compare::Tangential),
            Quantity::Displacements => laws::compare(&fibres, &displacements, Compare::Vectors),
        };
        Row { made, quantity, muscles: fibres.len(), comparison }
    };
    Ok(Quantity::ALL.map(row).to_vec())
}

/// One row a field, quantity and law. `force_error` is √(1 − R²) on skin not seen.
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "study,method,setting,noise_px,vertices,seed,time_ms,force_error,status,cause,quantity,muscles,patches,patches_without_fit,rms,r2_fitted,r2_held_out,r2_held_out_low,r2_held_out_high,parameters,strengths\n",
    );
    for row in rows {
        let Some(c) = &row.comparison else { continue };
        for s in &c.standings {
            let (time, status, cause) = match &s.fit {
                Ok(fit) => (format!("{:.4}", fit.time_ms), "ok", String::new()),
                Err(why) => (String::new(), "failed", why.replace('"', "'")),
            };
            let parameters: Vec<String> =
                s.law.parameters().iter().map(|p| format!("{}={:.4}", p.name, p.value)).collect();
            let strengths: Vec<String> = s.strengths_n.iter().map(|v| format!("{v:.4}")).collect();
            let _ = writeln!(
                text,
                "laws,\"{}\",\"{}\",0,{},0,{time},{:.4},{status},\"{cause}\",{},{},{},{},{:.5},{:.4},{:.4},{:.4},{:.4},{},{}",
                s.name,
                row.made.name,
                c.samples,
                (1.0 - s.held_out_r2).max(0.0).sqrt(),
                row.quantity.name(),
                row.muscles,
                c.patches,
                s.failed_patches,
                c.rms_n,
                s.r2,
                s.held_out_r2,
                s.interval[0],
                s.interval[1],
                parameters.join(" "),
                strengths.join(" ")
            );
        }
    }
    text
}

fn percent(value: f64) -> String {
    format!("{:.0}", 100.0 * value).replace('-', "−")
}

fn span(d: &Difference) -> String {
    format!("{} [{}, {}]", percent(d.value), percent(d.interval[0]), percent(d.interval[1]))
}

/// The tables as Markdown.
pub fn markdown(all: &[Row]) -> String {
    let mut text = String::from(
        "# The four laws on fields that none of them made\n\nShare (%) of the squared vectors that is foretold on patches of skin that the fit did not see; 95 % interval over patches. Below zero no muscle at all would be nearer. `*`: on some patches no fit was found.\n",
    );
    for quantity in Quantity::ALL {
        let rows: Vec<&Row> = all.iter().filter(|r| r.quantity == quantity).collect();
        let Some(first) = rows.iter().find_map(|r| r.comparison.as_ref()) else { continue };
        let _ = write!(
            text,
            "\n## {}\n\n| field | muscles | samples / patches | rms, {} |",
            quantity.label(),
            quantity.unit()
        );
        for s in &first.standings {
            let _ = write!(text, " {} |", s.name);
        }
        text.push_str(
            " best of the four | ahead of the next by | anatomical ahead of the best other by |\n|---|---|---|---|",
        );
        text.push_str(&"---|".repeat(first.standings.len() + 3));
        text.push('\n');
        for row in &rows {
            let Some(c) = &row.comparison else {
                let _ = writeln!(text, "| {} | {} | too few |", row.made.name, row.muscles);
                continue;
            };
            let _ = write!(
                text,
                "| {} | {} | {} / {} | {:.3} |",
                row.made.name, row.muscles, c.samples, c.patches, c.rms_n
            );
            for s in &c.standings {
                let star = if s.failed_patches > 0 || s.fit.is_err() { "*" } else { "" };
                let d = Difference { value: s.held_out_r2, interval: s.interval };
                let _ = write!(text, " {}{star} |", span(&d));
            }
            let _ = match ranking(c) {
                Some((best, next, anatomical, other)) => {
                    writeln!(
                        text,
                        " {} | {} | {} |",
                        c.best().map_or("none", |k| c.standings[k].name),
                        span(&c.difference(best, next)),
                        span(&c.difference(anatomical, other))
                    )
                }
                None => writeln!(text, " | | |"),
            };
        }
        summary(&mut text, &rows);
    }
    text
}

/// The best of the four and the next; the anatomical law and the best of the other three.
fn ranking(c: &Comparison) -> Option<(usize, usize, usize, usize)> {
    let mut order: Vec<usize> = (0..c.standings.len()).filter(|&k| c.standings[k].ranked).collect();
    order.sort_by(|&a, &b| c.standings[b].held_out_r2.total_cmp(&c.standings[a].held_out_r2));
    let anatomical = *order.iter().find(|&&k| c.standings[k].name == ANATOMICAL)?;
    let other = *order.iter().find(|&&k| k != anatomical)?;
    Some((*order.first()?, *order.get(1)?, anatomical, other))
}

const ANATOMICAL: &str = crate::muscle::LawKind::Anatomical.label();

fn summary(text: &mut String, rows: &[&Row]) {
    let comparisons: Vec<&Comparison> = rows.iter().filter_map(|r| r.comparison.as_ref()).collect();
    let Some(first) = comparisons.first() else { return };
    let _ = writeln!(
        text,
        "\n| law | best on | surely better than the next on | mean % | anatomical minus it, mean over the fields [95 %] |\n|---|---|---|---|---|"
    );
    let anatomical = first.standings.iter().position(|s| s.name == ANATOMICAL);
    for (k, standing) in first.standings.iter().enumerate() {
        let won: Vec<&&Comparison> = comparisons.iter().filter(|c| c.best() == Some(k)).collect();
        let sure = won.iter().filter(|c| ranking(c).is_some_and(|(best, next, ..)| c.difference(best, next).is_sure()));
        let mean = comparisons.iter().map(|c| c.standings[k].held_out_r2).sum::<f64>() / comparisons.len() as f64;
        let differences: Vec<f64> = anatomical.map_or_else(Vec::new, |a| {
            comparisons.iter().map(|c| c.standings[a].held_out_r2 - c.standings[k].held_out_r2).collect()
        });
        let over = laws::over_fields(&differences).filter(|_| anatomical != Some(k));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} |",
            standing.name,
            if standing.ranked { won.len().to_string() } else { "not ranked".to_owned() },
            sure.count(),
            percent(mean),
            over.map_or_else(String::new, |d| span(&d))
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Sample;
    use crate::muscle::{LawKind, MuscleLaw};
    use crate::study::activation_trial::fibres_and_samples;

    /// A field made by Koch's law, as a row: the tables name it, and every line of the CSV has as many cells as its head.
    #[test]
    fn tables_name_the_winner() {
        let face = crate::face::generic();
        let (fibres, samples) = fibres_and_samples(&face).unwrap();
        let law = MuscleLaw::default_of(LawKind::Koch);
        let forces = |s: &Sample| fibres[4..6].iter().map(|f| law.force(f, &s.position)).sum();
        let field: Vec<Sample> = samples.iter().map(|s| Sample { force: forces(s), ..*s }).collect();
        let comparison = laws::compare(&fibres[4..6], &field, Compare::Vectors);
        let rows = [Row { made: FIELDS[2], quantity: Quantity::Forces, muscles: 2, comparison }];
        let table = markdown(&rows);
        assert!(table.contains("| AU 4 | 2 |") && table.contains("| Koch | 1 | 1 | 100 |"), "{table}");
        let text = csv(&rows);
        let cells: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
        assert!(cells.len() == 6 && cells.iter().all(|n| *n == cells[0] || *n == cells[0] + 1), "{text}");
    }
}
