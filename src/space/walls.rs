//! Walls as obstacles: what keeps particles and tracers on their side.

use super::mesh::{Mesh, ON_LINE};

/// A straight obstacle along a mesh line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// 0: at a constant x; 1: at a constant y.
    pub normal: usize,
    pub at: f64,
    /// Extent along the other direction.
    pub from: f64,
    pub to: f64,
}

/// Where a path ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Landing {
    /// Where it wanted to go.
    Free([f64; 2]),
    /// Held back by a wall.
    Held([f64; 2]),
    /// Through an open side.
    Left,
}

/// All obstacles of a scene and which sides let particles out.
#[derive(Clone, Debug, Default)]
pub struct Enclosure {
    pub obstacles: Vec<Obstacle>,
    /// left, right, bottom, top
    pub open: [bool; 4],
}

impl Enclosure {
    /// Follows the straight path from `p0` (inside the mesh) to `p1`. The result is not wrapped
    /// around periodic sides.
    pub fn follow(&self, mesh: &Mesh, p0: [f64; 2], p1: [f64; 2]) -> Landing {
        let mut to = p1;
        let mut held = false;
        for (c, axis) in [&mesh.x, &mesh.y].into_iter().enumerate() {
            if axis.periodic() {
                continue;
            }
            let (low, high) = (axis.start(), axis.end());
            if to[c] < low || to[c] > high {
                if self.open[2 * c + usize::from(to[c] > high)] {
                    return Landing::Left;
                }
                to[c] = to[c].clamp(low, high);
                held = true;
            }
        }
        // Each pass removes one crossing; a path meets few walls.
        for _ in 0..8 {
            let first = self
                .obstacles
                .iter()
                .filter_map(|w| w.crossing(mesh, p0, to).map(|t| (t, w)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, wall)) = first else { break };
            to[wall.normal] =
                if p0[wall.normal] >= wall.at { wall.at } else { wall.below(mesh).next_down() };
            held = true;
        }
        if held { Landing::Held(to) } else { Landing::Free(to) }
    }
}

impl Obstacle {
    /// The largest coordinate below it that no cell above it counts as its own.
    fn below(&self, mesh: &Mesh) -> f64 {
        let axis = if self.normal == 0 { &mesh.x } else { &mesh.y };
        let line = axis.nearest_line(self.at);
        self.at - 2.0 * ON_LINE * axis.size(line.saturating_sub(1))
    }

    /// Fraction of the path at which it passes through. A point on the line counts to the upper
    /// side, as cells do; from below the wall is where that begins.
    fn crossing(&self, mesh: &Mesh, p0: [f64; 2], p1: [f64; 2]) -> Option<f64> {
        let (a, b) = (p0[self.normal], p1[self.normal]);
        let above = a >= self.at;
        let axis = if self.normal == 0 { &mesh.x } else { &mesh.y };
        if !above && b < self.at - 2.0 * ON_LINE * axis.length() {
            // Most paths are far from most walls: no need to know where exactly this one begins.
            return None;
        }
        let plane = if above { self.at } else { self.below(mesh) };
        if above == (b >= plane) {
            return None;
        }
        let t = if a == b { 0.0 } else { ((plane - a) / (b - a)).clamp(0.0, 1.0) };
        let along = p0[1 - self.normal] + t * (p1[1 - self.normal] - p0[1 - self.normal]);
        (along >= self.from && along <= self.to).then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Axis;
    use super::*;

    fn mesh() -> Mesh {
        Mesh::new(Axis::new(vec![0.0, 1.0, 2.0], false), Axis::new(vec![0.0, 1.0, 2.0], false))
    }

    #[test]
    fn a_wall_holds_a_path_on_its_side_and_an_aperture_lets_it_through() {
        let e = Enclosure {
            obstacles: vec![Obstacle { normal: 1, at: 1.0, from: 0.0, to: 1.0 }],
            open: [false; 4],
        };
        let m = mesh();
        assert_eq!(e.follow(&m, [0.5, 1.5], [0.6, 0.7]), Landing::Held([0.6, 1.0]));
        let below = (1.0 - 2.0 * ON_LINE).next_down();
        assert_eq!(e.follow(&m, [0.5, 0.5], [0.6, 1.7]), Landing::Held([0.6, below]));
        assert_eq!(m.locate([0.6, below]), 0, "a point that a wall holds is on its side");
        // A point that only comes near counts to the cell above the wall, and is held too.
        assert_eq!(
            e.follow(&m, [0.5, 0.5], [0.5, 1.0 - 0.1 * ON_LINE]),
            Landing::Held([0.5, below])
        );
        assert_eq!(e.follow(&m, [0.5, 1.0], [0.5, 0.9]), Landing::Held([0.5, 1.0]));
        assert_eq!(e.follow(&m, [1.5, 1.5], [1.4, 0.7]), Landing::Free([1.4, 0.7]));
        assert_eq!(e.follow(&m, [1.5, 1.5], [1.5, 2.7]), Landing::Held([1.5, 2.0]));
    }

    #[test]
    fn corners_hold_both_directions_and_open_sides_let_out() {
        let e = Enclosure {
            obstacles: vec![
                Obstacle { normal: 0, at: 1.0, from: 0.0, to: 1.0 },
                Obstacle { normal: 1, at: 1.0, from: 0.0, to: 1.0 },
            ],
            open: [false, true, false, false],
        };
        let m = mesh();
        let inside = [(1.0 - 2.0 * ON_LINE).next_down(); 2];
        assert_eq!(e.follow(&m, [0.9, 0.8], [1.3, 1.4]), Landing::Held(inside));
        assert_eq!(e.follow(&m, [1.9, 1.8], [2.3, 1.4]), Landing::Left);
    }
}
