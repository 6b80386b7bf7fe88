//! Verification: measures the errors of all cases with a known solution, and compares them with
//! published numbers.
//!
//! `grainscope verify` prints and writes the report of [`run`]. The tests run the quick version of
//! the same functions.

mod axisymmetric;
mod corners;
mod cut_cells;
mod elements;
mod flow_curves;
mod free_surfaces;
mod inertia;
mod layers;
mod rayleigh_taylor;
mod report;
mod rest;
mod slits;
mod smooth;
mod solids;
mod texture;
mod transport;

pub use report::{Bound, Check, Figure, Report, Section, Table, number, rate};

use crate::cases::CaseError;

/// Amount of computation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// Takes less than a minute: coarse meshes, few seeds.
    Quick,
    /// The results shown in `docs/verification.md`.
    Full,
}

impl Effort {
    /// The elements of a list that this effort uses: the first half of it if quick.
    fn take<'a, T>(&self, all: &'a [T]) -> &'a [T] {
        match self {
            Effort::Quick => &all[..all.len().div_ceil(2)],
            Effort::Full => all,
        }
    }
}

/// Function that verifies a subject.
type Subject = fn(Effort) -> Result<Section, CaseError>;

/// All subjects: name on the command line, and function.
pub const SUBJECTS: [(&str, Subject); 15] = [
    ("elements", elements::section),
    ("smooth", smooth::section),
    ("cut-cells", cut_cells::section),
    ("free-surfaces", free_surfaces::section),
    ("transport", transport::section),
    ("rest", rest::section),
    ("rayleigh-taylor", rayleigh_taylor::section),
    ("corners", corners::section),
    ("layers", layers::section),
    ("texture", texture::section),
    ("flow-curves", flow_curves::section),
    ("inertia", inertia::section),
    ("slits", slits::section),
    ("solids", solids::section),
    ("axisymmetric", axisymmetric::section),
];

/// Verifies the subjects with the given names, in the order of [`SUBJECTS`]. `announce` is called
/// with the name of each subject.
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
