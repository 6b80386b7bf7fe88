//! This module computes the pressure term, `-p div u~ - p~ div u`: the divergence matrix of the
//! pressure basis, and the penalty of the augmented Lagrangian.
//!
//! ```text
//! B_qa = integral q d/dx N_a  (and d/dy),   force B' p,   residual B u + C p,   penalty B' W B
//! ```
//! Around an axis the divergence has the hoop rate, `B_qa = integral q (dN_a/dx + N_a/x)` for the radial
//! velocity; times the thickness `2 pi x` the integrands are polynomials, which the points integrate
//! exactly.
//!
//! The discontinuous linear pressure is eliminated cell by cell; see
//! [`stokes`](crate::solve::stokes). In a cell with a solid of any shape only the constant is unknown;
//! see [`embedding`](crate::space::embedding). Its free part shrinks by what moving solids take from it.
//! In a cell with a void in it the pressure is that of the [filled part](crate::solve::filled).

use crate::solve::element::{Matrix, Nodal};
use crate::solve::filled::Filled;
use crate::solve::quadrature::Quadrature;
use crate::space::measure::CellMeasure;
use crate::space::mesh::Mesh;
use crate::space::parts::Part;
use crate::space::shape::{
    D_ETA_AT_GAUSS, D_XI_AT_GAUSS, GAUSS_3, GAUSS_3_WEIGHTS, NODES, Table, VALUES_AT_GAUSS,
};

/// Divergence matrix of a cell for its pressure basis, `integral q d/dx N` and `integral q d/dy N`:
/// tables of the reference cell and the factors they are multiplied by.
#[derive(Clone, Copy)]
pub struct Divergence<'a> {
    x_scale: f64,
    y_scale: f64,
    /// The part of the cell that solids leave free.
    part: Option<&'a Part>,
    /// The part of the cell that the material fills, if there is a void in it.
    filled: Option<&'a Filled>,
    /// The matrix of a cell around an axis, by pressure and component, without the factors.
    ring: Option<[[[f64; NODES]; 2]; 3]>,
}

/// Matrices of a cell of size 2 x 2 for `d/dx` and `d/dy`, divided by its area, for `q = 1, xi, eta`.
static REFERENCE_DIVERGENCE: [[[f64; NODES]; 3]; 2] =
    [reference_divergence(&D_XI_AT_GAUSS, None), reference_divergence(&D_ETA_AT_GAUSS, None)];

/// The parts of these matrices that a tilt of one adds, of `xi d/dxi N + N` and of `xi d/deta N`.
static TILTED_DIVERGENCE: [[[f64; NODES]; 3]; 2] = [
    reference_divergence(&D_XI_AT_GAUSS, Some(1.0)),
    reference_divergence(&D_ETA_AT_GAUSS, Some(0.0)),
];

/// Integrals of `q slope`, or of `q (xi slope + value N)`.
const fn reference_divergence(slope: &Table, value: Option<f64>) -> [[f64; NODES]; 3] {
    let mut b = [[0.0; NODES]; 3];
    let mut k = 0;
    while k < 81 {
        let (g, a) = (k / 9, k % 9);
        let at = match value {
            None => slope[g][a],
            Some(value) => {
                let n = VALUES_AT_GAUSS[g % 3][a % 3] * VALUES_AT_GAUSS[g / 3][a / 3];
                GAUSS_3[g % 3] * slope[g][a] + value * n
            }
        };
        let weighted = GAUSS_3_WEIGHTS[g % 3] * GAUSS_3_WEIGHTS[g / 3] * at;
        b[0][a] += weighted;
        b[1][a] += GAUSS_3[g % 3] * weighted;
        b[2][a] += GAUSS_3[g / 3] * weighted;
        k += 1;
    }
    b
}

/// The matrices of a reference cell with a tilt, for its pressure basis.
fn tilted(tilt: f64) -> [[[f64; NODES]; 2]; 3] {
    let mut out: [[[f64; NODES]; 2]; 3] = std::array::from_fn(|q| {
        std::array::from_fn(|c| {
            std::array::from_fn(|a| {
                REFERENCE_DIVERGENCE[c][q][a] + tilt * TILTED_DIVERGENCE[c][q][a]
            })
        })
    });
    // The second pressure is `xi - tilt/3`.
    let [constant, linear, _] = &mut out;
    for (linear, constant) in linear.iter_mut().zip(constant) {
        for (l, c) in linear.iter_mut().zip(constant) {
            *l -= tilt / 3.0 * *c;
        }
    }
    out
}

impl<'a> Divergence<'a> {
    /// Divergence matrix of a cell of a mesh with the contents of `quadrature`.
    pub fn new(mesh: &'a Mesh, quadrature: &'a Quadrature, cell: usize) -> Self {
        let measure = mesh.cell_measure(cell);
        let [x_scale, y_scale] = measure.divergence_scales();
        let ring = measure.is_ring().then(|| tilted(measure.tilt()));
        let part = mesh.part(cell);
        let filled = quadrature.cut(cell).and_then(|cut| cut.filled.as_ref());
        Divergence { x_scale, y_scale, part, filled, ring }
    }

    /// Whether each coefficient of the pressure is an unknown.
    pub fn unknown(&self) -> [bool; 3] {
        [true, self.part.is_none(), self.part.is_none()]
    }

