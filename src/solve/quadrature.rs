//! From particles to integration points.
//!
//! **Mixture**. Gauss points of every cell see the materials of the cell's own
//! particles. The fraction of material `m` at Gauss point `g` is the particle volume near it,
//! weighted by `exp(-r^2 / (0.4 h)^2)`; each material has its own law there, and the laws mix as
//! [`Mixture`] says. A cell of one uniform material sees that law exactly, whatever its
//! particles' places, so its element matrix is a constant.
//!
//! **Laminate** (default). The same, but in cells that hold two materials the viscous stiffness is that of
//! [`laminate`], with the interface that [`interface`](super::interface) finds.
//! Where it finds none to trust (three materials, debris) the mixture stays. Sheets and drops below
//! a cell are told by [`minority`]: a stiff sheet is a laminate
//! with straight rims, and a drop makes its cells a dilute suspension. Rotation,
//! density and pictures are those of the mixture.
//!
//! **Particles**. Each particle is an integration point with its own law and a weight
//! proportional to its volume: the method of the source, for comparison.

use super::interface::{Interface, Surroundings};
use super::laminate::{self, Cut, VelocityMatrix};
use super::minority;
use crate::laws::point::{Mixture, PointLaw};
use crate::plan::material::{Material, Texture};
use crate::scene::Quadrature as Rule;
use crate::space::fit::{Degree, Fit, Polynomial};
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_3, GAUSS_3X3, GAUSS_6X6, SUBPOINTS, Shape};
use crate::threads::{self, Divisible};
use std::cell::RefCell;

/// Cells that are worth a task of their own.
const GRAIN: usize = 32;

/// Width of the fraction kernel in cells: 0.4 was the best of those measured.
const KERNEL_WIDTH: f64 = 0.4;

/// Matching of fractions to volumes stops here: far below the noise of the particles.
const MATCHING_TOLERANCE: f64 = 1e-6;
const MATCHING_ITERATIONS: usize = 30;

/// Of [`Quadrature::keep_volumes`]: how fast, how far in a step, and from how many cut cells on.
const VOLUME_GAIN: f64 = 0.3;
const LARGEST_STEP: f64 = 0.05;
const LEAST_RESPONSE: f64 = 1e-4;

/// One integration point of a cell.
#[derive(Clone, Copy, Debug, Default)]
pub struct IntegrationPoint {
    pub law: PointLaw,
    /// Of particles as integration points; Gauss points have theirs from `weight`.
    pub density: f64,
    /// Share of the cell's area.
    pub weight: f64,
    /// Reference coordinates.
    pub r: [f64; 2],
}

/// What a cell is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// One uniform material, named by its index and the version of the material table.
    Uniform { material: u8, version: u32 },
    /// Anything else: to be evaluated afresh.
    Mixed,
    /// A solid block.
    Solid,
    /// Not evaluated yet.
    Unknown,
}

/// Viscous stiffness of a cell cut by an interface.
#[derive(Clone)]
pub struct CutStiffness {
    pub matrix: VelocityMatrix,
    /// Share of the viscosity that the integration points still have.
    pub rest: f64,
}

/// Integration points of all cells, and means the solver needs.
pub struct Quadrature {
    rule: Rule,
    points: Vec<IntegrationPoint>,
    start: Vec<u32>,
    content: Vec<Content>,
    /// Of cut cells, by the laminate rule.
    cut: Vec<Option<Box<CutStiffness>>>,
    /// Mean viscosity of each cell's points; scales the penalty.
    pub mean_viscosity: Vec<f64>,
    /// Mean 1/B of each cell.
    pub compliance: Vec<f64>,
    /// Share of each material in each cell.
    fractions: Vec<f64>,
    /// Factor on each material's volume in cut cells; see [`Quadrature::keep_volumes`].
    factors: Vec<f64>,
    materials: usize,
    /// Cells to be evaluated: room that is kept.
    fresh: Vec<bool>,
    /// What cells are made of by now; nothing is in an empty one.
    found: Vec<Option<Content>>,
}

