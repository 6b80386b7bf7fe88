//! Sparse Cholesky factorisation of the skeleton matrix: faer's supernodal LLT on a pattern that
//! is fixed for a run, refactored every step.
//!
//! Unknowns come in blocks of `D` per node, in the elimination order of [`Skeleton`]. The
//! supernodal path is forced: at these sizes the simplicial one is nine times slower.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::{
    SupernodalLltRef, SymbolicSupernodalCholesky, factorize_supernodal_numeric_llt,
    factorize_supernodal_numeric_llt_scratch,
};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::space::numbering::Skeleton;

/// Why a factorisation could not be made.
#[derive(Debug, thiserror::Error)]
pub enum FactorError {
    #[error("the matrix is not positive definite at skeleton unknown {unknown}")]
    NotPositiveDefinite { unknown: usize },
    #[error("the symbolic factorisation failed: {0}")]
    Symbolic(String),
}

/// A symmetric positive definite matrix on the skeleton, and its factor.
pub struct SparseCholesky {
    block: usize,
    /// Lower triangle, compressed columns.
    col_ptr: Vec<usize>,
    row_idx: Vec<usize>,
    values: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    scratch: MemBuffer,
}

impl SparseCholesky {
    /// Symbolic analysis for `block` unknowns per skeleton node.
    pub fn new(skeleton: &Skeleton, block: usize) -> Result<Self, FactorError> {
        let n = skeleton.len() * block;
        let (col_ptr, row_idx) = scalar_pattern(skeleton, block);
        let (upper_ptr, upper_idx) = transpose(n, &col_ptr, &row_idx);
        let upper = SymbolicSparseColMatRef::new_checked(n, n, &upper_ptr, None, &upper_idx);
        let symbolic = factorize_symbolic_cholesky(
            upper,
            Side::Upper,
            SymmetricOrdering::Identity,
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .map_err(|e| FactorError::Symbolic(format!("{e:?}")))?;
        let supernodal = as_supernodal(&symbolic)?;
        let scratch = MemBuffer::new(
            factorize_supernodal_numeric_llt_scratch::<usize, f64>(
                supernodal,
                Par::Seq,
                Default::default(),
            )
            .or(supernodal.solve_in_place_scratch::<f64>(1, Par::Seq)),
        );
        let factor = vec![0.0; symbolic.len_val()];
        let values = vec![0.0; row_idx.len()];
        Ok(SparseCholesky { block, col_ptr, row_idx, values, symbolic, factor, scratch })
    }

    pub fn unknowns(&self) -> usize {
        self.col_ptr.len() - 1
    }
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Where the block (row node, column node) of the lower triangle starts: the index of its
    /// entry in the first column, counted from `neighbour`, the row's rank below the diagonal.
    /// Column `c` of the block has its rows at `block_start(.., c) + r`.
    pub fn block_start(&self, column_node: usize, neighbour: usize, c: usize) -> usize {
        self.col_ptr[column_node * self.block + c] + (self.block - c) + neighbour * self.block
    }
    /// Index of entry (r, c), `r >= c`, of a diagonal block.
    pub fn diagonal_entry(&self, node: usize, r: usize, c: usize) -> usize {
        self.col_ptr[node * self.block + c] + (r - c)
    }

    /// Unit diagonal for unknowns that nothing acts on; returns how many there are.
    pub fn fill_empty_diagonal(&mut self) -> usize {
        let mut filled = 0;
        for &p in &self.col_ptr[..self.col_ptr.len() - 1] {
            if self.values[p] == 0.0 {
                self.values[p] = 1.0;
                filled += 1;
            }
        }
        filled
    }

    /// Factors the current values.
    pub fn factorize(&mut self) -> Result<(), FactorError> {
        let n = self.unknowns();
        let lower = SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, &self.col_ptr, None, &self.row_idx),
            &self.values,
        );
        factorize_supernodal_numeric_llt(
            &mut self.factor,
            lower,
            Default::default(),
            as_supernodal(&self.symbolic)?,
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        )
        .map(|_| ())
        .map_err(|LltError::NonPositivePivot { index }| FactorError::NotPositiveDefinite {
            unknown: index,
        })
    }

    /// Solves with the current factor, in place.
    pub fn solve(&mut self, rhs: &mut [f64]) -> Result<(), FactorError> {
        let n = self.unknowns();
        SupernodalLltRef::new(as_supernodal(&self.symbolic)?, &self.factor)
            .solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(rhs, n, 1),
                Par::Seq,
                MemStack::new(&mut self.scratch),
            );
        Ok(())
    }
}

fn as_supernodal(
    s: &SymbolicCholesky<usize>,
) -> Result<&SymbolicSupernodalCholesky<usize>, FactorError> {
    match s.raw() {
        SymbolicCholeskyRaw::Supernodal(s) => Ok(s),
        SymbolicCholeskyRaw::Simplicial(_) => {
            Err(FactorError::Symbolic("faer chose the simplicial path".into()))
        }
    }
}

/// Lower triangle of the matrix with `block` unknowns per node.
fn scalar_pattern(s: &Skeleton, block: usize) -> (Vec<usize>, Vec<usize>) {
    let mut col_ptr = Vec::with_capacity(s.len() * block + 1);
    let mut row_idx = Vec::new();
    col_ptr.push(0);
    for node in 0..s.len() {
        let below = &s.rows[s.col_ptr[node] as usize..s.col_ptr[node + 1] as usize];
        for c in 0..block {
            row_idx.extend((c..block).map(|r| node * block + r));
            for &b in below {
                row_idx.extend((0..block).map(|r| b as usize * block + r));
            }
            col_ptr.push(row_idx.len());
        }
    }
    (col_ptr, row_idx)
}

fn transpose(n: usize, col_ptr: &[usize], row_idx: &[usize]) -> (Vec<usize>, Vec<usize>) {
    let mut ptr = vec![0; n + 1];
    for &r in row_idx {
        ptr[r + 1] += 1;
    }
    for i in 0..n {
        ptr[i + 1] += ptr[i];
    }
    let mut next = ptr.clone();
    let mut idx = vec![0; row_idx.len()];
    for c in 0..n {
        for &r in &row_idx[col_ptr[c]..col_ptr[c + 1]] {
            idx[next[r]] = c;
            next[r] += 1;
        }
    }
    (ptr, idx)
}
