//! What of a moved skin can be shown as one number a vertex.

use nalgebra::{Point3, Vector3};

use crate::face::Mesh;

/// One number a vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Shown {
    /// How far it has moved from rest, mm.
    #[default]
    Displacement,
    /// Mean strain of the edges at it, %; negative where the skin is pressed.
    Strain,
    /// Length of the muscles' pull on it, N.
    Force,
}

impl Shown {
    /// All, in the order of the chooser.
    pub const ALL: [Self; 3] = [Self::Displacement, Self::Strain, Self::Force];

    /// Its name.
    pub fn label(self) -> &'static str {
        match self {
            Self::Displacement => "Displacement",
            Self::Strain => "Strain",
            Self::Force => "Force",
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement => "mm",
            Self::Strain => "%",
            Self::Force => "N",
        }
    }

    /// Whether values of both signs occur.
    pub fn is_signed(self) -> bool {
        self == Self::Strain
    }

    /// The value of every vertex of a skin at `x` (mm) under `loads` (N).
    pub fn values(self, mesh: &Mesh, rest: &[Point3<f64>], x: &[Point3<f64>], loads: &[Vector3<f64>]) -> Vec<f64> {
        match self {
            Self::Displacement => x.iter().zip(rest).map(|(x, x0)| (x - x0).norm()).collect(),
            Self::Force => loads.iter().map(Vector3::norm).collect(),
            Self::Strain => {
                let mut sums = vec![(0.0, 0_u32); x.len()];
                for edge in mesh.edges() {
                    let [a, b] = edge.map(|i| i as usize);
                    let (before, now) = ((rest[a] - rest[b]).norm(), (x[a] - x[b]).norm());
                    if before > 0.0 {
                        for i in [a, b] {
                            sums[i].0 += now / before - 1.0;
                            sums[i].1 += 1;
                        }
                    }
                }
                sums.into_iter().map(|(sum, count)| 100.0 * sum / f64::from(count.max(1))).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A right-angled triangle with legs 3 and 4 mm, pulled to twice its width: the leg along x doubles (+100 %), the hypotenuse
    /// grows from 5 to √(36 + 16) = 7.211 mm (+44.22 %), the other leg stays.
    #[test]
    fn strains_displacements_and_forces_by_hand() {
        let rest: Vec<Point3<f64>> =
            [[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]].map(|p| Point3::new(p[0], p[1], 0.0)).to_vec();
        let mesh = Mesh::new(rest.clone(), vec![[0, 1, 2]]).unwrap();
        let mut x = rest.clone();
        x[1].x = 6.0;
        let loads = [Vector3::zeros(), Vector3::new(0.3, 0.4, 0.0), Vector3::zeros()];
        let values = |shown: Shown| shown.values(&mesh, &rest, &x, &loads);
        assert_eq!(values(Shown::Displacement), [0.0, 3.0, 0.0]);
        assert!((values(Shown::Force)[1] - 0.5).abs() < 1e-12);
        let slanted = 100.0 * (52.0_f64.sqrt() / 5.0 - 1.0);
        let strain = values(Shown::Strain);
        for (found, by_hand) in strain.iter().zip([50.0, f64::midpoint(100.0, slanted), slanted / 2.0]) {
            assert!((found - by_hand).abs() < 1e-9, "{found} {by_hand}");
        }
    }
}
