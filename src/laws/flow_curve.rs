//! This module gives the flow curves of generalised fluids: the shear stress `tau` as a function of
//! the rate `g` and the pressure `p`.
//!
//! ```text
//! Herschel-Bulkley   tau(g)    = tau_y + K g^n                     (Bingham: n = 1)
//! friction mu(I)     tau(g, p) = c + mu(I) p,   p >= 0
//!                    mu(I) = mu_s + (mu_2 - mu_s)/(1 + I_0/I),   I = d g sqrt(rho_s/p)
//! ```
//! The viscosity is `eta = tau/g`, bounded by the smallest and the largest viscosity of the
//! material. The coupling and the couple viscosity are proportional to it, so the rate is that of
//! the power of the law at unit viscosity,
//!
//! ```text
//! g^2 = d.d + tr(D)^2 + 4 a (o - w)^2 + 2 a R^2 |grad w|^2,   a = eta_c/eta
//! ```
//! with `2 a (R_l^2 - R^2) (t.grad w)^2` in addition if the layers, along `t`, have an internal length
//! `R_l` of their own, and in axisymmetric flow the power of the hoop rates (see [`point`](super::point)).
//! The power per volume is `eta g^2`. With `tau' > 0` the stress is the
//! gradient of a convex function of the rates, so at fixed pressure a flow is the minimum of a convex
//! functional, and the derivative of the stress is positive definite:
//!
//! ```text
//! d(stress)/d(rates) = eta U + (eta'/g) (U r)(U r)^T,   U: the law at unit viscosity
//! ```
//! W. H. Herschel, R. Bulkley, Kolloid-Z. 39 (1926) 291. P. Jop, Y. Forterre, O. Pouliquen, "A
//! constitutive law for dense granular flows", Nature 441 (2006) 727. T. Barker, D. G. Schaeffer,
//! P. Bohorquez, J. M. N. T. Gray, "Well-posed and ill-posed behaviour of the mu(I)-rheology for
//! granular flow", J. Fluid Mech. 779 (2015) 794.

/// Friction of grains, with the coefficients of `mu(I)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Coefficient of friction at rest, mu_s.
    pub at_rest: f64,
    /// Coefficient of friction at large rates, mu_2.
    pub fast: f64,
    /// Inertial number I_0 at which friction is halfway between the two.
    pub inertial_number: f64,
    /// Diameter d of the grains, m.
    pub diameter: f64,
    /// Density rho_s of the grain material, kg/m3.
    pub grain_density: f64,
    /// Cohesion c, Pa.
    pub cohesion: f64,
}

impl Friction {
    /// Inertial number at the rate `g` and the pressure `p`; infinite without pressure.
    pub fn inertial_number(&self, g: f64, p: f64) -> f64 {
        self.diameter * g * (self.grain_density / p.max(0.0)).sqrt()
    }

    /// Coefficient of friction at the inertial number `i`, and its derivative.
    pub fn coefficient(&self, i: f64) -> (f64, f64) {
        if i.is_infinite() {
            return (self.fast, 0.0);
        }
        let (rise, sum) = (self.fast - self.at_rest, i + self.inertial_number);
        if sum == 0.0 {
            return (self.at_rest, 0.0);
        }
        (self.at_rest + rise * i / sum, rise * self.inertial_number / (sum * sum))
    }

    /// Whether the equations of a flow without internal length are well posed at the inertial
    /// number `i`; Barker et al. 2015, equation (3.9):
    /// `4 X^2 - 4 X + mu^2 (1 - X/2)^2 <= 0` with `X = I mu'/mu`.
    pub fn is_well_posed(&self, i: f64) -> bool {
        let (mu, slope) = self.coefficient(i);
        let x = i * slope / mu;
        4.0 * x * x - 4.0 * x + mu * mu * (1.0 - 0.5 * x).powi(2) <= 0.0
    }

