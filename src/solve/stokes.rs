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
use super::cholesky::{FactorError, SparseCholesky};
use super::element::{
    Condensed, Divergence, Internal, LOCAL, Matrix, Nodal, PointShape, SKELETON_NODES,
    add_cut_stiffness, add_stiffness, mirror, pair, pressure_mass,
};
use super::quadrature::{Content, Quadrature};
use super::spin::SpinModes;
use crate::space::constraints::Constraints;
use crate::space::flow::Flow;
use crate::space::mesh::Mesh;
use crate::space::numbering::Skeleton;
use crate::space::shape::{CENTRE, NODES};
use std::sync::Arc;
use std::time::Instant;

/// Penalty `r` in units of the cell's viscosity.
const PENALTY: f64 = 1e4;

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
    Factor { source: FactorError, x: f64, y: f64, component: &'static str },
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

/// The discrete problem on one mesh: pattern, boundary conditions, element matrices.
pub struct Stokes<const D: usize> {
    mesh: Arc<Mesh>,
    /// Of every cell: each correction asks five times, and finding them takes divisions.
    nodes: Vec<[usize; NODES]>,
    skeleton: Skeleton,
    constraints: Constraints<D>,
    matrix: SparseCholesky,
    /// Position below the diagonal of every node pair of a cell.
    scatter: Vec<[u32; 36]>,
    cells: Vec<CellMatrix<D>>,
    /// Unaugmented diagonal, per node.
    diagonal: Vec<[f64; D]>,
    work: Work<D>,
}

#[derive(Clone)]
struct CellMatrix<const D: usize> {
    built_from: Content,
    condensed: Condensed<D>,
    diagonal: Nodal<D>,
    /// W
    penalty: [f64; 3],
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
    /// Right-hand side and solution on the skeleton.
    skeleton: Vec<f64>,
    correction: Correction<D>,
    /// Corrections of this solution, of orthonormal divergence; the first `kept` are valid.
    directions: Vec<Correction<D>>,
    kept: usize,
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
        fn add<const N: usize>(a: &mut [[f64; N]], factor: f64, b: &[[f64; N]]) {
            for (a, b) in a.iter_mut().zip(b) {
                for c in 0..N {
                    a[c] += factor * b[c];
                }
            }
        }
        add(&mut self.velocity, factor, &o.velocity);
        add(&mut self.pressure, factor, &o.pressure);
        add(&mut self.divergence, factor, &o.divergence);
    }

    fn scale(&mut self, factor: f64) {
        let all = self.velocity.iter_mut().flatten();
        let all = all.chain(self.pressure.iter_mut().flatten());
        all.chain(self.divergence.iter_mut().flatten()).for_each(|v| *v *= factor);
    }
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
    pub fn new(mesh: Arc<Mesh>, constraints: Constraints<D>) -> Result<Self, FactorError> {
        let skeleton = Skeleton::new(&mesh);
        let matrix = SparseCholesky::new(&skeleton, D)?;
        let scatter = (0..mesh.cells())
            .map(|cell| {
                let nodes = mesh.cell_nodes(cell);
                let position = SKELETON_NODES.map(|a| skeleton.position[nodes[a]]);
                let mut ranks = [0; 36];
                for k in 0..8 {
                    for l in 0..k {
                        let (col, row) =
                            (position[k].min(position[l]), position[k].max(position[l]));
                        let range = skeleton.col_ptr[col as usize] as usize
                            ..skeleton.col_ptr[col as usize + 1] as usize;
                        // Solid cells are not in the pattern; they are never scattered.
                        ranks[pair(k, l)] =
                            skeleton.rows[range].binary_search(&row).unwrap_or(0) as u32;
                    }
                }
                ranks
            })
            .collect();
        let empty = CellMatrix {
            built_from: Content::Unknown,
            condensed: Condensed {
                blocks: [[[0.0; D]; D]; 36],
                centre_inverse: [[0.0; D]; D],
                coupling: [[[0.0; D]; D]; 8],
            },
            diagonal: [[0.0; D]; NODES],
            penalty: [0.0; 3],
        };
        Ok(Stokes {
            cells: vec![empty; mesh.cells()],
            diagonal: vec![[0.0; D]; mesh.nodes()],
            nodes: (0..mesh.cells()).map(|cell| mesh.cell_nodes(cell)).collect(),
            work: Work::default(),
            mesh,
            skeleton,
            constraints,
            matrix,
            scatter,
        })
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
        self.matrix.factorize().map_err(|e| self.explain(e))?;
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
            self.residual(quadrature, loads, flow, &mut work.residual);
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
            self.correct(work).map_err(|e| self.explain(e))?;
            // Sums of corrections mind the divergence only; here the forces are to be corrected.
            self.combine(quadrature, work, balanced && !converged);
            self.apply(work, flow);
            report.corrections += 1;
        }
    }

    /// Element matrices of the cells that changed, and the skeleton matrix; number of active
    /// rotation unknowns.
    fn assemble(&mut self, quadrature: &Quadrature, restoring: &Restoring) -> usize {
        self.matrix.values_mut().fill(0.0);
        self.diagonal.iter_mut().for_each(|d| *d = [0.0; D]);
        for cell in 0..self.mesh.cells() {
            let content = quadrature.content(cell);
            if content == Content::Solid {
                continue;
            }
            if content == Content::Mixed || content != self.cells[cell].built_from {
                self.build(cell, quadrature, restoring);
                self.cells[cell].built_from = content;
            }
            self.scatter(cell);
        }
        self.add_restoring(restoring);
        self.matrix.fill_empty_diagonal();
        if D == 3 { self.diagonal.iter().filter(|d| d[D - 1] > 0.0).count() } else { 0 }
    }

    fn build(&mut self, cell: usize, quadrature: &Quadrature, restoring: &Restoring) {
        let size = self.mesh.cell_size(cell);
        let area = size[0] * size[1];
        let mut k: Matrix = [[0.0; LOCAL]; LOCAL];
        let cut = quadrature.cut(cell);
        // What a stiff rotation adds to the viscosity of a flow on the scale of the cell.
        let (mut turning, thickness) = (0.0, size[0].min(size[1]));
        quadrature.for_points(cell, |p, shape| {
            let law = p.law.without_excess();
            let law = cut.map_or(law, |cut| law.with_viscosity_scaled(cut.rest));
            add_stiffness::<D>(&mut k, &PointShape::new(shape, size), &law, p.weight * area);
            turning += p.weight * p.law.turning_viscosity(thickness);
        });
        if let Some(cut) = cut {
            add_cut_stiffness(&mut k, cut);
        }
        if D == 3
            && let Some(modes) = SpinModes::new(quadrature, cell, size)
        {
            modes.add_stiffness(&mut k);
        }
        if restoring.cell_strength(cell) > 0.0 {
            for i in 0..2 * NODES {
                for j in 0..NODES * (i / NODES + 1) {
                    let (nodes, components) = ([i % NODES, j % NODES], [i / NODES, j / NODES]);
                    k[i][j] += restoring.cell_entry(cell, nodes, components);
                }
            }
        }
        let mass = pressure_mass(area);
        let viscosity = quadrature.mean_viscosity[cell] + if D == 3 { turning } else { 0.0 };
        let give = 1.0 / (PENALTY * viscosity) + quadrature.compliance[cell];
        let out = &mut self.cells[cell];
        out.penalty = mass.map(|m| 1.0 / (m * give));
        for a in 0..NODES {
            for c in 0..D {
                out.diagonal[a][c] = k[NODES * c + a][NODES * c + a];
            }
        }
        Divergence::new(size).add_penalty(&out.penalty, &mut k);
        mirror::<D>(&mut k);
        for (a, node) in self.nodes[cell].into_iter().enumerate() {
            for c in 0..D {
                if self.constraints.is_fixed(node, c) {
                    let i = NODES * c + a;
                    k[i].fill(0.0);
                    k.iter_mut().for_each(|row| row[i] = 0.0);
                }
            }
        }
        out.condensed = Condensed::new(&k);
    }

    fn scatter(&mut self, cell: usize) {
        let nodes = self.nodes[cell];
        let position = SKELETON_NODES.map(|a| self.skeleton.position[nodes[a]] as usize);
        let built = &self.cells[cell];
        for (a, node) in nodes.into_iter().enumerate() {
            for c in 0..D {
                self.diagonal[node][c] += built.diagonal[a][c];
            }
        }
        for k in 0..8 {
            for l in 0..=k {
                let block = &built.condensed.blocks[pair(k, l)];
                if k == l {
                    for c in 0..D {
                        for r in c..D {
                            let at = self.matrix.diagonal_entry(position[k], r, c);
                            self.matrix.values_mut()[at] += block[r][c];
                        }
                    }
                    continue;
                }
                let rank = self.scatter[cell][pair(k, l)] as usize;
                let (column, transposed) = if position[k] > position[l] {
                    (position[l], false)
                } else {
                    (position[k], true)
                };
                for c in 0..D {
                    let start = self.matrix.block_start(column, rank, c);
                    let values = &mut self.matrix.values_mut()[start..start + D];
                    for r in 0..D {
                        values[r] += if transposed { block[c][r] } else { block[r][c] };
                    }
                }
            }
        }
    }

    /// Adds the terms of faces, whose nodes the skeleton has all.
    fn add_restoring(&mut self, restoring: &Restoring) {
        for face in &restoring.faces {
            let nodes = self.nodes[face.cell];
            let side = SIDE_NODES[face.normal];
            for (k, &a) in side.iter().enumerate() {
                for c in 0..2 {
                    self.diagonal[nodes[a]][c] += restoring.entry(face, [k, k], [c, c]);
                }
                for (l, &b) in side.iter().enumerate().take(k + 1) {
                    self.add_block(face.cell, [a, b], |r, c| restoring.entry(face, [k, l], [r, c]));
                }
            }
        }
    }

    /// Adds velocity entries to the matrix for nodes `a >= b` on the rim of a cell.
    fn add_block(&mut self, cell: usize, [a, b]: [usize; 2], entry: impl Fn(usize, usize) -> f64) {
        let nodes = [a, b].map(|n| self.nodes[cell][n]);
        let position = nodes.map(|n| self.skeleton.position[n] as usize);
        // Local nodes without the centre.
        let [k, l] = [a, b].map(|n| n - usize::from(n > CENTRE));
        for r in 0..2 {
            for c in 0..2 {
                if self.constraints.is_fixed(nodes[0], r) || self.constraints.is_fixed(nodes[1], c)
                {
                    continue;
                }
                let at = if k == l {
                    if r < c {
                        continue;
                    }
                    self.matrix.diagonal_entry(position[0], r, c)
                } else {
                    let rank = self.scatter[cell][pair(k, l)] as usize;
                    if position[0] > position[1] {
                        self.matrix.block_start(position[1], rank, c) + r
                    } else {
                        self.matrix.block_start(position[0], rank, r) + c
                    }
                };
                self.matrix.values_mut()[at] += entry(r, c);
            }
        }
    }

    fn residual(
        &self,
        quadrature: &Quadrature,
        Loads { nodal, restoring }: Loads<D>,
        flow: &Flow<D>,
        out: &mut Residual<D>,
    ) {
        out.force.clear();
        out.force.extend_from_slice(nodal);
        out.divergence.resize(self.mesh.cells(), [0.0; 3]);
        (out.dissipation, out.strain, out.divergence_norm) = (0.0, 0.0, 0.0);
        (out.restoring, out.pressure_norm, out.yielding) = (0.0, 0.0, 0.0);
        (out.pressure_square, out.stiffest) = (0.0, 0.0);
        for face in &restoring.faces {
            let nodes = SIDE_NODES[face.normal].map(|a| self.nodes[face.cell][a]);
            let u = nodes.map(|n| [flow.velocity[n][0], flow.velocity[n][1]]);
            let (force, power) = restoring.force(face, nodes, u);
            out.restoring += power;
            for (node, f) in nodes.into_iter().zip(force) {
                out.force[node][0] += f[0];
                out.force[node][1] += f[1];
            }
        }
        for cell in (0..self.mesh.cells()).filter(|&c| !self.mesh.solid[c]) {
            let size = self.mesh.cell_size(cell);
            let area = size[0] * size[1];
            let u = self.nodes[cell].map(|n| flow.velocity[n]);
            let internal = Internal::new(quadrature, cell, size, &u);
            out.dissipation += internal.dissipation;
            out.strain += internal.strain;
            let divergence = Divergence::new(size);
            let mass = pressure_mass(area);
            let pressure = flow.pressure[cell];
            let compliance = quadrature.compliance[cell];
            out.stiffest = out.stiffest.max(quadrature.mean_viscosity[cell]);
            let mut g = [[0.0; D]; NODES];
            divergence.add_transposed(&pressure, &mut g);
            for (a, node) in self.nodes[cell].into_iter().enumerate() {
                for c in 0..2 {
                    out.pressure_norm += g[a][c] * g[a][c] / self.diagonal[node][c];
                }
            }
            let bu = divergence.apply(&u);
            for q in 0..3 {
                let rp = bu[q] + compliance * mass[q] * pressure[q];
                let needed = pressure[q] / self.cells[cell].penalty[q];
                out.yielding += needed * needed / mass[q];
                out.pressure_square += mass[q] * pressure[q] * pressure[q];
                out.divergence[cell][q] = rp;
                out.divergence_norm += rp * rp / mass[q];
                out.dissipation += compliance * mass[q] * pressure[q] * pressure[q];
            }
            for (a, node) in self.nodes[cell].into_iter().enumerate() {
                for c in 0..D {
                    out.force[node][c] += g[a][c] - internal.force[a][c];
                }
            }
            if restoring.cell_strength(cell) > 0.0 {
                let along = u.map(|u| [u[0], u[1]]);
                let (force, power) = restoring.cell_force(cell, &self.nodes[cell], along);
                out.restoring += power;
                for (node, f) in self.nodes[cell].into_iter().zip(force) {
                    out.force[node][0] += f[0];
                    out.force[node][1] += f[1];
                }
            }
        }
    }

    /// Scaled residual, relative divergence, what the penalty makes of the pressure relative to the
    /// same scale, and a scale of power.
    fn norms(&self, r: &Residual<D>, load: &[[f64; D]], flow: &Flow<D>) -> (f64, f64, f64, f64) {
        let (mut rr, mut ff, mut uu) = (0.0, 0.0, 0.0);
        for node in 0..self.mesh.nodes() {
            for c in 0..D {
                let d = self.diagonal[node][c];
                if d == 0.0 {
                    continue;
                }
                uu += d * flow.velocity[node][c].powi(2);
                if !self.constraints.is_fixed(node, c) {
                    rr += r.force[node][c].powi(2) / d;
                    ff += load[node][c].powi(2) / d;
                }
            }
        }
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
        let mut power = 0.0;
        for (node, u) in flow.velocity.iter().enumerate() {
            for c in 0..D {
                power += load[node][c] * u[c];
                if self.constraints.is_fixed(node, c) {
                    power -= r.force[node][c] * u[c];
                }
            }
        }
        power
    }

    /// One correction; uses the residual's forces up.
    fn correct(&mut self, work: &mut Work<D>) -> Result<(), FactorError> {
        let Work { residual: r, skeleton: x, correction, .. } = work;
        let du = &mut correction.velocity;
        correction.pressure.resize(self.mesh.cells(), [0.0; 3]);
        let force = &mut r.force;
        for cell in (0..self.mesh.cells()).filter(|&c| !self.mesh.solid[c]) {
            let divergence = Divergence::new(self.mesh.cell_size(cell));
            let penalty = self.cells[cell].penalty;
            let p: [f64; 3] = std::array::from_fn(|q| -penalty[q] * r.divergence[cell][q]);
            let mut f = [[0.0; D]; NODES];
            divergence.add_transposed(&p, &mut f);
            for (a, node) in self.nodes[cell].into_iter().enumerate() {
                for c in 0..D {
                    force[node][c] += f[a][c];
                }
            }
        }
        self.constraints.clear_fixed(force);
        // Condense the centres.
        for cell in (0..self.mesh.cells()).filter(|&c| !self.mesh.solid[c]) {
            let nodes = self.nodes[cell];
            let centre = force[nodes[CENTRE]];
            for (l, &a) in SKELETON_NODES.iter().enumerate() {
                let coupling = &self.cells[cell].condensed.coupling[l];
                for c in 0..D {
                    force[nodes[a]][c] -= (0..D).map(|m| coupling[m][c] * centre[m]).sum::<f64>();
                }
            }
        }
        x.resize(self.matrix.unknowns(), 0.0);
        for (position, &node) in self.skeleton.node.iter().enumerate() {
            x[D * position..D * position + D].copy_from_slice(&force[node as usize]);
        }
        self.matrix.solve(x)?;
        du.resize(self.mesh.nodes(), [0.0; D]);
        for (position, &node) in self.skeleton.node.iter().enumerate() {
            du[node as usize].copy_from_slice(&x[D * position..D * position + D]);
        }
        self.constraints.clear_fixed(du);
        for cell in (0..self.mesh.cells()).filter(|&c| !self.mesh.solid[c]) {
            let nodes = self.nodes[cell];
            let built = &self.cells[cell];
            let centre = force[nodes[CENTRE]];
            let mut u: [f64; D] = std::array::from_fn(|r| {
                (0..D).map(|m| built.condensed.centre_inverse[r][m] * centre[m]).sum()
            });
            for (l, &a) in SKELETON_NODES.iter().enumerate() {
                let coupling = &built.condensed.coupling[l];
                for (r, u) in u.iter_mut().enumerate() {
                    *u -= (0..D).map(|m| coupling[r][m] * du[nodes[a]][m]).sum::<f64>();
                }
            }
            du[nodes[CENTRE]] = u;
            let bdu = Divergence::new(self.mesh.cell_size(cell)).apply(&nodes.map(|n| du[n]));
            for q in 0..3 {
                correction.pressure[cell][q] = -built.penalty[q] * (r.divergence[cell][q] + bdu[q]);
            }
        }
        Ok(())
    }

    /// Combines a correction with those before it: of all sums of them the one that leaves the
    /// least divergence.
    fn combine(&self, quadrature: &Quadrature, work: &mut Work<D>, balanced: bool) {
        if !balanced {
            return;
        }
        let mesh = &self.mesh;
        let Work { residual, correction, directions, kept, .. } = work;
        correction.divergence.resize(mesh.cells(), [0.0; 3]);
        for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
            let du = self.nodes[cell].map(|n| correction.velocity[n]);
            let bdu = Divergence::new(mesh.cell_size(cell)).apply(&du);
            let mass = pressure_mass(mesh.cell_area(cell));
            for q in 0..3 {
                let give = quadrature.compliance[cell] * mass[q] * correction.pressure[cell][q];
                correction.divergence[cell][q] = bdu[q] + give;
            }
        }
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
        let cell = |c: usize| -> f64 {
            let mass = pressure_mass(self.mesh.cell_area(c));
            (0..3).map(|q| a[c][q] * b[c][q] / mass[q]).sum()
        };
        (0..self.mesh.cells()).filter(|&c| !self.mesh.solid[c]).map(cell).sum()
    }

    fn apply(&self, work: &Work<D>, flow: &mut Flow<D>) {
        let correction = &work.correction;
        for (u, du) in flow.velocity.iter_mut().zip(&correction.velocity) {
            for c in 0..D {
                u[c] += du[c];
            }
        }
        for (p, dp) in flow.pressure.iter_mut().zip(&correction.pressure) {
            for q in 0..3 {
                p[q] += dp[q];
            }
        }
    }

    fn explain(&self, e: FactorError) -> SolveError {
        let (node, component) = match e {
            FactorError::NotPositiveDefinite { unknown } => {
                (self.skeleton.node[unknown / D] as usize, unknown % D)
            }
            FactorError::Symbolic(_) => (0, 0),
        };
        let [x, y] = self.mesh.node_position(node);
        SolveError::Factor { source: e, x, y, component: ["u", "v", "w"][component] }
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
