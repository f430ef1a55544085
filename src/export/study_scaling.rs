//! The chart of the study of scaling: time a vertex against the size of the mesh, and time over that of streaming the same bytes.

use crate::draw::line_chart::{Axis, COLOURS, HEADING, LineChart, Series, Style, Value, sheet};
use crate::study::Run;
use crate::study::scaling::STAGES;

/// Two charts on a sheet.
pub fn svg(heading: &str, runs: &[Run], caption: &str) -> String {
    let mut methods: Vec<&str> = Vec::new();
    for run in runs.iter().filter(|r| r.part == STAGES) {
        if !methods.contains(&run.method.as_str()) {
            methods.push(&run.method);
        }
    }
    let series = |value: &dyn Fn(&Run) -> Option<f64>| -> Vec<Series> {
        let of = |(k, method): (usize, &&str)| {
            let own = runs.iter().filter(|r| r.part == STAGES && r.method == *method);
            let values: Vec<Value> = own.filter_map(|r| Some(Value::at(r.vertices as f64, value(r)?))).collect();
            // Twelve stages and seven colours: the second round is broken.
            let style = if k < COLOURS.len() { Style::LineAndPoints } else { Style::Dashed };
            let name = (*method).to_owned();
            Series { name, colour: COLOURS[k % COLOURS.len()].to_owned(), style, values }
        };
        methods.iter().enumerate().map(of).filter(|s| !s.values.is_empty()).collect()
    };
    let per_vertex = LineChart {
        title: "Time a vertex, one thread".into(),
        x: Axis::logarithmic("vertices"),
        y: Axis::logarithmic("ns a vertex"),
        series: series(&|r| Some(1e6 * r.time_ms? / r.vertices.max(1) as f64)),
        ..LineChart::default()
    };
    let over = LineChart {
        title: "Time over that of streaming the same bytes".into(),
        x: Axis::logarithmic("vertices"),
        y: Axis::logarithmic("times"),
        series: series(&|r| Some(r.time_ms? / r.measures.get("stream_ms").filter(|s| **s > 0.0)?)),
        y_marks: vec![(2.0, "twice".into())],
        ..LineChart::default()
    };
    sheet(
        [1120.0, HEADING + 640.0],
        heading,
        caption,
        &[per_vertex.draw([0.0, HEADING, 560.0, 630.0]), over.draw([560.0, HEADING, 560.0, 630.0])],
    )
}
