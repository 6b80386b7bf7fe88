//! This module holds the integration points of all cells and the means that the solver needs.
//!
//! **Mixture**. The Gauss points of a cell see the materials of the cell's own particles, with the
//! shares that [`composition`](crate::composition) computes. Each material has its own law there,
//! and [`Mixture`](crate::laws::mixture::Mixture) computes the mean law. A cell of one uniform
//! material has exactly that law for any positions of its particles, so its element matrix is a
//! constant.
//!
//! **Laminate**. As the mixture, but the viscous stiffness of cells with two materials is
//! that of [`laminate`](super::laminate), with the interface found by the composition. Where no
//! interface can be trusted (three materials, debris) the mixture is used. A stiff sheet thinner
//! than a cell is a laminate with straight edges; the cells of a drop are a dilute suspension.
//! Rotation, density and images are those of the mixture.
//!
//! **Sides** (default). As the laminate, but cells whose materials differ in density are treated differently.
//! Where a straight line separates two materials, each side has its own law and its own weight
//! ([`sides`](super::sides)); elsewhere the mean laws are arithmetic. In series, the thin material
//! would make a cell that is mostly heavy as soft as itself, and the weight of that cell would make
//! it slide.
//!
//! **Particles**. Each particle is an integration point with its own law and a weight proportional
//! to its volume: the method of the source paper, for comparison.

use super::cells::CellsMut;
use super::last_flow::LastFlow;
use super::local_laws::Evaluation;
use super::points::{CutStiffness, INSIDE_SOLIDS, IntegrationPoint};
use super::sides::Kinked;
use super::softening::{self, Directions, SofteningPoint};
use super::terms::slip::SlipFaces;
use super::terms::slip_outline::SlipOutlines;
use crate::composition::{Composition, Content, EmptyCell, Kind, SCRATCH};
use crate::laws::point::PointLaw;
use crate::laws::rates::Rates;
use crate::plan::material::Material;
use crate::scene::Quadrature as Rule;
use crate::space::constraints::Walls;
use crate::space::kink::Kink;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::parts::{Part, Parts, SharedParts};
use crate::space::shape::{GAUSS_3X3, NODES, Shape};
use crate::threads;

/// Largest number of cells per task.
const GRAIN: usize = 32;

/// Integration points of all cells, and means that the solver needs.
pub struct Quadrature {
    rule: Rule,
    pub(super) composition: Composition,
    kinds: Vec<Kind>,
    /// Integration points, ordered by cell.
    pub(super) points: Vec<IntegrationPoint>,
    /// Index of the first point of each cell, and the number of points.
    pub(super) start: Vec<u32>,
    /// Sides of each cell on which the velocity is prescribed, and gravity.
    pub(super) walls: Walls,
    /// Parts of cells with solids of any shape in them.
    parts: SharedParts,
    /// Stiffness of cut cells.
    cut: Vec<Option<Box<CutStiffness>>>,
    /// Mean viscosity of each cell; where a laminate is used, the mean by volume. It scales the
    /// penalty.
    pub mean_viscosity: Vec<f64>,
    /// Mean inverse bulk viscosity 1/B of each cell.
    pub compliance: Vec<f64>,
    /// Derivatives of the viscosities of generalised fluids, by cell; empty if there are none.
    softening: Vec<Vec<SofteningPoint>>,
    /// Those of the last matrices, while a correction is applied.
    softening_before: Vec<Vec<SofteningPoint>>,
    /// Directions of the stresses at these points.
    directions: Vec<Directions>,
    /// Whether the element matrices have these derivatives.
    pub(super) softened: bool,
    /// Walls along which material slips.
    pub(super) slip: SlipFaces,
    /// Outlines of solids along which material slips.
    pub(super) slip_outlines: SlipOutlines,
    /// Volume factors of the materials in the last update.
    factors: Vec<f64>,
    /// Whether each cell is evaluated.
    chosen: Vec<bool>,
}

impl Quadrature {
    /// Creates the integration points of a mesh; no law is evaluated yet.
    pub fn new(mesh: &Mesh, rule: Rule, materials: usize) -> Self {
        let cells = mesh.cells();
        let (points, start) = match rule {
            Rule::Mixture | Rule::Laminate | Rule::Sides => {
                let mut points = vec![IntegrationPoint::default(); 9 * cells];
                for (k, point) in points.iter_mut().enumerate() {
                    let (g, cell) = (&GAUSS_3X3[k % 9], mesh.whole_measure(k / 9));
                    (point.weight, point.r) = (cell.share(g.weight, g.r[0]), g.r);
                }
                for (cell, part) in mesh.parts().into_iter().flat_map(Parts::all) {
                    for (point, of) in points[9 * cell..].iter_mut().zip(&part.points) {
                        (point.weight, point.r) = (of.weight, of.r);
                    }
                }
                (points, (0..=cells as u32).map(|c| 9 * c).collect())
            }
            Rule::Particles => (Vec::new(), vec![0; cells + 1]),
        };
        Quadrature {
            rule,
            composition: Composition::new(cells, materials),
            kinds: Vec::with_capacity(materials),
            points,
            start,
            walls: Walls::free(cells),
            parts: mesh.shared_parts(),
            cut: vec![None; cells],
            mean_viscosity: vec![0.0; cells],
            compliance: vec![0.0; cells],
            softening: vec![],
            softening_before: vec![],
            directions: vec![],
            softened: true,
            slip: SlipFaces::default(),
            slip_outlines: SlipOutlines::default(),
            factors: vec![],
            chosen: vec![],
        }
    }

