//! This module stabilises stable stratification at large time steps.
//!
//! Where density grows along gravity, displaced fluid is driven back. The restoring load at the end
//! of a step, computed from its start, overshoots if the step exceeds the relaxation time, and the
//! surface sloshes ("drunken sailor", Kaus, Muehlhaus & May 2010, Phys. Earth Planet. Inter. 181,
//! 12-20). Their remedy is the load at a fraction `theta` of the next step ahead,
//! `rho g - theta dt (u . grad rho) g`. Here its symmetric positive part acts on the *change* of
//! the velocity since the previous solution,
//!
//! ```text
//! + theta dt integral c ((u - u_before).e) (v.e),    c = |g| max(0, d rho/d e),   e = g/|g|
//! ```
//! The matrix therefore stays symmetric positive definite, the solution is that of the current
//! positions of the particles to second order in `dt` whatever `c` omits, and a steady flow is
//! unchanged. With the velocity extrapolated to the middle of the next step, a relaxing mode
//! `x' = -lambda x` then decays at any step for `theta > 1/2`: for `lambda dt -> infinity` its
//! factor per step solves `theta r^2 + (3/2 - 2 theta) r + theta - 1/2 = 0` (`|r| = 0.58` for 3/4).
//! Without the term, extrapolation is stable up to `lambda dt = 1`. The error of a step,
//! `(5/12 - theta) dt^3 x'''`, is no larger than without it.
//!
//! The gradient of the density is that of its cell means: jumps across faces. An interface at the
//! fraction `s` of the height of a cell contributes the parts `1 - s` and `s` of its jump to the
//! faces below and above, so the jump and its position are exact. All nodes of a face are skeleton
//! nodes, so its term is added after the centre of its cell is condensed.
//!
//! An interface inside a cell also moves with the velocity at the centre of the cell, on which no
//! face term acts and which only the weaker fluid resists. The gradient of the density inside a cut
//! cell, as its weight uses it, therefore adds such a term over the cell. There it acts on both
//! components, because the weight of a cut cell also changes as the weaker fluid slides along the
//! interface, at right angles to gravity. Without this term, steps beyond about 200 times
//! `eta_weak/(rho g h)` amplify rounding to speeds of the order `rho g h^2/eta_weak`: for heavy
//! fluid at rest below a fluid a million times thinner, this happens at a thousandth of the heavy
//! fluid's relaxation time.

use super::{CellFace, CellTerm, FaceTerm, Motion, Powers};
use crate::solve::density::Density;
use crate::space::mesh::Mesh;
use crate::space::neighbours::Face;
use crate::space::shape::NODES;

/// Mass matrix of the quadratic functions on a line, divided by its length.
pub const LINE_MASS: [[f64; 3]; 3] = [
    [4.0 / 30.0, 2.0 / 30.0, -1.0 / 30.0],
    [2.0 / 30.0, 16.0 / 30.0, 2.0 / 30.0],
    [-1.0 / 30.0, 2.0 / 30.0, 4.0 / 30.0],
];
/// Smallest jump of the density, as a fraction of the largest density; smaller ones are rounding.
const LEAST_JUMP: f64 = 1e-13;

/// Ratio of the restoring force of a step to the weakest viscosity at which the terms inside cells
/// reach half their strength: half the ratio at which rounding is amplified without them.
const SUBCELL_STEP: f64 = 100.0;

/// Factor on the terms inside cells relative to those on faces. They must outweigh the unsymmetric
/// response of the weight of a cut cell to the slip of one fluid past the other. Test: heavy fluid
/// at rest below a fluid a million times thinner, 12 cells, interfaces at 6 heights in a cell. In
/// steps of 1 relaxation time, rounding grows at one of the heights with a factor of 1 and at none
/// with 2 and more; in steps of 100, growth is slowest with 3 and 4.
const SUBCELL_STRENGTH: f64 = 3.0;

/// Parameters of the restoring term.
#[derive(Clone, Copy, Debug)]
pub struct Ahead {
    /// Gravitational acceleration, in the plan's units.
    pub gravity: [f64; 2],
    /// Time `theta dt` ahead of the solution, in the plan's units.
    pub time: f64,
    /// Smallest viscosity of the scene, in the plan's units.
    pub weakest: f64,
}

/// The restoring terms of all faces and cells that have one.
#[derive(Clone, Debug, Default)]
pub struct Restoring {
    /// Faces with a term.
    faces: Vec<CellFace>,
    /// Force per velocity of each face: `theta dt c` integrated over the face.
    strength: Vec<f64>,
    /// Force per velocity of each cell; empty if there are no terms.
    cells: Vec<f64>,
    /// Unit vector `e` along gravity.
    direction: [f64; 2],
    /// Velocity `u_before` at the nodes.
    before: Vec<[f64; 2]>,
    /// Mean density of each cell.
    mean: Vec<f64>,
}

impl Restoring {
    /// Removes all terms.
    pub fn clear(&mut self) {
        self.faces.clear();
        self.strength.clear();
        self.cells.clear();
    }

