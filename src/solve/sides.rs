//! This module computes the stiffness of a cell that a straight line cuts into two sides with
//! different weight: each side has its own law, and both share the biquadratic velocity.
//!
//! ```text
//! K = sum over both sides of  integral over the side of  d~.S d + beta tr~ tr
//! ```
//! The integrals are exact. For any line the matrix is therefore positive semi-definite, and a cell
//! that is mostly filled by the stiff fluid keeps its stiffness. (Around an axis the hoop rate is no
//! polynomial; there the rule has points in each side, with positive weights.)
//!
//! **Kink.** Where the viscosities differ, the true velocity along the line has a kink, which a
//! biquadratic velocity cannot have. The kink
//!
//! ```text
//! psi t alpha,   psi = b |d| - sum_a b_a |d_a| N_a  (see space/kink.rs),   t tangent of the line
//! alpha = -K_alpha u / K_alpha_alpha
//! K_alpha u = integral over the stiffer side of  (stress of psi t: stiffer minus softer law) d(N)
//! ```
//! is zero at all nodes. Its amplitude is a linear form of the nodal velocities, the one of least
//! power (without the response of the softer fluid alone, so that equal laws have no kink). Matrix
//! and load are those of the velocity with the kink, particles move with it, and there is no further
//! unknown. The pressure does no work on the kink. If it did, thin slivers, whose amplitude is large
//! and whose line is uncertain, would disturb the flow: an undulation of a thousandth of a cell then
//! grew 2 % too fast at a contrast of 100, and 0.002 % without.
//!
//! At a contrast above 1e5 the kink makes the thin fluid fast where the line is uncertain, and no
//! longer changes the stiff one: from there to 1e7 the amplitude decreases to zero.
//!
//! A [laminate](super::laminate) is in series in shear. Under weight this is wrong: the stress is
//! that of the thin fluid in the whole cell, and the weight of the stiff fluid drives it with
//! `rho g h^2/eta_thin`. Power of a surface of slope 0.4 at contrast 1e6, relative to a mesh that
//! follows the surface, at 8, 16, 32 cells: laminate 265, 35, 5.6; see `grainscope verify`.

use super::element::{Nodal, PointShape};
use super::laminate::VelocityMatrix;
use crate::composition::straight::StraightCut;
use crate::laws::mixture::Mixture;
use crate::laws::point::{PointLaw, Sym2};
use crate::laws::rates::Rates;
use crate::space::kink::{Kink, Ramp};
use crate::space::measure::CellMeasure;
use crate::space::shape::{GAUSS_6X6, GaussPoint, NODES, SUBPOINTS};

/// Logarithm to base 10 of the contrast up to which the velocity has its full kink.
const KINKED: f64 = 5.0;
/// Logarithm to base 10 of the contrast from which the velocity has no kink.
const KINKLESS: f64 = 7.0;

/// A cell that a line cuts into the sides of two materials.
#[derive(Clone)]
pub struct Sides {
    /// Indices of the two materials.
    pub between: [usize; 2],
    /// The line, with the shares of the second material.
    pub cut: StraightCut,
    /// The kink of the velocity, if it has one.
    pub kinked: Option<Kinked>,
}

/// Kink of the velocity of a cell, with its amplitude.
#[derive(Clone)]
pub struct Kinked {
    /// The kink of amplitude one.
    pub kink: Kink,
    /// Amplitude `alpha` as a linear form of the nodal velocities.
    pub amplitude: Nodal<2>,
}

impl Kinked {
    fn new(line: [f64; 3], ramp: Ramp, cell: CellMeasure) -> Self {
        let kink = Kink::new(line, ramp, cell.size);
        Kinked { kink, amplitude: [[0.0; 2]; NODES] }
    }

    /// Amplitude of the kink for the nodal velocities `u`.
    pub fn amplitude(&self, u: &Nodal<2>) -> f64 {
        self.amplitude.iter().zip(u).map(|(f, u)| f[0] * u[0] + f[1] * u[1]).sum()
    }

    /// Rates of `psi t` at a point, continued from the first and from the second side.
    fn rates(&self, g: &GaussPoint, cell: CellMeasure) -> [Rates; 2] {
        let in_plane = self.kink.slopes(g).map(|slopes| {
            let slopes = [0, 1].map(|c| slopes[c] * 2.0 / cell.size[c]);
            Rates::classical(self.kink.along.map(|t| slopes.map(|s| s * t)))
        });
        if !cell.is_ring() {
            return in_plane;
        }
        let per_radius = cell.per_radius(g.r[0]);
        let psi = self.kink.values(g);
        [0, 1].map(|side| {
            in_plane[side].around_axis(per_radius * psi[side] * self.kink.along[0], 0.0)
        })
    }

