//! Verification: every case with a known answer, measured, with the numbers others published
//! beside ours.
//!
//! `grainscope verify` prints and writes what [`run`] finds; the tests run the quick version of
//! the same functions.

mod corners;
mod cut_cells;
mod elements;
mod layers;
mod rayleigh_taylor;
mod report;
mod rest;
mod smooth;
mod texture;
mod transport;

pub use report::{Bound, Check, Figure, Report, Section, Table, number, rate};

use crate::cases::CaseError;

/// How much is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Under a minute: coarse meshes, one seed.
    Quick,
    /// What `docs/verification.md` shows.
    Full,
}

impl Effort {
    /// The resolutions of a list that this effort reaches: the coarse half of it if quick.
    fn take<'a, T>(&self, all: &'a [T]) -> &'a [T] {
        match self {
            Effort::Quick => &all[..all.len().div_ceil(2)],
            Effort::Full => all,
        }
    }
}

/// Verifies a subject.
type Subject = fn(Effort) -> Result<Section, CaseError>;

/// All subjects: name for the command line, and function.
pub const SUBJECTS: [(&str, Subject); 9] = [
    ("elements", elements::section),
    ("smooth", smooth::section),
    ("cut-cells", cut_cells::section),
    ("transport", transport::section),
    ("rest", rest::section),
    ("rayleigh-taylor", rayleigh_taylor::section),
    ("corners", corners::section),
    ("layers", layers::section),
    ("texture", texture::section),
];

/// Verifies the subjects of these names, in order.
pub fn run(
    names: &[&str],
    effort: Effort,
    mut announce: impl FnMut(&str),
) -> Result<Report, CaseError> {
    let mut report = Report::default();
    for (name, subject) in SUBJECTS.iter().filter(|s| names.contains(&s.0)) {
        announce(name);
        report.sections.push(subject(effort)?);
    }
    Ok(report)
}
