//! The coordinates in which the free vertices of a system can move: two within the surface that each slides on, or three in space.

use nalgebra::{Point3, Vector3};

use super::block_cholesky::{Block, BlockCholesky};
use super::system::System;

/// K coordinates of every vertex that is free, and the right side and solution of a linear system in them.
#[derive(Debug)]
pub(super) struct Freedoms<const K: usize> {
    /// Number of each free vertex among the free ones.
    unknown: Vec<Option<u32>>,
    /// The directions in which each vertex can move.
    bases: Vec<[Vector3<f64>; K]>,
    /// One number a coordinate of the free vertices.
    values: Vec<f64>,
}

impl<const K: usize> Freedoms<K> {
    /// Those of a system, along the axes of space as long as [`Self::lie_in`] was not asked.
    pub(super) fn new(system: &System) -> Self {
        let mut count = 0_u32;
        let mut number = |free: &bool| {
            free.then(|| {
                count += 1;
                count - 1
            })
        };
        let unknown: Vec<Option<u32>> = system.free().iter().map(&mut number).collect();
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
        let bases = vec![std::array::from_fn(|c| axes[c]); unknown.len()];
        Self { unknown, bases, values: vec![0.0; count as usize * K] }
    }

    /// Number of free vertices.
    pub(super) fn free(&self) -> usize {
        self.values.len() / K
    }

    /// The number of a vertex among the free ones.
    pub(super) fn number(&self, vertex: usize) -> Option<u32> {
        self.unknown[vertex]
    }

    /// The numbers of the ends of an edge, where both are free.
    pub(super) fn pair(&self, ends: [u32; 2]) -> Option<[u32; 2]> {
        Some([self.unknown[ends[0] as usize]?, self.unknown[ends[1] as usize]?])
    }

    /// The free vertices, each with its number among them.
    pub(super) fn each(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.unknown.iter().enumerate().filter_map(|(i, u)| Some((i, (*u)?)))
    }

    /// The directions in which a vertex can move.
    pub(super) fn basis(&self, vertex: usize) -> &[Vector3<f64>; K] {
        &self.bases[vertex]
    }

    /// Lets a vertex move in the plane across this normal; the plane's two directions.
    pub(super) fn lie_in(&mut self, vertex: usize, normal: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let across = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
        let t = normal.cross(&across).normalize();
        let both = [t, normal.cross(&t)];
        self.bases[vertex] = std::array::from_fn(|c| both[c]);
        both
    }

    /// Turns the directions of each free vertex into the surface at `x`.
    pub(super) fn turn(&mut self, system: &System, x: &[Point3<f64>]) {
        for ((i, p), basis) in x.iter().enumerate().zip(&mut self.bases).filter(|((i, _), _)| system.free()[*i]) {
            let Some(normal) = system.normal(i, p) else { continue };
            let Some(t) = (basis[0] - normal * normal.dot(&basis[0])).try_normalize(1e-9) else { continue };
            let both = [t, normal.cross(&t)];
            *basis = std::array::from_fn(|c| both[c]);
        }
    }

    /// H⁻¹ f for forces f on every vertex, with the last factor of H; false where a number is no number.
    pub(super) fn solve(
        &mut self,
        matrix: &mut BlockCholesky<K>,
        forces: &[Vector3<f64>],
        out: &mut Vec<Vector3<f64>>,
    ) -> bool {
        for ((u, basis), f) in self.unknown.iter().zip(&self.bases).zip(forces) {
            let Some(u) = u else { continue };
            let at = *u as usize * K;
            self.values[at..at + K].copy_from_slice(&seen_from(basis, f));
        }
        matrix.solve(&mut self.values);
        out.clear();
        out.extend(self.unknown.iter().zip(&self.bases).map(|(u, basis)| {
            let Some(u) = u else { return Vector3::zeros() };
            let at = *u as usize * K;
            basis.iter().zip(&self.values[at..at + K]).map(|(b, value)| b * *value).sum::<Vector3<f64>>()
        }));
        out.iter().all(|d| d.iter().all(|c| c.is_finite()))
    }
}

/// A vector in the coordinates of a vertex.
#[inline]
pub(super) fn seen_from<const K: usize>(basis: &[Vector3<f64>; K], v: &Vector3<f64>) -> [f64; K] {
    std::array::from_fn(|c| basis[c].dot(v))
}

/// aᵀ M b of a block in space, column by column.
pub(super) fn seen_between<const K: usize>(
    a: &[Vector3<f64>; K],
    m: &nalgebra::Matrix3<f64>,
    b: &[Vector3<f64>; K],
) -> Block<K> {
    b.map(|b| seen_from(a, &(m * b)))
}
