//! This module computes sums over the particles of one cell: volumes, shares at the Gauss points,
//! orientations, fits of carried viscosities, and the arrangement of two materials.
//!
//! The share of material `m` at Gauss point `g` is the particle volume near it, weighted by
//! `exp(-r^2 / (0.4 h)^2)`.

use super::Kind;
use super::centroids::Centroids;
use super::features::{self, Strip};
use super::interface::{Interface, Surroundings};
use super::surface::VoidPart;
use crate::laws::director::Orientation;
use crate::space::fit::{Degree, Fit, Polynomial};
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_3, GAUSS_3X3};
use std::cell::RefCell;

/// Width of the kernel in cells; 0.4 gave the smallest error of the values tested.
const KERNEL_WIDTH: f64 = 0.4;

/// Tolerance of the iteration that matches shares to volumes; far below the noise of the particles.
const MATCHING_TOLERANCE: f64 = 1e-6;
/// Largest number of iterations that match shares to volumes.
const MATCHING_ITERATIONS: usize = 30;

/// Sums over the particles of one cell, by Gauss point and material.
#[derive(Default)]
pub struct Gathered {
    /// Kernel-weighted volume, later the share; index `9 m + g`.
    weight: Vec<f64>,
    /// Orientation of the directors near a Gauss point; index `9 m + g`.
    orientation: Vec<Orientation>,
    /// Volume of each material.
    volume: Vec<f64>,
    /// Points and values of the fits of `ln eta`, by material.
    log_viscosity: Vec<Fit>,
    /// Fits of `ln eta`, by material.
    viscosity: Vec<Option<Polynomial>>,
    /// Orientation of all directors of the cell, by material.
    cell_orientation: Vec<Orientation>,
    centroids: Centroids,
    /// Weights of the Gauss points, which add up to one.
    points: [f64; 9],
    /// Particles of the cell and its neighbours.
    surroundings: Surroundings,
    /// The void of the cell.
    void: Option<VoidPart>,
    /// Working memory.
    numbers: Vec<f64>,
}

thread_local! {
    /// Working memory of each thread.
    pub static SCRATCH: RefCell<Gathered> = RefCell::default();
}

/// The two materials of a cell and the particles around it.
pub struct Neighbourhood<'a> {
    /// Indices of the two materials.
    pub between: [usize; 2],
    /// Share of the second material in the volume of the cell's particles.
    pub share: f64,
    size: [f64; 2],
    surroundings: &'a Surroundings,
    numbers: &'a mut Vec<f64>,
}

impl Neighbourhood<'_> {
    /// Whether the first or the second material forms a drop in the other.
    pub fn is_drop(&self, second: bool) -> bool {
        features::is_drop(self.surroundings.particles(), second)
    }

    /// Edges of a sheet that the first or the second material forms; `None` if there is no sheet or
    /// it cannot be trusted.
    pub fn sheet(&mut self, second: bool) -> Option<Interface> {
        let strip: Strip = features::sheet(self.surroundings.particles(), second, self.numbers)?;
        let interface = Interface::of_sheet(&strip, second, self.size, self.share);
        (interface.trust > 0.0).then_some(interface)
    }

    /// The interface; `None` if there is none that can be trusted.
    pub fn interface(&self) -> Option<Interface> {
        self.surroundings.interface(self.share).filter(|i| i.trust > 0.0)
    }
}

impl Gathered {
    /// Allocates memory for a number of materials.
    pub fn prepare(&mut self, materials: usize) {
        self.weight.resize(9 * materials, 0.0);
        self.orientation.resize(9 * materials, Orientation::default());
        self.volume.resize(materials, 0.0);
        self.log_viscosity.resize(materials, Fit::default());
        self.cell_orientation.resize(materials, Orientation::default());
    }

    /// Computes the sums over the particles of a cell.
    pub fn gather(&mut self, mesh: &Mesh, cell: usize, particles: &Particles, kinds: &[Kind]) {
        self.void = None;
        let measure = mesh.whole_measure(cell);
        self.points = GAUSS_3X3.each_ref().map(|g| measure.share(g.weight, g.r[0]));
        self.weight.fill(0.0);
        self.orientation.fill(Orientation::default());
        self.volume.fill(0.0);
        self.log_viscosity.iter_mut().for_each(Fit::clear);
        self.cell_orientation.fill(Orientation::default());
        for p in particles.of_cell(cell) {
            let m = particles.material[p] as usize;
            let volume = particles.volume[p];
            let director = particles.director.as_ref().filter(|_| kinds[m].directors).map(|d| d[p]);
            let r = mesh.to_reference(cell, particles.position[p]);
            let kernel = |t: f64, g: f64| {
                let q = 0.5 * (t - g) / KERNEL_WIDTH;
                (-q * q).exp()
            };
            let kx = GAUSS_3.map(|g| kernel(r[0], g));
            let ky = GAUSS_3.map(|g| kernel(r[1], g));
            self.volume[m] += volume;
            if let Some(n) = director {
                self.cell_orientation[m].add(volume, n);
            }
            for g in 0..9 {
                let w = volume * kx[g % 3] * ky[g / 3];
                self.weight[9 * m + g] += w;
                if let Some(n) = director {
                    self.orientation[9 * m + g].add(w, n);
                }
            }
            if let (Some(v), true) = (&particles.viscosity, kinds[m].viscosity) {
                self.log_viscosity[m].add(volume, r, v[p].ln());
            }
        }
    }

