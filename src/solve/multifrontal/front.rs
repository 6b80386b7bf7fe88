//! This module defines the dense matrix of one front and its elimination.
//!
//! ```text
//! [ F11  .   ]     F11 = L11 L11',   L21 = F21 L11^-T,   U = F22 - L21 L21'
//! [ F21  F22 ]
//! ```
//! `F11` and `F21` are the *panel*, which the columns of the factor replace. `F22`, of which only
//! the lower triangle is used, becomes the *update* that the parent is assembled from. The update
//! is stored in blocks of [`BLOCK`] columns, each from its first diagonal entry down.

use super::kernels::{self, Columns, ColumnsMut, PANEL, Product};
use super::tree::Run;
use crate::simd::Simd;

/// Number of columns of a block of an update.
const BLOCK: usize = 64;

/// Number of columns of the panel that are updated together.
const WIDE: usize = 8 * PANEL;

/// Number of unknowns of a front.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Number of unknowns that the front eliminates.
    pub own: usize,
    /// Number of unknowns on its rim.
    pub rim: usize,
}

impl Size {
    /// Number of rows of the panel: all unknowns of the front.
    pub fn rows(self) -> usize {
        self.own + self.rim
    }
    /// Entries of the panel.
    pub fn panel(self) -> usize {
        self.own * self.rows()
    }
    /// Additions and multiplications of the elimination.
    pub fn flops(self) -> f64 {
        let (p, b) = (self.own as f64, self.rim as f64);
        p * p * p / 3.0 + p * p * b + p * b * b
    }
    /// Entries of the stored update.
    pub fn update(self) -> usize {
        update_len(self.rim)
    }
}

/// Entries of an update of `rim` unknowns.
fn update_len(rim: usize) -> usize {
    let (full, rest) = (rim / BLOCK, rim % BLOCK);
    block_start(rim, full) + rest * rest
}

/// Index of the first entry of block `k` of columns.
fn block_start(rim: usize, k: usize) -> usize {
    BLOCK * k * rim - BLOCK * BLOCK * (k * k - k) / 2
}

/// Index of the diagonal entry of column `j` of an update.
fn column_start(rim: usize, j: usize) -> usize {
    let k = j / BLOCK;
    let within = j - k * BLOCK;
    block_start(rim, k) + within * (rim - k * BLOCK) + within
}

/// Update of a child, with the runs of unknowns that are consecutive in both child and parent. Both
/// indices ascend from run to run.
pub struct Child<'a> {
    /// Number of unknowns of the update.
    pub rim: usize,
    /// Entries of the update.
    pub update: &'a [f64],
    /// Runs of nodes, in ascending order.
    pub runs: &'a [Run],
}

/// The matrix of a front.
pub struct Matrix<'a> {
    /// Number of unknowns.
    pub size: Size,
    /// Entries of the panel, column by column.
    pub panel: &'a mut [f64],
    /// Entries of the update, block by block.
    pub update: &'a mut [f64],
}

