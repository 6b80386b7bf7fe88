//! This module chooses the units in which a scene is solved from the values in the scene.

use super::materials::SiMatter;
use super::values::{Result, edge, finite_range, middle};
use crate::plan::Units;
use crate::plan::units::power_of_two;
use crate::scene::{Field, Scene, Scope};

/// Units of length, viscosity, time and density, from the values in the scene.
pub(super) fn choose_units(
    scene: &Scene,
    scope: &Scope,
    si: &SiMatter,
    domain: [[f64; 2]; 2],
    length: f64,
) -> Result<Units> {
    let mut viscosity = si.materials.iter().map(|m| m.viscosity).fold(0.0, f64::max);
    let density = si.materials.iter().map(|m| m.density).fold(0.0, f64::max);
    let gravity = si.gravity[0].hypot(si.gravity[1]);
    if scene.inertia {
        // The velocity of free fall, if viscosity does not slow it.
        viscosity = viscosity.max(density * (gravity * length.powi(3)).sqrt());
    }
    let mut rate = density * gravity * length / viscosity;
    let largest = |f: &Field, place: [[f64; 2]; 2]| -> Result<f64> {
        let range = finite_range(f, &f.compile(scope)?, place, "this value")?;
        Ok(range[0].abs().max(range[1].abs()))
    };
    let b = &scene.boundaries;
    for (s, side) in b.sides().into_iter().enumerate() {
        let largest = |f: &Field| largest(f, edge(domain, s));
        for given in side.all_given() {
            for v in given.velocity.into_iter().flatten() {
                rate = rate.max(largest(v)? / length);
            }
            for t in given.traction.into_iter().flatten() {
                rate = rate.max(largest(t)? / viscosity);
            }
            if let Some(w) = given.rotation {
                rate = rate.max(largest(w)?);
            }
        }
    }
    for source in &scene.sources {
        rate = rate.max(source.speed.eval(scope)?.abs() / length);
    }
    if let Some(f) = &scene.body_force {
        rate = rate.max(largest(&f.x, domain)?.max(largest(&f.y, domain)?) * length / viscosity);
        rate = rate.max(largest(&f.couple, domain)? / viscosity);
    }
    if let Some(a) = &scene.acceleration {
        let inside = middle(domain);
        let size = largest(&a.x, inside)?.max(largest(&a.y, inside)?);
        rate = rate.max(density * size * length / viscosity);
    }
    let end = scene.time.end()?.eval(scope)?;
    let time = match [1.0 / rate, end] {
        [time, _] if time.is_finite() => time,
        [_, end] if end > 0.0 => end,
        _ => 1.0,
    };
    let length = power_of_two(length);
    Ok(Units {
        length,
        viscosity: power_of_two(viscosity),
        time: power_of_two(time),
        density: power_of_two(density),
        depth: if scene.domain.geometry.is_round() { length } else { 1.0 },
    })
}
