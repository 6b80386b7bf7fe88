//! What may change while a run goes on, and what may not.

use super::boundary::add_body_force;
use super::material::Material;
use super::{Gauge, Matter, Plan, PlannedChange, Tracers, When, resolve};
use crate::scene::{self, Change, Quantity, Scene, SceneError};
use indexmap::IndexMap;

impl Plan {
    /// What differs, in a few words, besides the values of materials and gravity: those alone may
    /// change while a run goes on.
    pub fn beyond_matter(&self, other: &Plan) -> Option<&'static str> {
        let checks: [(bool, &str); 11] = [
            (geometry(self) != geometry(other), "the mesh"),
            (self.effects != other.effects, "the set of solved effects"),
            (!same_history(&self.state, &other.state), "the kind of a material"),
            (self.initial != other.initial, "what particles carry"),
            (supports(self) != supports(other), "the boundaries"),
            (
                loads(self) != loads(other) || self.acceleration != other.acceleration,
                "the boundaries' values or the loads",
            ),
            (self.regions != other.regions, "what fills the domain at first"),
            (lines(self) != lines(other), "gauges or dye"),
            (self.method != other.method, "the accuracy"),
            (times(self) != times(other), "times of the run"),
            (self.picture != other.picture, "the recording"),
        ];
        checks.into_iter().find_map(|(differs, what)| differs.then_some(what))
    }

    /// Whether a run of this plan is also one of `other` until the first change that only one of
    /// them has: same units, same instants to be met.
    fn shares_its_beginning_with(&self, other: &Plan) -> bool {
        self.units == other.units
            && self.clock.stops == other.clock.stops
            && self.beyond_matter(other).is_none()
            && self.state == other.state
    }

    /// The plan with a change of keys that takes effect with the solution of step `step`, given
    /// that `applied` of the changes planned so far lie behind. A run of this plan that has not
    /// come to that step yet may go on with the new one: run from its start, it comes to the same.
    pub fn with_change(
        &self,
        applied: usize,
        step: u64,
        set: &IndexMap<String, Quantity>,
    ) -> Result<Plan, SceneError> {
        let mut scene = self.scene.clone();
        let waiting = self.changes.get(applied).is_some_and(|c| c.when == When::Step(step));
        match scene.schedule.get_mut(applied) {
            Some(entry) if waiting => {
                entry.set.extend(set.iter().map(|(k, v)| (k.clone(), v.clone())));
            }
            _ => scene
                .schedule
                .insert(applied, Change { time: None, step: Some(step), set: set.clone() }),
        }
        let plan = resolve(&scene)?;
        let label = |c: &PlannedChange| (c.when, c.label.clone());
        let past = plan.changes.iter().take(applied).map(label);
        if self.shares_its_beginning_with(&plan)
            && past.eq(self.changes.iter().take(applied).map(label))
        {
            return Ok(plan);
        }
        Err(SceneError::new(
            "the change reaches back to the beginning of the run",
            "such a change needs a run of its own",
        ))
    }
}

/// Sides and walls that hold or let through, apart from their values.
fn supports(p: &Plan) -> ([bool; 4], [bool; 2], bool) {
    (p.enclosure.open, p.boundary.free_translation, p.boundary.closed)
}

/// Gauges, dye lines and marks in SI units.
fn lines(p: &Plan) -> (Vec<Gauge>, Option<Tracers>, Vec<[f64; 5]>) {
    let l = p.units.length;
    let gauges = p.gauges.iter().cloned();
    let gauges = gauges.map(|g| Gauge { at: g.at * l, from: g.from * l, to: g.to * l, ..g });
    let dye = p.tracers.as_ref().map(|t| Tracers {
        lines: t.lines.iter().map(|s| s.iter().map(|p| p.map(|v| v * l)).collect()).collect(),
        spacing: t.spacing * l,
    });
    let marks = p.marks.iter();
    let marks = marks
        .map(|m| [m.from[0], m.from[1], m.to[0], m.to[1], m.half_width].map(|v| v * l))
        .collect();
    (gauges.collect(), dye, marks)
}

