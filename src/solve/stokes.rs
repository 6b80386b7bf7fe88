//! This module computes one solution of the (Cosserat) Stokes problem for given integration points.
//!
//! ```text
//! K u - B' p = f,    -B u - C p = 0        (C = Mp / bulk viscosity, 0 if incompressible)
//! ```
//! The discontinuous pressure is eliminated cell by cell with an augmented Lagrangian. The matrix
//! `A = K + B' W B`, `W = (C + Mp / (r eta))^-1`, is factored, and corrections of the residual of
//! the equations *without* augmentation give the solution:
//!
//! ```text
//! ru = f - K u + B' p,   rp = B u + C p,   du = A^-1 (ru - B' W rp),   dp = -W (rp + B du)
//! ```
//! With `r = 1e6` and `eta` the mean viscosity of the cell (by volume where an interface cuts it,
//! and with the viscosity of a stiff rotation added), two or three corrections suffice at the
//! contrasts of the presets. A constant `r eta`, or a geometric mean for `eta`, fails at a contrast
//! of 1e6.
//!
//! Once the forces balance (`ru = 0`), every correction keeps them balanced, and so does every
//! linear combination of corrections. Each new correction is therefore combined with the previous
//! ones so that the remaining divergence is smallest (generalised conjugate residuals; Eisenstat,
//! Elman and Schultz 1983). This finds the pressure of a weak pocket in stiff surroundings at once;
//! single corrections, with the weight `r eta` of the pocket, reduce its error only by the fraction
//! `r eta/eta_stiff` each. The residuals are always computed afresh from the fields.
//!
//! A converged solution must also balance its power. Where one coefficient exceeds the resistance
//! to the flow by many orders of magnitude (an internal length a million times the domain, layers a
//! million times weaker along than across), a residual that is small relative to that coefficient
//! leaves an error in the flow; a few more corrections reduce it to rounding.

use super::loose::{Course, Loose};
use super::matrices::{Ingredients, Matrices};
use super::multifrontal::{Effort, Multifrontal, NotPositiveDefinite};
use super::problem::{Given, NODE_GRAIN, Residual, Work};
pub use super::problem::{Loads, Stokes};
use super::quadrature::Quadrature;
use super::report::{Report, SolveError, Stopping};
use super::residual::PRESSURE_SHARE;
use super::symbolic::Symbolic;
use super::terms::{FaceTerm, Terms};
use crate::simd::Simd;
use crate::space::constraints::Constraints;
use crate::space::flow::Flow;
use crate::space::mesh::Mesh;
use crate::space::parts::Parts;
use crate::space::shape::SIDE_NODES;
use crate::threads;
use std::sync::Arc;
use std::time::Instant;

/// Relative tolerance of the balance of powers of a converged solution.
const POWER_TOLERANCE: f64 = 1e-9;
/// Largest residual that is taken for a rounding error beside solids.
const ROUNDING: f64 = 1e-10;
/// Change of the pressures that are continued into cells with solids, relative to the largest
/// pressure, below which they are not continued again.
const CONTINUED: f64 = 1e-5;
/// Largest number of times that they are continued in a solution.
const MOST_CONTINUATIONS: u32 = 8;
/// Largest number of further corrections that reduce the error of the balance of powers.
const POWER_CORRECTIONS: u32 = 3;

/// Takes forces on nodes away from others.
fn take<const D: usize>(out: &mut [[f64; D]], nodes: &[usize], force: &[[f64; 2]]) {
    for (&node, f) in nodes.iter().zip(force) {
        (0..2).for_each(|c| out[node][c] -= f[c]);
    }
}

impl<const D: usize> Stokes<D> {
    /// Creates the problem on a mesh; nothing is assembled or factored yet.
    pub fn new(mesh: Arc<Mesh>, constraints: Constraints<D>) -> Self {
        let Symbolic { tree, incidence } = Symbolic::of(&mesh);
        Stokes {
            incidence,
            matrices: Matrices::new(mesh.cells()),
            factor: Multifrontal::new(tree, mesh.cells()),
            diagonal: vec![[0.0; D]; mesh.nodes()],
            inverse_diagonal: vec![[0.0; D]; mesh.nodes()],
            simd: Simd::used(),
            work: Work::default(),
            loose: Loose::default(),
            void: false,
            eliminated: vec![],
            mesh,
            constraints,
        }
    }

