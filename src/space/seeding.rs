//! This module places the particles at the start.

use super::mesh::Mesh;
use crate::scene::Placement;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Number and positions of the particles of a cell at the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seeding {
    /// Number of particles per direction.
    pub side: usize,
    /// Placement of the particles.
    pub placement: Placement,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Seeding {
    /// Number of particles per cell.
    pub fn count(&self) -> usize {
        self.side * self.side
    }

    /// Random number generator of one cell; it does not depend on the order in which cells are
    /// filled.
    pub fn random(&self, cell: usize) -> Pcg64 {
        Pcg64::seed_from_u64(self.seed ^ (cell as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// Positions of the particles in a cell. Those inside of solids are left out; if all are, there is
    /// one in the part that is free, or none if that is too small to hold one.
    pub fn positions(&self, mesh: &Mesh, cell: usize, random: &mut Pcg64) -> Vec<[f64; 2]> {
        let mut all = self.lattice(mesh, cell, random);
        if let Some(part) = mesh.part(cell) {
            all.retain(|&p| !mesh.is_solid_in(cell, p));
            if all.is_empty() {
                all.extend(mesh.free_place(cell, part));
            }
        }
        all
    }

    fn lattice(&self, mesh: &Mesh, cell: usize, random: &mut Pcg64) -> Vec<[f64; 2]> {
        let n = self.side as f64;
        (0..self.count())
            .map(|k| {
                let (i, j) = ((k % self.side) as f64, (k / self.side) as f64);
                let [s, t] = match self.placement {
                    Placement::Regular => [(i + 0.5) / n, (j + 0.5) / n],
                    Placement::Jittered => {
                        [(i + random.random::<f64>()) / n, (j + random.random::<f64>()) / n]
                    }
                    Placement::Random => [random.random(), random.random()],
                };
                mesh.from_reference(cell, [2.0 * s - 1.0, 2.0 * t - 1.0])
            })
            .collect()
    }
}