    /// Range of inertial numbers in which the equations without internal length are well posed;
    /// `None` if there is none.
    pub fn well_posed_range(&self) -> Option<[f64; 2]> {
        const DECADES: [f64; 2] = [-8.0, 6.0];
        const PROBES: usize = 1400;
        let at = |k: usize| {
            let share = k as f64 / PROBES as f64;
            10f64.powf(DECADES[0] + share * (DECADES[1] - DECADES[0]))
        };
        let first = (0..=PROBES).find(|&k| self.is_well_posed(at(k)))?;
        let last = (first..=PROBES).take_while(|&k| self.is_well_posed(at(k))).last()?;
        // The ends lie between neighbouring probes.
        let end = |outside: usize, inside: usize| {
            let (mut out, mut within) = (at(outside), at(inside));
            for _ in 0..50 {
                let middle = (out * within).sqrt();
                *if self.is_well_posed(middle) { &mut within } else { &mut out } = middle;
            }
            within
        };
        Some([end(first.saturating_sub(1), first), end((last + 1).min(PROBES), last)])
    }
}

/// How the shear stress depends on the rate and the pressure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Strength {
    /// `tau_y + K g^n`.
    HerschelBulkley {
        /// Yield stress tau_y, Pa.
        yield_stress: f64,
        /// Consistency K, Pa s^n.
        consistency: f64,
        /// Flow index n.
        index: f64,
    },
    /// `c + mu(I) p`.
    Friction(Friction),
}

/// Flow curve of a generalised fluid with the bounds of its viscosity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowCurve {
    /// Shear stress.
    pub strength: Strength,
    /// Smallest viscosity, Pa s.
    pub smallest: f64,
    /// Largest viscosity, Pa s.
    pub largest: f64,
}

/// Smallest derivative of the stress with respect to the rate, in units of the smallest viscosity. Constant
/// friction has none, and a matrix without stiffness along a shear band cannot be factored safely. A larger
/// value makes corrections too short: with 1, those of a shear band without internal length were a
/// twentieth of what was needed.
const SLOPE: f64 = 0.01;

/// Viscosity at a rate and a pressure, and its derivative with respect to the rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viscosity {
    /// `eta`, Pa s.
    pub value: f64,
    /// `d eta/dg`, Pa s2; zero where a bound holds, and such that the derivative of the stress is
    /// nowhere below a hundredth of the smallest viscosity.
    pub slope: f64,
}

impl FlowCurve {
    /// Whether the stress depends on the pressure.
    pub fn depends_on_pressure(&self) -> bool {
        self.friction().is_some()
    }

    /// Friction, if it determines the stress.
    pub fn friction(&self) -> Option<&Friction> {
        match &self.strength {
            Strength::Friction(friction) => Some(friction),
            Strength::HerschelBulkley { .. } => None,
        }
    }

    /// Shear stress without the bounds of the viscosity, Pa, and its derivative with respect to the
    /// rate, Pa s.
    pub fn stress(&self, g: f64, p: f64) -> (f64, f64) {
        match &self.strength {
            Strength::HerschelBulkley { yield_stress, consistency, index } => {
                let viscous = consistency * g.powf(*index);
                let slope = if g > 0.0 { index * viscous / g } else { 0.0 };
                (yield_stress + viscous, slope)
            }
            Strength::Friction(f) => {
                let p = p.max(0.0);
                if p == 0.0 {
                    return (f.cohesion, 0.0);
                }
                let per_rate = f.inertial_number(1.0, p);
                let (mu, slope) = f.coefficient(per_rate * g);
                (f.cohesion + mu * p, p * slope * per_rate)
            }
        }
    }

    /// Viscosity at the rate `g` and the pressure `p`.
    pub fn viscosity(&self, g: f64, p: f64) -> Viscosity {
        let (stress, slope) = self.stress(g, p);
        if stress >= self.largest * g {
            Viscosity { value: self.largest, slope: 0.0 }
        } else if stress <= self.smallest * g {
            Viscosity { value: self.smallest, slope: 0.0 }
        } else {
            let value = stress / g;
            Viscosity { value, slope: (slope.max(SLOPE * self.smallest) - value) / g }
        }
    }

