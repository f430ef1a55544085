//! Time of the forward model: the static equilibrium and a second of motion by every method, how both grow with the mesh, and where
//! each method stops being stable.
//!
//! `cargo bench --no-default-features --bench simulate` prints the times and how they grow.
//! `cargo bench --no-default-features --bench simulate -- 1000 DIR` also steps the default method from a thousand random starts, looks for
//! every method's longest stable step over three skins, and writes `simulate.csv`, `simulate.svg`, `simulate.png` and `simulate.md`.

use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

use frontalis::draw::line_chart::{Axis, COLOURS, HEADING, LineChart, Series, Style, Value, sheet};
use frontalis::draw::svg;
use frontalis::expression::{Basic, Expression, Setup, Stage};
use frontalis::face::{self, FaceModel, Mesh};
use frontalis::muscle::{Fibre, LawKind, MuscleLaw};
use frontalis::simulate::{EquilibriumSolver, Hold, Method, Stepper, System, SystemOptions, rim};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

type Anything = Result<(), Box<dyn std::error::Error>>;

/// Sum of the lengths of one muscle's forces, N.
const STRENGTH_N: f64 = 1.0;
/// Shorter steps are not tried, s.
const LEAST_STEP_S: f64 = 3e-6;

fn main() -> Anything {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let generic = face::generic();
    times(&generic)?;
    growth()?;
    match asked.as_slice() {
        [starts, folder] => trials(&generic, starts.parse()?, Path::new(folder)),
        _ => Ok(()),
    }
}

/// The pull of each muscle of a face whose name begins so, within the skin, N on every vertex.
fn pulls(face: &FaceModel, start: &str) -> Result<Vec<Vec<Vector3<f64>>>, Box<dyn std::error::Error>> {
    let (mesh, x) = (face.mesh(), face.mesh().positions());
    let normals = mesh.vertex_normals(x);
    let law = MuscleLaw::default_of(LawKind::Anatomical);
    let mut all = Vec::new();
    for muscle in face.muscles().iter().filter(|m| m.id.starts_with(start)) {
        let fibre = Fibre::of(muscle, x, &normals)?;
        let within = |(p, n): (&Point3<f64>, &Vector3<f64>)| {
            let f = law.force(&fibre, p);
            f - n * n.dot(&f)
        };
        let pull: Vec<Vector3<f64>> = x.iter().zip(&normals).map(within).collect();
        let sum: f64 = pull.iter().map(Vector3::norm).sum();
        all.push(pull.into_iter().map(|f| f * (STRENGTH_N / sum)).collect());
    }
    Ok(all)
}

fn summed(pulls: &[Vec<Vector3<f64>>], activation: impl Fn(usize) -> f64) -> Vec<Vector3<f64>> {
    let mut loads = vec![Vector3::zeros(); pulls.first().map_or(0, Vec::len)];
    for (k, pull) in pulls.iter().enumerate() {
        for (load, f) in loads.iter_mut().zip(pull) {
            *load += f * activation(k);
        }
    }
    loads
}

fn brow_raise(face: &FaceModel, options: SystemOptions) -> Result<System, Box<dyn std::error::Error>> {
    let (mesh, x) = (face.mesh(), face.mesh().positions());
    let mut system = System::new(mesh, x, &rim(mesh, x), None, options)?;
    system.set_loads(summed(&pulls(face, "frontalis")?, |_| 1.0))?;
    Ok(system)
}

/// Steps a system for a while; whether every step was done.
fn run(system: &System, method: Method, step_s: f64, seconds: f64) -> bool {
    let mut state = system.at_rest();
    let mut stepper = Stepper::new(method);
    let steps = (seconds / step_s).round() as usize;
    (0..steps).all(|_| stepper.step(system, &mut state, step_s).is_ok())
}

/// The longest step from a second downwards, each time three quarters as long, at which a tenth of a second (at least 20 steps) is done; none above `least`.
fn longest_step(system: &System, method: Method, least: f64) -> Option<f64> {
    let mut step = 1.0;
    while step > least {
        if run(system, method, step, (20.0 * step).max(0.1)) {
            return Some(step);
        }
        step *= 0.75;
    }
    None
}

