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

use super::buoyancy::{Restoring, SIDE_NODES};
use super::element::{Divergence, Internal, Nodal, SKELETON_NODES, TOGETHER, pressure_mass};
use super::matrices::{Ingredients, Matrices};
use super::multifrontal::tree::NO_POSITION;
use super::multifrontal::{Effort, Multifrontal, NotPositiveDefinite};
use super::quadrature::Quadrature;
use super::symbolic::Symbolic;
use crate::simd::Simd;
use crate::space::constraints::Constraints;
use crate::space::flow::Flow;
use crate::space::incidence::Incidence;
use crate::space::mesh::Mesh;
use crate::space::shape::{CENTRE, NODES};
use crate::threads;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

/// Cells, and nodes, that are worth a task of their own.
const CELL_GRAIN: usize = 128;
const NODE_GRAIN: usize = 2048;

/// Share of `||sqrt(D) u||` in the scale of the divergence: far below that of a strained flow.
const RIGID_SHARE: f64 = 1e-3;

/// Share of the pressure's forces in the scale of the residual, and of what the penalty makes of
/// the pressure in that of the divergence: at the usual tolerance a unit or two in the last place of
/// a pressure that is far larger than the stresses of the flow.
const PRESSURE_SHARE: f64 = 3e-4;

/// Powers must balance to this, or as near as that many further corrections bring them.
const POWER_TOLERANCE: f64 = 1e-9;
const POWER_CORRECTIONS: u32 = 3;

/// Powers below this share of [`Report::power_scale`] are rounding: the scene is at rest.
const REST: f64 = 1e-6;
/// Share of `||sqrt(D) u||^2` in that scale: far below the dissipation of a strained flow, above
/// the rounding of a rigid one.
const RIGID_POWER: f64 = 3e-2;

/// Most corrections that a new one is combined with.
const MOST_DIRECTIONS: usize = 6;

/// When the corrections stop.
#[derive(Clone, Copy, Debug)]
pub struct Stopping {
    /// On the scaled residual and on the relative divergence.
    pub tolerance: f64,
    pub max_corrections: u32,
}

/// How a solution went.
#[derive(Clone, Copy, Debug, Default)]
pub struct Report {
    pub corrections: u32,
    /// `||r||_{1/D} / (||f||_{1/D} + ||sqrt(D) u||)`, `D = diag K`.
    pub residual: f64,
    /// L2 norm of the projected divergence over that of the strain rate.
    pub divergence: f64,
    /// Power of loads and of moving boundaries.
    pub power_in: f64,
    /// Viscous dissipation.
    pub dissipation: f64,
    /// Power that the restoring terms of [`super::buoyancy`] take from the flow; numerical.
    pub restoring: f64,
    /// A scale for powers that rounding alone makes: `||f||^2_{1/D}`, the power the loads would
    /// have on a mesh of one element, `integral p^2/eta`, what the pressure would have if it strained
    /// the stiffest fluid, and a little of `||sqrt(D) u||^2`.
    pub power_scale: f64,
    /// Rotation unknowns that some Cosserat material acts on.
    pub active_rotation: usize,
    pub seconds: Seconds,
}

impl Report {
    /// What is left of the powers, over the largest of them.
    pub fn power_error(&self) -> f64 {
        let larger = [self.power_in, self.dissipation, self.restoring, REST * self.power_scale];
        let larger = larger.iter().fold(0.0, |a: f64, p| a.max(p.abs()));
        let difference = (self.power_in - self.dissipation - self.restoring).abs();
        if larger > 0.0 { difference / larger } else { 0.0 }
    }
}

/// Wall seconds of the parts of a solution.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seconds {
    pub assemble: f64,
    pub factor: f64,
    pub solve: f64,
}

/// Why there is no solution.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    #[error("{source}, at ({x:.4e}, {y:.4e}), unknown {component}")]
    Factor { source: NotPositiveDefinite, x: f64, y: f64, component: &'static str },
    #[error(
        "no convergence in {corrections} corrections: residual {residual:.1e}, \
         divergence {divergence:.1e}; the worst is at ({x:.4e}, {y:.4e})"
    )]
    Stalled { corrections: u32, residual: f64, divergence: f64, x: f64, y: f64 },
    #[error("the solution is not finite after {corrections} corrections")]
    NonFinite { corrections: u32 },
}

impl SolveError {
    /// The same with coordinates in units of `length`.
    pub fn scaled(mut self, length: f64) -> Self {
        match &mut self {
            SolveError::Factor { x, y, .. } | SolveError::Stalled { x, y, .. } => {
                *x *= length;
                *y *= length;
            }
            SolveError::NonFinite { .. } => {}
        }
        self
    }
}

