//! This module evaluates the laws of the materials at the integration points of a cell, with
//! mixtures and laminates, from the [`composition`](crate::composition) of the cell.

use super::element::{PointShape, rates};
use super::laminate::{self, Cut};
use super::points::{CutStiffness, IntegrationPoint};
use super::sides::{self, Sides};
use crate::composition::interface::Interface;
use crate::composition::straight::StraightCut;
use crate::composition::{Content, Gathered, Kind};
use crate::laws::Here;
use crate::laws::director::Orientation;
use crate::laws::mixture::Mixture;
use crate::laws::point::PointLaw;
use crate::laws::rates::Rates;
use crate::plan::material::Material;
use crate::scene::Quadrature as Rule;
use crate::space::flow::Flow;
use crate::space::kink::Ramp;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_6X6, SUBPOINTS, Shape};
use crate::threads::Divisible;

/// Relative difference up to which densities are equal.
const SAME_DENSITY: f64 = 1e-12;

/// Rates and pressure of the last iterate, for laws that depend on them.
pub trait LastFlow: Sync {
    /// Rates and pressure at the reference coordinates `r` of a cell, in the plan's units.
    fn at(&self, cell: usize, r: [f64; 2]) -> (Rates, f64);
}

impl<const D: usize> LastFlow for (&Mesh, &Flow<D>) {
    fn at(&self, cell: usize, r: [f64; 2]) -> (Rates, f64) {
        let (mesh, flow) = *self;
        let shape = PointShape::new(&Shape::at(r), mesh.cell_size(cell));
        let pressure = mesh.measure().pressure_basis(r);
        let p = flow.pressure[cell].iter().zip(pressure).map(|(p, q)| p * q).sum();
        (rates(&shape, &flow.of_cell(mesh, cell)), p)
    }
}

/// Law of a material whose particles are all alike.
pub fn uniform(m: &Material) -> PointLaw {
    m.law.at(&Here::at_rest(m.viscosity, &Orientation::default()))
}

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
    /// Factor on each material's volume in cut cells.
    pub factors: &'a [f64],
    /// Ramp of the kink that the velocity of each cell may have.
    pub ramps: &'a [Option<Ramp>],
    /// Last iterate, for laws that depend on rates or pressure.
    pub flow: &'a dyn LastFlow,
}

/// Mutable data of consecutive cells.
pub struct CellsMut<'a> {
    /// Number of materials.
    pub materials: usize,
    /// Integration points, nine per cell.
    pub points: &'a mut [IntegrationPoint],
    /// Stiffness of each cut cell.
    pub cut: &'a mut [Option<Box<CutStiffness>>],
    /// Mean viscosity of each cell.
    pub mean_viscosity: &'a mut [f64],
    /// Mean inverse bulk viscosity of each cell.
    pub compliance: &'a mut [f64],
    /// Volume fractions, by cell and material.
    pub fractions: &'a mut [f64],
}

/// Mutable data of one cell.
pub struct CellMut<'a> {
    points: &'a mut [IntegrationPoint],
    cut: &'a mut Option<Box<CutStiffness>>,
    mean_viscosity: &'a mut f64,
    compliance: &'a mut f64,
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
    /// Data of the `k`th of these cells.
    pub fn cell(&mut self, k: usize) -> CellMut<'_> {
        CellMut {
            points: &mut self.points[9 * k..9 * k + 9],
            cut: &mut self.cut[k],
            mean_viscosity: &mut self.mean_viscosity[k],
            compliance: &mut self.compliance[k],
            fractions: &mut self.fractions[k * self.materials..][..self.materials],
        }
    }
}

/// Arrangement of the materials of a cell.
enum Form {
    /// Two materials separated by an interface.
    Cut { interface: Interface, between: [usize; 2] },
    /// Two materials of different weight separated by a straight line.
    Sides { cut: StraightCut, between: [usize; 2] },
    /// Materials of different weight in no known arrangement.
    Weights,
    /// Drops in a material of the viscosity `around`.
    Drops { around: f64 },
    /// No known arrangement.
    Mixture,
}

