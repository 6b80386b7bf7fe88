//! This module computes the density of each cell for the weight.
//!
//! In a cut cell the share of material `m` varies linearly, with the volume and the first moments
//! of its particles,
//!
//! ```text
//! chi_m(xi, eta) = s_m (1 + 3 X_m xi + 3 Y_m eta),   rho = sum_m chi_m rho_m
//! ```
//! where `s_m` is the material's share of the volume of the particles and `(X_m, Y_m)` its shifted
//! centroid. This is the projection of the true density on linear functions, which needs no
//! assumption about the density between particles. The omitted part does work only on the curvature
//! of the velocity. Shares smoothed by a kernel, which the viscosity uses, would transfer the noise
//! of the particles' positions to the load: on a mesh of 32 cells, a horizontal interface at rest
//! inside a cell then moves with 3e-3 rho g a^2/eta at a viscosity contrast of 1000, and not at all
//! with exact moments.
//!
//! `s_m` and `(X_m, Y_m)` are those of [`centroids`](crate::composition::centroids).
//!
//! Where a straight line separates the materials of a cell (see
//! [`straight`](crate::composition::straight)), each side has its own density, so that the weight
//! of a fluid acts where its stiffness is. Distributed linearly over the whole cell, the weight of
//! the heavy fluid would also drive the thin one.
//!
//! With inertia the density is also that of the mass, which must nowhere be negative. A linear share is
//! negative in a part of a cell whose material lies in a corner, so there the variation of the density
//! is scaled down until the density is nowhere below that of the lightest material.
//!
//! `rho_m` is a quadratic fit if particles carry their density. Particles of neighbouring cells
//! contribute to the fit with a small weight.

use super::quadrature::Quadrature;
use super::sides::Sides;
use crate::composition::Content;
use crate::composition::centroids::Centroids;
use crate::plan::material::Material;
use crate::space::fit::{Degree, Fit, Polynomial};
use crate::space::measure::CellMeasure;
use crate::space::mesh::Mesh;
use crate::space::neighbours::Neighbours;
use crate::space::particles::Particles;
use crate::space::parts::{Part, SharedParts};
use crate::space::shape::{GAUSS_3, GAUSS_3X3, GAUSS_6X6, NODES, SUBPOINTS};
use std::sync::LazyLock;

/// Weight per volume of a neighbour's particle in a fit, relative to the cell's own particles, by
/// its reference coordinates.
///
/// Sixteen particles at random positions occasionally determine six coefficients badly; a few
/// particles of neighbouring cells, even with a small weight, prevent that. On the steady vortex at
/// 32 cells with random particles, the velocity error is 2.3 times the error without particles if
/// neighbours do not contribute and 1.3 times if they do; with three times the weight, or without
/// decay, it is 3 and 10 times.
fn lent([x, y]: [f64; 2]) -> f64 {
    0.1 * ((2.0 - x * x - y * y) / 0.7).exp().min(1.0)
}

/// Densities of each cell.
pub struct Density {
    neighbours: Neighbours,
    /// Linear densities at the points of [`GAUSS_3X3`].
    at_gauss: Vec<[f64; 9]>,
    /// Densities of the cells cut by a straight line.
    of_sides: Vec<Option<Box<SideDensities>>>,
    centroids: Centroids,
    /// Fits of the densities that the particles of each material carry.
    fits: Vec<Fit>,
    /// Density of each material of the cell.
    densities: Vec<Option<Polynomial>>,
    /// Whether densities lie nowhere below that of the lightest material.
    bounded: bool,
    /// Share of a void in each cell; empty without one.
    void: Vec<f64>,
    /// What is distributed, per mass of a material: 1 for the mass itself.
    pub per_mass: fn(&Material) -> f64,
    /// Parts of cells with solids of any shape in them; their density is constant.
    parts: SharedParts,
    /// Measures of the cells.
    measures: Vec<CellMeasure>,
}