    /// Rate at which the material yields: that at which its stress is the largest viscosity times the
    /// rate. For a power law without yield stress it is approximate.
    pub fn yield_rate(&self, p: f64) -> f64 {
        const ITERATIONS: usize = 6;
        let start = self.stress(1e-3, p).0 / self.largest;
        (0..ITERATIONS).fold(start, |g, _| self.stress(g, p).0 / self.largest)
    }

    /// Whether the material yields: its viscosity is below the largest.
    pub fn yields(&self, g: f64, p: f64) -> bool {
        self.stress(g, p).0 < self.largest * g
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The constants of the exact cases in `verify`, and those of Lagree, Staron and Popinet 2011.
    const EXACT: Friction = Friction {
        at_rest: 0.38,
        fast: 0.64,
        inertial_number: 0.279,
        diameter: 0.04,
        grain_density: 1.0 / 0.6,
        cohesion: 0.0,
    };
    const PUBLISHED: Friction = Friction {
        at_rest: 0.32,
        fast: 0.60,
        inertial_number: 0.4,
        diameter: 1.0 / 30.0,
        grain_density: 1.0,
        cohesion: 0.0,
    };

    fn curves() -> [FlowCurve; 4] {
        let bounds = |strength| FlowCurve { strength, smallest: 1e-3, largest: 1e4 };
        let mud = |n: f64, yield_stress: f64| {
            bounds(Strength::HerschelBulkley { yield_stress, consistency: 2.0, index: n })
        };
        let sticky = Friction { cohesion: 0.3, ..EXACT };
        [mud(1.0, 1.0), mud(0.5, 0.2), mud(1.5, 0.0), bounds(Strength::Friction(sticky))]
    }

    #[test]
    fn the_stress_rises_with_the_rate() {
        for curve in curves() {
            for p in [1e-3, 1.0, 1e3] {
                let stress = |g: f64| curve.viscosity(g, p).value * g;
                let mut g = 1e-9;
                while g < 1e6 {
                    assert!(stress(1.01 * g) > stress(g), "{curve:?} {g} {p}");
                    g *= 1.3;
                }
            }
        }
    }

    #[test]
    fn the_slope_is_the_derivative() {
        for curve in curves() {
            for p in [0.1, 1.0, 30.0] {
                for g in [1e-3, 0.1, 3.0, 100.0] {
                    let eta = curve.viscosity(g, p);
                    if eta.value == curve.largest || eta.value == curve.smallest {
                        assert_eq!(eta.slope, 0.0);
                        continue;
                    }
                    let step = 1e-5 * g;
                    let [low, high] = [g - step, g + step].map(|g| curve.viscosity(g, p).value);
                    let slope = (high - low) / (2.0 * step);
                    let slope = slope.max((SLOPE * curve.smallest - eta.value) / g);
                    assert!((slope / eta.slope - 1.0).abs() < 1e-6, "{curve:?} {g} {p}");
                }
            }
        }
    }

    #[test]
    fn grains_bear_no_tension_and_yield_at_static_friction() {
        let curve = FlowCurve { strength: Strength::Friction(EXACT), smallest: 1e-6, largest: 1e6 };
        assert_eq!(curve.viscosity(1.0, -2.0).value, 1e-6);
        assert_eq!(curve.viscosity(0.0, 1.0).value, 1e6);
        let slow = curve.viscosity(1e-5, 2.0).value * 1e-5;
        assert!((slow - 2.0 * 0.38).abs() < 1e-4);
        let fast = curve.viscosity(1e5, 2.0).value * 1e5;
        assert!((fast - 2.0 * 0.64).abs() < 1e-3);
    }

    #[test]
    fn the_well_posed_range_is_the_published_one() {
        for (friction, range) in [(EXACT, [0.019, 0.863]), (PUBLISHED, [0.0136, 1.81])] {
            let found = friction.well_posed_range().unwrap();
            for (a, b) in found.iter().zip(range) {
                assert!((a / b - 1.0).abs() < 0.02, "{found:?}");
            }
        }
        let constant = Friction { fast: 0.38, ..EXACT };
        assert_eq!(constant.well_posed_range(), None);
    }
}
