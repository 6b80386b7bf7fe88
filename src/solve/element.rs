//! Element matrices and forces of one cell, from whatever integration points it has.
//!
//! The weak form (per volume, `d = (D_xx - D_yy, 2 D_xy)`, spin `o = (v,x - u,y)/2`):
//!
//! ```text
//! d.S d~ + beta tr(D) tr(D~) + 4 eta_c (o - w)(o~ - w~) + M grad w . grad w~ - p div u~
//! ```
//! Local unknowns are ordered component by component: `9 c + a` for component `c` (u, v, w) of
//! node `a`. `D` is 2 for the classical continuum, 3 with Cosserat rotation.

use crate::laws::point::PointLaw;
use crate::space::shape::{CENTRE, GAUSS_3X3, NODES, PRESSURE_MASS, Shape};
use std::sync::LazyLock;

/// Local unknowns with rotation; classical elements use the first 18.
pub const LOCAL: usize = 3 * NODES;
/// A full element matrix.
pub type Matrix = [[f64; LOCAL]; LOCAL];
/// Velocities (and rotation) or forces of a cell's nodes.
pub type Nodal<const D: usize> = [[f64; D]; NODES];

/// Shape functions with derivatives in the cell's own coordinates.
#[derive(Clone, Copy)]
pub struct PointShape {
    pub n: [f64; NODES],
    pub gx: [f64; NODES],
    pub gy: [f64; NODES],
}

impl PointShape {
    pub fn new(s: &Shape, [hx, hy]: [f64; 2]) -> Self {
        PointShape { n: s.n, gx: s.d_xi.map(|d| d * 2.0 / hx), gy: s.d_eta.map(|d| d * 2.0 / hy) }
    }
}

/// Rates at an integration point.
#[derive(Clone, Copy, Default)]
pub struct Rates {
    /// `D_xx - D_yy`, `2 D_xy`
    pub d: [f64; 2],
    /// `tr D`
    pub trace: f64,
    /// spin minus rotation
    pub relative_spin: f64,
    /// `grad w`
    pub kappa: [f64; 2],
}

impl Rates {
    pub fn new<const D: usize>(s: &PointShape, u: &Nodal<D>) -> Self {
        let (mut ux, mut uy, mut vx, mut vy) = (0.0, 0.0, 0.0, 0.0);
        let (mut w, mut wx, mut wy) = (0.0, 0.0, 0.0);
        for a in 0..NODES {
            ux += s.gx[a] * u[a][0];
            uy += s.gy[a] * u[a][0];
            vx += s.gx[a] * u[a][1];
            vy += s.gy[a] * u[a][1];
            if D == 3 {
                w += s.n[a] * u[a][2];
                wx += s.gx[a] * u[a][2];
                wy += s.gy[a] * u[a][2];
            }
        }
        Rates {
            d: [ux - vy, uy + vx],
            trace: ux + vy,
            relative_spin: if D == 3 { 0.5 * (vx - uy) - w } else { 0.0 },
            kappa: [wx, wy],
        }
    }

    /// Power per volume, without the pressure's.
    pub fn power(&self, law: &PointLaw) -> f64 {
        law.shear.quadratic(self.d)
            + law.dilation * self.trace * self.trace
            + 4.0 * law.coupling * self.relative_spin * self.relative_spin
            + law.couple * (self.kappa[0] * self.kappa[0] + self.kappa[1] * self.kappa[1])
    }

    /// `|grad u|^2` of the symmetric part, `D:D`.
    pub fn strain_squared(&self) -> f64 {
        0.5 * (self.d[0] * self.d[0] + self.d[1] * self.d[1] + self.trace * self.trace)
    }
}

/// Adds the virtual power of the stresses at a point of volume `volume` to the nodal forces.
pub fn add_internal_force<const D: usize>(
    f: &mut Nodal<D>,
    s: &PointShape,
    law: &PointLaw,
    r: &Rates,
    volume: f64,
) {
    let t0 = volume * (law.shear.a * r.d[0] + law.shear.c * r.d[1]);
    let t1 = volume * (law.shear.c * r.d[0] + law.shear.b * r.d[1]);
    let t2 = volume * law.dilation * r.trace;
    let t3 = volume * 4.0 * law.coupling * r.relative_spin;
    let (t4, t5) = (volume * law.couple * r.kappa[0], volume * law.couple * r.kappa[1]);
    let half = if D == 3 { 0.5 * t3 } else { 0.0 };
    for a in 0..NODES {
        f[a][0] += (t2 + t0) * s.gx[a] + (t1 - half) * s.gy[a];
        f[a][1] += (t1 + half) * s.gx[a] + (t2 - t0) * s.gy[a];
        if D == 3 {
            f[a][2] += t4 * s.gx[a] + t5 * s.gy[a] - t3 * s.n[a];
        }
    }
}