/// A cell that holds no particles though no background fills it.
#[derive(Debug, thiserror::Error)]
#[error("cell {cell} at ({x:.4e}, {y:.4e}) holds no particles and no background material fills it")]
pub struct EmptyCell {
    pub cell: usize,
    pub x: f64,
    pub y: f64,
}

impl Quadrature {
    pub fn new(mesh: &Mesh, rule: Rule, materials: usize) -> Self {
        let cells = mesh.cells();
        let (points, start) = match rule {
            Rule::Mixture | Rule::Laminate => {
                let mut points = vec![IntegrationPoint::default(); 9 * cells];
                for (k, point) in points.iter_mut().enumerate() {
                    let g = &GAUSS_3X3[k % 9];
                    (point.weight, point.r) = (g.weight, g.r);
                }
                (points, (0..=cells as u32).map(|c| 9 * c).collect())
            }
            Rule::Particles => (Vec::new(), vec![0; cells + 1]),
        };
        Quadrature {
            rule,
            points,
            start,
            content: vec![Content::Unknown; cells],
            cut: vec![None; cells],
            mean_viscosity: vec![0.0; cells],
            compliance: vec![0.0; cells],
            fractions: vec![0.0; cells * materials],
            factors: vec![1.0; materials],
            materials,
            fresh: vec![false; cells],
            found: vec![None; cells],
        }
    }

    /// Gauss points with the law, density and viscosity that `at(cell, position)` gives: the
    /// integration that particles aim at, without any.
    pub fn from_fields(
        mesh: &Mesh,
        materials: usize,
        mut at: impl FnMut(usize, [f64; 2]) -> (PointLaw, f64, f64),
    ) -> Self {
        let mut out = Quadrature::new(mesh, Rule::Mixture, materials);
        for cell in 0..mesh.cells() {
            if mesh.solid[cell] {
                out.content[cell] = Content::Solid;
                continue;
            }
            out.content[cell] = Content::Mixed;
            for p in &mut out.points[9 * cell..9 * cell + 9] {
                let viscosity;
                (p.law, p.density, viscosity) = at(cell, mesh.from_reference(cell, p.r));
                out.mean_viscosity[cell] += p.weight * viscosity;
            }
        }
        out
    }

    pub fn content(&self, cell: usize) -> Content {
        self.content[cell]
    }

    /// The cell's nine points if they are those of the Gauss rule, row by row from below.
    pub fn gauss_points(&self, cell: usize) -> Option<&[IntegrationPoint; 9]> {
        match self.rule {
            Rule::Mixture | Rule::Laminate => self.points[9 * cell..9 * cell + 9].try_into().ok(),
            Rule::Particles => None,
        }
    }

    /// Viscous stiffness that a cell has besides that of its integration points, which then have
    /// only a part of theirs.
    pub fn cut(&self, cell: usize) -> Option<&CutStiffness> {
        self.cut[cell].as_deref()
    }

    /// Integration points of a cell with their shape functions.
    pub fn for_points(&self, cell: usize, mut f: impl FnMut(&IntegrationPoint, &Shape)) {
        let range = self.start[cell] as usize..self.start[cell + 1] as usize;
        match self.rule {
            Rule::Mixture | Rule::Laminate => {
                for (p, g) in self.points[range].iter().zip(GAUSS_3X3.iter()) {
                    f(p, &g.shape);
                }
            }
            Rule::Particles => {
                for p in &self.points[range] {
                    f(p, &Shape::at(p.r));
                }
            }
        }
    }

    /// Share of a material in a cell.
    pub fn fraction(&self, cell: usize, material: usize) -> f64 {
        self.fractions[cell * self.materials + material]
    }

    /// Factor on each material's volume in cut cells.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// Goes back to the factors of an earlier state.
    pub fn set_factors(&mut self, factors: &[f64]) {
        self.factors.copy_from_slice(factors);
    }

    /// Area of a material as the solver sees it.
    pub fn projected_area(&self, mesh: &Mesh, material: usize) -> f64 {
        let share = |cell| [self.fraction(cell, material) * mesh.cell_area(cell)];
        threads::sum(0..mesh.cells(), share)[0]
    }

