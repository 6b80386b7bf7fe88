//! This module defines the unknowns (velocity and rotation at nodes, pressure in cells) and their
//! interpolation.

use super::mesh::Mesh;
use super::shape::{GAUSS_3X3, NODES, Shape};
use crate::threads;
use nalgebra::Matrix2;

/// Velocity (and rotation) at the nodes of the mesh and pressure in its cells, in the plan's units.
#[derive(Clone, Debug, Default)]
pub struct Flow<const D: usize> {
    /// Components `u, v` (and the rotation rate `w`) of each node.
    pub velocity: Vec<[f64; D]>,
    /// Coefficients of the pressure basis `1, xi, eta` of each cell.
    pub pressure: Vec<[f64; 3]>,
}

impl<const D: usize> Flow<D> {
    /// A flow at rest with zero pressure.
    pub fn zero(mesh: &Mesh) -> Self {
        Flow { velocity: vec![[0.0; D]; mesh.nodes()], pressure: vec![[0.0; 3]; mesh.cells()] }
    }

    /// Velocity (and rotation) at the nine nodes of a cell.
    pub fn of_cell(&self, mesh: &Mesh, cell: usize) -> [[f64; D]; NODES] {
        mesh.cell_nodes(cell).map(|n| self.velocity[n])
    }

    /// Velocity (and rotation) at a point.
    pub fn at(&self, mesh: &Mesh, p: [f64; 2]) -> [f64; D] {
        let cell = mesh.locate(p);
        interpolate(&self.of_cell(mesh, cell), &Shape::values(mesh.to_reference(cell, p)))
    }

    /// Pressure at a point.
    pub fn pressure_at(&self, mesh: &Mesh, p: [f64; 2]) -> f64 {
        let cell = mesh.locate(p);
        self.pressure_in(mesh, cell, mesh.to_reference(cell, p))
    }

    /// Pressure at reference coordinates of a cell.
    pub fn pressure_in(&self, mesh: &Mesh, cell: usize, r: [f64; 2]) -> f64 {
        let [_, xi, eta] = mesh.whole_measure(cell).pressure_basis(r);
        let [a, b, c] = self.pressure[cell];
        a + b * xi + c * eta
    }

    /// Gives the pressure of cells with solids in them its slope: it balances the weight per volume of
    /// the cell, and besides has the part of the slope of its neighbours that viscous stresses balance,
    /// less by the ratio of the viscosities where the cell is the less viscous. `weight` and `viscosity`
    /// are those of all cells. Returns the largest change, as a difference of pressures in a cell.
    pub fn continue_slopes(&mut self, mesh: &Mesh, weight: &[[f64; 2]], viscosity: &[f64]) -> f64 {
        let Some(parts) = mesh.parts() else { return 0.0 };
        let weight = |cell: usize| weight.get(cell).copied().unwrap_or([0.0; 2]);
        let mut largest = 0.0f64;
        for (cell, part) in parts.all() {
            let mut slope = [0.0; 2];
            for &n in &part.beside {
                let size = mesh.cell_size(n);
                let less = (viscosity[cell] / viscosity[n]).min(1.0);
                for c in 0..2 {
                    let rest = less * (2.0 * self.pressure[n][1 + c] / size[c] - weight(n)[c]);
                    slope[c] += rest / part.beside.len() as f64;
                }
            }
            let size = mesh.cell_size(cell);
            for c in 0..2 {
                let new = 0.5 * size[c] * (slope[c] + weight(cell)[c]);
                largest = largest.max((new - self.pressure[cell][1 + c]).abs());
                self.pressure[cell][1 + c] = new;
            }
        }
        largest
    }

    /// Extrapolates: adds `share` times the change since an earlier flow.
    pub fn extrapolate(&mut self, earlier: &Flow<D>, share: f64) {
        let go_on = |now: &mut f64, before: &f64| *now += share * (*now - before);
        let velocity = self.velocity.as_flattened_mut().iter_mut();
        velocity.zip(earlier.velocity.as_flattened()).for_each(|(now, before)| go_on(now, before));
        let pressure = self.pressure.as_flattened_mut().iter_mut();
        pressure.zip(earlier.pressure.as_flattened()).for_each(|(now, before)| go_on(now, before));
    }

    /// Copies another flow, reusing the allocated memory.
    pub fn copy_from(&mut self, other: &Flow<D>) {
        self.velocity.clone_from(&other.velocity);
        self.pressure.clone_from(&other.pressure);
    }

    /// Writes the velocity without the rotation to `out`.
    pub fn translation(&self, out: &mut Vec<[f64; 2]>) {
        out.clear();
        out.extend(self.velocity.iter().map(|u| [u[0], u[1]]));
    }

    /// Largest mean pressure of a cell.
    pub fn largest_pressure(&self) -> f64 {
        self.pressure.iter().map(|p| p[0].abs()).fold(0.0, f64::max)
    }

    /// Largest nodal speed.
    pub fn max_speed(&self) -> f64 {
        self.max_speed_of(|_| true)
    }

    /// The largest speed of the nodes that `counts` selects.
    pub fn max_speed_of(&self, counts: impl Fn(usize) -> bool) -> f64 {
        let nodes = self.velocity.iter().enumerate().filter(|(node, _)| counts(*node));
        nodes.map(|(_, u)| u[0].hypot(u[1])).fold(0.0, f64::max)
    }

    /// Root-mean-square speed over all cells that are not solid.
    pub fn rms_speed(&self, mesh: &Mesh) -> f64 {
        let [sum, volume] = threads::sum(0..mesh.cells(), |cell| {
            if mesh.solid[cell] {
                return [0.0; 2];
            }
            let nodal = self.of_cell(mesh, cell);
            let measure = mesh.cell_measure(cell);
            let squares = GAUSS_3X3.iter().map(|g| {
                let u = interpolate(&nodal, &g.shape.n);
                measure.share(g.weight, g.r[0]) * (u[0] * u[0] + u[1] * u[1])
            });
            let volume = measure.volume();
            [volume * squares.sum::<f64>(), volume]
        });
        (sum / volume).sqrt()
    }
}

/// Interpolated value: sum of nodal values weighted by the shape functions `n`.
pub fn interpolate<const D: usize>(nodal: &[[f64; D]; NODES], n: &[f64; NODES]) -> [f64; D] {
    let mut out = [0.0; D];
    for a in 0..NODES {
        for c in 0..D {
            out[c] += n[a] * nodal[a][c];
        }
    }
    out
}

/// Velocity gradient `L_ij = u_i,j` at a point of a cell of size `[hx, hy]`.
pub fn gradient(nodal: &[[f64; 2]; NODES], s: &Shape, [hx, hy]: [f64; 2]) -> Matrix2<f64> {
    let mut l = Matrix2::zeros();
    for a in 0..NODES {
        for c in 0..2 {
            l[(c, 0)] += s.d_xi[a] * nodal[a][c] * 2.0 / hx;
            l[(c, 1)] += s.d_eta[a] * nodal[a][c] * 2.0 / hy;
        }
    }
    l
}
