//! This module advects the particles: their positions, directors and volumes.

use super::frozen_flow::{CELL_GRAIN, FrozenFlow};
use super::gauges::Counter;
use crate::plan::EffectSet;
use crate::space::count::{Count, Crossing};
use crate::space::particles::{GONE, GRAIN, Particles};
use crate::threads::{self, Divisible};

/// Positions, directors and volume factors of all particles after a step. The buffers are reused in
/// the next step.
#[derive(Default)]
pub struct Displacements {
    /// Positions, not wrapped around periodic sides.
    to: Vec<[f64; 2]>,
    /// Cells of the positions; [`GONE`] for particles that left.
    cell: Vec<u32>,
    /// Whether a wall stopped the particle.
    held: Vec<bool>,
    /// Directors; empty if the particles have none.
    director: Vec<[f64; 2]>,
    /// Factors on the volumes; empty if no volume follows the flow.
    stretch: Vec<f64>,
}

impl Displacements {
    /// Resizes the buffers; their contents are invalid afterwards.
    fn make_room(&mut self, particles: &Particles, effects: &EffectSet) {
        let n = particles.len();
        self.to.resize(n, [0.0; 2]);
        self.cell.resize(n, 0);
        self.held.resize(n, false);
        self.director.resize(if particles.director.is_some() { n } else { 0 }, [0.0; 2]);
        self.stretch.resize(if effects.volume_change { n } else { 0 }, 1.0);
    }
}

/// The parts of the buffers of [`Displacements`] that belong to consecutive cells.
struct Members<'a> {
    /// Index of the first particle of each of these cells and of the cell after them.
    start: &'a [u32],
    to: &'a mut [[f64; 2]],
    cell: &'a mut [u32],
    held: &'a mut [bool],
    director: &'a mut [[f64; 2]],
    stretch: &'a mut [f64],
}

impl Divisible for Members<'_> {
    fn cut(self, at: usize) -> (Self, Self) {
        /// Splits a column, which may be empty.
        fn split<T>(column: &mut [T], at: usize) -> (&mut [T], &mut [T]) {
            let at = at.min(column.len());
            column.split_at_mut(at)
        }
        let particles = (self.start[at] - self.start[0]) as usize;
        let (to, cell) = (split(self.to, particles), split(self.cell, particles));
        let (held, director) = (split(self.held, particles), split(self.director, particles));
        let stretch = split(self.stretch, particles);
        (
            Members {
                start: &self.start[..=at],
                to: to.0,
                cell: cell.0,
                held: held.0,
                director: director.0,
                stretch: stretch.0,
            },
            Members {
                start: &self.start[at..],
                to: to.1,
                cell: cell.1,
                held: held.1,
                director: director.1,
                stretch: stretch.1,
            },
        )
    }
}

/// Advects all particles through a step. `particles` must be sorted by cell and are sorted
/// afterwards. `compliant`: whether the particle volumes of a material follow the flow; their mass
/// is constant. What leaves the domain is added to `crossings`.
pub fn advance(
    frozen_flow: &FrozenFlow,
    particles: &mut Particles,
    displacements: &mut Displacements,
    effects: &EffectSet,
    compliant: impl Fn(u8) -> bool + Sync,
    gauges: &mut [Counter],
    (count, crossings): (&mut Count, &mut Vec<Crossing>),
) {
    let mesh = frozen_flow.mesh;
    displacements.make_room(particles, effects);
    let Displacements { to, cell, held, director, stretch } = &mut *displacements;
    let members = Members { start: &particles.cell_start, to, cell, held, director, stretch };
    threads::for_parts(members, 0..mesh.cells(), CELL_GRAIN, |cells, members| {
        let first = members.start[0] as usize;
        for home in cells {
            let range = particles.of_cell(home);
            frozen_flow.travel_all(home, &particles.position[range.clone()], |k, displacement| {
                let p = range.start + k;
                let at = p - first;
                members.held[at] = displacement.held;
                members.to[at] = displacement.to;
                let arrived = || mesh.locate(mesh.wrap(displacement.to));
                let cell = displacement.cell.unwrap_or_else(arrived) as u32;
                members.cell[at] = if displacement.left { GONE } else { cell };
                if members.director.is_empty() && members.stretch.is_empty() {
                    return;
                }
                let l = frozen_flow.gradient(displacement.middle);
                if let Some(director) = &particles.director {
                    members.director[at] = frozen_flow.turn(director[p], &l);
                }
                if let Some(stretch) = members.stretch.get_mut(at) {
                    let follows = compliant(particles.material[p]);
                    let rate = || frozen_flow.dilation(displacement.middle, &l);
                    *stretch = if follows { (rate() * frozen_flow.dt).exp() } else { 1.0 };
                }
            });
        }
    });
    for gauge in gauges {
        for (p, &to) in to.iter().enumerate() {
            gauge.pass(mesh, particles.position[p], to, particles.material[p], particles.volume[p]);
        }
    }
    count.held += held.iter().filter(|&&held| held).count() as u64;
    for (p, _) in cell.iter().enumerate().filter(|&(_, &cell)| cell == GONE) {
        crossings.push(Crossing {
            enters: false,
            material: particles.material[p],
            volume: particles.volume[p],
            density: particles.density.as_ref().map(|density| density[p]),
            at: mesh.nearest_inside(to[p]),
        });
    }
    if mesh.x.periodic() || mesh.y.periodic() {
        threads::for_each(to, GRAIN, |_, p| *p = mesh.wrap(*p));
    }
    std::mem::swap(&mut particles.position, to);
    if let Some(column) = &mut particles.director {
        std::mem::swap(column, director);
    }
    for (p, stretch) in stretch.iter().enumerate() {
        particles.volume[p] *= stretch;
        if let Some(density) = &mut particles.density {
            density[p] /= stretch;
        }
    }
    particles.regroup(cell);
}
