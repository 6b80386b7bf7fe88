//! This module computes the numerical factorisation: it eliminates the fronts from the leaves to
//! the root.

use super::super::element::{CellBlocks, pair};
use super::*;
use crate::simd::Simd;
use crate::threads;
use front::{Child, Matrix};
use tree::{Run, Source, Tree};

/// Inputs of one factorisation.
pub(super) struct Factorize<'a, const D: usize> {
    /// The elimination tree.
    pub(super) tree: &'a Tree,
    /// Whether each front must be factored again.
    pub(super) stale: &'a [bool],
    /// Instruction set of the kernels.
    pub(super) simd: Simd,
    /// Element matrices.
    pub(super) cells: &'a [CellBlocks<D>],
}

impl<const D: usize> Factorize<'_, D> {
    /// Factors a subtree whose update is kept; `part` holds the data of this subtree only.
    pub(super) fn kept(
        &self,
        f: usize,
        mut part: Part,
        work: &mut [Vec<f64>],
    ) -> Result<(), NotPositiveDefinite> {
        if !self.stale[f] {
            return Ok(());
        }
        let [mut below, here] = part.split(f);
        let runs = match &self.tree.fronts[f].source {
            Source::Children(runs) if !here.places.whole[f] => runs,
            _ => return self.whole(f, below, here.factor, here.updates, &mut work[0]),
        };
        let [left, right] = self.tree.children(f);
        let [mut a, mut b] = below.split(left + 1);
        let shared = work.len() > 1 && self.tree.fronts[f].subtree > SHARED_FRONTS;
        let (first, second) = if shared {
            let (w0, w1) = work.split_at_mut(work.len() / 2);
            threads::both(
                true,
                || self.kept(left, a.reborrow(), w0),
                || self.kept(right, b.reborrow(), w1),
            )
        } else {
            (self.kept(left, a.reborrow(), work), self.kept(right, b.reborrow(), work))
        };
        first.and(second)?;
        let updates = [(left, &a), (right, &b)].map(|(child, part)| {
            let update = size::<D>(self.tree, child).update();
            &part.updates[part.updates.len() - update..]
        });
        let size = size::<D>(self.tree, f);
        let mut matrix = Matrix { size, panel: here.factor, update: here.updates };
        self.assemble(&mut matrix, [left, right], updates, runs);
        self.eliminate(f, matrix)
    }

    /// Factors a subtree that is recomputed whole; all updates below it are in `work`.
    pub(super) fn whole(
        &self,
        f: usize,
        mut below: Part,
        panel: &mut [f64],
        update: &mut [f64],
        work: &mut [f64],
    ) -> Result<(), NotPositiveDefinite> {
        let mut matrix = Matrix { size: size::<D>(self.tree, f), panel, update };
        match &self.tree.fronts[f].source {
            Source::Cells(cells) => {
                matrix.clear();
                for c in cells {
                    add_cell(&mut matrix, &c.nodes, &self.cells[c.cell as usize]);
                }
            }
            Source::Children(runs) => {
                let children = self.tree.children(f);
                let [left, right] = children.map(|c| size::<D>(self.tree, c).update());
                let (left, rest) = work.split_at_mut(left);
                let (right, rest) = rest.split_at_mut(right);
                let parts = below.split(children[0] + 1);
                for ((child, mut part), update) in
                    children.into_iter().zip(parts).zip([&mut *left, &mut *right])
                {
                    let [below, here] = part.split(child);
                    self.whole(child, below, here.factor, update, rest)?;
                }
                self.assemble(&mut matrix, children, [left, right], runs);
            }
        }
        self.eliminate(f, matrix)
    }

    /// Assembles a front from the updates of its children.
    pub(super) fn assemble(
        &self,
        matrix: &mut Matrix,
        children: [usize; 2],
        updates: [&[f64]; 2],
        runs: &[Vec<Run>; 2],
    ) {
        let child = |k: usize| Child {
            rim: size::<D>(self.tree, children[k]).rim,
            update: updates[k],
            runs: &runs[k],
        };
        matrix.assemble::<D>([child(0), child(1)]);
    }

    /// Eliminates the own unknowns of a front.
    pub(super) fn eliminate(
        &self,
        f: usize,
        mut matrix: Matrix,
    ) -> Result<(), NotPositiveDefinite> {
        let first = D * self.tree.fronts[f].first as usize;
        matrix.eliminate(self.simd).map_err(|i| NotPositiveDefinite { unknown: first + i })
    }
}

/// Adds the element matrix of a cell whose nodes are at the indices `nodes` of the front.
pub(super) fn add_cell<const D: usize>(
    matrix: &mut Matrix,
    nodes: &[u16; 8],
    blocks: &CellBlocks<D>,
) {
    for k in 0..8 {
        for l in 0..=k {
            let block = &blocks[pair(k, l)];
            let at = [nodes[k], nodes[l]].map(usize::from);
            matrix.add_block([at[0].max(at[1]), at[0].min(at[1])], block, at[0] < at[1]);
            if k != l && at[0] == at[1] {
                // In a periodic cell that is its own neighbour, both blocks are on the diagonal.
                matrix.add_block(at, block, true);
            }
        }
    }
}
