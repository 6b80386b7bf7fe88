//! This module lists the effects that a scene needs, with the reason for each and its cost, for
//! `grainscope plan`.

use super::Plan;
use super::effect_kind::EffectKind;
use crate::scene::Quadrature;
use serde::Serialize;

/// Stages that a steady flow does not have.
const MOVING: [&str; 7] = [
    "advection",
    "population control",
    "director turning",
    "restoring loads",
    "volume change",
    "dye",
    "inflow",
];

/// An effect, whether it is solved, and why.
#[derive(Clone, Debug, Serialize)]
pub struct Effect {
    /// Kind of effect.
    #[serde(skip)]
    pub kind: EffectKind,
    /// Name of the effect.
    pub name: &'static str,
    /// Whether the effect is solved.
    pub solved: bool,
    /// Reason for solving the effect or not.
    pub why: String,
    /// Number of unknowns that the effect adds.
    pub unknowns: usize,
    /// Number of bytes that the effect adds to each particle.
    pub particle_bytes: usize,
    /// Stages of a step that the effect adds.
    pub stages: Vec<&'static str>,
    /// Measured fraction of the time of a step, if available.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
}

/// Measured computing time of a step.
#[derive(Clone, Debug, Serialize)]
pub struct StepTime {
    /// Number of measured steps.
    pub steps: u32,
    /// Median processor time of a step, s.
    pub seconds: f64,
    /// Mean processor time of each phase of a step, s.
    pub phases: Vec<(&'static str, f64)>,
}

/// All effects and the sizes of the problem.
#[derive(Clone, Debug, Serialize)]
pub struct EffectList {
    /// Name of the scene.
    pub scene: String,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Smallest cell size along x and y, m.
    pub smallest_cell: [f64; 2],
    /// Largest cell size along x and y, m.
    pub largest_cell: [f64; 2],
    /// Number of velocity and rotation unknowns.
    pub unknowns: usize,
    /// Number of pressure unknowns.
    pub pressure_unknowns: usize,
    /// Number of particles per cell at the start.
    pub particles_per_cell: usize,
    /// Names of the quantities stored for each particle.
    pub particle_columns: Vec<&'static str>,
    /// Names of the stages of a step.
    pub stages: Vec<&'static str>,
    /// All effects, solved or not.
    pub effects: Vec<Effect>,
    /// Measured computing time of a step, if available.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<StepTime>,
    /// Warnings about the scene.
    pub warnings: Vec<String>,
}

impl EffectList {
    /// Whether an effect is solved.
    pub fn has(&self, kind: EffectKind) -> bool {
        self.effects.iter().any(|e| e.kind == kind && e.solved)
    }
}

impl Plan {
    /// Lists the effects that are solved or not, with reasons.
    pub fn describe(&self) -> EffectList {
        let effects = self.list_effects();
        let e = &self.effects;
        let mut columns = vec!["position", "volume", "material"];
        for (on, name) in [
            (e.directors, "director"),
            (e.carried_viscosity, "viscosity"),
            (e.carried_density, "density"),
            (!self.marks.is_empty(), "mark"),
        ] {
            if on {
                columns.push(name);
            }
        }
        let mut stages = vec!["integration points", "assembly", "factorisation", "corrections"];
        stages.push("advection");
        stages.extend(effects.iter().filter(|e| e.solved).flat_map(|e| e.stages.iter().copied()));
        stages.push("population control");
        if self.scene.time.steady {
            stages.retain(|s| !MOVING.contains(s));
        }
        let sizes = |axis: &crate::space::mesh::Axis| {
            let all = (0..axis.cells()).map(|c| axis.size(c) * self.units.length);
            let low = all.clone().fold(f64::INFINITY, f64::min);
            (low, all.fold(0.0, f64::max))
        };
        let ((xl, xh), (yl, yh)) = (sizes(&self.mesh.x), sizes(&self.mesh.y));
        EffectList {
            scene: self.scene.name.clone(),
            cells: [self.mesh.x.cells(), self.mesh.y.cells()],
            smallest_cell: [xl, yl],
            largest_cell: [xh, yh],
            unknowns: self.unknowns_per_node() * self.mesh.nodes(),
            pressure_unknowns: 3 * self.mesh.cells(),
            particles_per_cell: self.method.seeding.count(),
            particle_columns: columns,
            stages,
            effects,
            step: None,
            warnings: self.warnings.iter().map(ToString::to_string).collect(),
        }
    }