    /// Evaluates all cells whose content is not known to be unchanged. `particles` sorted.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        materials: &[Material],
        version: u32,
    ) -> Result<(), EmptyCell> {
        let background = materials.iter().position(|m| m.background);
        if self.rule == Rule::Particles {
            self.points.clear();
        }
        threads::for_each(&mut self.found, GRAIN, |cell, found| {
            *found = if mesh.solid[cell] {
                Some(Content::Solid)
            } else {
                content(particles, cell, materials, background, version)
            };
        });
        for cell in 0..mesh.cells() {
            let content = self.found[cell].ok_or_else(|| {
                let [x, y] = mesh.cell_centre(cell);
                EmptyCell { cell, x, y }
            })?;
            // Particles as integration points move: their matrix is never the one before.
            let moving = self.rule == Rule::Particles && !particles.of_cell(cell).is_empty();
            let content = if moving { Content::Mixed } else { content };
            let unchanged = content != Content::Mixed && content == self.content[cell];
            self.content[cell] = content;
            self.fresh[cell] = !unchanged;
            if self.rule == Rule::Particles {
                self.list(mesh, cell, particles, materials);
            }
        }
        if self.rule != Rule::Particles {
            let from = Ingredients {
                rule: self.rule,
                mesh,
                particles,
                materials,
                content: &self.content,
                factors: &self.factors,
            };
            let cells = CellsMut {
                materials: self.materials,
                points: &mut self.points,
                cut: &mut self.cut,
                mean_viscosity: &mut self.mean_viscosity,
                compliance: &mut self.compliance,
                fractions: &mut self.fractions,
            };
            let fresh = &self.fresh;
            threads::for_parts(cells, 0..mesh.cells(), GRAIN, |range, mut cells| {
                SCRATCH.with_borrow_mut(|scratch| {
                    scratch.prepare(materials.len());
                    for (k, cell) in range.enumerate().filter(|&(_, c)| fresh[c]) {
                        cells.mix(k, cell, from, scratch);
                    }
                });
            });
            self.keep_volumes(mesh, particles);
        }
        Ok(())
    }

    /// Lets each material's projected area follow the volume of its particles, which is exact.
    ///
    /// In cut cells a material's share is that of its particles' volume times a factor of its
    /// own; the factors are adjusted a little each step,
    ///
    /// ```text
    /// d ln f_m = gain (V_m - P_m) / S_m,   P_m = sum A phi,   S_m = dP_m/d ln f_m = sum A phi (1 - phi)
    /// ```
    /// which shifts all of its rim by the same small distance (a hundredth of a cell on the
    /// silo). Without it the projected volume of the grains wanders by 0.3 %.
    fn keep_volumes(&mut self, mesh: &Mesh, particles: &Particles) {
        let [area] = threads::sum(0..mesh.cells(), |cell| {
            [if mesh.solid[cell] { 0.0 } else { mesh.cell_area(cell) }]
        });
        let [volume] = threads::sum(0..particles.len(), |p| [particles.volume[p]]);
        let scale = area / volume;
        for m in 0..self.materials {
            let [projected, response] = threads::sum(0..mesh.cells(), |cell| {
                let (phi, area) = (self.fraction(cell, m), mesh.cell_area(cell));
                // Nothing is in a solid one.
                [area * phi, area * phi * (1.0 - phi)]
            });
            // Without cut cells, or with next to none, there is no rim to shift.
            if response > LEAST_RESPONSE * area {
                let missing = (particles.volume_of(m) * scale - projected) / response;
                let step = (VOLUME_GAIN * missing).clamp(-LARGEST_STEP, LARGEST_STEP);
                self.factors[m] = (self.factors[m] * step.exp()).clamp(0.5, 2.0);
            }
        }
    }

    /// Particles as integration points.
    fn list(&mut self, mesh: &Mesh, cell: usize, particles: &Particles, materials: &[Material]) {
        let range = particles.of_cell(cell);
        if let Content::Uniform { material, .. } = self.content[cell] {
            let cells = &mut CellsMut {
                materials: self.materials,
                points: &mut [],
                cut: &mut [],
                mean_viscosity: &mut self.mean_viscosity,
                compliance: &mut self.compliance,
                fractions: &mut self.fractions,
            };
            let law = cells.fill_uniform(cell, material as usize, materials);
            if range.is_empty() {
                let density = materials[material as usize].density;
                self.points.extend(GAUSS_3X3.iter().map(|g| IntegrationPoint {
                    law,
                    density,
                    weight: g.weight,
                    r: g.r,
                }));
            }
        }
        let total: f64 = particles.volume[range.clone()].iter().sum();
        let fractions = &mut self.fractions[cell * self.materials..][..self.materials];
        if !range.is_empty() {
            fractions.fill(0.0);
            self.mean_viscosity[cell] = 0.0;
            self.compliance[cell] = 0.0;
        }
        for p in range {
            let index = particles.material[p] as usize;
            let m = &materials[index];
            let weight = particles.volume[p] / total;
            let eta = match &particles.viscosity {
                Some(v) if m.carries_viscosity => v[p],
                _ => m.viscosity,
            };
            let density = match &particles.density {
                Some(d) if m.carries_density => d[p],
                _ => m.density,
            };
            let mut texture = Texture::default();
            if let (Some(d), Some(_)) = (&particles.director, m.layer_viscosity) {
                texture.add(1.0, d[p]);
            }
            fractions[index] += weight;
            self.mean_viscosity[cell] += weight * eta;
            self.compliance[cell] += weight * m.compliance;
            let r = mesh.to_reference(cell, particles.position[p]);
            self.points.push(IntegrationPoint { law: m.law(eta, &texture), density, weight, r });
        }
        self.hold_rotation(cell, materials);
        self.start[cell + 1] = self.points.len() as u32;
    }

    /// Few particles of a Cosserat material leave its rotation undetermined in a cut cell: a
    /// billionth of its law at the Gauss points holds it.
    fn hold_rotation(&mut self, cell: usize, materials: &[Material]) {
        const HOLD: f64 = 1e-9;
        if self.content[cell] != Content::Mixed {
            return;
        }
        for (m, material) in materials.iter().enumerate() {
            let Some(rotation) = material.rotation else { continue };
            if self.fractions[cell * self.materials + m] > 0.0 {
                let law = PointLaw {
                    coupling: HOLD * rotation.coupling,
                    couple: HOLD * rotation.couple,
                    ..PointLaw::default()
                };
                self.points.extend(GAUSS_3X3.iter().map(|g| IntegrationPoint {
                    law,
                    density: 0.0,
                    weight: g.weight,
                    r: g.r,
                }));
            }
        }
    }
}

