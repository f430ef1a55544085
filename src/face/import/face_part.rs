//! The front of the head, cut out of a head or a whole body.

use std::collections::VecDeque;

use super::{ImportError, Repair, Soup, clean};

/// Height of a head from its top to the chin, mm.
const HEAD_MM: f64 = 250.0;
/// The nose is looked for this close to the middle of the head, mm.
const MIDDLE_MM: f64 = 15.0;
/// The face reaches so far below the tip of the nose, above it, to the side, and behind it, mm (`docs`: mean face, chin 82 below,
/// hairline 103 above, temples 75 to the side and 95 behind).
const BELOW_MM: f64 = 92.0;
const ABOVE_MM: f64 = 108.0;
const ASIDE_MM: f64 = 82.0;
const BEHIND_MM: f64 = 105.0;
/// The least share of a triangle's area that must look to the front.
const FRONT: f64 = -0.15;

/// Keeps the triangles that hang together with the tip of the nose and lie on the front of the head. In mm, turned to face space.
pub(super) fn cut_out(soup: &mut Soup, repairs: &mut Vec<Repair>) -> Result<(), ImportError> {
    let p = &soup.positions;
    let top = p.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    let head = || p.iter().enumerate().filter(|(_, p)| p.y > top - HEAD_MM);
    let (low, high) = head().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (_, p)| (l.min(p.x), h.max(p.x)));
    let middle = f64::midpoint(low, high);
    let tip = head()
        .filter(|(_, p)| (p.x - middle).abs() < MIDDLE_MM && p.y < top - 60.0 && p.y > top - 200.0)
        .max_by(|a, b| a.1.z.total_cmp(&b.1.z))
        .map(|(i, p)| (i as u32, *p));
    let Some((tip, nose)) = tip else {
        return Err(ImportError::NoFace("there is no tip of a nose below the top of the mesh"));
    };

    let wanted = |t: &[u32; 3]| {
        let corners = t.map(|i| p[i as usize]);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        normal.z > FRONT * normal.norm()
            && corners.iter().all(|q| {
                let d = q - nose;
                d.y > -BELOW_MM && d.y < ABOVE_MM && (q.x - middle).abs() < ASIDE_MM && d.z > -BEHIND_MM
            })
    };
    let wanted: Vec<bool> = soup.triangles.iter().map(wanted).collect();
    // From the tip of the nose over edges: what only touches, or lies behind the lips, stays out.
    let sides = soup.sides();
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); soup.triangles.len()];
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        for pair in run.windows(2) {
            beside[pair[0].1 as usize].push(pair[1].1);
            beside[pair[1].1 as usize].push(pair[0].1);
        }
    }
    let at_tip = |t: &usize| wanted[*t] && soup.triangles[*t].contains(&tip);
    let mut kept = vec![false; soup.triangles.len()];
    let mut waiting: VecDeque<u32> = (0..soup.triangles.len()).find(at_tip).map(|t| t as u32).into_iter().collect();
    while let Some(t) = waiting.pop_front() {
        if !std::mem::replace(&mut kept[t as usize], true) {
            waiting.extend(beside[t as usize].iter().filter(|&&u| wanted[u as usize] && !kept[u as usize]));
        }
    }
    let of = soup.triangles.len();
    let mut keep = kept.iter();
    soup.triangles.retain(|_| keep.next() == Some(&true));
    if soup.triangles.is_empty() {
        return Err(ImportError::NoFace("the tip of the nose does not face the front"));
    }
    // Where the cut leaves two fans touching at a vertex, they become two.
    let mut cuts = Vec::new();
    clean::surface(soup, false, &mut cuts);
    clean::compact(soup);
    repairs.push(Repair::CutOut { kept: soup.triangles.len(), of });
    Ok(())
}
