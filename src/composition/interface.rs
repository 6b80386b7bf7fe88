//! This module finds the interface in a cell that contains two materials, from the particles around
//! it.
//!
//! A quadratic level set separates the particles of the two materials in the cell and its eight
//! neighbours. It is found by logistic regression of their labels `y` (0 or 1),
//!
//! ```text
//! f(x) = a + g.x + x.H x / 2,   min  sum_p ln(1 + e^f) - y f  +  (lambda/2) (|g|^2 + |H|^2),
//! ```
//! with `x` relative to the centre of the cell, in cell sizes. The level set represents edges, also
//! curved ones, sheets (`f` positive in a strip) and drops (in an ellipse). The error of its area
//! in a cell is 0.02-0.03 with 16 jittered particles per cell; if the cell's own particles are
//! counted, the error is 0.05.
//!
//! The normal of the interface is the eigenvector of `sum delta(f) n n^T` with the largest
//! eigenvalue. The normalised difference of the eigenvalues is the coherence of the direction: one
//! for an edge or a sheet, zero for a drop.
//!
//! Stiff sheets thinner than a cell are found by [`features`](super::features) and have straight
//! edges.

use super::features::{Labelled, Strip};
use crate::space::measure::CellMeasure;
use crate::space::mesh::Mesh;
use crate::space::particles::Particles;
use crate::space::shape::{GAUSS_6X6, SUBPOINTS};
use nalgebra::{SMatrix, SVector};

/// Regularisation `lambda`: small enough for the curvature of `f` in a sheet of half a cell, large
/// enough for separable labels.
const RIDGE: f64 = 2e-3;
/// Number of Newton steps of the regression.
const NEWTON_STEPS: usize = 6;
/// Value of `|f|` beyond which a correctly classified particle is omitted.
const CERTAIN: f64 = 9.0;
/// Width of the ramp from one material to the other, in cells: the spacing of the points.
const RAMP: f64 = 1.0 / 6.0;
/// Width of the ramp at the edges of a sheet, in cells: at the centre of the cell the points are
/// farther apart than a ramp.
const SHEET_RAMP: f64 = 0.3;
/// Distance from the interface, in cells, over which the weight of a point in the direction decays.
const NEAR: f64 = 0.25;
/// Coherence below which there is no direction, and coherence from which the direction is certain.
const COHERENCE: [f64; 2] = [0.3, 0.7];
/// Difference from the share of the cell's own particles: up to the first value it is noise, from
/// the second value the level set does not represent the cell (two sheets, debris).
const MISFIT: [f64; 2] = [0.1, 0.2];
/// The same limits for a sheet, of which a cell may contain few particles.
const SHEET_MISFIT: [f64; 2] = [0.25, 0.5];

/// The interface in one cell.
#[derive(Clone, Debug)]
pub struct Interface {
    /// Share of the second material at the points of [`GAUSS_6X6`].
    pub share: [f64; SUBPOINTS],
    /// Unit normal; its sign is arbitrary.
    pub normal: [f64; 2],
    /// Whether the interface is that of a stiff sheet thinner than a cell, whose tension is not
    /// limited.
    pub sheet: bool,
    /// Trust in the interface: 0 if there is none, 1 if it is certain.
    pub trust: f64,
}

impl Interface {
    /// The edges of a sheet. `second` tells whether its material is the second one; `wanted` is the
    /// second material's share of the cell.
    pub fn of_sheet(strip: &Strip, second: bool, [hx, hy]: [f64; 2], wanted: f64) -> Self {
        let mut inside =
            GAUSS_6X6.each_ref().map(|g| strip.share([0.5 * g.r[0], 0.5 * g.r[1]], SHEET_RAMP));
        // The points are too few for a thin strip, so the shares are scaled to its area.
        let found: f64 = GAUSS_6X6.iter().zip(inside).map(|(g, s)| g.weight * s).sum();
        let area = strip.area(SHEET_RAMP);
        if found > 0.0 {
            inside.iter_mut().for_each(|s| *s = (*s * area / found).min(1.0));
        }
        let held = if second { area } else { 1.0 - area };
        let share = inside.map(|s| if second { s } else { 1.0 - s });
        let (nx, ny) = (strip.normal[0] / hx, strip.normal[1] / hy);
        let length = nx.hypot(ny);
        let normal = [nx / length, ny / length];
        let trust = fade((held - wanted).abs(), SHEET_MISFIT);
        Interface { share, normal, sheet: true, trust }
    }
}

