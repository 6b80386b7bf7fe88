//! This module computes the residual of a flow, the imbalance of forces and the divergence, cell by
//! cell, with the norms and powers that are computed from it.

use super::problem::{CELL_GRAIN, Loads, Residual, Share, Stokes, Work};
use super::quadrature::Quadrature;
use super::terms::pressure::Divergence;
use super::terms::viscous::{Internal, TOGETHER};
use super::terms::{FaceTerm, Terms};
use crate::space::flow::Flow;
use crate::space::parts::Parts;
use crate::space::shape::{NODES, SIDE_NODES};
use crate::threads;
use std::ops::Range;

/// Share of `||sqrt(D) u||` in the scale of the divergence; negligible in a strained flow.
const RIGID_SHARE: f64 = 1e-3;

/// Share of the forces of the pressure in the scale of the residual, and of the divergence that
/// belongs to the pressure by the penalty in the tolerance of the divergence. At the usual
/// tolerance it allows one or two units in the last place of a pressure far larger than the viscous
/// stresses.
pub(super) const PRESSURE_SHARE: f64 = 3e-4;

/// Share of `||sqrt(D) u||^2` in the scale of powers: far below the dissipation of a strained flow,
/// above the rounding errors of a rigid one.
const RIGID_POWER: f64 = 3e-2;

impl<const D: usize> Stokes<D> {
    /// Computes the residual of `flow`.
    pub(super) fn residual(
        &self,
        quadrature: &Quadrature,
        Loads { nodal, terms, .. }: Loads<D>,
        flow: &Flow<D>,
        work: &mut Work<D>,
    ) {
        let Work { residual: out, shares, .. } = work;
        let cells = self.mesh.cells();
        // Whole blocks of cells; entries after the last cell stay zero.
        shares.resize(cells.next_multiple_of(TOGETHER), Share::default());
        let (blocks, _) = shares.as_chunks_mut::<TOGETHER>();
        threads::for_each(blocks, CELL_GRAIN / TOGETHER, |block, shares| {
            let first = block * TOGETHER;
            self.residuals(first..cells.min(first + TOGETHER), quadrature, terms, flow, shares);
        });
        let shares = &shares[..cells];
        let sums = threads::sum(0..shares.len(), |cell| shares[cell].sums);
        [out.dissipation, out.strain, out.divergence_norm, out.restoring, ..] = sums;
        [.., out.pressure_norm, out.penalty_norm, out.pressure_square, out.continued] = sums;
        let cells = (0..self.mesh.cells()).filter(|&c| !self.mesh.solid[c]);
        out.stiffest = cells.map(|c| quadrature.mean_viscosity[c]).fold(0.0, f64::max);
        out.divergence.clear();
        out.divergence.extend(shares.iter().map(|s| s.divergence));
        out.force.clear();
        out.force.extend_from_slice(nodal);
        self.incidence.add_up(&mut out.force, |cell, a| shares[cell].force[a]);
        (out.supplied, out.drive) = (0.0, 0.0);
        for term in terms.on_faces().chain([quadrature.slip() as &dyn FaceTerm]) {
            for (index, face) in term.faces().iter().enumerate() {
                let nodes = SIDE_NODES[face.side].map(|a| self.incidence.nodes[face.cell][a]);
                let u = nodes.map(|n| [flow.velocity[n][0], flow.velocity[n][1]]);
                let (force, powers) = term.force(index, nodes, u);
                out.restoring += powers.numerical;
                out.dissipation += powers.dissipated;
                out.supplied += powers.supplied;
                let drive = term.drive(index);
                for ((node, f), drive) in nodes.into_iter().zip(force).zip(drive) {
                    for c in 0..2 {
                        out.force[node][c] += f[c];
                        if !self.constraints.is_fixed(node, c) {
                            out.drive += drive[c] * drive[c] * self.inverse_diagonal[node][c];
                        }
                    }
                }
            }
        }
        self.add_slip_outlines(quadrature, flow, out);
        for (cell, part) in
            self.mesh.parts().filter(|p| p.move_on()).into_iter().flat_map(Parts::all)
        {
            let [u, v] = part.velocity;
            // Pressures that are not solved for are counted with the continued ones.
            if self.determines_pressure(cell) {
                out.supplied += flow.pressure[cell][0] * part.swept;
            }
            out.drive += quadrature.mean_viscosity[cell] * (u * u + v * v);
        }
        if let Some(relations) = self.constraints.embedding() {
            out.on_solids.clear();
            out.on_solids.extend(relations.nodes().map(|node| out.force[node]));
            relations.reduce(&mut out.force);
        }
    }