/// Adds the stiffness of a point of volume `volume` to the element matrix (both triangles).
pub fn add_stiffness<const D: usize>(k: &mut Matrix, s: &PointShape, law: &PointLaw, volume: f64) {
    let (sa, sb, sc) = (volume * law.shear.a, volume * law.shear.b, volume * law.shear.c);
    let beta = volume * law.dilation;
    let spin = if D == 3 { 4.0 * volume * law.coupling } else { 0.0 };
    let couple = volume * law.couple;
    let mut row = |i: usize, t: [f64; 6]| {
        let [t0, t1, t2, t3, t4, t5] = t;
        let k = &mut k[i];
        for a in 0..NODES {
            k[a] += (t2 + t0) * s.gx[a] + (t1 - 0.5 * t3) * s.gy[a];
        }
        for a in 0..NODES {
            k[NODES + a] += (t1 + 0.5 * t3) * s.gx[a] + (t2 - t0) * s.gy[a];
        }
        if D == 3 {
            for a in 0..NODES {
                k[2 * NODES + a] += t4 * s.gx[a] + t5 * s.gy[a] - t3 * s.n[a];
            }
        }
    };
    for a in 0..NODES {
        let (gx, gy, n) = (s.gx[a], s.gy[a], s.n[a]);
        row(a, [sa * gx + sc * gy, sc * gx + sb * gy, beta * gx, -0.5 * spin * gy, 0.0, 0.0]);
        row(
            NODES + a,
            [-sa * gy + sc * gx, -sc * gy + sb * gx, beta * gy, 0.5 * spin * gx, 0.0, 0.0],
        );
        if D == 3 {
            row(2 * NODES + a, [0.0, 0.0, 0.0, -spin * n, couple * gx, couple * gy]);
        }
    }
}

/// `integral q d/dx N` and `integral q d/dy N` on a cell: the divergence matrix of the pressure
/// basis `1, xi, eta`.
#[derive(Clone, Copy)]
pub struct Divergence {
    pub x: [[f64; NODES]; 3],
    pub y: [[f64; NODES]; 3],
}

static REFERENCE_DIVERGENCE: LazyLock<Divergence> = LazyLock::new(|| {
    let mut b = Divergence { x: [[0.0; NODES]; 3], y: [[0.0; NODES]; 3] };
    for g in GAUSS_3X3.iter() {
        let q = [1.0, g.r[0], g.r[1]];
        for (i, q) in q.iter().enumerate() {
            for a in 0..NODES {
                b.x[i][a] += g.weight * q * g.shape.d_xi[a];
                b.y[i][a] += g.weight * q * g.shape.d_eta[a];
            }
        }
    }
    b
});

impl Divergence {
    pub fn new([hx, hy]: [f64; 2]) -> Self {
        let r = &*REFERENCE_DIVERGENCE;
        Divergence {
            x: r.x.map(|row| row.map(|v| v * 2.0 * hy)),
            y: r.y.map(|row| row.map(|v| v * 2.0 * hx)),
        }
    }

    /// `B u`
    pub fn apply<const D: usize>(&self, u: &Nodal<D>) -> [f64; 3] {
        std::array::from_fn(|q| {
            (0..NODES).map(|a| self.x[q][a] * u[a][0] + self.y[q][a] * u[a][1]).sum()
        })
    }

    /// `f += B^T p`
    pub fn add_transposed<const D: usize>(&self, p: &[f64; 3], f: &mut Nodal<D>) {
        for q in 0..3 {
            for a in 0..NODES {
                f[a][0] += self.x[q][a] * p[q];
                f[a][1] += self.y[q][a] * p[q];
            }
        }
    }

    /// `k += B^T diag(w) B`
    pub fn add_penalty(&self, w: &[f64; 3], k: &mut Matrix) {
        for q in 0..3 {
            for a in 0..NODES {
                let (x, y) = (w[q] * self.x[q][a], w[q] * self.y[q][a]);
                for b in 0..NODES {
                    k[a][b] += x * self.x[q][b];
                    k[a][NODES + b] += x * self.y[q][b];
                    k[NODES + a][b] += y * self.x[q][b];
                    k[NODES + a][NODES + b] += y * self.y[q][b];
                }
            }
        }
    }
}