/// What cells are evaluated from.
#[derive(Clone, Copy)]
struct Ingredients<'a> {
    rule: Rule,
    mesh: &'a Mesh,
    particles: &'a Particles,
    materials: &'a [Material],
    content: &'a [Content],
    factors: &'a [f64],
}

/// What some consecutive cells have, to be written.
struct CellsMut<'a> {
    materials: usize,
    points: &'a mut [IntegrationPoint],
    cut: &'a mut [Option<Box<CutStiffness>>],
    mean_viscosity: &'a mut [f64],
    compliance: &'a mut [f64],
    fractions: &'a mut [f64],
}

impl Divisible for CellsMut<'_> {
    fn cut(self, at: usize) -> (Self, Self) {
        let materials = self.materials;
        let (p0, p1) = self.points.split_at_mut(9 * at);
        let (k0, k1) = self.cut.split_at_mut(at);
        let (v0, v1) = self.mean_viscosity.split_at_mut(at);
        let (c0, c1) = self.compliance.split_at_mut(at);
        let (f0, f1) = self.fractions.split_at_mut(materials * at);
        let part = |points, cut, mean_viscosity, compliance, fractions| CellsMut {
            materials,
            points,
            cut,
            mean_viscosity,
            compliance,
            fractions,
        };
        (part(p0, k0, v0, c0, f0), part(p1, k1, v1, c1, f1))
    }
}

