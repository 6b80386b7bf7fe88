//! This module stops particles and dye lines at walls, and lets them leave through openings
//! in the sides of the domain.

use super::mesh::{Mesh, ON_LINE};
use super::outline::slide;
use super::segment::Segment;
use super::shape::side_normal;

/// End of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Landing {
    /// The path ends at its target.
    Free([f64; 2]),
    /// A wall stopped the path at this point.
    Held([f64; 2]),
    /// The path left through an opening in a side.
    Left,
}

/// All obstacles of a scene, and the openings through which particles leave.
#[derive(Clone, Debug, Default)]
pub struct Enclosure {
    /// Walls and sides of blocks, in the plan's units.
    pub obstacles: Vec<Segment>,
    /// Ranges of the coordinate along each side of the domain (left, right, bottom, top) in which
    /// the side is open. A range that reaches the end of a side is infinite there: it lets out what
    /// leaves across the corner.
    pub open: [Vec<[f64; 2]>; 4],
}

impl Enclosure {
    /// Opens a range of a side.
    pub fn open_side(&mut self, mesh: &Mesh, side: usize, [from, to]: [f64; 2]) {
        let (_, along) = mesh.axes(side_normal(side));
        let low = if from <= along.start() { f64::NEG_INFINITY } else { from };
        let high = if to >= along.end() { f64::INFINITY } else { to };
        self.open[side].push([low, high]);
    }

    /// Whether there is any opening.
    pub fn is_open(&self) -> bool {
        self.open.iter().any(|ranges| !ranges.is_empty())
    }

    /// Whether the straight path from `p0` to `p1`, which crosses the line of a side, leaves the
    /// domain through an opening before it meets an obstacle.
    fn lets_out(&self, mesh: &Mesh, side: usize, p0: [f64; 2], p1: [f64; 2]) -> bool {
        if self.open[side].is_empty() {
            return false;
        }
        let normal = side_normal(side);
        let (across, along) = mesh.axes(normal);
        let line = if side.is_multiple_of(2) { across.start() } else { across.end() };
        let t = ((line - p0[normal]) / (p1[normal] - p0[normal])).clamp(0.0, 1.0);
        let at = p0[1 - normal] + t * (p1[1 - normal] - p0[1 - normal]);
        let at = if along.periodic() { along.wrap(at) } else { at };
        self.open[side].iter().any(|&[from, to]| at >= from && at <= to)
            && !self.obstacles.iter().any(|w| w.crossing(mesh, p0, p1).is_some_and(|c| c < t))
    }

    /// Follows the straight path from `p0` (inside the mesh) to `p1`. The result is not wrapped
    /// around periodic sides.
    pub fn follow(&self, mesh: &Mesh, p0: [f64; 2], p1: [f64; 2]) -> Landing {
        self.follow_during(mesh, [p0, p1], [0.0; 2])
    }

    /// The same for a path that begins and ends at these times after those of the solids of the mesh.
    pub fn follow_during(&self, mesh: &Mesh, [p0, p1]: [[f64; 2]; 2], times: [f64; 2]) -> Landing {
        let mut to = p1;
        let mut held = false;
        for (c, axis) in [&mesh.x, &mesh.y].into_iter().enumerate() {
            if axis.periodic() {
                continue;
            }
            let (low, high) = (axis.start(), axis.end());
            if to[c] < low || to[c] > high {
                if self.lets_out(mesh, 2 * c + usize::from(to[c] > high), p0, p1) {
                    return Landing::Left;
                }
                to[c] = to[c].clamp(low, high);
                held = true;
            }
        }
        // Each pass removes one crossing; a path crosses few walls.
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
        if let Some(parts) = mesh.parts() {
            if let Some(end) = slide(parts.obstacles(times), p0, to) {
                (to, held) = (mesh.nearest_inside(end), true);
            }
            // Solids that move leave places later in which the mesh does not show them.
            let blocked = if parts.move_on() {
                held && parts.obstacles(times).any(|o| o.contains(to))
            } else {
                mesh.is_solid_at(mesh.wrap(to))
            };
            if blocked {
                (to, held) = (p0, true);
            }
        }
        if held { Landing::Held(to) } else { Landing::Free(to) }
    }
}

impl Segment {
    /// The largest coordinate below the wall that does not belong to a cell above it.
    fn below(&self, mesh: &Mesh) -> f64 {
        let (axis, _) = mesh.axes(self.normal);
        let line = axis.nearest_line(self.at);
        self.at - 2.0 * ON_LINE * axis.size(line.saturating_sub(1))
    }

