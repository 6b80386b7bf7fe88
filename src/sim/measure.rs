//! This module computes the diagnostics of a state.

use super::clock::{Limiter, Speeds};
use super::criteria::ACCURATE_ENERGY;
use super::inertia::twice_kinetic;
use super::phases::Phases;
use super::row::{ForceRow, GaugeRow, Measured, Row};
use super::simulation::Simulation;
use crate::plan::ForceGauge;
use crate::solve::element::{PointShape, rates};
use crate::space::particles::Particles;
use crate::space::shape::Shape;
use crate::threads;
use sha2::{Digest, Sha256};
use std::time::Instant;

/// Smallest dissipated energy, relative to the initial potential energy, that tells an error of the
/// energy from rounding.
const REST: f64 = 1e-6;

/// Weight of all earlier steps in the energies of the last steps, relative to the next step.
const MEMORY: f64 = 0.8;
/// Smallest factor on the step because of the energy: the displacement error of the step is then a
/// tenth of its tolerance.
const SHORTEST: f64 = 0.46;

/// SHA-256 hash, in hexadecimal, of the bits of all particle data except the marks for drawing.
pub fn hash(p: &Particles) -> String {
    let mut h = Sha256::new();
    let mut floats = |values: &mut dyn Iterator<Item = f64>| {
        for v in values {
            h.update(v.to_bits().to_le_bytes());
        }
    };
    floats(&mut p.position.iter().flatten().copied());
    floats(&mut p.volume.iter().copied());
    floats(&mut p.director.iter().flatten().flatten().copied());
    floats(&mut p.viscosity.iter().flatten().copied());
    floats(&mut p.density.iter().flatten().copied());
    h.update(&p.material);
    h.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

impl<const D: usize> Simulation<D> {
    /// Quantities that limit the next step.
    pub(super) fn speeds(&self) -> Speeds {
        let mesh = &self.plan.mesh;
        let centre = Shape::at([0.0; 2]);
        let materials = &self.matter.materials;
        let layered = |m: usize| materials[m].law.is_layered();
        let velocity = &self.flow.velocity;
        let moving = |node: usize| [velocity[node][0], velocity[node][1]];
        let mut speeds = Speeds {
            crossings: self.crossings_of_interest(moving),
            tolerated: self.tolerated.map(|dt| dt * self.energy_factor()),
            strain_rate: 0.0,
            relaxation: self.matter.relaxation,
        };
        if !self.plan.effects.directors {
            return speeds;
        }
        for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
            if (0..materials.len())
                .any(|m| layered(m) && self.quadrature.composition().fraction(cell, m) > 0.0)
            {
                let nodal = self.flow.of_cell(mesh, cell);
                let shape = PointShape::new(&centre, mesh.whole_measure(cell), 0.0);
                let rates = rates(&shape, &nodal);
                let spin = rates.relative_spin.abs();
                let rate = (2.0 * rates.strain_squared()).sqrt() + spin;
                speeds.strain_rate = speeds.strain_rate.max(rate);
            }
        }
        speeds
    }

    /// Factor on the step that the displacement error allows: below one if the energy lost in the
    /// last steps is not the energy dissipated. An error that does not fall with the step (that of a
    /// coarse mesh) shortens steps by no more than [`SHORTEST`].
    fn energy_factor(&self) -> f64 {
        let [lost, dissipated] = self.recent_energy;
        let error = (lost - dissipated).abs() / dissipated;
        // Without dissipation there is no error.
        if error > ACCURATE_ENERGY { (ACCURATE_ENERGY / error).sqrt().max(SHORTEST) } else { 1.0 }
    }

    /// [`Simulation::crossings`] of the materials of interest.
    pub(super) fn crossings_of_interest(&self, velocity: impl Fn(usize) -> [f64; 2]) -> f64 {
        self.crossings(velocity, |node| self.interest.contains(node))
    }

    /// Largest number of cells crossed per unit time with given nodal velocities, of the nodes that
    /// `counts` selects.
    pub(super) fn crossings(
        &self,
        velocity: impl Fn(usize) -> [f64; 2],
        counts: impl Fn(usize) -> bool,
    ) -> f64 {
        let crossed = |(node, rate): (usize, &[f64; 2])| {
            let u = velocity(node);
            (u[0].abs() * rate[0]).max(u[1].abs() * rate[1])
        };
        let all = self.crossing_rates.iter().enumerate();
        let all = all.filter(|(node, _)| counts(*node) && !self.reach.inside(*node));
        all.map(crossed).fold(0.0, f64::max)
    }

    /// Whether a node has a velocity of a material: it is not inside of a solid, and no cell around it is
    /// left out.
    fn moves(&self, node: usize) -> bool {
        let left_out = self.plan.effects.void && self.stokes.is_left_out(node);
        !left_out && !self.reach.inside(node)
    }

    /// Projected area of a material over the volume of its particles.
    pub(super) fn projected_share(&self, material: usize) -> f64 {
        let volume = self.particles.volume_of(material);
        let area = self.quadrature.composition().projected_area(&self.plan.mesh, material);
        if volume > 0.0 { area / volume } else { 0.0 }
    }

    /// Potential energy of the particles relative to the background material, in the plan's units.
    pub(super) fn potential_energy(&self) -> f64 {
        let p = &self.particles;
        let ground = self.background_density();
        let g = self.matter.gravity;
        let [energy] = threads::sum(0..p.len(), |k| {
            let m = &self.matter.materials[p.material[k] as usize];
            let density = m.density_of(p, k);
            let x = p.position[k];
            [-p.volume[k] * (density - ground) * (g[0] * x[0] + g[1] * x[1])]
        });
        energy
    }

    /// Power of all loads except gravity, and of the pressure of the background where it crosses the
    /// sides, in the plan's units.
    fn other_power(&self) -> f64 {
        let weight: f64 = if self.plan.effects.gravity {
            self.load
                .iter()
                .zip(&self.other_load)
                .zip(&self.flow.velocity)
                .map(|((l, f), u)| (l[0] - f[0]) * u[0] + (l[1] - f[1]) * u[1])
                .sum()
        } else {
            0.0
        };
        self.report.power_in - weight + self.power_of_background()
    }

    /// Forces of the materials on what the gauges of forces name, from the residual of the flow.
    fn forces(&self) -> Vec<ForceRow> {
        let (plan, mesh) = (&self.plan, &self.plan.mesh);
        let force = plan.units.force();
        let of = |gauge: &ForceGauge| {
            let mut sum = ForceRow::default();
            for &(node, carries) in &gauge.nodes {
                let r = self.reactions[node];
                let f = [0, 1].map(|c| if carries[c] { r[c] } else { 0.0 });
                let at = mesh.node_position(node);
                let arm = [0, 1].map(|c| at[c] - gauge.about[c]);
                sum.x += force * f[0];
                sum.y += force * f[1];
                sum.torque += force * plan.units.length * (arm[0] * f[1] - arm[1] * f[0]);
                if D == 3 && carries[0] {
                    sum.torque += force * plan.units.length * r[D - 1];
                }
            }
            if mesh.measure().is_ring() {
                // Around the axis all other forces and torques cancel.
                sum = ForceRow { y: sum.y, ..ForceRow::default() };
            }
            sum
        };
        plan.forces.iter().map(of).collect()
    }

    /// See [`Row::volume_error`].
    fn volume_error(&self) -> f64 {
        let mesh = &self.plan.mesh;
        let [sum, cells] = threads::sum(0..mesh.cells(), |cell| {
            let range = self.particles.of_cell(cell);
            let fill = self.quadrature.composition().fill();
            if range.is_empty() || fill.is_some_and(|fill| fill.is_partial(cell)) {
                return [0.0; 2];
            }
            let volume: f64 = self.particles.volume[range].iter().sum();
            // In a sliver beside a solid, one particle more or less is much of it, but not of a cell.
            let part = mesh.part(cell).map_or(1.0, |part| part.fraction);
            [(part * (volume / mesh.cell_volume(cell) - 1.0)).powi(2), 1.0]
        });
        (sum / cells.max(1.0)).sqrt()
    }

    /// Computes the row of the current state, after a step of length `dt` whose computation began
    /// at `clock`.
    pub(super) fn measure(
        &mut self,
        dt: f64,
        limiter: Limiter,
        mut seconds: Phases,
        iterations: u32,
        clock: Instant,
    ) {
        let phase = Instant::now();
        let plan = self.plan.clone();
        let u = &plan.units;
        let r = self.report;
        let dissipation = r.dissipation * u.power();
        let other = self.other_power() * u.power();
        let dt_si = dt * u.time;
        let before = &self.row;
        let first = limiter == Limiter::Start;
        let trapezoid = |total: f64, last: f64, now: f64| {
            if first { 0.0 } else { total + 0.5 * dt_si * (last + now) }
        };
        let dissipated = trapezoid(before.dissipated, before.dissipation, dissipation);
        let work = trapezoid(before.work, self.last_other_power, other);
        let potential_energy = self.potential_energy() * u.energy();
        let kinetic_energy =
            0.5 * twice_kinetic(&plan.mesh, &self.terms.inertia, &self.flow) * u.energy();
        let energy = potential_energy + kinetic_energy;
        if first {
            self.first_energy = energy;
        }
        let energy_out = self.count.energy_out * u.energy();
        let spent = self.first_energy - energy + work;
        let lost = spent - energy_out;
        // A smaller difference is rounding: the scene is at rest.
        let mut scale = dissipated.max(REST * self.first_energy.abs());
        if plan.effects.inertia {
            scale = scale.max(spent.abs()).max(energy_out.abs()).max(kinetic_energy);
        }
        let tells = plan.energy_tells() && scale > 0.0;
        let energy_error = if tells { (lost - dissipated) / scale } else { 0.0 };
        // What crosses the sides does so particle by particle, which does not tell the error of a step.
        if tells && !first && !plan.exchanges_volume() {
            let of_step = [
                before.potential_energy + before.kinetic_energy - energy + work - before.work,
                dissipated - before.dissipated,
            ];
            for (recent, now) in self.recent_energy.iter_mut().zip(of_step) {
                *recent = MEMORY * *recent + now;
            }
        }
        // The lists of the previous row are reused.
        let mut drift = std::mem::take(&mut self.row.drift);
        drift.clear();
        drift.extend(self.baseline.iter().enumerate().map(|(m, &start)| {
            if start > 0.0 { self.projected_share(m) / start - 1.0 } else { 0.0 }
        }));
        let mut gauges = std::mem::take(&mut self.row.gauges);
        gauges.clear();
        let filling = (&self.particles, plan.background());
        let fill = self.quadrature.composition().fill();
        let filled = |cell: usize| fill.map_or(1.0, |fill| fill.of(cell));
        gauges.extend(self.gauges.iter_mut().map(|g| GaugeRow {
            volume: g.volume * u.volume(),
            refilled: g.refilled * u.volume(),
            rate: g.rate(&plan.mesh, &self.flow, filling, &filled, dt) * u.volume_rate(),
        }));
        let mut ill_posed_share = 0.0;
        if plan.has_friction() {
            let [flowing, all, classical] = self.ill_posed_volumes();
            ill_posed_share = if flowing > 0.0 { all / flowing } else { 0.0 };
            self.flowed[0] += dt * classical;
            self.flowed[1] += dt * flowing;
        }
        let measured = Measured {
            plan: &plan,
            units: u,
            materials: &self.matter.materials,
            particles: &self.particles,
            report: &self.report,
            count: self.count,
            step: self.step,
            time: self.si_time(),
            dt: dt_si,
            limiter,
            iterations,
            nonlinear: r.iterations,
            ill_posed_share,
            kinetic_energy,
            max_speed: self.flow.max_speed_of(|node| self.moves(node)) * u.velocity(),
            rms_speed: self.flow.rms_speed(self.stokes.mesh()) * u.velocity(),
            volume_error: self.volume_error(),
            potential_energy,
            work,
            dissipated,
            energy_error,
        };
        let forces = self.forces();
        let row = Row::measured(&measured, gauges, forces, drift, seconds);
        self.last_other_power = other;
        self.row = row;
        seconds.diagnostics += phase.elapsed().as_secs_f64();
        self.row.seconds = seconds;
        self.row.wall = clock.elapsed().as_secs_f64();
    }
}
