//! This module saves a simulation in a [`State`] and restores it.

use super::clock::Limiter;
use super::error::SimError;
use super::inertia::{Acceleration, Past};
use super::row::{self, COLUMNS, GaugeRow, Row};
use super::simulation::{Before, Simulation};
use super::state::{State, StateError, flat, load_phases, save_phases, wrong_length};
use crate::motion::gauges::Amount;
use crate::plan::Pose;
use crate::solve::last_flow::Iterate;
use crate::space::count::Count;
use crate::space::flow::Flow;
use crate::space::particles::Particles;

fn save_particles(p: &Particles, s: &mut State) {
    s.put_floats("particles.position", flat(&p.position));
    s.put_floats("particles.volume", p.volume.iter().copied());
    s.put_bytes("particles.material", p.material.iter().copied());
    if let Some(d) = &p.director {
        s.put_floats("particles.director", flat(d));
    }
    if let Some(v) = &p.viscosity {
        s.put_floats("particles.viscosity", v.iter().copied());
    }
    if let Some(d) = &p.density {
        s.put_floats("particles.density", d.iter().copied());
    }
    if let Some(m) = &p.mark {
        s.put_bytes("particles.mark", m.iter().map(|&m| u8::from(m)));
    }
}

/// Loads particles, with the same columns as `like`; they are not sorted.
fn load_particles(s: &State, like: &Particles, materials: usize) -> Result<Particles, StateError> {
    let material = s.bytes("particles.material")?.to_vec();
    let n = material.len();
    if let Some(m) = material.iter().find(|&&m| usize::from(m) >= materials) {
        return Err(StateError::Range { name: "particles.material", value: m.to_string() });
    }
    let position = s.tuples("particles.position", n)?;
    if let Some(p) = position.iter().flatten().find(|v: &&f64| !v.is_finite()) {
        return Err(StateError::Range { name: "particles.position", value: p.to_string() });
    }
    let column = |exists: bool, name: &str| -> Result<Option<Vec<f64>>, StateError> {
        exists.then(|| Ok(s.exactly(name, n)?.to_vec())).transpose()
    };
    let mark = match &like.mark {
        None => None,
        Some(_) => {
            let mark = s.bytes("particles.mark")?;
            if mark.len() != n {
                return Err(wrong_length("particles.mark", mark.len(), n));
            }
            Some(mark.iter().map(|&m| m != 0).collect())
        }
    };
    Ok(Particles {
        position,
        volume: s.exactly("particles.volume", n)?.to_vec(),
        material,
        director: like.director.as_ref().map(|_| s.tuples("particles.director", n)).transpose()?,
        viscosity: column(like.viscosity.is_some(), "particles.viscosity")?,
        density: column(like.density.is_some(), "particles.density")?,
        mark,
        ..Particles::default()
    })
}

/// Columns of a row that the format saves in one list of numbers, in this order. Columns added to
/// [`COLUMNS`] later are saved under their own names.
const ROW_NUMBERS: [&str; 15] = [
    "time",
    "dt",
    "wall",
    "power_in",
    "dissipation",
    "stabilisation",
    "power_error",
    "divergence_error",
    "volume_error",
    "max_speed",
    "rms_speed",
    "potential_energy",
    "work",
    "dissipated",
    "director_error",
];

/// Columns of a row that are saved in one list of counts. The limiter is saved as its index in
/// [`Limiter::ALL`].
const ROW_COUNTS: [&str; 8] = [
    "step",
    "dt_limiter",
    "iterations",
    "particles",
    "active_rotation",
    "splits",
    "merges",
    "held",
];

/// The value of a row in the column with a name.
fn of_row(row: &Row, name: &str) -> f64 {
    COLUMNS.iter().find(|c| c.name == name).map_or(f64::NAN, |c| c.number(row))
}

fn save_row(row: &Row, s: &mut State) {
    let limiter = Limiter::ALL.iter().position(|&l| l == row.dt_limiter).unwrap_or(0);
    let count = |name| if name == "dt_limiter" { limiter as u64 } else { of_row(row, name) as u64 };
    s.put_counts("row.counts", ROW_COUNTS.map(count));
    s.put_floats("row.numbers", ROW_NUMBERS.map(|name| of_row(row, name)));
    s.put_floats("row.alignment", row.mean_alignment);
    for column in later_columns() {
        s.put_floats(column.saved, [column.number(row)]);
    }
    s.put_floats("row.gauges", row.gauges.iter().flat_map(|g| [g.volume, g.rate]));
    s.put_floats("row.refilled", row.gauges.iter().map(|g| g.refilled));
    s.put_floats("row.drift", row.drift.iter().copied());
    save_phases("row.seconds", &row.seconds, s);
}