    /// Determines the amplitude, and replaces the matrix of the velocity without a kink by that of
    /// the velocity with it.
    fn eliminate(
        &mut self,
        cut: &StraightCut,
        laws: &[PointLaw; 2],
        cell: CellMeasure,
        k: &mut VelocityMatrix,
    ) -> bool {
        let [a, b] = laws.each_ref().map(|law| law.shear.mean());
        let decades = (a / b).log10().abs();
        let kept = ((KINKLESS - decades) / (KINKLESS - KINKED)).clamp(0.0, 1.0);
        if kept == 0.0 {
            return false;
        }
        let stiffer = usize::from(b > a);
        let difference = minus(&laws[stiffer], &laws[1 - stiffer]);
        // Products of the kink with the velocities, with the difference of the laws and with the
        // laws, and with itself.
        let mut driven = [0.0; 2 * NODES];
        let mut coupled = [0.0; 2 * NODES];
        let mut itself = 0.0;
        integrate(cut, cell, |g, shares| {
            let s = PointShape::new(&g.shape, cell, g.r[0]);
            let rates = self.rates(g, cell);
            for side in 0..2 {
                let volume = cell.of_point(g.weight * shares[side], g.r[0]);
                itself += volume * laws[side].power(&rates[side]);
                add_forces(&mut coupled, &s, &laws[side], &rates[side], volume);
                if side == stiffer {
                    add_forces(&mut driven, &s, &difference, &rates[side], volume);
                }
            }
        });
        if itself <= 0.0 {
            return false;
        }
        let alpha = driven.map(|d| -kept * d / itself);
        for i in 0..2 * NODES {
            self.amplitude[i % NODES][i / NODES] = alpha[i];
            for j in 0..2 * NODES {
                k[i][j] +=
                    alpha[i] * coupled[j] + coupled[i] * alpha[j] + alpha[i] * itself * alpha[j];
            }
        }
        true
    }
}

/// The difference of the viscosities of two laws.
fn minus(a: &PointLaw, b: &PointLaw) -> PointLaw {
    let mut shear: Sym2 = a.shear;
    shear.add_scaled(-1.0, &b.shear);
    let (dilation, hoop) = (a.dilation - b.dilation, a.hoop - b.hoop);
    PointLaw { shear, dilation, hoop, ..PointLaw::default() }
}

/// Adds the forces of the stress at the rates `r` on the nodes, component by component.
fn add_forces(f: &mut [f64; 2 * NODES], s: &PointShape, law: &PointLaw, r: &Rates, volume: f64) {
    let ([[xx, xy], [yx, yy]], hoop) = law.stress(r, volume).components();
    for a in 0..NODES {
        f[a] += xx * s.gx[a] + xy * s.gy[a];
        f[NODES + a] += yy * s.gy[a] + yx * s.gx[a];
    }
    if s.per_radius != 0.0 {
        for a in 0..NODES {
            f[a] += hoop * s.per_radius * s.n[a];
        }
    }
}

/// Stiffness matrix of a cell with the laws of the two materials, and the kink of its velocity; the
/// shares of the line are those of the second material.
pub fn matrix(
    cut: &StraightCut,
    laws: &[PointLaw; 2],
    cell: CellMeasure,
    ramp: Option<Ramp>,
) -> (VelocityMatrix, Option<Kinked>) {
    let mut k = [[0.0; 2 * NODES]; 2 * NODES];
    integrate(cut, cell, |g, shares| add_point(&mut k, g, cell, shares, laws));
    let kinked = ramp.and_then(|ramp| {
        let mut kinked = Kinked::new(cut.line, ramp, cell);
        kinked.eliminate(cut, laws, cell, &mut k).then_some(kinked)
    });
    symmetrize(&mut k);
    (k, kinked)
}

/// Stiffness matrix of a cell whose materials have given laws at the points of [`GAUSS_6X6`]; the
/// velocity has no kink.
pub fn varying(
    cut: &StraightCut,
    laws: &[[PointLaw; 2]; SUBPOINTS],
    cell: CellMeasure,
) -> VelocityMatrix {
    let mut k = [[0.0; 2 * NODES]; 2 * NODES];
    for (q, g) in GAUSS_6X6.iter().enumerate() {
        add_point(&mut k, g, cell, bounded(cut.share[q]), &laws[q]);
    }
    symmetrize(&mut k);
    k
}

/// Calls `f` with the points of a rule for both sides and the shares of the sides at each. In the plane the
/// rule is exact; around an axis all shares are zero or one, so that hoop rates cannot make a matrix
/// indefinite.
fn integrate(cut: &StraightCut, cell: CellMeasure, mut f: impl FnMut(&GaussPoint, [f64; 2])) {
    if cell.is_ring() {
        for (side, g) in cut.points() {
            f(&g, if side == 0 { [1.0, 0.0] } else { [0.0, 1.0] });
        }
    } else {
        for (g, &share) in GAUSS_6X6.iter().zip(&cut.share) {
            f(g, [1.0 - share, share]);
        }
    }
}

