//! This module resamples the particles (population control), so that no cell has too few or too
//! many.
//!
//! In a cell with too few particles, the particle nearest to the largest gap is split. The child
//! takes half of its volume, and all particles of this material in the cell move slightly so that
//! their centroid is unchanged. In a cell with too many particles, the closest pairs of one material
//! are merged. The volume and the centroid of each material are
//! conserved, so a level at rest stays at rest and no potential energy is created. Directors are
//! averaged regardless of their sign.
//!
//! With the nominal number `n` of particles per cell, a cell has
//!
//! - too few if it holds fewer than `n/2`, or none in one of its quadrants. The shares and the
//!   interface of several materials, and the fields that particles carry, are known from them;
//! - too few only below `n/4` if it and its neighbours hold one material whose particles carry
//!   nothing: there the particles only transport the material to the next interface;
//! - in the strips of small cells that a mesh refined in one direction has, too few only below a quarter of these
//!   numbers if a neighbour holds another material, and amid one material below the part of the area; where a mesh is
//!   refined in both directions, cells need as many as large ones;
//! - in the cells at an axis too few below `n/2`, since rings that shrink move apart in the section;
//! - too many above `3 n + 4`.
//!
//! The particles of large cells would otherwise be split in these strips, and merged again behind them. The default
//! silo, whose cells at the lips are a twelfth of the others, needs 17,600 splits and 13,600 merges; with the numbers
//! of large cells in all cells it would need 45,000 and 24,000. Where the mesh is refined in both directions, fewer
//! particles would make the flow jump: the outflow changes by 3 % when grains enter or leave the cell below a lip.
//!
//! Of choices that are equal up to rounding, the one nearest to the centre of the domain is taken,
//! so that mirror images are treated alike. Otherwise a symmetric jet is deflected: that of the
//! silo, at 6 cells per aperture graded by 8, by a quarter of the aperture at 0.7 ms.

use super::carried::CarriedFields;
use super::count::Count;
use super::merging::Merging;
use super::mesh::Mesh;
use super::neighbours::Neighbours;
use super::particles::Particles;
use super::refilling::{self, Refill};
use super::seeding::Seeding;
use super::ties::{SAME, cheapest, from_middle};
use super::walls::Enclosure;
use crate::threads;

/// Fraction of the nominal volume above which particles are split first. Splitting smaller
/// particles makes volumes more and more unequal: after 10,000 steps of a steady vortex, cells of
/// 16 particles deviated by 1.01 rows of particles with a fraction of a quarter, and deviate by
/// 0.91 with this one (with random positions they would deviate by 0.8).
const SPLIT: f64 = 0.7;

/// Smallest fraction of the numbers of particles that a cell beside another material needs, however small it is.
const LEAST_BESIDE: f64 = 0.25;

/// Fraction of the numbers of particles from which on each quadrant needs one.
const WITH_QUADRANTS: f64 = 0.5;

/// Largest number of cells per task.
const GRAIN: usize = 256;

/// What fills cells without particles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surrounding {
    /// The background material, if there is one: no cell stays empty.
    Material(Option<u8>),
    /// Nothing: cells may be empty.
    Void,
}

/// Resampling that keeps the number of particles per cell within bounds.
#[derive(Clone, Debug)]
pub struct Population {
    seeding: Seeding,
    around: Surrounding,
    neighbours: Neighbours,
    merging: Merging,
    room: Room,
    /// Volumes that the last call of [`Population::control`] has moved between cells.
    pub refills: Vec<Refill>,
}

/// Particles that a cell needs.
#[derive(Clone, Copy)]
struct Need {
    /// Smallest number.
    least: usize,
    /// Whether each quadrant must hold one.
    quadrants: bool,
}

/// Buffers that are kept between steps.
#[derive(Clone, Debug, Default)]
struct Room {
    /// Whether each cell has too few particles, or none in a quadrant.
    lacking: Vec<bool>,
    /// Particles of a cell.
    members: Vec<usize>,
    /// Particles of one material in a cell.
    kin: Vec<usize>,
    /// Reference coordinates of these particles.
    places: Vec<[f64; 2]>,
    /// Cells of the particles that were added.
    added: Vec<u32>,
}

impl Population {
    /// Population control for a mesh; `seeding` gives the nominal number of particles per cell.
    pub fn new(mesh: &Mesh, enclosure: &Enclosure, seeding: Seeding, around: Surrounding) -> Self {
        let room = Room { lacking: vec![false; mesh.cells()], ..Room::default() };
        let neighbours = Neighbours::new(mesh, enclosure);
        let merging = Merging::default();
        Population { seeding, around, neighbours, merging, room, refills: vec![] }
    }

    /// Restores the bounds and counts the events. `particles` must be sorted, and are sorted on
    /// return.
    pub fn control(&mut self, mesh: &Mesh, particles: &mut Particles, count: &mut Count) {
        self.refills.clear();
        count.merges += self.merging.thin(mesh, particles, 3 * self.target() + 4);
        self.split(mesh, particles, count);
    }

