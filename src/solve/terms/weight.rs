//! This module computes the weight of the materials: `integral rho (g + a) . u~`, with gravity `g`
//! and an acceleration `a(x, y)` that is fixed in space.
//!
//! Densities come from [`density`](crate::solve::density) or, if particles are the integration
//! points, from the particles.

use crate::plan::Plan;
use crate::scene::Quadrature as Rule;
use crate::solve::density::{Density, MassPoint};
use crate::solve::quadrature::Quadrature;
use crate::solve::sides::Kinked;

/// Points at which the densities of a cell are known.
#[derive(Clone, Copy)]
pub enum Masses<'a> {
    /// Gauss points, with fitted densities, and the kinks of the velocity in cut cells.
    Fitted(&'a Density, &'a Quadrature),
    /// The integration points, with their own densities.
    Points(&'a Quadrature),
}

impl<'a> Masses<'a> {
    /// The masses that a quadrature rule integrates.
    pub fn of(rule: Rule, density: &'a Density, quadrature: &'a Quadrature) -> Self {
        match rule {
            Rule::Mixture | Rule::Laminate | Rule::Sides => Masses::Fitted(density, quadrature),
            Rule::Particles => Masses::Points(quadrature),
        }
    }

    /// Calls `f` for each point of a cell.
    fn for_points(&self, cell: usize, mut f: impl FnMut(MassPoint)) {
        match self {
            Masses::Fitted(density, _) => density.for_points(cell, f),
            Masses::Points(quadrature) => quadrature.for_points(cell, |p, shape| {
                f(MassPoint { mass: p.weight * p.density, kinked: 0.0, r: p.r, n: &shape.n })
            }),
        }
    }

    /// Kink of the velocity in a cell.
    fn kinked(&self, cell: usize) -> Option<&Kinked> {
        match self {
            Masses::Fitted(_, quadrature) => quadrature.kinked(cell),
            Masses::Points(_) => None,
        }
    }

    /// Adds the force `force` on the kink of a cell to the forces on its nodes.
    fn add_kinked(&self, cell: usize, force: [f64; 2], mut add: impl FnMut(usize, [f64; 2])) {
        if let Some(Kinked { kink, amplitude, .. }) = self.kinked(cell) {
            let along = force[0] * kink.along[0] + force[1] * kink.along[1];
            for (a, alpha) in amplitude.iter().enumerate() {
                add(a, alpha.map(|alpha| along * alpha));
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
        let (mut mass, mut kinked) = ([0.0; 9], 0.0);
        masses.for_points(cell, |p| {
            for (mass, n) in mass.iter_mut().zip(p.n) {
                *mass += p.mass * n;
            }
            kinked += p.kinked;
        });
        let nodes = mesh.cell_nodes(cell);
        for (node, mass) in nodes.into_iter().zip(mass) {
            load[node][0] += volume * mass * g[0];
            load[node][1] += volume * mass * g[1];
        }
        masses.add_kinked(cell, g.map(|g| volume * kinked * g), |a, [x, y]| {
            load[nodes[a]][0] += x;
            load[nodes[a]][1] += y;
        });
    }
}

/// Adds the weight under the plan's acceleration, if there is one, to the nodal load.
pub fn add_acceleration<const D: usize>(plan: &Plan, masses: Masses, load: &mut [[f64; D]]) {
    let Some(acceleration) = &plan.acceleration else { return };
    let (mesh, unit) = (&plan.mesh, plan.units.acceleration());
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let volume = mesh.cell_volume(cell);
        let (mut force, mut kinked) = ([[0.0; 2]; 9], [0.0; 2]);
        masses.for_points(cell, |p| {
            let [x, y] = plan.si(mesh.from_reference(cell, p.r));
            let a = acceleration.each_ref().map(|a| a.at(x, y));
            for (force, n) in force.iter_mut().zip(p.n) {
                force[0] += volume * p.mass * n * a[0] / unit;
                force[1] += volume * p.mass * n * a[1] / unit;
            }
            for c in 0..2 {
                kinked[c] += volume * p.kinked * a[c] / unit;
            }
        });
        let nodes = mesh.cell_nodes(cell);
        for (node, force) in nodes.into_iter().zip(force) {
            load[node][0] += force[0];
            load[node][1] += force[1];
        }
        masses.add_kinked(cell, kinked, |a, [x, y]| {
            load[nodes[a]][0] += x;
            load[nodes[a]][1] += y;
        });
    }
}
