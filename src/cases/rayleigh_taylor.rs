//! This module compares growth rates with the linear theory of the Rayleigh-Taylor instability of
//! two viscous layers.

use super::{CaseError, start};
use crate::scene::SceneSource;
use std::f64::consts::PI;

/// Two layers between no-slip plates, with free slip (or symmetry) at the sides, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layers {
    /// The upper layer.
    pub upper: Layer,
    /// The lower layer.
    pub lower: Layer,
    /// Wavelength of the undulation, m.
    pub wavelength: f64,
    /// Downward gravity, m/s2.
    pub gravity: f64,
}

/// A viscous layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Thickness, m.
    pub thickness: f64,
    /// Shear viscosity, Pa s.
    pub viscosity: f64,
    /// Density, kg/m3.
    pub density: f64,
}

/// Growth rate, 1/s, of a small undulation of the interface, by Ramberg (1968, Phys. Earth Planet.
/// Inter. 1, 63-67), in the form of Gerya (2010, Introduction to Numerical Geodynamic Modelling,
/// section 16.2). It is negative if the denser layer is below.
///
/// ```text
/// rate = K (rho_1 - rho_2) g h_2 / (2 eta_2),   K = -d12 / (c11 j22 - d12 i21),
/// phi_i = 2 pi h_i / wavelength,   q_i = cosh 2 phi_i - 1 - 2 phi_i^2,   r = eta_1 / eta_2
/// c11 = 2 r phi_1^2/q_1 - 2 phi_2^2/q_2
/// d12 = r (sinh 2 phi_1 - 2 phi_1)/q_1 + (sinh 2 phi_2 - 2 phi_2)/q_2
/// i21 = r phi_2 (sinh 2 phi_1 + 2 phi_1)/q_1 + phi_2 (sinh 2 phi_2 + 2 phi_2)/q_2
/// j22 = 2 r phi_1^2 phi_2/q_1 - 2 phi_2^3/q_2
/// ```
/// where 1 is the upper and 2 the lower layer. The rate agrees to rounding with the solution of the
/// fourth-order equations of the vertical velocities of the layers, matched at the interface
/// (velocity, shear stress, and a normal stress that jumps by the weight of the undulation).
pub fn ramberg_growth_rate(layers: &Layers) -> f64 {
    let Layers { upper, lower, wavelength, gravity } = layers;
    let r = upper.viscosity / lower.viscosity;
    let phi = [upper, lower].map(|l| 2.0 * PI * l.thickness / wavelength);
    // Hyperbolic functions are divided by exp(2 phi) because they overflow for thick layers.
    let scaled = phi.map(|p| {
        let (decay, c) = ((-2.0 * p).exp(), 0.5 * (1.0 + (-4.0 * p).exp()));
        let (s, one) = (0.5 * (1.0 - (-4.0 * p).exp()), decay);
        (c, s, one)
    });
    let part = |k: usize| {
        let (p, (c, s, one)) = (phi[k], scaled[k]);
        let q = c - one * (1.0 + 2.0 * p * p);
        let square = 2.0 * p * p * one / q;
        ((s - 2.0 * p * one) / q, (s + 2.0 * p * one) / q, square)
    };
    let ((minus_1, plus_1, square_1), (minus_2, plus_2, square_2)) = (part(0), part(1));
    let c11 = r * square_1 - square_2;
    let d12 = r * minus_1 + minus_2;
    let i21 = phi[1] * (r * plus_1 + plus_2);
    let j22 = phi[1] * (r * square_1 - square_2);
    let k = -d12 / (c11 * j22 - d12 * i21);
    k * (upper.density - lower.density) * gravity * lower.thickness / (2.0 * lower.viscosity)
}

/// A light layer of thickness 0.2 below a heavy layer in a box of height 1. The heavy fluid has
/// density and viscosity 1, and gravity is 1.
#[derive(Clone, Copy, Debug)]
pub struct Undulation {
    /// Wavelength of the undulation.
    pub wavelength: f64,
    /// Viscosity of the light layer over the viscosity of the heavy layer.
    pub viscosity: f64,
    /// Amplitude of the undulation.
    pub amplitude: f64,
}