impl CellsMut<'_> {
    /// Fills the means of a cell of one uniform material; its law.
    fn fill_uniform(&mut self, k: usize, material: usize, materials: &[Material]) -> PointLaw {
        let m = &materials[material];
        self.mean_viscosity[k] = m.viscosity;
        self.compliance[k] = m.compliance;
        let fractions = &mut self.fractions[k * self.materials..][..self.materials];
        fractions.fill(0.0);
        fractions[material] = 1.0;
        m.law(m.viscosity, &Texture::default())
    }

    /// Evaluates cell `cell`, the `k`th of these.
    fn mix(&mut self, k: usize, cell: usize, from: Ingredients, scratch: &mut Scratch) {
        let Ingredients { rule, mesh, particles, materials, content, factors } = from;
        let kept = self.cut[k].take();
        match content[cell] {
            Content::Uniform { material, .. } => {
                let law = self.fill_uniform(k, material as usize, materials);
                for p in &mut self.points[9 * k..9 * k + 9] {
                    p.law = law;
                }
            }
            Content::Mixed => {
                let points = &mut self.points[9 * k..9 * k + 9];
                let fractions = &mut self.fractions[k * self.materials..][..self.materials];
                scratch.gather(mesh, cell, particles, materials);
                let form = match rule {
                    Rule::Laminate => scratch.form(mesh, cell, particles, materials),
                    Rule::Mixture | Rule::Particles => Form::Mixture,
                };
                let mixture = match form {
                    Form::Drops { around } => Mixture::around_drops(around),
                    Form::Cut { .. } | Form::Mixture => Mixture::default(),
                };
                let (viscosity, compliance) =
                    scratch.evaluate(points, fractions, materials, factors, mixture);
                self.mean_viscosity[k] = viscosity;
                self.compliance[k] = compliance;
                if let Form::Cut { interface, between } = form {
                    let size = mesh.cell_size(cell);
                    let cut = scratch.laminate(size, &interface, between, materials);
                    // In parallel: the stiff part counts. With the mixture's mean as the
                    // scale of the penalty layers of contrast 1e8 do not converge.
                    let arithmetic = scratch.arithmetic_viscosity(materials);
                    self.mean_viscosity[k] = cut.rest * viscosity + (1.0 - cut.rest) * arithmetic;
                    self.cut[k] = Some(match kept {
                        Some(mut kept) => {
                            *kept = cut;
                            kept
                        }
                        None => Box::new(cut),
                    });
                }
            }
            Content::Solid | Content::Unknown => {}
        }
    }
}

/// What a cell is made of; `None` if nothing fills it.
fn content(
    particles: &Particles,
    cell: usize,
    materials: &[Material],
    background: Option<usize>,
    version: u32,
) -> Option<Content> {
    let range = particles.of_cell(cell);
    let first = match particles.material[range.clone()].first() {
        Some(&m) => m,
        None => background? as u8,
    };
    let single = particles.material[range].iter().all(|&m| m == first);
    Some(if single && materials[first as usize].is_uniform() {
        Content::Uniform { material: first, version }
    } else {
        Content::Mixed
    })
}

/// How the materials of a cell lie.
#[expect(
    clippy::large_enum_variant,
    reason = "there is one at a time, and a box would be allocated"
)]
enum Form {
    /// Two with an interface.
    Cut { interface: Interface, between: [usize; 2] },
    /// Drops in a material of the viscosity `around`.
    Drops { around: f64 },
    /// Unknown.
    Mixture,
}

/// Sums over the particles of one cell, by Gauss point and material. Each thread keeps its own.
#[derive(Default)]
struct Scratch {
    /// Kernel-weighted volume, index `9 m + g`.
    weight: Vec<f64>,
    texture: Vec<Texture>,
    /// Per material.
    volume: Vec<f64>,
    log_viscosity: Vec<Fit>,
    /// Fits of those, at the Gauss points.
    viscosity: Vec<Option<Polynomial>>,
    /// Of all of the cell's particles, by material.
    cell_texture: Vec<Texture>,
    surroundings: Surroundings,
    numbers: Vec<f64>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

impl Scratch {
    /// Makes room for a number of materials.
    fn prepare(&mut self, materials: usize) {
        self.weight.resize(9 * materials, 0.0);
        self.texture.resize(9 * materials, Texture::default());
        self.volume.resize(materials, 0.0);
        self.log_viscosity.resize(materials, Fit::default());
        self.cell_texture.resize(materials, Texture::default());
    }