    fn target(&self) -> usize {
        self.seeding.count()
    }

    fn split(&mut self, mesh: &Mesh, particles: &mut Particles, count: &mut Count) {
        let mut room = std::mem::take(&mut self.room);
        let Room { lacking, members, kin, places, added } = &mut room;
        added.clear();
        threads::for_each(lacking, GRAIN, |cell, lacks| {
            *lacks = self.lacks(mesh, particles, cell);
        });
        for cell in (0..mesh.cells()).filter(|&c| lacking[c]) {
            members.clear();
            members.extend(particles.of_cell(cell));
            let need = self.need(mesh, particles, cell);
            let section = mesh.section(mesh.cell_volume(cell), mesh.cell_centre(cell));
            let nominal = section / self.target() as f64;
            loop {
                let place = |&p: &usize| mesh.to_reference(cell, particles.position[p]);
                places.clear();
                places.extend(members.iter().map(place));
                let Some(gap) = self.gap(mesh, cell, places, need) else { break };
                let parent = nearest(mesh, particles, cell, members, gap, SPLIT * nominal);
                particles.volume[parent] *= 0.5;
                particles.duplicate(parent);
                let child = particles.len() - 1;
                members.push(child);
                added.push(cell as u32);
                let kind = particles.material[child];
                kin.clear();
                kin.extend(members.iter().filter(|&&p| particles.material[p] == kind));
                let fields = CarriedFields::new(mesh, particles, cell, kin, places);
                particles.position[child] = mesh.from_reference(cell, gap);
                keep_centroid(mesh, particles, cell, kin, (parent, child));
                fields.follow(mesh, particles, cell, kin);
                count.splits += 1;
            }
        }
        if !added.is_empty() {
            particles.settle(added);
        }
        self.room = room;
        while self.heal_all(mesh, particles, count) {}
    }

    /// Refills empty cells that have a neighbour with particles; returns whether there were any.
    /// Cells whose neighbours are all empty are refilled in later calls.
    fn heal_all(&mut self, mesh: &Mesh, particles: &mut Particles, count: &mut Count) -> bool {
        let Surrounding::Material(background) = self.around else { return false };
        let mut added = std::mem::take(&mut self.room.added);
        added.clear();
        for cell in refilling::empty_cells(mesh, particles) {
            let refill = refilling::refill(mesh, &self.neighbours, particles, cell);
            let Some(refill) = refill else { continue };
            count.healed += u64::from(!refill.amid && Some(refill.material) != background);
            self.refills.push(refill);
            added.push(cell as u32);
        }
        let any = !added.is_empty();
        if any {
            particles.settle(&added);
        }
        self.room.added = added;
        any
    }

    /// Particles that a cell needs at most.
    fn largest_need(&self) -> Need {
        Need { least: (self.target() / 2).max(1), quadrants: self.target() >= 4 }
    }

    /// Particles that a cell needs.
    fn need(&self, mesh: &Mesh, particles: &Particles, cell: usize) -> Need {
        let is_empty = |c: usize| particles.of_cell(c).is_empty() && !mesh.solid[c];
        if self.around == Surrounding::Void && mesh.block(cell).any(is_empty) {
            // At the surface, the number of particles follows from what they fill.
            return Need { least: 0, quadrants: false };
        }
        if let Some(part) = mesh.part(cell) {
            let least = (part.fraction * self.target() as f64 / 2.0).ceil() as usize;
            return Need { least, quadrants: false };
        }
        if mesh.block(cell).any(|c| mesh.part(c).is_some()) {
            // Beside slanted walls the flow thins out the particles of single cells.
            return self.largest_need();
        }
        if mesh.whole_measure(cell).tilt() > NEAR_AXIS {
            // Towards an axis particles move apart in the section.
            return self.largest_need();
        }
        let carries = particles.director.is_some()
            || particles.viscosity.is_some()
            || particles.density.is_some();
        let mut own = particles.of_cell(cell);
        let mut around = self.neighbours.of(cell).flat_map(|n| particles.of_cell(n));
        let first = particles.material[own.start];
        let [area, corner] = size_factors(mesh, cell);
        let of_part = |part: f64, number: usize| ((part * number as f64).ceil() as usize).max(1);
        if carries || own.any(|p| particles.material[p] != first) {
            self.largest_need()
        } else if around.all(|p| particles.material[p] == first) {
            // A cell beside an empty one has to give it particles.
            let beside_empty = self.neighbours.of(cell).any(is_empty);
            let part = if beside_empty { 1.0 } else { area.max(corner) };
            Need { least: of_part(part, self.target() / 4), quadrants: false }
        } else {
            let Need { least, quadrants } = self.largest_need();
            let part = corner.max(LEAST_BESIDE);
            Need { least: of_part(part, least), quadrants: quadrants && part >= WITH_QUADRANTS }
        }
    }

