//! The jaw of a face: the axis through its joints, and how much each vertex goes with it.

use nalgebra::{Point3, Vector3};

use super::places::Carry;
use crate::face::check::borders_of;
use crate::face::{FaceModel, Mesh};
use crate::simulate::Jaw;

/// Middle of the jaw's joints on the generic face, mm: the condyles lie about 55 mm to the sides.
const JOINTS: [f64; 3] = [0.0, -18.0, -70.0];
/// Below this height of the generic face, mm, skin lies on the jaw.
const ON_JAW: f64 = -84.0;
/// Above this height it lies on the skull: between, the cheeks are as long as they can be, for skin stretches little.
const ON_SKULL: f64 = -15.0;
/// Nose and upper lip lie on the skull: nearer to the middle than this, above that height, mm.
const UPPER_LIP: [f64; 2] = [20.0, -62.0];
/// Share of the half width of the mouth, from its middle, in which a lip goes wholly with its bone.
const LIP: f64 = 0.6;
/// Sweeps of the relaxation at most, the change at which it ends, and how far each step overshoots.
const SWEEPS: usize = 3000;
const SETTLED: f64 = 1e-7;
const OVERSHOOT: f64 = 1.6;

/// The widest angle to which a jaw opens, degrees: 50 mm between the teeth, 90 mm from the joints.
pub const WIDEST_DEG: f64 = 35.0;

/// The jaw of a face at rest. Weights are 1 below the mouth and on the lower lip, 0 above it and on the upper lip, and harmonic
/// between: every other vertex has the mean of its neighbours. The second value says what was missing.
pub fn jaw(face: &FaceModel, rest: &[Point3<f64>], carry: &Carry) -> (Jaw, Option<String>) {
    let mesh = face.mesh();
    let mut fixed: Vec<Option<f64>> = rest
        .iter()
        .map(|p| {
            let Point3 { coords: at } = carry.back(p);
            let on_skull = at.y > ON_SKULL || (at.x.abs() < UPPER_LIP[0] && at.y > UPPER_LIP[1]);
            if at.y < ON_JAW { Some(1.0) } else { on_skull.then_some(0.0) }
        })
        .collect();
    let lips = lips(face, rest);
    let note = lips.is_none().then(|| "the mouth has no opening between the lips, so they stay joined".to_owned());
    for (chain, weight) in lips.iter().flatten().zip([0.0, 1.0]) {
        for &v in chain {
            fixed[v as usize] = Some(weight);
        }
    }
    (Jaw { centre: carry.there(JOINTS.into()), axis: Vector3::x_axis(), weights: harmonic(mesh, &fixed) }, note)
}

/// The jaw of a face at rest; none where a landmark is missing that says where it is ([`super::places::NEEDED`]).
pub fn jaw_of(face: &FaceModel, rest: &[Point3<f64>]) -> Option<Jaw> {
    Some(jaw(face, rest, &Carry::onto(face, rest).ok()?).0)
}

/// The middles of the upper and the lower lip's edge on the opening of the mouth.
fn lips(face: &FaceModel, rest: &[Point3<f64>]) -> Option<[Vec<u32>; 2]> {
    let at = |id: &str| face.landmark(id).map(|l| rest[l.vertex as usize]);
    let (left, right) = (at("mouth_corner_left")?, at("mouth_corner_right")?);
    let (upper, lower) = (at("upper_lip")?, at("lower_lip")?);
    let (middle, half) = (nalgebra::center(&left, &right), 0.5 * (left.x - right.x).abs());
    let tall = (upper.y - lower.y).abs();
    let inside = |v: &u32| {
        let p = rest[*v as usize];
        (p.x - middle.x).abs() <= half && (p.y - middle.y).abs() <= tall
    };
    // The rim is the longest border; the mouth is a border that lies whole between the corners.
    let borders = borders_of(face.mesh());
    let line = &borders.iter().skip(1).find(|b| b.vertices.iter().all(inside))?.vertices;
    let extreme = |sign: f64| {
        let x = |i: &usize| sign * rest[line[*i] as usize].x;
        (0..line.len()).max_by(|i, j| x(i).total_cmp(&x(j)))
    };
    let (from, to) = (extreme(1.0)?, extreme(-1.0)?);
    let chain = |from: usize, to: usize| -> Vec<u32> {
        let count = (to + line.len() - from) % line.len();
        (1..count).map(|k| line[(from + k) % line.len()]).collect()
    };
    let one = chain(from, to);
    let other = chain(to, from);
    let height = |c: &[u32]| c.iter().map(|v| rest[*v as usize].y).sum::<f64>() / c.len().max(1) as f64;
    let chains = if height(&one) > height(&other) { [one, other] } else { [other, one] };
    let near = |v: &u32| (rest[*v as usize].x - middle.x).abs() <= LIP * half;
    Some(chains.map(|c| c.into_iter().filter(near).collect()))
}

