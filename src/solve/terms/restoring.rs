//! Stable stratification at large steps.
//!
//! Where density grows along gravity, displaced fluid is driven back; the restoring load of the
//! end of a step, taken from its start, overshoots once the step exceeds the relaxation time, and
//! the surface sloshes ("drunken sailor", Kaus, Muehlhaus & May 2010, Phys. Earth Planet. Inter.
//! 181, 12-20). Their remedy is the load a share `theta` of the next step ahead,
//! `rho g - theta dt (u . grad rho) g`. Here its symmetric positive part acts on the *change* of
//! the velocity since the solution before,
//!
//! ```text
//! + theta dt integral c ((u - u_before).e) (v.e),    c = |g| max(0, d rho/d e),   e = g/|g|
//! ```
//! so that the matrix stays symmetric positive definite, the solution is that of the particles'
//! places to second order in `dt` whatever `c` leaves out, and nothing at all is added to a steady
//! flow. With the velocity extrapolated to the middle of the next step, a relaxing mode
//! `x' = -lambda x` then decays at any step for `theta > 1/2`: for `lambda dt -> infinity` its
//! factor per step solves `theta r^2 + (3/2 - 2 theta) r + theta - 1/2 = 0` (`|r| = 0.58` for 3/4).
//! Without it, extrapolation is stable up to `lambda dt = 1`. The error of a step,
//! `(5/12 - theta) dt^3 x'''`, is no larger than before.
//!
//! The gradient of the density is that of its mean in each cell: jumps across faces. A level at the
//! share `s` of a cell puts the parts `1 - s` and `s` of its jump on the faces below and above: the
//! jump and its place are exact. Faces have only nodes that cells share, so that the matrices of
//! uniform cells stay as they are.
//!
//! A level inside a cell also moves with the velocity of the cell's middle, which no face feels, and
//! which only the weaker fluid resists. So the gradient of the density inside a cut cell, as its
//! weight has it, adds such a term over the cell. There it acts on both components: the weight of
//! a cut cell also follows the weaker fluid as it slides along the interface, at right angles to
//! gravity. Without it, steps beyond about 200 times `eta_weak/(rho g h)` amplify rounding to speeds
//! of the order `rho g h^2/eta_weak`: heavy fluid at rest below one a million times thinner, in steps
//! of a thousandth of its own relaxation time.

use super::{CellFace, CellTerm, FaceTerm};
use crate::solve::density::Density;
use crate::space::mesh::Mesh;
use crate::space::neighbours::Face;
use crate::space::shape::NODES;

/// Mass of the quadratic functions on a line, over its length.
pub const LINE_MASS: [[f64; 3]; 3] = [
    [4.0 / 30.0, 2.0 / 30.0, -1.0 / 30.0],
    [2.0 / 30.0, 16.0 / 30.0, 2.0 / 30.0],
    [-1.0 / 30.0, 2.0 / 30.0, 4.0 / 30.0],
];
/// Jumps smaller than this share of the largest density are rounding.
const LEAST_JUMP: f64 = 1e-13;

/// Terms inside cells come in where the restoring force of a step exceeds the weakest viscosity
/// this many times: half of where rounding begins to be amplified without them.
const SUBCELL_STEP: f64 = 100.0;

/// Strength of the terms inside cells over that of the faces': they must outweigh what the weight of
/// a cut cell answers to without symmetry, the slip of one fluid past the other. Heavy fluid at rest
/// below one a million times thinner, 12 cells, levels at 6 shares of a cell, in steps of 1 relaxation
/// time: 1 lets one of them grow, 2 and more none; in steps of 100 the slowest growth is at 3 and 4.
const SUBCELL_STRENGTH: f64 = 3.0;

/// What restoring loads are taken for.
#[derive(Clone, Copy, Debug)]
pub struct Ahead {
    pub gravity: [f64; 2],
    /// How far ahead of the solution.
    pub time: f64,
    /// Smallest viscosity of the scene.
    pub weakest: f64,
}

/// The terms of all faces that have one.
#[derive(Clone, Debug, Default)]
pub struct Restoring {
    faces: Vec<CellFace>,
    /// Force per velocity of each face: `theta dt c` integrated over it.
    strength: Vec<f64>,
    /// Force per velocity, over each cell; empty if there are no terms.
    cells: Vec<f64>,
    /// `e`
    direction: [f64; 2],
    /// `u_before` at the nodes.
    before: Vec<[f64; 2]>,
    /// Mean density of each cell.
    mean: Vec<f64>,
}

impl Restoring {
    /// No terms.
    pub fn clear(&mut self) {
        self.faces.clear();
        self.strength.clear();
        self.cells.clear();
    }

    /// From the density of the cells, and the velocity of the solution before at the nodes.
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
                let strength = ahead * g * jump * mesh.face_area(a, face.normal);
                self.faces.push(CellFace { cell: a, side: 2 * face.normal + 1 });
                self.strength.push(strength);
            }
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
            // Faces alone have the whole gradient: at short steps these terms would count it twice.
            let restoring = measure.times(SUBCELL_STRENGTH * ahead * g * growth);
            restoring * restoring / (restoring + SUBCELL_STEP * weakest * measure.depth())
        }));
    }

    /// Force per velocity over a cell; zero where it has no term of its own.
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
        // Both components alike.
        if c == d { self.cell_strength(cell) * mass } else { 0.0 }
    }

    fn force(
        &self,
        cell: usize,
        nodes: &[usize; NODES],
        u: [[f64; 2]; NODES],
    ) -> ([[f64; 2]; NODES], f64) {
        let mut power = 0.0;
        let force = std::array::from_fn(|a| {
            let mass = |b: usize| LINE_MASS[a % 3][b % 3] * LINE_MASS[a / 3][b / 3];
            std::array::from_fn(|c| {
                let change = |b: usize| u[b][c] - self.before[nodes[b]][c];
                let f =
                    self.cell_strength(cell) * (0..NODES).map(|b| mass(b) * change(b)).sum::<f64>();
                power += f * u[a][c];
                -f
            })
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

    fn force(&self, face: usize, nodes: [usize; 3], u: [[f64; 2]; 3]) -> ([[f64; 2]; 3], f64) {
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
        (force, power)
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
