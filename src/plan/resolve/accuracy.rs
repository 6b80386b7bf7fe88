//! This module resolves `[accuracy]`.

use super::values::Result;
use crate::plan::Method;
use crate::scene::{Scene, SceneError};
use crate::space::seeding::Seeding;

/// Largest number of corrections of a solution.
const MOST_CORRECTIONS: u32 = 10_000;

/// Settings of the numerical method.
pub(super) fn method(scene: &Scene) -> Result<Method> {
    let a = &scene.accuracy;
    let side = f64::from(a.particles_per_cell).sqrt().round() as usize;
    if side == 0 || side * side != a.particles_per_cell as usize || side > 32 {
        return Err(SceneError::of_key(
            "accuracy.particles_per_cell",
            format!("accuracy.particles_per_cell is {}", a.particles_per_cell),
            "give a square number from 1 to 1024: 9, 16, 25, ...",
        ));
    }
    if !(a.tolerance >= 1e-14 && a.tolerance <= 1e-2) {
        return Err(SceneError::of_key(
            "accuracy.tolerance",
            format!("accuracy.tolerance is {}", a.tolerance),
            "give 1e-14 to 1e-2; 1e-12 is the limit of double precision in stiff scenes",
        ));
    }
    if !(a.nonlinear_tolerance >= 1e-10 && a.nonlinear_tolerance <= 0.1) {
        return Err(SceneError::of_key(
            "accuracy.nonlinear_tolerance",
            format!("accuracy.nonlinear_tolerance is {}", a.nonlinear_tolerance),
            "give 1e-10 to 0.1; 1e-3 is usual",
        ));
    }
    if !(0.0..=2.0).contains(&a.stabilisation) {
        return Err(SceneError::of_key(
            "accuracy.stabilisation",
            format!("accuracy.stabilisation is {}", a.stabilisation),
            "give a fraction of a step, 0.6 to 1, or 0 to switch it off; 0.75 is usual",
        ));
    }
    if !(1..=MOST_CORRECTIONS).contains(&a.max_corrections) {
        return Err(SceneError::of_key(
            "accuracy.max_corrections",
            format!("accuracy.max_corrections is {}", a.max_corrections),
            format!("give 1 to {MOST_CORRECTIONS}; 40 is usual"),
        ));
    }
    Ok(Method {
        seeding: Seeding { side, placement: a.placement, seed: a.seed },
        quadrature: a.quadrature,
        integrator: a.integrator,
        stabilisation: None,
        tolerance: a.tolerance,
        nonlinear_tolerance: a.nonlinear_tolerance,
        max_corrections: a.max_corrections,
    })
}
