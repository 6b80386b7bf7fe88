//! This module resolves a scene with its `[[schedule]]`. Each entry gives a scene in which some
//! values are replaced.

use super::materials::SiMatter;
use super::values::Result;
use crate::plan::material::Material;
use crate::plan::{Matter, Plan, PlannedChange, Units, When};
use crate::scene::{self, Change, Quantity, Scene, SceneError, Scope};
use crate::space::mesh::{Axis, Mesh};

/// Checks a scene and makes its plan.
pub fn resolve(scene: &Scene) -> Result<Plan> {
    let mut plan = super::without_schedule(scene, None)?;
    let mut current = super::void::with_void(scene)?;
    current.schedule.clear();
    for (index, change) in scene.schedule.iter().enumerate() {
        apply(&mut current, change, index)?;
        let scope = Scope::new(&current)?;
        let when = match (&change.time, change.step) {
            (Some(t), None) => When::Time(t.eval(&scope)? / plan.units.time),
            (None, Some(step)) => When::Step(step),
            _ => {
                return Err(SceneError::of_key(
                    format!("schedule[{index}]"),
                    format!("schedule[{index}]: give either `time` or `step`"),
                    "one of them says when the change takes effect",
                ));
            }
        };
        let other = super::without_schedule(&current, None)?;
        if let Some(what) = plan.beyond_matter(&other) {
            return Err(SceneError::of_key(
                format!("schedule[{index}]"),
                format!(
                    "schedule[{index}] changes {what}; only constant material values and gravity \
                     may change"
                ),
                "start a new run for such a change",
            ));
        }
        if !follows(&plan.changes, when) {
            return Err(SceneError::of_key(
                format!("schedule[{index}]"),
                format!("schedule[{index}] does not come after the entries above it"),
                "order the entries of [[schedule]] that have a time, and those that have a step",
            ));
        }
        let mut state = SiMatter::new(&current, &scope)?.matter(&plan.units);
        plan.effects.micro_inertia |= state.materials.iter().any(|m| m.micro_inertia > 0.0);
        state.relaxation = relaxation(&state, &plan.mesh, inertial(scene, &plan.units));
        let label =
            change.set.iter().map(|(k, v)| format!("{k} = {v}")).collect::<Vec<_>>().join(", ");
        plan.changes.push(PlannedChange { when, state, label });
    }
    for change in &plan.changes {
        if let When::Time(t) = change.when
            && t < plan.clock.end
        {
            plan.clock.stops.push(t);
        }
    }
    plan.clock.stops.sort_by(f64::total_cmp);
    let least = 1e-9 * plan.clock.end;
    plan.clock.stops.dedup_by(|b, a| *b - *a < least);
    Ok(plan)
}

/// Whether a change comes after those above it. Only times are compared with times and steps with
/// steps, because the step that contains a given time is not known yet.
fn follows(before: &[PlannedChange], when: When) -> bool {
    before.iter().all(|c| match (c.when, when) {
        (When::Time(before), When::Time(now)) => before <= now,
        (When::Step(before), When::Step(now)) => before <= now,
        _ => true,
    })
}

/// Largest time step in units of the relaxation time of a stratification. At rest, the residual
/// speed of the solver is its tolerance times the speed scale of the scene, and a step displaces
/// particles by an amount proportional to this speed and to the step in relaxation times.
const RELAXATIONS: f64 = 1e4;

/// Largest time step of a stratification with inertia, in units of the inverse frequency of the
/// shortest waves of a mesh, `sqrt(h/(pi g))`.
const WAVES: f64 = 1.0;

/// Unit of the acceleration of the weight over that of the inertia, if inertia is solved.
pub(super) fn inertial(scene: &Scene, units: &Units) -> Option<f64> {
    scene.inertia.then(|| units.inertial_density() / units.density)
}

/// Largest time step for a stratification: a multiple of `eta/(rho g L)` with the largest
/// viscosity, or, with inertia, of the period of the shortest waves; `None` without gravity or with
/// a single density.
pub(super) fn relaxation(matter: &Matter, mesh: &Mesh, inertial: Option<f64>) -> Option<f64> {
    if let Some(unit) = inertial {
        let smallest =
            |axis: &Axis| (0..axis.cells()).map(|k| axis.size(k)).fold(f64::INFINITY, f64::min);
        let h = smallest(&mesh.x).max(smallest(&mesh.y));
        let g = matter.gravity[0].hypot(matter.gravity[1]) * unit;
        return (g > 0.0 && matter.is_stratified())
            .then(|| WAVES * (h / (std::f64::consts::PI * g)).sqrt());
    }
    let largest = |f: fn(&Material) -> f64| matter.materials.iter().map(f).fold(0.0, f64::max);
    let extent = (mesh.x.end() - mesh.x.start()).max(mesh.y.end() - mesh.y.start());
    let weight = largest(|m| m.density) * matter.gravity[0].hypot(matter.gravity[1]) * extent;
    (weight > 0.0 && matter.is_stratified())
        .then(|| RELAXATIONS * largest(|m| m.viscosity) / weight)
}

/// Applies a change to the parameters, the material values and the gravity of a scene.
fn apply(scene: &mut Scene, change: &Change, index: usize) -> Result<()> {
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
            ["materials", name, "friction", field] => {
                let friction = scene.materials.get_mut(*name).and_then(|m| m.friction.as_mut());
                friction.is_some_and(|f| set_friction(f, field, value))
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

fn set_friction(f: &mut scene::Friction, field: &str, value: &Quantity) -> bool {
    match field {
        "static" => f.at_rest = value.clone(),
        "dynamic" => f.dynamic = Some(value.clone()),
        "inertial_number" => f.inertial_number = value.clone(),
        "grain_diameter" => f.grain_diameter = value.clone(),
        "grain_density" => f.grain_density = Some(value.clone()),
        _ => return false,
    }
    true
}

fn set_material(m: &mut scene::Material, field: &str, value: &Quantity) -> bool {
    match field {
        "density" => m.density = value.clone().into(),
        "shear_viscosity" => m.shear_viscosity = Some(value.clone().into()),
        "bulk_viscosity" => m.bulk_viscosity = Some(value.clone()),
        "coupling_viscosity" => m.coupling_viscosity = Some(value.clone()),
        "internal_length" => m.internal_length = Some(value.clone()),
        "layer_internal_length" => m.layer_internal_length = Some(value.clone()),
        "micro_inertia" => m.micro_inertia = Some(value.clone()),
        "couple_viscosity" => m.couple_viscosity = Some(value.clone()),
        "layer_viscosity" => m.layer_viscosity = Some(value.clone()),
        "coupling_ratio" => m.coupling_ratio = Some(value.clone()),
        "layer_ratio" => m.layer_ratio = Some(value.clone()),
        "cohesion" => m.cohesion = Some(value.clone()),
        "yield_stress" => m.yield_stress = Some(value.clone()),
        "flow_index" => m.flow_index = Some(value.clone()),
        "largest_viscosity" => m.largest_viscosity = Some(value.clone()),
        "smallest_viscosity" => m.smallest_viscosity = Some(value.clone()),
        _ => return false,
    }
    true
}
