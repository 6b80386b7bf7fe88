//! This module leaves cells that nothing fills out of the problem, and continues the velocity into them.
//!
//! The nodes of such cells have no unknowns. Points that a step carries across the surface of the materials
//! move with velocities that are continued from there: layer by layer, each node has the mean of its
//! neighbours in the layer before. Farther away nothing moves. With inertia the momentum of material that
//! advances comes from there too; continued linearly, its velocity grew without bound within 20 steps of a
//! collapsing column.

use super::error::SimError;
use super::simulation::Simulation;
use crate::composition::fill::Fill;
use crate::plan::Plan;
use crate::solve::sides::Sides;
use crate::space::mesh::{Axis, Mesh};
use crate::space::neighbours::joined;

/// Number of layers of nodes into which velocities are continued.
const LAYERS: usize = 8;
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
        if self.trapped_void.is_none()
            && let Some(cell) = trapped(plan, fill)
        {
            let [x, y] = plan.si(plan.mesh.cell_centre(cell));
            let origin = plan.origin;
            self.trapped_void = Some([x + origin[0], y + origin[1], self.time * plan.units.time]);
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

    /// Whether nothing fills a point of a cell (reference coordinates).
    pub(super) fn is_void_at(&self, cell: usize, r: [f64; 2]) -> bool {
        let Some(fill) = self.quadrature.composition().fill() else { return false };
        if !fill.is_partial(cell) {
            return fill.of(cell) == 0.0;
        }
        let sides = self.quadrature.cut(cell).and_then(|cut| cut.sides.as_ref());
        sides.is_some_and(|Sides { between, cut, .. }| {
            let second = cut.line[0] + cut.line[1] * r[0] + cut.line[2] * r[1] < 0.0;
            cut.trust > 0.0 && between[usize::from(second)] == fill.void()
        })
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

/// A cell of a void that material encloses; `None` if every void reaches an open side, or if there is only
/// one in a closed domain, whose volume the material determines.
fn trapped(plan: &Plan, fill: &Fill) -> Option<usize> {
    let mesh = &*plan.mesh;
    let mut reaches_open = vec![false; mesh.cells()];
    for (side, piece) in plan.boundary.pieces().filter(|(_, piece)| piece.open) {
        let cells = piece.segment.cells_at_side(mesh, side);
        cells.for_each(|(_, cell)| reaches_open[cell] = true);
    }
    // Cells that are mostly filled do not join voids.
    let has_void = |cell: &usize| !mesh.solid[*cell] && fill.of(*cell) < 0.5;
    let mut seen = vec![false; mesh.cells()];
    let (mut voids, mut enclosed) = (0, None);
    for start in (0..mesh.cells()).filter(|&c| !mesh.solid[c] && fill.of(c) == 0.0) {
        if seen[start] {
            continue;
        }
        voids += 1;
        let void = joined(start, &mut seen, |cell| {
            (0..4).filter_map(move |side| mesh.beyond(cell, side)).filter(has_void)
        });
        if !void.iter().any(|&cell| reaches_open[cell]) {
            enclosed = enclosed.or(Some(start));
        }
    }
    enclosed.filter(|_| voids > 1 || !plan.boundary.closed)
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
    for _ in 0..LAYERS {
        found.clear();
        for node in (0..mesh.nodes()).filter(|&node| !known[node]) {
            let (mut sum, mut count) = ([0.0; D], 0.0);
            for (normal, up) in ways {
                let Some(one) = beside(node, normal, up).filter(|&n| known[n]) else { continue };
                (0..D).for_each(|c| sum[c] += velocity[one][c]);
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
    fn uniform_velocities_are_continued_exactly_and_end_after_some_layers() {
        let axis = |n: usize| Axis::new((0..=n).map(|k| (k * k) as f64).collect(), false);
        let mesh = Mesh::new(axis(4), axis(12));
        let height = |node: usize| mesh.node_position(node)[1];
        let mut known: Vec<bool> = (0..mesh.nodes()).map(|n| height(n) <= 1.0).collect();
        let start = known.iter().map(|&is| if is { [1.0, -2.0] } else { [f64::NAN; 2] });
        let mut velocity: Vec<[f64; 2]> = start.collect();
        continue_velocity(&mesh, &mut known, &mut velocity);
        for (node, u) in velocity.iter().enumerate() {
            // Two nodes per cell: eight layers above y = 1 end at y = 25.
            let expected = if height(node) <= 25.0 { [1.0, -2.0] } else { [0.0; 2] };
            assert_eq!(*u, expected, "{}", height(node));
        }
    }
}
