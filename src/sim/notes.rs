//! This module finds what a user should know about the initial state.

use super::simulation::Simulation;
use crate::plan::{Plan, Warning};
use crate::space::neighbours::Neighbours;

/// Largest speed at rest, in units of the speed at which the densest material would move by its
/// weight.
const REST: f64 = 1e-9;

/// Smallest difference of densities, relative to the largest, that counts.
const DENSER: f64 = 1e-9;

/// The warning about regions of a plan that contain no particle; `None` if there are none.
pub fn empty_regions(plan: &Plan, empty: Vec<usize>) -> Option<Warning> {
    // Regions that a later one covers completely are not part of the plan.
    let covered = plan.scene.regions.len() - plan.regions.len();
    let regions: Vec<usize> = empty.into_iter().map(|k| covered + k).collect();
    (!regions.is_empty()).then_some(Warning::RegionsEmpty { regions })
}

impl<const D: usize> Simulation<D> {
    /// Warnings about the initial state, in which the given regions contain no particle.
    pub(super) fn initial_notes(&self, empty: Vec<usize>) -> Vec<Warning> {
        let mut notes = vec![];
        notes.extend(empty_regions(&self.plan, empty));
        if self.rests_upside_down() {
            notes.push(Warning::UnstableRest);
        }
        notes
    }

    /// Whether nothing moves although somewhere a cell is denser than the one below it.
    fn rests_upside_down(&self) -> bool {
        let (mesh, g) = (&self.plan.mesh, self.matter.gravity);
        let materials = &self.matter.materials;
        let densest = materials.iter().map(|m| m.density.abs()).fold(0.0, f64::max);
        let stiffest = materials.iter().map(|m| m.viscosity).fold(0.0, f64::max);
        let size = mesh.x.length().min(mesh.y.length());
        let natural = densest * g[0].hypot(g[1]) * size * size / stiffest;
        if natural == 0.0 || self.flow.max_speed() > REST * natural {
            return false;
        }
        let p = &self.particles;
        let thin = self.plan.background().map_or(0.0, |b| materials[usize::from(b)].density);
        let density = |cell: usize| {
            let (mut mass, mut volume) = (0.0, 0.0);
            for k in p.of_cell(cell) {
                let m = &materials[usize::from(p.material[k])];
                mass += p.volume[k] * m.density_of(p, k);
                volume += p.volume[k];
            }
            if volume > 0.0 { mass / volume } else { thin }
        };
        let neighbours = Neighbours::new(mesh, &self.plan.enclosure);
        let mut cells = (0..mesh.cells()).filter(|&c| !mesh.solid[c]);
        cells.any(|cell| {
            let at = mesh.cell_centre(cell);
            neighbours.of(cell).any(|near| {
                let to = mesh.cell_centre(near);
                let d = [mesh.x.nearest_image(to[0] - at[0]), mesh.y.nearest_image(to[1] - at[1])];
                // `near` is below `cell`; directions across gravity are only rounding.
                let fall = d[0] * g[0] + d[1] * g[1];
                fall > 1e-6 * d[0].hypot(d[1]) * g[0].hypot(g[1])
                    && density(cell) > density(near) + DENSER * densest
            })
        })
    }
}
