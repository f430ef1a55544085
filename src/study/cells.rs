//! The cells of a map: what share of the seeds ended well at each pair of settings, and what failed first.

use super::table::{Run, pairs};

/// One method's map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// The question.
    pub part: String,
    /// The method; empty where the methods are the rows.
    pub method: String,
    /// Name of what lies along it, with unit: "step_ms".
    pub along: String,
    /// Name of what lies up it; "method" where those are the rows.
    pub up: String,
    /// The values along, in ascending order.
    pub columns: Vec<f64>,
    /// The rows, from below.
    pub rows: Vec<String>,
    /// The cells, row by row from below; none where nothing was run.
    pub cells: Vec<Option<Cell>>,
}

/// One cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    /// Its method.
    pub method: String,
    /// Its setting.
    pub setting: String,
    /// Runs.
    pub runs: usize,
    /// Runs that ended well.
    pub well: usize,
    /// The cause of the first seed that failed.
    pub cause: Option<String>,
    /// Median error of those that have one.
    pub error: Option<f64>,
    /// Where theory ends along the map, in its unit.
    pub limit: Option<f64>,
}

impl Map {
    /// The cell in a column and a row.
    pub fn cell(&self, column: usize, row: usize) -> Option<&Cell> {
        self.cells.get(row * self.columns.len() + column)?.as_ref()
    }
}

impl Cell {
    /// Share of the seeds that ended well.
    pub fn share(&self) -> f64 {
        self.well as f64 / self.runs.max(1) as f64
    }
}

/// The maps of a part, in the order of the table. Runs with two settings make one map a method; runs with one make a single map whose rows
/// are the methods.
pub fn maps(runs: &[Run], part: &str) -> Vec<Map> {
    let mut maps: Vec<Map> = Vec::new();
    let own: Vec<&Run> = runs.iter().filter(|r| r.part == part).collect();
    for run in &own {
        let Some((along, x, up, row)) = place(run) else { continue };
        let method = if up == "method" { "" } else { run.method.as_str() };
        let at = maps.iter().position(|m| m.method == method).unwrap_or_else(|| {
            let head = Map {
                part: part.to_owned(),
                method: method.to_owned(),
                along: along.to_owned(),
                up: up.to_owned(),
                ..Map::default()
            };
            maps.push(head);
            maps.len() - 1
        });
        let map = &mut maps[at];
        if !map.columns.contains(&x) {
            map.columns.push(x);
        }
        if !map.rows.contains(&row) {
            map.rows.push(row);
        }
    }
    for map in &mut maps {
        map.columns.sort_by(f64::total_cmp);
        if map.up == "method" {
            // The first method on top.
            map.rows.reverse();
        } else {
            map.rows.sort_by(|a, b| a.parse().unwrap_or(f64::NAN).total_cmp(&b.parse().unwrap_or(f64::NAN)));
        }
        map.cells = vec![None; map.columns.len() * map.rows.len()];
    }
    for map in &mut maps {
        let mut gathered: Vec<Vec<&Run>> = vec![Vec::new(); map.cells.len()];
        for run in own.iter().filter(|r| map.method.is_empty() || r.method == map.method) {
            let Some((_, x, _, row)) = place(run) else { continue };
            let found = map.columns.iter().position(|c| *c == x).zip(map.rows.iter().position(|r| *r == row));
            if let Some((column, row)) = found {
                gathered[row * map.columns.len() + column].push(run);
            }
        }
        let limit = format!("limit_{}", map.along.rsplit('_').next().unwrap_or_default());
        map.cells = gathered.iter().map(|runs| cell(runs, &limit)).collect();
    }
    maps
}

/// Name and value along, name of what lies up, and the row.
fn place(run: &Run) -> Option<(&str, f64, &str, String)> {
    match pairs(&run.setting)[..] {
        [(along, x)] => Some((along, x.parse().ok()?, "method", run.method.clone())),
        [(along, x), (up, y), ..] => Some((along, x.parse().ok()?, up, y.to_owned())),
        _ => None,
    }
}

fn cell(runs: &[&Run], limit: &str) -> Option<Cell> {
    let first = runs.first()?;
    let mut errors: Vec<f64> = runs.iter().filter_map(|r| r.force_error).collect();
    let seeds_first = runs.iter().filter(|r| !r.is_ok()).min_by_key(|r| r.seed);
    Some(Cell {
        method: first.method.clone(),
        setting: first.setting.clone(),
        runs: runs.len(),
        well: runs.iter().filter(|r| r.is_ok()).count(),
        cause: seeds_first.and_then(|r| r.cause.clone()),
        error: super::points::median(&mut errors),
        limit: first.measures.get(limit).copied(),
    })
}

