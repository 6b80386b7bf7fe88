//! The diagnostics of a step, in SI units: a row of `series.csv`.

use super::clock::Limiter;
use serde::Serialize;

/// One row of the series.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub step: u64,
    /// s
    pub time: f64,
    /// s
    pub dt: f64,
    pub dt_limiter: Limiter,
    /// Seconds this step took.
    pub wall: f64,
    /// Power of gravity, body forces, tractions and moving boundaries, W/m.
    pub power_in: f64,
    /// Viscous dissipation, W/m.
    pub dissipation: f64,
    /// Power that the stabilisation of stratified fluids takes from the flow, W/m: numerical, of
    /// second order in the step, either sign.
    pub stabilisation: f64,
    /// `|power_in - dissipation - stabilisation|` over the larger of the first two.
    pub power_error: f64,
    /// L2 norm of the projected divergence over that of the strain rate.
    pub divergence_error: f64,
    /// rms over cells with particles of (sum of particle volumes)/(cell area) - 1.
    pub volume_error: f64,
    /// Corrections of the solver, all solutions of the step together.
    pub iterations: u32,
    pub particles: usize,
    /// m/s
    pub max_speed: f64,
    /// Root mean square over the domain without solids, m/s.
    pub rms_speed: f64,
    /// Of the particles in gravity, less the background's, J/m.
    pub potential_energy: f64,
    /// Time integral of the power of everything but gravity, and what scheduled changes of gravity
    /// add, J/m.
    pub work: f64,
    /// Time integral of the dissipation, J/m.
    pub dissipated: f64,
    /// Largest `| |n| - 1 |`; zero without directors.
    pub director_error: f64,
    /// Volume mean of |n_x| over layered particles; `None` without directors.
    pub alignment: Option<f64>,
    /// Rotation unknowns that a Cosserat material acts on.
    pub active_rotation: usize,
    pub splits: u64,
    pub merges: u64,
    pub held: u64,
    pub gauges: Vec<GaugeRow>,
    /// Relative change since the start of each material's projected area over the volume of its
    /// particles, which is exact.
    pub drift: Vec<f64>,
    pub seconds: Phases,
}

/// State of a gauge.
#[derive(Clone, Debug, Serialize)]
pub struct GaugeRow {
    /// m2 per unit depth: m3/m.
    pub volume: f64,
    /// m3/(m s)
    pub rate: f64,
}

/// Wall seconds by phase.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Phases {
    pub quadrature: f64,
    /// Gravity, accelerations and the restoring loads of stratification.
    pub weight: f64,
    pub assemble: f64,
    pub factor: f64,
    pub solve: f64,
    pub motion: f64,
    pub dye: f64,
    pub population: f64,
    pub diagnostics: f64,
}

impl Phases {
    pub fn add(&mut self, o: &Phases) {
        self.quadrature += o.quadrature;
        self.weight += o.weight;
        self.assemble += o.assemble;
        self.factor += o.factor;
        self.solve += o.solve;
        self.motion += o.motion;
        self.dye += o.dye;
        self.population += o.population;
        self.diagnostics += o.diagnostics;
    }

    pub fn list(&self) -> [(&'static str, f64); 9] {
        [
            ("quadrature", self.quadrature),
            ("weight", self.weight),
            ("assemble", self.assemble),
            ("factor", self.factor),
            ("solve", self.solve),
            ("motion", self.motion),
            ("dye", self.dye),
            ("population", self.population),
            ("diagnostics", self.diagnostics),
        ]
    }

    pub fn total(&self) -> f64 {
        self.list().iter().map(|(_, s)| s).sum()
    }
}