    /// Adds the friction along outlines, and its powers.
    fn add_slip_outlines(&self, quadrature: &Quadrature, flow: &Flow<D>, out: &mut Residual<D>) {
        let outlines = quadrature.slip_outlines();
        for &cell in outlines.cells() {
            let nodes = &self.incidence.nodes[cell];
            let u = nodes.map(|n| [flow.velocity[n][0], flow.velocity[n][1]]);
            let (force, powers) = outlines.force(cell, u);
            out.dissipation += powers.dissipated;
            out.supplied += powers.supplied;
            for (&node, f) in nodes.iter().zip(force) {
                out.force[node][0] += f[0];
                out.force[node][1] += f[1];
            }
        }
    }

    /// Computes the residuals of up to [`TOGETHER`] cells.
    fn residuals(
        &self,
        cells: Range<usize>,
        quadrature: &Quadrature,
        terms: &Terms,
        flow: &Flow<D>,
        shares: &mut [Share<D>; TOGETHER],
    ) {
        let rotation = &self.matrices.rotation;
        let internal = Internal::of_cells(self.simd, quadrature, rotation, cells.clone(), |cell| {
            let u = self.incidence.nodes[cell].map(|n| flow.velocity[n]);
            (!self.mesh.solid[cell]).then(|| (self.mesh.cell_measure(cell), u))
        });
        for (cell, (share, internal)) in cells.zip(shares.iter_mut().zip(&internal)) {
            if !self.mesh.solid[cell] {
                self.cell_residual(cell, internal, quadrature, terms, flow, share);
            }
        }
    }

    /// Computes the residual of one cell from its internal forces.
    fn cell_residual(
        &self,
        cell: usize,
        internal: &Internal<D>,
        quadrature: &Quadrature,
        terms: &Terms,
        flow: &Flow<D>,
        share: &mut Share<D>,
    ) {
        let nodes = &self.incidence.nodes[cell];
        let u = nodes.map(|n| flow.velocity[n]);
        let divergence = Divergence::new(&self.mesh, quadrature, cell);
        let mass = divergence.mass(self.mesh.cell_measure(cell));
        let weights = self.mesh.divergence_mass(cell);
        let relations = self.constraints.embedding();
        let pressure = divergence.coefficients(flow.pressure[cell]);
        let compliance =
            quadrature.compliance[cell] + self.loose.compliance(&self.mesh, quadrature, cell);
        let mut force = [[0.0; D]; NODES];
        divergence.add_transposed(&pressure, &mut force);
        let mut pressure_norm = 0.0;
        for (a, &node) in nodes.iter().enumerate() {
            if relations.is_some_and(|r| r.holds(node)) {
                continue;
            }
            for c in 0..2 {
                pressure_norm += force[a][c] * force[a][c] * self.inverse_diagonal[node][c];
            }
        }
        let mut bu = divergence.apply(&u);
        bu[0] -= divergence.swept();
        let [mut penalty_norm, mut pressure_square, mut divergence_norm] = [0.0; 3];
        let mut continued = 0.0;
        for q in 0..3 {
            let penalty = self.matrices.cells[cell].penalty[q];
            if penalty == 0.0 {
                // A pressure that is given does work on the divergence.
                continued += pressure[q] * divergence.of_given(q, &u);
                share.divergence[q] = 0.0;
                continue;
            }
            let rp = bu[q] + compliance * mass[q] * pressure[q];
            let needed = pressure[q] / penalty;
            penalty_norm += needed * needed / mass[q];
            pressure_square += mass[q] * pressure[q] * pressure[q];
            divergence_norm += rp * rp / weights[q];
            share.divergence[q] = rp;
        }
        let dissipation = internal.dissipation + compliance * pressure_square;
        for a in 0..NODES {
            for c in 0..D {
                force[a][c] -= internal.force[a][c];
            }
        }
        let mut taken = 0.0;
        for term in terms.on_cells().into_iter().filter(|t| t.acts_on(cell)) {
            let motion = u.map(|u| [u[0], u[1], if D == 3 { u[D - 1] } else { 0.0 }]);
            let (f, power) = term.force(cell, nodes, &motion);
            taken += power;
            for (force, f) in force.iter_mut().zip(f) {
                for c in 0..term.components().min(D) {
                    force[c] += f[c];
                }
            }
        }
        share.force = force;
        let [strain, norms] = [internal.strain, divergence_norm];
        share.sums = [
            dissipation,
            strain,
            norms,
            taken,
            pressure_norm,
            penalty_norm,
            pressure_square,
            continued,
        ];
    }

