//! This module holds the velocity of every cell in the form that its measure calls for.

use super::cell_velocity::{self, CellVelocity, Points, Ways};
use super::ring_velocity::{self, RingVelocity};
use crate::simd::Simd;
use crate::space::mesh::Mesh;
use crate::space::shape::NODES;
use crate::threads;
use nalgebra::Matrix2;

/// Number of cells in a parallel task.
pub const CELL_GRAIN: usize = 64;

/// Velocity of every cell.
pub enum Currents {
    /// In the plane.
    Plane(Vec<CellVelocity>),
    /// Around an axis.
    Ring(Vec<RingVelocity>),
}

impl Currents {
    /// Zero velocities on a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        if mesh.measure().is_ring() {
            Currents::Ring(vec![RingVelocity::default(); mesh.cells()])
        } else {
            Currents::Plane(vec![CellVelocity::default(); mesh.cells()])
        }
    }

    /// Sets the velocities of all cells from their nodal velocities; those that are `divergent` keep their
    /// divergence.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        divergent: &[bool],
        nodal: impl Fn(usize) -> [[f64; 2]; NODES] + Sync,
    ) {
        // Beside a solid it vanishes on the outline; corrected, it would not.
        let corrected = |cell| {
            let keeps = divergent.get(cell).is_some_and(|&keeps| keeps);
            !keeps && mesh.part(cell).is_none() && mesh.solid_velocity(cell).is_none()
        };
        match self {
            Currents::Plane(cells) => threads::for_each(cells, CELL_GRAIN, |cell, current| {
                let nodal = nodal(cell);
                *current = if corrected(cell) {
                    CellVelocity::new(&nodal, mesh.cell_size(cell))
                } else {
                    CellVelocity::uncorrected(&nodal)
                };
            }),
            Currents::Ring(cells) => threads::for_each(cells, CELL_GRAIN, |cell, current| {
                let measure = mesh.whole_measure(cell);
                *current = RingVelocity::new(&nodal(cell), measure, corrected(cell));
            }),
        }
    }

    /// Velocity at reference coordinates of a cell.
    pub fn at(&self, cell: usize, r: [f64; 2]) -> [f64; 2] {
        match self {
            Currents::Plane(cells) => cells[cell].at(r),
            Currents::Ring(cells) => cells[cell].at(r),
        }
    }

    /// Velocity gradient in the plane of the mesh.
    pub fn gradient(&self, cell: usize, r: [f64; 2], size: [f64; 2]) -> Matrix2<f64> {
        match self {
            Currents::Plane(cells) => cells[cell].gradient(r, size),
            Currents::Ring(cells) => cells[cell].gradient(r, size),
        }
    }

    /// Paths of points of a cell.
    pub fn trace(&self, simd: Simd, cell: usize, r: &Points, step: [f64; 2]) -> Ways {
        match self {
            Currents::Plane(cells) => cell_velocity::trace_points(simd, &cells[cell], r, step),
            Currents::Ring(cells) => ring_velocity::trace_points(simd, &cells[cell], r, step),
        }
    }
}
