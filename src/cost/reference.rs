//! What errors are measured against: an exact solution, or a ladder of finer settings.
//!
//! Three rungs refine every knob by the ratio `r`. With values `q0` (coarse), `q1`, `q2`
//!
//! ```text
//! r^p = |q1 - q0| / |q2 - q1|        q* = q2 + (q2 - q1)/(r^p - 1)        (Richardson)
//! ```
//! Where the differences shrink at a believable rate, `q*` is the reference and half of what was
//! added to `q2` its uncertainty (rates above 2 are taken as 2); else `q2` is, and its uncertainty
//! is the larger difference.

use super::measure::Target;
use serde::{Deserialize, Serialize};

/// Rates that are believed.
const RATES: [f64; 2] = [0.5, 4.5];

/// Extrapolation takes no faster rate than this: three rungs often seem to converge faster than
/// they do, and a fast rate would call its own result certain.
const FASTEST: f64 = 2.0;

/// Where the reference is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Exact,
    /// Richardson extrapolation of three rungs.
    Extrapolated,
    /// The finest of three rungs: they do not converge regularly.
    Finest,
}

/// A reference and how far it may be off.
#[derive(Clone, Debug)]
pub struct Reference {
    pub kind: Kind,
    pub value: Vec<f64>,
    /// Norm of the value, no less than the floor: errors are relative to it.
    pub scale: f64,
    /// Relative.
    pub uncertainty: f64,
    /// Observed between the rungs.
    pub rate: Option<f64>,
}

impl Reference {
    /// An exact value.
    pub fn exact(value: Vec<f64>, target: &Target) -> Reference {
        let scale = target.size(value.iter().copied()).max(target.floor);
        Reference { kind: Kind::Exact, value, scale, uncertainty: 0.0, rate: None }
    }

    /// From three rungs, coarse to fine, each finer by `ratio`.
    pub fn ladder(rungs: [&[f64]; 3], ratio: f64, target: &Target) -> Reference {
        let [q0, q1, q2] = rungs;
        let scale = target.size(q2.iter().copied()).max(target.floor);
        let (coarse, fine) = (target.distance(q0, q1, scale), target.distance(q1, q2, scale));
        let rate = (coarse / fine).ln() / ratio.ln();
        let rate = rate.is_finite().then_some(rate);
        if fine < 1e-14 {
            // Nothing changes: exact as far as anyone can tell.
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
                // A rate too good to be true is luck: the small last difference too.
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
    fn extrapolates_a_regular_ladder() {
        let q = |h: f64| [2.0 + 0.3 * h * h];
        let found = Reference::ladder([&q(1.5), &q(1.0), &q(1.0 / 1.5)], 1.5, &target());
        assert_eq!(found.kind, Kind::Extrapolated);
        assert!((found.value[0] - 2.0).abs() < 1e-12, "{found:?}");
        assert!(found.rate.is_some_and(|p| (p - 2.0).abs() < 1e-9));
        let left = 0.3 / 2.25 / 2.0;
        assert!((found.uncertainty - 0.5 * left).abs() < 1e-12);
    }

    #[test]
    fn distrusts_an_irregular_one() {
        let found = Reference::ladder([&[1.0], &[1.1], &[0.9]], 2.0, &target());
        assert_eq!(found.kind, Kind::Finest);
        assert_eq!(found.value, [0.9]);
        assert!((found.uncertainty - 0.2 / 0.9).abs() < 1e-12);
        let still = Reference::ladder([&[1.0], &[1.0], &[1.0]], 2.0, &target());
        assert_eq!(still.uncertainty, 0.0);
    }
}
