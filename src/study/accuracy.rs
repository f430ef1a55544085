//! The study of accuracy: how near every method comes to the truth, and how long it takes.
//!
//! Five questions, each with its own truth: forces from marks (a twin's), motion under muscles (a run of very small steps), muscle laws from forces
//! (fields of known laws), the customised face (people of known proportions), and marks that the program finds (pictures of a twin).

mod forces;
mod forward;
mod marks;
mod others;
mod reading;

use super::kind::Options;
use super::runner::{Case, Plan};
use super::table::Run;

pub use reading::reading;

/// The study's name.
const STUDY: &str = "accuracy";

/// The questions, and what stands above each chart.
const PARTS: [(&str, &str); 11] = [
    ("forces", "Forces from marks: a brow raise that slides on the face"),
    ("forces, rough", "Forces from marks: a rough motion that no smoothness was made for"),
    (
        "forces, membrane",
        "Forces from marks: foreheads of a membrane on a finer mesh, pulled by muscles in four expressions",
    ),
    (
        "forces, elsewhere",
        "Forces from marks: the same foreheads, pulled by muscles one vertex from where the face has them",
    ),
    ("forces, spread", "Forces from marks: the same foreheads, pulled by muscles of the thesis's law in another shape"),
    (
        "forces, whole face",
        "Forces from marks: whole faces in the same expressions, surprise and fear with an open jaw",
    ),
    (
        "forces, whole face elsewhere",
        "Forces from marks: the same whole faces, pulled by muscles one vertex from where the face has them",
    ),
    ("forward", "Motion under one muscle for a thirtieth of a second, against steps of 0.04 ms"),
    ("laws", "The thesis's law fitted to its own field, from starts within a factor 3"),
    ("face", "The customised face: lengths of its edges against those of the person"),
    ("marks", "Marks found by the program, a point: median distance from the truth over how far the skin moves"),
];

/// The cases.
pub fn plan(options: &Options) -> Plan {
    let seeds = options.seeds(7, 2);
    let mut cases = forces::cases(options, seeds);
    cases.extend(forward::cases(options));
    cases.extend(others::cases(options, seeds));
    cases.extend(marks::cases(options, seeds));
    Plan { study: STUDY.to_owned(), question: options.words(seeds), cases }
}

/// What stands above the chart of a part.
pub fn title(part: &str) -> &str {
    PARTS.iter().find(|p| p.0 == part).map_or(part, |p| p.1)
}

/// What an error of forces is called.
pub const FORCE_ERROR: &str = "relative force error";

/// What the errors of a part are of, on the axis of its chart.
pub fn error_words(part: &str) -> &'static str {
    match part {
        "forward" | "face" | "marks" => "relative error",
        _ => FORCE_ERROR,
    }
}

/// A row of the study.
fn run(part: usize, method: &str, setting: &str) -> Run {
    Run::new(STUDY, PARTS[part].0, method, setting.to_owned())
}

/// A case whose times count, with the name of its cell.
fn case(part: usize, method: &str, setting: &str, work: impl Fn() -> Vec<Run> + Send + Sync + 'static) -> Case {
    Case::timed(format!("{} · {method} · {setting}", PARTS[part].0), work)
}

#[cfg(test)]
mod tests {
    use super::super::journal::Journal;
    use super::*;

    /// The rows of some cases of the quick study.
    fn rows(only: impl Fn(&str) -> bool) -> Vec<Run> {
        let options = Options { quick: true, ..Options::on(crate::face::generic()) };
        let mut plan = plan(&options);
        plan.cases.retain(|c| only(&c.key));
        plan.run(&mut Journal::in_memory(), 1, &|| false, &mut |_, _| {}).unwrap().unwrap()
    }

    fn error(rows: &[Run], method: &str, setting: &str, noise: f64) -> f64 {
        let of = |r: &&Run| r.method == method && r.setting.contains(setting) && r.noise_px == noise;
        let mut errors: Vec<f64> = rows.iter().filter(of).filter_map(|r| r.force_error).collect();
        super::super::points::median(&mut errors).unwrap()
    }

