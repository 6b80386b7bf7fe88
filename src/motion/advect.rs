//! Moving the particles: position, director, volume.

use super::carrier::{CELL_GRAIN, Carrier};
use super::gauges::Counter;
use crate::plan::EffectSet;
use crate::space::particles::Particles;
use crate::space::population::Count;
use crate::threads::{self, Divisible};

/// Where a particle comes in a step, and what becomes of what it carries.
#[derive(Clone, Copy, Default)]
struct Moved {
    /// Not wrapped around periodic sides.
    to: [f64; 2],
    left: bool,
    held: bool,
    cell: u32,
    director: [f64; 2],
    stretch: f64,
}

/// The particles of some consecutive cells, to be moved.
struct Members<'a> {
    /// First particle of each of these cells and of the next.
    start: &'a [u32],
    moved: &'a mut [Moved],
}

impl Divisible for Members<'_> {
    fn cut(self, at: usize) -> (Self, Self) {
        let particles = (self.start[at] - self.start[0]) as usize;
        let (a, b) = self.moved.split_at_mut(particles);
        let (before, after) = (&self.start[..=at], &self.start[at..]);
        (Members { start: before, moved: a }, Members { start: after, moved: b })
    }
}

/// Moves all particles through a step. `particles` must be sorted, and are sorted afterwards.
/// `compliant[m]`: volumes of material `m` follow the flow, and its particles keep their mass.
pub fn advance(
    carrier: &Carrier,
    particles: &mut Particles,
    effects: &EffectSet,
    compliant: &[bool],
    gauges: &mut [Counter],
    count: &mut Count,
) {
    let mesh = carrier.mesh;
    let turning = effects.directors || effects.volume_change;
    let mut moved = vec![Moved::default(); particles.len()];
    let members = Members { start: &particles.cell_start, moved: &mut moved };
    threads::for_parts(members, 0..mesh.cells(), CELL_GRAIN, |cells, members| {
        let first = members.start[0] as usize;
        for cell in cells {
            let range = particles.of_cell(cell);
            carrier.travel_all(cell, &particles.position[range.clone()], |k, journey| {
                let p = range.start + k;
                let moved = &mut members.moved[p - first];
                (moved.left, moved.held) = (journey.left, journey.held);
                moved.to = journey.to;
                let arrived = || mesh.locate(mesh.wrap(journey.to));
                moved.cell = journey.stays.unwrap_or_else(arrived) as u32;
                if turning {
                    let l = carrier.gradient(journey.middle);
                    if let Some(director) = &particles.director {
                        moved.director = carrier.turn(director[p], &l);
                    }
                    if compliant[particles.material[p] as usize] {
                        moved.stretch = (l.trace() * carrier.dt).exp();
                    }
                }
            });
        }
    });
    for gauge in gauges {
        for (p, moved) in moved.iter().enumerate() {
            let (material, volume) = (particles.material[p], particles.volume[p]);
            gauge.pass(mesh, particles.position[p], moved.to, material, volume);
        }
    }
    for (p, moved) in moved.iter().enumerate() {
        count.held += u64::from(moved.held);
        if !moved.left {
            particles.position[p] = mesh.wrap(moved.to);
        }
        if let (true, Some(director)) = (turning, &mut particles.director) {
            director[p] = moved.director;
        }
        if turning && compliant[particles.material[p] as usize] {
            particles.volume[p] *= moved.stretch;
            if let Some(density) = &mut particles.density {
                density[p] /= moved.stretch;
            }
        }
    }
    let stay = || moved.iter().filter(|m| !m.left);
    if moved.iter().any(|m| m.left) {
        let gone: Vec<bool> = moved.iter().map(|m| m.left).collect();
        count.left += gone.iter().filter(|&&g| g).count() as u64;
        particles.remove(&gone);
    }
    particles.sort_into(mesh.cells(), stay().map(|m| m.cell));
}
