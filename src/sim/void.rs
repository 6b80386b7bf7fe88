//! This module leaves cells that nothing fills out of the problem, and continues the velocity into them.
//!
//! The nodes of such cells have no unknowns. Points that a step carries across the surface of the materials
//! move with velocities that are continued from there: along the lines of the mesh, linearly in the first
//! empty cell, and by the mean of the neighbours beyond it. Farther away nothing moves.

use super::error::SimError;
use super::simulation::Simulation;
use crate::space::mesh::{Axis, Mesh};

/// Number of layers of nodes into which velocities are continued.
const LAYERS: usize = 8;
/// Number of layers in which they are continued linearly.
const LINEAR: usize = 2;
/// Largest number of cells of a body that nothing holds which is carried along as debris.
const DEBRIS: usize = 8;

impl<const D: usize> Simulation<D> {
    /// Leaves the cells that nothing fills out of the next solution, after the content of the cells was
    /// found.
    ///
    /// # Errors
    /// Without inertia, a body that nothing holds has no flow.
    pub(super) fn leave_out_void(&mut self) -> Result<(), SimError> {
        let Simulation { quadrature, stokes, velocities, flow, plan, .. } = self;
        let Some(fill) = quadrature.composition().fill() else { return Ok(()) };
        if fill.largest_loose().len() > DEBRIS {
            let [x, y] = plan.si(plan.mesh.cell_centre(fill.largest_loose()[0]));
            let (step, time) = (self.step, self.time * plan.units.time);
            return Err(SimError::Falls { step, time, x, y });
        }
        stokes.leave_out(&plan.mesh, |cell| fill.of(cell) == 0.0);
        velocities.keep_divergence(|cell| fill.of(cell) < 1.0);
        if let Some(inertia) = &mut self.inertia {
            inertia.keep_divergence(|cell| fill.of(cell) < 1.0);
        }
        for (cell, pressure) in flow.pressure.iter_mut().enumerate() {
            if fill.of(cell) == 0.0 {
                *pressure = [0.0; 3];
            }
        }
        Ok(())
    }

    /// Continues the velocity of the last solution into the cells that nothing fills.
    pub(super) fn continue_into_void(&mut self) {
        if !self.plan.effects.void {
            return;
        }
        let mesh = &*self.plan.mesh;
        let occupied = self.stokes.mesh();
        let mut known = vec![false; mesh.nodes()];
        for cell in (0..mesh.cells()).filter(|&c| !occupied.solid[c]) {
            mesh.cell_nodes(cell).into_iter().for_each(|node| known[node] = true);
        }
        continue_velocity(mesh, &mut known, &mut self.flow.velocity);
        self.stokes.impose(&mut self.flow.velocity);
    }
}

/// Continues nodal velocities from the nodes that are `known`; the others become zero.
fn continue_velocity<const D: usize>(mesh: &Mesh, known: &mut [bool], velocity: &mut [[f64; D]]) {
    let columns = mesh.x.nodes();
    // The node beside another one along an axis, in a direction.
    let beside = |node: usize, normal: usize, up: bool| -> Option<usize> {
        let (axis, _) = mesh.axes(normal);
        let (i, j) = (node % columns, node / columns);
        let next = neighbour(axis, [i, j][normal], up)?;
        Some(if normal == 0 { mesh.node(next, j) } else { mesh.node(i, next) })
    };
    let ways = [(0, false), (0, true), (1, false), (1, true)];
    let mut found: Vec<(usize, [f64; D])> = vec![];
    for layer in 0..LAYERS {
        found.clear();
        for node in (0..mesh.nodes()).filter(|&node| !known[node]) {
            let (mut sum, mut count) = ([0.0; D], 0.0);
            for (normal, up) in ways {
                let Some(one) = beside(node, normal, up).filter(|&n| known[n]) else { continue };
                let two = beside(one, normal, up).filter(|&n| layer < LINEAR && known[n]);
                let slope = two.map_or(0.0, |two| {
                    let at = |n: usize| mesh.node_position(n)[normal];
                    let apart =
                        |a: usize, b: usize| mesh.axes(normal).0.nearest_image(at(a) - at(b));
                    apart(node, one) / apart(one, two)
                });
                let (u, v) = (velocity[one], velocity[two.unwrap_or(one)]);
                (0..D).for_each(|c| sum[c] += u[c] + slope * (u[c] - v[c]));
                count += 1.0;
            }
            if count > 0.0 {
                found.push((node, sum.map(|s| s / count)));
            }
        }
        for (node, u) in &found {
            (velocity[*node], known[*node]) = (*u, true);
        }
    }
    for (u, _) in velocity.iter_mut().zip(known).filter(|(_, known)| !**known) {
        *u = [0.0; D];
    }
}

/// The node beside another one on an axis.
fn neighbour(axis: &Axis, node: usize, up: bool) -> Option<usize> {
    let last = axis.nodes() - 1;
    match (node, up) {
        (0, false) => axis.periodic().then_some(last),
        (_, false) => Some(node - 1),
        (_, true) if node == last => axis.periodic().then_some(0),
        (_, true) => Some(node + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_velocities_are_continued_exactly_into_the_next_cell() {
        let axis = |n: usize| Axis::new((0..=n).map(|k| (k * k) as f64).collect(), false);
        let mesh = Mesh::new(axis(4), axis(3));
        let exact = |node: usize| {
            let [x, y] = mesh.node_position(node);
            [1.0 + 2.0 * x - y, 0.5 * x + y]
        };
        let mut known: Vec<bool> =
            (0..mesh.nodes()).map(|n| mesh.node_position(n)[1] <= 1.0).collect();
        let mut velocity: Vec<[f64; 2]> =
            (0..mesh.nodes()).map(|n| if known[n] { exact(n) } else { [f64::NAN; 2] }).collect();
        continue_velocity(&mesh, &mut known, &mut velocity);
        for (node, u) in velocity.iter().enumerate() {
            let within = mesh.node_position(node)[1] <= 4.0;
            let off = (0..2).map(|c| (u[c] - exact(node)[c]).abs()).fold(0.0, f64::max);
            assert!(u.iter().all(|u| u.is_finite()) && (!within || off < 1e-12), "{node}: {u:?}");
        }
    }
}
