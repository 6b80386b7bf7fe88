//! This module merges particles in cells that hold too many.

use super::mesh::Mesh;
use super::particles::{Particles, merged_position};
use super::ties::{cheapest, from_middle};
use crate::threads;

/// Largest number of crowded cells per task.
const GRAIN: usize = 2;

/// Merges the closest pairs of one material in crowded cells. It keeps its buffers between calls.
#[derive(Clone, Debug, Default)]
pub(super) struct Merging {
    /// The crowded cells are the first ones of this list.
    crowds: Vec<Crowd>,
    /// Whether each particle was merged into another one.
    gone: Vec<bool>,
}

/// A cell with too many particles.
#[derive(Clone, Debug, Default)]
struct Crowd {
    cell: usize,
    members: Vec<Member>,
    /// Particles to be merged, in this order: the second into the first.
    pairs: Vec<(usize, usize)>,
}

/// What decides which particles are merged.
#[derive(Clone, Copy, Debug)]
struct Member {
    particle: usize,
    position: [f64; 2],
    volume: f64,
    material: u8,
    marked: bool,
}

impl Merging {
    /// Merges particles until no cell has more than `most`, or no two that may be merged. Returns the
    /// number of merges. `particles` must be sorted, and stay sorted.
    pub(super) fn thin(&mut self, mesh: &Mesh, particles: &mut Particles, most: usize) -> u64 {
        let mut count = 0;
        for cell in (0..mesh.cells()).filter(|&c| particles.of_cell(c).len() > most) {
            if count == self.crowds.len() {
                self.crowds.push(Crowd::default());
            }
            self.crowds[count].cell = cell;
            count += 1;
        }
        if count == 0 {
            return 0;
        }
        let crowds = &mut self.crowds[..count];
        let before = &*particles;
        threads::for_each(crowds, GRAIN, |_, crowd| crowd.choose(mesh, before, most));
        self.gone.clear();
        self.gone.resize(particles.len(), false);
        let mut merges = 0;
        for crowd in crowds {
            for &(a, b) in &crowd.pairs {
                particles.absorb(mesh, crowd.cell, (a, b));
                self.gone[b] = true;
                merges += 1;
            }
        }
        particles.remove(&self.gone);
        merges
    }
}

impl Crowd {
    /// Chooses the particles that are merged.
    fn choose(&mut self, mesh: &Mesh, particles: &Particles, most: usize) {
        self.members.clear();
        self.members.extend(particles.of_cell(self.cell).map(|p| Member {
            particle: p,
            position: particles.position[p],
            volume: particles.volume[p],
            material: particles.material[p],
            marked: particles.mark.as_ref().is_some_and(|m| m[p]),
        }));
        self.pairs.clear();
        while self.members.len() > most {
            let Some([i, j]) = self.closest_pair(mesh) else { return };
            let [a, b] = [self.members[i], self.members[j]];
            self.pairs.push((a.particle, b.particle));
            let both = [a, b].map(|m| (m.position, m.volume));
            self.members[i].position = merged_position(mesh, self.cell, both);
            self.members[i].volume += b.volume;
            self.members.remove(j);
        }
    }

    /// The pair of one material, both marked or both not, that costs least to merge: the cost is small
    /// for close and small particles.
    fn closest_pair(&self, mesh: &Mesh) -> Option<[usize; 2]> {
        let [hx, hy] = mesh.cell_size(self.cell);
        let all = &self.members;
        let pairs = all.iter().enumerate().flat_map(|(i, a)| {
            all.iter().enumerate().skip(i + 1).map(move |(j, b)| ([i, j], a, b))
        });
        let kin = pairs.filter(|(_, a, b)| a.material == b.material && a.marked == b.marked);
        let costs = kin.map(|(pair, a, b)| {
            let (pa, pb) = (a.position, b.position);
            let r2 = ((pa[0] - pb[0]) / hx).powi(2) + ((pa[1] - pb[1]) / hy).powi(2);
            (r2 * a.volume * b.volume / (a.volume + b.volume), pair)
        });
        cheapest(costs, |&[i, j]| {
            from_middle(mesh, all[i].position) + from_middle(mesh, all[j].position)
        })
    }
}