/// Times and limits of steps in SI units.
fn times(p: &Plan) -> (Vec<f64>, Option<f64>, [f64; 2]) {
    let t = p.units.time;
    let frames = p.clock.frames.iter().chain([&p.clock.end]).map(|v| v * t);
    (frames.collect(), p.clock.max_step.map(|v| v * t), [p.clock.courant, p.clock.strain])
}

/// What a scheduled change must leave as it is, in SI units.
fn geometry(p: &Plan) -> (Vec<f64>, Vec<[f64; 2]>) {
    let l = p.units.length;
    let lines = p.mesh.x.lines().iter().chain(p.mesh.y.lines()).map(|v| v * l).collect();
    let walls = p
        .enclosure
        .obstacles
        .iter()
        .flat_map(|o| [[o.at * l, o.normal as f64], [o.from * l, o.to * l]])
        .collect();
    (lines, walls)
}

/// Materials carry the same columns and have the same kind of law.
fn same_history(a: &Matter, b: &Matter) -> bool {
    let kind = |m: &Material| {
        (
            m.name.clone(),
            m.background,
            m.carries_viscosity,
            m.carries_density,
            m.layer_viscosity.is_some(),
            m.rotation.is_some(),
            m.compliance > 0.0,
        )
    };
    a.materials.iter().map(kind).eq(b.materials.iter().map(kind))
}

/// Given nodal values and fixed loads in SI units.
fn loads(p: &Plan) -> Vec<f64> {
    let (mesh, units) = (&p.mesh, &p.units);
    let given = p.boundary.constraints::<3>(mesh, units);
    let mut load = vec![[0.0; 3]; mesh.nodes()];
    p.boundary.add_tractions(mesh, units, &mut load);
    if let Some(f) = &p.body_force {
        add_body_force(mesh, units, f, &mut load);
    }
    let force = units.stress() * units.length;
    let scale = [units.velocity(), units.velocity(), units.rate()];
    let mut out: Vec<f64> = load.iter().flatten().map(|f| f * force).collect();
    for node in 0..mesh.nodes() {
        out.extend((0..3).filter_map(|c| Some(given.fixed_value(node, c)? * scale[c])));
    }
    out
}

/// Sets parameters, material values and gravity of a scene.
pub(super) fn apply(scene: &mut Scene, change: &Change, index: usize) -> Result<(), SceneError> {
    for (key, value) in &change.set {
        let place = format!("schedule[{index}].set: ");
        let slot = key.split(['.', '[']).collect::<Vec<_>>();
        if let Some(parameter) = scene.parameters.get_mut(key) {
            parameter.value = Some(value.clone());
            continue;
        }
        let ok = match slot.as_slice() {
            ["gravity", "0]"] => {
                scene.gravity[0] = value.clone();
                true
            }
            ["gravity", "1]"] => {
                scene.gravity[1] = value.clone();
                true
            }
            ["materials", name, field] => match scene.materials.get_mut(*name) {
                Some(m) => set_material(m, field, value),
                None => false,
            },
            _ => false,
        };
        if !ok {
            return Err(SceneError::at(
                value,
                format!("{place}`{key}` cannot be scheduled"),
                "a parameter's name, `gravity[0]`, `gravity[1]` or `materials.<name>.<value>` can",
            ));
        }
    }
    Ok(())
}

fn set_material(m: &mut scene::Material, field: &str, value: &Quantity) -> bool {
    match field {
        "density" => m.density = value.clone().into(),
        "shear_viscosity" => m.shear_viscosity = Some(value.clone().into()),
        "bulk_viscosity" => m.bulk_viscosity = Some(value.clone()),
        "coupling_viscosity" => m.coupling_viscosity = Some(value.clone()),
        "internal_length" => m.internal_length = Some(value.clone()),
        "couple_viscosity" => m.couple_viscosity = Some(value.clone()),
        "layer_viscosity" => m.layer_viscosity = Some(value.clone()),
        _ => return false,
    }
    true
}
