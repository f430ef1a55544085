//! The points of the chart of speed against accuracy: medians over seeds of every method and setting, and which of them nobody beats.

use super::table::Run;

/// One method at one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// The method.
    pub method: String,
    /// Its setting.
    pub setting: String,
    /// Marking noise, px.
    pub noise_px: f64,
    /// Number of vertices.
    pub vertices: usize,
    /// Median time of the runs that have one, ms.
    pub time_ms: Option<f64>,
    /// Median error of the runs that ended well.
    pub error: Option<f64>,
    /// Runs.
    pub runs: usize,
    /// Runs that failed.
    pub failed: usize,
    /// The cause of the first seed that failed.
    pub cause: Option<String>,
    /// Whether no other point that ended well is both as fast and as true.
    pub on_front: bool,
}

/// The middle of some values: the mean of the two middle ones where their number is even. The values are put in order.
pub fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    Some(0.5 * (values.get(n.checked_sub(1)? / 2)? + values.get(n / 2)?))
}

/// The points of a part, in the order of the table; those at another noise are points of their own.
pub fn points(runs: &[Run], part: &str) -> Vec<Point> {
    let mut groups: Vec<(&Run, Vec<&Run>)> = Vec::new();
    for run in runs.iter().filter(|r| r.part == part) {
        let same = |g: &&mut (&Run, Vec<&Run>)| {
            let of = g.0;
            (&of.method, &of.setting, of.noise_px, of.vertices)
                == (&run.method, &run.setting, run.noise_px, run.vertices)
        };
        match groups.iter_mut().find(same) {
            Some(group) => group.1.push(run),
            None => groups.push((run, vec![run])),
        }
    }
    let point = |(first, runs): (&Run, Vec<&Run>)| {
        let well = || runs.iter().filter(|r| r.is_ok());
        let first_failed = runs.iter().filter(|r| !r.is_ok()).min_by_key(|r| r.seed);
        Point {
            method: first.method.clone(),
            setting: first.setting.clone(),
            noise_px: first.noise_px,
            vertices: first.vertices,
            time_ms: median(&mut runs.iter().filter_map(|r| r.time_ms).collect::<Vec<_>>()),
            error: median(&mut well().filter_map(|r| r.force_error).collect::<Vec<_>>()),
            runs: runs.len(),
            failed: runs.len() - well().count(),
            cause: first_failed.and_then(|r| r.cause.clone()),
            on_front: false,
        }
    };
    groups.into_iter().map(point).collect()
}

/// Marks the points that no other of these beats or equals in time and error both (Pareto's front). Points with failures are not on it: a
/// method that fails on one seed of ten answers another question.
pub fn mark_front(points: &mut [Point]) {
    let place = |p: &Point| if p.failed == 0 { Some([p.time_ms?, p.error?]) } else { None };
    let places: Vec<Option<[f64; 2]>> = points.iter().map(place).collect();
    for (k, point) in points.iter_mut().enumerate() {
        let beaten = |[t, e]: [f64; 2]| places.iter().flatten().any(|[u, f]| *u <= t && *f <= e && (*u < t || *f < e));
        point.on_front = places[k].is_some_and(|p| !beaten(p));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_the_median_and_the_front_is_what_nobody_beats() {
        let run = |method: &str, seed: u64, ms: f64, error: f64| {
            Run { seed, ..Run::new("s", "p", method, "x=1".into()) }.timed(ms).erring(error)
        };
        let mut runs = vec![run("A", 1, 1.0, 0.3), run("A", 2, 3.0, 0.1), run("A", 3, 2.0, 0.2)];
        runs.extend([run("slow and worse", 1, 9.0, 0.5), run("slow and better", 1, 9.0, 0.01)]);
        runs.extend([run("fails", 1, 0.1, 0.01), run("fails", 2, 0.1, 0.01).failing(Some("no".into()))]);
        let mut points = points(&runs, "p");
        mark_front(&mut points);
        assert_eq!((points[0].time_ms, points[0].error, points[0].runs), (Some(2.0), Some(0.2), 3));
        assert_eq!(points.iter().map(|p| p.on_front).collect::<Vec<_>>(), [true, false, true, false]);
        assert_eq!((points[3].failed, points[3].cause.as_deref()), (1, Some("no")));
        assert_eq!(median(&mut [4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(median(&mut []), None);
    }
}