/// The discrete problem on one mesh: boundary conditions, element matrices, factor.
pub struct Stokes<const D: usize> {
    mesh: Arc<Mesh>,
    incidence: Arc<Incidence>,
    constraints: Constraints<D>,
    matrices: Matrices<D>,
    factor: Multifrontal<D>,
    /// Unaugmented diagonal, per node, and one over it.
    diagonal: Vec<[f64; D]>,
    inverse_diagonal: Vec<[f64; D]>,
    simd: Simd,
    work: Work<D>,
}

/// What drives a solution.
#[derive(Clone, Copy)]
pub struct Loads<'a, const D: usize> {
    /// Force (and couple) at each node.
    pub nodal: &'a [[f64; D]],
    pub restoring: &'a Restoring,
}

/// What a solution is asked for.
struct Given<'a, const D: usize> {
    quadrature: &'a Quadrature,
    loads: Loads<'a, D>,
    stopping: Stopping,
}

/// Vectors of the corrections, kept from one solution to the next.
#[derive(Default)]
struct Work<const D: usize> {
    residual: Residual<D>,
    /// What each cell has for its nodes.
    shares: Vec<Share<D>>,
    /// Right-hand side and solution on the skeleton.
    skeleton: Vec<f64>,
    correction: Correction<D>,
    /// Corrections of this solution, of orthonormal divergence; the first `kept` are valid.
    directions: Vec<Correction<D>>,
    kept: usize,
}

/// What a cell adds to the forces on its nodes, and to sums over all cells.
#[derive(Clone, Copy)]
struct Share<const D: usize> {
    force: Nodal<D>,
    divergence: [f64; 3],
    sums: [f64; SUMS],
}

/// Sums over cells in a [`Residual`].
const SUMS: usize = 7;

impl<const D: usize> Default for Share<D> {
    fn default() -> Self {
        Share { force: [[0.0; D]; NODES], divergence: [0.0; 3], sums: [0.0; SUMS] }
    }
}

/// A change of velocity (and rotation) and pressure.
#[derive(Clone, Default)]
struct Correction<const D: usize> {
    velocity: Vec<[f64; D]>,
    pressure: Vec<[f64; 3]>,
    /// `B du + C dp`
    divergence: Vec<[f64; 3]>,
}

impl<const D: usize> Correction<D> {
    fn add_scaled(&mut self, factor: f64, o: &Correction<D>) {
        add_scaled(&mut self.velocity, factor, &o.velocity);
        add_scaled(&mut self.pressure, factor, &o.pressure);
        add_scaled(&mut self.divergence, factor, &o.divergence);
    }

    fn scale(&mut self, factor: f64) {
        fn scale<const N: usize>(a: &mut [[f64; N]], factor: f64) {
            threads::for_each(a, NODE_GRAIN, |_, a| a.iter_mut().for_each(|v| *v *= factor));
        }
        scale(&mut self.velocity, factor);
        scale(&mut self.pressure, factor);
        scale(&mut self.divergence, factor);
    }
}

/// `a += factor b`
fn add_scaled<const N: usize>(a: &mut [[f64; N]], factor: f64, b: &[[f64; N]]) {
    threads::for_each(a, NODE_GRAIN, |k, a| {
        for c in 0..N {
            a[c] += factor * b[k][c];
        }
    });
}