    fn list_effects(&self) -> Vec<Effect> {
        let materials = &self.state.materials;
        let names = |f: &dyn Fn(&super::Material) -> bool| -> String {
            let list: Vec<_> = materials.iter().filter(|m| f(m)).map(|m| m.name.as_str()).collect();
            list.join(", ")
        };
        let e = &self.effects;
        let nodes = self.mesh.nodes();
        let mut list = Vec::new();
        use EffectKind::*;
        let mut add =
            |kind: EffectKind, solved, why: String, unknowns, particle_bytes, stages: &[_]| {
                let (unknowns, particle_bytes) =
                    if solved { (unknowns, particle_bytes) } else { (0, 0) };
                list.push(Effect {
                    kind,
                    name: kind.name(),
                    share: None,
                    solved,
                    why,
                    unknowns,
                    particle_bytes,
                    stages: stages.to_vec(),
                });
            };
        let why = |on: bool, yes: String, no: &str| if on { yes } else { no.to_string() };
        add(
            Flow,
            true,
            "every scene: Q2 velocity, discontinuous linear pressure".into(),
            2 * nodes + 3 * self.mesh.cells(),
            0,
            &[],
        );
        add(
            Rotation,
            e.rotation,
            why(
                e.rotation,
                format!(
                    "coupling viscosity and internal length: {}",
                    names(&|m| m.law.rotation.is_some())
                ),
                "no material has both a coupling viscosity and an internal length above zero",
            ),
            nodes,
            0,
            &[],
        );
        add(
            Directors,
            e.directors,
            why(
                e.directors,
                format!("layered: {}", names(&|m| m.law.is_layered())),
                "no material has a layer viscosity other than its shear viscosity",
            ),
            0,
            16,
            &["director turning"],
        );
        add(
            Gravity,
            e.gravity,
            why(
                e.gravity,
                format!("acts on: {}", names(&|m| m.density != 0.0 || m.carries_density)),
                "no gravity, or nothing with a density",
            ),
            0,
            0,
            &["body force"],
        );
        let states = || std::iter::once(&self.state).chain(self.changes.iter().map(|c| &c.state));
        let stabilised =
            self.method.stabilisation.filter(|_| states().any(super::Matter::is_stratified));
        add(
            Stabilisation,
            stabilised.is_some(),
            why(
                stabilised.is_some(),
                format!(
                    "more than one density in gravity: accuracy.stabilisation = {}",
                    stabilised.unwrap_or(0.0)
                ),
                "no gravity, a single density, inertia, or accuracy.stabilisation = 0",
            ),
            0,
            0,
            &["restoring loads"],
        );
        add(
            BodyForce,
            self.body_force.is_some(),
            why(self.body_force.is_some(), "[body_force]".into(), "no [body_force]"),
            0,
            0,
            &[],
        );
        add(
            Acceleration,
            self.acceleration.is_some(),
            why(
                self.acceleration.is_some(),
                "[acceleration]".into(),
                "no [acceleration], or nothing with a density",
            ),
            0,
            0,
            &["body force"],
        );
        add(
            CarriedViscosity,
            e.carried_viscosity,
            why(
                e.carried_viscosity,
                names(&|m| m.carries_viscosity),
                "every viscosity is constant",
            ),
            0,
            8,
            &[],
        );
        add(
            CarriedDensity,
            e.carried_density,
            why(e.carried_density, names(&|m| m.carries_density), "every density is constant"),
            0,
            8,
            &[],
        );
        add(
            VolumeChange,
            e.volume_change,
            why(
                e.volume_change,
                format!("finite bulk viscosity: {}", names(&|m| m.law.compliance > 0.0)),
                "every material is incompressible",
            ),
            0,
            0,
            &["volume change"],
        );
        let dye = self.tracers.is_some();
        add(Dye, dye, why(dye, "[dye]".into(), "no [dye] lines"), 0, 0, &["dye"]);
        let gauges = !self.gauges.is_empty();
        add(
            Gauges,
            gauges,
            why(
                gauges,
                self.gauges.iter().map(|g| g.name.as_str()).collect::<Vec<_>>().join(", "),
                "no [[gauges]]",
            ),
            0,
            0,
            &["gauges"],
        );
        let rule = match self.method.quadrature {
            Quadrature::Laminate => "\"laminate\": a laminate along the interface",
            Quadrature::Sides => {
                "\"sides\": each material on its side of a line if their weights differ, a laminate \
                 otherwise"
            }
            Quadrature::Mixture => "\"mixture\": a harmonic mixture",
            Quadrature::Particles => "\"particles\": each particle by itself, as in the source",
        };
        add(
            CutCells,
            self.state.materials.len() > 1,
            why(
                self.state.materials.len() > 1,
                format!("several materials; accuracy.quadrature = {rule}"),
                "one material",
            ),
            0,
            0,
            &[],
        );
        let no = "no `background = \"void\"`";
        add(Void, e.void, why(e.void, "`background = \"void\"`".into(), no), 0, 0, &["surface"]);
        let no = "no material has friction, a yield stress or a flow index";
        let stage = "iterations of the flow curves";
        add(FlowCurves, e.flow_curves, why(e.flow_curves, self.curves(), no), 0, 0, &[stage]);
        let (given, reason) = self.zero_of_pressure();
        add(PressureZero, given, reason, 0, 0, &[]);
        let yes = "`inertia = true`".to_string();
        add(Inertia, e.inertia, why(e.inertia, yes, self.no_inertia()), 0, 0, &["momentum"]);
        let (turns, yes) = (e.micro_inertia, self.micro_inertia());
        let no = self.no_micro_inertia();
        add(MicroInertia, turns, why(turns, yes, no), 0, 0, &["momentum of the rotation"]);
        let slips = self.slips();
        let no = "no side, wall or block has slip_length or wall_friction";
        add(Slip, !slips.is_empty(), why(!slips.is_empty(), slips, no), 0, 0, &[]);
        let (inflow, no) = (self.inflow(), "nothing enters through sides or [[sources]]");
        add(Inflow, !inflow.is_empty(), why(!inflow.is_empty(), inflow, no), 0, 0, &["inflow"]);
        let (solids, no) = (self.solids(), "every wall and block is along mesh lines");
        add(Solids, !solids.is_empty(), why(!solids.is_empty(), solids, no), 0, 0, &[]);
        let moving = self.moving.iter().map(|m| m.name.as_str()).collect::<Vec<_>>().join(", ");
        let (moves, stage) = (!moving.is_empty(), "placing of solids");
        add(Moving, moves, why(moves, moving, "no block has a velocity"), 0, 0, &[stage]);
        list
    }
}