/// Densities of a cell cut by a straight line, at the points of [`GAUSS_6X6`].
#[derive(Clone)]
struct SideDensities {
    /// Density.
    density: [f64; SUBPOINTS],
    /// Density times the function `psi` of the kink of the velocity.
    kinked: [f64; SUBPOINTS],
}

/// An integration point of the weight.
pub struct MassPoint<'a> {
    /// Mass divided by the volume of the cell.
    pub mass: f64,
    /// The mass times the function `psi` of the kink of the velocity.
    pub kinked: f64,
    /// Reference coordinates.
    pub r: [f64; 2],
    /// Values of the shape functions.
    pub n: &'a [f64; NODES],
}

/// Values at the points of [`GAUSS_6X6`] of the Lagrange polynomials of the points of
/// [`GAUSS_3X3`].
static FROM_GAUSS: LazyLock<[[f64; 9]; SUBPOINTS]> = LazyLock::new(|| {
    let along = |t: f64| -> [f64; 3] {
        std::array::from_fn(|i| {
            let others = (0..3).filter(|&k| k != i);
            others.map(|k| (t - GAUSS_3[k]) / (GAUSS_3[i] - GAUSS_3[k])).product()
        })
    };
    std::array::from_fn(|q| {
        let [x, y] = GAUSS_6X6[q].r.map(along);
        std::array::from_fn(|g| x[g % 3] * y[g / 3])
    })
});

/// Value at a point of [`GAUSS_6X6`] of the polynomial with given values at the points of
/// [`GAUSS_3X3`].
fn at_fine_point(at_gauss: &[f64; 9], q: usize) -> f64 {
    FROM_GAUSS[q].iter().zip(at_gauss).map(|(l, d)| l * d).sum()
}

impl Density {
    /// Creates zero densities for all cells. `bounded`: the density is that of a mass.
    pub fn new(mesh: &Mesh, neighbours: Neighbours, materials: usize, bounded: bool) -> Self {
        Density {
            neighbours,
            at_gauss: vec![[0.0; 9]; mesh.cells()],
            of_sides: vec![None; mesh.cells()],
            centroids: Centroids::new(materials),
            fits: vec![Fit::default(); materials],
            densities: Vec::with_capacity(materials),
            bounded,
            void: vec![],
            per_mass: |_| 1.0,
            parts: mesh.shared_parts(),
            measures: (0..mesh.cells()).map(|cell| mesh.whole_measure(cell)).collect(),
        }
    }

