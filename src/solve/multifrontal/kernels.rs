//! This module contains dense kernels on columns, compiled for the widest vectors of the processor
//! (see [`simd`](crate::simd)). Matrices are stored column by column: entry `(i, j)` is at
//! `i + j ld`.

mod substitution;

use crate::simd::{Simd, dispatch, multiply_add};
use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use substitution::{backward_kernel, forward_kernel};

/// Number of columns of a panel that are eliminated together.
pub const PANEL: usize = 8;

/// Smallest depth at which the packed product of faer is faster.
const PACKED_DEPTH: usize = 48;
/// Smallest number of rows at which the packed product of faer is faster.
const PACKED_ROWS: usize = 96;

/// Read-only columns of a matrix.
#[derive(Clone, Copy)]
pub struct Columns<'a> {
    /// Entries, column by column.
    pub data: &'a [f64],
    /// Distance between the starts of two columns, in entries.
    pub ld: usize,
}

/// Mutable columns of a matrix.
pub struct ColumnsMut<'a> {
    /// Entries, column by column.
    pub data: &'a mut [f64],
    /// Distance between the starts of two columns, in entries.
    pub ld: usize,
}

/// Size of a product `A B'`: `A` has `rows` rows, `B` has `columns`, both have `depth` columns.
#[derive(Clone, Copy)]
pub struct Product {
    /// Rows of `A`.
    pub rows: usize,
    /// Rows of `B`, the columns of the product.
    pub columns: usize,
    /// Columns of `A` and `B`.
    pub depth: usize,
}

dispatch! {
    /// `C -= A B'` on and below the diagonal, where `B` is the first rows of `A`.
    fn subtract_small(c: ColumnsMut, a: Columns, size: Product) = subtract_square_kernel
}
dispatch! {
    /// Eliminates the first `columns` columns, at most [`PANEL`], of a matrix of `rows` rows.
    /// Afterwards they are columns of its Cholesky factor, with the reciprocal of each diagonal
    /// entry in its place. The error is the index of a pivot that is not positive and finite.
    pub fn factor_panel(c: ColumnsMut, rows: usize, columns: usize) -> Result<(), usize>
        = factor_panel_kernel
}
dispatch! {
    /// Forward substitution with columns of a factor: `x` becomes `L1^-1 x`; then `rest -= L2 x`.
    pub fn forward(l: Columns, x: &mut [f64], rest: &mut [f64]) = forward_kernel
}
dispatch! {
    /// Backward substitution: `x` becomes `L1^-T (x - L2' rest)`.
    pub fn backward(l: Columns, x: &mut [f64], rest: &[f64]) = backward_kernel
}

/// `C -= A B'` on and below the diagonal, where `B` is the first rows of `A`. Below the first
/// square, large products use the packed product of faer.
pub fn subtract_square(simd: Simd, c: ColumnsMut, a: Columns, size: Product) {
    let Product { rows, columns, depth } = size;
    if depth < PACKED_DEPTH || rows < PACKED_ROWS {
        return subtract_small(simd, c, a, size);
    }
    let ColumnsMut { data, ld } = c;
    subtract_small(simd, ColumnsMut { data, ld }, a, Product { rows: columns, ..size });
    if rows > columns {
        let below = rows - columns;
        matmul(
            MatMut::from_column_major_slice_with_stride_mut(
                &mut data[columns..],
                below,
                columns,
                ld,
            ),
            Accum::Add,
            MatRef::from_column_major_slice_with_stride(&a.data[columns..], below, depth, a.ld),
            MatRef::from_column_major_slice_with_stride(a.data, columns, depth, a.ld).transpose(),
            -1.0,
            Par::Seq,
        );
    }
}

/// `c - a b`.
#[inline(always)]
fn negated_product<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    multiply_add::<FMA>(-a, b, c)
}

#[inline(always)]
fn array<const N: usize>(data: &[f64], at: usize) -> &[f64; N] {
    match data[at..at + N].try_into() {
        Ok(a) => a,
        Err(_) => unreachable!("a slice of N has N entries"),
    }
}

#[inline(always)]
fn array_mut<const N: usize>(data: &mut [f64], at: usize) -> &mut [f64; N] {
    match (&mut data[at..at + N]).try_into() {
        Ok(a) => a,
        Err(_) => unreachable!("a slice of N has N entries"),
    }
}

