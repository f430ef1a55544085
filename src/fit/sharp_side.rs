//! The side of a zone that ends sharply: no slope says where it is, so every place where it can be is tried.

use nalgebra::Vector3;

use super::law_model::Model;
use super::{Compare, cholesky};

impl Model<'_> {
    /// The cost for every position of the sharp side `k` between which a sample changes sides, in rising order, and for the
    /// strengths that are best for each; the other parameters stand where they are.
    ///
    /// The side moves outwards past one sample after the other. Each adds its column to G and Φᵀy, and the cost is
    /// yᵀy − (Φᵀy)ᵀ G⁻¹ Φᵀy: all positions cost little more than one evaluation. The model stands nowhere afterwards.
    pub(super) fn scan(&mut self, k: usize) -> Vec<(f64, f64)> {
        self.evaluations += 1;
        let (low, high) = (self.parameters[k].low, self.parameters[k].high);
        let here = std::mem::replace(&mut self.values[k], high);
        self.shape();
        self.values[k] = here;
        let fibres = self.field.fibres().len();
        let lateral = |term: usize| self.field.places()[term].lateral;
        // A sharp law has one lobe: terms are pairs of a sample and a fibre, as places are.
        let pulls: Vec<Vector3<f64>> =
            (0..self.field.places().len()).map(|t| self.pull(t % fibres, t / fibres)).collect();
        let mut order: Vec<usize> =
            (0..pulls.len()).filter(|&t| pulls[t] != Vector3::zeros() && lateral(t) <= high).collect();
        order.sort_unstable_by(|a, b| lateral(*a).total_cmp(&lateral(*b)));
        let q = self.columns();
        let lengths = self.field.compare() == Compare::Magnitudes;
        let mut columns = vec![Vector3::<f64>::zeros(); self.field.len() * q];
        let (mut gram, mut factor) = (vec![0.0; q * q], vec![0.0; q * q]);
        let (mut right, mut solved) = (vec![0.0; q], vec![0.0; q]);
        let nothing = self.field.cost_of_nothing();
        let mut scanned = Vec::with_capacity(order.len());
        for (at, &term) in order.iter().enumerate() {
            let (i, c) = (term / fibres, if q == 1 { 0 } else { term % fibres });
            let y = &self.field.forces()[i];
            let size = |v: &Vector3<f64>| if lengths { Vector3::new(v.norm(), 0.0, 0.0) } else { *v };
            let before = columns[i * q + c];
            let after = before + pulls[term];
            let change = size(&after) - size(&before);
            right[c] += if lengths { change.x * y.norm() } else { change.dot(y) };
            gram[c * q + c] += size(&after).norm_squared() - size(&before).norm_squared();
            for d in (0..q).filter(|&d| d != c) {
                let product = change.dot(&size(&columns[i * q + d]));
                gram[c.max(d) * q + c.min(d)] += product;
            }
            columns[i * q + c] = after;
            let next = order.get(at + 1).map_or(high, |&t| lateral(t));
            let side = 0.5 * (lateral(term) + next);
            // Samples that share a place change sides together.
            if next - lateral(term) <= 1e-9 * next || !(low..=high).contains(&side) {
                continue;
            }
            factor.copy_from_slice(&gram);
            cholesky::factor(&mut factor, q);
            solved.copy_from_slice(&right);
            cholesky::solve(&factor, q, &mut solved);
            let explained: f64 = solved.iter().zip(&right).map(|(s, b)| s * b).sum();
            scanned.push((side, nothing - explained));
        }
        scanned
    }

    /// Sets the sharp side `k` to the best position for where the other parameters stand, and the unknowns with it; whether that
    /// lowered the cost.
    pub(super) fn move_side(&mut self, k: usize, u: &mut Vec<f64>) -> bool {
        let values = self.values().to_vec();
        let before = self.cost_at(&values, None);
        let best = self.scan(k).into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let mut moved = values.clone();
        let better = best.is_some_and(|(side, _)| {
            moved[k] = side;
            self.cost_at(&moved, None) < before * (1.0 - 1e-9)
        });
        *u = self.start(if better { &moved } else { &values });
        better
    }

    /// Positions of the sharp side `k` about the present one whose cost stays under a ceiling, the other parameters held. Between two
    /// neighbouring samples all are alike, so the interval reaches from sample to sample.
    pub(super) fn side_interval(&mut self, k: usize, ceiling: f64) -> (f64, f64) {
        let values = self.values().to_vec();
        let scanned = self.scan(k);
        self.cost_at(&values, None);
        let (low, high) = (self.parameters[k].low, self.parameters[k].high);
        let here = scanned.partition_point(|(side, _)| *side < values[k]);
        let fits = |(_, cost): &&(f64, f64)| *cost <= ceiling;
        let below = scanned[..here].iter().rev().take_while(fits).last().map_or(values[k], |s| s.0);
        let above = scanned[here..].iter().take_while(fits).last().map_or(values[k], |s| s.0);
        let lateral = || self.field.places().iter().map(|p| p.lateral);
        let inner = lateral().filter(|l| *l <= below).fold(low, f64::max);
        let outer = lateral().filter(|l| *l > above).fold(high, f64::min);
        (inner, outer)
    }
}