fn least_and_median(mut work: impl FnMut(), times: usize) -> (f64, f64) {
    let mut spent: Vec<f64> = (0..times)
        .map(|_| {
            let start = Instant::now();
            work();
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    spent.sort_by(f64::total_cmp);
    (spent[0], spent[times / 2])
}

fn times(face: &FaceModel) -> Anything {
    let system = brow_raise(face, SystemOptions::default())?;
    let mut solver = EquilibriumSolver::new(&system)?;
    println!("612 vertices, one core, four muscles of {STRENGTH_N} N on the brows; ms");
    println!("{:<44} least     median", "");
    let x = system.rest().to_vec();
    let (least, median) = least_and_median(|| drop(solver.solve(&system, &x)), 100);
    println!("{:<44} {least:<9.2} {median:.2}", "static equilibrium from rest");
    let found = solver.solve(&system, &x);
    println!("  {} Newton steps, {} N left, {}", found.iterations, found.residual_n, found.ended.label());
    let mut nearly = system.clone();
    nearly.set_loads(system.loads().iter().map(|f| f * 1.05).collect())?;
    let (least, median) = least_and_median(|| drop(solver.solve(&nearly, &found.positions)), 100);
    println!("{:<44} {least:<9.2} {median:.2}", "the same after 5 % more activation");
    for method in Method::ALL {
        let step_s = match method.limit_s(&system) {
            None => 1.0 / 60.0,
            Some(_) => longest_step(&system, method, LEAST_STEP_S).unwrap_or(LEAST_STEP_S),
        };
        let repeats = if step_s > 1e-3 { 9 } else { 1 };
        let (least, median) = least_and_median(|| _ = run(&system, method, step_s, 1.0), repeats);
        let name = format!("one second by {}, {:.3} ms", method.label(), 1e3 * step_s);
        println!("{name:<44} {least:<9.2} {median:.2}");
    }
    Ok(())
}

/// A dome as large as a forehead, of about `vertices`, pulled along y.
fn dome(vertices: usize) -> Result<System, Box<dyn std::error::Error>> {
    let side = (vertices as f64).sqrt().round() as usize;
    let pitch = 180.0 / side as f64;
    let at = |k: usize| {
        let (u, v) = ((k % side) as f64 * pitch - 90.0, (k / side) as f64 * pitch - 90.0);
        Point3::new(u, v, 30.0 - (u * u + v * v) / 270.0)
    };
    let corner = |c: usize, r: usize| (r * side + c) as u32;
    let triangles = (0..(side - 1) * (side - 1)).flat_map(|k| {
        let (c, r) = (k % (side - 1), k / (side - 1));
        let [a, b, d, e] = [corner(c, r), corner(c + 1, r), corner(c, r + 1), corner(c + 1, r + 1)];
        [[a, b, e], [a, e, d]]
    });
    let mesh = Mesh::new((0..side * side).map(at).collect(), triangles.collect())?;
    let x = mesh.positions();
    let areas = mesh.vertex_areas(x);
    let mut system = System::new(&mesh, x, &mesh.on_border(), None, SystemOptions::default())?;
    let pull =
        |(p, area): (&Point3<f64>, &f64)| Vector3::y() * (4e-4 * area * (-(p.x * p.x + p.y * p.y) / 1500.0).exp());
    system.set_loads(x.iter().zip(&areas).map(pull).collect())?;
    Ok(system)
}

fn growth() -> Anything {
    println!("\nvertices  equilibrium, ms  Newton steps  implicit Euler, ms a step  vertex block descent, ms a step");
    for vertices in [612, 2500, 10_000, 100_000] {
        let system = dome(vertices)?;
        let mut solver = EquilibriumSolver::new(&system)?;
        let repeats = if vertices > 20_000 { 1 } else { 5 };
        let x = system.rest().to_vec();
        let mut steps = 0;
        let (least, _) = least_and_median(|| steps = solver.solve(&system, &x).iterations, repeats);
        let step = |method: Method| {
            let mut state = system.at_rest();
            let mut stepper = Stepper::new(method);
            least_and_median(|| drop(stepper.step(&system, &mut state, 1.0 / 60.0)), repeats.max(3)).1
        };
        let (implicit, descent) = (step(Method::ImplicitEuler), step(Method::VertexBlockDescent));
        println!("{:<9} {least:<16.2} {steps:<13} {implicit:<26.2} {descent:.2}", system.len());
    }
    Ok(())
}

/// What became of random starts.
#[derive(Default)]
struct Tally {
    failed: usize,
    gained: usize,
    folded: usize,
    unfolded: usize,
    still_folded: usize,
}

/// Places thrown about, pressed together to 30 %, or mirrored, with random velocities, stiffness from 0.01 to 100 and steps up to 33 ms;
/// by turns under random ones of the face's muscles and under one of the six expressions with its jaw, at up to 200 %.
fn random_starts(face: &FaceModel, starts: u64) -> Result<Tally, Box<dyn std::error::Error>> {
    let pulls = pulls(face, "")?;
    let (mesh, rest) = (face.mesh(), face.mesh().positions());
    let fixed = rim(mesh, rest);
    let mut tally = Tally::default();
    for seed in 0..starts {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut number = move || random.random::<f64>();
        let stiffness = 10_f64.powf(4.0 * number() - 2.0);
        let step_s = 0.033 * number().max(0.01);
        let system = if seed % 2 == 0 {
            let options = SystemOptions { stiffness, ..SystemOptions::default() };
            let mut system = System::new(mesh, rest, &fixed, None, options)?;
            let random: Vec<f64> = pulls.iter().map(|_| if number() < 0.4 { 2.0 * number() } else { 0.0 }).collect();
            system.set_loads(summed(&pulls, |k| random[k]))?;
            system
        } else {
            let Stage { mut system, actuators } = Stage::new(face, rest, &Setup { stiffness, ..Setup::default() })?;
            let basic = Basic::ALL[seed as usize / 2 % Basic::ALL.len()];
            let expression = Expression::basic(basic, &actuators).times(2.0 * number());
            system.open_jaw(expression.jaw_deg.to_radians());
            system.set_loads(actuators.loads(&expression).newton)?;
            system
        };
        let mut state = system.at_rest();
        let middle = Point3::new(0.0, -20.0, 0.0);
        for (x, v) in state.positions.iter_mut().zip(&mut state.velocities) {
            match seed % 3 {
                0 => *x += Vector3::new(number() - 0.5, number() - 0.5, number() - 0.5) * 20.0 * number(),
                1 => *x = middle + (*x - middle) * 0.3,
                _ => x.x = -x.x,
            }
            *v = Vector3::new(number() - 0.5, number() - 0.5, 0.0) * 200.0;
        }
        system.settle(&mut state);
        let folds = |x: &[Point3<f64>]| system.doubled_areas(x).iter().any(|a| *a < 0.0);
        let before = folds(&state.positions);
        let mut energy = system.energy(&state).total();
        let slack = 1e-6 * energy.abs().max(1.0);
        let mut stepper = Stepper::new(Method::default());
        for step in 0..60 {
            if let Err(failure) = stepper.step(&system, &mut state, step_s) {
                println!("seed {seed}: {failure}");
                tally.failed += 1;
                break;
            }
            let now = system.energy(&state).total();
            if now > energy + slack {
                tally.gained += 1;
                println!(
                    "seed {seed}: stiffness {stiffness:.4}, steps of {:.2} ms: step {step} gained {:.2e} of {:.2e} mJ",
                    1e3 * step_s,
                    now - energy,
                    energy.abs()
                );
            }
            energy = now;
        }
        let after = folds(&state.positions);
        tally.folded += usize::from(before);
        tally.unfolded += usize::from(before && !after);
        tally.still_folded += usize::from(after);
    }
    Ok(tally)
}

fn trials(face: &FaceModel, starts: u64, folder: &Path) -> Anything {
    std::fs::create_dir_all(folder)?;
    let mut csv = "method,hold,stiffness,longest_stable_step_ms,limit_for_small_motions_ms\n".to_owned();
    let mut series = Vec::new();
    let stiffnesses = [0.01, 0.1, 1.0, 10.0, 100.0];
    for (m, method) in Method::ALL.into_iter().enumerate() {
        let mut values = Vec::new();
        for stiffness in stiffnesses {
            let system = brow_raise(face, SystemOptions { stiffness, ..SystemOptions::default() })?;
            let longest = longest_step(&system, method, LEAST_STEP_S);
            let ms = |s: Option<f64>| s.map_or_else(String::new, |s| format!("{:.4}", 1e3 * s));
            let _ =
                writeln!(csv, "{},skull,{stiffness},{},{}", method.name(), ms(longest), ms(method.limit_s(&system)));
            println!("{} at stiffness {stiffness}: {} ms", method.label(), ms(longest));
            values.extend(longest.map(|s| Value::at(stiffness, 1e3 * s)));
        }
        series.push(Series {
            name: method.label().to_owned(),
            colour: COLOURS[m % COLOURS.len()].to_owned(),
            style: Style::LineAndPoints,
            values,
        });
    }
    for hold in [Hold::ANCHORS, Hold::Bare] {
        let system = brow_raise(face, SystemOptions { hold, ..SystemOptions::default() })?;
        for method in Method::ALL {
            let longest =
                longest_step(&system, method, LEAST_STEP_S).map_or_else(String::new, |s| format!("{:.4}", 1e3 * s));
            let limit = method.limit_s(&system).map_or_else(String::new, |s| format!("{:.4}", 1e3 * s));
            let name = if hold == Hold::Bare { "bare" } else { "anchors" };
            let _ = writeln!(csv, "{},{name},1,{longest},{limit}", method.name());
        }
    }
    let chart = LineChart {
        title: "Longest step that a brow raise survives".into(),
        x: Axis::logarithmic("stiffness of the skin, times the default"),
        y: Axis::logarithmic("time step, ms"),
        series,
        ..LineChart::default()
    };
    let drawing = sheet(
        [900.0, HEADING + 480.0],
        "Where each method stops being stable",
        "612 vertices over a skull, four muscles of 1 N; one second is the longest step tried",
        &[chart.draw([0.0, HEADING, 900.0, 470.0])],
    );
    svg::paint(&drawing, 1.0)?.save(folder.join("simulate.png"))?;
    std::fs::write(folder.join("simulate.svg"), drawing)?;
    std::fs::write(folder.join("simulate.csv"), csv)?;
    let tally = random_starts(face, starts)?;
    let text = format!(
        "{starts} random starts of {}: {} failed, {} steps gained energy; {} began folded, of which {} unfolded within 60 steps, and {} are \
         folded then.\n",
        Method::default().label(),
        tally.failed,
        tally.gained,
        tally.folded,
        tally.unfolded,
        tally.still_folded
    );
    print!("{text}");
    std::fs::write(folder.join("simulate.md"), text)?;
    Ok(())
}