#[inline(always)]
fn subtract_square_kernel<const R: usize, const FMA: bool>(
    c: ColumnsMut,
    a: Columns,
    Product { rows, columns, depth }: Product,
) {
    let mut j = 0;
    while j < columns {
        let here = ColumnsMut { data: &mut c.data[j * c.ld..], ld: c.ld };
        let b = Columns { data: &a.data[j..], ld: a.ld };
        if j + 4 <= columns {
            strip::<R, 4, FMA>(here, a, b, [j, rows], depth);
            j += 4;
        } else if j + 2 <= columns {
            strip::<R, 2, FMA>(here, a, b, [j, rows], depth);
            j += 2;
        } else {
            strip::<R, 1, FMA>(here, a, b, [j, rows], depth);
            j += 1;
        }
    }
}

/// Rows `from..to` of `C` columns of the product.
#[inline(always)]
fn strip<const R: usize, const C: usize, const FMA: bool>(
    mut c: ColumnsMut,
    a: Columns,
    b: Columns,
    [from, to]: [usize; 2],
    depth: usize,
) {
    let mut i = from;
    while i + R <= to {
        tile::<R, C, FMA>(&mut c, a, b, i, depth);
        i += R;
    }
    if R > 8 && i + 8 <= to {
        tile::<8, C, FMA>(&mut c, a, b, i, depth);
        i += 8;
    }
    if i + 4 <= to {
        tile::<4, C, FMA>(&mut c, a, b, i, depth);
        i += 4;
    }
    if i + 2 <= to {
        tile::<2, C, FMA>(&mut c, a, b, i, depth);
        i += 2;
    }
    if i < to {
        tile::<1, C, FMA>(&mut c, a, b, i, depth);
    }
}

#[inline(always)]
fn tile<const R: usize, const C: usize, const FMA: bool>(
    c: &mut ColumnsMut,
    a: Columns,
    b: Columns,
    i: usize,
    depth: usize,
) {
    let mut sum: [[f64; R]; C] = std::array::from_fn(|j| *array(c.data, i + j * c.ld));
    for k in 0..depth {
        let a: &[f64; R] = array(a.data, i + k * a.ld);
        let b: &[f64; C] = array(b.data, k * b.ld);
        for j in 0..C {
            for r in 0..R {
                sum[j][r] = negated_product::<FMA>(a[r], b[j], sum[j][r]);
            }
        }
    }
    for j in 0..C {
        *array_mut(c.data, i + j * c.ld) = sum[j];
    }
}

#[inline(always)]
fn factor_panel_kernel<const R: usize, const FMA: bool>(
    c: ColumnsMut,
    rows: usize,
    columns: usize,
) -> Result<(), usize> {
    let ColumnsMut { data, ld } = c;
    // The diagonal block; entry `(i, j)` is at `[j][i]`.
    let mut l = [[0.0; PANEL]; PANEL];
    let mut inverse = [0.0; PANEL];
    for j in 0..columns {
        for i in j..columns {
            let mut s = data[i + j * ld];
            for k in 0..j {
                s = negated_product::<FMA>(l[k][i], l[k][j], s);
            }
            l[j][i] = s;
        }
        // No matrix entry acts on this unknown: its value is unchanged.
        if l[j][j] == 0.0 {
            l[j][j] = 1.0;
        }
        if !(l[j][j] > 0.0 && l[j][j].is_finite()) {
            return Err(j);
        }
        let root = l[j][j].sqrt();
        inverse[j] = 1.0 / root;
        l[j][j] = root;
        for i in j + 1..columns {
            l[j][i] *= inverse[j];
        }
        data[j + j * ld] = inverse[j];
        for i in j + 1..columns {
            data[i + j * ld] = l[j][i];
        }
    }
    let mut i = columns;
    if columns == PANEL {
        while i + 8 <= rows {
            below::<8, FMA>(data, ld, i, &l, &inverse);
            i += 8;
        }
        while i + 2 <= rows {
            below::<2, FMA>(data, ld, i, &l, &inverse);
            i += 2;
        }
    }
    for i in i..rows {
        let mut x = [0.0; PANEL];
        for j in 0..columns {
            let mut s = data[i + j * ld];
            for k in 0..j {
                s = negated_product::<FMA>(x[k], l[k][j], s);
            }
            x[j] = s * inverse[j];
            data[i + j * ld] = x[j];
        }
    }
    Ok(())
}

