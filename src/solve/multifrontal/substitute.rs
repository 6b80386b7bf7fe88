//! This module performs the forward and backward substitution along the tree.

use super::*;
use crate::simd::Simd;
use crate::threads;
use front::Size;
use kernels::Columns;
use std::ops::Range;
use tree::{Run, Source, Tree};

/// Inputs of one forward and backward substitution.
pub(super) struct Sweep<'a, const D: usize> {
    /// The elimination tree.
    pub(super) tree: &'a Tree,
    /// Offsets of the data of the fronts.
    pub(super) places: &'a Places,
    /// Instruction set of the kernels.
    pub(super) simd: Simd,
    /// Panels of all fronts in postorder.
    pub(super) factor: &'a [f64],
}

/// Unknowns of a subtree.
pub(super) struct Unknowns<'a> {
    /// Unknowns that the subtree eliminates.
    pub(super) x: &'a mut [f64],
    /// Vectors of its fronts.
    pub(super) vectors: &'a mut [f64],
}

impl<const D: usize> Sweep<'_, D> {
    /// Columns of the factor of a front.
    pub(super) fn columns(&self, f: usize) -> Columns<'_> {
        let data = &self.factor[self.places.panel[f]..self.places.panel[f + 1]];
        Columns { data, ld: size::<D>(self.tree, f).rows() }
    }

    /// Whether the children of a front are processed by separate threads.
    pub(super) fn is_shared(&self, f: usize, depth: u32) -> bool {
        depth > 0 && self.tree.fronts[f].subtree > SHARED_FRONTS
    }

    /// The unknowns of the two children, and the front's own.
    pub(super) fn split<'a>(&self, f: usize, u: Unknowns<'a>) -> [Unknowns<'a>; 3] {
        let [left, right] = self.tree.children(f);
        let (first, vector) = (self.tree.first_of(f), &self.places.vector);
        let start = |front: usize| D * self.tree.fronts[front].first as usize;
        let (x0, x1, x2) = (start(first), start(self.tree.first_of(right)), start(f));
        let (xl, x) = u.x.split_at_mut(x1 - x0);
        let (xr, x) = x.split_at_mut(x2 - x1);
        let (vl, v) = u.vectors.split_at_mut(vector[left + 1] - vector[first]);
        let (vr, v) = v.split_at_mut(vector[f] - vector[left + 1]);
        [(xl, vl), (xr, vr), (x, v)].map(|(x, vectors)| Unknowns { x, vectors })
    }

    /// Forward substitution in a subtree. Afterwards the vector of each front holds its own
    /// intermediate unknowns and their contribution to the right-hand side on its rim.
    pub(super) fn forward(&self, f: usize, u: Unknowns, depth: u32) {
        let size = size::<D>(self.tree, f);
        let vector = match &self.tree.fronts[f].source {
            Source::Cells(_) => {
                begin(size, u.x, u.vectors);
                u.vectors
            }
            Source::Children(runs) => {
                let [mut left, mut right, here] = self.split(f, u);
                let [l, r] = self.tree.children(f);
                threads::both(
                    self.is_shared(f, depth),
                    || self.forward(l, left.reborrow(), depth.saturating_sub(1)),
                    || self.forward(r, right.reborrow(), depth.saturating_sub(1)),
                );
                begin(size, here.x, here.vectors);
                for (child, part, runs) in [(l, &left, &runs[0]), (r, &right, &runs[1])] {
                    let rim = D * self.tree.fronts[child].rim.len();
                    let rim = &part.vectors[part.vectors.len() - rim..];
                    for (to, from) in runs.iter().map(ends::<D>) {
                        for (t, f) in here.vectors[to].iter_mut().zip(&rim[from]) {
                            *t += f;
                        }
                    }
                }
                here.vectors
            }
        };
        let (own, rim) = vector.split_at_mut(size.own);
        kernels::forward(self.simd, self.columns(f), own, rim);
    }

    /// Backward substitution in a subtree whose rim is known from the parent's vector. Afterwards
    /// the vector of each front holds the solution.
    pub(super) fn backward(
        &self,
        f: usize,
        u: Unknowns,
        parent: Option<(&[f64], &[Run])>,
        depth: u32,
    ) {
        let size = size::<D>(self.tree, f);
        let (children, here) = match &self.tree.fronts[f].source {
            Source::Cells(_) => (None, u),
            Source::Children(runs) => {
                let [left, right, here] = self.split(f, u);
                (Some((left, right, runs)), here)
            }
        };
        let (own, rim) = here.vectors.split_at_mut(size.own);
        if let Some((known, runs)) = parent {
            for (from, to) in runs.iter().map(ends::<D>) {
                rim[to].copy_from_slice(&known[from]);
            }
        }
        kernels::backward(self.simd, self.columns(f), own, rim);
        here.x.copy_from_slice(own);
        if let Some((left, right, runs)) = children {
            let [l, r] = self.tree.children(f);
            let known = &*here.vectors;
            threads::both(
                self.is_shared(f, depth),
                || self.backward(l, left, Some((known, &runs[0])), depth.saturating_sub(1)),
                || self.backward(r, right, Some((known, &runs[1])), depth.saturating_sub(1)),
            );
        }
    }
}

impl Unknowns<'_> {
    /// The same unknowns, borrowed for a shorter time.
    pub(super) fn reborrow(&mut self) -> Unknowns<'_> {
        Unknowns { x: self.x, vectors: self.vectors }
    }
}

/// Initialises the vector of a front: its own unknowns, and zero on the rim.
pub(super) fn begin(size: Size, x: &[f64], vector: &mut [f64]) {
    vector[..size.own].copy_from_slice(x);
    vector[size.own..].fill(0.0);
}

/// The unknowns of the parent and of the child's rim that a run connects.
pub(super) fn ends<const D: usize>(run: &Run) -> (Range<usize>, Range<usize>) {
    let range = |start: u32| D * start as usize..D * (start + run.len) as usize;
    (range(run.parent), range(run.child))
}