/// Columns that are not in the first version of the format.
fn later_columns() -> impl Iterator<Item = &'static row::Column> {
    let known = |c: &&row::Column| {
        ROW_NUMBERS.contains(&c.name) || ROW_COUNTS.contains(&c.name) || c.name == "mean_alignment"
    };
    COLUMNS.iter().filter(move |c| !known(c))
}

fn load_row(s: &State, gauges: usize, materials: usize) -> Result<Row, StateError> {
    let counts: [u64; 8] = s.tally("row.counts")?;
    let numbers: [f64; 15] = s.numbers("row.numbers")?;
    let out_of_range =
        |name: &'static str, value: u64| StateError::Range { name, value: value.to_string() };
    let limiter = usize::try_from(counts[1]).ok().and_then(|k| Limiter::ALL.get(k));
    let limiter = limiter.ok_or_else(|| out_of_range("row.counts (limiter)", counts[1]))?;
    let mut row = Row::empty(materials);
    let mut set = |name: &str, text: &str| {
        let column = COLUMNS.iter().find(|c| c.name == name);
        column.is_none_or(|c| c.set(&mut row, text).is_ok())
    };
    for (name, value) in ROW_COUNTS.into_iter().zip(counts) {
        let text = if name == "dt_limiter" { limiter.name().into() } else { value.to_string() };
        if !set(name, &text) {
            return Err(out_of_range("row.counts", value));
        }
    }
    // The text of a number is read back to the last bit.
    let list = ROW_NUMBERS.into_iter().zip(numbers);
    let later = later_columns().map(|c| {
        let value = s.try_floats(c.saved).and_then(|v| v.first().copied());
        (c.name, value.unwrap_or(f64::NAN))
    });
    list.chain(later).for_each(|(name, value)| {
        set(name, &value.to_string());
    });
    row.mean_alignment = s.floats("row.alignment")?.first().copied();
    let tuples = s.tuples("row.gauges", gauges)?;
    let refilled = s.exactly("row.refilled", gauges)?;
    let gauges = tuples.into_iter().zip(refilled);
    row.gauges =
        gauges.map(|([volume, rate], &refilled)| GaugeRow { volume, rate, refilled }).collect();
    row.drift = s.exactly("row.drift", materials)?.to_vec();
    row.seconds = load_phases("row.seconds", s)?;
    Ok(row)
}

impl<const D: usize> Simulation<D> {
    /// Saves all quantities on which the next step depends.
    pub(super) fn save(&self, s: &mut State) {
        save_particles(&self.particles, s);
        s.put_floats("flow.velocity", flat(&self.flow.velocity));
        s.put_floats("flow.pressure", flat(&self.flow.pressure));
        let names = ["previous.velocity", "previous.pressure", "previous.step"];
        if let Some(Before { flow, dt }) = &self.previous {
            s.put_floats(names[0], flat(&flow.velocity));
            s.put_floats(names[1], flat(&flow.pressure));
            s.put_floats(names[2], [*dt]);
        } else {
            names.iter().for_each(|name| s.remove(name));
        }
        let names = ["inertia.velocity", "inertia.half", "inertia.step", "inertia.parts"];
        if let Some(Past { velocity, rotation, half, dt, parts }) =
            self.inertia.as_ref().and_then(|i| i.past[0].as_ref())
        {
            s.put_floats(names[0], flat(velocity));
            s.put_floats(names[1], flat(half));
            s.put_floats(names[2], [*dt]);
            s.put_counts(names[3], [u64::from(*parts)]);
            if !rotation.is_empty() {
                s.put_floats("inertia.rotation", flat(rotation));
            }
        } else {
            names.iter().for_each(|name| s.remove(name));
        }
        match self.inertia.as_ref().and_then(|i| i.acceleration.as_ref()) {
            Some(a) => {
                s.put_floats("inertia.acceleration", flat(&a.velocity));
                if !a.rotation.is_empty() {
                    s.put_floats("inertia.rotation_acceleration", flat(&a.rotation));
                }
            }
            None => {
                s.remove("inertia.acceleration");
                s.remove("inertia.rotation_acceleration");
            }
        }
        // The integration points follow from these factors, and the current factors from the
        // points.
        s.put_floats("quadrature.factors", self.factors_of_points.iter().copied());
        s.put_floats("gauges", self.gauges.iter().map(|g| g.volume));
        s.put_floats("gauges.refilled", self.gauges.iter().map(|g| g.refilled));
        if !self.gauges.is_empty() {
            let recent = self.gauges.iter().flat_map(|g| g.recent).flat_map(|r| [r.all, r.own]);
            s.put_floats("gauges.recent", recent);
        }
        if let Some(dye) = &self.dye {
            s.put_floats("dye.points", dye.lines.iter().flatten().flatten().copied());
            s.put_counts("dye.lines", dye.lines.iter().map(|l| l.len() as u64));
        }
        let c = self.count;
        s.put_counts("count", [c.splits, c.merges, c.held, c.left, c.healed]);
        if self.plan.exchanges_volume() {
            s.put_floats("count.exchanged", [c.volume_in, c.volume_out, c.energy_out]);
        }
        s.put_counts("progress", [self.step, u64::from(self.version), self.next_change as u64]);
        if !self.standing.is_empty() {
            s.put_floats("blocks.displacement", self.standing.iter().flat_map(|p| p.displacement));
        }
        s.put_floats("time", [self.time]);
        s.put_floats("tolerated", self.tolerated);
        s.put_floats("first_energy", [self.first_energy]);
        s.put_floats("recent_energy", self.recent_energy);
        if self.plan.has_friction() {
            s.put_floats("flowed", self.flowed);
        }
        if self.loosened[0] > 0 {
            s.put_counts("loosened", self.loosened);
        }
        if let Some(trapped) = self.trapped_void {
            s.put_floats("trapped_void", trapped);
        }
        s.put_floats("baseline", self.baseline.iter().copied());
        s.put_floats("other_power", [self.last_other_power]);
        save_row(&self.row, s);
    }