/// Computes rows below a full diagonal block: `X L' = A`.
#[inline(always)]
fn below<const R: usize, const FMA: bool>(
    data: &mut [f64],
    ld: usize,
    i: usize,
    l: &[[f64; PANEL]; PANEL],
    inverse: &[f64; PANEL],
) {
    let mut x = [[0.0; R]; PANEL];
    for j in 0..PANEL {
        let column: &mut [f64; R] = array_mut(data, i + j * ld);
        let mut s = *column;
        for k in 0..j {
            for r in 0..R {
                s[r] = negated_product::<FMA>(x[k][r], l[k][j], s[r]);
            }
        }
        for r in 0..R {
            x[j][r] = s[r] * inverse[j];
        }
        *column = x[j];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd;

    fn numbers(n: usize) -> Vec<f64> {
        (0..n).map(|k| ((k * k) as f64 * 0.37 + 1.0).sin()).collect()
    }

    /// The kernels of every instruction set agree with plain loops.
    #[test]
    fn products_are_those_of_plain_loops() {
        for simd in simd::all() {
            for (rows, columns, depth) in [(1, 1, 1), (7, 3, 2), (42, 32, 10), (130, 17, 64)] {
                let (ld_a, ld_c) = (rows + 3, rows + 1);
                let a = numbers(ld_a * depth);
                let before = numbers(ld_c * columns);
                let mut c = before.clone();
                let size = Product { rows, columns, depth };
                let to = ColumnsMut { data: &mut c, ld: ld_c };
                subtract_square(simd, to, Columns { data: &a, ld: ld_a }, size);
                for j in 0..columns {
                    for i in j..rows {
                        let sum: f64 = (0..depth).map(|k| a[i + k * ld_a] * a[j + k * ld_a]).sum();
                        let expected = before[i + j * ld_c] - sum;
                        let got = c[i + j * ld_c];
                        assert!((got - expected).abs() < 1e-12, "{simd:?} {i} {j}");
                    }
                }
            }
        }
    }

    /// `L1 L1'` and `L2 L1'` reproduce the matrix, and both substitutions invert it.
    #[test]
    fn panels_and_substitutions_invert() {
        for simd in simd::all() {
            for (own, rim) in [(1, 0), (2, 5), (8, 8), (10, 32), (21, 13)] {
                let rows = own + rim;
                let mut a = vec![0.0; rows * own];
                let noise = numbers(rows * own);
                for j in 0..own {
                    for i in j..rows {
                        a[i + j * rows] =
                            if i == j { rows as f64 } else { 0.5 * noise[i + j * rows] };
                    }
                }
                let mut l = a.clone();
                let mut at = 0;
                while at < own {
                    let columns = PANEL.min(own - at);
                    let (before, here) = l.split_at_mut(at * rows);
                    if at > 0 {
                        let size = Product { rows: rows - at, columns, depth: at };
                        let c = ColumnsMut { data: &mut here[at..], ld: rows };
                        let known = Columns { data: &before[at..], ld: rows };
                        subtract_square(simd, c, known, size);
                    }
                    let c = ColumnsMut { data: &mut here[at..], ld: rows };
                    factor_panel(simd, c, rows - at, columns).unwrap();
                    at += columns;
                }
                let entry = |i: usize, j: usize| match i.cmp(&j) {
                    std::cmp::Ordering::Less => 0.0,
                    std::cmp::Ordering::Equal => 1.0 / l[i + j * rows],
                    std::cmp::Ordering::Greater => l[i + j * rows],
                };
                for j in 0..own {
                    for i in j..rows {
                        let product: f64 = (0..=j).map(|k| entry(i, k) * entry(j, k)).sum();
                        assert!((product - a[i + j * rows]).abs() < 1e-12 * rows as f64);
                    }
                }
                // L [x; rest'] = [b; rest]: the forward substitution gives x and subtracts L2 x
                // from rest.
                let (b, rest) = (numbers(own), numbers(rim));
                let (mut x, mut left) = (b.clone(), rest.clone());
                let columns = Columns { data: &l, ld: rows };
                forward(simd, columns, &mut x, &mut left);
                for i in 0..rows {
                    let product: f64 = (0..own).map(|k| entry(i, k) * x[k]).sum();
                    let expected = if i < own { b[i] } else { rest[i - own] - left[i - own] };
                    assert!((product - expected).abs() < 1e-12, "{simd:?} {i}");
                }
                let mut y = b.clone();
                backward(simd, columns, &mut y, &rest);
                for j in 0..own {
                    let known = y.iter().chain(&rest).enumerate().skip(j);
                    let product: f64 = known.map(|(i, v)| entry(i, j) * v).sum();
                    assert!((product - b[j]).abs() < 1e-11, "{simd:?} {j}");
                }
            }
        }
    }

    #[test]
    fn pivots_that_are_not_positive_are_named_and_idle_ones_pass() {
        for simd in simd::all() {
            let mut a = vec![0.0; 16];
            (a[0], a[5], a[10], a[15]) = (4.0, 0.0, -1.0, 1.0);
            let c = ColumnsMut { data: &mut a, ld: 4 };
            assert_eq!(factor_panel(simd, c, 4, 4), Err(2));
            let mut a = vec![f64::NAN];
            assert_eq!(factor_panel(simd, ColumnsMut { data: &mut a, ld: 1 }, 1, 1), Err(0));
        }
    }
}
