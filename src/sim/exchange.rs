//! This module computes what the material that enters and leaves carries: volume and energy.
//!
//! The energy of the particles is relative to the background, of density `rho_0`. Particles that leave
//! take `V ((rho - rho_0) (-g.x) + rho u^2/2)` with them, with the velocity where they cross. The background
//! itself, whose weight its pressure balances, does the work
//!
//! ```text
//! integral over the sides of  rho_0 (g.x) (u.n)
//! ```
//! per time, which is zero in a closed box.

use super::inertia::interpolated;
use super::simulation::Simulation;
use crate::space::count::Crossing;
use crate::space::shape::{
    GAUSS_3, GAUSS_3_WEIGHTS, SIDE_NODES, Shape, side_end, side_normal, side_point,
};

impl<const D: usize> Simulation<D> {
    /// Density of the background, in the plan's units; zero without one.
    pub(super) fn background_density(&self) -> f64 {
        let density = |m: u8| self.matter.materials[usize::from(m)].density;
        self.plan.background().map_or(0.0, density)
    }

    /// Counts the pieces of material that have crossed the sides since the last call.
    pub(super) fn count_crossings(&mut self) {
        let mut crossings = std::mem::take(&mut self.crossings);
        for crossing in crossings.drain(..) {
            let energy = self.energy_of(&crossing);
            if crossing.enters {
                self.count.volume_in += crossing.volume;
                self.count.energy_out -= energy;
            } else {
                self.count.left += 1;
                self.count.volume_out += crossing.volume;
                self.count.energy_out += energy;
            }
        }
        self.crossings = crossings;
    }

    /// Potential energy relative to the background, and kinetic energy.
    fn energy_of(&self, crossing: &Crossing) -> f64 {
        let material = &self.matter.materials[usize::from(crossing.material)];
        let carried = crossing.density.filter(|_| material.carries_density);
        let density = carried.unwrap_or(material.density);
        let (g, x) = (self.matter.gravity, crossing.at);
        let potential = -(density - self.background_density()) * (g[0] * x[0] + g[1] * x[1]);
        let kinetic = self.inertia.as_ref().map_or(0.0, |inertia| {
            let [u, v] = interpolated(&self.plan.mesh, &self.half, (self.plan.mesh.locate(x), x));
            0.5 * inertia.density * density * (u * u + v * v)
        });
        crossing.volume * (potential + kinetic)
    }

    /// Power of the pressure that balances the weight of the background, on what crosses the sides.
    pub(super) fn power_of_background(&self) -> f64 {
        let density = self.background_density();
        if density == 0.0 || !self.plan.exchanges_volume() {
            return 0.0;
        }
        let (plan, mesh, g) = (&self.plan, &self.plan.mesh, self.matter.gravity);
        let sides = plan.boundary.pieces().flat_map(|(side, piece)| {
            piece.segment.cells_at_side(mesh, side).map(move |(_, cell)| (cell, side))
        });
        let mouths = plan.boundary.sources.iter().flat_map(|source| source.faces(mesh));
        let mut sum = 0.0;
        for (cell, side) in sides.chain(mouths).filter(|&(cell, _)| !mesh.solid[cell]) {
            let normal = side_normal(side);
            let (nodes, face) = (mesh.cell_nodes(cell), mesh.face(cell, side));
            for (t, weight) in GAUSS_3.into_iter().zip(GAUSS_3_WEIGHTS) {
                let x = mesh.from_reference(cell, side_point(side, t));
                if mesh.is_solid_in(cell, x) {
                    continue;
                }
                let along = Shape::line(t).into_iter().zip(SIDE_NODES[side]);
                let u: f64 = along.map(|(n, a)| n * self.flow.velocity[nodes[a]][normal]).sum();
                sum += face.of_point(weight, t) * (g[0] * x[0] + g[1] * x[1]) * side_end(side) * u;
            }
        }
        density * sum
    }
}