    fn gather(&mut self, mesh: &Mesh, cell: usize, particles: &Particles, materials: &[Material]) {
        self.weight.fill(0.0);
        self.texture.fill(Texture::default());
        self.volume.fill(0.0);
        self.log_viscosity.iter_mut().for_each(Fit::clear);
        self.cell_texture.fill(Texture::default());
        for p in particles.of_cell(cell) {
            let m = particles.material[p] as usize;
            let volume = particles.volume[p];
            let r = mesh.to_reference(cell, particles.position[p]);
            let kernel = |t: f64, g: f64| {
                let q = 0.5 * (t - g) / KERNEL_WIDTH;
                (-q * q).exp()
            };
            let kx = GAUSS_3.map(|g| kernel(r[0], g));
            let ky = GAUSS_3.map(|g| kernel(r[1], g));
            self.volume[m] += volume;
            if let (Some(d), Some(_)) = (&particles.director, materials[m].layer_viscosity) {
                self.cell_texture[m].add(volume, d[p]);
            }
            for g in 0..9 {
                let w = volume * kx[g % 3] * ky[g / 3];
                self.weight[9 * m + g] += w;
                if let (Some(d), Some(_)) = (&particles.director, materials[m].layer_viscosity) {
                    self.texture[9 * m + g].add(w, d[p]);
                }
            }
            if let (Some(v), true) = (&particles.viscosity, materials[m].carries_viscosity) {
                self.log_viscosity[m].add(volume, r, v[p].ln());
            }
        }
    }

    /// Turns kernel weights into fractions whose mean over the cell is each material's share of
    /// the particles' volume: weights of a material are scaled by a common factor, found by
    /// fixed-point iteration. So a cell weighs what its particles weigh.
    fn match_volumes(&mut self, points: &[IntegrationPoint], factors: &[f64]) {
        let materials = factors.len();
        let wanted = |volume: &[f64], m: usize| volume[m] * factors[m];
        let volume: f64 = (0..materials).map(|m| wanted(&self.volume, m)).sum();
        let normalise = |weight: &mut [f64]| {
            for g in 0..9 {
                let total: f64 = (0..materials).map(|m| weight[9 * m + g]).sum();
                (0..materials).for_each(|m| weight[9 * m + g] /= total);
            }
        };
        normalise(&mut self.weight);
        if self.volume.iter().filter(|&&v| v > 0.0).count() < 2 {
            return;
        }
        for _ in 0..MATCHING_ITERATIONS {
            let mut worst: f64 = 0.0;
            for m in 0..materials {
                let share = wanted(&self.volume, m) / volume;
                let weight = &mut self.weight[9 * m..9 * m + 9];
                let mean: f64 = weight.iter().zip(points).map(|(w, p)| w * p.weight).sum();
                if share > 0.0 && mean > 0.0 {
                    weight.iter_mut().for_each(|w| *w *= share / mean);
                    worst = worst.max((share - mean).abs());
                }
            }
            normalise(&mut self.weight);
            if worst < MATCHING_TOLERANCE {
                break;
            }
        }
    }

