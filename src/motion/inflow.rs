//! This module lets material enter through the sides of the domain and through nozzles, so that the
//! particles fill the domain while material is pushed in, or while material leaves it elsewhere.
//!
//! The volume that the velocity carries inwards across a part `F` of a face in a step,
//!
//! ```text
//! V = dt max(-integral over F of u . n, 0)
//! ```
//! becomes material next to the face. It is divided into parts that are not larger than a usual
//! particle, which lie where what enters evenly during the step is at its end. Each is added to the
//! nearest small particle of its material in the cell, which moves so that the centroid of the
//! volumes is kept, or makes a new particle. So the volume of all particles changes by what enters
//! and what leaves, to rounding, and no volume is kept anywhere else. What enters carries the
//! directors, the viscosity and the density that the scene gives at the face.

use super::gauges::Counter;
use crate::plan::{Entering, InitialFields, Plan};
use crate::space::count::Crossing;
use crate::space::mesh::{INSIDE, Mesh};
use crate::space::particles::Particles;
use crate::space::shape::{SIDE_NODES, Shape, side_end, side_normal, side_point};

/// Pieces of a part of a face that a solid may cover.
const PIECES: usize = 16;

/// Faces on sides of the domain and of nozzles through which material may enter.
#[derive(Clone, Debug)]
pub struct Inflow {
    faces: Vec<Face>,
    /// What enters through the faces.
    entering: Vec<Entering>,
    /// Number of particles along a cell at the start.
    particles_along: usize,
}

/// A face through which material may enter.
#[derive(Clone, Copy, Debug)]
struct Face {
    cell: usize,
    /// Side of the cell.
    side: usize,
    /// Index into [`Inflow::entering`].
    entering: usize,
}

/// A part of what enters through a face in a step.
struct Entry {
    cell: usize,
    material: u8,
    volume: f64,
    /// Its position at the end of the step.
    at: [f64; 2],
    /// A point on the other side of the face from which it came, and one on the face.
    from: [f64; 2],
    through: [f64; 2],
    /// Director, viscosity and density that it carries.
    carried: ([f64; 2], [f64; 2]),
}

impl Inflow {
    /// The faces of a plan through which it is known what enters; `None` if there are none.
    pub fn new(plan: &Plan) -> Option<Inflow> {
        let (mesh, void) = (&plan.mesh, plan.void());
        let mut out =
            Inflow { faces: vec![], entering: vec![], particles_along: plan.method.seeding.side };
        for (side, piece) in plan.boundary.pieces() {
            let Some(entering) = &piece.enters else { continue };
            let cells = piece.segment.cells_at_side(mesh, side).map(|(_, cell)| cell);
            out.add_faces((mesh, void), entering, cells.map(|cell| (cell, side)));
        }
        for source in &plan.boundary.sources {
            out.add_faces((mesh, void), &source.entering, source.faces(mesh));
        }
        (!out.faces.is_empty()).then_some(out)
    }

    /// Adds faces, which are sides of cells, unless a void would enter.
    fn add_faces(
        &mut self,
        (mesh, void): (&Mesh, Option<u8>),
        entering: &Entering,
        faces: impl Iterator<Item = (usize, usize)>,
    ) {
        if void == Some(entering.material) {
            return;
        }
        self.entering.push(entering.clone());
        let entering = self.entering.len() - 1;
        let faces = faces.filter(|&(cell, _)| !mesh.solid[cell]);
        self.faces.extend(faces.map(|(cell, side)| Face { cell, side, entering }));
    }