/// Mass of the pressure basis on a cell of this area.
pub fn pressure_mass(area: f64) -> [f64; 3] {
    PRESSURE_MASS.map(|m| m * area)
}

/// Nodes of a cell without its centre, in local order.
pub const SKELETON_NODES: [usize; 8] = [0, 1, 2, 3, 5, 6, 7, 8];

/// A cell's matrix with the centre node condensed:
/// `A_bb - A_bc A_cc^-1 A_cb`, and what brings the centre back.
#[derive(Clone)]
pub struct Condensed<const D: usize> {
    /// Lower triangle by node pairs `(k, l)`, `k >= l`, of [`SKELETON_NODES`], each a full block.
    pub blocks: [[[f64; D]; D]; 36],
    /// `A_cc^-1`
    pub centre_inverse: [[f64; D]; D],
    /// `A_cc^-1 A_cb`, by skeleton node.
    pub coupling: [[[f64; D]; D]; 8],
}

/// Index of the node pair `(k, l)`, `k >= l`, in [`Condensed::blocks`].
pub const fn pair(k: usize, l: usize) -> usize {
    k * (k + 1) / 2 + l
}

impl<const D: usize> Condensed<D> {
    /// `a` must be symmetric; unknowns with a zero diagonal at the centre become idle.
    pub fn new(a: &Matrix) -> Self {
        let at = |i: usize, ci: usize, j: usize, cj: usize| a[NODES * ci + i][NODES * cj + j];
        let mut centre = nalgebra::SMatrix::<f64, D, D>::from_fn(|r, c| at(CENTRE, r, CENTRE, c));
        for c in 0..D {
            if centre[(c, c)] == 0.0 {
                centre[(c, c)] = 1.0;
            }
        }
        let inverse = invert(&centre);
        let mut coupling = [[[0.0; D]; D]; 8];
        for (l, &b) in SKELETON_NODES.iter().enumerate() {
            for r in 0..D {
                for c in 0..D {
                    coupling[l][r][c] = (0..D).map(|m| inverse[(r, m)] * at(CENTRE, m, b, c)).sum();
                }
            }
        }
        let mut blocks = [[[0.0; D]; D]; 36];
        for (k, &i) in SKELETON_NODES.iter().enumerate() {
            for (l, &j) in SKELETON_NODES.iter().enumerate().take(k + 1) {
                for r in 0..D {
                    for c in 0..D {
                        let condensed: f64 =
                            (0..D).map(|m| at(i, r, CENTRE, m) * coupling[l][m][c]).sum();
                        blocks[pair(k, l)][r][c] = at(i, r, j, c) - condensed;
                    }
                }
            }
        }
        let mut centre_inverse = [[0.0; D]; D];
        for r in 0..D {
            for c in 0..D {
                centre_inverse[r][c] = inverse[(r, c)];
            }
        }
        Condensed { blocks, centre_inverse, coupling }
    }
}

/// Inverse of a small symmetric positive definite matrix (Cholesky by hand: `D` is 2 or 3).
fn invert<const D: usize>(a: &nalgebra::SMatrix<f64, D, D>) -> nalgebra::SMatrix<f64, D, D> {
    let mut l = nalgebra::SMatrix::<f64, D, D>::zeros();
    for j in 0..D {
        for i in j..D {
            let s: f64 = a[(i, j)] - (0..j).map(|m| l[(i, m)] * l[(j, m)]).sum::<f64>();
            l[(i, j)] = if i == j { s.sqrt() } else { s / l[(j, j)] };
        }
    }
    let mut inverse = nalgebra::SMatrix::<f64, D, D>::zeros();
    for c in 0..D {
        let mut x = [0.0; D];
        for i in 0..D {
            let e = if i == c { 1.0 } else { 0.0 };
            x[i] = (e - (0..i).map(|m| l[(i, m)] * x[m]).sum::<f64>()) / l[(i, i)];
        }
        for i in (0..D).rev() {
            x[i] = (x[i] - (i + 1..D).map(|m| l[(m, i)] * x[m]).sum::<f64>()) / l[(i, i)];
        }
        for i in 0..D {
            inverse[(i, c)] = x[i];
        }
    }
    inverse
}
