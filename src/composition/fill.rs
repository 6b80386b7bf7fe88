//! This module finds how much of each cell the materials fill where nothing surrounds them.
//!
//! With the volume `V` of the particles of a cell over that of the cell, a cell is
//!
//! - empty below [`LEAST`]: its particles are carried by the flow around it;
//! - filled in part, by `V`, if one of the cells around it is empty, or if `V` is below [`POCKET`];
//! - full otherwise.
//!
//! A straight surface leaves one of the eight cells around each cell that it cuts empty, so the random
//! fluctuations of `V` inside a material never make a surface there. Beside a side of the domain or a block,
//! a cell beyond it counts as empty if the shares of the cells at the surface, continued linearly, say so. A
//! cell whose particles have more than its volume is full.

use crate::space::constraints::FixedSides;
use crate::space::mesh::Mesh;
use crate::space::neighbours::joined;
use crate::space::particles::Particles;
use crate::space::shape::side_normal;
use crate::threads;

/// Largest number of cells per task.
const GRAIN: usize = 64;
/// Filled share below which a cell is empty. In a smaller sliver rounding errors of its pressure disturb
/// the solver.
pub const LEAST: f64 = 0.01;
/// Filled share from which a cell at the surface is full.
const FULL: f64 = 1.0 - 1e-6;
/// Filled share below which a cell among others that are not empty is filled in part.
const POCKET: f64 = 0.4;

/// Filled share of every cell.
#[derive(Clone, Debug, Default)]
pub struct Fill {
    /// Material that stands for the void.
    void: usize,
    /// Whether material that nothing holds has a flow: with inertia it falls.
    falls: bool,
    /// Volume of the particles of each cell over that of the cell.
    volume: Vec<f64>,
    /// Filled share of each cell, from 0 to 1.
    share: Vec<f64>,
    /// Cells of the largest body that nothing holds.
    largest_loose: Vec<usize>,
}

impl Fill {
    /// No cell filled. `void`: the material that stands for the void; `falls`: whether material that nothing
    /// holds has a flow.
    pub fn new(void: usize, falls: bool, cells: usize) -> Self {
        Fill { void, falls, volume: vec![0.0; cells], share: vec![0.0; cells], ..Fill::default() }
    }

    /// The material that stands for the void.
    pub fn void(&self) -> usize {
        self.void
    }

    /// Filled share of a cell.
    pub fn of(&self, cell: usize) -> f64 {
        self.share[cell]
    }

    /// Whether a material fills a cell in part.
    pub fn is_partial(&self, cell: usize) -> bool {
        self.share[cell] > 0.0 && self.share[cell] < 1.0
    }

    /// Cells of the largest body that nothing holds, if such bodies have no flow.
    pub fn largest_loose(&self) -> &[usize] {
        &self.largest_loose
    }

    /// Computes the shares from the particles, which must be sorted. The volume of each material is
    /// multiplied by its factor; `walls`: sides of each cell on which the velocity is prescribed.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        factors: &[f64],
        walls: &[FixedSides],
    ) {
        let Fill { volume, share, .. } = self;
        threads::for_each(volume, GRAIN, |cell, volume| {
            let own = particles.of_cell(cell);
            let of = |p: usize| particles.volume[p] * factors[usize::from(particles.material[p])];
            *volume = own.map(of).sum::<f64>() / mesh.cell_volume(cell);
        });
        let volume = &*volume;
        threads::for_each(share, GRAIN, |cell, share| {
            let own = volume[cell];
            *share = if mesh.solid[cell] || own < LEAST {
                0.0
            } else if own >= FULL {
                1.0
            } else if own < POCKET || is_at_surface(mesh, volume, cell) {
                own
            } else {
                1.0
            };
        });
        if !self.falls {
            self.release(mesh, walls);
        }
    }

    /// Empties the cells of bodies that nothing holds: cells that are joined by faces and touch no sides
    /// that prescribe velocities along both directions. Without inertia they would fall at any speed.
    fn release(&mut self, mesh: &Mesh, walls: &[FixedSides]) {
        let Fill { share, largest_loose, .. } = self;
        largest_loose.clear();
        let mut seen = vec![false; mesh.cells()];
        for start in 0..mesh.cells() {
            if share[start] == 0.0 || seen[start] {
                continue;
            }
            let body = joined(start, &mut seen, |cell| {
                let beyond = (0..4).filter_map(move |side| mesh.beyond(cell, side));
                beyond.filter(|&c| share[c] > 0.0)
            });
            let mut held = [false; 2];
            for (cell, side) in body.iter().flat_map(|&cell| (0..4).map(move |side| (cell, side))) {
                let normal = side_normal(side);
                let FixedSides { any, along } = walls[cell];
                held[1 - normal] |= along[side];
                held[normal] |= any[side];
            }
            if held != [true; 2] {
                body.iter().for_each(|&cell| share[cell] = 0.0);
                if body.len() > largest_loose.len() {
                    *largest_loose = body;
                }
            }
        }
    }
}

/// Whether one of the cells around a cell is empty.
fn touches_empty(mesh: &Mesh, volume: &[f64], cell: usize) -> bool {
    mesh.block(cell).any(|c| volume[c] < LEAST && !mesh.solid[c])
}

/// Whether one of the cells around a cell is empty, cells beyond sides of the domain and in blocks included.
fn is_at_surface(mesh: &Mesh, volume: &[f64], cell: usize) -> bool {
    let inside = |c: usize, side: usize| mesh.beyond(c, side).filter(|&c| !mesh.solid[c]);
    let beyond_is_empty = |c: usize, side: usize| {
        let opposite = side ^ 1;
        inside(c, opposite).is_some_and(|next| {
            2.0 * volume[c] - volume[next] < LEAST && touches_empty(mesh, volume, c)
        })
    };
    touches_empty(mesh, volume, cell)
        || (0..4).filter(|&side| inside(cell, side).is_none()).any(|side| {
            let along = 2 * (1 - side_normal(side));
            let beside = [along, along + 1].into_iter().filter_map(|to| inside(cell, to));
            beside.into_iter().any(|c| beyond_is_empty(c, side))
        })
}
