//! This module checks whether the machine has enough memory for a run.

use super::Failure;
use crate::plan::Plan;
use crate::plan::memory::{self, TooLarge};

/// Returns a failure if the plan needs more memory than is available.
pub fn afford(plan: &Plan) -> Result<(), Failure> {
    memory::afford(plan)
        .map_err(|e| Failure::Environment(format!("{e}\n  help: {}", TooLarge::REMEDY)))
}
