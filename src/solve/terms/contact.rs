//! This module holds the law of friction at a point of a wall along which material slips; the equations
//! are those of [`slip`](super::slip).

use crate::plan::slip::WallLaw;

/// Smallest share of the resistance that the matrix has where material slides, so that friction alone
/// can hold a body.
const LEAST: f64 = 1e-3;

/// What is beside a piece of a wall.
#[derive(Clone, Copy, Debug, Default)]
pub struct Beside {
    /// Mean viscosity of the cell.
    pub viscosity: f64,
    /// Largest resistance to slip, for friction.
    pub largest: f64,
    /// Volume fraction of the materials that rub: all but the background.
    pub share: f64,
}

/// Friction at a point of a wall.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contact {
    /// Force per area and velocity, `r`.
    pub(super) resistance: f64,
    /// Slip `s`.
    slip: f64,
    /// `m`; zero without friction.
    effective: f64,
    /// Direction `q`.
    direction: f64,
    /// Viscous normal stress `tau_nn`.
    normal: f64,
    /// Normal stress `N` on the wall.
    pub(super) pressing: f64,
}

impl Contact {
    fn slides(&self) -> bool {
        self.effective > 0.0 && self.slip.abs() >= self.effective
    }

    /// Evaluates a law; `here`: slip and pressure at the point, if a flow is known.
    pub(super) fn evaluate(&mut self, law: WallLaw, beside: &Beside, here: Option<(f64, f64)>) {
        let coefficient = match law {
            WallLaw::Slip { length } => {
                self.resistance = beside.viscosity / length;
                return;
            }
            WallLaw::Friction { coefficient } => coefficient,
        };
        // Without a flow, everything sticks.
        self.resistance = beside.largest;
        let Some((slip, pressure)) = here else { return };
        self.slip = slip;
        self.pressing = (pressure - self.normal).max(0.0);
        let strength = coefficient * beside.share * self.pressing;
        let sticks = strength / beside.largest;
        self.effective = self.slip.abs().max(sticks);
        self.resistance = if self.effective > 0.0 { strength / self.effective } else { 0.0 };
    }

    /// The entry of the matrix, force per area and velocity.
    pub(super) fn tangent(&self) -> f64 {
        if self.slides() {
            let along = (1.0 - self.direction * self.slip.signum()).max(LEAST);
            self.resistance * along
        } else {
            self.resistance
        }
    }

    /// Takes a share of the change of the viscous normal stress.
    pub(super) fn press(&mut self, share: f64, normal: f64) {
        self.normal += share * (normal - self.normal);
    }

    /// Gives the friction the direction of the slip.
    pub(super) fn align(&mut self) {
        self.direction = if self.effective > 0.0 { self.slip / self.effective } else { 0.0 };
    }

    /// Advances the direction after the share `share` of a correction; `before`: the contact before it.
    pub(super) fn turn(&mut self, before: &Contact, share: f64) {
        if before.effective == 0.0 {
            return;
        }
        let (q, change) = (before.direction, self.slip - before.slip);
        let turn = if before.slides() { before.slip.signum() * change } else { 0.0 };
        let step = change - turn * q + share * (before.slip - q * before.effective);
        let next = q + step / before.effective;
        self.direction = if next.is_finite() { next.clamp(-1.0, 1.0) } else { 0.0 };
    }
}
