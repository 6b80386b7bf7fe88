//! This module holds the inputs of the evaluation of cells, and gives the law of a material at a point
//! of a cell.

use super::last_flow::LastFlow;
use crate::composition::fill::Fill;
use crate::composition::{Content, Gathered, Kind};
use crate::laws::Here;
use crate::laws::director::Orientation;
use crate::laws::point::PointLaw;
use crate::plan::material::Material;
use crate::scene::Quadrature as Rule;
use crate::space::constraints::Walls;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_6X6, SUBPOINTS};

/// Inputs of the evaluation of cells.
#[derive(Clone, Copy)]
pub struct Evaluation<'a> {
    /// Rule that determines the integration points.
    pub rule: Rule,
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Particles, sorted by cell.
    pub particles: &'a Particles,
    /// The materials.
    pub materials: &'a [Material],
    /// Properties of each material that the composition needs.
    pub kinds: &'a [Kind],
    /// Content of each cell.
    pub content: &'a [Content],
    /// Filled shares of the cells, if a void is around the materials.
    pub fill: Option<&'a Fill>,
    /// Factor on each material's volume in cut cells.
    pub factors: &'a [f64],
    /// Sides of each cell on which the velocity is prescribed, and gravity.
    pub walls: &'a Walls,
    /// Last iterate, for laws that depend on rates or pressure.
    pub flow: &'a dyn LastFlow,
}

impl Evaluation<'_> {
    /// State of a material at a point of a cell.
    pub(super) fn here<'o>(
        &self,
        (cell, r): (usize, [f64; 2]),
        m: usize,
        viscosity: f64,
        orientation: &'o Orientation,
    ) -> Here<'o> {
        let mut here = Here::without_flow(viscosity, orientation);
        if self.materials[m].law.depends_on().needs_flow() {
            here.flow = self.flow.at(cell, r);
        }
        here
    }

    /// Law of a material at a point of a cell.
    pub(super) fn law(
        &self,
        point: (usize, [f64; 2]),
        m: usize,
        viscosity: f64,
        orientation: &Orientation,
    ) -> PointLaw {
        self.materials[m].law.at(&self.here(point, m, viscosity, orientation))
    }

    /// Carried or constant viscosity of a material at a point of a gathered cell.
    pub(super) fn viscosity(&self, m: usize, r: [f64; 2], scratch: &Gathered) -> f64 {
        scratch.viscosity_at(m, r).unwrap_or(self.materials[m].viscosity)
    }

    /// Law of one material at the centre of the cell.
    pub(super) fn law_at_centre(&self, cell: usize, m: usize, scratch: &Gathered) -> PointLaw {
        let eta = self.viscosity(m, [0.0; 2], scratch);
        self.law((cell, [0.0; 2]), m, eta, scratch.cell_orientation(m))
    }

    /// Law of one material at the points of [`GAUSS_6X6`].
    pub(super) fn law_in_cell(
        &self,
        cell: usize,
        m: usize,
        scratch: &Gathered,
    ) -> [PointLaw; SUBPOINTS] {
        let orientation = scratch.cell_orientation(m);
        let material = &self.materials[m];
        if !material.carries_viscosity && !material.law.depends_on().needs_flow() {
            return [self.law((cell, [0.0; 2]), m, material.viscosity, orientation); SUBPOINTS];
        }
        std::array::from_fn(|q| {
            let r = GAUSS_6X6[q].r;
            self.law((cell, r), m, self.viscosity(m, r, scratch), orientation)
        })
    }
}
