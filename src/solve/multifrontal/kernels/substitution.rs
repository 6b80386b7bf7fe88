//! This module contains the kernels of the forward and backward substitution.

use super::*;

/// Kernel of [`forward`].
#[inline(always)]
pub(super) fn forward_kernel<const R: usize, const FMA: bool>(
    l: Columns,
    x: &mut [f64],
    rest: &mut [f64],
) {
    let own = x.len();
    let mut k = 0;
    while k < own {
        let width = PANEL.min(own - k);
        let (done, ahead) = x[k..].split_at_mut(width);
        let top = &l.data[k * l.ld + k..];
        for j in 0..width {
            let column = &top[j * l.ld..j * l.ld + width];
            let xj = done[j] * column[j];
            done[j] = xj;
            for i in j + 1..width {
                done[i] = negated_product::<FMA>(column[i], xj, done[i]);
            }
        }
        let below = Columns { data: &top[width..], ld: l.ld };
        let rim = Columns { data: &l.data[k * l.ld + own..], ld: l.ld };
        let mut j = 0;
        while j < width {
            let wide = part_of_panel(width - j);
            for (a, y) in [(below, &mut *ahead), (rim, &mut *rest)] {
                let (a, x) = (a.after_columns(j), &done[j..]);
                match wide {
                    8 => subtract_columns::<8, FMA>(a, x, y),
                    4 => subtract_columns::<4, FMA>(a, x, y),
                    2 => subtract_columns::<2, FMA>(a, x, y),
                    _ => subtract_columns::<1, FMA>(a, x, y),
                }
            }
            j += wide;
        }
        k += width;
    }
}

/// Number of columns of a panel that are processed together if `columns` remain.
#[inline(always)]
pub(super) fn part_of_panel(columns: usize) -> usize {
    match columns {
        8.. => 8,
        4.. => 4,
        2.. => 2,
        _ => 1,
    }
}

impl<'a> Columns<'a> {
    /// The columns from column `j` on.
    #[inline(always)]
    fn after_columns(self, j: usize) -> Columns<'a> {
        Columns { data: &self.data[(j * self.ld).min(self.data.len())..], ld: self.ld }
    }

    /// The first `rows` entries of each of the first `W` columns.
    #[inline(always)]
    fn first<const W: usize>(self, rows: usize) -> [&'a [f64]; W] {
        std::array::from_fn(|k| &self.data[k * self.ld..k * self.ld + rows])
    }
}

/// `y -= A x` for the first `W` columns.
#[inline(always)]
pub(super) fn subtract_columns<const W: usize, const FMA: bool>(
    a: Columns,
    x: &[f64],
    y: &mut [f64],
) {
    let rows = y.len();
    if rows == 0 {
        return;
    }
    let x: &[f64; W] = array(x, 0);
    let columns = a.first::<W>(rows);
    let mut i = 0;
    while i + 8 <= rows {
        let y: &mut [f64; 8] = array_mut(y, i);
        let mut s = *y;
        for k in 0..W {
            let c: &[f64; 8] = array(columns[k], i);
            for r in 0..8 {
                s[r] = negated_product::<FMA>(c[r], x[k], s[r]);
            }
        }
        *y = s;
        i += 8;
    }
    for i in i..rows {
        for k in 0..W {
            y[i] = negated_product::<FMA>(columns[k][i], x[k], y[i]);
        }
    }
}

/// Kernel of [`backward`].
#[inline(always)]
pub(super) fn backward_kernel<const R: usize, const FMA: bool>(
    l: Columns,
    x: &mut [f64],
    rest: &[f64],
) {
    let own = x.len();
    let mut k = own;
    while k > 0 {
        // If there is a narrow panel, it is the last one.
        let width = if k.is_multiple_of(PANEL) { PANEL } else { k % PANEL };
        k -= width;
        let (done, ahead) = x[k..].split_at_mut(width);
        let top = &l.data[k * l.ld + k..];
        let below = Columns { data: &top[width..], ld: l.ld };
        let rim = Columns { data: &l.data[k * l.ld + own..], ld: l.ld };
        let mut j = 0;
        while j < width {
            let wide = part_of_panel(width - j);
            for (a, y) in [(below, &*ahead), (rim, rest)] {
                let (a, x) = (a.after_columns(j), &mut done[j..]);
                match wide {
                    8 => subtract_products::<8, FMA>(a, y, x),
                    4 => subtract_products::<4, FMA>(a, y, x),
                    2 => subtract_products::<2, FMA>(a, y, x),
                    _ => subtract_products::<1, FMA>(a, y, x),
                }
            }
            j += wide;
        }
        for j in (0..width).rev() {
            let column = &top[j * l.ld..j * l.ld + width];
            let mut s = done[j];
            for i in j + 1..width {
                s = negated_product::<FMA>(column[i], done[i], s);
            }
            done[j] = s * column[j];
        }
    }
}

/// `x -= A' y` for the first `W` columns.
#[inline(always)]
pub(super) fn subtract_products<const W: usize, const FMA: bool>(
    a: Columns,
    y: &[f64],
    x: &mut [f64],
) {
    let rows = y.len();
    if rows == 0 {
        return;
    }
    let columns = a.first::<W>(rows);
    let mut sum = [[0.0; 8]; W];
    let mut i = 0;
    while i + 8 <= rows {
        let y: &[f64; 8] = array(y, i);
        for k in 0..W {
            let c: &[f64; 8] = array(columns[k], i);
            for r in 0..8 {
                sum[k][r] = negated_product::<FMA>(c[r], y[r], sum[k][r]);
            }
        }
        i += 8;
    }
    for k in 0..W {
        let quarter: [f64; 4] = std::array::from_fn(|r| sum[k][r] + sum[k][r + 4]);
        let mut s = (quarter[0] + quarter[2]) + (quarter[1] + quarter[3]);
        for i in i..rows {
            s = negated_product::<FMA>(columns[k][i], y[i], s);
        }
        x[k] += s;
    }
}