impl Matrix<'_> {
    /// Sets all entries to zero.
    pub fn clear(&mut self) {
        self.panel.fill(0.0);
        self.update.fill(0.0);
    }

    /// All stored entries of a column, including those above the diagonal.
    fn whole_column(&mut self, j: usize) -> &mut [f64] {
        let Size { own, rim } = self.size;
        if j < own {
            let rows = own + rim;
            &mut self.panel[j * rows..(j + 1) * rows]
        } else {
            let (k, within) = ((j - own) / BLOCK, (j - own) % BLOCK);
            let rows = rim - k * BLOCK;
            let start = block_start(rim, k) + within * rows;
            &mut self.update[start..start + rows]
        }
    }

    /// Entries of a column from row `i` on; row `i` must not be above the diagonal.
    fn column_from(&mut self, j: usize, i: usize) -> &mut [f64] {
        let Size { own, rim } = self.size;
        if j < own {
            let rows = own + rim;
            &mut self.panel[j * rows + i..(j + 1) * rows]
        } else {
            let (i, j) = (i - own, j - own);
            let start = column_start(rim, j) + (i - j);
            &mut self.update[start..start + rim - i]
        }
    }

    /// Adds the block of a pair of nodes with `D` unknowns each. If `transposed`, the entry of
    /// unknown `r` of the row node and unknown `c` of the column node is `block[c][r]`.
    pub fn add_block<const D: usize>(
        &mut self,
        [row, column]: [usize; 2],
        block: &[[f64; D]; D],
        transposed: bool,
    ) {
        for c in 0..D {
            let from = if row == column { c } else { 0 };
            let target = self.column_from(D * column + c, D * row + from);
            for r in from..D {
                target[r - from] += if transposed { block[c][r] } else { block[r][c] };
            }
        }
    }

    /// Sets the matrix to the sum of the updates of the children. It proceeds column by column, so
    /// large fronts pass through the cache once.
    pub fn assemble<const D: usize>(&mut self, mut children: [Child; 2]) {
        for to in 0..self.size.rows() {
            self.whole_column(to).fill(0.0);
            for child in &mut children {
                let Some((run, later)) = child.runs.split_first() else { continue };
                let first = D * run.parent as usize;
                if to < first {
                    continue;
                }
                let k = to - first;
                let j = D * run.child as usize + k;
                let column = &child.update[column_start(child.rim, j)..];
                // The rest of this run, then the later runs.
                let rest = D * run.len as usize - k;
                add(&mut self.column_from(to, to)[..rest], &column[..rest]);
                for other in later {
                    let len = D * other.len as usize;
                    let from = D * other.child as usize - j;
                    let to = &mut self.column_from(to, D * other.parent as usize)[..len];
                    add(to, &column[from..from + len]);
                }
                if rest == 1 {
                    child.runs = later;
                }
            }
        }
    }

    /// Eliminates the own unknowns.
    ///
    /// # Errors
    /// Returns the index of an unknown whose pivot is not positive and finite.
    pub fn eliminate(&mut self, simd: Simd) -> Result<(), usize> {
        let Size { own, rim } = self.size;
        if own == 0 {
            // All own unknowns lie inside of solids.
            return Ok(());
        }
        let ld = own + rim;
        let mut k = 0;
        while k < own {
            let width = WIDE.min(own - k);
            self.eliminate_columns(simd, k, width)?;
            k += width;
        }
        let mut j = 0;
        while j < rim {
            let width = BLOCK.min(rim - j);
            let c =
                ColumnsMut { data: &mut self.update[block_start(rim, j / BLOCK)..], ld: rim - j };
            let l = Columns { data: &self.panel[own + j..], ld };
            let size = Product { rows: rim - j, columns: width, depth: own };
            kernels::subtract_square(simd, c, l, size);
            j += width;
        }
        Ok(())
    }

    /// Eliminates columns `k..k + width` of the panel; the columns before them are already
    /// eliminated.
    fn eliminate_columns(&mut self, simd: Simd, k: usize, width: usize) -> Result<(), usize> {
        let ld = self.size.rows();
        let rows = ld - k;
        let (before, here) = self.panel.split_at_mut(k * ld);
        if k > 0 {
            let l = Columns { data: &before[k..], ld };
            let c = ColumnsMut { data: &mut here[k..], ld };
            kernels::subtract_square(simd, c, l, Product { rows, columns: width, depth: k });
        }
        let mut j = 0;
        while j < width {
            let columns = PANEL.min(width - j);
            let at = k + j;
            let (before, here) = here.split_at_mut(j * ld);
            if j > 0 {
                let l = Columns { data: &before[at..], ld };
                let c = ColumnsMut { data: &mut here[at..], ld };
                kernels::subtract_square(simd, c, l, Product { rows: ld - at, columns, depth: j });
            }
            let c = ColumnsMut { data: &mut here[at..], ld };
            kernels::factor_panel(simd, c, ld - at, columns).map_err(|i| at + i)?;
            j += columns;
        }
        Ok(())
    }
}

fn add(to: &mut [f64], from: &[f64]) {
    for (t, f) in to.iter_mut().zip(from) {
        *t += f;
    }
}