    /// The cells at the faces through which a material other than `background` may enter.
    pub fn cells_of_interest(&self, background: Option<u8>) -> impl Iterator<Item = usize> + '_ {
        let of_interest = move |f: &&Face| Some(self.entering[f.entering].material) != background;
        self.faces.iter().filter(of_interest).map(|f| f.cell)
    }

    /// Adds what enters in a step of length `dt` with the nodal velocities `velocity`, counts it at
    /// the gauges, and adds it to `crossings`. `particles` must be sorted, and are sorted on return.
    pub fn enter(
        &self,
        plan: &Plan,
        (velocity, dt): (&[[f64; 2]], f64),
        particles: &mut Particles,
        gauges: &mut [Counter],
        crossings: &mut Vec<Crossing>,
    ) {
        let mesh = &*plan.mesh;
        let before = particles.len();
        for face in &self.faces {
            for k in 0..self.particles_along {
                self.entries(plan, (velocity, dt), face, k, |entry| {
                    for gauge in gauges.iter_mut() {
                        gauge.pass(mesh, entry.from, entry.at, entry.material, entry.volume);
                    }
                    let Entry { material, volume, through, .. } = entry;
                    crossings.push(Crossing {
                        enters: true,
                        material,
                        volume,
                        density: particles.density.is_some().then_some(entry.carried.1[1]),
                        at: through,
                    });
                    self.add(mesh, particles, &entry);
                });
            }
        }
        if particles.len() != before {
            particles.sort(mesh);
        }
    }

    /// Calls `add` with what enters through part `k` of the parts of equal size of a face.
    fn entries(
        &self,
        plan: &Plan,
        (velocity, dt): (&[[f64; 2]], f64),
        &Face { cell: home, side, entering }: &Face,
        k: usize,
        mut add: impl FnMut(Entry),
    ) {
        let mesh = &*plan.mesh;
        let normal = side_normal(side);
        let outwards = side_end(side);
        let nodes = mesh.cell_nodes(home);
        let nodal = SIDE_NODES[side].map(|a| velocity[nodes[a]]);
        let area = mesh.face(home, side);
        let at = |t: f64, c: usize| -> f64 {
            let u: f64 = Shape::line(t).into_iter().zip(nodal).map(|(n, u)| n * u[c]).sum();
            u * area.thickness(t)
        };
        let width = 2.0 / self.particles_along as f64;
        let low = -1.0 + k as f64 * width;
        let [middle, high] = [low + 0.5 * width, low + width];
        // Nothing enters through what a solid covers.
        let free = |t: f64| !mesh.is_solid_in(home, mesh.from_reference(home, side_point(side, t)));
        let mean = |c: usize| {
            if mesh.part(home).is_none() {
                // Simpson's rule is exact for quadratic functions.
                return (at(low, c) + 4.0 * at(middle, c) + at(high, c)) / 6.0;
            }
            let pieces = (0..PIECES).map(|k| low + width * (k as f64 + 0.5) / PIECES as f64);
            pieces.filter(|&t| free(t)).map(|t| at(t, c)).sum::<f64>() / PIECES as f64
        };
        let speed = -outwards * mean(normal);
        if speed <= 0.0 {
            return;
        }
        let size = mesh.cell_size(home);
        let volume = dt * speed * area.area / self.particles_along as f64;
        // Where cells are made smaller by grading, a step crosses several of them.
        let depth = dt * speed / size[normal];
        let drift = 2.0 * dt * mean(1 - normal) / size[1 - normal];
        let point = |inside: f64, along: f64| {
            let across = outwards * (1.0 - 2.0 * inside);
            let r = if normal == 0 { [across, along] } else { [along, across] };
            mesh.from_reference(home, r)
        };
        let material = self.entering[entering].material;
        let carried = self.carried(plan, &self.entering[entering], point(0.0, middle));
        let parts = (volume / self.usual(mesh, home, point(0.0, middle))).ceil().max(1.0);
        for part in 0..parts as usize {
            let share = (part as f64 + 0.5) / parts;
            let along = (middle + share * drift).clamp(-INSIDE, INSIDE);
            let inside = share * depth;
            let (mut cell, mut at) = (home, point(inside, along));
            if inside >= 1.0 {
                cell = mesh.locate(at);
                if mesh.solid[cell] {
                    (cell, at) = (home, point(0.5 * (1.0 + INSIDE), along));
                }
            }
            let [from, through] = [-inside, 0.0].map(|inside| point(inside, middle));
            if mesh.is_solid_in(cell, at) {
                let place = mesh.part(cell).and_then(|part| mesh.free_place(cell, part));
                at = place.or_else(|| mesh.nearest_free(at)).unwrap_or(at);
                cell = mesh.locate(at);
            }
            let volume = volume / parts;
            add(Entry { cell, material, volume, at, from, through, carried });
        }
    }

    /// Director, and viscosity and density, that a particle carries which enters at a point.
    fn carried(&self, plan: &Plan, entering: &Entering, at: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let [x, y] = plan.si(at);
        let angle = entering.director.as_ref().map_or(90.0, |f| f.at(x, y)).to_radians();
        let InitialFields { viscosity, density } = &plan.initial[usize::from(entering.material)];
        let fields = [(viscosity, plan.units.viscosity), (density, plan.units.density)];
        let values = fields.map(|(f, unit)| f.as_ref().map_or(0.0, |f| f.at(x, y) / unit));
        ([angle.cos(), angle.sin()], values)
    }

    /// Volume of a usual particle at a point of a cell.
    fn usual(&self, mesh: &Mesh, cell: usize, at: [f64; 2]) -> f64 {
        let (measure, [xi, _]) = (mesh.cell_measure(cell), mesh.to_reference(cell, at));
        measure.share(measure.volume(), xi) / self.particles_along.pow(2) as f64
    }

    /// Adds an entry to the nearest particle of its material in its cell that is not larger than
    /// usual afterwards, or else as a new particle.
    fn add(&self, mesh: &Mesh, particles: &mut Particles, entry: &Entry) {
        let &Entry { cell, material, volume, at, carried: (director, values), .. } = entry;
        let usual = self.usual(mesh, cell, at);
        let [hx, hy] = mesh.cell_size(cell);
        let distance = |p: usize| {
            let d = particles.position[p];
            ((d[0] - at[0]) / hx).powi(2) + ((d[1] - at[1]) / hy).powi(2)
        };
        let marked = |p: usize| particles.mark.as_ref().is_some_and(|m| m[p]);
        let small = |&p: &usize| {
            particles.material[p] == material && particles.volume[p] + volume <= usual && !marked(p)
        };
        let nearest = particles
            .of_cell(cell)
            .filter(small)
            .min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        particles.push(at, volume, material);
        let new = particles.len() - 1;
        if let Some(column) = &mut particles.director {
            column[new] = director;
        }
        for (column, value) in
            [&mut particles.viscosity, &mut particles.density].into_iter().zip(values)
        {
            if let Some(column) = column {
                column[new] = value;
            }
        }
        if let Some(p) = nearest {
            particles.absorb(mesh, cell, (p, new));
            particles.pop();
        }
    }
}
