//! Placing particles at the start.

use super::mesh::Mesh;
use crate::scene::Placement;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// How many particles a cell gets, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seeding {
    /// Particles per direction.
    pub side: usize,
    pub placement: Placement,
    pub seed: u64,
}

impl Seeding {
    /// Particles per cell.
    pub fn count(&self) -> usize {
        self.side * self.side
    }

    /// Random numbers of one cell: independent of the order in which cells are filled.
    pub fn random(&self, cell: usize) -> Pcg64 {
        Pcg64::seed_from_u64(self.seed ^ (cell as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// Positions in a cell.
    pub fn positions(&self, mesh: &Mesh, cell: usize, random: &mut Pcg64) -> Vec<[f64; 2]> {
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