/// Coefficients `a, g_x, g_y, H_xx, H_xy, H_yy` of the level set.
type Coefficients = [f64; 6];

/// Functions that the coefficients multiply.
fn basis([x, y]: [f64; 2]) -> [f64; 6] {
    [1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y]
}

/// Value of the level set with the coefficients `f` at a point with the basis `x`.
#[inline(always)]
fn value(f: &[f64; 6], x: &[f64; 6]) -> f64 {
    f.iter().zip(x).map(|(f, x)| f * x).sum()
}

/// Particles around a cell, with memory reused from cell to cell.
#[derive(Default)]
pub struct Surroundings {
    particles: Vec<Labelled>,
    cell: CellMeasure,
}

impl Surroundings {
    /// Particles around the last gathered cell, relative to its centre in cell sizes.
    pub fn particles(&self) -> &[Labelled] {
        &self.particles
    }

    /// Interface in the gathered cell, of which the second material has the share `wanted`; `None`
    /// if the regression fails.
    pub fn interface(&self, wanted: f64) -> Option<Interface> {
        let f = self.regress()?;
        Some(describe(&f, self.cell, wanted))
    }

    /// Collects the particles of two materials in a cell and around it.
    pub fn gather(&mut self, mesh: &Mesh, particles: &Particles, cell: usize, between: [usize; 2]) {
        let [a, b] = between;
        self.cell = mesh.whole_measure(cell);
        self.particles.clear();
        let [cx, cy] = mesh.cell_centre(cell);
        let [hx, hy] = mesh.cell_size(cell);
        for near in mesh.block(cell) {
            if mesh.solid[near] {
                continue;
            }
            for p in particles.of_cell(near) {
                let m = particles.material[p] as usize;
                if m != a && m != b {
                    continue;
                }
                let [x, y] = particles.position[p];
                let at = [mesh.x.nearest_image(x - cx) / hx, mesh.y.nearest_image(y - cy) / hy];
                self.particles.push((at, m == b));
            }
        }
    }

    /// Newton's method from zero, where the first step is linear least squares.
    fn regress(&self) -> Option<Coefficients> {
        let mut f: Coefficients = [0.0; 6];
        for _ in 0..NEWTON_STEPS {
            let mut gradient: Coefficients = f.map(|f| -RIDGE * f);
            gradient[0] = 0.0;
            let mut hessian = [[0.0; 6]; 6];
            for (at, second) in &self.particles {
                let x = basis(*at);
                let value = value(&f, &x);
                if value.abs() > CERTAIN && (value > 0.0) == *second {
                    continue;
                }
                let p = 1.0 / (1.0 + (-value.clamp(-30.0, 30.0)).exp());
                let miss = if *second { 1.0 - p } else { -p };
                let weight = p * (1.0 - p);
                for i in 0..6 {
                    gradient[i] += miss * x[i];
                    let w = weight * x[i];
                    for j in 0..6 {
                        hessian[i][j] += w * x[j];
                    }
                }
            }
            for (i, row) in hessian.iter_mut().enumerate() {
                row[i] += if i == 0 { 1e-6 } else { RIDGE };
            }
            let matrix = SMatrix::<f64, 6, 6>::from_fn(|i, j| hessian[i][j]);
            let step = matrix.cholesky()?.solve(&SVector::from(gradient));
            f.iter_mut().zip(step.iter()).for_each(|(f, s)| *f += s);
        }
        f.iter().all(|v| v.is_finite()).then_some(f)
    }
}

/// One below `a`, zero above `b`, linear in between.
pub(super) fn fade(x: f64, [a, b]: [f64; 2]) -> f64 {
    ((b - x) / (b - a)).clamp(0.0, 1.0)
}

