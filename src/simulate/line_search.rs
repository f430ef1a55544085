//! Steps of Newton's method along the surface: how far along a direction, whether a factor still serves, and when the end is reached.

use nalgebra::{Point3, Vector3};

use super::system::System;

/// Halvings of a step before it is given up.
const HALVINGS: usize = 24;
/// Share of the promised descent that is enough (Armijo).
const ENOUGH: f64 = 1e-4;
/// A step with a kept factor must leave at most this share of the step before; else the matrix is factored anew.
const SERVES: f64 = 0.3;

/// Memory of a search.
#[derive(Debug, Default)]
pub(super) struct Search {
    pub(super) direction: Vec<Vector3<f64>>,
    /// What a surface adds to each vertex's way: with the square of the share that is gone; empty without a surface.
    pub(super) bend: Vec<Vector3<f64>>,
    trial: Vec<Point3<f64>>,
    /// Length of the last whole step, mm.
    last_mm: Option<f64>,
    /// Whether the last factor that was kept served ill.
    worn: bool,
}

impl Search {
    /// A search from a new place.
    pub(super) fn begin(&mut self) {
        self.last_mm = None;
        self.worn = false;
    }

    /// Whether the factor of the step before may serve once more: that step was whole and shorter than this, and a kept factor has
    /// not failed since the last was made.
    pub(super) fn keeps(&self, shorter_than_mm: f64) -> bool {
        !self.worn && self.last_mm.is_some_and(|last| last < shorter_than_mm)
    }

    /// Whether a kept factor has served ill.
    pub(super) fn is_worn(&self) -> bool {
        self.worn
    }

    /// Whether what is left after a step of this length (mm) and share is less than the tolerance: steps shrink at least as much
    /// from one to the next as they just did. `kept` says that the factor was that of an earlier place.
    pub(super) fn arrived(&mut self, longest_mm: f64, share: f64, tolerance_mm: f64, kept: bool) -> bool {
        let whole = (share == 1.0).then_some(longest_mm);
        let last = std::mem::replace(&mut self.last_mm, whole);
        let ratio = whole.zip(last).map(|(now, last)| now / last);
        self.worn = kept && !ratio.is_some_and(|r| r < SERVES);
        let left = match ratio {
            Some(ratio) if ratio < 0.1 => longest_mm * ratio,
            _ => longest_mm * share,
        };
        left < tolerance_mm
    }

    /// Goes along the direction as far as lowers the energy enough, `evaluate` telling the energy of a place; the share of it that was
    /// gone, with the energy there, or none. The place gone to is the last that was evaluated. `slope` is the product of direction
    /// and force.
    pub(super) fn descend(
        &mut self,
        system: &System,
        x: &mut Vec<Point3<f64>>,
        before: f64,
        slope: f64,
        mut evaluate: impl FnMut(&[Point3<f64>]) -> f64,
    ) -> Option<(f64, f64)> {
        let mut share = 1.0;
        for _ in 0..HALVINGS {
            self.trial.clear();
            let bend = |i: usize| self.bend.get(i).map_or_else(Vector3::zeros, |b| b * (share * share));
            let places = x.iter().zip(&self.direction).enumerate();
            self.trial.extend(places.map(|(i, (p, d))| system.allowed(i, &(p + d * share + bend(i)))));
            let after = evaluate(&self.trial);
            if after <= before - ENOUGH * share * slope {
                std::mem::swap(x, &mut self.trial);
                return Some((share, after));
            }
            share *= 0.5;
        }
        None
    }

    /// Length of the longest of the vertices' ways along the direction, mm.
    pub(super) fn longest_mm(&self) -> f64 {
        self.direction.iter().map(Vector3::norm_squared).fold(0.0, f64::max).sqrt()
    }

    /// Product of the direction and forces, mJ.
    pub(super) fn slope(&self, forces: &[Vector3<f64>]) -> f64 {
        self.direction.iter().zip(forces).map(|(d, f)| d.dot(f)).sum()
    }
}
