//! The speed of the chain, stage by stage, on curved sheets of 612 to 10⁶ vertices, beside what it is measured against:
//! the plain edge loop and the time to stream the same bytes from memory.
//!
//! `cargo bench --no-default-features --bench chain` prints a table; add a word to run only the stages whose name holds it. The same stages on one
//! thread, with memory and a chart, are `frontalis study scaling`.
//! Times are the least and the median of repeated runs on a mesh that is in use (memory touched, caches as they are). On a
//! machine that does something else besides, the least is the one to read.

use std::hint::black_box;
use std::time::Duration;

use frontalis::face::MeshError;
use frontalis::study::scaling::SIZES;
use frontalis::study::scaling::stages::{Sheet, Stage};
use frontalis::study::scaling::timing::{repeated, stream};

/// Stages of the chain; the forward model has a benchmark of its own.
const STAGES: [Stage; 7] =
    [Stage::Field, Stage::FieldWithMask, Stage::PlainLoop, Stage::Errors, Stage::Nnwa, Stage::Customize, Stage::Chain];

fn main() -> Result<(), MeshError> {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let wants = |name: &str| wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str()));
    let cores = rayon::current_num_threads();
    println!("{cores} threads; {}", widest());
    println!(
        "{:<30}{:>9}{:>8}{:>12}{:>12}{:>11}{:>10}{:>7}",
        "stage", "vertices", "threads", "least", "median", "ns/vertex", "MB moved", "GB/s"
    );
    let mut counts = vec![1, cores];
    counts.dedup();
    for (columns, rows) in SIZES {
        let sheet = Sheet::new(columns, rows)?;
        for &threads in &counts {
            let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { continue };
            pool.install(|| measure(&sheet, threads, &wants));
        }
    }
    Ok(())
}

/// What the wide loops compile to here.
fn widest() -> &'static str {
    match pulp::Arch::new() {
        pulp::Arch::Scalar => "no wide registers",
        _ => "wide registers (AVX2 and FMA on x86-64)",
    }
}

fn measure(sheet: &Sheet, threads: usize, wants: &dyn Fn(&str) -> bool) {
    let n = sheet.vertices();
    for stage in STAGES.into_iter().filter(|s| wants(s.name())) {
        // The plain loop knows one thread.
        if stage == Stage::PlainLoop && threads > 1 {
            continue;
        }
        let done = sheet.run(stage, &mut |bytes, work| report(stage.name(), n, threads, bytes, repeated(work)));
        if let Err(why) = done {
            println!("{:<30}{n:>9}{threads:>8}  {why}", stage.name());
        }
    }
    let name = "field: streaming its bytes";
    if wants(name) {
        // Reads as many bytes as the field reads, and writes as many as it writes.
        let bytes = sheet.field_bytes();
        let read = vec![1.0_f64; (bytes - 24 * n) / 8];
        let mut written = vec![0.0_f64; 3 * n];
        report(name, n, threads, bytes, repeated(&mut || stream(black_box(&read), &mut written)));
    }
}

fn report(name: &str, n: usize, threads: usize, bytes: usize, [least, median]: [Duration; 2]) {
    let shown = |t: Duration| {
        let seconds = t.as_secs_f64();
        if seconds < 1e-3 { format!("{:.2} µs", seconds * 1e6) } else { format!("{:.3} ms", seconds * 1e3) }
    };
    let per_vertex = least.as_secs_f64() * 1e9 / n as f64;
    print!("{name:<30}{n:>9}{threads:>8}{:>12}{:>12}{per_vertex:>11.2}", shown(least), shown(median));
    if bytes > 0 {
        print!("{:>10.2}{:>7.1}", bytes as f64 / 1e6, bytes as f64 / least.as_secs_f64() / 1e9);
    }
    println!();
}
