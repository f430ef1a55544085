//! The speed of the chain, stage by stage, on curved sheets of 612 to 10⁶ vertices, beside what it is measured against:
//! the plain edge loop and the time to stream the same bytes from memory.
//!
//! `cargo bench --no-default-features --bench chain` prints a table; add a word to run only the stages whose name holds it.
//! Times are the least and the median of repeated runs on a mesh that is in use (memory touched, caches as they are). On a
//! machine that does something else besides, the least is the one to read.

use std::hint::black_box;
use std::time::{Duration, Instant};

use frontalis::camera::Camera;
use frontalis::customize::{Anchor, CustomizeSettings, LandmarkTarget, customize, nnwa};
use frontalis::face::{FaceModel, FaceParts, Mesh, MeshError};
use frontalis::forces::{Influence, MarkInfluence, SpringRule, Springs, muscle_forces, standard_errors};
use frontalis::pipeline::{Workspace, solve};
use frontalis::project::{Edit, PointId, Project};
use frontalis::skin::StressStrainCurve;
use nalgebra::{Matrix3x2, Point2, Point3, Vector3};

/// Columns and rows of the sheets; the first is the size of the thesis's face.
const SIZES: [(usize, usize); 4] = [(18, 34), (80, 125), (250, 400), (800, 1250)];
const CAMERA: Camera =
    Camera { principal_point_px: Point2::new(518.0, 518.0), z_prp_mm: 1000.0, z_vp_mm: 0.0, px_per_mm: 4.0 };

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
        let scene = Scene::new(columns, rows)?;
        for &threads in &counts {
            let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(threads).build() else { continue };
            pool.install(|| scene.measure(threads, &wants));
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

/// Measures one stage: its name, the bytes it must move (0: not counted), the work.
type Row<'a> = dyn Fn(&str, usize, &mut dyn FnMut()) + 'a;

/// A sheet of 140 × 180 mm bulging like a face, its landmarks, and the same sheet after a motion of some millimetres.
struct Scene {
    mesh: Mesh,
    moved: Vec<Point3<f64>>,
    springs: Springs,
    curve: StressStrainCurve,
}

impl Scene {
    fn new(columns: usize, rows: usize) -> Result<Self, MeshError> {
        let at = |i: usize, n: usize, size: f64| (i as f64 / (n - 1) as f64 - 0.5) * size;
        let positions: Vec<Point3<f64>> = (0..columns * rows)
            .map(|i| {
                let (x, y) = (at(i % columns, columns, 140.0), at(i / columns, rows, 180.0));
                Point3::new(x, y, 20.0 - x * x / 80.0 - y * y / 300.0)
            })
            .collect();
        let mut triangles = Vec::new();
        for r in 0..rows - 1 {
            for c in 0..columns - 1 {
                let i = (r * columns + c) as u32;
                let up = i + columns as u32;
                triangles.extend([[i, i + 1, up + 1], [i, up + 1, up]]);
            }
        }
        let moved = positions
            .iter()
            .map(|p| {
                p + Vector3::new(
                    1.5 * (p.y / 9.0).sin(),
                    4.0 * (p.y / 15.0).sin() * (p.x / 25.0).cos(),
                    0.8 * (p.x / 7.0).sin(),
                )
            })
            .collect();
        let mesh = Mesh::new(positions, triangles)?;
        let springs = Springs::new(&mesh, mesh.positions(), SpringRule::Strip, 1.5);
        Ok(Self { mesh, moved, springs, curve: StressStrainCurve::default() })
    }

    fn measure(&self, threads: usize, wants: &dyn Fn(&str) -> bool) {
        let (n, edges) = (self.mesh.len(), self.springs.edges().len());
        let row = |name: &str, bytes: usize, work: &mut dyn FnMut()| {
            if wants(name) {
                report(name, n, threads, bytes, repeated(work));
            }
        };
        let mut out = Vec::new();

        // Each edge: two ends, 1/l and h w (24 bytes); each vertex: position read, force written.
        let field_bytes = 24 * edges + 48 * n;
        row("field F = -K X", field_bytes, &mut || {
            muscle_forces(&self.springs, &self.curve, black_box(&self.moved), None, &mut out);
        });
        let active = vec![true; n];
        row("field with a mask", field_bytes + n, &mut || {
            muscle_forces(&self.springs, &self.curve, black_box(&self.moved), Some(&active), &mut out);
        });
        if threads == 1 {
            row("field: plain edge loop", field_bytes, &mut || {
                plain_edge_loop(&self.springs, &self.curve, black_box(&self.moved), &mut out);
            });
        }
        // Reads as many bytes as the field reads, and writes as many as it writes.
        let read = vec![1.0_f64; (24 * edges + 24 * n) / 8];
        let mut written = vec![0.0_f64; 3 * n];
        row("field: streaming its bytes", field_bytes, &mut || stream(black_box(&read), &mut written));

        let influence = MarkInfluence {
            weights: Influence::from_rows((0..n as u32).map(|i| [(i, 1.0)])),
            slope_mm_per_px: vec![Matrix3x2::identity() * 0.25; n],
            sigma_px: vec![0.5; n],
            common: None,
        };
        let mut sigma = Vec::new();
        // Blocks of 72 bytes written and read from both ends, springs of a vertex, ends, slopes.
        row("standard errors", (72 * 3 + 24 + 16) * edges + (24 + 48 + 8 + 12 + 8) * n, &mut || {
            standard_errors(&self.springs, &self.curve, black_box(&self.moved), None, &influence, &mut sigma);
        });

        let targets = self.landmarks();
        let anchors: Vec<Anchor> = targets
            .iter()
            .map(|t| {
                let at = self.mesh.positions()[t.vertex as usize];
                Anchor { at, shift: CAMERA.face_from_image(&t.at_in_image, at.z) - at }
            })
            .collect();
        let mut face = self.mesh.positions().to_vec();
        row("NNWA, 32 landmarks", 48 * n, &mut || nnwa::morph(black_box(&mut face), &anchors, 2.0, None));
        row("customize, 32 landmarks", (24 * 8 + 24) * n, &mut || {
            let fit = customize(&self.mesh, black_box(&targets), &CAMERA, &CustomizeSettings::default());
            black_box(fit.is_ok());
        });
        if wants("chain") {
            self.chain_after_a_drag(&row);
        }
    }

    /// 32 landmarks spread over the sheet, marked up to 3 mm from where they are.
    fn landmarks(&self) -> Vec<LandmarkTarget> {
        let n = self.mesh.len() as f64;
        (0..32)
            .map(|k| {
                let vertex = ((f64::from(k) + 0.37 * f64::from(k % 3)) * n / 32.0) as u32;
                let at = self.mesh.positions()[vertex as usize]
                    + Vector3::new(f64::from(k).sin() * 3.0, f64::from(k).cos() * 3.0, 0.0);
                LandmarkTarget { vertex, at_in_image: CAMERA.image_from_face(&at) }
            })
            .collect()
    }

    /// Every vertex marked in the last frame; then one mark is dragged to and fro.
    fn chain_after_a_drag(&self, row: &Row) {
        let n = self.mesh.len();
        let parts = FaceParts { name: "sheet".to_owned(), mirror: vec![None; n], ..FaceParts::default() };
        let Ok(face) = FaceModel::new(self.mesh.clone(), parts) else { return };
        let mut project = Project::default();
        for (v, x) in self.moved.iter().enumerate() {
            let at = CAMERA.image_from_face(x);
            let put = Edit::Put(PointId::FeatureLast(v as u32), [at.x, at.y]);
            if put.apply(&mut project).is_err() {
                return;
            }
        }
        let middle = PointId::FeatureLast(n as u32 / 2);
        let at = CAMERA.image_from_face(&self.moved[n / 2]);
        let mut workspace = Workspace::default();
        let mut step = 0.0;
        row("chain after a dragged point", 0, &mut || {
            step = if step == 0.0 { 0.3 } else { 0.0 };
            let _ = Edit::Put(middle.clone(), [at.x + step, at.y]).apply(&mut project);
            black_box(solve(&project, &face, [1036, 1036], &mut workspace));
        });
    }
}

/// The loop a good programmer writes first: one spring after the other, the table searched.
fn plain_edge_loop(springs: &Springs, curve: &StressStrainCurve, x: &[Point3<f64>], out: &mut Vec<Vector3<f64>>) {
    out.clear();
    out.resize(x.len(), Vector3::zeros());
    for (e, &[a, b]) in springs.edges().iter().enumerate() {
        let d = x[a as usize] - x[b as usize];
        let length = d.norm();
        let f = d * (springs.tension(e, curve, length) / length);
        out[a as usize] += f;
        out[b as usize] -= f;
    }
}

/// Reads everything once and writes everything once, on the threads at hand, in pieces of the same proportion.
fn stream(read: &[f64], written: &mut [f64]) {
    use rayon::prelude::*;
    let pieces = if read.len() < 100_000 { 1 } else { 64 };
    let (r, w) = (read.len().div_ceil(pieces), written.len().div_ceil(pieces));
    let pass = |(read, written): (&[f64], &mut [f64])| {
        pulp::Arch::new().dispatch(|| {
            let mut sums = [0.0; 16];
            for chunk in read.chunks_exact(16) {
                for (s, v) in sums.iter_mut().zip(chunk) {
                    *s += v;
                }
            }
            written.fill(sums.iter().sum());
        });
    };
    if pieces == 1 {
        pass((read, written));
    } else {
        read.par_chunks(r).zip(written.par_chunks_mut(w)).for_each(pass);
    }
}

/// Least and median time of one run, over at least 15 runs and a quarter of a second.
fn repeated(work: &mut dyn FnMut()) -> [Duration; 2] {
    work();
    let first = Instant::now();
    work();
    // Runs too short for the clock are taken by the dozen.
    let batch = (20e-6 / first.elapsed().as_secs_f64().max(1e-9)).clamp(1.0, 1000.0) as u32;
    let (mut times, begin) = (Vec::new(), Instant::now());
    while times.len() < 15 || (begin.elapsed() < Duration::from_millis(250) && times.len() < 2000) {
        let start = Instant::now();
        for _ in 0..batch {
            work();
        }
        times.push(start.elapsed() / batch);
    }
    times.sort_unstable();
    [times[0], times[times.len() / 2]]
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
