//! This module checks the state of a run for invalid values.

use super::fault::{Fault, Place};
use super::simulation::Simulation;

/// Largest relative difference of the powers in a valid solution; at the usual tolerance it is
/// 1e-9.
const POWER: f64 = 1e-3;
/// The difference of the powers may exceed the solver tolerance by this factor, if that is larger. For
/// generalised fluids the tolerance of their iteration counts.
const POWER_TOLERANCE: f64 = 10.0;
/// The same factor for that tolerance: errors up to it are by design.
const NONLINEAR_TOLERANCE: f64 = 2.0;
/// Largest relative drift of the projected area of a material in a valid state; coarse meshes reach
/// 0.05 (`grainscope stress`).
const DRIFT: f64 = 0.2;
/// The drift of materials that fill fewer cells is not checked: most of their cells are cut.
const CELLS_THAT_DRIFT: f64 = 16.0;

/// Bound of valid values. Squares of much larger values are infinite, and norms are sums of
/// squares.
const LARGEST: f64 = 1e150;

/// Index and value of the first number that is not finite or not below [`LARGEST`].
fn first_bad(values: &[f64]) -> Option<(usize, f64)> {
    /// Number of values that are checked together.
    const TOGETHER: usize = 256;
    let good = |v: f64| v.abs() < LARGEST;
    let all_good = |part: &[f64]| part.iter().fold(true, |all, &v| all & good(v));
    let part = values.chunks(TOGETHER).position(|part| !all_good(part))?;
    let first = part * TOGETHER;
    let bad = values[first..].iter().position(|&v| !good(v))?;
    Some((first + bad, values[first + bad]))
}

impl<const D: usize> Simulation<D> {
    /// Checks the loads and the flow, then the particles, then the row.
    ///
    /// # Errors
    /// The first fault.
    pub(super) fn find_fault(&self) -> Result<(), Fault> {
        self.faults_of_flow()?;
        self.faults_of_particles()?;
        self.faults_of_row()
    }

    fn faults_of_flow(&self) -> Result<(), Fault> {
        let mesh = &self.plan.mesh;
        for (names, nodal) in [
            (["the load", "the couple of the load"], &self.load),
            (["the velocity", "the rotation"], &self.flow.velocity),
        ] {
            if let Some((k, value)) = first_bad(nodal.as_flattened()) {
                let at = mesh.node_position(k / D);
                let [x, y] = self.plan.si(at);
                let place = Place::Node { cell: mesh.locate(at), x, y };
                let field = names[usize::from(k % D == 2)];
                return Err(Fault::NonFinite { field, value, place });
            }
        }
        if let Some((k, value)) = first_bad(self.flow.pressure.as_flattened()) {
            let cell = k / 3;
            let [x, y] = self.plan.si(mesh.cell_centre(cell));
            let place = Place::Cell { cell, x, y };
            return Err(Fault::NonFinite { field: "the pressure", value, place });
        }
        Ok(())
    }

