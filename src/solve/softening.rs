//! This module holds the derivatives of the viscosities of generalised fluids at the points of a
//! cell, and their part of the element matrix.
//!
//! The derivative of the stress is `eta U + (eta'/g) e e^T` with `e = U r`. Near material at rest the
//! direction `e/g` of tiny rates changes wildly from one iterate to the next, and Newton's method
//! hardly advances. The direction of the stress is therefore an unknown of its own, `w = U q`, which
//! satisfies `q m = r`, `m = max(g, g_yield)`. Linearised, this gives
//!
//! ```text
//! matrix   eta U + eta' (w e^T + e w^T)/2
//! q  +=  [dr - x q (e . dr)/g + a (r - q m)]/m,   then |q| <= 1
//! ```
//! with `x = 1` where the material yields (`g > g_yield`) and 0 elsewhere, after the share `a` of a
//! correction, which changed the rates by `dr`. The right-hand side is that of Newton's method, and
//! with `|q| <= 1` (the norm of the power at unit viscosity) the matrix is positive definite. At the
//! solution `w = e/g`, so the convergence is that of Newton's method in the end. T. F. Chan, G. H.
//! Golub, P. Mulet, "A nonlinear primal-dual method for total variation-based image restoration",
//! SIAM J. Sci. Comput. 20 (1999) 1964.

use super::element::{Matrix, PointShape};
use super::points::Place;
use crate::laws::Softening;
use crate::laws::rates::{Rates, Stress};
use crate::space::measure::CellMeasure;
use crate::space::shape::NODES;

/// The derivative of the viscosity of a generalised fluid at a point of a cell.
#[derive(Clone, Copy, Debug)]
pub struct SofteningPoint {
    /// The point.
    pub place: Place,
    /// Share of the volume of the cell.
    pub weight: f64,
    /// The derivative of the stress.
    pub softening: Softening,
}

/// Direction `q` of the stress of each point.
pub type Directions = Vec<Rates>;

/// Directions that belong to the rates of the points.
pub fn aligned(points: &[SofteningPoint], directions: &mut Directions) {
    directions.clear();
    directions.extend(points.iter().map(|p| {
        let mut q = Rates::default();
        let m = p.softening.effective_rate();
        if m > 0.0 {
            q.add_scaled(1.0 / m, &p.softening.rates);
        }
        q
    }));
}

/// Advances the directions after the share `share` of a correction, between the points before and
/// after it.
pub fn advance(
    before: &[SofteningPoint],
    after: &[SofteningPoint],
    share: f64,
    directions: &mut Directions,
) {
    for ((old, new), q) in before.iter().zip(after).zip(directions) {
        let Softening { unit, rates, rate, .. } = &old.softening;
        let m = old.softening.effective_rate();
        if m == 0.0 {
            continue;
        }
        let mut change = new.softening.rates;
        change.add_scaled(-1.0, rates);
        let yields = *rate > old.softening.yield_rate;
        let turn = if yields { unit.stress(rates, 1.0).power(&change) / rate } else { 0.0 };
        let mut next = *q;
        next.add_scaled(1.0 / m, &change);
        next.add_scaled(share / m, rates);
        next.add_scaled(-(turn / m + share), q);
        let norm = unit.power(&next).sqrt();
        *q = Rates::default();
        if norm.is_finite() {
            q.add_scaled(if norm > 1.0 { 1.0 / norm } else { 1.0 }, &next);
        }
    }
}

/// The power of a stress with the rates of each unknown of a cell, by component.
fn powers<const D: usize>(e: &Stress, s: &PointShape) -> [[f64; NODES]; D] {
    let ([[xx, xy], [yx, yy]], hoop) = e.components();
    let mut row = [[0.0; NODES]; D];
    for a in 0..NODES {
        row[0][a] = xx * s.gx[a] + xy * s.gy[a];
        row[1][a] = yx * s.gx[a] + yy * s.gy[a];
        if D == 3 {
            row[D - 1][a] = e.couple[0] * s.gx[a] + e.couple[1] * s.gy[a] - e.skew * s.n[a];
        }
    }
    if s.per_radius != 0.0 {
        for a in 0..NODES {
            row[0][a] += hoop * s.per_radius * s.n[a];
            if D == 3 {
                row[D - 1][a] += e.hoop_couple * s.per_radius * s.n[a];
            }
        }
    }
    row
}

impl SofteningPoint {
    /// Adds the derivative for the direction `q` to the matrix of the cell, in the blocks of
    /// components on and below the diagonal.
    pub fn add_stiffness<const D: usize>(&self, q: &Rates, k: &mut Matrix, cell: CellMeasure) {
        let Softening { slope, unit, rates, rate, .. } = &self.softening;
        if *slope == 0.0 {
            return;
        }
        let s = PointShape::new(&self.place.shape(), cell, self.place.r()[0]);
        let e = powers::<D>(&unit.stress(rates, 1.0), &s);
        // A stress that stiffens has no direction to be found.
        let (w, scale) = if *slope < 0.0 {
            (powers::<D>(&unit.stress(q, 1.0), &s), 1.0)
        } else {
            (e, 1.0 / rate)
        };
        let half = 0.5 * slope * scale * cell.of_share(self.weight);
        for c in 0..D {
            for a in 0..NODES {
                let (we, ee) = (half * w[c][a], half * e[c][a]);
                for d in 0..=c {
                    for b in 0..NODES {
                        k[NODES * c + a][NODES * d + b] += we * e[d][b] + ee * w[d][b];
                    }
                }
            }
        }
    }
}