/// Every vertex that is not fixed gets the mean of its neighbours (successive over-relaxation); one that no fixed vertex reaches keeps 0.
fn harmonic(mesh: &Mesh, fixed: &[Option<f64>]) -> Vec<f64> {
    let mut w: Vec<f64> = fixed.iter().map(|f| f.unwrap_or(0.0)).collect();
    let free: Vec<usize> = (0..w.len()).filter(|&i| fixed[i].is_none() && !mesh.neighbours(i).is_empty()).collect();
    for _ in 0..SWEEPS {
        let mut change = 0.0_f64;
        for &i in &free {
            let around = mesh.neighbours(i);
            let mean = around.iter().map(|&j| w[j as usize]).sum::<f64>() / around.len() as f64;
            let step = OVERSHOOT * (mean - w[i]);
            change = change.max(step.abs());
            w[i] += step;
        }
        if change < SETTLED {
            break;
        }
    }
    for v in &mut w {
        *v = v.clamp(0.0, 1.0);
    }
    w
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face;
    use nalgebra::Rotation3;

    #[test]
    fn every_vertex_that_is_not_fixed_has_the_mean_of_its_neighbours() {
        let mesh = face::patches::right_angled(9, 5, 1.0, 1.0);
        let ends = |p: &Point3<f64>| (p.x == 0.0).then_some(0.0).or((p.x == 8.0).then_some(1.0));
        let fixed: Vec<_> = mesh.positions().iter().map(ends).collect();
        let w = harmonic(&mesh, &fixed);
        for (v, fixed) in fixed.iter().enumerate() {
            let around = mesh.neighbours(v);
            let mean = around.iter().map(|&j| w[j as usize]).sum::<f64>() / around.len() as f64;
            let expected = fixed.unwrap_or(mean);
            assert!((w[v] - expected).abs() < 1e-6 && (fixed.is_some() || (w[v] > 0.0 && w[v] < 1.0)));
        }
        // Nothing fixed: nothing moves.
        assert_eq!(harmonic(&mesh, &[None; 45]), vec![0.0; 45]);
    }

    #[test]
    fn the_lower_lip_and_the_chin_go_with_the_jaw_and_the_upper_lip_stays() {
        let face = face::generic();
        let rest = face.mesh().positions();
        let carry = Carry::onto(&face, rest).unwrap();
        let (jaw, note) = jaw(&face, rest, &carry);
        assert_eq!(note, None);
        let at = |id: &str| face.landmark(id).unwrap().vertex as usize;
        for id in ["nose_tip", "upper_lip_inner", "eye_bottom_left", "subnasale"] {
            assert_eq!(jaw.weights[at(id)], 0.0, "{id}");
        }
        assert_eq!(jaw.weights[at("chin")], 1.0);
        assert!(jaw.weights[at("lower_lip")] > 0.9);
        let corner = jaw.weights[at("mouth_corner_left")];
        assert!(corner > 0.2 && corner < 0.7, "{corner}");
        for (v, w) in jaw.weights.iter().enumerate() {
            let across = face.mirror()[v].unwrap() as usize;
            assert!((w - jaw.weights[across]).abs() < 1e-4 && (0.0..=1.0).contains(w));
        }
        // By hand: the chin lies 92.5 mm below and 80.35 mm before the joints; 15° lower it by 80.35 sin 15° − 92.5 (1 − cos 15°).
        let turn = Rotation3::from_axis_angle(&jaw.axis, 15.0_f64.to_radians());
        let chin = jaw.centre + turn * (rest[at("chin")] - jaw.centre);
        assert!((rest[at("chin")].y - chin.y - (80.35 * 0.258_819 - 92.5 * 0.034_074)).abs() < 0.1);
    }
}
