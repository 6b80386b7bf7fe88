//! This module computes a multifrontal Cholesky factorisation of the skeleton matrix of a
//! structured mesh.
//!
//! The global matrix is never assembled. Each front of the nested dissection (`tree.rs`) is the sum
//! of the element matrices of its cells or of the updates of its children. It eliminates its own
//! unknowns (`front.rs`) and passes an update to its parent. With 2 or 3 unknowns per node, a mesh
//! of `N` cells has `O(N log N)` entries in the factor and takes `O(N^1.5)` operations.
//!
//! **Only what changed is factored again.** If all element matrices below a front are bit for bit
//! the previous ones, the front keeps its part of the factor and its update. The fronts above cells
//! that changed are recomputed with the same operations in the same order as in a full
//! factorisation, so the factor does not depend on which parts were kept. Rectangles of up to 8
//! cells per side are recomputed whole, in memory that stays in the cache; the updates inside them
//! are not kept.
//!
//! **Threads** process separate subtrees. The order of sums is fixed, so no bit of the result
//! depends on the number of threads.

mod factorize;
mod substitute;

mod front;
mod kernels;
pub mod tree;

use super::element::CellBlocks;
use crate::simd::Simd;
use factorize::Factorize;
use front::Size;
use std::sync::Arc;
use substitute::{Sweep, Unknowns};
use tree::{Source, Tree};

/// Longer side, in cells, of the largest rectangles that are recomputed whole.
const KEPT_SIDE: u32 = 8;

/// Depth of the tree down to which subtrees are distributed among threads.
const SHARED_DEPTH: u32 = 4;

/// Largest subtree, in fronts, that is not divided among threads.
const SHARED_FRONTS: u32 = 64;

/// Largest memory for kept updates, in bytes; if it is exceeded, larger rectangles are recomputed
/// whole.
const KEPT_BYTES: usize = 6 << 30;

/// Error: the matrix is not positive definite.
#[derive(Debug, thiserror::Error)]
#[error("the matrix is not positive definite at skeleton unknown {unknown}")]
pub struct NotPositiveDefinite {
    /// Index of the unknown in the elimination order.
    pub unknown: usize,
}

/// Work of a factorisation, and of one that computes all fronts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Effort {
    /// Computed entries of the factor.
    pub entries: usize,
    /// Additions and multiplications.
    pub flops: f64,
    /// Entries of the whole factor.
    pub all_entries: usize,
    /// Additions and multiplications of a factorisation of all fronts.
    pub all_flops: f64,
    /// Entries of kept updates.
    pub kept_entries: usize,
}

/// Factored matrix on the skeleton, with `D` unknowns per node.
pub struct Multifrontal<const D: usize> {
    tree: Arc<Tree>,
    places: Places,
    simd: Simd,
    /// Panels of all fronts in postorder.
    factor: Vec<f64>,
    /// Kept updates.
    updates: Vec<f64>,
    /// Own and rim unknowns of each front, for the vector being solved for.
    vectors: Vec<f64>,
    /// Memory for updates that are not kept, per task.
    work: Vec<Vec<f64>>,
    /// Whether each front must be factored again.
    stale: Vec<bool>,
    /// Front of each cell.
    leaf_of: Vec<u32>,
    effort: Effort,
}

/// Offsets of the data of the fronts; each list of offsets has one entry more than there are
/// fronts.
struct Places {
    /// Offsets of the panels.
    panel: Vec<usize>,
    /// Offsets of the updates; updates that are not kept have length zero.
    update: Vec<usize>,
    /// Offsets of the vectors.
    vector: Vec<usize>,
    /// Whether the front and all fronts below it are recomputed together.
    whole: Vec<bool>,
}

/// Number of unknowns of a front.
fn size<const D: usize>(tree: &Tree, f: usize) -> Size {
    let front = &tree.fronts[f];
    Size { own: D * front.own as usize, rim: D * front.rim.len() }
}

impl Places {
    fn new<const D: usize>(tree: &Tree) -> Self {
        let kept = |side: u32| -> usize {
            (0..tree.fronts.len())
                .filter(|&f| is_kept(tree, f, side))
                .map(|f| size::<D>(tree, f).update())
                .sum()
        };
        let mut side = KEPT_SIDE;
        while kept(side) * size_of::<f64>() > KEPT_BYTES
            && side < tree.fronts.iter().map(|f| f.side).max().unwrap_or(0)
        {
            side *= 2;
        }
        let offsets = |len: &dyn Fn(usize) -> usize| -> Vec<usize> {
            let mut at = vec![0];
            let mut sum = 0;
            for f in 0..tree.fronts.len() {
                sum += len(f);
                at.push(sum);
            }
            at
        };
        Places {
            panel: offsets(&|f| size::<D>(tree, f).panel()),
            update: offsets(&|f| {
                if is_kept(tree, f, side) { size::<D>(tree, f).update() } else { 0 }
            }),
            vector: offsets(&|f| size::<D>(tree, f).rows()),
            whole: tree.fronts.iter().map(|f| f.side <= side).collect(),
        }
    }
}