    /// Places the blocks that move.
    fn load_blocks(&mut self, s: &State) -> Result<(), StateError> {
        if self.plan.moving.is_empty() {
            return Ok(());
        }
        let ([time], name) = (s.numbers("time")?, "blocks.displacement");
        let places: Vec<[f64; 2]> = s.tuples(name, self.plan.moving.len())?;
        let time = time * self.plan.units.time;
        let moving = self.plan.moving.iter().zip(places);
        let poses =
            moving.map(|(m, displacement)| Pose { displacement, velocity: m.velocity_at(time) });
        let poses: Vec<Pose> = poses.collect();
        let failed =
            |e: SimError| StateError::Range { name: "blocks.displacement", value: e.to_string() };
        self.pose(&poses).map_err(failed)?;
        self.standing = poses;
        Ok(())
    }

    /// Values of the rotation at the nodes, if it has inertia.
    fn rotations(&self, s: &State, name: &'static str) -> Result<Vec<[f64; 1]>, StateError> {
        let turns = self.plan.effects.micro_inertia;
        if turns { s.tuples(name, self.plan.mesh.nodes()) } else { Ok(vec![]) }
    }

    /// Restores a state of a run of the same plan.
    ///
    /// # Errors
    /// The state does not fit the plan.
    pub(super) fn load(&mut self, s: &State) -> Result<(), StateError> {
        self.load_blocks(s)?;
        let plan = self.plan.clone();
        let (mesh, materials) = (&plan.mesh, self.matter.materials.len());
        let mut particles = load_particles(s, &self.particles, materials)?;
        let flow = Flow {
            velocity: s.tuples("flow.velocity", mesh.nodes())?,
            pressure: s.tuples("flow.pressure", mesh.cells())?,
        };
        let previous = match s.try_floats("previous.velocity") {
            None => None,
            Some(_) => {
                let [dt] = s.numbers("previous.step")?;
                let velocity = s.tuples("previous.velocity", mesh.nodes())?;
                let pressure = s.tuples("previous.pressure", mesh.cells())?;
                Some(Before { flow: Flow { velocity, pressure }, dt })
            }
        };
        let past = match s.try_floats("inertia.velocity") {
            None => None,
            Some(_) => {
                let velocity = s.tuples("inertia.velocity", mesh.nodes())?;
                let half = s.tuples("inertia.half", mesh.nodes())?;
                let ([dt], [parts]) = (s.numbers("inertia.step")?, s.tally("inertia.parts")?);
                let parts = u32::try_from(parts).map_err(|_| StateError::Range {
                    name: "inertia.parts",
                    value: parts.to_string(),
                })?;
                let rotation = self.rotations(s, "inertia.rotation")?;
                Some(Past { velocity, rotation, half, dt, parts })
            }
        };
        let acceleration = match s.try_floats("inertia.acceleration") {
            Some(_) => {
                let velocity = s.tuples("inertia.acceleration", mesh.nodes())?;
                let rotation = self.rotations(s, "inertia.rotation_acceleration")?;
                Some(Acceleration { velocity, rotation })
            }
            None => None,
        };
        let factors = s.exactly("quadrature.factors", materials)?;
        let gauges = s.exactly("gauges", self.gauges.len())?;
        let refilled = s.exactly("gauges.refilled", self.gauges.len())?;
        let dye = self.dye.as_ref().map(|_| dye_lines(s)).transpose()?;
        let [splits, merges, held, left, healed] = s.tally("count")?;
        let [volume_in, volume_out, energy_out] =
            s.try_numbers("count.exchanged")?.unwrap_or_default();
        let [step, version, next_change] = s.tally("progress")?;
        let changes = plan.changes.get(..next_change as usize).ok_or(StateError::Range {
            name: "progress (changes)",
            value: next_change.to_string(),
        })?;
        let version = u32::try_from(version).map_err(|_| StateError::Range {
            name: "progress (version)",
            value: version.to_string(),
        })?;
        let [time] = s.numbers("time")?;
        let [first_energy] = s.numbers("first_energy")?;
        let recent_energy = s.numbers("recent_energy")?;
        let flowed = s.try_numbers("flowed")?.unwrap_or_default();
        let loosened = s.or_default("loosened", State::tally)?;
        let trapped_void = s.try_numbers("trapped_void")?;
        let tolerated = s.floats("tolerated")?.first().copied();
        let baseline = s.exactly("baseline", materials)?;
        let [last_other_power] = s.numbers("other_power")?;
        let row = load_row(s, self.gauges.len(), materials)?;

        particles.sort(mesh);
        self.matter = changes.last().map_or(&plan.state, |c| &c.state).clone();
        self.quadrature.composition_mut().set_factors(factors);
        self.factors_of_points = factors.to_vec();
        let last = Iterate { mesh, velocity: &flow.velocity, pressure: &flow.pressure };
        self.quadrature
            .update(mesh, &particles, &self.matter.materials, version, &last)
            .map_err(|e| StateError::Range { name: "particles.position", value: e.to_string() })?;
        self.particles = particles;
        self.flow = flow;
        self.previous = previous;
        if let Some(inertia) = &mut self.inertia {
            (inertia.past, inertia.acceleration) = ([past, None], acceleration);
        }
        for ((gauge, &volume), &refilled) in self.gauges.iter_mut().zip(gauges).zip(refilled) {
            (gauge.volume, gauge.refilled) = (volume, refilled);
        }
        let both = 2 * self.gauges.len();
        let recent = s.or_default("gauges.recent", |s, name| s.tuples(name, both))?;
        for (gauge, recent) in self.gauges.iter_mut().zip(recent.as_chunks().0) {
            gauge.recent = recent.map(|[all, own]| Amount { all, own });
        }
        if let (Some(dye), Some(lines)) = (&mut self.dye, dye) {
            dye.lines = lines;
        }
        self.count =
            Count { splits, merges, held, left, healed, volume_in, volume_out, energy_out };
        (self.step, self.version, self.next_change) = (step, version, next_change as usize);
        self.time = time;
        self.switch_sources();
        self.tolerated = tolerated;
        self.first_energy = first_energy;
        self.flowed = flowed;
        self.loosened = loosened;
        self.trapped_void = trapped_void;
        self.recent_energy = recent_energy;
        let entering = self.inflow.iter().flat_map(|i| i.cells_of_interest(plan.background()));
        self.interest.update(mesh, self.quadrature.composition(), plan.background(), entering);
        self.baseline = baseline.to_vec();
        self.last_other_power = last_other_power;
        self.row = row;
        self.events.clear();
        // The next step moves particles with the velocities of the cells that were solved for.
        let failed = |e: SimError| StateError::Range { name: "particles", value: e.to_string() };
        self.leave_out_void().map_err(failed)
    }
}

fn dye_lines(s: &State) -> Result<Vec<Vec<[f64; 2]>>, StateError> {
    let lengths = s.counts("dye.lines")?;
    let total = lengths.iter().fold(0u64, |a, &b| a.saturating_add(b));
    let count = usize::try_from(total).unwrap_or(usize::MAX / 2);
    let mut points = s.tuples::<2>("dye.points", count.min(usize::MAX / 2))?.into_iter();
    Ok(lengths.iter().map(|&n| points.by_ref().take(n as usize).collect()).collect())
}
