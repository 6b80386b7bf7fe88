//! Population control: no cell runs empty or overfull.
//!
//! A cell that lacks particles, or has none in one of its quadrants, splits the particle nearest
//! to the gap: the child takes half of its volume, and all of its kind there move a little so that
//! their centroid stays. An overfull cell merges its closest pairs of one material. Volume and
//! centroid are kept material by material (so a level at rest stays there, and no potential energy
//! is made); directors are averaged as axes.
//!
//! Of choices that are equal but for rounding, the one nearest to the middle of the domain is
//! taken, so that mirror images decide alike. Otherwise a symmetric jet leans over: that of the
//! silo, at 6 cells per aperture graded by 8, by a quarter of the aperture at 0.7 ms.

use super::fit::{Degree, Fit, Polynomial};
use super::mesh::Mesh;
use super::neighbours::Neighbours;
use super::particles::Particles;
use super::seeding::Seeding;
use super::walls::Enclosure;
use crate::laws::director;
use crate::threads;

/// Particles of this share of the usual volume are split before smaller ones, which would make
/// volumes ever more unequal: after 10,000 steps of a steady vortex, cells of 16 were off by 1.01 rows
/// of particles with a quarter, and are by 0.91 with this (at random places they would be by 0.8).
const SPLIT: f64 = 0.7;

/// Cells that are worth a task of their own.
const GRAIN: usize = 256;

/// Shifted particles stay within this, in half cells.
const INSIDE: f64 = 0.999;

/// What was done, added up over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    pub splits: u64,
    pub merges: u64,
    /// Particles held back at walls that their step would have crossed.
    pub held: u64,
    /// Particles that left through an open side.
    pub left: u64,
    /// Empty cells refilled from a neighbour.
    pub healed: u64,
}

/// Bounds on the number of particles per cell.
#[derive(Clone, Debug)]
pub struct Population {
    seeding: Seeding,
    neighbours: Neighbours,
    room: Room,
}

/// Room that is kept from step to step.
#[derive(Clone, Debug, Default)]
struct Room {
    /// Cells that lack particles.
    lacking: Vec<bool>,
    /// Particles of a cell, and those of one kind.
    members: Vec<usize>,
    kin: Vec<usize>,
    /// Their reference coordinates.
    places: Vec<[f64; 2]>,
}

impl Population {
    pub fn new(mesh: &Mesh, enclosure: &Enclosure, seeding: Seeding) -> Self {
        let room = Room { lacking: vec![false; mesh.cells()], ..Room::default() };
        Population { seeding, neighbours: Neighbours::new(mesh, enclosure), room }
    }

    /// Restores the bounds. `particles` must be sorted, and are sorted on return.
    pub fn control(&mut self, mesh: &Mesh, particles: &mut Particles, count: &mut Count) {
        self.merge(mesh, particles, count);
        self.split(mesh, particles, count);
    }

    fn target(&self) -> usize {
        self.seeding.count()
    }

