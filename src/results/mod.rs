//! This module reads the results of runs from their folders, recordings or summaries, for
//! comparisons, exports and figures.

mod member;
pub mod table;

pub use member::{Kind, Member, ResultsError, open_all};

/// Relative difference up to which two times count as equal.
pub const SAME_TIME: f64 = 1e-9;

/// Whether time `a` is later than time `b` by more than rounding errors.
pub fn later(a: f64, b: f64) -> bool {
    a > b + SAME_TIME * a.abs()
}
