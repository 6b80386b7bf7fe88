//! This module holds the divergence of a cell that its material fills in part, with nothing beside it.
//!
//! Only the filled part of the cell keeps its volume, and its pressure is linear there:
//!
//! ```text
//! B_qa = integral over the filled part of  q d/dx N_a  (and d/dy),   q = 1, xi, eta made orthogonal there
//! ```
//! The free surface carries no traction: it is the natural condition. With the basis orthogonal on the
//! filled part, pressures are eliminated as in full cells, whatever the shape of the part, and a
//! hydrostatic pressure is exact.

use super::element::PointShape;
use crate::composition::straight::StraightCut;
use crate::space::measure::CellMeasure;
use crate::space::shape::{GAUSS_6X6, NODES, SUBPOINTS};

/// Divergence and pressure basis of the filled part of a cell.
#[derive(Clone, Debug)]
pub struct Filled {
    /// Rows of the divergence matrix, by pressure and component.
    pub divergence: [[[f64; NODES]; 2]; 3],
    /// Integral of the square of each function of the basis.
    pub mass: [f64; 3],
    /// Functions of the basis in terms of `1, xi, eta`; lower triangular with a unit diagonal.
    basis: [[f64; 3]; 3],
}

impl Filled {
    /// The second side of a line (`side` 1), or the first one (0), which fills the share `fill` of the
    /// cell; as far as the line is not trusted, the share is the same everywhere.
    pub fn of_side((cut, side): (&StraightCut, usize), fill: f64, cell: CellMeasure) -> Self {
        let own = |q: usize| if side == 1 { cut.share[q] } else { 1.0 - cut.share[q] };
        let share = |q: usize| cut.trust * own(q) + (1.0 - cut.trust) * fill;
        Self::of_shares(&std::array::from_fn(share), cell)
    }

    /// A cell whose material fills the same share of it everywhere.
    pub fn uniform(fill: f64, cell: CellMeasure) -> Self {
        Self::of_shares(&[fill; SUBPOINTS], cell)
    }

    /// A cell that is filled by given shares at the points of [`GAUSS_6X6`].
    fn of_shares(share: &[f64; SUBPOINTS], cell: CellMeasure) -> Self {
        let monomials = |r: [f64; 2]| [1.0, r[0], r[1]];
        let points = || {
            let points = GAUSS_6X6.iter().zip(share);
            points.map(|(g, share)| (g, cell.of_point(g.weight * share, g.r[0])))
        };
        let mut moments = [[0.0; 3]; 3];
        for (g, volume) in points() {
            let m = monomials(g.r);
            for (row, a) in moments.iter_mut().zip(m) {
                row.iter_mut().zip(m).for_each(|(sum, b)| *sum += volume * a * b);
            }
        }
        let product = |a: &[f64; 3], b: &[f64; 3]| -> f64 {
            (0..9).map(|k| a[k / 3] * moments[k / 3][k % 3] * b[k % 3]).sum()
        };
        let mut basis: [[f64; 3]; 3] =
            std::array::from_fn(|k| std::array::from_fn(|j| f64::from(u8::from(k == j))));
        let mut mass = [0.0; 3];
        for k in 0..3 {
            for j in 0..k {
                let along = product(&basis[k], &basis[j]) / mass[j];
                for i in 0..3 {
                    basis[k][i] -= along * basis[j][i];
                }
            }
            mass[k] = product(&basis[k], &basis[k]);
        }
        let mut divergence = [[[0.0; NODES]; 2]; 3];
        for (g, volume) in points() {
            let (s, m) = (PointShape::new(&g.shape, cell, g.r[0]), monomials(g.r));
            for (rows, q) in divergence.iter_mut().zip(&basis) {
                let q: f64 = volume * q.iter().zip(m).map(|(q, m)| q * m).sum::<f64>();
                for a in 0..NODES {
                    rows[0][a] += q * s.gx[a];
                    rows[1][a] += q * s.gy[a];
                }
            }
        }
        Filled { divergence, mass, basis }
    }

    /// Coefficients in the basis of the filled part, from those of `1, xi, eta`.
    pub fn coefficients(&self, [a, b, c]: [f64; 3]) -> [f64; 3] {
        let q = &self.basis;
        let b = b - c * q[2][1];
        [a - b * q[1][0] - c * q[2][0], b, c]
    }

    /// Coefficients of `1, xi, eta`, from those in the basis of the filled part.
    pub fn monomials(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|j| (0..3).map(|k| p[k] * self.basis[k][j]).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::measure::Measure;

    const SIZE: [f64; 2] = [0.5, 0.25];

    fn filled(share: f64, centroid: [f64; 2], side: usize) -> Filled {
        let cut = StraightCut::new(share, centroid).unwrap();
        let fill = if side == 1 { share } else { 1.0 - share };
        Filled::of_side((&cut, side), fill, Measure::PLANE.of_cell(SIZE, 0.0))
    }

    #[test]
    fn the_coefficients_of_a_pressure_are_those_of_the_same_function() {
        let filled = filled(0.3, [0.4, -0.5], 1);
        let p = [0.7, -2.0, 3.0];
        let back = filled.monomials(filled.coefficients(p));
        for (a, b) in p.iter().zip(back) {
            assert!((a - b).abs() < 1e-13);
        }
    }

    #[test]
    fn the_divergence_is_that_of_the_filled_part() {
        // u = x, v = 2 y has the divergence 3; the volume of the side is its share of the cell.
        let place = |a: usize| {
            let r = [(a % 3) as f64 - 1.0, (a / 3) as f64 - 1.0];
            [0, 1].map(|c| 0.5 * SIZE[c] * r[c])
        };
        for (side, volume) in [(1, 0.3), (0, 0.7)] {
            let filled = filled(0.3, [0.4, -0.5], side);
            let of = |q: usize| -> f64 {
                let [x, y] = &filled.divergence[q];
                (0..NODES).map(|a| x[a] * place(a)[0] + 2.0 * y[a] * place(a)[1]).sum()
            };
            let volume = volume * SIZE[0] * SIZE[1];
            assert!(
                (of(0) - 3.0 * volume).abs() < 1e-12 && (filled.mass[0] - volume).abs() < 1e-12
            );
            // The other functions are orthogonal to constants.
            assert!(of(1).abs() < 1e-12 && of(2).abs() < 1e-12, "{} {}", of(1), of(2));
        }
    }

    #[test]
    fn the_basis_exists_in_slivers() {
        let filled = filled(1e-3, [0.0, -0.999], 1);
        assert!(filled.mass.iter().all(|m| *m > 0.0), "{:?}", filled.mass);
    }
}
