//! This module defines the units in which a scene is solved.
//!
//! Length, viscosity, time and density are scaled by powers of two near the scene's own scales.
//! Internal values are thus of order one, and scaling rounds nothing: a scene in other units takes
//! the same steps bit for bit.

/// SI values of the units of a plan; those of the fields are powers of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Length, m.
    pub length: f64,
    /// Viscosity, Pa s.
    pub viscosity: f64,
    /// Time, s.
    pub time: f64,
    /// Density, kg/m3.
    pub density: f64,
    /// Depth of the domain, m: 1 in the plane, the length around an axis, where volumes are those of
    /// rings.
    pub depth: f64,
}

/// The largest power of two that does not exceed a positive number; 1 for other numbers.
pub fn power_of_two(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x.log2().floor().exp2() } else { 1.0 }
}

impl Units {
    /// Velocity, m/s.
    pub fn velocity(&self) -> f64 {
        self.length / self.time
    }
    /// Rate, 1/s.
    pub fn rate(&self) -> f64 {
        1.0 / self.time
    }
    /// Stress, Pa.
    pub fn stress(&self) -> f64 {
        self.viscosity / self.time
    }
    /// Force per volume, N/m3.
    pub fn force_density(&self) -> f64 {
        self.stress() / self.length
    }
    /// Acceleration, m/s2.
    pub fn acceleration(&self) -> f64 {
        self.force_density() / self.density
    }
    /// Density of the inertial force `rho du/dt`, kg/m3. It is not the unit of the density, which
    /// the weight determines.
    pub fn inertial_density(&self) -> f64 {
        self.stress() / self.velocity().powi(2)
    }
    /// Couple viscosity M, Pa s m2.
    pub fn couple_viscosity(&self) -> f64 {
        self.viscosity * self.length * self.length
    }
    /// Volume, m3 around an axis, m2 (per unit depth) in the plane.
    pub fn volume(&self) -> f64 {
        self.length * self.length * self.depth
    }
    /// Rate of a volume, m3/s, or m2/s in the plane.
    pub fn volume_rate(&self) -> f64 {
        self.volume() / self.time
    }
    /// Force, N, or N/m in the plane.
    pub fn force(&self) -> f64 {
        self.stress() * self.length * self.depth
    }
    /// Power, W, or W/m in the plane.
    pub fn power(&self) -> f64 {
        self.stress() / self.time * self.volume()
    }
    /// Energy, J, or J/m in the plane.
    pub fn energy(&self) -> f64 {
        self.power() * self.time
    }
}
