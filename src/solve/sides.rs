//! This module computes the stiffness of a cell that a straight line cuts into two sides with
//! different weight: each side has its own law, and both share the biquadratic velocity.
//!
//! ```text
//! K = sum over both sides of  integral over the side of  d~.S d + beta tr~ tr
//! ```
//! The integrals are exact. For any line the matrix is therefore positive semi-definite, and a cell
//! that is mostly filled by the stiff fluid keeps its stiffness. The velocity cannot have a kink at
//! the line, so a thin sheet of fluid beside a stiff one is as stiff as the whole cell; this is an
//! error of the thin fluid alone, which decreases with the size of the cells.
//!
//! A [laminate](super::laminate) is in series in shear. Under weight this is wrong: the stress is
//! that of the thin fluid in the whole cell, and the weight of the stiff fluid drives it with
//! `rho g h^2/eta_thin`. Power of a surface of slope 0.4 at contrast 1e6, relative to a mesh that
//! follows the surface, at 8, 16, 32 cells: laminate 265, 35, 5.6.

use super::element::{LOCAL, Matrix, PointShape, mirror};
use super::laminate::VelocityMatrix;
use super::terms::viscous::add_stiffness;
use crate::composition::straight::StraightCut;
use crate::laws::mixture::Mixture;
use crate::laws::point::PointLaw;
use crate::space::measure::CellMeasure;
use crate::space::shape::GAUSS_6X6;

/// Stiffness matrix of a cell with the laws of the two materials; the shares of the line are those
/// of the second one.
pub fn matrix(cut: &StraightCut, laws: &[PointLaw; 2], cell: CellMeasure) -> VelocityMatrix {
    let mut k: Matrix = [[0.0; LOCAL]; LOCAL];
    for (g, &share) in GAUSS_6X6.iter().zip(&cut.share) {
        let mut mixture = Mixture::parallel();
        mixture.add(1.0 - share, &laws[0]);
        mixture.add(share, &laws[1]);
        let shape = PointShape::new(&g.shape, cell.size);
        add_stiffness::<2>(&mut k, &shape, &mixture.law(), cell.of_point(g.weight));
    }
    mirror::<2>(&mut k);
    std::array::from_fn(|i| std::array::from_fn(|j| k[i][j]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::director::Orientation;
    use crate::laws::{Here, Law};
    use crate::space::measure::Measure;
    use nalgebra::SMatrix;

    const SIZE: [f64; 2] = [0.7, 1.3];

    fn law(viscosity: f64) -> PointLaw {
        Law::default().at(&Here::at_rest(viscosity, &Orientation::default()))
    }

    fn cut(seed: i32) -> StraightCut {
        let k = f64::from(seed);
        let (share, angle) = (0.5 + 0.499 * (1.7 * k).sin(), 2.3 * k);
        let away = 0.9 * (1.0 - share);
        StraightCut::new(share, [away * angle.cos(), away * angle.sin()]).unwrap()
    }

    #[test]
    fn definite_for_any_line_and_contrast() {
        for seed in 0..60 {
            for exponent in [-8, -4, 0, 4, 8] {
                let thin = 10f64.powi(exponent).min(1.0);
                let laws = [law(1.0), law(10f64.powi(exponent))];
                let k = matrix(&cut(seed), &laws, Measure::PLANE.of_cell(SIZE));
                let k = SMatrix::<f64, 18, 18>::from_fn(|i, j| k[i][j]);
                let mut values: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
                values.sort_by(f64::total_cmp);
                let rounding = 1e-12 * values[17];
                assert!(values[0] > -rounding, "{seed} {exponent}: {values:?}");
                assert!(values[2] < rounding, "{seed} {exponent}: {values:?}");
                assert!(values[3] > 1e-4 * thin - rounding, "{seed} {exponent}: {values:?}");
            }
        }
    }

    #[test]
    fn equal_laws_give_the_uniform_matrix() {
        let cell = Measure::PLANE.of_cell(SIZE);
        let k = matrix(&cut(3), &[law(2.0), law(2.0)], cell);
        let mut uniform: Matrix = [[0.0; LOCAL]; LOCAL];
        for g in GAUSS_6X6.iter() {
            let shape = PointShape::new(&g.shape, SIZE);
            add_stiffness::<2>(&mut uniform, &shape, &law(2.0), cell.of_point(g.weight));
        }
        mirror::<2>(&mut uniform);
        for i in 0..18 {
            for j in 0..18 {
                assert!((k[i][j] - uniform[i][j]).abs() < 1e-12);
            }
        }
    }
}
