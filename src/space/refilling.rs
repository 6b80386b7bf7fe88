//! This module gives particles to cells that hold none.
//!
//! An empty cell gets a part of the largest particle of its neighbours. Amid one material that moves no material:
//! the donor moves away from the cell so that its centroid with the new particle is kept. Otherwise
//! half of the donor's material moves into the cell.

use super::mesh::Mesh;
use super::neighbours::Neighbours;
use super::particles::Particles;
use super::ties::{cheapest, from_middle};

/// Fraction of its volume that a donor gives to a cell amid its material. With less the volumes of
/// particles would be more unequal, with more the donor would move farther.
const GIVEN_AMID: f64 = 0.25;

/// What an empty cell was given: a volume per depth (in the plan's units) of a material.
#[derive(Clone, Copy, Debug)]
pub struct Refill {
    /// The cell that gave it and the cell that received it; they share a face.
    pub cells: [usize; 2],
    pub material: u8,
    pub volume: f64,
    /// Whether all neighbours of the cell held this material only.
    pub amid: bool,
}

/// The cells without particles, in an order in which mirror images that have the same donors are treated alike:
/// from the centre of the domain outwards.
pub(super) fn empty_cells(mesh: &Mesh, particles: &Particles) -> Vec<usize> {
    let is_empty = |c: &usize| !mesh.solid[*c] && particles.of_cell(*c).is_empty();
    let mut empty: Vec<usize> = (0..mesh.cells()).filter(is_empty).collect();
    let distance = |&c: &usize| from_middle(mesh, mesh.cell_centre(c));
    empty.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    empty
}

/// Refills an empty cell from the largest particle of its neighbours, if possible one that is not behind a
/// solid. `None` if they have none, or if the free part of the cell is too small to hold one.
pub(super) fn refill(
    mesh: &Mesh,
    neighbours: &Neighbours,
    particles: &mut Particles,
    cell: usize,
) -> Option<Refill> {
    let place = match mesh.part(cell) {
        Some(part) => mesh.free_place(cell, part)?,
        None => mesh.cell_centre(cell),
    };
    let near = || neighbours.of(cell).flat_map(|n| particles.of_cell(n).map(move |p| (n, p)));
    let offers = near().map(|(n, p)| {
        let seen = mesh.sees(place, particles.position[p]);
        (if seen { -particles.volume[p] } else { 0.0 }, (n, p))
    });
    let middle = |&(_, p): &(usize, usize)| from_middle(mesh, particles.position[p]);
    let (from, donor) = cheapest(offers, middle)?;
    let material = particles.material[donor];
    let amid = near().all(|(_, p)| particles.material[p] == material);
    let given = if amid { GIVEN_AMID } else { 0.5 };
    particles.duplicate(donor);
    let child = particles.len() - 1;
    particles.position[child] = place;
    particles.volume[child] *= given;
    particles.volume[donor] *= 1.0 - given;
    if amid {
        let old = particles.position[donor];
        let shift = given / (1.0 - given);
        let to =
            [0, 1].map(|c| old[c] - shift * [&mesh.x, &mesh.y][c].nearest_image(place[c] - old[c]));
        particles.move_inside(mesh, from, (donor, to));
    }
    Some(Refill { cells: [from, cell], material, volume: particles.volume[child], amid })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::mesh::Axis;
    use crate::space::walls::Enclosure;

    /// Four by three cells, of which those in the middle row hold a particle each.
    fn start(material: impl Fn([f64; 2]) -> u8) -> (Mesh, Neighbours, Particles) {
        let axis = |lines: &[f64]| Axis::new(lines.to_vec(), false);
        let mesh = Mesh::new(axis(&[0.0, 1.0, 2.0, 3.0, 4.0]), axis(&[0.0, 1.0, 2.0, 3.0]));
        let neighbours = Neighbours::new(&mesh, &Enclosure::default());
        let mut particles = Particles::default();
        for (x, y) in [(0.4, 1.3), (1.3, 1.2), (2.7, 1.2), (3.6, 1.3)] {
            particles.push([x, y], 1.0, material([x, y]));
        }
        particles.sort(&mesh);
        (mesh, neighbours, particles)
    }

    fn moments(particles: &Particles) -> [f64; 3] {
        let each = particles.position.iter().zip(&particles.volume);
        each.fold([0.0; 3], |m, (p, v)| [m[0] + v, m[1] + v * p[0], m[2] + v * p[1]])
    }

    #[test]
    fn amid_one_material_no_material_is_moved() {
        let (mesh, neighbours, mut particles) = start(|_| 0);
        let before = moments(&particles);
        for cell in 0..4 {
            let refill = refill(&mesh, &neighbours, &mut particles, cell).unwrap();
            assert!(refill.amid);
        }
        let after = moments(&particles);
        for (a, b) in before.iter().zip(after) {
            assert!((a - b).abs() < 1e-14, "{before:?} {after:?}");
        }
    }

    #[test]
    fn mirror_images_are_refilled_alike() {
        let (mesh, neighbours, mut particles) = start(|p| u8::from(p[0] > 1.0 && p[0] < 3.0));
        for cell in empty_cells(&mesh, &particles) {
            refill(&mesh, &neighbours, &mut particles, cell);
        }
        for (p, v) in particles.position.iter().zip(&particles.volume) {
            let image = particles.position.iter().zip(&particles.volume).find(|(q, w)| {
                (p[0] + q[0] - 4.0).abs() < 1e-12 && (p[1] - q[1]).abs() < 1e-12 && v == *w
            });
            assert!(image.is_some(), "{p:?}");
        }
    }
}
