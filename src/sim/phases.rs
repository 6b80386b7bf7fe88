//! This module holds the wall time of a step by phase.

use serde::Serialize;

/// Wall time by phase, s.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Phases {
    /// Computation of integration points.
    pub quadrature: f64,
    /// Gravity, accelerations and the restoring loads of stratification.
    pub weight: f64,
    /// Assembly of element matrices.
    pub assemble: f64,
    /// Factorisation.
    pub factor: f64,
    /// Solver corrections.
    pub solve: f64,
    /// Advection of particles and directors.
    pub motion: f64,
    /// Advection of dye lines.
    pub dye: f64,
    /// Splits and merges of particles.
    pub population: f64,
    /// Computation of the row of the series.
    pub diagnostics: f64,
}

impl Phases {
    /// Adds the times of another step.
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

    /// Name and time of each phase, s.
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

    /// Sum over all phases, s.
    pub fn total(&self) -> f64 {
        self.list().iter().map(|(_, s)| s).sum()
    }
}