    #[test]
    fn without_noise_the_direct_way_is_exact_and_with_it_the_regularised_one_is_nearer() {
        let rows = rows(|key| key.starts_with("forces ·") && key.contains("as the scene") && !key.contains("Muscles"));
        assert!(error(&rows, "Direct", "as the scene", 0.0) < 1e-6);
        let [direct, smooth] = ["Direct", "Regularised, discrepancy"].map(|m| error(&rows, m, "as the scene", 1.0));
        assert!(smooth < 0.6 * direct && smooth > 0.05, "{direct} {smooth}");
    }

    /// Muscles one vertex from where the face has them: alone they do not find the field, nor know it; what they leave makes up for it.
    #[test]
    fn what_the_muscles_leave_counts_most_where_they_are_not_where_the_face_has_them() {
        let rows = rows(|key| key.starts_with("forces, elsewhere · Muscles") && key.ends_with("· 0.3 px"));
        let [both, alone] = ["Muscles, all", "Muscles alone, all"].map(|m| error(&rows, m, "membrane", 0.3));
        assert!(both < 0.7 * alone, "{both} {alone}");
        let covered = |method: &str| {
            let of = rows.iter().filter(|r| r.method == method);
            let mut covered: Vec<f64> = of.filter_map(|r| r.measures.get("covered_percent").copied()).collect();
            super::super::points::median(&mut covered).unwrap()
        };
        assert!(covered("Muscles, all") > 85.0 && covered("Muscles alone, all") < 60.0);
    }

    /// The same marks on triangles cut into four: another discretisation of the same skin gives other forces, on the same vertices and as good.
    #[test]
    fn a_finer_mesh_is_asked_with_the_same_marks() {
        let rows = rows(|key| {
            key.starts_with("forces, membrane · Regularised, discrepancy · skin=membrane") && key.ends_with("· 1 px")
        });
        let [own, finer] = [false, true].map(|finer| {
            let of = rows.iter().find(|r| r.setting.contains("mesh=finer") == finer && r.seed == 1).unwrap();
            (of.vertices, of.force_error.unwrap())
        });
        // 612 vertices and an edge's middle each: 612 + 1742.
        assert_eq!((own.0, finer.0), (612, 2354));
        assert!(own.1 != finer.1 && (own.1 - finer.1).abs() < 0.5 * own.1, "{own:?} {finer:?}");
    }

    #[test]
    fn marks_are_nearest_where_lines_are_painted_and_a_point_follows_its_skin() {
        let rows = rows(|key| key.starts_with("marks ·"));
        let of = |method: &str, setting: &str| error(&rows, method, setting, 0.0);
        let tracked = of("tracked, on crossings", "painted");
        assert!(tracked < 0.006, "{tracked}");
        for mm in [2, 3, 5, 7, 10] {
            let [painted, bare] = ["painted", "none"].map(|grid| of(&format!("template {mm} mm"), grid));
            assert!(tracked < painted && tracked < bare, "{mm} mm: {painted} {bare}");
        }
        let [vertices, smallest] = ["tracked, vertices", "template 2 mm"].map(|m| of(m, "none"));
        assert!(vertices < smallest, "{vertices} {smallest}");
        assert!(rows.iter().all(|r| r.is_ok() && r.measures["points"] > 100.0));
    }

    #[test]
    fn small_steps_come_nearer_and_a_method_beyond_its_limit_fails() {
        let rows = rows(|key| key.starts_with("forward ·"));
        let of = |method: &str, step: &str| {
            let row = rows.iter().find(|r| r.method == method && r.setting == format!("step_ms={step}")).unwrap();
            row.force_error.filter(|_| row.is_ok())
        };
        // A method of first order is up to ten times nearer with a tenth of the step: less where the step is longer than the quickest motion.
        let [coarse, fine] = ["1", "0.1"].map(|s| of("Implicit Euler", s).unwrap());
        assert!((3.0..14.0).contains(&(coarse / fine)), "{coarse} {fine}");
        assert!(of("Explicit Euler", "10").is_none());
    }

    #[test]
    fn the_same_seed_gives_the_same_table_but_for_times() {
        let some = || {
            rows(|key| key.starts_with("forces ·") && key.contains("as the scene · 0.3"))
                .into_iter()
                .map(Run::without_times)
        };
        assert!(some().eq(some()));
    }

    #[test]
    fn the_reading_names_the_best_way_and_its_error() {
        let rows = rows(|key| key.starts_with("forces ·") && key.contains("as the scene · 1"));
        let text = reading(&rows);
        assert!(text.contains("Regularised") && text.contains('%'), "{text}");
    }
}