/// The causes of all maps, by name: the legend. The letter of a cause is that of its place.
pub fn causes(maps: &[Map]) -> Vec<&str> {
    let mut found: Vec<&str> = Vec::new();
    for cause in maps.iter().flat_map(|m| &m.cells).flatten().filter_map(|c| c.cause.as_deref()) {
        if !found.contains(&cause) {
            found.push(cause);
        }
    }
    found.sort_unstable();
    found
}

/// The letter of a cause in a legend: A, B, … Z, then numbers.
pub fn letter(place: usize) -> String {
    u8::try_from(place).ok().filter(|p| *p < 26).map_or_else(|| place.to_string(), |p| char::from(b'A' + p).to_string())
}

/// Where a value lies among the columns, in columns: between two of them by the logarithm where all are positive. None beyond their ends by more
/// than half a column.
pub fn among(columns: &[f64], value: f64) -> Option<f64> {
    let along = |v: f64| if columns.iter().all(|c| *c > 0.0) { v.max(1e-300).ln() } else { v };
    let n = columns.len();
    let (first, last) = (*columns.first()?, *columns.last()?);
    let steps: Vec<f64> = columns.windows(2).map(|w| along(w[1]) - along(w[0])).collect();
    let place = if value < first {
        (along(value) - along(first)) / steps.first()?
    } else if value >= last {
        (n - 1) as f64 + (along(value) - along(last)) / steps.last()?
    } else {
        let k = columns.windows(2).position(|w| value >= w[0] && value < w[1])?;
        k as f64 + (along(value) - along(columns[k])) / steps[k]
    };
    (place > -0.5 && place < n as f64 - 0.5).then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::table::setting;

    fn run(method: &str, at: &[(&str, f64)], seed: u64, cause: Option<&str>) -> Run {
        let run = Run { seed, cause: cause.map(str::to_owned), ..Run::new("s", "p", method, setting(at)) };
        run.with("limit_ms", 2.0)
    }

    #[test]
    fn two_settings_make_a_map_a_method_with_the_first_seed_s_cause() {
        let at = |x: f64, y: f64| [("step_ms", x), ("stiffness", y)];
        let runs = [
            run("A", &at(10.0, 100.0), 2, Some("late")),
            run("A", &at(10.0, 100.0), 1, Some("early")),
            run("A", &at(10.0, 100.0), 3, None),
            run("A", &at(1.0, 9.0), 1, None),
            run("B", &at(1.0, 9.0), 1, None),
        ];
        let maps = maps(&runs, "p");
        assert_eq!(maps.len(), 2);
        assert_eq!(
            (maps[0].columns.as_slice(), maps[0].rows.as_slice()),
            (&[1.0, 10.0][..], &["9".into(), "100".into()][..])
        );
        let cell = maps[0].cell(1, 1).unwrap();
        assert_eq!((cell.runs, cell.well, cell.cause.as_deref(), cell.limit), (3, 1, Some("early"), Some(2.0)));
        assert!((cell.share() - 1.0 / 3.0).abs() < 1e-12);
        assert!(maps[0].cell(1, 0).is_none() && maps[0].cell(0, 0).unwrap().cause.is_none());
        assert_eq!(causes(&maps), ["early"]);
    }

    /// By hand: √10 lies in the middle between 1 and 10 on a logarithmic axis, 2.5 in the middle between 0 and 5 on a plain one.
    #[test]
    fn a_limit_lies_among_the_columns() {
        assert!((among(&[1.0, 10.0, 100.0], 10.0_f64.sqrt()).unwrap() - 0.5).abs() < 1e-12);
        assert_eq!(among(&[0.0, 5.0], 2.5), Some(0.5));
        assert_eq!((among(&[1.0, 10.0], 0.2), among(&[1.0, 10.0], 1e4), among(&[1.0], 1.0)), (None, None, None));
        assert_eq!((letter(2), letter(30)), ("C".into(), "30".into()));
    }

    #[test]
    fn one_setting_makes_one_map_with_a_row_a_method() {
        let runs = [run("A", &[("x_mm", 5.0)], 1, None), run("B", &[("x_mm", 5.0)], 1, Some("no"))];
        let maps = maps(&runs, "p");
        assert_eq!(maps.len(), 1);
        assert_eq!(maps[0].rows, ["B", "A"]);
        assert_eq!(maps[0].cell(0, 0).unwrap().cause.as_deref(), Some("no"));
    }
}