/// Residuals of a state, and powers that come with them.
#[derive(Default)]
struct Residual<const D: usize> {
    /// `f - K u + B' p`, constrained rows included.
    force: Vec<[f64; D]>,
    /// `B u + C p`
    divergence: Vec<[f64; 3]>,
    dissipation: f64,
    restoring: f64,
    strain: f64,
    divergence_norm: f64,
    /// `||B' p||^2_{1/D}`, cell by cell.
    pressure_norm: f64,
    /// `||W^-1 p||^2`, the divergence that would make such a pressure.
    yielding: f64,
    /// `integral p^2`
    pressure_square: f64,
    /// Largest mean viscosity of a cell.
    stiffest: f64,
}

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
        report.active_rotation = self.assemble(quadrature, loads.restoring);
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
    fn assemble(&mut self, quadrature: &Quadrature, restoring: &Restoring) -> usize {
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
        let from = Ingredients { mesh, incidence, constraints, quadrature, restoring };
        matrices.update(from, |cell| factor.touch(cell));
        diagonal.fill([0.0; D]);
        incidence.add_up(diagonal, |cell, a| matrices.cells[cell].diagonal[a]);
        threads::for_each(inverse_diagonal, NODE_GRAIN, |node, inverse| {
            *inverse = diagonal[node].map(|d| 1.0 / d);
        });
        if D == 3 { diagonal.iter().filter(|d| d[D - 1] > 0.0).count() } else { 0 }
    }

    fn residual(
        &self,
        quadrature: &Quadrature,
        Loads { nodal, restoring }: Loads<D>,
        flow: &Flow<D>,
        work: &mut Work<D>,
    ) {
        let Work { residual: out, shares, .. } = work;
        let cells = self.mesh.cells();
        // Whole blocks; what is beyond the last cell stays zero.
        shares.resize(cells.next_multiple_of(TOGETHER), Share::default());
        let (blocks, _) = shares.as_chunks_mut::<TOGETHER>();
        threads::for_each(blocks, CELL_GRAIN / TOGETHER, |block, shares| {
            let first = block * TOGETHER;
            self.residuals(first..cells.min(first + TOGETHER), quadrature, restoring, flow, shares);
        });
        let shares = &shares[..cells];
        let sums = threads::sum(0..shares.len(), |cell| shares[cell].sums);
        [out.dissipation, out.strain, out.divergence_norm, out.restoring, ..] = sums;
        [.., out.pressure_norm, out.yielding, out.pressure_square] = sums;
        let cells = (0..self.mesh.cells()).filter(|&c| !self.mesh.solid[c]);
        out.stiffest = cells.map(|c| quadrature.mean_viscosity[c]).fold(0.0, f64::max);
        out.divergence.clear();
        out.divergence.extend(shares.iter().map(|s| s.divergence));
        out.force.clear();
        out.force.extend_from_slice(nodal);
        self.incidence.add_up(&mut out.force, |cell, a| shares[cell].force[a]);
        for face in &restoring.faces {
            let nodes = SIDE_NODES[face.normal].map(|a| self.incidence.nodes[face.cell][a]);
            let u = nodes.map(|n| [flow.velocity[n][0], flow.velocity[n][1]]);
            let (force, power) = restoring.force(face, nodes, u);
            out.restoring += power;
            for (node, f) in nodes.into_iter().zip(force) {
                out.force[node][0] += f[0];
                out.force[node][1] += f[1];
            }
        }
    }

    /// Of some cells that are computed together.
    fn residuals(
        &self,
        cells: Range<usize>,
        quadrature: &Quadrature,
        restoring: &Restoring,
        flow: &Flow<D>,
        shares: &mut [Share<D>; TOGETHER],
    ) {
        let spin = &self.matrices.spin;
        let internal = Internal::of_cells(self.simd, quadrature, spin, cells.clone(), |cell| {
            let u = self.incidence.nodes[cell].map(|n| flow.velocity[n]);
            (!self.mesh.solid[cell]).then(|| (self.mesh.cell_size(cell), u))
        });
        for (cell, (share, internal)) in cells.zip(shares.iter_mut().zip(&internal)) {
            if !self.mesh.solid[cell] {
                self.cell_residual(cell, internal, quadrature, restoring, flow, share);
            }
        }
    }

    fn cell_residual(
        &self,
        cell: usize,
        internal: &Internal<D>,
        quadrature: &Quadrature,
        restoring: &Restoring,
        flow: &Flow<D>,
        share: &mut Share<D>,
    ) {
        let nodes = &self.incidence.nodes[cell];
        let size = self.mesh.cell_size(cell);
        let u = nodes.map(|n| flow.velocity[n]);
        let divergence = Divergence::new(size);
        let mass = pressure_mass(size[0] * size[1]);
        let pressure = flow.pressure[cell];
        let compliance = quadrature.compliance[cell];
        let mut force = [[0.0; D]; NODES];
        divergence.add_transposed(&pressure, &mut force);
        let mut pressure_norm = 0.0;
        for (a, &node) in nodes.iter().enumerate() {
            for c in 0..2 {
                pressure_norm += force[a][c] * force[a][c] * self.inverse_diagonal[node][c];
            }
        }
        let bu = divergence.apply(&u);
        let [mut yielding, mut pressure_square, mut divergence_norm] = [0.0; 3];
        for q in 0..3 {
            let rp = bu[q] + compliance * mass[q] * pressure[q];
            let needed = pressure[q] / self.matrices.cells[cell].penalty[q];
            yielding += needed * needed / mass[q];
            pressure_square += mass[q] * pressure[q] * pressure[q];
            divergence_norm += rp * rp / mass[q];
            share.divergence[q] = rp;
        }
        let dissipation = internal.dissipation + compliance * pressure_square;
        for a in 0..NODES {
            for c in 0..D {
                force[a][c] -= internal.force[a][c];
            }
        }
        let mut taken = 0.0;
        if restoring.cell_strength(cell) > 0.0 {
            let along = u.map(|u| [u[0], u[1]]);
            let (f, power) = restoring.cell_force(cell, nodes, along);
            taken = power;
            for (force, f) in force.iter_mut().zip(f) {
                force[0] += f[0];
                force[1] += f[1];
            }
        }
        share.force = force;
        let [strain, norms] = [internal.strain, divergence_norm];
        share.sums = [dissipation, strain, norms, taken, pressure_norm, yielding, pressure_square];
    }

    /// Scaled residual, relative divergence, what the penalty makes of the pressure relative to the
    /// same scale, and a scale of power.
    fn norms(&self, r: &Residual<D>, load: &[[f64; D]], flow: &Flow<D>) -> (f64, f64, f64, f64) {
        let [rr, ff, uu] = threads::sum(0..self.mesh.nodes(), |node| {
            let mut sums = [0.0; 3];
            for c in 0..D {
                let d = self.diagonal[node][c];
                if d == 0.0 {
                    continue;
                }
                sums[2] += d * flow.velocity[node][c].powi(2);
                if !self.constraints.is_fixed(node, c) {
                    let inverse = self.inverse_diagonal[node][c];
                    sums[0] += r.force[node][c].powi(2) * inverse;
                    sums[1] += load[node][c].powi(2) * inverse;
                }
            }
            sums
        });
        // The last two terms keep the ratio sensible when nothing moves, and in a rigid rotation,
        // where divergence and strain are both rounding.
        let scale = ff.sqrt() + uu.sqrt() + PRESSURE_SHARE * r.pressure_norm.sqrt();
        let strain = r.strain.sqrt() + ff.sqrt() + RIGID_SHARE * uu.sqrt();
        let ratio = |a: f64, b: f64| if a == 0.0 { 0.0 } else { a / b };
        let stiffest = r.stiffest.max(f64::MIN_POSITIVE);
        (
            ratio(rr.sqrt(), scale),
            ratio(r.divergence_norm.sqrt(), strain),
            ratio(r.yielding.sqrt(), strain),
            ff + RIGID_POWER * uu + r.pressure_square / stiffest,
        )
    }

    /// Power of the loads and of the reactions on moving boundaries.
    fn power_in(&self, r: &Residual<D>, load: &[[f64; D]], flow: &Flow<D>) -> f64 {
        let [power] = threads::sum(0..self.mesh.nodes(), |node| {
            let (u, mut power) = (flow.velocity[node], 0.0);
            for c in 0..D {
                power += load[node][c] * u[c];
                if self.constraints.is_fixed(node, c) {
                    power -= r.force[node][c] * u[c];
                }
            }
            [power]
        });
        power
    }

    /// One correction.
    fn correct(&mut self, quadrature: &Quadrature, work: &mut Work<D>) {
        let Work { residual, shares, skeleton, correction, .. } = work;
        let Stokes { mesh, incidence, constraints, matrices, factor, .. } = self;
        let free = |node: usize, mut force: [f64; D]| -> [f64; D] {
            (0..D).filter(|&c| constraints.is_fixed(node, c)).for_each(|c| force[c] = 0.0);
            force
        };
        let shares = &mut shares[..mesh.cells()];
        // Right-hand side of each cell, its centre condensed; there the whole force.
        threads::for_each(shares, CELL_GRAIN, |cell, share| {
            if mesh.solid[cell] {
                return;
            }
            let matrix = &matrices.cells[cell];
            let p: [f64; 3] =
                std::array::from_fn(|q| -matrix.penalty[q] * residual.divergence[cell][q]);
            let mut force = [[0.0; D]; NODES];
            Divergence::new(mesh.cell_size(cell)).add_transposed(&p, &mut force);
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
        // The centre comes back, and the pressure.
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
            let size = mesh.cell_size(cell);
            let (bdu, mass) = (Divergence::new(size).apply(&du), pressure_mass(size[0] * size[1]));
            for q in 0..3 {
                let dp = -matrix.penalty[q] * (residual.divergence[cell][q] + bdu[q]);
                share.sums[q] = dp;
                share.divergence[q] = bdu[q] + quadrature.compliance[cell] * mass[q] * dp;
            }
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
    }

    /// Combines a correction with those before it: of all sums of them the one that leaves the
    /// least divergence.
    fn combine(&self, work: &mut Work<D>, balanced: bool) {
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
            let mass = pressure_mass(self.mesh.cell_area(c));
            [(0..3).map(|q| a[c][q] * b[c][q] / mass[q]).sum()]
        });
        sum
    }

    fn apply(&self, work: &Work<D>, flow: &mut Flow<D>) {
        add_scaled(&mut flow.velocity, 1.0, &work.correction.velocity);
        add_scaled(&mut flow.pressure, 1.0, &work.correction.pressure);
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
                (cell, sum / self.mesh.cell_area(cell))
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