impl Evaluation<'_> {
    /// Evaluates a cell.
    pub fn evaluate(&self, cell: usize, mut out: CellMut, scratch: &mut Gathered) {
        let kept = out.cut.take();
        match self.content[cell] {
            Content::Uniform { material, .. } => {
                let m = &self.materials[material as usize];
                *out.mean_viscosity = m.viscosity;
                *out.compliance = m.law.compliance;
                out.fractions.fill(0.0);
                out.fractions[material as usize] = 1.0;
                let law = uniform(m);
                out.points.iter_mut().for_each(|p| p.law = law);
            }
            Content::Mixed => self.mix(cell, &mut out, kept, scratch),
            Content::Solid | Content::Unknown => {}
        }
    }

    /// Evaluates a mixed cell.
    fn mix(
        &self,
        cell: usize,
        out: &mut CellMut,
        kept: Option<Box<CutStiffness>>,
        scratch: &mut Gathered,
    ) {
        scratch.gather(self.mesh, cell, self.particles, self.kinds);
        scratch.fit_viscosities();
        let form = match self.rule {
            Rule::Laminate | Rule::Sides => self.form(cell, scratch),
            Rule::Mixture | Rule::Particles => Form::Mixture,
        };
        let mixture = match form {
            Form::Drops { around } => Mixture::around_drops(around),
            Form::Sides { .. } | Form::Weights => Mixture::parallel(),
            Form::Cut { .. } | Form::Mixture => Mixture::default(),
        };
        scratch.match_volumes(self.factors);
        self.points(cell, out, scratch, mixture);
        let cut = match form {
            Form::Cut { interface, between } => {
                let cut = self.laminate(cell, &interface, between, scratch);
                // The two sides resist stretching in parallel, so the stiff side determines the
                // scale of the penalty. With the mean of the mixture as this scale, layers of
                // contrast 1e8 do not converge.
                let arithmetic = self.arithmetic_viscosity(scratch);
                *out.mean_viscosity =
                    cut.rest * *out.mean_viscosity + (1.0 - cut.rest) * arithmetic;
                cut
            }
            Form::Sides { cut, between } => self.sides(cell, cut, between, scratch),
            Form::Weights | Form::Drops { .. } | Form::Mixture => return,
        };
        *out.cut = Some(match kept {
            Some(mut kept) => {
                *kept = cut;
                kept
            }
            None => Box::new(cut),
        });
    }

    /// Arrangement of the materials in a gathered cell.
    fn form(&self, cell: usize, scratch: &mut Gathered) -> Form {
        if self.rule == Rule::Sides && self.densities_differ(scratch.volumes()) {
            let between = present(scratch.volumes());
            let cut = between.and_then(|b| Some((self.straight_cut(cell, b, scratch)?, b)));
            return match cut {
                Some((cut, between)) => Form::Sides { cut, between },
                None => Form::Weights,
            };
        }
        let viscosity: [f64; 2] = match present(scratch.volumes()) {
            Some(between) => between.map(|m| self.law_at_centre(cell, m, scratch).shear.mean()),
            None => return Form::Mixture,
        };
        let Some(mut around) = scratch.neighbourhood(self.mesh, cell, self.particles) else {
            return Form::Mixture;
        };
        for drop in [false, true] {
            if around.is_drop(drop) {
                return Form::Drops { around: viscosity[usize::from(!drop)] };
            }
        }
        let between = around.between;
        let sheet = around.sheet(viscosity[1] > viscosity[0]);
        match sheet.or_else(|| around.interface()) {
            Some(interface) => Form::Cut { interface, between },
            None => Form::Mixture,
        }
    }

    /// Whether the materials with a nonzero volume differ in density.
    fn densities_differ(&self, volumes: &[f64]) -> bool {
        let present = || volumes.iter().zip(self.materials).filter(|(v, _)| **v > 0.0);
        let Some((_, first)) = present().next() else { return false };
        present().skip(1).any(|(_, m)| {
            m.carries_density
                || first.carries_density
                || (m.density - first.density).abs()
                    > SAME_DENSITY * m.density.abs().max(first.density.abs())
        })
    }

    /// The straight line between the two materials of a gathered cell.
    fn straight_cut(
        &self,
        cell: usize,
        [_, b]: [usize; 2],
        scratch: &mut Gathered,
    ) -> Option<StraightCut> {
        let viscosity = self.materials.iter().map(|m| m.viscosity);
        let centroids =
            scratch.centroids((self.mesh, cell), self.particles, self.factors, viscosity);
        StraightCut::new(centroids.share(b), centroids.centroid(b))
    }

    /// Law of a material at a point of a cell.
    fn law(
        &self,
        (cell, r): (usize, [f64; 2]),
        m: usize,
        viscosity: f64,
        orientation: &Orientation,
    ) -> PointLaw {
        let law = &self.materials[m].law;
        let mut here = Here::at_rest(viscosity, orientation);
        if law.depends_on().needs_flow() {
            (here.rates, here.pressure) = self.flow.at(cell, r);
        }
        law.at(&here)
    }

    /// Carried or constant viscosity of a material at a point of a gathered cell.
    fn viscosity(&self, m: usize, r: [f64; 2], scratch: &Gathered) -> f64 {
        scratch.viscosity_at(m, r).unwrap_or(self.materials[m].viscosity)
    }

    /// Stiffness of a cell of two materials with an interface.
    fn laminate(
        &self,
        cell: usize,
        interface: &Interface,
        between: [usize; 2],
        scratch: &Gathered,
    ) -> CutStiffness {
        let sides = between.map(|m| self.law_in_cell(cell, m, scratch));
        let cut = Cut { interface, sides: &sides, cell: self.mesh.cell_measure(cell) };
        let mut matrix = laminate::matrix(&cut);
        matrix.iter_mut().flatten().for_each(|k| *k *= interface.trust);
        CutStiffness { matrix, rest: 1.0 - interface.trust, sides: None }
    }

    /// Stiffness of a cell of two materials on the two sides of a line. Each material has its law
    /// at the centre of the cell.
    fn sides(
        &self,
        cell: usize,
        cut: StraightCut,
        between: [usize; 2],
        scratch: &Gathered,
    ) -> CutStiffness {
        let laws = between.map(|m| self.law_at_centre(cell, m, scratch));
        let (mut matrix, kinked) =
            sides::matrix(&cut, &laws, self.mesh.cell_measure(cell), self.ramps[cell]);
        matrix.iter_mut().flatten().for_each(|k| *k *= cut.trust);
        CutStiffness { matrix, rest: 1.0 - cut.trust, sides: Some(Sides { between, cut, kinked }) }
    }

    /// Law of one material at the centre of the cell.
    fn law_at_centre(&self, cell: usize, m: usize, scratch: &Gathered) -> PointLaw {
        let eta = self.viscosity(m, [0.0; 2], scratch);
        self.law((cell, [0.0; 2]), m, eta, scratch.cell_orientation(m))
    }

    /// Mean of the viscosities of the cell's materials, weighted by volume.
    fn arithmetic_viscosity(&self, scratch: &Gathered) -> f64 {
        let total: f64 = scratch.volumes().iter().sum();
        scratch.volumes().iter().zip(self.materials).map(|(v, m)| v / total * m.viscosity).sum()
    }

    /// Law of one material at the points of [`GAUSS_6X6`].
    fn law_in_cell(&self, cell: usize, m: usize, scratch: &Gathered) -> [PointLaw; SUBPOINTS] {
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

    /// Fills the nine points of a cell, its volume fractions and its means.
    fn points(&self, cell: usize, out: &mut CellMut, scratch: &Gathered, empty: Mixture) {
        out.fractions.fill(0.0);
        (*out.mean_viscosity, *out.compliance) = (0.0, 0.0);
        for (g, point) in out.points.iter_mut().enumerate() {
            let mut mixture = empty;
            for (m, material) in self.materials.iter().enumerate() {
                let phi = scratch.share(m, g);
                if phi == 0.0 {
                    continue;
                }
                let eta = self.viscosity(m, point.r, scratch);
                let law = self.law((cell, point.r), m, eta, scratch.orientation(m, g));
                mixture.add(phi, &law);
                out.fractions[m] += point.weight * phi;
                *out.compliance += point.weight * phi * material.law.compliance;
            }
            point.law = mixture.law();
            *out.mean_viscosity += point.weight * point.law.shear.mean();
        }
    }
}