    /// Changes the prescribed values; the same unknowns must be prescribed as before.
    pub fn prescribe(&mut self, constraints: Constraints<D>) {
        self.constraints = constraints;
    }

    /// Whether a velocity other than zero is prescribed.
    pub fn is_driven(&self) -> bool {
        self.constraints.is_driven()
    }

    /// Number of velocity and rotation unknowns, including condensed ones.
    pub fn unknowns(&self) -> usize {
        if self.void {
            return (0..self.mesh.nodes()).filter(|&node| !self.is_left_out(node)).count() * D;
        }
        self.mesh.nodes() * D
    }
    /// Work of the last factorisation.
    pub fn effort(&self) -> Effort {
        self.factor.effort()
    }

    /// Whether the flow determines the pressure of a cell: where all its velocities are given, it does not.
    pub fn determines_pressure(&self, cell: usize) -> bool {
        self.matrices.cells[cell].penalty[0] > 0.0
    }

    /// Makes the next factorisation compute the whole factor, for measurements of its time.
    pub fn forget_factor(&mut self) {
        self.factor.forget();
    }

    /// Solves for `flow`, which holds the initial guess.
    ///
    /// # Errors
    /// [`SolveError`] if the matrix is not positive definite, the corrections do not converge, or
    /// the solution is not finite.
    pub fn solve(
        &mut self,
        quadrature: &Quadrature,
        loads: Loads<D>,
        stopping: Stopping,
        flow: &mut Flow<D>,
    ) -> Result<Report, SolveError> {
        let mut report = Report::default();
        let mut course = self.has_moving_solids().then(Course::default);
        loop {
            let clock = Instant::now();
            report.active_rotation = self.assemble(quadrature, loads.terms);
            report.seconds.assemble += clock.elapsed().as_secs_f64();
            let clock = Instant::now();
            let factored = self.factor.factorize(&self.matrices.blocks);
            report.seconds.factor += clock.elapsed().as_secs_f64();
            if let Err(e) = factored {
                if self.may_be_dependent() {
                    continue;
                }
                return Err(self.explain(e));
            }
            let clock = Instant::now();
            self.constraints.impose(&mut flow.velocity);
            let mut work = std::mem::take(&mut self.work);
            work.kept = 0;
            let given = Given { quadrature, loads, stopping };
            let outcome = self.iterate(&given, &mut course, flow, &mut report, &mut work);
            let loosened = self.loosens(&outcome, stopping.tolerance, &work.residual);
            self.work = work;
            report.seconds.solve += clock.elapsed().as_secs_f64();
            if loosened {
                course = Some(Course::default());
            } else if course.as_ref().is_none_or(|c| !c.has_stalled()) {
                outcome?;
                break;
            } else {
                // The divergence falls slowly, but no cell is the reason.
                course = None;
            }
        }
        let clock = Instant::now();
        self.remove_null_space(flow);
        report.seconds.solve += clock.elapsed().as_secs_f64();
        report.loose = self.loose.count();
        Ok(report)
    }