    /// Adds a void, after [`Gathered::gather`].
    pub fn add_void(&mut self, void: VoidPart, factors: &[f64]) {
        let VoidPart { material: m, share, .. } = void;
        let volume: f64 = self.volume.iter().zip(factors).map(|(v, f)| v * f).sum();
        self.volume[m] = volume * share / (1.0 - share);
        self.weight[9 * m..9 * m + 9].fill(self.volume[m]);
        self.void = Some(void);
    }

    /// The void of the cell, after [`Gathered::add_void`].
    pub fn void(&self) -> Option<VoidPart> {
        self.void
    }

    /// The two materials of the cell and the particles around it; `None` if the cell has more or
    /// fewer materials.
    pub fn neighbourhood(
        &mut self,
        mesh: &Mesh,
        cell: usize,
        particles: &Particles,
    ) -> Option<Neighbourhood<'_>> {
        let mut present = (0..self.volume.len()).filter(|&m| self.volume[m] > 0.0);
        let (Some(first), Some(second), None) = (present.next(), present.next(), present.next())
        else {
            return None;
        };
        let between = [first, second];
        let [a, b] = between.map(|m| self.volume[m]);
        self.surroundings.gather(mesh, particles, cell, between);
        Some(Neighbourhood {
            between,
            share: b / (a + b),
            size: mesh.cell_size(cell),
            surroundings: &self.surroundings,
            numbers: &mut self.numbers,
        })
    }

    /// Converts kernel weights to shares whose mean over the cell is each material's share of the
    /// volume of the particles, multiplied by `factors`: a fixed-point iteration finds a common
    /// factor for the weights of each material. The volume of each material in the cell is then
    /// that of its particles.
    pub fn match_volumes(&mut self, factors: &[f64]) {
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
                let mean: f64 = weight.iter().zip(self.points).map(|(w, g)| w * g).sum();
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

    /// Shares and shifted centroids of the materials of a cell, for the factors and viscosities of
    /// all materials.
    pub fn centroids(
        &mut self,
        (mesh, cell): (&Mesh, usize),
        particles: &Particles,
        factors: &[f64],
        viscosity: impl Iterator<Item = f64> + Clone,
    ) -> &Centroids {
        self.centroids.prepare(factors.len());
        self.centroids.gather(mesh, cell, particles);
        if let Some(void) = self.void {
            self.centroids.add_void(void, factors);
        }
        self.centroids.finish(factors, viscosity);
        &self.centroids
    }

    /// Fits the carried viscosities, which [`Gathered::viscosity_at`] then returns.
    pub fn fit_viscosities(&mut self) {
        self.viscosity.clear();
        self.viscosity.extend(self.log_viscosity.iter().map(|f| f.solve(Degree::Quadratic)));
    }

    /// Share of a material at a Gauss point, after [`Gathered::match_volumes`].
    pub fn share(&self, material: usize, g: usize) -> f64 {
        self.weight[9 * material + g]
    }

    /// Share of a material in the cell, after [`Gathered::match_volumes`].
    pub fn mean_share(&self, material: usize) -> f64 {
        self.points.iter().enumerate().map(|(g, point)| point * self.share(material, g)).sum()
    }

    /// Volumes of the materials.
    pub fn volumes(&self) -> &[f64] {
        &self.volume
    }

    /// Whether the cell has particles of one material only.
    pub fn is_of_one_material(&self) -> bool {
        self.volume.iter().filter(|&&v| v > 0.0).count() == 1
    }

    /// Orientation of a material's directors near a Gauss point.
    pub fn orientation(&self, material: usize, g: usize) -> &Orientation {
        &self.orientation[9 * material + g]
    }

    /// Orientation of a material's directors in the whole cell.
    pub fn cell_orientation(&self, material: usize) -> &Orientation {
        &self.cell_orientation[material]
    }

    /// Carried viscosity of a material at reference coordinates `r`, after
    /// [`Gathered::fit_viscosities`]; `None` if its particles carry none.
    pub fn viscosity_at(&self, material: usize, r: [f64; 2]) -> Option<f64> {
        self.viscosity[material].as_ref().map(|fit| fit.at_bounded(r).exp())
    }
}