    fn split(&mut self, mesh: &Mesh, particles: &mut Particles, count: &mut Count) {
        let before = particles.len();
        let least = (self.target() / 2).max(1);
        let mut room = std::mem::take(&mut self.room);
        let Room { lacking, members, kin, places } = &mut room;
        threads::for_each(lacking, GRAIN, |cell, lacks| {
            *lacks = self.lacks(mesh, particles, cell, least);
        });
        for cell in (0..mesh.cells()).filter(|&c| lacking[c]) {
            members.clear();
            members.extend(particles.of_cell(cell));
            let nominal = mesh.cell_area(cell) / self.target() as f64;
            loop {
                let place = |&p: &usize| mesh.to_reference(cell, particles.position[p]);
                places.clear();
                places.extend(members.iter().map(place));
                let Some(gap) = self.gap(mesh, cell, places, least) else { break };
                let parent = nearest(mesh, particles, cell, members, gap, SPLIT * nominal);
                particles.volume[parent] *= 0.5;
                particles.duplicate(parent);
                let child = particles.len() - 1;
                members.push(child);
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
        self.room = room;
        if particles.len() != before {
            particles.sort(mesh);
        }
        while self.heal_all(mesh, particles, count) {}
    }

    /// Refills empty cells that have a neighbour that is not; whether there were any. Cells amid
    /// empty ones come next, from their refilled neighbours.
    fn heal_all(&self, mesh: &Mesh, particles: &mut Particles, count: &mut Count) -> bool {
        let before = particles.len();
        for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
            if particles.of_cell(cell).is_empty() {
                count.healed += u64::from(self.heal(mesh, particles, cell));
            }
        }
        let any = particles.len() != before;
        if any {
            particles.sort(mesh);
        }
        any
    }

    /// Whether a cell that holds particles has too few, or none in a quadrant.
    fn lacks(&self, mesh: &Mesh, particles: &Particles, cell: usize, least: usize) -> bool {
        let members = particles.of_cell(cell);
        if members.len() < least {
            return !members.is_empty();
        }
        let (centre, [hx, hy]) = (mesh.cell_centre(cell), mesh.cell_size(cell));
        let mut held = [false; 4];
        for p in &particles.position[members] {
            let r = [2.0 * (p[0] - centre[0]) / hx, 2.0 * (p[1] - centre[1]) / hy];
            for (q, held) in held.iter_mut().enumerate() {
                *held |= holds(&quadrant(q), &r);
            }
        }
        self.target() >= 4 && held.contains(&false)
    }

    /// A place (reference coordinates) that lacks a particle: in an empty quadrant, or, where
    /// the cell has too few, the lattice point farthest from all.
    fn gap(&self, mesh: &Mesh, cell: usize, places: &[[f64; 2]], least: usize) -> Option<[f64; 2]> {
        if self.target() >= 4 {
            let empty = (0..4).map(quadrant).filter(|c| !places.iter().any(|r| holds(c, r)));
            let first =
                cheapest(empty.map(|c| (0.0, from_middle(mesh, mesh.from_reference(cell, c)), c)));
            if first.is_some() {
                return first;
            }
        }
        if places.len() >= least {
            return None;
        }
        let lattice = (0..16).map(|k| [-0.75 + 0.5 * (k % 4) as f64, -0.75 + 0.5 * (k / 4) as f64]);
        let clearance = |g: &[f64; 2]| {
            places
                .iter()
                .map(|r| (r[0] - g[0]).powi(2) + (r[1] - g[1]).powi(2))
                .fold(f64::INFINITY, f64::min)
        };
        cheapest(
            lattice.map(|g| (-clearance(&g), from_middle(mesh, mesh.from_reference(cell, g)), g)),
        )
    }

    /// Refills an empty cell with half of the largest particle of its neighbours.
    fn heal(&self, mesh: &Mesh, particles: &mut Particles, cell: usize) -> bool {
        let donor = cheapest(
            self.neighbours
                .of(cell)
                .flat_map(|n| particles.of_cell(n))
                .map(|p| (-particles.volume[p], from_middle(mesh, particles.position[p]), p)),
        );
        let Some(donor) = donor else { return false };
        particles.volume[donor] *= 0.5;
        particles.duplicate(donor);
        let child = particles.len() - 1;
        particles.position[child] = mesh.cell_centre(cell);
        true
    }

    fn merge(&self, mesh: &Mesh, particles: &mut Particles, count: &mut Count) {
        let most = 2 * self.target() + 4;
        let mut gone = Vec::new();
        for cell in 0..mesh.cells() {
            if particles.of_cell(cell).len() <= most {
                continue;
            }
            let mut members: Vec<usize> = particles.of_cell(cell).collect();
            while members.len() > most {
                let Some((a, b)) = closest_pair(mesh, particles, cell, &members) else { break };
                particles.absorb(a, b);
                gone.resize(particles.len(), false);
                gone[b] = true;
                members.retain(|&p| p != b);
                count.merges += 1;
            }
        }
        if !gone.is_empty() {
            particles.remove(&gone);
            particles.sort(mesh);
        }
    }
}

/// Centre of a quadrant in reference coordinates.
fn quadrant(q: usize) -> [f64; 2] {
    [(q % 2) as f64 - 0.5, (q / 2) as f64 - 0.5]
}

/// Whether the quadrant around `centre` holds a place; one on the line between two is in both.
fn holds(centre: &[f64; 2], r: &[f64; 2]) -> bool {
    (0..2).all(|k| centre[k] * r[k] > -SAME)
}

/// The member nearest to a place among those of at least `least_volume`; failing that, the
/// largest.
fn nearest(
    mesh: &Mesh,
    particles: &Particles,
    cell: usize,
    members: &[usize],
    place: [f64; 2],
    least_volume: f64,
) -> usize {
    let distance = |p: usize| {
        let r = mesh.to_reference(cell, particles.position[p]);
        (r[0] - place[0]).powi(2) + (r[1] - place[1]).powi(2)
    };
    let middle = |p: usize| from_middle(mesh, particles.position[p]);
    let large = members.iter().copied().filter(|&p| particles.volume[p] >= least_volume);
    cheapest(large.map(|p| (distance(p), middle(p), p)))
        .or_else(|| cheapest(members.iter().map(|&p| (-particles.volume[p], middle(p), p))))
        .unwrap_or(members[0])
}

/// Shifts a parent, its child, whose volume came from the parent's place, and all others of their
/// kind in the cell such that their centroid is what it was; none leaves the cell.
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
        let r = mesh.to_reference(cell, [x + shift[0], y + shift[1]]);
        particles.position[p] = mesh.from_reference(cell, r.map(|c| c.clamp(-INSIDE, INSIDE)));
    }
}

/// Fields that particles of one kind carry in a cell, as polynomials: particles that are moved
/// without flow take the field's difference between their places with them. Without it, a
/// child has its parent's density at a place where the density is another, a first-order error.
struct CarriedFields<'a> {
    density: Option<Polynomial>,
    log_viscosity: Option<Polynomial>,
    /// Where they were, in reference coordinates.
    places: &'a [[f64; 2]],
}

