//! This module wraps faer's supernodal Cholesky factorisation of the same matrix, with the same
//! order of elimination.

use faer::dyn_stack::{MemBuffer, MemStack};
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
use std::collections::BTreeMap;

/// A sparse matrix and its Cholesky factor by faer.
pub struct FaerLlt {
    col_ptr: Vec<usize>,
    row_idx: Vec<usize>,
    values: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    scratch: MemBuffer,
}

impl FaerLlt {
    /// Makes the matrix from its entries on and below the diagonal: one map of rows per column.
    pub fn new(columns: &[BTreeMap<usize, f64>]) -> super::Outcome<Self> {
        let n = columns.len();
        let (mut col_ptr, mut row_idx, mut values) = (vec![0], vec![], vec![]);
        let mut upper: Vec<Vec<usize>> = vec![vec![]; n];
        for (c, column) in columns.iter().enumerate() {
            row_idx.extend(column.keys());
            values.extend(column.values());
            col_ptr.push(row_idx.len());
            column.keys().for_each(|&r| upper[r].push(c));
        }
        let mut upper_ptr = vec![0];
        for rows in &upper {
            upper_ptr.push(upper_ptr[upper_ptr.len() - 1] + rows.len());
        }
        let upper = upper.concat();
        let symbolic = factorize_symbolic_cholesky(
            SymbolicSparseColMatRef::new_checked(n, n, &upper_ptr, None, &upper),
            Side::Upper,
            SymmetricOrdering::Identity,
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .map_err(|e| format!("{e:?}"))?;
        let supernodal = supernodal(&symbolic)?;
        let spec = Default::default();
        let scratch = MemBuffer::new(
            factorize_supernodal_numeric_llt_scratch::<usize, f64>(supernodal, Par::Seq, spec)
                .or(supernodal.solve_in_place_scratch::<f64>(1, Par::Seq)),
        );
        let factor = vec![0.0; symbolic.len_val()];
        Ok(FaerLlt { col_ptr, row_idx, values, symbolic, factor, scratch })
    }

    /// Factors the matrix on one thread.
    pub fn factorize(&mut self) -> super::Outcome<()> {
        let n = self.col_ptr.len() - 1;
        let pattern =
            SymbolicSparseColMatRef::new_checked(n, n, &self.col_ptr, None, &self.row_idx);
        factorize_supernodal_numeric_llt(
            &mut self.factor,
            SparseColMatRef::new(pattern, &self.values),
            Default::default(),
            supernodal(&self.symbolic)?,
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        )
        .map_err(|e| format!("{e:?}"))?;
        Ok(())
    }

    /// Solves in place: `x` is the right-hand side, then the solution.
    pub fn solve(&mut self, x: &mut [f64]) -> super::Outcome<()> {
        let n = x.len();
        SupernodalLltRef::new(supernodal(&self.symbolic)?, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        Ok(())
    }
}

/// The supernodal symbolic factorisation.
fn supernodal(s: &SymbolicCholesky<usize>) -> super::Outcome<&SymbolicSupernodalCholesky<usize>> {
    match s.raw() {
        SymbolicCholeskyRaw::Supernodal(s) => Ok(s),
        SymbolicCholeskyRaw::Simplicial(_) => Err("faer chose the simplicial path".into()),
    }
}