    /// Creates Gauss points with the law, density and viscosity that `at(cell, position)` returns.
    /// This is the exact integration that the particles approximate.
    pub fn from_fields(
        mesh: &Mesh,
        materials: usize,
        mut at: impl FnMut(usize, [f64; 2]) -> (PointLaw, f64, f64),
    ) -> Self {
        let mut out = Quadrature::new(mesh, Rule::Mixture, materials);
        for cell in 0..mesh.cells() {
            if mesh.solid[cell] {
                out.composition.set_content(cell, Content::Solid);
                continue;
            }
            out.composition.set_content(cell, Content::Mixed);
            for p in &mut out.points[9 * cell..9 * cell + 9] {
                let viscosity;
                (p.law, p.density, viscosity) = at(cell, mesh.from_reference(cell, p.r));
                out.mean_viscosity[cell] += p.weight * viscosity;
            }
        }
        out
    }

    /// Materials of all cells.
    pub fn composition(&self) -> &Composition {
        &self.composition
    }

    /// Materials of all cells, to be restored to an earlier state.
    pub fn composition_mut(&mut self) -> &mut Composition {
        &mut self.composition
    }

    /// Content of a cell.
    pub fn content(&self, cell: usize) -> Content {
        self.composition.content(cell)
    }

    /// The nine points of a cell, row by row from below, if they are those of the Gauss rule.
    pub fn gauss_points(&self, cell: usize) -> Option<&[IntegrationPoint; 9]> {
        match self.rule {
            _ if self.part(cell).is_some() => None,
            Rule::Mixture | Rule::Laminate | Rule::Sides => {
                self.points[9 * cell..9 * cell + 9].try_into().ok()
            }
            Rule::Particles => None,
        }
    }

    /// The part of a cell that solids leave free, if there is a solid in it.
    #[inline(always)]
    fn part(&self, cell: usize) -> Option<&Part> {
        self.parts.as_deref()?.of(cell)
    }

    /// Viscous stiffness of a cut cell. Its integration points then have only a part of their
    /// viscosity.
    pub fn cut(&self, cell: usize) -> Option<&CutStiffness> {
        self.cut[cell].as_deref()
    }

    /// Derivatives of the viscosities at the points of a cell, with the directions of the stresses,
    /// that the element matrices have.
    pub fn softening(&self, cell: usize) -> impl Iterator<Item = (&SofteningPoint, &Rates)> {
        let known = self.softening.get(cell).filter(|_| self.softened);
        let points = known.into_iter().flatten();
        points.zip(self.directions.get(cell).into_iter().flatten())
    }

    /// Whether the viscosity of a cell depends on the flow.
    pub fn flows(&self, cell: usize) -> bool {
        self.softening.get(cell).is_some_and(|list| !list.is_empty())
    }

    /// Sets the directions of the stresses to those of the current rates.
    pub(super) fn align_cells(&mut self) {
        self.directions.resize_with(self.softening.len(), Vec::new);
        threads::for_each(&mut self.directions, GRAIN, |cell, directions| {
            softening::aligned(&self.softening[cell], directions);
        });
    }

    /// Keeps the current derivatives for [`Quadrature::turn_cells`]; the laws must be evaluated again
    /// before it.
    pub(super) fn keep_softening_of_cells(&mut self) {
        self.softening_before.resize_with(self.softening.len(), Vec::new);
        std::mem::swap(&mut self.softening_before, &mut self.softening);
        // Cells that are not evaluated again have none.
        self.softening.iter_mut().for_each(Vec::clear);
    }

    /// Advances the directions of the stresses after the share `share` of a correction.
    pub(super) fn turn_cells(&mut self, share: f64) {
        threads::for_each(&mut self.directions, GRAIN, |cell, directions| {
            let [before, after] = [&self.softening_before, &self.softening].map(|s| &s[cell]);
            softening::advance(before, after, share, directions);
        });
    }

    /// Kink of the velocity in a cell, if it has one.
    pub fn kinked(&self, cell: usize) -> Option<&Kinked> {
        self.cut(cell)?.kinked()
    }

    /// The kinks of cells, with their amplitudes for the nodal velocities of the cell.
    pub fn kinks(&self) -> impl Fn(usize, &[[f64; 2]; NODES]) -> Option<(Kink, f64)> + Sync {
        |cell, u| {
            let cut = self.cut(cell)?;
            let trust = 1.0 - cut.rest;
            cut.kinked().map(|k| (k.kink, trust * k.amplitude(u)))
        }
    }