/// Shares of the two sides at a point, between zero and one. Shares that integrate polynomials
/// exactly are slightly outside, where viscosities that vary within a side would make the matrix
/// indefinite.
pub fn bounded(share: f64) -> [f64; 2] {
    let share = share.clamp(0.0, 1.0);
    [1.0 - share, share]
}

/// Adds the stiffness at a point, with the shares and the laws of the two materials there.
fn add_point(
    k: &mut VelocityMatrix,
    g: &GaussPoint,
    cell: CellMeasure,
    [first, second]: [f64; 2],
    laws: &[PointLaw; 2],
) {
    let mut mixture = Mixture::parallel();
    mixture.add(first, &laws[0]);
    mixture.add(second, &laws[1]);
    let (s, law) = (PointShape::new(&g.shape, cell, g.r[0]), mixture.law());
    for (i, row) in k.iter_mut().enumerate() {
        let slope = [s.gx[i % NODES], s.gy[i % NODES]];
        let mut gradient = [[0.0; 2]; 2];
        gradient[i / NODES] = slope;
        let mut rates = Rates::classical(gradient);
        if cell.is_ring() {
            let along = if i < NODES { s.n[i] } else { 0.0 };
            rates = rates.around_axis(s.per_radius * along, 0.0);
        }
        add_forces(row, &s, &law, &rates, cell.of_point(g.weight, g.r[0]));
    }
}

/// Copies the lower triangle to the upper one: rounding differs between the two.
fn symmetrize(k: &mut VelocityMatrix) {
    for i in 0..2 * NODES {
        for j in 0..i {
            k[j][i] = k[i][j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::director::Orientation;
    use crate::laws::{Here, Law};
    use crate::solve::element::{LOCAL, Matrix, mirror};
    use crate::solve::terms::stress::add_stiffness;
    use crate::space::measure::Measure;
    use nalgebra::SMatrix;

    const SIZE: [f64; 2] = [0.7, 1.3];

    fn law(viscosity: f64) -> PointLaw {
        Law::default().at(&Here::without_flow(viscosity, &Orientation::default()))
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
                let cell = Measure::PLANE.of_cell(SIZE, 0.0);
                let (k, _) = matrix(&cut(seed), &laws, cell, Ramp::new([false; 4]));
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
    fn definite_around_an_axis() {
        for seed in 0..60 {
            for exponent in [-4, 0, 4] {
                let laws = [law(1.0), law(10f64.powi(exponent))];
                let cell = Measure::RING.of_cell(SIZE, 0.35 + 0.1 * f64::from(seed % 7));
                let (k, _) = matrix(&cut(seed), &laws, cell, Ramp::new([false; 4]));
                let k = SMatrix::<f64, 18, 18>::from_fn(|i, j| k[i][j]);
                let mut values: Vec<f64> = k.symmetric_eigenvalues().iter().copied().collect();
                values.sort_by(f64::total_cmp);
                // Only the translation along the axis is rigid.
                let rounding = 1e-12 * values[17];
                assert!(values[0].abs() < rounding, "{seed} {exponent}: {values:?}");
                assert!(values[1] > rounding, "{seed} {exponent}: {values:?}");
            }
        }
    }

    #[test]
    fn equal_laws_give_the_uniform_matrix() {
        for cell in [Measure::PLANE.of_cell(SIZE, 0.0), Measure::RING.of_cell(SIZE, 0.8)] {
            let (k, _) = matrix(&cut(3), &[law(2.0), law(2.0)], cell, Ramp::new([false; 4]));
            let mut uniform: Matrix = [[0.0; LOCAL]; LOCAL];
            for g in GAUSS_6X6.iter() {
                let (shape, volume) =
                    (PointShape::new(&g.shape, cell, g.r[0]), cell.of_point(g.weight, g.r[0]));
                add_stiffness::<2>(&mut uniform, &shape, &law(2.0), volume);
            }
            mirror::<2>(&mut uniform);
            // Around an axis, no rule is exact for hoop rates.
            let largest = uniform.iter().flatten().fold(0.0, |most: f64, k| most.max(k.abs()));
            let most = if cell.is_ring() { 1e-4 * largest } else { 1e-11 };
            for i in 0..18 {
                for j in 0..18 {
                    let off = (k[i][j] - uniform[i][j]).abs();
                    assert!(off < most, "{i} {j}: {off}");
                }
            }
        }
    }
}
