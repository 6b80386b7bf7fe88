//! This module defines the biquadratic element: local unknowns, shape functions with derivatives,
//! rates at a point, and the condensation of the centre node.
//!
//! Local unknowns are ordered component by component: `9 c + a` for component `c` (u, v, w) of node
//! `a`. `D` is 2 for the classical continuum, 3 with Cosserat rotation.

use crate::laws::rates::Rates;
use crate::space::embedding::CellMap;
use crate::space::measure::CellMeasure;
use crate::space::shape::{CENTRE, NODES, Shape};

/// Number of local unknowns with rotation; classical elements use the first 18.
pub const LOCAL: usize = 3 * NODES;
/// Full element matrix.
pub type Matrix = [[f64; LOCAL]; LOCAL];
/// Velocities (and rotation) or forces of the nodes of a cell.
pub type Nodal<const D: usize> = [[f64; D]; NODES];

/// Shape functions and their derivatives in physical coordinates at a point of a cell.
#[derive(Clone, Copy)]
pub struct PointShape {
    /// Values.
    pub n: [f64; NODES],
    /// Derivatives along x.
    pub gx: [f64; NODES],
    /// Derivatives along y.
    pub gy: [f64; NODES],
    /// One over the radius; zero in the plane.
    pub per_radius: f64,
}

impl PointShape {
    /// Converts the reference derivatives at the reference coordinate `xi` of a cell.
    pub fn new(s: &Shape, cell: CellMeasure, xi: f64) -> Self {
        let [hx, hy] = cell.size;
        PointShape {
            n: s.n,
            gx: s.d_xi.map(|d| d * 2.0 / hx),
            gy: s.d_eta.map(|d| d * 2.0 / hy),
            per_radius: cell.per_radius(xi),
        }
    }
}

/// Gradient of the nodal unknowns at a point: the derivatives `x[c]` and `y[c]` of component `c`,
/// the value `w` of the rotation, and the hoop rate and hoop curvature around an axis.
#[derive(Clone, Copy)]
pub struct Gradient<const D: usize> {
    /// Derivative of each component along x.
    pub(super) x: [f64; D],
    /// Derivative of each component along y.
    pub(super) y: [f64; D],
    /// Rotation rate; zero without rotation.
    pub(super) w: f64,
    /// `u/x` and `w/x`; `None` in the plane.
    pub(super) hoop: Option<[f64; 2]>,
}

impl<const D: usize> Gradient<D> {
    /// Gradient at a point of a cell with the nodal values `u`.
    pub fn at(s: &PointShape, u: &Nodal<D>) -> Self {
        let mut g = Gradient { x: [0.0; D], y: [0.0; D], w: 0.0, hoop: None };
        for a in 0..NODES {
            for c in 0..D {
                g.x[c] += s.gx[a] * u[a][c];
                g.y[c] += s.gy[a] * u[a][c];
            }
            if D == 3 {
                g.w += s.n[a] * u[a][D - 1];
            }
        }
        if s.per_radius != 0.0 {
            let along: f64 = (0..NODES).map(|a| s.n[a] * u[a][0]).sum();
            g.hoop = Some([s.per_radius * along, s.per_radius * g.w]);
        }
        g
    }

    /// Deformation rates of this gradient.
    #[inline(always)]
    pub fn rates(&self) -> Rates {
        let gradient = [[self.x[0], self.y[0]], [self.x[1], self.y[1]]];
        let rates = if D == 3 {
            Rates::cosserat(gradient, self.w, [self.x[D - 1], self.y[D - 1]])
        } else {
            Rates::classical(gradient)
        };
        match self.hoop {
            Some([hoop, kappa]) => rates.around_axis(hoop, kappa),
            None => rates,
        }
    }
}

/// Deformation rates at a point of a cell with the nodal values `u`.
pub fn rates<const D: usize>(s: &PointShape, u: &Nodal<D>) -> Rates {
    Gradient::at(s, u).rates()
}

/// Copies the blocks of components below the diagonal to those above it.
pub fn mirror<const D: usize>(k: &mut Matrix) {
    for i in NODES..NODES * D {
        for j in 0..i - i % NODES {
            k[j][i] = k[i][j];
        }
    }
}

