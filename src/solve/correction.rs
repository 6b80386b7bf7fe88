//! This module computes one correction of velocity and pressure and combines it with the previous
//! corrections.

use super::element::{SKELETON_NODES, expand, reduce};
use super::multifrontal::tree::NO_POSITION;
use super::problem::{CELL_GRAIN, Correction, NODE_GRAIN, Stokes, Work, add_scaled};
use super::quadrature::Quadrature;
use super::terms::pressure::Divergence;
use crate::space::flow::Flow;
use crate::space::shape::{CENTRE, NODES};
use crate::threads;

/// Largest number of previous corrections that a new one is combined with.
const MOST_DIRECTIONS: usize = 6;

impl<const D: usize> Stokes<D> {
    /// Computes one correction from the residual.
    pub(super) fn correct(&mut self, quadrature: &Quadrature, work: &mut Work<D>) {
        let Work { residual, shares, skeleton, correction, .. } = work;
        let Stokes { mesh, incidence, constraints, matrices, factor, loose, .. } = self;
        let free = |node: usize, mut force: [f64; D]| -> [f64; D] {
            (0..D).filter(|&c| constraints.is_fixed(node, c)).for_each(|c| force[c] = 0.0);
            force
        };
        let relations = constraints.embedding();
        let map = |cell: usize| relations.and_then(|r| r.of_cell(cell));
        let shares = &mut shares[..mesh.cells()];
        // The right-hand side of each cell, with the centre node condensed; the entry of the centre
        // holds the whole force.
        threads::for_each(shares, CELL_GRAIN, |cell, share| {
            if mesh.solid[cell] {
                return;
            }
            let matrix = &matrices.cells[cell];
            let p: [f64; 3] =
                std::array::from_fn(|q| -matrix.penalty[q] * residual.divergence[cell][q]);
            let mut force = [[0.0; D]; NODES];
            Divergence::new(mesh, quadrature, cell).add_transposed(&p, &mut force);
            if let Some(map) = map(cell) {
                reduce(&mut force, map);
            }
            let node = incidence.nodes[cell][CENTRE];
            let whole = std::array::from_fn(|c| force[CENTRE][c] + residual.force[node][c]);
            force[CENTRE] = free(node, whole);
            for (&a, coupling) in SKELETON_NODES.iter().zip(&matrix.centre.coupling) {
                for c in 0..D {
                    let moved = (0..D).map(|m| coupling[m][c] * force[CENTRE][m]);
                    force[a][c] -= moved.sum::<f64>();
                }
            }
            share.force = force;
        });
        let tree = factor.tree().clone();
        skeleton.resize(tree.len() * D, 0.0);
        let (x, _) = skeleton.as_chunks_mut::<D>();
        threads::for_each(x, NODE_GRAIN, |position, x| {
            let node = tree.node[position] as usize;
            *x = residual.force[node];
            for (cell, a) in incidence.of_node(node) {
                (0..D).for_each(|c| x[c] += shares[cell].force[a][c]);
            }
            *x = free(node, *x);
        });
        factor.solve(skeleton);
        let (x, _) = skeleton.as_chunks::<D>();
        correction.velocity.resize(mesh.nodes(), [0.0; D]);
        threads::for_each(&mut correction.velocity, NODE_GRAIN, |node, du| {
            let position = tree.position[node];
            *du = if position == NO_POSITION { [0.0; D] } else { free(node, x[position as usize]) };
        });
        // The change of the velocity at the centre node and of the pressure.
        let velocity = &correction.velocity;
        threads::for_each(shares, CELL_GRAIN, |cell, share| {
            if mesh.solid[cell] {
                return;
            }
            let matrix = &matrices.cells[cell];
            let mut du = incidence.nodes[cell].map(|n| velocity[n]);
            let (inverse, force) = (&matrix.centre.inverse, &share.force[CENTRE]);
            du[CENTRE] =
                std::array::from_fn(|r| (0..D).map(|m| inverse[r][m] * force[m]).sum::<f64>());
            for (&a, coupling) in SKELETON_NODES.iter().zip(&matrix.centre.coupling) {
                for r in 0..D {
                    du[CENTRE][r] -= (0..D).map(|m| coupling[r][m] * du[a][m]).sum::<f64>();
                }
            }
            share.force[CENTRE] = du[CENTRE];
            if let Some(map) = map(cell) {
                expand(&mut du, map);
            }
            let divergence = Divergence::new(mesh, quadrature, cell);
            let mass = divergence.mass(mesh.cell_measure(cell));
            let bdu = divergence.apply(&du);
            let compliance = quadrature.compliance[cell] + loose.compliance(mesh, quadrature, cell);
            for q in 0..3 {
                let dp = -matrix.penalty[q] * (residual.divergence[cell][q] + bdu[q]);
                share.sums[q] = dp;
                share.divergence[q] = bdu[q] + compliance * mass[q] * dp;
            }
            let dp = divergence.monomials([0, 1, 2].map(|q| share.sums[q]));
            share.sums[..3].copy_from_slice(&dp);
        });
        correction.pressure.resize(mesh.cells(), [0.0; 3]);
        correction.divergence.resize(mesh.cells(), [0.0; 3]);
        let shares = &*shares;
        threads::for_each(&mut correction.pressure, NODE_GRAIN, |cell, dp| {
            if !mesh.solid[cell] {
                dp.copy_from_slice(&shares[cell].sums[..3]);
            }
        });
        threads::for_each(&mut correction.divergence, NODE_GRAIN, |cell, divergence| {
            if !mesh.solid[cell] {
                *divergence = shares[cell].divergence;
            }
        });
        for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
            correction.velocity[incidence.nodes[cell][CENTRE]] = shares[cell].force[CENTRE];
        }
        if let Some(relations) = relations {
            relations.expand(&mut correction.velocity);
        }
    }

    /// Replaces the correction by the linear combination of it and the previous ones that leaves
    /// the smallest divergence. Does nothing if the forces do not balance.
    pub(super) fn combine(&self, work: &mut Work<D>, balanced: bool) {
        if !balanced {
            return;
        }
        let Work { residual, correction, directions, kept, .. } = work;
        for known in &directions[..*kept] {
            let along = self.product(&known.divergence, &correction.divergence);
            correction.add_scaled(-along, known);
        }
        let norm = self.product(&correction.divergence, &correction.divergence).sqrt();
        if norm == 0.0 {
            return;
        }
        correction.scale(1.0 / norm);
        if *kept == MOST_DIRECTIONS {
            directions.rotate_left(1);
            *kept -= 1;
        }
        if directions.len() == *kept {
            directions.push(Correction::default());
        }
        directions[*kept].clone_from(correction);
        *kept += 1;
        correction.scale(-self.product(&correction.divergence, &residual.divergence));
    }

    /// Inner product of two divergences.
    fn product(&self, a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
        let [sum] = threads::sum(0..self.mesh.cells(), |c| {
            if self.mesh.solid[c] {
                return [0.0];
            }
            let mass = self.mesh.divergence_mass(c);
            [(0..3).map(|q| a[c][q] * b[c][q] / mass[q]).sum()]
        });
        sum
    }

    /// Adds the correction to the flow.
    pub(super) fn apply(&self, work: &Work<D>, flow: &mut Flow<D>) {
        add_scaled(&mut flow.velocity, 1.0, &work.correction.velocity);
        add_scaled(&mut flow.pressure, 1.0, &work.correction.pressure);
    }
}
