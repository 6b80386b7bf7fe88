//! This module computes the weight of the materials: `integral rho (g + a) . u~`, with gravity `g`
//! and an acceleration `a(x, y)` that is fixed in space.
//!
//! Densities come from [`density`](crate::solve::density) or, if particles are the integration
//! points, from the particles.

use crate::plan::Plan;
use crate::scene::Quadrature as Rule;
use crate::solve::density::Density;
use crate::solve::quadrature::Quadrature;

/// Points at which the densities of a cell are known.
#[derive(Clone, Copy)]
pub enum Masses<'a> {
    /// The Gauss points, with fitted densities.
    Fitted(&'a Density),
    /// The integration points, with their own densities.
    Points(&'a Quadrature),
}

impl<'a> Masses<'a> {
    /// The masses that a quadrature rule integrates.
    pub fn of(rule: Rule, density: &'a Density, quadrature: &'a Quadrature) -> Self {
        match rule {
            Rule::Mixture | Rule::Laminate => Masses::Fitted(density),
            Rule::Particles => Masses::Points(quadrature),
        }
    }

    /// Calls `f` for each point with its mass divided by the volume of the cell, its reference
    /// coordinates and the shape functions.
    fn for_points(&self, cell: usize, mut f: impl FnMut(f64, [f64; 2], &[f64; 9])) {
        match self {
            Masses::Fitted(density) => density.for_points(cell, f),
            Masses::Points(quadrature) => {
                quadrature.for_points(cell, |p, shape| f(p.weight * p.density, p.r, &shape.n))
            }
        }
    }
}

/// Adds the weight under gravity `g`, in the plan's units, to the nodal load.
pub fn add_gravity<const D: usize>(
    plan: &Plan,
    g: [f64; 2],
    masses: Masses,
    load: &mut [[f64; D]],
) {
    let mesh = &plan.mesh;
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let volume = mesh.cell_volume(cell);
        let mut mass = [0.0; 9];
        masses.for_points(cell, |m, _, n| {
            for (mass, n) in mass.iter_mut().zip(n) {
                *mass += m * n;
            }
        });
        for (node, mass) in mesh.cell_nodes(cell).into_iter().zip(mass) {
            load[node][0] += volume * mass * g[0];
            load[node][1] += volume * mass * g[1];
        }
    }
}

/// Adds the weight under the plan's acceleration, if there is one, to the nodal load.
pub fn add_acceleration<const D: usize>(plan: &Plan, masses: Masses, load: &mut [[f64; D]]) {
    let Some(acceleration) = &plan.acceleration else { return };
    let (mesh, unit) = (&plan.mesh, plan.units.acceleration());
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let volume = mesh.cell_volume(cell);
        let mut force = [[0.0; 2]; 9];
        masses.for_points(cell, |mass, r, n| {
            let [x, y] = plan.si(mesh.from_reference(cell, r));
            let a = acceleration.each_ref().map(|a| a.at(x, y));
            for (force, n) in force.iter_mut().zip(n) {
                force[0] += volume * mass * n * a[0] / unit;
                force[1] += volume * mass * n * a[1] / unit;
            }
        });
        for (node, force) in mesh.cell_nodes(cell).into_iter().zip(force) {
            load[node][0] += force[0];
            load[node][1] += force[1];
        }
    }
}