    /// Fraction of the path at which it crosses the wall. A point on the line belongs to the upper
    /// side, as in [`Mesh::locate`]. For a path from below, the wall is at the lower limit of the
    /// upper side.
    fn crossing(&self, mesh: &Mesh, p0: [f64; 2], p1: [f64; 2]) -> Option<f64> {
        let (a, b) = (p0[self.normal], p1[self.normal]);
        let above = a >= self.at;
        let (axis, _) = mesh.axes(self.normal);
        if !above && b < self.at - 2.0 * ON_LINE * axis.length() {
            // Most paths are far from most walls: the exact limit is not needed.
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
    fn a_wall_stops_a_path_and_an_aperture_lets_it_through() {
        let e = Enclosure {
            obstacles: vec![Segment { normal: 1, at: 1.0, from: 0.0, to: 1.0 }],
            ..Enclosure::default()
        };
        let m = mesh();
        assert_eq!(e.follow(&m, [0.5, 1.5], [0.6, 0.7]), Landing::Held([0.6, 1.0]));
        let below = (1.0 - 2.0 * ON_LINE).next_down();
        assert_eq!(e.follow(&m, [0.5, 0.5], [0.6, 1.7]), Landing::Held([0.6, below]));
        assert_eq!(m.locate([0.6, below]), 0, "a point stopped by a wall is on its side");
        // A point just below the wall belongs to the cell above it, and is stopped too.
        assert_eq!(
            e.follow(&m, [0.5, 0.5], [0.5, 1.0 - 0.1 * ON_LINE]),
            Landing::Held([0.5, below])
        );
        assert_eq!(e.follow(&m, [0.5, 1.0], [0.5, 0.9]), Landing::Held([0.5, 1.0]));
        assert_eq!(e.follow(&m, [1.5, 1.5], [1.4, 0.7]), Landing::Free([1.4, 0.7]));
        assert_eq!(e.follow(&m, [1.5, 1.5], [1.5, 2.7]), Landing::Held([1.5, 2.0]));
    }

    #[test]
    fn corners_stop_both_directions_and_open_sides_let_particles_leave() {
        let e = Enclosure {
            obstacles: vec![
                Segment { normal: 0, at: 1.0, from: 0.0, to: 1.0 },
                Segment { normal: 1, at: 1.0, from: 0.0, to: 1.0 },
            ],
            open: [vec![], vec![[f64::NEG_INFINITY, f64::INFINITY]], vec![], vec![]],
        };
        let m = mesh();
        let inside = [(1.0 - 2.0 * ON_LINE).next_down(); 2];
        assert_eq!(e.follow(&m, [0.9, 0.8], [1.3, 1.4]), Landing::Held(inside));
        assert_eq!(e.follow(&m, [1.9, 1.8], [2.3, 1.4]), Landing::Left);
    }

    #[test]
    fn a_side_lets_particles_leave_only_through_its_openings() {
        let m = mesh();
        let mut e = Enclosure {
            obstacles: vec![Segment { normal: 0, at: 1.0, from: 0.0, to: 1.0 }],
            ..Enclosure::default()
        };
        assert!(!e.is_open());
        e.open_side(&m, 2, [0.5, 1.0]);
        e.open_side(&m, 3, [1.0, 2.0]);
        assert!(e.is_open());
        assert_eq!(e.follow(&m, [0.7, 0.1], [0.8, -0.1]), Landing::Left);
        assert_eq!(e.follow(&m, [0.3, 0.1], [0.4, -0.1]), Landing::Held([0.4, 0.0]));
        // The path leaves where it crosses the side, not where it would end.
        assert_eq!(e.follow(&m, [0.45, 0.01], [0.65, -0.5]), Landing::Held([0.65, 0.0]));
        assert_eq!(e.follow(&m, [0.55, 0.01], [0.45, -0.5]), Landing::Left);
        // A wall inside the domain that ends at the lip stops the path before the opening.
        assert_eq!(e.follow(&m, [1.1, 0.2], [0.8, -0.1]), Landing::Held([1.0, 0.0]));
        // The opening at the top reaches the corner.
        assert_eq!(e.follow(&m, [1.9, 1.9], [2.2, 2.1]), Landing::Left);
        assert_eq!(e.follow(&m, [0.1, 1.9], [-0.2, 2.1]), Landing::Held([0.0, 2.0]));
    }
}
