//! This module states why flow curves, the zero of the pressure, inertia, slip and inflow are solved or
//! not, for `grainscope plan`.

use super::Plan;
use super::boundary::place_of;
use super::material::Material;
use super::slip::WallLaw;
use crate::laws::flow_curve::{FlowCurve, Strength};

/// A number with three digits.
fn short(value: f64) -> String {
    let rounded = format!("{value:.2e}").parse().unwrap_or(value);
    let plain = rounded == 0.0 || (1e-3..1e5).contains(&rounded.abs());
    if plain { format!("{rounded}") } else { format!("{rounded:e}") }
}

impl Plan {
    /// The materials with a flow curve, and the bounds of their viscosity.
    pub(super) fn curves(&self) -> String {
        let curve = |m: &Material| Some(self.curve(&m.name, m.law.curve.as_ref()?));
        self.state.materials.iter().filter_map(curve).collect::<Vec<_>>().join("; ")
    }

    fn curve(&self, name: &str, curve: &FlowCurve) -> String {
        let u = &self.units;
        let [low, high] = [curve.smallest, curve.largest].map(|v| short(v * u.viscosity));
        let what = match &curve.strength {
            Strength::HerschelBulkley { yield_stress: 0.0, index, .. } => {
                format!("power law of index {}", short(*index))
            }
            Strength::HerschelBulkley { yield_stress, .. } => {
                format!("yield stress {} Pa", short(yield_stress * u.stress()))
            }
            Strength::Friction(f) => {
                let range = f.well_posed_range().map(|ends| ends.map(short));
                let range = range.map_or("none".into(), |[a, b]| format!("{a} to {b}"));
                format!("friction, well posed without an internal length for I = {range}")
            }
        };
        format!("{name}: {what}, viscosity {low} to {high} Pa s")
    }

    /// Whether the pressure is given at a point, and the reason.
    pub(super) fn zero_of_pressure(&self) -> (bool, String) {
        let Some(point) = &self.pressure_reference else {
            let reason = if self.effects.void {
                "the surface of the materials determines the pressure: nothing is around them"
            } else if self.boundary.closed {
                "closed domain without friction: the mean of the pressure is zero"
            } else {
                "the boundaries determine the pressure"
            };
            return (false, reason.into());
        };
        let [x, y] = self.si(point.at);
        let at = [x + self.origin[0], y + self.origin[1]].map(short);
        let place =
            format!("{} Pa at ({}, {}) m", short(point.value * self.units.stress()), at[0], at[1]);
        let cause = match &self.scene.pressure_reference {
            Some(_) => "[pressure_reference]",
            None => "friction in a closed domain: the highest background",
        };
        (true, format!("{cause}, {place}"))
    }

    /// Why inertia is not solved.
    pub(super) fn no_inertia(&self) -> &'static str {
        if self.scene.inertia { "nothing has a density" } else { "creeping flow" }
    }

    /// The materials whose rotation has inertia.
    pub(super) fn micro_inertia(&self) -> String {
        let states = std::iter::once(&self.state).chain(self.changes.iter().map(|c| &c.state));
        let mut names = vec![];
        for m in states.flat_map(|s| &s.materials).filter(|m| m.micro_inertia > 0.0) {
            if !names.contains(&m.name.as_str()) {
                names.push(m.name.as_str());
            }
        }
        format!("micro_inertia: {}", names.join(", "))
    }

    /// Why the rotation has no inertia.
    pub(super) fn no_micro_inertia(&self) -> &'static str {
        match (self.effects.rotation, self.effects.inertia) {
            (false, _) => "no rotation",
            (true, false) => "creeping flow",
            (true, true) => "no material has micro_inertia: the rotation follows without delay",
        }
    }

    /// The places along which material slips, with the laws there; empty if there are none.
    pub(super) fn slips(&self) -> String {
        let law = |law: &WallLaw| match law {
            WallLaw::Slip { length } => format!("slip length {} m", short(*length)),
            WallLaw::Friction { coefficient } => format!("friction {}", short(*coefficient)),
        };
        let sides = self.boundary.pieces().filter_map(|(s, piece)| {
            let slip = piece.conditions.slip.as_ref()?;
            Some(format!("{}: {}", place_of(s, piece), law(&slip.law)))
        });
        let mut list: Vec<String> = sides.collect();
        let mut others: Vec<String> =
            self.boundary.walls.iter().filter_map(|w| w.slip.as_ref()).map(law).collect();
        others.extend(self.boundary.solids.iter().flatten().map(law));
        others.dedup();
        list.extend(others.iter().map(|law| format!("walls and blocks: {law}")));
        list.dedup();
        list.join("; ")
    }

    /// Names of the solids of any shape and the number of cells that they cut; empty if there are none.
    pub(super) fn solids(&self) -> String {
        let Some(parts) = self.mesh.parts() else { return String::new() };
        let names: Vec<&str> = parts.solids.iter().map(|s| s.name.as_str()).collect();
        let (cut, all) = (parts.all().count(), self.mesh.cells());
        format!("{}: {cut} of {all} cells are cut", names.join(", "))
    }

    /// What enters, and where; empty if nothing does.
    pub(super) fn inflow(&self) -> String {
        let name = |m: u8| &self.state.materials[usize::from(m)].name;
        let sides = self.boundary.pieces().filter_map(|(s, piece)| {
            let entering = piece.enters.as_ref()?;
            Some(format!("{} through {}", name(entering.material), place_of(s, piece)))
        });
        let sources = self.boundary.sources.iter();
        let sources = sources.map(|s| format!("{} from `{}`", name(s.entering.material), s.name));
        let mut list: Vec<String> = sides.chain(sources).collect();
        list.dedup();
        list.join("; ")
    }
}
