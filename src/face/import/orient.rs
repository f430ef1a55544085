//! Triangles turned so that every surface faces outwards: first like their neighbours, then each surface as a whole.

use nalgebra::{Point3, Vector3};

use super::{ImportError, Repair, Soup};

/// A surface is turned as a whole only when it is bent by more than this share of its size: a flat sheet has no outside.
const BENT: f64 = 1e-6;

/// Makes neighbours agree by the shortest way, then turns surfaces that face inwards.
///
/// A sheet faces outwards when its points lie, on the whole, on the side of its centre to which its triangles face:
/// Σ (x_t − c) · n_t A_t > 0. So does a face, which is bent like a shell, wherever it looks.
pub(super) fn outwards(soup: &mut Soup, repairs: &mut Vec<Repair>) -> Result<(), ImportError> {
    let sides = soup.sides();
    // Neighbours of a triangle, and whether they face the same way as it.
    let mut links = Vec::with_capacity(sides.len());
    for run in sides.chunk_by(|a, b| a.0 == b.0) {
        if let [one, other] = run {
            let forward = |t: u32| {
                let c = soup.triangles[t as usize];
                (0..3).any(|k| c[k] == one.0[0] && c[(k + 1) % 3] == one.0[1])
            };
            let same = forward(one.1) != forward(other.1);
            links.push((one.1, other.1, same));
            links.push((other.1, one.1, same));
        }
    }
    links.sort_unstable();
    let start_of = |t: u32| links.partition_point(|l| l.0 < t);
    let n = soup.triangles.len();
    let mut turn: Vec<Option<bool>> = vec![None; n];
    let mut aligned = 0;
    let mut turned_outwards = 0;
    for start in 0..n as u32 {
        if turn[start as usize].is_some() {
            continue;
        }
        turn[start as usize] = Some(false);
        let mut piece = vec![start];
        let mut next = 0;
        while let Some(&t) = piece.get(next) {
            next += 1;
            for &(_, other, same) in links[start_of(t)..].iter().take_while(|l| l.0 == t) {
                let wanted = turn[t as usize].map(|turned| turned == same);
                match turn[other as usize] {
                    None => {
                        turn[other as usize] = wanted;
                        piece.push(other);
                    }
                    Some(_) if turn[other as usize] != wanted => {
                        let vertex = soup.in_file[soup.triangles[t as usize][0] as usize];
                        return Err(ImportError::OneSided { vertex });
                    }
                    Some(_) => {}
                }
            }
        }
        let turned = |t: &&u32| turn[**t as usize] == Some(true);
        let minority = piece.iter().filter(turned).count();
        // The smaller number of triangles is turned, unless the whole then faces inwards.
        let flip_others = 2 * minority > piece.len();
        aligned += if flip_others { piece.len() - minority } else { minority };
        for &t in &piece {
            if (turn[t as usize] == Some(true)) != flip_others {
                soup.triangles[t as usize].swap(1, 2);
            }
        }
        if faces_inwards(soup, &piece) {
            turned_outwards += piece.len();
            for &t in &piece {
                soup.triangles[t as usize].swap(1, 2);
            }
        }
    }
    if aligned > 0 {
        repairs.push(Repair::Aligned(aligned));
    }
    if turned_outwards > 0 {
        repairs.push(Repair::TurnedOutwards(turned_outwards));
    }
    Ok(())
}

fn faces_inwards(soup: &Soup, piece: &[u32]) -> bool {
    let parts = || {
        piece.iter().map(|&t| {
            let [a, b, c] = soup.triangles[t as usize].map(|i| soup.positions[i as usize]);
            (Point3::from((a.coords + b.coords + c.coords) / 3.0), (b - a).cross(&(c - a)))
        })
    };
    let area: f64 = parts().map(|(_, n)| n.norm()).sum();
    let centre = parts().map(|(x, n)| x.coords * n.norm()).sum::<Vector3<f64>>() / area;
    let (mut out, mut size) = (0.0, 0.0);
    for (x, n) in parts() {
        out += (x.coords - centre).dot(&n);
        size += (x.coords - centre).norm() * n.norm();
    }
    out < -BENT * size
}
