//! This module lets the background material enter through openings in the sides of the domain, so
//! that the particles fill the domain while material leaves it elsewhere.
//!
//! The volume that the velocity carries inwards across a part `F` of a face in a step,
//!
//! ```text
//! V = dt max(-integral over F of u . n, 0)
//! ```
//! becomes background next to the face. It is added to the nearest small particle of the
//! background in the cell, which moves so that the centroid of the volumes is kept, or makes a new
//! particle. So the volume of all particles changes by what enters and what leaves, to rounding,
//! and no volume is kept anywhere else.

use super::gauges::Counter;
use crate::plan::Plan;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{SIDE_NODES, Shape, side_normal};

/// Faces on sides of the domain through which the background enters.
#[derive(Clone, Debug)]
pub struct Inflow {
    /// Index of the background material.
    material: u8,
    /// Cells at openings, with the side of the domain.
    faces: Vec<(usize, usize)>,
    /// Number of particles along a cell at the start.
    particles_along: usize,
}

/// Volume that enters through a part of a face in a step.
struct Entry {
    cell: usize,
    volume: f64,
    /// Centroid of the volume at the end of the step.
    at: [f64; 2],
    /// A point outside the domain from which it came.
    from: [f64; 2],
}

impl Inflow {
    /// The faces of a plan without a prescribed normal velocity through which particles leave;
    /// `None` if there are none or the plan has no background.
    pub fn new(plan: &Plan) -> Option<Inflow> {
        let material = plan.background()?;
        let mesh = &plan.mesh;
        let open = plan.boundary.pieces().filter(|(s, piece)| {
            piece.open && piece.conditions.velocity[side_normal(*s)].is_none()
        });
        let faces: Vec<_> = open
            .flat_map(|(s, piece)| piece.segment.cells_at_side(mesh, s).map(move |(_, c)| (c, s)))
            .filter(|&(cell, _)| !mesh.solid[cell])
            .collect();
        let particles_along = plan.method.seeding.side;
        (!faces.is_empty()).then_some(Inflow { material, faces, particles_along })
    }

    /// Adds the background that enters in a step of length `dt` with the nodal velocities
    /// `velocity`, and counts it at the gauges. `particles` must be sorted, and are sorted on return.
    pub fn enter(
        &self,
        mesh: &Mesh,
        (velocity, dt): (&[[f64; 2]], f64),
        particles: &mut Particles,
        gauges: &mut [Counter],
    ) {
        let before = particles.len();
        for &(cell, side) in &self.faces {
            for k in 0..self.particles_along {
                if let Some(entry) = self.entry(mesh, (velocity, dt), (cell, side), k) {
                    for gauge in gauges.iter_mut() {
                        gauge.pass(mesh, entry.from, entry.at, self.material, entry.volume);
                    }
                    self.add(mesh, particles, &entry);
                }
            }
        }
        if particles.len() != before {
            particles.sort(mesh);
        }
    }

    /// What enters through part `k` of the parts of equal size of a face, if anything does.
    fn entry(
        &self,
        mesh: &Mesh,
        (velocity, dt): (&[[f64; 2]], f64),
        (cell, side): (usize, usize),
        k: usize,
    ) -> Option<Entry> {
        let normal = side_normal(side);
        let outwards = if side.is_multiple_of(2) { -1.0 } else { 1.0 };
        let nodes = mesh.cell_nodes(cell);
        let outflow = SIDE_NODES[side].map(|a| outwards * velocity[nodes[a]][normal]);
        let at =
            |t: f64| -> f64 { Shape::line(t).into_iter().zip(outflow).map(|(n, u)| n * u).sum() };
        let width = 2.0 / self.particles_along as f64;
        let low = -1.0 + k as f64 * width;
        let [middle, high] = [low + 0.5 * width, low + width];
        // Simpson's rule is exact for quadratic functions.
        let speed = -(at(low) + 4.0 * at(middle) + at(high)) / 6.0;
        if speed <= 0.0 {
            return None;
        }
        let volume = dt * speed * mesh.face_area(cell, normal) / self.particles_along as f64;
        let depth = dt * speed / mesh.cell_size(cell)[normal];
        let point = |inside: f64| {
            let across = outwards * (1.0 - 2.0 * inside);
            let r = if normal == 0 { [across, middle] } else { [middle, across] };
            mesh.from_reference(cell, r)
        };
        // A step crosses at most a cell; a longer way would end in another cell.
        let inside = (0.5 * depth).min(0.5);
        // Nothing enters through what a solid covers.
        if [0.0, inside].iter().any(|&t| mesh.is_solid_in(cell, point(t))) {
            return None;
        }
        Some(Entry { cell, volume, at: point(inside), from: point(-inside) })
    }

    /// Adds the volume of an entry to the nearest particle of the background in its cell that is
    /// not larger than usual afterwards, or else as a new particle.
    fn add(&self, mesh: &Mesh, particles: &mut Particles, entry: &Entry) {
        let &Entry { cell, volume, at, .. } = entry;
        let usual = mesh.cell_volume(cell) / self.particles_along.pow(2) as f64;
        let [hx, hy] = mesh.cell_size(cell);
        let distance = |p: usize| {
            let d = particles.position[p];
            ((d[0] - at[0]) / hx).powi(2) + ((d[1] - at[1]) / hy).powi(2)
        };
        let small = |&p: &usize| {
            particles.material[p] == self.material && particles.volume[p] + volume <= usual
        };
        let nearest = particles
            .of_cell(cell)
            .filter(small)
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let Some(p) = nearest else { return particles.push(at, volume, self.material) };
        let share = volume / (particles.volume[p] + volume);
        for c in 0..2 {
            particles.position[p][c] += share * (at[c] - particles.position[p][c]);
        }
        particles.volume[p] += volume;
    }
}