    /// Forces of the materials on the supports at all nodes, `f - K u + B' p`.
    pub fn reactions(
        &mut self,
        quadrature: &Quadrature,
        loads: Loads<D>,
        flow: &Flow<D>,
        out: &mut Vec<[f64; D]>,
    ) {
        let mut work = std::mem::take(&mut self.work);
        self.residual(quadrature, loads, flow, &mut work);
        out.clone_from(&work.residual.force);
        if let Some(relations) = self.constraints.embedding() {
            for (node, force) in relations.nodes().zip(&work.residual.on_solids) {
                out[node] = *force;
            }
        }
        // The friction along walls that slip is a force on the flow, and its opposite on the wall.
        let (slip, outlines) = (quadrature.slip(), quadrature.slip_outlines());
        for (index, face) in slip.faces().iter().enumerate() {
            let nodes = SIDE_NODES[face.side].map(|a| self.incidence.nodes[face.cell][a]);
            let u = nodes.map(|n| [flow.velocity[n][0], flow.velocity[n][1]]);
            take(out, &nodes, &slip.force(index, nodes, u).0);
        }
        for &cell in outlines.cells() {
            let nodes = &self.incidence.nodes[cell];
            let u = nodes.map(|n| [flow.velocity[n][0], flow.velocity[n][1]]);
            take(out, nodes, &outlines.force(cell, u).0);
        }
        // The pressure on outlines does no work on the flow.
        for (cell, part) in self.mesh.parts().into_iter().flat_map(Parts::all) {
            for (a, &node) in self.incidence.nodes[cell].iter().enumerate() {
                for c in 0..2 {
                    let pressure = flow.pressure[cell].iter().zip(&part.outline);
                    out[node][c] += pressure.map(|(p, row)| p * row[c][a]).sum::<f64>();
                }
            }
        }
        self.work = work;
    }

    /// Corrects `flow` until the residual, the divergence and the balance of powers are small.
    fn iterate(
        &mut self,
        given: &Given<D>,
        course: &mut Option<Course>,
        flow: &mut Flow<D>,
        report: &mut Report,
        work: &mut Work<D>,
    ) -> Result<(), SolveError> {
        let &Given { quadrature, loads, stopping } = given;
        let load = loads.nodal;
        let (mut further, mut continued) = (0, 0);
        // Number of corrections when the pressures were continued last.
        let mut begun = report.corrections;
        flow.continue_slopes(&self.mesh, loads.weight, &quadrature.mean_viscosity);
        loop {
            self.residual(quadrature, loads, flow, work);
            let residual = &work.residual;
            let slack;
            (report.residual, report.divergence, slack, report.power_scale) =
                self.norms(residual, load, flow);
            report.dissipation = residual.dissipation;
            report.restoring = residual.restoring;
            report.power_in = self.power_in(residual, load, flow);
            if !(report.residual.is_finite() && report.divergence.is_finite()) {
                return Err(SolveError::NonFinite { corrections: report.corrections });
            }
            let balanced = report.residual <= stopping.tolerance;
            let converged = balanced
                && report.divergence <= stopping.tolerance * (1.0 + PRESSURE_SHARE * slack);
            if converged && continued < MOST_CONTINUATIONS && self.mesh.parts().is_some() {
                let change =
                    flow.continue_slopes(&self.mesh, loads.weight, &quadrature.mean_viscosity);
                if change > CONTINUED * flow.largest_pressure() {
                    continued += 1;
                    begun = report.corrections;
                    work.kept = 0;
                    continue;
                }
            }
            if converged {
                if further == POWER_CORRECTIONS || report.power_error() <= POWER_TOLERANCE {
                    return Ok(());
                }
                further += 1;
            } else if report.corrections - begun >= stopping.max_corrections
                && self.is_rounding(report, &given.stopping)
            {
                return Ok(());
            } else if report.corrections - begun >= stopping.max_corrections
                || course.as_mut().is_some_and(|c| c.stalls(report.divergence, stopping.tolerance))
            {
                return Err(self.stalled(residual, report, stopping.tolerance));
            }
            self.correct(quadrature, work);
            // Linear combinations reduce the divergence only; while the forces do not balance, the
            // correction is applied as it is.
            self.combine(work, balanced && !converged);
            self.apply(work, flow);
            report.corrections += 1;
        }
    }

    /// Whether solids move, so that a solution may exist only if some cells change their volume.
    fn has_moving_solids(&self) -> bool {
        self.mesh.parts().is_some_and(Parts::move_on)
    }

    /// After a factorisation that failed, whether another one may succeed, with unknowns beside solids that
    /// are not taken to be independent.
    pub(super) fn may_be_dependent(&mut self) -> bool {
        self.mesh.parts().is_some() && self.loose.declare_dependent()
    }