    /// Whether a cell that is not empty has fewer particles than it needs.
    fn lacks(&self, mesh: &Mesh, particles: &Particles, cell: usize) -> bool {
        // Most cells have enough by the largest need, which is known without their neighbours.
        !particles.of_cell(cell).is_empty()
            && falls_short(mesh, particles, cell, self.largest_need())
            && falls_short(mesh, particles, cell, self.need(mesh, particles, cell))
    }

    /// Position (reference coordinates) for a new particle: the centre of an empty quadrant, or, if
    /// the cell has too few particles, the lattice point farthest from all of them.
    fn gap(&self, mesh: &Mesh, cell: usize, places: &[[f64; 2]], need: Need) -> Option<[f64; 2]> {
        let middle = |r: &[f64; 2]| from_middle(mesh, mesh.from_reference(cell, *r));
        if need.quadrants {
            let empty = (0..4).map(quadrant).filter(|c| !places.iter().any(|r| holds(c, r)));
            let first = cheapest(empty.map(|c| (0.0, c)), middle);
            if first.is_some() {
                return first;
            }
        }
        if places.len() >= need.least {
            return None;
        }
        let lattice = (0..16).map(|k| [-0.75 + 0.5 * (k % 4) as f64, -0.75 + 0.5 * (k / 4) as f64]);
        let clearance = |g: &[f64; 2]| {
            places
                .iter()
                .map(|r| (r[0] - g[0]).powi(2) + (r[1] - g[1]).powi(2))
                .fold(f64::INFINITY, f64::min)
        };
        let lattice = lattice.filter(|g| !mesh.is_solid_in(cell, mesh.from_reference(cell, *g)));
        cheapest(lattice.map(|g| (-clearance(&g), g)), middle)
    }
}

/// Area of a cell over that of the largest, and the square of its aspect ratio if its sides are measured in those of
/// the largest: 1 at the places towards which a mesh is refined, where the flow is sensitive to the interface, and
/// less in the strips of small cells that its lines make elsewhere.
fn size_factors(mesh: &Mesh, cell: usize) -> [f64; 2] {
    let size = mesh.cell_size(cell);
    let [a, b] = [size[0] / mesh.x.largest(), size[1] / mesh.y.largest()];
    [a * b, (a / b).min(b / a).powi(2)]
}

/// Whether a cell has fewer particles than a need.
fn falls_short(mesh: &Mesh, particles: &Particles, cell: usize, need: Need) -> bool {
    let members = particles.of_cell(cell);
    if members.len() < need.least {
        return true;
    }
    let (centre, [hx, hy]) = (mesh.cell_centre(cell), mesh.cell_size(cell));
    let mut held = [false; 4];
    for p in &particles.position[members] {
        let r = [2.0 * (p[0] - centre[0]) / hx, 2.0 * (p[1] - centre[1]) / hy];
        for (q, held) in held.iter_mut().enumerate() {
            *held |= holds(&quadrant(q), &r);
        }
    }
    need.quadrants && held.contains(&false)
}

/// Centre of the quadrant `q` in reference coordinates.
fn quadrant(q: usize) -> [f64; 2] {
    [(q % 2) as f64 - 0.5, (q / 2) as f64 - 0.5]
}

/// Whether the quadrant around `centre` contains a point; a point on the line between two quadrants
/// is in both.
fn holds(centre: &[f64; 2], r: &[f64; 2]) -> bool {
    (0..2).all(|k| centre[k] * r[k] > -SAME)
}

/// The member nearest to `place` among those with at least the section `least`; if there are none, the
/// largest member.
fn nearest(
    mesh: &Mesh,
    particles: &Particles,
    cell: usize,
    members: &[usize],
    place: [f64; 2],
    least: f64,
) -> usize {
    let distance = |p: usize| {
        let r = mesh.to_reference(cell, particles.position[p]);
        (r[0] - place[0]).powi(2) + (r[1] - place[1]).powi(2)
    };
    let middle = |&p: &usize| from_middle(mesh, particles.position[p]);
    let section = |p: usize| mesh.section(particles.volume[p], particles.position[p]);
    let large = members.iter().copied().filter(|&p| section(p) >= least);
    cheapest(large.map(|p| (distance(p), p)), middle)
        .or_else(|| cheapest(members.iter().map(|&p| (-section(p), p)), middle))
        .unwrap_or(members[0])
}

/// Shifts all particles of the material of `parent` and `child` in the cell so that their centroid
/// is the same as before the split, when the volume of the child was at the position of the parent.
/// No particle leaves the cell.
fn keep_centroid(
    mesh: &Mesh,
    particles: &mut Particles,
    cell: usize,
    kin: &[usize],
    (parent, child): (usize, usize),
) {
    let volume: f64 = kin.iter().map(|&p| particles.volume[p]).sum();
    let share = particles.volume[child] / volume;
    let shift =
        [0, 1].map(|c| share * (particles.position[parent][c] - particles.position[child][c]));
    for &p in kin {
        let [x, y] = particles.position[p];
        particles.move_inside(mesh, cell, (p, [x + shift[0], y + shift[1]]));
    }
}

/// Tilt of the cell from which on it is near the axis: the two columns beside it.
const NEAR_AXIS: f64 = 0.3;