impl<'a> CarriedFields<'a> {
    /// `places`: room.
    fn new(
        mesh: &Mesh,
        particles: &Particles,
        cell: usize,
        kin: &[usize],
        places: &'a mut Vec<[f64; 2]>,
    ) -> Self {
        places.clear();
        places.extend(kin.iter().map(|&p| mesh.to_reference(cell, particles.position[p])));
        let fit = |value: &dyn Fn(usize) -> f64| {
            let mut fit = Fit::default();
            for (&p, &r) in kin.iter().zip(&*places) {
                fit.add(particles.volume[p], r, value(p));
            }
            fit.solve(Degree::Quadratic)
        };
        CarriedFields {
            density: particles.density.as_ref().and_then(|d| fit(&|p| d[p])),
            log_viscosity: particles.viscosity.as_ref().and_then(|v| fit(&|p| v[p].ln())),
            places,
        }
    }

    fn follow(&self, mesh: &Mesh, particles: &mut Particles, cell: usize, kin: &[usize]) {
        for (&p, &before) in kin.iter().zip(self.places) {
            let now = mesh.to_reference(cell, particles.position[p]);
            let change = |f: &Polynomial| f.at_bounded(now) - f.at_bounded(before);
            if let (Some(column), Some(f)) = (&mut particles.density, &self.density) {
                column[p] += change(f);
            }
            if let (Some(column), Some(f)) = (&mut particles.viscosity, &self.log_viscosity) {
                column[p] *= change(f).exp();
            }
        }
    }
}

/// Differences below this are rounding: of reference coordinates, and of costs relative to them.
const SAME: f64 = 1e-9;

/// Squared distance from the middle of the domain: the same for mirror images.
fn from_middle(mesh: &Mesh, p: [f64; 2]) -> f64 {
    let x = p[0] - 0.5 * (mesh.x.start() + mesh.x.end());
    let y = p[1] - 0.5 * (mesh.y.start() + mesh.y.end());
    x * x + y * y
}

/// The choice of least cost among `(cost, from_middle, choice)`; of equal ones the innermost.
fn cheapest<T>(choices: impl Iterator<Item = (f64, f64, T)>) -> Option<T> {
    let better = |a: &(f64, f64, T), b: &(f64, f64, T)| {
        let slack = SAME * b.0.abs();
        a.0 < b.0 - slack || (a.0 <= b.0 + slack && a.1 < b.1)
    };
    choices.reduce(|best, next| if better(&next, &best) { next } else { best }).map(|c| c.2)
}

/// The two members of one kind that cost least to merge: close and small.
fn closest_pair(
    mesh: &Mesh,
    particles: &Particles,
    cell: usize,
    members: &[usize],
) -> Option<(usize, usize)> {
    let [hx, hy] = mesh.cell_size(cell);
    let marked = |p: usize| particles.mark.as_ref().is_some_and(|m| m[p]);
    let pairs = members
        .iter()
        .enumerate()
        .flat_map(|(k, &a)| members[k + 1..].iter().map(move |&b| (a, b)));
    let kin = pairs
        .filter(|&(a, b)| particles.material[a] == particles.material[b] && marked(a) == marked(b));
    cheapest(kin.map(|(a, b)| {
        let (pa, pb) = (particles.position[a], particles.position[b]);
        let r2 = ((pa[0] - pb[0]) / hx).powi(2) + ((pa[1] - pb[1]) / hy).powi(2);
        let (va, vb) = (particles.volume[a], particles.volume[b]);
        let cost = r2 * va * vb / (va + vb);
        (cost, from_middle(mesh, pa) + from_middle(mesh, pb), (a, b))
    }))
}

impl Particles {
    /// Appends a particle of a material that carries nothing of its own.
    pub fn push(&mut self, position: [f64; 2], volume: f64, material: u8) {
        self.position.push(position);
        self.volume.push(volume);
        self.material.push(material);
        if let Some(d) = &mut self.director {
            d.push([0.0, 1.0]);
        }
        if let Some(v) = &mut self.viscosity {
            v.push(0.0);
        }
        if let Some(d) = &mut self.density {
            d.push(0.0);
        }
        if let Some(m) = &mut self.mark {
            m.push(false);
        }
    }

    /// Joins particle `b` to `a` (which keeps its place in the list): volumes add up, position
    /// and carried values are means weighted by volume, directors are averaged as axes.
    pub fn absorb(&mut self, a: usize, b: usize) {
        let (va, vb) = (self.volume[a], self.volume[b]);
        let (fa, fb) = (va / (va + vb), vb / (va + vb));
        self.volume[a] = va + vb;
        for c in 0..2 {
            self.position[a][c] = fa * self.position[a][c] + fb * self.position[b][c];
        }
        if let Some(d) = &mut self.director {
            let [p, q] = [d[a], d[b]];
            let product = |i: usize, j: usize| fa * p[i] * p[j] + fb * q[i] * q[j];
            let n = director::axis(product(0, 0), product(1, 1), product(0, 1));
            d[a] = [n.x, n.y];
        }
        for column in [&mut self.viscosity, &mut self.density].into_iter().flatten() {
            column[a] = fa * column[a] + fb * column[b];
        }
    }
}