    /// After corrections that have left more divergence than `tolerance`, lets the cells at solids with the
    /// largest divergences change their volume; returns whether there are any that could not before.
    pub(super) fn loosens(
        &mut self,
        outcome: &Result<(), SolveError>,
        tolerance: f64,
        residual: &Residual<D>,
    ) -> bool {
        match outcome {
            Err(SolveError::Stalled { divergence, .. })
                if *divergence > tolerance && self.mesh.parts().is_some() =>
            {
                self.loose.add_largest(&self.mesh, &residual.divergence)
            }
            _ => false,
        }
    }

    /// Whether only rounding keeps the residual from falling further: beside solids and voids that leave
    /// slivers of cells, rounding errors of large pressures are larger than elsewhere.
    fn is_rounding(&self, report: &Report, stopping: &Stopping) -> bool {
        (self.mesh.parts().is_some() || self.void)
            && report.residual <= ROUNDING.max(stopping.tolerance)
            && report.divergence <= stopping.tolerance
            && report.power_error() <= POWER_TOLERANCE
    }

    /// Computes the element matrices of the cells that changed; returns the number of active
    /// rotation unknowns.
    pub(super) fn assemble(&mut self, quadrature: &Quadrature, terms: &Terms) -> usize {
        let Stokes {
            mesh,
            incidence,
            constraints,
            matrices,
            factor,
            diagonal,
            inverse_diagonal,
            loose,
            ..
        } = self;
        let from = Ingredients { mesh, incidence, constraints, quadrature, terms, loose };
        matrices.update(from, |cell| factor.touch(cell));
        diagonal.fill([0.0; D]);
        incidence.add_up(diagonal, |cell, a| matrices.cells[cell].diagonal[a]);
        threads::for_each(inverse_diagonal, NODE_GRAIN, |node, inverse| {
            *inverse = diagonal[node].map(|d| if d > 0.0 { 1.0 / d } else { 0.0 });
        });
        if D == 3 { diagonal.iter().filter(|d| d[D - 1] > 0.0).count() } else { 0 }
    }

    /// The error of a failed factorisation, with the position and the name of the unknown.
    pub(super) fn explain(&self, source: NotPositiveDefinite) -> SolveError {
        let node = self.factor.tree().node[source.unknown / D] as usize;
        let [x, y] = self.mesh.node_position(node);
        let component = ["u", "v", "w"][source.unknown % D];
        SolveError::Factor { source, x, y, component }
    }

    /// Position of the largest residual, relative to the diagonal of the matrix.
    pub(super) fn largest_residual(&self, r: &Residual<D>) -> [f64; 2] {
        let worst = (0..self.mesh.nodes())
            .flat_map(|n| (0..D).map(move |c| (n, c)))
            .filter(|&(n, c)| !self.constraints.is_fixed(n, c) && self.diagonal[n][c] > 0.0)
            .map(|(n, c)| (n, r.force[n][c].powi(2) / self.diagonal[n][c]))
            .fold((0, 0.0), |a: (usize, f64), b| if b.1 > a.1 { b } else { a });
        self.mesh.node_position(worst.0)
    }

    /// The error of a solution that did not converge, with the position of the largest residual, or
    /// of the largest divergence if the residual has converged.
    pub(super) fn stalled(&self, r: &Residual<D>, report: &Report, tolerance: f64) -> SolveError {
        let largest = |a: (usize, f64), b: (usize, f64)| if b.1 > a.1 { b } else { a };
        let [x, y] = if report.residual > tolerance {
            self.largest_residual(r)
        } else {
            let density = |cell: usize| {
                let sum: f64 = r.divergence[cell].iter().map(|d| d * d).sum();
                (cell, sum / self.mesh.cell_volume(cell))
            };
            let worst = (0..self.mesh.cells()).map(density).fold((0, 0.0), largest);
            self.mesh.cell_centre(worst.0)
        };
        SolveError::Stalled {
            corrections: report.corrections,
            residual: report.residual,
            divergence: report.divergence,
            x,
            y,
        }
    }
}
