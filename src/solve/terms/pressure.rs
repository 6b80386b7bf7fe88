//! This module computes the pressure term, `-p div u~ - p~ div u`: the divergence matrix of the
//! pressure basis, and the penalty of the augmented Lagrangian.
//!
//! ```text
//! B_qa = integral q d/dx N_a  (and d/dy),   force B' p,   residual B u + C p,   penalty B' W B
//! ```
//! The discontinuous linear pressure is eliminated cell by cell; see
//! [`stokes`](crate::solve::stokes). In a cell with a solid of any shape only the constant is unknown;
//! see [`embedding`](crate::space::embedding).

use crate::solve::element::{Matrix, Nodal};
use crate::space::mesh::Mesh;
use crate::space::parts::Part;
use crate::space::shape::{D_ETA_AT_GAUSS, D_XI_AT_GAUSS, GAUSS_3, GAUSS_3_WEIGHTS, NODES, Table};

/// Divergence matrix of a cell for the pressure basis `1, xi, eta`, `integral q d/dx N` and
/// `integral q d/dy N`: tables of the reference cell and the factors they are multiplied by.
#[derive(Clone, Copy)]
pub struct Divergence<'a> {
    x_scale: f64,
    y_scale: f64,
    /// The part of the cell that solids leave free.
    part: Option<&'a Part>,
}

/// Matrices of a cell of size 2 x 2 for `d/dx` and `d/dy`, divided by its area.
static REFERENCE_DIVERGENCE: [[[f64; NODES]; 3]; 2] =
    [reference_divergence(&D_XI_AT_GAUSS), reference_divergence(&D_ETA_AT_GAUSS)];

const fn reference_divergence(slope: &Table) -> [[f64; NODES]; 3] {
    let mut b = [[0.0; NODES]; 3];
    let mut k = 0;
    while k < 81 {
        let (g, a) = (k / 9, k % 9);
        let weighted = GAUSS_3_WEIGHTS[g % 3] * GAUSS_3_WEIGHTS[g / 3] * slope[g][a];
        b[0][a] += weighted;
        b[1][a] += GAUSS_3[g % 3] * weighted;
        b[2][a] += GAUSS_3[g / 3] * weighted;
        k += 1;
    }
    b
}

impl<'a> Divergence<'a> {
    /// Divergence matrix of a cell of a mesh.
    pub fn new(mesh: &'a Mesh, cell: usize) -> Self {
        let [x_scale, y_scale] = mesh.cell_measure(cell).divergence_scales();
        Divergence { x_scale, y_scale, part: mesh.part(cell) }
    }

    /// Whether each coefficient of the pressure is an unknown.
    pub fn unknown(&self) -> [bool; 3] {
        [true, self.part.is_none(), self.part.is_none()]
    }

    /// `B u` for the unknown pressures.
    pub fn apply<const D: usize>(&self, u: &Nodal<D>) -> [f64; 3] {
        if let Some(part) = self.part {
            let [x, y] = &part.divergence[0];
            return [(0..NODES).map(|a| x[a] * u[a][0] + y[a] * u[a][1]).sum(), 0.0, 0.0];
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

    /// `B u` for a pressure that is not an unknown.
    pub fn of_given<const D: usize>(&self, q: usize, u: &Nodal<D>) -> f64 {
        let Some(part) = self.part else { return 0.0 };
        let [x, y] = &part.divergence[q];
        (0..NODES).map(|a| x[a] * u[a][0] + y[a] * u[a][1]).sum()
    }

    /// `f += B^T p`.
    pub fn add_transposed<const D: usize>(&self, p: &[f64; 3], f: &mut Nodal<D>) {
        if let Some(part) = self.part {
            for ([x, y], p) in part.divergence.iter().zip(p) {
                for a in 0..NODES {
                    f[a][0] += x[a] * p;
                    f[a][1] += y[a] * p;
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
            let [bx, by] = match self.part {
                Some(part) => part.divergence[q],
                None => [x[q].map(|v| v * self.x_scale), y[q].map(|v| v * self.y_scale)],
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
