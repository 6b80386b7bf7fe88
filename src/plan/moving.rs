//! This module moves solids: their velocities as functions of time, and the plan with the solids at other
//! places.

use super::Plan;
use super::resolve;
use crate::scene::{FieldFn, SceneError};
use crate::space::shape::{GAUSS_3, GAUSS_3_WEIGHTS};

/// Number of pieces of a step in which a velocity that varies is integrated.
const PIECES: usize = 16;

/// A block that moves, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Moving {
    /// Name of the block.
    pub name: String,
    /// Velocity along x and y, m/s, as functions of the time in s, the first argument.
    pub velocity: [FieldFn; 2],
}

/// Place and velocity of a block that moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Displacement from its place in the scene, m.
    pub displacement: [f64; 2],
    /// Velocity, m/s.
    pub velocity: [f64; 2],
}

impl Moving {
    /// Velocity at a time, s.
    pub fn velocity_at(&self, time: f64) -> [f64; 2] {
        self.velocity.each_ref().map(|v| v.at(time, 0.0))
    }

    /// Displacement from one time to another, s: exact for a constant velocity, otherwise by
    /// Gauss's rule of three points in each of some pieces.
    pub fn displacement(&self, from: f64, to: f64) -> [f64; 2] {
        let piece = (to - from) / PIECES as f64;
        self.velocity.each_ref().map(|v| {
            if let Some(v) = v.constant() {
                return v * (to - from);
            }
            let at = |k: usize, g: f64| v.at(from + piece * (k as f64 + 0.5 + 0.5 * g), 0.0);
            let points = GAUSS_3.iter().zip(GAUSS_3_WEIGHTS);
            let mean = |k: usize| points.clone().map(|(g, w)| w * at(k, *g)).sum::<f64>();
            (0..PIECES).map(|k| piece * mean(k)).sum()
        })
    }
}

impl Pose {
    /// Places of blocks that move, at the start.
    pub(super) fn at_start(moving: &Moving) -> Pose {
        Pose { displacement: [0.0; 2], velocity: moving.velocity_at(0.0) }
    }
}

impl Plan {
    /// The plan with the blocks that move at other places, in the order of [`Plan::moving`].
    ///
    /// # Errors
    /// The velocity of a block is not finite, or the flow is impossible with the blocks there.
    pub fn posed(&self, poses: &[Pose]) -> Result<Plan, SceneError> {
        for (moving, pose) in self.moving.iter().zip(poses) {
            if !pose.velocity.iter().chain(&pose.displacement).all(|v| v.is_finite()) {
                let [x, y] = pose.velocity;
                return Err(SceneError::of_key(
                    "blocks",
                    format!("block `{}` has the velocity ({x}, {y}) m/s", moving.name),
                    "make its velocity finite at all times of the run",
                ));
            }
        }
        let there = resolve::posed(&self.scene, poses)?;
        Ok(Plan {
            mesh: there.mesh,
            boundary: there.boundary,
            enclosure: there.enclosure,
            forces: there.forces,
            poses: poses.to_vec(),
            ..self.clone()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Quantity, Scope};

    #[test]
    fn displacements_are_integrals_of_velocities() {
        let scope = Scope::from_values([("v", 0.5)]);
        let compile = |text: &str| Quantity::expression(text).in_time(&scope).expect("valid");
        let velocity = [compile("v"), compile("v*(1 + sin(3*t))")];
        let moving = Moving { name: "gate".into(), velocity };
        let [x, y] = moving.displacement(1.0, 1.5);
        let exact = 0.5 * (0.5 - ((4.5f64).cos() - 3f64.cos()) / 3.0);
        assert!(x == 0.25 && (y - exact).abs() < 1e-9, "{x} {y} {exact}");
        assert_eq!(moving.velocity_at(0.0), [0.5, 0.5]);
        assert!(Quantity::expression("x").in_time(&scope).is_err());
        let named = Scope::from_values([("t", 0.5)]);
        assert!(Quantity::expression("2*t").in_time(&named).is_err());
    }
}