    /// Whether there is a void in the cell.
    pub fn is_of_filled_part(&self) -> bool {
        self.filled.is_some()
    }

    /// Integrals of the squares of the functions of the pressure basis, `measure` that of the cell.
    pub fn mass(&self, measure: CellMeasure) -> [f64; 3] {
        self.filled.map_or_else(|| measure.pressure_mass(), |filled| filled.mass)
    }

    /// Coefficients in the basis of the cell, from those of `1, xi, eta`.
    pub fn coefficients(&self, p: [f64; 3]) -> [f64; 3] {
        self.filled.map_or(p, |filled| filled.coefficients(p))
    }

    /// Coefficients of `1, xi, eta`, from those in the basis of the cell.
    pub fn monomials(&self, p: [f64; 3]) -> [f64; 3] {
        self.filled.map_or(p, |filled| filled.monomials(p))
    }

    /// The rows of a part of the cell, if it has some of its own.
    fn rows(&self) -> Option<&'a [[[f64; NODES]; 2]; 3]> {
        let of_part = self.part.map(|part| &part.divergence);
        of_part.or_else(|| self.filled.map(|filled| &filled.divergence))
    }

    /// `B u` for the unknown pressures.
    pub fn apply<const D: usize>(&self, u: &Nodal<D>) -> [f64; 3] {
        if let Some(filled) = self.filled {
            return filled
                .divergence
                .each_ref()
                .map(|[x, y]| (0..NODES).map(|a| x[a] * u[a][0] + y[a] * u[a][1]).sum::<f64>());
        }
        if let Some(part) = self.part {
            let [x, y] = &part.divergence[0];
            return [(0..NODES).map(|a| x[a] * u[a][0] + y[a] * u[a][1]).sum(), 0.0, 0.0];
        }
        if let Some(ring) = &self.ring {
            return ring.each_ref().map(|[x, y]| {
                let along = |v: &[f64; NODES], c: usize| -> f64 {
                    v.iter().zip(u).map(|(v, u)| v * u[c]).sum()
                };
                self.x_scale * along(x, 0) + self.y_scale * along(y, 1)
            });
        }
        let [x, y] = &REFERENCE_DIVERGENCE;
        let mut sum = [[0.0; 3]; 2];
        for a in 0..NODES {
            for q in 0..3 {
                sum[0][q] += x[q][a] * u[a][0];
                sum[1][q] += y[q][a] * u[a][1];
            }
        }
        std::array::from_fn(|q| self.x_scale * sum[0][q] + self.y_scale * sum[1][q])
    }

    /// Volume that moving solids take from the cell per time: a flow without divergence has `B u` equal
    /// to it.
    pub fn swept(&self) -> f64 {
        self.part.map_or(0.0, |part| part.swept)
    }

    /// `B u` for a pressure that is not an unknown.
    pub fn of_given<const D: usize>(&self, q: usize, u: &Nodal<D>) -> f64 {
        let Some(part) = self.part else { return 0.0 };
        let [x, y] = &part.divergence[q];
        (0..NODES).map(|a| x[a] * u[a][0] + y[a] * u[a][1]).sum()
    }

    /// `f += B^T p`.
    pub fn add_transposed<const D: usize>(&self, p: &[f64; 3], f: &mut Nodal<D>) {
        if let Some(rows) = self.rows() {
            for ([x, y], p) in rows.iter().zip(p) {
                for a in 0..NODES {
                    f[a][0] += x[a] * p;
                    f[a][1] += y[a] * p;
                }
            }
            return;
        }
        if let Some(ring) = &self.ring {
            for ([x, y], p) in ring.iter().zip(p) {
                for a in 0..NODES {
                    f[a][0] += self.x_scale * x[a] * p;
                    f[a][1] += self.y_scale * y[a] * p;
                }
            }
            return;
        }
        let [x, y] = &REFERENCE_DIVERGENCE;
        let (px, py) = (p.map(|p| self.x_scale * p), p.map(|p| self.y_scale * p));
        for a in 0..NODES {
            f[a][0] += x[0][a] * px[0] + x[1][a] * px[1] + x[2][a] * px[2];
            f[a][1] += y[0][a] * py[0] + y[1][a] * py[1] + y[2][a] * py[2];
        }
    }

    /// `k += B^T diag(w) B`, in the blocks of components on and below the diagonal.
    pub fn add_penalty(&self, w: &[f64; 3], k: &mut Matrix) {
        let [x, y] = &REFERENCE_DIVERGENCE;
        for q in 0..3 {
            let scaled = |x: &[f64; NODES], y: &[f64; NODES]| {
                [x.map(|v| v * self.x_scale), y.map(|v| v * self.y_scale)]
            };
            let [bx, by] = match (self.rows(), &self.ring) {
                (Some(rows), _) => rows[q],
                (None, Some(ring)) => scaled(&ring[q][0], &ring[q][1]),
                (None, None) => scaled(&x[q], &y[q]),
            };
            for a in 0..NODES {
                for b in 0..NODES {
                    k[a][b] += w[q] * bx[a] * bx[b];
                    k[NODES + a][b] += w[q] * by[a] * bx[b];
                    k[NODES + a][NODES + b] += w[q] * by[a] * by[b];
                }
            }
        }
    }
}
