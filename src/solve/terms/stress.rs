//! This module computes the stresses at a point, with their forces on the nodes of a cell, and the
//! stiffness of a point.

use crate::laws::point::PointLaw;
use crate::laws::rates::{self, Rates};
use crate::solve::element::{Gradient, Matrix, Nodal, PointShape};
use crate::space::shape::NODES;

/// Stresses at a point times its volume, by the derivatives they are conjugate to: their virtual
/// power is `sum_c x[c] du_c/dx + y[c] du_c/dy + w w~`, and around an axis besides
/// `hoop[0] u/x + hoop[1] w/x`.
#[derive(Clone, Copy)]
pub struct Stress<const D: usize> {
    pub(super) x: [f64; D],
    pub(super) y: [f64; D],
    pub(super) w: f64,
    pub(super) hoop: [f64; 2],
}

impl<const D: usize> Stress<D> {
    /// Stresses of a law at the rates `r`, multiplied by the volume of the point.
    #[inline(always)]
    pub fn new(law: &PointLaw, r: &Rates, volume: f64) -> Self {
        Self::of(law.stress(r, volume))
    }

    #[inline(always)]
    pub(super) fn of(mut stress: rates::Stress) -> Self {
        if D == 2 {
            stress.skew = 0.0;
        }
        let (x, y, w) = ([0.0; D], [0.0; D], -stress.skew);
        let ([[xx, xy], [yx, yy]], hoop) = stress.components();
        let mut out = Stress { x, y, w, hoop: [hoop, 0.0] };
        (out.x[0], out.y[0]) = (xx, xy);
        (out.x[1], out.y[1]) = (yx, yy);
        if D == 3 {
            (out.x[D - 1], out.y[D - 1]) = (stress.couple[0], stress.couple[1]);
            out.hoop[1] = stress.hoop_couple;
        }
        out
    }

    /// Adds the virtual power of the stresses to the nodal forces.
    pub fn add_force(&self, s: &PointShape, f: &mut Nodal<D>) {
        for a in 0..NODES {
            for c in 0..D {
                f[a][c] += self.x[c] * s.gx[a] + self.y[c] * s.gy[a];
            }
            if D == 3 {
                f[a][D - 1] += self.w * s.n[a];
            }
        }
        if s.per_radius != 0.0 {
            for a in 0..NODES {
                f[a][0] += self.hoop[0] * s.per_radius * s.n[a];
                if D == 3 {
                    f[a][D - 1] += self.hoop[1] * s.per_radius * s.n[a];
                }
            }
        }
    }
}

/// Adds the stiffness of a point with the given volume to the element matrix, only in the blocks of
/// components on and below the diagonal; [`mirror`](crate::solve::element::mirror) fills the
/// others.
pub fn add_stiffness<const D: usize>(k: &mut Matrix, s: &PointShape, law: &PointLaw, volume: f64) {
    for component in 0..D {
        for a in 0..NODES {
            let mut g = Gradient { x: [0.0; D], y: [0.0; D], w: 0.0, hoop: None };
            (g.x[component], g.y[component]) = (s.gx[a], s.gy[a]);
            if component == 2 {
                g.w = s.n[a];
            }
            let ring = s.per_radius != 0.0;
            let around = s.per_radius * s.n[a];
            if ring {
                let of = |c: usize| if component == c { around } else { 0.0 };
                g.hoop = Some([of(0), of(2)]);
            }
            // The stress of a unit value of this unknown; its forces on all unknowns are the row.
            let t = Stress::<D>::new(law, &g.rates(), volume);
            let row = &mut k[NODES * component + a];
            for c in 0..=component {
                for b in 0..NODES {
                    row[NODES * c + b] += t.x[c] * s.gx[b] + t.y[c] * s.gy[b];
                }
            }
            if component == 2 {
                for b in 0..NODES {
                    row[2 * NODES + b] += t.w * s.n[b];
                }
            }
            if ring {
                for b in 0..NODES {
                    row[b] += t.hoop[0] * s.per_radius * s.n[b];
                    if component == 2 {
                        row[2 * NODES + b] += t.hoop[1] * s.per_radius * s.n[b];
                    }
                }
            }
        }
    }
}