/// Computed growth rate of the first Fourier mode of the interface over the rate of linear theory.
/// `sets`: further assignments `name=value`.
///
/// # Errors
/// The scene is invalid, or the initial flow cannot be solved for.
pub fn growth_ratio(u: Undulation, cells: u32, sets: &[&str]) -> Result<f64, CaseError> {
    const THICKNESS: f64 = 0.2;
    let Undulation { wavelength, viscosity, amplitude } = u;
    let text = format!(
        "schema = 1\nname = \"growth\"\ngravity = [0, -1]\n[domain]\nx = [0, \"{wavelength}/2\"]\n\
         y = [0, 1]\nlength_scale = 1\n[accuracy]\ncells = {cells}\n[time]\nend = 1\n\
         [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n\
         [materials.light]\nshear_viscosity = {viscosity}\n\
         [[regions]]\nmaterial = \"heavy\"\n[[regions]]\nmaterial = \"light\"\n\
         shape.where = \"y < {THICKNESS} + {amplitude}*cos(2*pi*x/{wavelength})\"\n\
         [boundaries]\nbottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\n"
    );
    let sets: Vec<String> = sets.iter().map(ToString::to_string).collect();
    let source = SceneSource::new("growth", text).with_sets(&sets)?;
    let run = start(&source)?;
    let layer = |thickness, viscosity, density| Layer { thickness, viscosity, density };
    let theory = ramberg_growth_rate(&Layers {
        upper: layer(1.0 - THICKNESS, 1.0, 1.0),
        lower: layer(THICKNESS, viscosity, 0.0),
        wavelength,
        gravity: 1.0,
    });
    // First Fourier coefficient of the velocity along the interface.
    const POINTS: u32 = 64;
    let mode: f64 = (0..POINTS)
        .map(|k| {
            let phase = PI * (f64::from(k) + 0.5) / f64::from(POINTS);
            let x = phase * wavelength / (2.0 * PI);
            run.velocity_at([x, THICKNESS])[1] * phase.cos() * 2.0 / f64::from(POINTS)
        })
        .sum();
    Ok(mode / amplitude / theory)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(lower: f64, viscosities: [f64; 2], wavelength: f64) -> f64 {
        let layer = |thickness, viscosity, density| Layer { thickness, viscosity, density };
        ramberg_growth_rate(&Layers {
            upper: layer(1.0 - lower, viscosities[0], 1.0),
            lower: layer(lower, viscosities[1], 0.0),
            wavelength,
            gravity: 1.0,
        })
    }

    #[test]
    fn known_rates_are_met() {
        // From an independent solution of the matched equations of the layers.
        for (lower, viscosities, wavelength, expected) in [
            (0.2, [1.0, 1.0], 1.8284, 0.0109401891382),
            (0.2, [1.0, 0.1], 1.8284, 0.0470548392182),
            (0.2, [1.0, 0.01], 0.5, 0.0392789809518),
            (0.2, [1.0, 100.0], 3.0, 8.8187481091e-5),
        ] {
            let found = rate(lower, viscosities, wavelength);
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn short_waves_see_no_walls() {
        // Rate of two half-spaces: delta rho g / (2 k (eta_1 + eta_2)).
        let k = 2.0 * PI / 0.02;
        let expected = 1.0 / (2.0 * k * (1.0 + 3.0));
        assert!((rate(0.5, [1.0, 3.0], 0.02) / expected - 1.0).abs() < 1e-9);
    }

    #[test]
    fn mirrored_layers_grow_at_the_same_rate() {
        let (up, down) = (rate(0.3, [2.0, 5.0], 1.1), rate(0.7, [5.0, 2.0], 1.1));
        assert!((up / down - 1.0).abs() < 1e-9, "{up} {down}");
    }
}
