//! The reference against which errors are measured: an exact solution, or one extrapolated from
//! three resolutions.
//!
//! The three resolutions differ by the ratio `r` in every knob. With values `q0` (coarse), `q1`,
//! `q2`
//!
//! ```text
//! r^p = |q1 - q0| / |q2 - q1|        q* = q2 + (q2 - q1)/(r^p - 1)        (Richardson)
//! ```
//! If the rate `p` is plausible, `q*` is the reference, and half of its difference to `q2` is the
//! uncertainty (rates above 2 are taken as 2). Otherwise `q2` is the reference, and the larger of
//! the two differences is the uncertainty.

use super::measure::Target;
use serde::{Deserialize, Serialize};

/// Range of plausible convergence rates.
const RATES: [f64; 2] = [0.5, 4.5];

/// Largest rate used for extrapolation: three resolutions often seem to converge faster than they
/// do, and a large rate would underestimate the uncertainty.
const FASTEST: f64 = 2.0;

/// Origin of the reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// An exact solution.
    Exact,
    /// Richardson extrapolation of three resolutions.
    Extrapolated,
    /// The finest of three resolutions, which do not converge at a plausible rate.
    Finest,
}

/// A reference and its uncertainty.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Origin of the reference.
    pub kind: Kind,
    /// One number, or a field at the sample points; SI units.
    pub value: Vec<f64>,
    /// Scale of relative errors: the norm of the value, but at least [`Target::floor`]; SI units.
    pub scale: f64,
    /// Relative uncertainty.
    pub uncertainty: f64,
    /// Observed convergence rate, if it is finite.
    pub rate: Option<f64>,
}

impl Reference {
    /// A reference from an exact value.
    pub fn exact(value: Vec<f64>, target: &Target) -> Reference {
        let scale = target.size(value.iter().copied()).max(target.floor);
        Reference { kind: Kind::Exact, value, scale, uncertainty: 0.0, rate: None }
    }

    /// A reference from three resolutions, coarse to fine, each finer by `ratio`.
    pub fn ladder(rungs: [&[f64]; 3], ratio: f64, target: &Target) -> Reference {
        let [q0, q1, q2] = rungs;
        let scale = target.size(q2.iter().copied()).max(target.floor);
        let (coarse, fine) = (target.distance(q0, q1, scale), target.distance(q1, q2, scale));
        let rate = (coarse / fine).ln() / ratio.ln();
        let rate = rate.is_finite().then_some(rate);
        if fine < 1e-14 {
            // The value no longer changes.
            return Reference {
                kind: Kind::Extrapolated,
                value: q2.to_vec(),
                scale,
                uncertainty: fine,
                rate,
            };
        }
        match rate {
            Some(p) if (RATES[0]..=RATES[1]).contains(&p) => {
                let more = 1.0 / (ratio.powf(p.min(FASTEST)) - 1.0);
                let value: Vec<f64> =
                    q2.iter().zip(q1).map(|(fine, coarse)| fine + more * (fine - coarse)).collect();
                let scale = target.size(value.iter().copied()).max(target.floor);
                let uncertainty = 0.5 * target.distance(&value, q2, scale);
                Reference { kind: Kind::Extrapolated, value, scale, uncertainty, rate }
            }
            _ => Reference {
                kind: Kind::Finest,
                value: q2.to_vec(),
                scale,
                // After an implausibly fast rate the small last difference is a coincidence.
                uncertainty: fine.max(coarse),
                rate,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Interesting, Moment, Norm};

    fn target() -> Target {
        Target { quantity: Interesting::RmsSpeed, at: Moment::End, norm: Norm::L2, floor: 0.0 }
    }

    #[test]
    fn regular_convergence_is_extrapolated() {
        let q = |h: f64| [2.0 + 0.3 * h * h];
        let found = Reference::ladder([&q(1.5), &q(1.0), &q(1.0 / 1.5)], 1.5, &target());
        assert_eq!(found.kind, Kind::Extrapolated);
        assert!((found.value[0] - 2.0).abs() < 1e-12, "{found:?}");
        assert!(found.rate.is_some_and(|p| (p - 2.0).abs() < 1e-9));
        let left = 0.3 / 2.25 / 2.0;
        assert!((found.uncertainty - 0.5 * left).abs() < 1e-12);
    }

    #[test]
    fn irregular_convergence_keeps_the_finest_resolution() {
        let found = Reference::ladder([&[1.0], &[1.1], &[0.9]], 2.0, &target());
        assert_eq!(found.kind, Kind::Finest);
        assert_eq!(found.value, [0.9]);
        assert!((found.uncertainty - 0.2 / 0.9).abs() < 1e-12);
        let still = Reference::ladder([&[1.0], &[1.0], &[1.0]], 2.0, &target());
        assert_eq!(still.uncertainty, 0.0);
    }
}