/// The two materials with a nonzero volume; `None` if there are more or fewer.
fn present(volumes: &[f64]) -> Option<[usize; 2]> {
    let mut present = (0..volumes.len()).filter(|&m| volumes[m] > 0.0);
    match (present.next(), present.next(), present.next()) {
        (Some(first), Some(second), None) => Some([first, second]),
        _ => None,
    }
}

/// Viscosity of a particle, and the particle as an integration point of a cell whose particles have
/// the volume `total`.
pub fn particle_point(
    (mesh, cell): (&Mesh, usize),
    (particles, p): (&Particles, usize),
    m: &Material,
    total: f64,
    flow: &dyn LastFlow,
) -> (f64, IntegrationPoint) {
    let eta = match &particles.viscosity {
        Some(v) if m.carries_viscosity => v[p],
        _ => m.viscosity,
    };
    let density = m.density_of(particles, p);
    let director = particles.director.as_ref().filter(|_| m.law.is_layered()).map(|d| d[p]);
    let orientation = director.map_or(Orientation::default(), Orientation::of);
    let r = mesh.to_reference(cell, particles.position[p]);
    let mut here = Here::at_rest(eta, &orientation);
    if m.law.depends_on().needs_flow() {
        (here.rates, here.pressure) = flow.at(cell, r);
    }
    let weight = particles.volume[p] / total;
    (eta, IntegrationPoint { law: m.law.at(&here), density, weight, r })
}