    /// Calls `f` with each integration point of a cell and its shape functions.
    pub fn for_points(&self, cell: usize, mut f: impl FnMut(&IntegrationPoint, &Shape)) {
        let range = self.start[cell] as usize..self.start[cell + 1] as usize;
        match self.rule {
            Rule::Mixture | Rule::Laminate | Rule::Sides => {
                let points = &self.points[range];
                if let Some(part) = self.part(cell) {
                    for (p, of) in points.iter().zip(&part.points) {
                        f(p, &of.shape);
                    }
                    for (p, g) in points.iter().zip(GAUSS_3X3.iter()) {
                        let (law, weight) = (p.law.scaled(INSIDE_SOLIDS), g.weight);
                        f(&IntegrationPoint { law, density: 0.0, weight, r: g.r }, &g.shape);
                    }
                    return;
                }
                for (p, g) in points.iter().zip(GAUSS_3X3.iter()) {
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

    /// Evaluates all cells whose content may have changed. `particles` must be sorted. `version`
    /// counts changes of the material table. `flow` is the last iterate, for laws that depend on
    /// it.
    ///
    /// # Errors
    /// Returns [`EmptyCell`] if a cell has neither particles nor a background material.
    pub(super) fn update_cells(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        materials: &[Material],
        version: u32,
        flow: &dyn LastFlow,
    ) -> Result<(), EmptyCell> {
        let background = materials.iter().position(|m| m.background);
        self.kinds.clear();
        self.kinds.extend(materials.iter().map(|m| Kind {
            uniform: m.is_uniform(),
            flowing: m.is_flowing(),
            directors: m.law.is_layered(),
            viscosity: m.carries_viscosity,
        }));
        // Particles as integration points move, so the matrix of a cell with particles always
        // changes.
        let moving = self.rule == Rule::Particles;
        let Quadrature { composition, kinds, walls: Walls { sides, .. }, .. } = self;
        composition.update(mesh, particles, kinds, (background, version), (moving, sides))?;
        if self.rule == Rule::Particles {
            self.points.clear();
            for cell in 0..mesh.cells() {
                self.list(mesh, cell, particles, materials, flow);
            }
            return Ok(());
        }
        if materials.iter().any(|m| m.law.depends_on().needs_flow()) {
            self.softening.resize_with(mesh.cells(), Vec::new);
        }
        self.factors.clear();
        self.factors.extend_from_slice(self.composition.factors());
        self.evaluate(mesh, particles, materials, flow, |c, cell| c.is_fresh(cell));
        self.composition.keep_volumes(mesh, particles);
        Ok(())
    }

    /// Evaluates the cells with laws that depend on the flow again, with another iterate and
    /// otherwise the arguments of the last [`Quadrature::update_cells`].
    pub(super) fn reevaluate_cells(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        materials: &[Material],
        flow: &dyn LastFlow,
    ) {
        if self.rule == Rule::Particles {
            self.points.clear();
            for cell in 0..mesh.cells() {
                self.list(mesh, cell, particles, materials, flow);
            }
            return;
        }
        let flows: Vec<usize> =
            (0..materials.len()).filter(|&m| materials[m].law.depends_on().needs_flow()).collect();
        self.evaluate(mesh, particles, materials, flow, |composition, cell| {
            match composition.content(cell) {
                Content::Flowing { .. } => true,
                Content::Mixed => flows.iter().any(|&m| composition.fraction(cell, m) > 0.0),
                Content::Uniform { .. } | Content::Empty | Content::Solid | Content::Unknown => {
                    false
                }
            }
        });
    }

    /// Evaluates some of the cells.
    fn evaluate(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        materials: &[Material],
        flow: &dyn LastFlow,
        selected: impl Fn(&Composition, usize) -> bool + Sync,
    ) {
        let Quadrature {
            rule,
            composition,
            kinds,
            walls,
            points,
            cut,
            mean_viscosity,
            compliance,
            softening,
            factors,
            chosen,
            ..
        } = self;
        chosen.clear();
        chosen.extend((0..mesh.cells()).map(|cell| selected(composition, cell)));
        // The volume fractions are written while the rest of the composition is read.
        let mut fractions = std::mem::take(&mut composition.fractions);
        let from = Evaluation {
            rule: *rule,
            mesh,
            particles,
            materials,
            kinds,
            content: composition.contents(),
            fill: composition.fill(),
            factors,
            walls,
            flow,
        };
        let cells = CellsMut {
            materials: materials.len(),
            points,
            cut,
            mean_viscosity,
            compliance,
            fractions: &mut fractions,
            softening,
        };
        threads::for_parts(cells, 0..mesh.cells(), GRAIN, |range, mut cells| {
            SCRATCH.with_borrow_mut(|scratch| {
                scratch.prepare(materials.len());
                for (k, cell) in range.enumerate().filter(|&(_, c)| chosen[c]) {
                    from.evaluate(cell, cells.cell(k), scratch);
                }
            });
        });
        composition.fractions = fractions;
    }
}