/// Replaces the matrix of the velocities and rotations of a cell by that of its unknowns, `P' k P` with the
/// map `P`.
pub fn embed<const D: usize>(k: &mut Matrix, map: &CellMap) {
    const U: usize = 2 * NODES;
    let velocity = &map.velocity;
    let rotation = map.rotation.as_ref().filter(|_| D == 3);
    let mut half: Matrix = [[0.0; LOCAL]; LOCAL];
    for i in 0..NODES * D {
        for j in 0..U {
            half[i][j] = (0..U).map(|m| k[i][m] * velocity[m][j]).sum();
        }
        half[i][U..].copy_from_slice(&k[i][U..]);
        if let Some(rotation) = rotation {
            for j in 0..NODES {
                half[i][U + j] = (0..NODES).map(|m| k[i][U + m] * rotation[m][j]).sum();
            }
        }
    }
    *k = half;
    for i in 0..U {
        for j in 0..NODES * D {
            k[i][j] = (0..U).map(|m| velocity[m][i] * half[m][j]).sum();
        }
    }
    if let Some(rotation) = rotation {
        for i in 0..NODES {
            for j in 0..NODES * D {
                k[U + i][j] = (0..NODES).map(|m| rotation[m][i] * half[U + m][j]).sum();
            }
        }
    }
    // Rounding differs between the two triangles.
    for i in 0..NODES * D {
        for j in 0..i {
            k[j][i] = k[i][j];
        }
    }
}

/// Forces on the unknowns of a cell, `P' f`.
pub fn reduce<const D: usize>(f: &mut Nodal<D>, map: &CellMap) {
    let before = *f;
    let velocity = &map.velocity;
    for b in 0..NODES {
        for d in 0..2 {
            let rows =
                (0..2 * NODES).map(|i| velocity[i][NODES * d + b] * before[i % NODES][i / NODES]);
            f[b][d] = rows.sum();
        }
    }
    if let Some(rotation) = map.rotation.as_ref().filter(|_| D == 3) {
        for b in 0..NODES {
            f[b][D - 1] = (0..NODES).map(|a| rotation[a][b] * before[a][D - 1]).sum();
        }
    }
}

/// Velocities and rotations of a cell with the given unknowns, `P q`.
pub fn expand<const D: usize>(q: &mut Nodal<D>, map: &CellMap) {
    let before = *q;
    for a in 0..NODES {
        for c in 0..2 {
            let row = &map.velocity[NODES * c + a];
            q[a][c] = (0..2 * NODES).map(|j| row[j] * before[j % NODES][j / NODES]).sum();
        }
    }
    if let Some(rotation) = map.rotation.as_ref().filter(|_| D == 3) {
        for a in 0..NODES {
            q[a][D - 1] = (0..NODES).map(|b| rotation[a][b] * before[b][D - 1]).sum();
        }
    }
}

/// Nodes of a cell except the centre, in local order.
pub const SKELETON_NODES: [usize; 8] = [0, 1, 2, 3, 5, 6, 7, 8];

/// Condensed matrix of a cell on its skeleton nodes: a full `D x D` block for each pair `(k, l)`,
/// `k >= l`, of [`SKELETON_NODES`], at the index [`pair`].
pub type CellBlocks<const D: usize> = [[[f64; D]; D]; 36];

/// Data that recover the condensed centre node of a cell.
#[derive(Clone, Copy)]
pub struct Centre<const D: usize> {
    /// `A_cc^-1`.
    pub inverse: [[f64; D]; D],
    /// `A_cc^-1 A_cb`, by skeleton node.
    pub coupling: [[[f64; D]; D]; 8],
}

/// Index of the node pair `(k, l)`, `k >= l`, in [`CellBlocks`].
pub const fn pair(k: usize, l: usize) -> usize {
    k * (k + 1) / 2 + l
}

/// Condenses the centre node of a cell: `A_bb - A_bc A_cc^-1 A_cb`. `a` must be symmetric. A zero
/// diagonal entry at the centre (an unknown that no material acts on) is replaced by one.
pub fn condense<const D: usize>(a: &Matrix) -> (CellBlocks<D>, Centre<D>) {
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
    let inverse = std::array::from_fn(|r| std::array::from_fn(|c| inverse[(r, c)]));
    (blocks, Centre { inverse, coupling })
}

/// Inverse of a small symmetric positive definite matrix by Cholesky factorisation (`D` is 2 or 3).
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