/// The interface of a level set in a cell.
fn describe(f: &Coefficients, cell: CellMeasure, wanted: f64) -> Interface {
    let [hx, hy] = cell.size;
    let mut share = [0.0; SUBPOINTS];
    let mut held = 0.0;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (share, g) in share.iter_mut().zip(GAUSS_6X6.iter()) {
        let at = [0.5 * g.r[0], 0.5 * g.r[1]];
        let gx = f[1] + f[3] * at[0] + f[4] * at[1];
        let gy = f[2] + f[4] * at[0] + f[5] * at[1];
        let slope = (gx * gx + gy * gy).sqrt().max(1e-30);
        let distance = value(f, &basis(at)) / slope;
        *share = (0.5 + distance / RAMP).clamp(0.0, 1.0);
        held += cell.share(g.weight, g.r[0]) * *share;
        // Directions are physical, not those of the stretched reference cell.
        let (nx, ny) = (gx / hx, gy / hy);
        let nearness = (-(distance / NEAR).powi(2)).exp() / (nx * nx + ny * ny).max(1e-60);
        xx += nearness * nx * nx;
        xy += nearness * nx * ny;
        yy += nearness * ny * ny;
    }
    let split = (0.5 * (xx - yy)).hypot(xy);
    let coherence = 2.0 * split / (xx + yy).max(1e-30);
    let angle = 0.5 * xy.atan2(0.5 * (xx - yy));
    let directed = 1.0 - fade(coherence, COHERENCE);
    let normal = [angle.cos(), angle.sin()];
    let trust = directed * fade((held - wanted).abs(), MISFIT);
    Interface { share, normal, sheet: false, trust }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Placement;
    use crate::space::mesh::Axis;
    use crate::space::seeding::Seeding;

    const CENTRE: usize = 4;

    /// Jittered particles on 3 x 3 unit cells, labelled by a function of the position relative to
    /// the centre; the interface in the central cell and its true area there.
    fn find(seed: u64, second: impl Fn([f64; 2]) -> bool) -> (Interface, f64) {
        let axis = || Axis::new(vec![0.0, 1.0, 2.0, 3.0], false);
        let mesh = Mesh::new(axis(), axis());
        let seeding = Seeding { side: 4, placement: Placement::Jittered, seed };
        let mut particles = Particles::default();
        for cell in 0..mesh.cells() {
            for p in seeding.positions(&mesh, cell, &mut seeding.random(cell)) {
                particles.position.push(p);
                particles.volume.push(1.0);
                particles.material.push(u8::from(second([p[0] - 1.5, p[1] - 1.5])));
            }
        }
        particles.sort(&mesh);
        let held = particles.of_cell(CENTRE).filter(|&p| particles.material[p] == 1).count();
        let fine = (0..10_000)
            .filter(|k| {
                second([(k % 100) as f64 / 100.0 - 0.495, (k / 100) as f64 / 100.0 - 0.495])
            })
            .count();
        let mut around = Surroundings::default();
        around.gather(&mesh, &particles, CENTRE, [0, 1]);
        (around.interface(held as f64 / 16.0).unwrap(), fine as f64 / 1e4)
    }

    fn area(i: &Interface) -> f64 {
        GAUSS_6X6.iter().zip(i.share).map(|(g, s)| g.weight * s).sum()
    }

    #[test]
    fn an_edge_is_found() {
        let mut sum = 0.0;
        for seed in 0..50 {
            let angle = seed as f64;
            let n = [angle.cos(), angle.sin()];
            let offset = 0.3 * (2.3 * angle).sin();
            let (found, truth) = find(seed, |p| n[0] * p[0] + n[1] * p[1] > offset);
            assert!(found.trust > 0.5, "{}", found.trust);
            let sine = found.normal[0] * n[1] - found.normal[1] * n[0];
            assert!(sine.abs() < 0.15, "{sine}");
            sum += (area(&found) - truth).powi(2);
        }
        assert!((sum / 50.0).sqrt() < 0.03);
    }

    #[test]
    fn a_sheet_has_a_direction_and_a_drop_has_none() {
        let (sheet, truth) = find(3, |p| (0.6 * p[0] + 0.8 * p[1]).abs() < 0.25);
        assert!((area(&sheet) - truth).abs() < 0.12);
        let sine = sheet.normal[0] * 0.8 - sheet.normal[1] * 0.6;
        assert!(sheet.trust > 0.5 && sine.abs() < 0.15, "{sheet:?}");
        let (drop, _) = find(3, |p| p[0].hypot(p[1]) < 0.35);
        assert!(drop.trust < 0.5, "{}", drop.trust);
    }
}
