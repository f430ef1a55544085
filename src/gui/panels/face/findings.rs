//! What the check says of the face, and what its import has changed.

use egui::{RichText, Ui};

use crate::face::check::Severity;
use crate::gui::face_work::OpenFace;
use crate::gui::theme;

/// Shows the findings, gravest first.
pub(super) fn show(ui: &mut Ui, open: &OpenFace) {
    let p = theme::palette(ui.visuals());
    match &open.report {
        Some((revision, report)) => {
            let (failed, warned) = report.findings.iter().fold((0, 0), |(f, w), finding| match finding.severity {
                Severity::Failed => (f + 1, w),
                Severity::Warning => (f, w + 1),
                Severity::Passed => (f, w),
            });
            let text = match (failed, warned) {
                (0, 0) => "Everything is as it should be.".to_owned(),
                (0, w) => format!("Usable; {w} to heed."),
                (f, _) => format!("{f} faults: results on this face would be wrong."),
            };
            let colour = if failed > 0 {
                ui.visuals().error_fg_color
            } else if warned > 0 {
                p.warn
            } else {
                p.good
            };
            ui.label(RichText::new(text).color(colour).strong());
            if *revision != open.draft.revision() {
                ui.weak("The face has changed; it is checked again.");
            }
            ui.add_space(4.0);
            for severity in [Severity::Failed, Severity::Warning, Severity::Passed] {
                for finding in report.findings.iter().filter(|f| f.severity == severity) {
                    let (sign, colour) = match severity {
                        Severity::Failed => ("×", ui.visuals().error_fg_color),
                        Severity::Warning => ("!", p.warn),
                        Severity::Passed => ("•", p.good),
                    };
                    ui.horizontal_wrapped(|ui| {
                        ui.label(RichText::new(sign).color(colour));
                        ui.label(&finding.what);
                        if !finding.where_.is_empty() {
                            ui.label(RichText::new(&finding.where_).weak().small());
                        }
                    });
                }
            }
        }
        None => _ = ui.weak("The face is being checked…"),
    }
    for (title, notes) in [("When the mesh was read", &open.notes), ("Transfer from the generic face", &open.proposed)]
    {
        if !notes.is_empty() {
            ui.add_space(10.0);
            ui.strong(title);
            for note in notes {
                ui.label(RichText::new(note).weak());
            }
        }
    }
}
