//! Reads runs back: from their folders, recordings or summaries, for comparisons, exports and figures.

mod member;
pub mod table;

pub use member::{Kind, Member, ResultsError, open_all};

/// Relative difference below which times are equal.
pub const SAME_TIME: f64 = 1e-9;

/// Whether a time is later than another by more than rounding.
pub fn later(a: f64, b: f64) -> bool {
    a > b + SAME_TIME * a.abs()
}