    /// Returns the scaled residual, the relative divergence, the divergence that belongs to the
    /// pressure by the penalty (relative to the same scale), and a scale of power.
    pub(super) fn norms(
        &self,
        r: &Residual<D>,
        load: &[[f64; D]],
        flow: &Flow<D>,
    ) -> (f64, f64, f64, f64) {
        let relations = self.constraints.embedding();
        let [rr, ff, uu] = threads::sum(0..self.mesh.nodes(), |node| {
            let mut sums = [0.0; 3];
            for c in 0..D {
                let d = self.diagonal[node][c];
                if d == 0.0 {
                    continue;
                }
                let embedded = relations.is_some_and(|r| r.binds(node, c));
                if !embedded {
                    sums[2] += d * flow.velocity[node][c].powi(2);
                }
                if !self.constraints.is_fixed(node, c) {
                    let inverse = self.inverse_diagonal[node][c];
                    sums[0] += r.force[node][c].powi(2) * inverse;
                    if !embedded {
                        sums[1] += load[node][c].powi(2) * inverse;
                    }
                }
            }
            sums
        });
        let ff = ff + r.drive;
        // The last terms keep the ratios meaningful at rest and in a rigid rotation, where
        // divergence and strain are both rounding errors.
        let scale = ff.sqrt() + uu.sqrt() + PRESSURE_SHARE * r.pressure_norm.sqrt();
        let strain = r.strain.sqrt() + ff.sqrt() + RIGID_SHARE * uu.sqrt();
        let ratio = |a: f64, b: f64| if a == 0.0 { 0.0 } else { a / b };
        let stiffest = r.stiffest.max(f64::MIN_POSITIVE);
        (
            ratio(rr.sqrt(), scale),
            ratio(r.divergence_norm.sqrt(), strain),
            ratio(r.penalty_norm.sqrt(), strain),
            ff + RIGID_POWER * uu + r.pressure_square / stiffest,
        )
    }

    /// Power of the loads, of the reactions on moving boundaries and of the friction at moving walls.
    pub(super) fn power_in(&self, r: &Residual<D>, load: &[[f64; D]], flow: &Flow<D>) -> f64 {
        let relations = self.constraints.embedding();
        let [power] = threads::sum(0..self.mesh.nodes(), |node| {
            let (u, mut power) = (flow.velocity[node], 0.0);
            for c in 0..D {
                power += load[node][c] * u[c];
                let embedded = relations.is_some_and(|r| r.binds(node, c));
                if self.constraints.is_fixed(node, c) && !embedded {
                    power -= r.force[node][c] * u[c];
                }
            }
            [power]
        });
        let Some(relations) = relations else { return power + r.supplied };
        power + r.supplied + r.continued - r.power_on_solids(relations, &flow.velocity)
    }
}