/// Whether the update of a front is kept: the updates of the largest rectangles that are recomputed
/// whole, and of all fronts above them.
fn is_kept(tree: &Tree, f: usize, side: u32) -> bool {
    tree.fronts[f].side > side || tree.parent[f].is_none_or(|p| tree.fronts[p].side > side)
}

/// Data of consecutive fronts, starting with front `first`.
struct Part<'a> {
    places: &'a Places,
    first: usize,
    factor: &'a mut [f64],
    updates: &'a mut [f64],
}

impl Part<'_> {
    fn reborrow(&mut self) -> Part<'_> {
        let Part { places, first, factor, updates } = self;
        Part { places, first: *first, factor, updates }
    }

    /// The fronts before `front`, and the fronts from `front` on.
    fn split(&mut self, front: usize) -> [Part<'_>; 2] {
        let Part { places, first, factor, updates } = self.reborrow();
        let (f0, f1) = factor.split_at_mut(places.panel[front] - places.panel[first]);
        let (u0, u1) = updates.split_at_mut(places.update[front] - places.update[first]);
        [
            Part { places, first, factor: f0, updates: u0 },
            Part { places, first: front, factor: f1, updates: u1 },
        ]
    }
}

impl<const D: usize> Multifrontal<D> {
    /// Allocates the factor; nothing is factored yet.
    pub fn new(tree: Arc<Tree>, cells: usize) -> Self {
        let places = Places::new::<D>(&tree);
        let fronts = tree.fronts.len();
        let mut leaf_of = vec![0; cells];
        for (f, front) in tree.fronts.iter().enumerate() {
            if let Source::Cells(list) = &front.source {
                list.iter().for_each(|c| leaf_of[c.cell as usize] = f as u32);
            }
        }
        let workspace = (0..fronts)
            .filter(|&f| places.whole[f])
            .map(|f| workspace::<D>(&tree, f))
            .max()
            .unwrap_or(0);
        Multifrontal {
            factor: vec![0.0; places.panel[fronts]],
            updates: vec![0.0; places.update[fronts]],
            vectors: vec![0.0; places.vector[fronts]],
            work: vec![vec![0.0; workspace]; 1 << SHARED_DEPTH],
            stale: vec![true; fronts],
            simd: Simd::used(),
            effort: Effort::default(),
            leaf_of,
            places,
            tree,
        }
    }

    /// The elimination tree.
    pub fn tree(&self) -> &Arc<Tree> {
        &self.tree
    }
    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        D * self.tree.len()
    }
    /// Work of the last factorisation.
    pub fn effort(&self) -> Effort {
        self.effort
    }

    /// Makes the next factorisation compute all fronts.
    pub fn forget(&mut self) {
        self.stale.fill(true);
    }

    /// Marks the matrix of a cell as changed since the last factorisation.
    pub fn touch(&mut self, cell: usize) {
        // Without any cell there are no fronts.
        if let Some(stale) = self.stale.get_mut(self.leaf_of[cell] as usize) {
            *stale = true;
        }
    }

    /// Factors the fronts above cells that changed.
    ///
    /// # Errors
    /// Returns `NotPositiveDefinite` at the first pivot that is not positive. The fronts marked
    /// for factorisation then stay marked.
    pub fn factorize(&mut self, cells: &[CellBlocks<D>]) -> Result<(), NotPositiveDefinite> {
        self.spread_stale();
        self.effort = self.effort_ahead();
        let Multifrontal { tree, places, simd, factor, updates, work, stale, .. } = self;
        let stage = Factorize { tree, stale, simd: *simd, cells };
        if let Some(root) = tree.fronts.len().checked_sub(1) {
            stage.kept(root, Part { places, first: 0, factor, updates }, work)?;
        }
        self.stale.fill(false);
        Ok(())
    }

    /// Work of the next factorisation.
    fn effort_ahead(&self) -> Effort {
        let mut out = Effort { kept_entries: self.updates.len(), ..Effort::default() };
        for (f, &stale) in self.stale.iter().enumerate() {
            let size = size::<D>(&self.tree, f);
            out.all_entries += size.panel();
            out.all_flops += size.flops();
            if stale {
                out.entries += size.panel();
                out.flops += size.flops();
            }
        }
        out
    }

    /// Marks the fronts above stale fronts, and all fronts of a rectangle that is recomputed whole.
    fn spread_stale(&mut self) {
        for f in 0..self.stale.len() {
            if self.stale[f]
                && let Some(parent) = self.tree.parent[f]
            {
                self.stale[parent] = true;
            }
        }
        for f in (0..self.stale.len()).rev() {
            if let Some(parent) = self.tree.parent[f]
                && self.places.whole[parent]
            {
                self.stale[f] = self.stale[parent];
            }
        }
    }

    /// Solves with the factor. `x` is in the elimination order: the right-hand side on entry, the
    /// solution on return.
    pub fn solve(&mut self, x: &mut [f64]) {
        let Multifrontal { tree, places, simd, factor, vectors, .. } = self;
        let sweep = Sweep::<D> { tree, places, simd: *simd, factor };
        if let Some(root) = tree.fronts.len().checked_sub(1) {
            sweep.forward(root, Unknowns { x, vectors }, SHARED_DEPTH);
            sweep.backward(root, Unknowns { x, vectors }, None, SHARED_DEPTH);
        }
    }
}

