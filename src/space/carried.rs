//! This module changes the fields that particles carry when population control moves them.

use super::fit::{Degree, Fit, Polynomial};
use super::mesh::Mesh;
use super::particles::Particles;

/// Polynomials of the fields that particles of one material carry in a cell. A particle that is
/// moved without flow gets the difference of the field between its two positions added. Otherwise a
/// child would keep its parent's density at a position with another density, a first-order error.
pub(super) struct CarriedFields<'a> {
    density: Option<Polynomial>,
    log_viscosity: Option<Polynomial>,
    /// Positions before the move, in reference coordinates.
    places: &'a [[f64; 2]],
}

impl<'a> CarriedFields<'a> {
    /// Fits the fields of the particles `kin`; `places` is a buffer for their positions.
    pub(super) fn new(
        mesh: &Mesh,
        particles: &Particles,
        cell: usize,
        kin: &[usize],
        places: &'a mut Vec<[f64; 2]>,
    ) -> Self {
        places.clear();
        places.extend(kin.iter().map(|&p| mesh.to_reference(cell, particles.position[p])));
        let fit = |value: &dyn Fn(usize) -> f64| {
            let mut fit = Fit::default();
            for (&p, &r) in kin.iter().zip(&*places) {
                fit.add(particles.volume[p], r, value(p));
            }
            fit.solve(Degree::Quadratic)
        };
        CarriedFields {
            density: particles.density.as_ref().and_then(|d| fit(&|p| d[p])),
            log_viscosity: particles.viscosity.as_ref().and_then(|v| fit(&|p| v[p].ln())),
            places,
        }
    }

    /// Gives the particles `kin` the values at their positions now.
    pub(super) fn follow(
        &self,
        mesh: &Mesh,
        particles: &mut Particles,
        cell: usize,
        kin: &[usize],
    ) {
        for (&p, &before) in kin.iter().zip(self.places) {
            let now = mesh.to_reference(cell, particles.position[p]);
            let change = |f: &Polynomial| f.at_bounded(now) - f.at_bounded(before);
            if let (Some(column), Some(f)) = (&mut particles.density, &self.density) {
                column[p] += change(f);
            }
            if let (Some(column), Some(f)) = (&mut particles.viscosity, &self.log_viscosity) {
                column[p] *= change(f).exp();
            }
        }
    }
}