    fn faults_of_particles(&self) -> Result<(), Fault> {
        let (mesh, p) = (&self.plan.mesh, &self.particles);
        let place = |index: usize| {
            let at = p.position[index];
            let [x, y] = self.plan.si(at);
            Place::Particle { index, cell: mesh.locate(at), x, y }
        };
        let none: &[f64] = &[];
        let fields: [(&'static str, usize, &[f64]); 5] = [
            ("the position", 2, p.position.as_flattened()),
            ("the volume", 1, &p.volume),
            ("the director", 2, p.director.as_ref().map_or(none, |d| d.as_flattened())),
            ("the viscosity", 1, p.viscosity.as_deref().unwrap_or(none)),
            ("the density", 1, p.density.as_deref().unwrap_or(none)),
        ];
        for (field, width, values) in fields {
            if let Some((k, value)) = first_bad(values) {
                return Err(Fault::NonFinite { field, value, place: place(k / width) });
            }
        }
        let carries = |k: usize| self.matter.materials[p.material[k] as usize].carries_viscosity;
        if let Some(k) = p.volume.iter().position(|&v| v <= 0.0) {
            let (field, value) = ("the volume", p.volume[k]);
            return Err(Fault::NotPositive { field, value, place: place(k) });
        }
        let viscosities = p.viscosity.iter().flatten().enumerate();
        if let Some((k, &value)) =
            viscosities.filter(|(k, _)| carries(*k)).find(|(_, v)| **v <= 0.0)
        {
            return Err(Fault::NotPositive { field: "the viscosity", value, place: place(k) });
        }
        match p.position.iter().position(|&at| !mesh.holds(at)) {
            Some(k) => Err(Fault::Outside { place: place(k) }),
            None => Ok(()),
        }
    }

    fn faults_of_row(&self) -> Result<(), Fault> {
        let r = &self.row;
        let numbers = [
            ("the time", r.time),
            ("the power of the loads", r.power_in),
            ("the dissipation", r.dissipation),
            ("the power of the stabilisation", r.stabilisation),
            ("the power error", r.power_error),
            ("the divergence", r.divergence_error),
            ("the volume error", r.volume_error),
            ("the potential energy", r.potential_energy),
            ("the work", r.work),
            ("the dissipated energy", r.dissipated),
        ];
        let gauges = r.gauges.iter().flat_map(|g| [("a gauge", g.volume), ("a gauge", g.rate)]);
        for (field, value) in numbers.into_iter().chain(gauges) {
            if !value.is_finite() {
                return Err(Fault::NonFinite { field, value, place: Place::Scene });
            }
        }
        let method = &self.plan.method;
        let mut limit = POWER.max(POWER_TOLERANCE * method.tolerance);
        if self.plan.effects.flow_curves {
            limit = limit.max(NONLINEAR_TOLERANCE * method.nonlinear_tolerance);
        }
        if r.power_error > limit {
            return Err(Fault::Power { error: r.power_error, limit });
        }
        let mesh = &self.plan.mesh;
        let cell = mesh.x.length() * mesh.y.length() / mesh.cells() as f64;
        for (m, (&drift, material)) in r.drift.iter().zip(&self.matter.materials).enumerate() {
            let strays = drift.is_nan() || drift.abs() > DRIFT;
            if strays && self.particles.volume_of(m) > CELLS_THAT_DRIFT * cell {
                let material = material.name.clone();
                return Err(Fault::Drift { material, drift: drift.abs(), limit: DRIFT });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{plan, scene};
    use std::sync::Arc;

    fn silo() -> Simulation<3> {
        let source = scene::presets::find("silo").expect("listed");
        let source = source.with_sets(&["accuracy.cells=2".into()]).expect("valid");
        let plan = plan::resolve(&scene::parse(&source).expect("valid")).expect("valid");
        Simulation::new(Arc::new(plan)).expect("solved")
    }

    #[test]
    fn a_good_state_has_no_fault() {
        assert_eq!(silo().find_fault(), Ok(()));
    }

    #[test]
    fn what_is_not_finite_is_named_with_its_place() {
        let mut sim = silo();
        sim.particles.volume[7] = f64::NAN;
        let fault = sim.find_fault().expect_err("a fault");
        assert!(fault.is_non_finite() && !fault.is_tolerable());
        let cell = sim.plan.mesh.locate(sim.particles.position[7]);
        let said = fault.to_string();
        assert!(said.contains("the volume is NaN"), "{said}");
        assert!(said.contains(&format!("at particle 7 in cell {cell}, (")), "{said}");
        assert!(fault.remedy().contains("likely cause"));

        let mut sim = silo();
        sim.flow.velocity[10][2] = f64::INFINITY;
        let said = sim.find_fault().expect_err("a fault").to_string();
        assert!(
            said.contains("the rotation is inf") && said.contains("at a node of cell"),
            "{said}"
        );
        let mut sim = silo();
        sim.flow.pressure[3][1] = f64::NAN;
        let said = sim.find_fault().expect_err("a fault").to_string();
        assert!(said.contains("the pressure is NaN") && said.contains("in cell 3, ("), "{said}");
        let mut sim = silo();
        sim.row.gauges[0].rate = f64::NAN;
        assert!(sim.find_fault().expect_err("a fault").to_string().contains("a gauge is NaN"));
    }

    #[test]
    fn what_cannot_be_is_a_fault_though_it_is_finite() {
        let mut sim = silo();
        sim.particles.volume[7] = -1.0;
        assert!(matches!(sim.find_fault(), Err(Fault::NotPositive { field: "the volume", .. })));
        let mut sim = silo();
        sim.particles.position[2] = [1e3, 0.0];
        assert!(matches!(sim.find_fault(), Err(Fault::Outside { .. })));
        let mut sim = silo();
        sim.row.power_error = 0.1;
        assert!(matches!(sim.find_fault(), Err(f @ Fault::Power { .. }) if f.is_tolerable()));
        let mut sim = silo();
        sim.row.drift[0] = -0.5;
        let fault = sim.find_fault().expect_err("a fault");
        assert!(fault.is_tolerable() && fault.to_string().contains("`grains`"), "{fault}");
    }
}