    /// Computes the terms from the density of the cells; `before` yields the velocity of the
    /// previous solution at the nodes.
    pub fn update(
        &mut self,
        mesh: &Mesh,
        faces: &[Face],
        density: &Density,
        Ahead { gravity, time: ahead, weakest }: Ahead,
        before: impl Iterator<Item = [f64; 2]>,
    ) {
        self.clear();
        self.before.clear();
        self.before.extend(before);
        let g = gravity[0].hypot(gravity[1]);
        if g == 0.0 {
            return;
        }
        self.direction = gravity.map(|c| c / g);
        self.mean.clear();
        self.mean.extend((0..mesh.cells()).map(|cell| density.mean(cell)));
        let mean = &self.mean;
        let least = LEAST_JUMP * mean.iter().fold(0.0, |a: f64, d| a.max(d.abs()));
        for face in faces {
            let [a, b] = face.cells.map(|c| c as usize);
            let jump = (mean[b] - mean[a]) * self.direction[face.normal];
            if jump > least {
                let side = 2 * face.normal + 1;
                let strength = ahead * g * jump * mesh.face(a, side).area;
                // A cell of a void has no matrix.
                let (cell, side) = if density.is_void(a) { (b, side - 1) } else { (a, side) };
                self.faces.push(CellFace { cell, side });
                self.strength.push(strength);
            }
        }
        if !self.faces.is_sorted_by_key(|face| face.cell) {
            let mut order: Vec<usize> = (0..self.faces.len()).collect();
            order.sort_by_key(|&k| self.faces[k].cell);
            self.faces = order.iter().map(|&k| self.faces[k]).collect();
            self.strength = order.iter().map(|&k| self.strength[k]).collect();
        }
        let direction = self.direction;
        self.cells.extend((0..mesh.cells()).map(|cell| {
            let (measure, slope) = (mesh.cell_measure(cell), density.slope(cell));
            let [hx, hy] = measure.size;
            let [x, y] = [slope[0] * direction[0], slope[1] * direction[1]];
            let growth = 2.0 * (x / hx + y / hy);
            if x + y <= least {
                return 0.0;
            }
            // The faces contain the whole gradient: at short steps this term would count it twice.
            let restoring = measure.times(SUBCELL_STRENGTH * ahead * g * growth);
            restoring * restoring / (restoring + SUBCELL_STEP * weakest * measure.depth())
        }));
    }

    /// Force per velocity over a cell; zero if the cell has no term.
    fn cell_strength(&self, cell: usize) -> f64 {
        self.cells.get(cell).copied().unwrap_or(0.0)
    }
}

impl CellTerm for Restoring {
    fn acts_on(&self, cell: usize) -> bool {
        self.cell_strength(cell) > 0.0
    }

    fn entry(&self, cell: usize, [a, b]: [usize; 2], [c, d]: [usize; 2]) -> f64 {
        let mass = LINE_MASS[a % 3][b % 3] * LINE_MASS[a / 3][b / 3];
        // The same term acts on both components.
        if c == d { self.cell_strength(cell) * mass } else { 0.0 }
    }

    fn force(&self, cell: usize, nodes: &[usize; NODES], u: &Motion) -> (Motion, f64) {
        let mut power = 0.0;
        let force = std::array::from_fn(|a| {
            let mass = |b: usize| LINE_MASS[a % 3][b % 3] * LINE_MASS[a / 3][b / 3];
            let mut along = |c: usize| {
                let change = |b: usize| u[b][c] - self.before[nodes[b]][c];
                let f =
                    self.cell_strength(cell) * (0..NODES).map(|b| mass(b) * change(b)).sum::<f64>();
                power += f * u[a][c];
                -f
            };
            [along(0), along(1), 0.0]
        });
        (force, power)
    }
}

impl FaceTerm for Restoring {
    fn faces(&self) -> &[CellFace] {
        &self.faces
    }

    fn entry(&self, face: usize, [k, l]: [usize; 2], [c, d]: [usize; 2]) -> f64 {
        self.strength[face] * LINE_MASS[k][l] * self.direction[c] * self.direction[d]
    }

    fn force(&self, face: usize, nodes: [usize; 3], u: [[f64; 2]; 3]) -> ([[f64; 2]; 3], Powers) {
        let [ex, ey] = self.direction;
        let along = u.map(|u| u[0] * ex + u[1] * ey);
        let change: [f64; 3] = std::array::from_fn(|k| {
            let before = self.before[nodes[k]];
            along[k] - before[0] * ex - before[1] * ey
        });
        let mut power = 0.0;
        let force = std::array::from_fn(|k| {
            let f = self.strength[face] * (0..3).map(|l| LINE_MASS[k][l] * change[l]).sum::<f64>();
            power += f * along[k];
            [-f * ex, -f * ey]
        });
        (force, Powers { numerical: power, ..Powers::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_mass_integrates_products_of_quadratics() {
        // 1 * 1, t * t, t^2 * t^2 on [-1, 1], whose nodes are -1, 0, 1; mean values.
        for (f, mean) in
            [([1.0, 1.0, 1.0], 1.0), ([-1.0, 0.0, 1.0], 1.0 / 3.0), ([1.0, 0.0, 1.0], 0.2)]
        {
            let sum: f64 = (0..9).map(|k| f[k % 3] * LINE_MASS[k % 3][k / 3] * f[k / 3]).sum();
            assert!((sum - mean).abs() < 1e-15);
        }
    }
}
