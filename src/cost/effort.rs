//! How much is measured for a cost table.

use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// Amount of measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Takes less than two minutes: runs are shortened and few combinations are run.
    Quick,
    /// Runs are not shortened where one takes less than half a minute.
    Full,
}

/// Limits of an [`Effort`].
pub struct Limits {
    /// Longest CPU time of a run with the scene's own settings, s. Longer runs are shortened. The
    /// whole table takes about forty times as long.
    pub base: f64,
    /// Wall-clock time after which no new run is started, s.
    pub total: f64,
    /// Refinement ratio between the resolutions of the reference.
    pub ratio: f64,
    /// Numbers of cells relative to that of the scene; all coarser than the reference.
    pub factors: &'static [f64],
    /// The same as `factors`, for scenes with an exact solution, which need no finer reference.
    pub factors_exact: &'static [f64],
    /// Largest number of combinations run in a round.
    pub combinations: usize,
    /// Number of rounds of combinations.
    pub rounds: usize,
}

impl Effort {
    /// Limits of this amount of measurement.
    pub fn limits(self) -> Limits {
        match self {
            Effort::Quick => Limits {
                base: 1.0,
                total: 105.0,
                ratio: 1.5,
                factors: &[0.5, FRAC_1_SQRT_2, 1.0, 1.2],
                factors_exact: &[0.25, 0.5, FRAC_1_SQRT_2, 1.0, SQRT_2, 2.0],
                combinations: 7,
                rounds: 1,
            },
            Effort::Full => Limits {
                base: 25.0,
                total: 3600.0,
                ratio: 2.0,
                factors: &[0.25, 0.35, 0.5, FRAC_1_SQRT_2, 1.0, SQRT_2],
                factors_exact: &[0.25, 0.35, 0.5, FRAC_1_SQRT_2, 1.0, SQRT_2, 2.0, 2.83, 4.0],
                combinations: 12,
                rounds: 2,
            },
        }
    }
}