    /// What two materials form in a gathered cell.
    fn form(
        &mut self,
        mesh: &Mesh,
        cell: usize,
        particles: &Particles,
        materials: &[Material],
    ) -> Form {
        let mut present = (0..materials.len()).filter(|&m| self.volume[m] > 0.0);
        let (Some(first), Some(second), None) = (present.next(), present.next(), present.next())
        else {
            return Form::Mixture;
        };
        let between = [first, second];
        let [a, b] = between.map(|m| self.volume[m]);
        let share = b / (a + b);
        let viscosity = between.map(|m| self.viscosity_in_cell(m, &materials[m]));
        self.surroundings.gather(mesh, particles, cell, between);
        let around = self.surroundings.particles();
        for drop in [false, true] {
            if minority::is_drop(around, drop) {
                return Form::Drops { around: viscosity[usize::from(!drop)] };
            }
        }
        let stiff = viscosity[1] > viscosity[0];
        if let Some(strip) = minority::sheet(around, stiff, &mut self.numbers) {
            let interface = Interface::of_sheet(&strip, stiff, mesh.cell_size(cell), share);
            if interface.trust > 0.0 {
                return Form::Cut { interface, between };
            }
        }
        match self.surroundings.interface(share) {
            Some(interface) if interface.trust > 0.0 => Form::Cut { interface, between },
            _ => Form::Mixture,
        }
    }

    /// Stiffness of a cell of two materials with an interface.
    fn laminate(
        &self,
        size: [f64; 2],
        interface: &Interface,
        between: [usize; 2],
        materials: &[Material],
    ) -> CutStiffness {
        let sides = between.map(|m| self.law_in_cell(m, &materials[m]));
        let mut matrix = laminate::matrix(&Cut { interface, sides: &sides, size });
        matrix.iter_mut().flatten().for_each(|k| *k *= interface.trust);
        CutStiffness { matrix, rest: 1.0 - interface.trust }
    }

    /// Mean viscosity of one material's law in the cell's middle.
    fn viscosity_in_cell(&self, m: usize, material: &Material) -> f64 {
        let eta = match self.log_viscosity[m].solve(Degree::Quadratic) {
            Some(fit) if material.carries_viscosity => fit.at_bounded([0.0; 2]).exp(),
            _ => material.viscosity,
        };
        material.law(eta, &self.cell_texture[m]).shear.mean()
    }

    /// Mean viscosity of the cell's materials by volume.
    fn arithmetic_viscosity(&self, materials: &[Material]) -> f64 {
        let total: f64 = self.volume.iter().sum();
        self.volume.iter().zip(materials).map(|(v, m)| v / total * m.viscosity).sum()
    }

    /// Law of one material over the whole cell.
    fn law_in_cell(&self, m: usize, material: &Material) -> [PointLaw; SUBPOINTS] {
        let texture = &self.cell_texture[m];
        match self.log_viscosity[m].solve(Degree::Quadratic) {
            Some(fit) if material.carries_viscosity => {
                std::array::from_fn(|q| material.law(fit.at_bounded(GAUSS_6X6[q].r).exp(), texture))
            }
            _ => [material.law(material.viscosity, texture); SUBPOINTS],
        }
    }

    /// Fills the nine points and the cell's fractions; mean viscosity and mean 1/B.
    fn evaluate(
        &mut self,
        points: &mut [IntegrationPoint],
        fractions: &mut [f64],
        materials: &[Material],
        factors: &[f64],
        empty: Mixture,
    ) -> (f64, f64) {
        self.viscosity.clear();
        self.viscosity.extend(self.log_viscosity.iter().map(|f| f.solve(Degree::Quadratic)));
        self.match_volumes(points, factors);
        fractions.fill(0.0);
        let (mut mean_viscosity, mut compliance) = (0.0, 0.0);
        for (g, point) in points.iter_mut().enumerate() {
            let mut mixture = empty;
            for (m, material) in materials.iter().enumerate() {
                let phi = self.weight[9 * m + g];
                if phi == 0.0 {
                    continue;
                }
                let eta = match &self.viscosity[m] {
                    Some(fit) if material.carries_viscosity => fit.at_bounded(point.r).exp(),
                    _ => material.viscosity,
                };
                mixture.add(phi, &material.law(eta, &self.texture[9 * m + g]));
                fractions[m] += point.weight * phi;
                compliance += point.weight * phi * material.compliance;
            }
            point.law = mixture.law();
            mean_viscosity += point.weight * point.law.shear.mean();
        }
        (mean_viscosity, compliance)
    }
}
