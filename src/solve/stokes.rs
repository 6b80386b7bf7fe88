//! One solution of the (Cosserat) Stokes problem for given integration points.
//!
//! ```text
//! K u - B' p = f,    -B u - C p = 0        (C = Mp / bulk viscosity, 0 if incompressible)
//! ```
//! The discontinuous pressure is eliminated cell by cell by an augmented Lagrangian; the matrix
//! `A = K + B' W B`, `W = (C + Mp / (r eta))^-1`, is factored, and the solution is found by
//! corrections of the *un-augmented* residual:
//!
//! ```text
//! ru = f - K u + B' p,   rp = B u + C p,   du = A^-1 (ru - B' W rp),   dp = -W (rp + B du)
//! ```
//! With `r = 1e4` and `eta` the mean viscosity of the cell's points this takes 3-4 corrections
//! at contrasts up to 1e6; a constant `r`, or a geometric mean, fails there.
//!
//! Once the forces balance (`ru = 0`), every correction keeps them balanced, and so does any sum of
//! corrections: each new one is combined with those before it such that the divergence that
//! remains is least (generalised conjugate residuals; Eisenstat, Elman and Schultz 1983). The
//! pressure of a weak pocket in stiff surroundings, which single corrections of weight `r eta` of
//! the pocket approach by a share `r eta/eta_stiff` each, is so found at once; the residuals are
//! always computed afresh from the fields.
//!
//! A solution that has converged must also balance its power: where one coefficient exceeds what
//! resists the flow by many orders (an internal length a million times the domain, layers a million
//! times weaker along than across), a residual that is small beside the former leaves an error in
//! the latter, and a few more corrections bring it down to rounding.

use super::matrices::{Ingredients, Matrices};
use super::multifrontal::{Effort, Multifrontal, NotPositiveDefinite};
use super::problem::{Given, NODE_GRAIN, Residual, Work};
pub use super::problem::{Loads, Stokes};
use super::quadrature::Quadrature;
use super::report::{Report, SolveError, Stopping};
use super::residual::PRESSURE_SHARE;
use super::symbolic::Symbolic;
use super::terms::Terms;
use crate::simd::Simd;
use crate::space::constraints::Constraints;
use crate::space::flow::Flow;
use crate::space::mesh::Mesh;
use crate::threads;
use std::sync::Arc;
use std::time::Instant;

/// Powers must balance to this, or as near as that many further corrections bring them.
const POWER_TOLERANCE: f64 = 1e-9;
const POWER_CORRECTIONS: u32 = 3;

impl<const D: usize> Stokes<D> {
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
            mesh,
            constraints,
        }
    }

    pub fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }
    pub fn constraints(&self) -> &Constraints<D> {
        &self.constraints
    }
    /// Velocity and rotation unknowns, condensed ones included.
    pub fn unknowns(&self) -> usize {
        self.mesh.nodes() * D
    }
    /// What the last factorisation took.
    pub fn effort(&self) -> Effort {
        self.factor.effort()
    }

    /// Lets the next factorisation compute all of the factor, changed or not: for measurements.
    pub fn forget_factor(&mut self) {
        self.factor.forget();
    }

    /// Solves for `flow`, starting from what it holds.
    pub fn solve(
        &mut self,
        quadrature: &Quadrature,
        loads: Loads<D>,
        stopping: Stopping,
        flow: &mut Flow<D>,
    ) -> Result<Report, SolveError> {
        let mut report = Report::default();
        let clock = Instant::now();
        report.active_rotation = self.assemble(quadrature, loads.terms);
        report.seconds.assemble = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        self.factor.factorize(&self.matrices.blocks).map_err(|e| self.explain(e))?;
        report.seconds.factor = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        self.constraints.impose(&mut flow.velocity);
        let mut work = std::mem::take(&mut self.work);
        work.kept = 0;
        let outcome =
            self.iterate(&Given { quadrature, loads, stopping }, flow, &mut report, &mut work);
        self.work = work;
        outcome?;
        self.constraints.remove_null_space(&self.mesh, flow);
        report.seconds.solve = clock.elapsed().as_secs_f64();
        Ok(report)
    }

    /// Corrects `flow` until the residual is small.
    fn iterate(
        &mut self,
        given: &Given<D>,
        flow: &mut Flow<D>,
        report: &mut Report,
        work: &mut Work<D>,
    ) -> Result<(), SolveError> {
        let &Given { quadrature, loads, stopping } = given;
        let load = loads.nodal;
        let mut further = 0;
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
            if converged {
                if further == POWER_CORRECTIONS || report.power_error() <= POWER_TOLERANCE {
                    return Ok(());
                }
                further += 1;
            } else if report.corrections >= stopping.max_corrections {
                return Err(self.stalled(residual, report, stopping.tolerance));
            }
            self.correct(quadrature, work);
            // Sums of corrections mind the divergence only; here the forces are to be corrected.
            self.combine(work, balanced && !converged);
            self.apply(work, flow);
            report.corrections += 1;
        }
    }

    /// Element matrices of the cells that changed; number of active rotation unknowns.
    fn assemble(&mut self, quadrature: &Quadrature, terms: &Terms) -> usize {
        let Stokes {
            mesh,
            incidence,
            constraints,
            matrices,
            factor,
            diagonal,
            inverse_diagonal,
            ..
        } = self;
        let from = Ingredients { mesh, incidence, constraints, quadrature, terms };
        matrices.update(from, |cell| factor.touch(cell));
        diagonal.fill([0.0; D]);
        incidence.add_up(diagonal, |cell, a| matrices.cells[cell].diagonal[a]);
        threads::for_each(inverse_diagonal, NODE_GRAIN, |node, inverse| {
            *inverse = diagonal[node].map(|d| 1.0 / d);
        });
        if D == 3 { diagonal.iter().filter(|d| d[D - 1] > 0.0).count() } else { 0 }
    }

    fn explain(&self, source: NotPositiveDefinite) -> SolveError {
        let node = self.factor.tree().node[source.unknown / D] as usize;
        let [x, y] = self.mesh.node_position(node);
        let component = ["u", "v", "w"][source.unknown % D];
        SolveError::Factor { source, x, y, component }
    }

    fn stalled(&self, r: &Residual<D>, report: &Report, tolerance: f64) -> SolveError {
        let largest = |a: (usize, f64), b: (usize, f64)| if b.1 > a.1 { b } else { a };
        let [x, y] = if report.residual > tolerance {
            let worst = (0..self.mesh.nodes())
                .flat_map(|n| (0..D).map(move |c| (n, c)))
                .filter(|&(n, c)| !self.constraints.is_fixed(n, c) && self.diagonal[n][c] > 0.0)
                .map(|(n, c)| (n, r.force[n][c].powi(2) / self.diagonal[n][c]))
                .fold((0, 0.0), largest);
            self.mesh.node_position(worst.0)
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