    /// Computes the densities of all cells. `particles` must be sorted, and `quadrature` evaluated
    /// with the same particles.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        particles: &Particles,
        materials: &[Material],
        quadrature: &Quadrature,
    ) {
        if let Some(fill) = quadrature.composition().fill() {
            self.void.clear();
            self.void.extend((0..mesh.cells()).map(|cell| 1.0 - fill.of(cell)));
        }
        for cell in 0..mesh.cells() {
            let kept = self.of_sides[cell].take();
            self.at_gauss[cell] = match quadrature.content(cell) {
                Content::Uniform { material, .. } | Content::Flowing { material } => {
                    [self.of(&materials[material as usize]); 9]
                }
                Content::Mixed => {
                    self.gather(mesh, cell, particles, materials);
                    if let Some(void) = quadrature.composition().void_in(mesh, cell) {
                        self.centroids.add_void(void, quadrature.composition().factors());
                    }
                    self.help(mesh, cell, particles, materials);
                    let viscosity = materials.iter().map(|m| m.viscosity);
                    self.centroids.finish(quadrature.composition().factors(), viscosity);
                    let fits = self.fits.iter();
                    self.densities.clear();
                    self.densities.extend(fits.map(|f| f.solve(Degree::Quadratic)));
                    let mut linear = self.at_gauss(materials);
                    if mesh.part(cell).is_some() {
                        linear = [self.mean_of_shares(materials); 9];
                    }
                    if let Some(sides) = quadrature.cut(cell).and_then(|cut| cut.sides.as_ref()) {
                        let densities = self.sides(sides, &linear, materials);
                        self.of_sides[cell] = Some(match kept {
                            Some(mut kept) => {
                                *kept = densities;
                                kept
                            }
                            None => Box::new(densities),
                        });
                    }
                    linear
                }
                Content::Empty | Content::Solid | Content::Unknown => [0.0; 9],
            };
        }
    }

    fn part(&self, cell: usize) -> Option<&Part> {
        self.parts.as_deref()?.of(cell)
    }

    /// Whether a cell is of a void.
    pub fn is_void(&self, cell: usize) -> bool {
        self.void_share(cell) == 1.0
    }

    /// Share of a void in a cell.
    pub fn void_share(&self, cell: usize) -> f64 {
        self.void.get(cell).copied().unwrap_or(0.0)
    }

    /// Mean density of the section of a cell.
    pub fn mean(&self, cell: usize) -> f64 {
        self.at_gauss[cell].iter().zip(GAUSS_3X3.iter()).map(|(d, g)| d * g.weight).sum()
    }

    /// Share of a point of the plane in the volume of a cell.
    fn share(&self, cell: usize, weight: f64, r: [f64; 2]) -> f64 {
        self.measures[cell].share(weight, r[0])
    }

    /// Gradient of the density inside a cell, per reference coordinate.
    pub fn slope(&self, cell: usize) -> [f64; 2] {
        let points = || self.at_gauss[cell].iter().zip(GAUSS_3X3.iter());
        [0, 1].map(|c| points().map(|(d, g)| 3.0 * d * g.weight * g.r[c]).sum())
    }

    /// Calls `f` for each integration point.
    pub fn for_points(&self, cell: usize, mut f: impl FnMut(MassPoint)) {
        if let Some(part) = self.part(cell) {
            for p in &part.points {
                let mass = p.weight * self.at_gauss[cell][0];
                f(MassPoint { mass, kinked: 0.0, r: p.r, n: &p.shape.n });
            }
        } else if let Some(sides) = &self.of_sides[cell] {
            let densities = sides.density.iter().zip(&sides.kinked);
            for ((density, kinked), g) in densities.zip(GAUSS_6X6.iter()) {
                let weight = self.share(cell, g.weight, g.r);
                let [mass, kinked] = [density, kinked].map(|d| weight * d);
                f(MassPoint { mass, kinked, r: g.r, n: &g.shape.n });
            }
        } else {
            for (density, g) in self.at_gauss[cell].iter().zip(GAUSS_3X3.iter()) {
                let mass = self.share(cell, g.weight, g.r) * density;
                f(MassPoint { mass, kinked: 0.0, r: g.r, n: &g.shape.n });
            }
        }
    }

    /// Calls `f` for each of the points of [`GAUSS_6X6`]. Integrals of polynomials are those of
    /// [`Density::for_points`].
    pub fn for_fine_points(&self, cell: usize, mut f: impl FnMut(MassPoint)) {
        if self.of_sides[cell].is_some() || self.part(cell).is_some() {
            return self.for_points(cell, f);
        }
        for (q, g) in GAUSS_6X6.iter().enumerate() {
            let density = at_fine_point(&self.at_gauss[cell], q);
            let mass = self.share(cell, g.weight, g.r) * density;
            f(MassPoint { mass, kinked: 0.0, r: g.r, n: &g.shape.n });
        }
    }

    /// Sums the volumes and moments of the materials, and collects the points of the fits.
    fn gather(&mut self, mesh: &Mesh, cell: usize, particles: &Particles, materials: &[Material]) {
        self.centroids.gather(mesh, cell, particles);
        self.fits.iter_mut().for_each(Fit::clear);
        let Some(density) = &particles.density else { return };
        for p in particles.of_cell(cell) {
            let m = particles.material[p] as usize;
            if materials[m].carries_density {
                let r = mesh.to_reference(cell, particles.position[p]);
                self.fits[m].add(particles.volume[p], r, density[p]);
            }
        }
    }

    /// Adds particles of neighbouring cells to the fits of carried densities.
    fn help(&mut self, mesh: &Mesh, cell: usize, particles: &Particles, materials: &[Material]) {
        let Some(density) = &particles.density else { return };
        for (m, fit) in self.fits.iter_mut().enumerate() {
            if !materials[m].carries_density {
                continue;
            }
            for p in self.neighbours.of(cell).flat_map(|n| particles.of_cell(n)) {
                if particles.material[p] as usize == m {
                    let r = mesh.to_near_reference(cell, particles.position[p]);
                    fit.borrow(lent(r) * particles.volume[p], r, density[p]);
                }
            }
        }
    }

    /// Density of a material that does not carry its own.
    fn of(&self, material: &Material) -> f64 {
        (self.per_mass)(material) * material.density
    }

    /// Density of a material at a point of the cell, after its fits.
    fn of_material(&self, m: usize, r: [f64; 2], materials: &[Material]) -> f64 {
        let fitted = self.densities[m].as_ref();
        fitted.map_or_else(|| self.of(&materials[m]), |f| (self.per_mass)(&materials[m]) * f.at(r))
    }

    /// Density at a point of the cell for shares that vary linearly.
    fn linear(&self, r: [f64; 2], materials: &[Material]) -> f64 {
        let mut density = 0.0;
        for m in 0..materials.len() {
            let share = self.centroids.share(m);
            if share > 0.0 {
                density += self.centroids.share_at(m, r) * self.of_material(m, r, materials);
            }
        }
        density
    }

    /// Mean density of the materials of the cell, after its fits.
    fn mean_of_shares(&self, materials: &[Material]) -> f64 {
        let of = |m: usize| {
            self.centroids.share(m) * self.of_material(m, self.centroids.centroid(m), materials)
        };
        (0..materials.len()).filter(|&m| self.centroids.share(m) > 0.0).map(of).sum()
    }

    /// Densities at the points of [`GAUSS_3X3`] for shares that vary linearly.
    fn at_gauss(&self, materials: &[Material]) -> [f64; 9] {
        let linear = GAUSS_3X3.each_ref().map(|g| self.linear(g.r, materials));
        if !self.bounded {
            return linear;
        }
        let present = (0..materials.len()).filter(|&m| self.centroids.share(m) > 0.0);
        let lightest =
            |m: usize| if materials[m].carries_density { 0.0 } else { self.of(&materials[m]) };
        let least = present.map(lightest).fold(f64::INFINITY, f64::min);
        let mean: f64 = linear.iter().zip(GAUSS_3X3.iter()).map(|(d, g)| d * g.weight).sum();
        let lowest = (0..SUBPOINTS).map(|q| at_fine_point(&linear, q)).fold(mean, f64::min);
        if lowest >= least {
            return linear;
        }
        let scale = ((mean - least) / (mean - lowest)).max(0.0);
        linear.map(|d| mean + scale * (d - mean))
    }

    /// Densities of a cell cut by a line; `linear`: those for shares that vary linearly.
    fn sides(&self, sides: &Sides, linear: &[f64; 9], materials: &[Material]) -> SideDensities {
        let trust = sides.cut.trust;
        let mut out = SideDensities { density: [0.0; SUBPOINTS], kinked: [0.0; SUBPOINTS] };
        for (q, g) in GAUSS_6X6.iter().enumerate() {
            let share = sides.cut.share[q];
            let of = sides.between.map(|m| self.of_material(m, g.r, materials));
            let mass = [(1.0 - share) * of[0], share * of[1]];
            let psi = sides.kinked.as_ref().map_or([0.0; 2], |kinked| kinked.kink.values(g));
            let rest = match trust < 1.0 {
                true if self.bounded => (1.0 - trust) * at_fine_point(linear, q),
                true => (1.0 - trust) * self.linear(g.r, materials),
                false => 0.0,
            };
            out.density[q] = trust * (mass[0] + mass[1]) + rest;
            out.kinked[q] = trust * (mass[0] * psi[0] + mass[1] * psi[1]);
        }
        out
    }
}
