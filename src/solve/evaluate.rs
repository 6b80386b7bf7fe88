//! This module evaluates the laws of the materials at the integration points of a cell, with
//! mixtures and laminates, from the [`composition`](crate::composition) of the cell.

use super::cells::CellMut;
use super::filled::Filled;
use super::form::Form;
use super::laminate::{self, Cut};
use super::last_flow::LastFlow;
use super::local_laws::Evaluation;
use super::points::{CutStiffness, IntegrationPoint, Place, VOID};
use super::sides::{self, Sides};
use crate::composition::interface::Interface;
use crate::composition::straight::StraightCut;
use crate::composition::surface::VoidPart;
use crate::composition::{Content, Gathered};
use crate::laws::director::Orientation;
use crate::laws::mixture::Mixture;
use crate::laws::point::PointLaw;
use crate::laws::{Here, Softening};
use crate::plan::material::Material;
use crate::scene::Quadrature as Rule;
use crate::space::kink::Ramp;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_6X6, NODES};

/// Law of a material whose particles are all alike.
pub fn uniform(m: &Material) -> PointLaw {
    m.law.at(&Here::without_flow(m.viscosity, &Orientation::default()))
}

impl Evaluation<'_> {
    /// Evaluates a cell.
    pub fn evaluate(&self, cell: usize, mut out: CellMut, scratch: &mut Gathered) {
        let kept = out.cut.take();
        if let Some(list) = &mut out.softening {
            list.clear();
        }
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
            Content::Flowing { material } => self.flow(cell, usize::from(material), &mut out),
            Content::Mixed => self.mix(cell, &mut out, kept, scratch),
            Content::Empty => {
                (*out.mean_viscosity, *out.compliance) = (0.0, 0.0);
                out.fractions.fill(0.0);
                if let Some(fill) = self.fill {
                    out.fractions[fill.void()] = 1.0;
                }
                out.points.iter_mut().for_each(|p| p.law = PointLaw::default());
            }
            Content::Solid | Content::Unknown => {}
        }
    }

    /// Evaluates a cell of one material whose law depends on the flow only.
    fn flow(&self, cell: usize, m: usize, out: &mut CellMut) {
        let material = &self.materials[m];
        out.fractions.fill(0.0);
        out.fractions[m] = 1.0;
        *out.compliance = material.law.compliance;
        *out.mean_viscosity = 0.0;
        let orientation = Orientation::default();
        for g in 0..9 {
            let (r, weight) = (out.points[g].r, out.points[g].weight);
            let here = self.here((cell, r), m, material.viscosity, &orientation);
            let (law, softening) = material.law.with_softening(&here);
            out.points[g].law = law;
            *out.mean_viscosity += weight * law.shear.mean();
            out.soften(self.place(cell, g, r), weight, softening);
        }
    }

    /// Point `g` of a cell, at the reference coordinates `r`.
    fn place(&self, cell: usize, g: usize, r: [f64; 2]) -> Place {
        if self.mesh.part(cell).is_some() { Place::At(r) } else { Place::Gauss(g as u8) }
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
        let void = self.fill.and_then(|fill| VoidPart::of(self.mesh, fill, cell));
        if let Some(void) = void {
            scratch.add_void(void, self.factors);
        }
        scratch.fit_viscosities();
        let form = match self.rule {
            // The arrangement next to a solid is not known.
            _ if self.mesh.part(cell).is_some() => Form::Even,
            Rule::Laminate | Rule::Sides => self.form(cell, scratch),
            Rule::Mixture | Rule::Particles => Form::Mixture,
        };
        let mixture = match form {
            Form::Drops { around } => Mixture::around_drops(around),
            Form::Sides { .. } | Form::Film { .. } | Form::Even | Form::Weights => {
                Mixture::parallel()
            }
            Form::Cut { .. } | Form::Mixture => Mixture::default(),
        };
        scratch.match_volumes(self.factors);
        // Where the stress is not the sum of those of the materials, its derivative is left out.
        let softened = match &form {
            Form::Sides { cut, .. } => 1.0 - cut.trust,
            Form::Film { .. } | Form::Even | Form::Weights => 1.0,
            Form::Mixture if scratch.is_of_one_material() => 1.0,
            Form::Cut { .. } | Form::Drops { .. } | Form::Mixture => 0.0,
        };
        let alone = match form {
            Form::Sides { alone, .. } => alone,
            Form::Film { alone } => Some(alone),
            _ => None,
        };
        let even = matches!(form, Form::Film { .. } | Form::Even) || void.is_some();
        let shares =
            |m: usize, g: usize| if even { scratch.mean_share(m) } else { scratch.share(m, g) };
        self.points(cell, out, (scratch, &shares, alone), (mixture, softened));
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
            Form::Sides { cut, between, .. } => self.sides(cell, cut, between, (scratch, out)),
            Form::Film { .. } | Form::Even | Form::Weights | Form::Drops { .. } | Form::Mixture => {
                match void {
                    Some(void) => self.spread(cell, 1.0 - void.share),
                    None => return,
                }
            }
        };
        if let Some(void) = void {
            *out.mean_viscosity /= 1.0 - void.share;
        }
        *out.cut = Some(match kept {
            Some(mut kept) => {
                *kept = cut;
                kept
            }
            None => Box::new(cut),
        });
    }

    /// A cell that is filled in part, nowhere in particular.
    fn spread(&self, cell: usize, fill: f64) -> CutStiffness {
        let matrix = [[0.0; 2 * NODES]; 2 * NODES];
        let filled = Some(Filled::uniform(fill, self.mesh.cell_measure(cell)));
        CutStiffness { matrix, rest: 1.0, sides: None, filled }
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
        CutStiffness { matrix, rest: 1.0 - interface.trust, sides: None, filled: None }
    }

    /// Stiffness of a cell of two materials on the two sides of a line. Each material has its law
    /// at the centre of the cell, or at the points of [`GAUSS_6X6`] if it depends on the flow. The
    /// velocity then has no kink.
    fn sides(
        &self,
        cell: usize,
        cut: StraightCut,
        between: [usize; 2],
        (scratch, out): (&Gathered, &mut CellMut),
    ) -> CutStiffness {
        let measure = self.mesh.cell_measure(cell);
        let void =
            scratch.void().map(|void| (usize::from(between[1] == void.material), void.share));
        // Where one side is void, it has a part of the viscosities of the other.
        let with_void = |laws: [PointLaw; 2]| match void {
            Some((side, _)) => {
                let (mut out, law) = (laws, laws[1 - side]);
                let nominal = self.materials[between[1 - side]].viscosity;
                out[side] = law.scaled(VOID * (nominal / law.shear.mean()).max(1.0));
                out
            }
            None => laws,
        };
        let flows = |m: usize| self.materials[m].law.depends_on().needs_flow();
        let (mut matrix, kinked) = if between.into_iter().any(flows) {
            let laws = std::array::from_fn(|q| {
                let g = &GAUSS_6X6[q];
                let shares = sides::bounded(cut.share[q]);
                with_void([0, 1].map(|side| {
                    let (m, share) = (between[side], shares[side]);
                    let eta = self.viscosity(m, g.r, scratch);
                    let here = self.here((cell, g.r), m, eta, scratch.cell_orientation(m));
                    let (law, softening) = self.materials[m].law.with_softening(&here);
                    if share > 0.0 && void.is_none_or(|(side_of_void, _)| side_of_void != side) {
                        // The integration points have the stresses of the rotation.
                        let softening = softening.map(Softening::of_shear);
                        let weight = measure.share(g.weight, g.r[0]) * share * cut.trust;
                        out.soften(Place::Fine(q as u8), weight, softening);
                    }
                    law
                }))
            });
            (sides::varying(&cut, &laws, measure), None)
        } else {
            let laws = with_void(between.map(|m| self.law_at_centre(cell, m, scratch)));
            let ramp = Ramp::new(self.walls.sides[cell].any).filter(|_| void.is_none());
            sides::matrix(&cut, &laws, measure, ramp)
        };
        matrix.iter_mut().flatten().for_each(|k| *k *= cut.trust);
        let filled =
            void.map(|(side, share)| Filled::of_side((&cut, 1 - side), 1.0 - share, measure));
        let rest = 1.0 - cut.trust;
        CutStiffness { matrix, rest, sides: Some(Sides { between, cut, kinked }), filled }
    }

    /// Mean of the viscosities of the cell's materials, weighted by volume.
    fn arithmetic_viscosity(&self, scratch: &Gathered) -> f64 {
        let total: f64 = scratch.volumes().iter().sum();
        scratch.volumes().iter().zip(self.materials).map(|(v, m)| v / total * m.viscosity).sum()
    }

    /// Fills the nine points of a cell, its volume fractions and its means. `only`: the material whose
    /// law is that of the cell, if the others have volume only. `softened`: the part of the
    /// derivatives of the viscosities that the points have.
    fn points(
        &self,
        cell: usize,
        out: &mut CellMut,
        (scratch, share, only): (&Gathered, &dyn Fn(usize, usize) -> f64, Option<usize>),
        (empty, softened): (Mixture, f64),
    ) {
        out.fractions.fill(0.0);
        (*out.mean_viscosity, *out.compliance) = (0.0, 0.0);
        let alone = only.is_some() || scratch.is_of_one_material();
        for g in 0..9 {
            let IntegrationPoint { r, weight, .. } = out.points[g];
            let mut mixture = empty;
            for (m, material) in self.materials.iter().enumerate() {
                let phi = share(m, g);
                if phi == 0.0 {
                    continue;
                }
                out.fractions[m] += weight * phi;
                if self.fill.is_some_and(|fill| fill.void() == m) || only.is_some_and(|o| o != m) {
                    continue;
                }
                let phi = if only.is_some() { 1.0 } else { phi };
                let eta = self.viscosity(m, r, scratch);
                let here = self.here((cell, r), m, eta, scratch.orientation(m, g));
                let (law, softening) = material.law.with_softening(&here);
                mixture.add(phi, &law);
                *out.compliance += weight * phi * material.law.compliance;
                if softened > 0.0 {
                    let place = self.place(cell, g, r);
                    // The coupling viscosity of a mixture is less than the sum of its materials'.
                    let softening =
                        if alone { softening } else { softening.map(Softening::of_shear) };
                    out.soften(place, weight * phi * softened, softening);
                }
            }
            let law = mixture.law();
            out.points[g].law = law;
            *out.mean_viscosity += weight * law.shear.mean();
        }
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
    let mut here = Here::without_flow(eta, &orientation);
    if m.law.depends_on().needs_flow() {
        here.flow = flow.at(cell, r);
    }
    let weight = particles.volume[p] / total;
    (eta, IntegrationPoint { law: m.law.at(&here), density, weight, r })
}
