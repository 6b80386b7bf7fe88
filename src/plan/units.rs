//! The units in which a scene is solved.
//!
//! Length, viscosity, time and density are scaled by powers of two near the scene's own scales,
//! so that all numbers inside are of order one while nothing is rounded: a scene in other units
//! takes the same steps bit for bit.

/// SI values of one unit of each kind; all powers of two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// m
    pub length: f64,
    /// Pa s
    pub viscosity: f64,
    /// s
    pub time: f64,
    /// kg/m3
    pub density: f64,
}

/// The power of two just below a positive number; 1 for anything else.
pub fn power_of_two(x: f64) -> f64 {
    if x > 0.0 && x.is_finite() { x.log2().floor().exp2() } else { 1.0 }
}

impl Units {
    /// m/s
    pub fn velocity(&self) -> f64 {
        self.length / self.time
    }
    /// 1/s
    pub fn rate(&self) -> f64 {
        1.0 / self.time
    }
    /// Pa
    pub fn stress(&self) -> f64 {
        self.viscosity / self.time
    }
    /// N/m3
    pub fn force_density(&self) -> f64 {
        self.stress() / self.length
    }
    /// m/s2
    pub fn acceleration(&self) -> f64 {
        self.force_density() / self.density
    }
    /// Pa s m2, of the couple viscosity M.
    pub fn couple_viscosity(&self) -> f64 {
        self.viscosity * self.length * self.length
    }
    /// m2, of volumes per unit depth.
    pub fn area(&self) -> f64 {
        self.length * self.length
    }
    /// m2/s, of outflow per unit depth.
    pub fn area_rate(&self) -> f64 {
        self.area() / self.time
    }
    /// W/m
    pub fn power(&self) -> f64 {
        self.stress() / self.time * self.area()
    }
    /// J/m
    pub fn energy(&self) -> f64 {
        self.power() * self.time
    }
}