/// Entries needed for the updates below a front while it is recomputed.
fn workspace<const D: usize>(tree: &Tree, f: usize) -> usize {
    match tree.fronts[f].source {
        Source::Cells(_) => 0,
        Source::Children(_) => {
            let children = tree.children(f);
            let updates: usize = children.iter().map(|&c| size::<D>(tree, c).update()).sum();
            let below = children.iter().map(|&c| workspace::<D>(tree, c)).max();
            updates + below.unwrap_or(0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::element::SKELETON_NODES;
    use super::super::element::pair;
    use super::*;
    use crate::space::mesh::{Axis, Mesh};
    use crate::threads;
    use rand::{Rng, SeedableRng};

    fn mesh(n: [usize; 2], periodic: [bool; 2]) -> Mesh {
        let axis = |n: usize, periodic| Axis::new((0..=n).map(|i| i as f64).collect(), periodic);
        let mut mesh = Mesh::new(axis(n[0], periodic[0]), axis(n[1], periodic[1]));
        // A block of solid cells in a corner.
        (0..mesh.cells() / 9).for_each(|c| mesh.solid[c] = true);
        mesh
    }

    /// The matrix `G G' + I` of a random `G` for each cell.
    fn matrices<const D: usize>(mesh: &Mesh, seed: u64) -> Vec<CellBlocks<D>> {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let n = 8 * D;
        let mut one = || {
            let g: Vec<f64> = (0..n * n).map(|_| rng.random_range(-0.5..0.5)).collect();
            let mut out = [[[0.0; D]; D]; 36];
            for k in 0..8 {
                for l in 0..=k {
                    for r in 0..D {
                        for c in 0..D {
                            let (i, j) = (D * k + r, D * l + c);
                            out[pair(k, l)][r][c] = f64::from(i == j)
                                + (0..n).map(|m| g[i * n + m] * g[j * n + m]).sum::<f64>();
                        }
                    }
                }
            }
            out
        };
        (0..mesh.cells()).map(|_| one()).collect()
    }

    fn times<const D: usize>(
        mesh: &Mesh,
        tree: &Tree,
        cells: &[CellBlocks<D>],
        x: &[f64],
    ) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        for (cell, blocks) in cells.iter().enumerate().filter(|&(c, _)| !mesh.solid[c]) {
            let nodes = mesh.cell_nodes(cell);
            let at = SKELETON_NODES.map(|a| D * tree.position[nodes[a]] as usize);
            for k in 0..8 {
                for l in 0..=k {
                    for r in 0..D {
                        for c in 0..D {
                            let (i, j, v) = (at[k] + r, at[l] + c, blocks[pair(k, l)][r][c]);
                            out[i] += v * x[j];
                            if k != l {
                                out[j] += v * x[i];
                            }
                        }
                    }
                }
            }
        }
        out
    }

    fn shapes() -> [Mesh; 5] {
        [
            mesh([1, 1], [false; 2]),
            mesh([7, 5], [false; 2]),
            mesh([30, 19], [false; 2]),
            mesh([12, 21], [true, false]),
            mesh([18, 20], [true; 2]),
        ]
    }

    fn solutions_satisfy_their_equations<const D: usize>() {
        for mesh in shapes() {
            let tree = Arc::new(Tree::new(&mesh));
            let cells = matrices::<D>(&mesh, 3);
            let mut factor = Multifrontal::<D>::new(tree.clone(), mesh.cells());
            factor.factorize(&cells).unwrap();
            let x: Vec<f64> = (0..factor.unknowns()).map(|k| (k as f64).sin()).collect();
            let mut y = times(&mesh, &tree, &cells, &x);
            factor.solve(&mut y);
            assert!(x.iter().zip(&y).all(|(x, y)| (x - y).abs() < 1e-12));
        }
    }

    #[test]
    fn solutions_satisfy_the_equations() {
        solutions_satisfy_their_equations::<2>();
        solutions_satisfy_their_equations::<3>();
    }

    #[test]
    fn a_factor_of_what_changed_is_the_factor_of_all_to_the_bit() {
        for mesh in shapes() {
            let tree = Arc::new(Tree::new(&mesh));
            let (mut cells, other) = (matrices::<2>(&mesh, 5), matrices::<2>(&mesh, 6));
            let mut kept = Multifrontal::<2>::new(tree.clone(), mesh.cells());
            kept.factorize(&cells).unwrap();
            for round in 0..3 {
                for cell in (0..mesh.cells()).filter(|c| c % 97 == 13 * round % 97) {
                    cells[cell] = other[cell];
                    kept.touch(cell);
                }
                kept.factorize(&cells).unwrap();
                let mut fresh = Multifrontal::<2>::new(tree.clone(), mesh.cells());
                fresh.factorize(&cells).unwrap();
                assert_eq!(kept.factor, fresh.factor);
                assert!(mesh.cells() < 100 || kept.effort().entries < fresh.effort().entries);
            }
        }
    }

    #[test]
    fn no_bit_depends_on_the_number_of_threads() {
        let mesh = mesh([60, 45], [false; 2]);
        let tree = Arc::new(Tree::new(&mesh));
        let cells = matrices::<3>(&mesh, 8);
        let run = || {
            let mut factor = Multifrontal::<3>::new(tree.clone(), mesh.cells());
            factor.factorize(&cells).unwrap();
            let mut x: Vec<f64> = (0..factor.unknowns()).map(|k| (k as f64).cos()).collect();
            factor.solve(&mut x);
            (factor.factor, x)
        };
        let one = threads::alone(run);
        for threads in [2, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert!(pool.install(run) == one, "{threads} threads");
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused_until_it_is_mended() {
        let mesh = mesh([20, 20], [false; 2]);
        let tree = Arc::new(Tree::new(&mesh));
        let mut cells = matrices::<2>(&mesh, 9);
        let good = cells[210];
        cells[210].iter_mut().flatten().flatten().for_each(|v| *v *= -9.0);
        let mut factor = Multifrontal::<2>::new(tree.clone(), mesh.cells());
        let error = factor.factorize(&cells).unwrap_err();
        let node = tree.node[error.unknown / 2] as usize;
        let [x, y] = mesh.node_position(node);
        assert!((x - 10.5).abs() < 3.0 && (y - 10.5).abs() < 3.0, "{x} {y}");
        cells[210] = good;
        factor.factorize(&cells).unwrap();
        let mut fresh = Multifrontal::<2>::new(tree, mesh.cells());
        fresh.factorize(&cells).unwrap();
        assert_eq!(factor.factor, fresh.factor);
    }

    #[test]
    fn work_and_memory_grow_as_nested_dissection_says() {
        let effort = |n: usize| {
            let mesh = Mesh::new(
                Axis::new((0..=n).map(|i| i as f64).collect(), false),
                Axis::new((0..=n).map(|i| i as f64).collect(), false),
            );
            let factor = Multifrontal::<2>::new(Arc::new(Tree::new(&mesh)), mesh.cells());
            factor.effort_ahead()
        };
        let (coarse, fine) = (effort(64), effort(256));
        let exponent = |a: f64, b: f64| (b / a).ln() / 16f64.ln();
        // On coarse meshes rims are relatively small, so the exponents approach their limits from
        // above.
        let flops = exponent(coarse.all_flops, fine.all_flops);
        assert!(flops > 1.5 && flops < 1.6, "{flops}");
        let entries = exponent(coarse.all_entries as f64, fine.all_entries as f64);
        assert!(entries > 1.0 && entries < 1.15, "{entries}");
    }
}
