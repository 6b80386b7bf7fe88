//! This module defines outlines of any shape, their signed distance, and the paths of points along
//! them.

/// Coordinates x and y.
pub type Point = [f64; 2];

/// Distance from an outline, relative to its size, at which points that it stops stay.
const CLEARANCE: f64 = 1e-9;

/// Outline of a solid or of a region: a simple polygon or a circle.
#[derive(Clone, Debug, PartialEq)]
pub enum Outline {
    /// Corners in counter-clockwise order.
    Polygon(Vec<Point>),
    /// A circle.
    Circle {
        /// Its centre.
        centre: Point,
        /// Its radius.
        radius: f64,
    },
}

/// The place of an outline that is nearest to a point.
#[derive(Clone, Copy, Debug)]
struct Nearest {
    /// Distance from the point; negative inside.
    distance: f64,
    /// Unit normal there, away from the inside.
    normal: Point,
}

/// A path that enters an outline.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Fraction of the path before the outline.
    pub at: f64,
    /// Unit normal of the outline there, away from the inside.
    pub normal: Point,
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// Twice the area of a polygon; positive if its corners are in counter-clockwise order.
fn twice_area(corners: &[Point]) -> f64 {
    edges(corners).map(|[a, b]| cross(a, b)).sum()
}

pub(super) fn edges(corners: &[Point]) -> impl Iterator<Item = [Point; 2]> + '_ {
    (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]])
}

/// Two edges of a polygon, by the index of their first corner, that meet elsewhere than at a common
/// corner.
pub fn crossing_edges(corners: &[Point]) -> Option<[usize; 2]> {
    let n = corners.len();
    let side = |[a, b]: [Point; 2], p: Point| cross(minus(b, a), minus(p, a));
    let list: Vec<[Point; 2]> = edges(corners).collect();
    // Whether `p`, which is on the line of an edge, is on the edge.
    let between = |[a, b]: [Point; 2], p: Point| dot(minus(p, a), minus(p, b)) <= 0.0;
    for i in 0..n {
        for j in i + 1..n {
            let (e, f) = (list[i], list[j]);
            let neighbours = j == i + 1 || (i == 0 && j == n - 1);
            if neighbours {
                // Neighbours meet in one corner; they overlap if one turns back along the other.
                let (a, b, c) = if j == i + 1 { (e[0], e[1], f[1]) } else { (f[0], f[1], e[1]) };
                if side([a, b], c) == 0.0 && dot(minus(b, a), minus(c, b)) < 0.0 {
                    return Some([i, j]);
                }
                continue;
            }
            let [a, b] = [side(e, f[0]), side(e, f[1])];
            let [c, d] = [side(f, e[0]), side(f, e[1])];
            let cross = a * b < 0.0 && c * d < 0.0;
            let touch = (a == 0.0 && between(e, f[0]))
                || (b == 0.0 && between(e, f[1]))
                || (c == 0.0 && between(f, e[0]))
                || (d == 0.0 && between(f, e[1]));
            if cross || touch {
                return Some([i, j]);
            }
        }
    }
    None
}

impl Outline {
    /// A polygon with corners in either order.
    pub fn polygon(mut corners: Vec<Point>) -> Outline {
        if twice_area(&corners) < 0.0 {
            corners.reverse();
        }
        Outline::Polygon(corners)
    }

    /// The outline in other units of length: coordinates are divided by `unit`.
    pub fn in_units(&self, unit: f64) -> Outline {
        let scaled = |p: &Point| p.map(|c| c / unit);
        match self {
            Outline::Polygon(corners) => Outline::Polygon(corners.iter().map(scaled).collect()),
            Outline::Circle { centre, radius } => {
                Outline::Circle { centre: scaled(centre), radius: radius / unit }
            }
        }
    }

    /// The outline elsewhere.
    pub fn moved(&self, by: Point) -> Outline {
        let moved = |p: &Point| [p[0] + by[0], p[1] + by[1]];
        match self {
            Outline::Polygon(corners) => Outline::Polygon(corners.iter().map(moved).collect()),
            Outline::Circle { centre, radius } => {
                Outline::Circle { centre: moved(centre), radius: *radius }
            }
        }
    }

    /// Area enclosed.
    pub fn area(&self) -> f64 {
        match self {
            Outline::Polygon(corners) => 0.5 * twice_area(corners).abs(),
            Outline::Circle { radius, .. } => std::f64::consts::PI * radius * radius,
        }
    }

    /// Ranges of x and y.
    pub fn extent(&self) -> [[f64; 2]; 2] {
        match self {
            Outline::Polygon(corners) => [0, 1].map(|c| {
                let range = [f64::INFINITY, f64::NEG_INFINITY];
                corners.iter().fold(range, |[a, b], p| [a.min(p[c]), b.max(p[c])])
            }),
            Outline::Circle { centre, radius } => centre.map(|c| [c - radius, c + radius]),
        }
    }

    fn size(&self) -> f64 {
        let [x, y] = self.extent();
        (x[1] - x[0]).max(y[1] - y[0])
    }

    /// The outline as a closed line; a circle has a corner every five degrees.
    pub fn line(&self) -> Vec<Point> {
        let mut line = match self {
            Outline::Polygon(corners) => corners.clone(),
            Outline::Circle { centre, radius } => (0..72)
                .map(|k| f64::from(5 * k).to_radians().sin_cos())
                .map(|(sin, cos)| [centre[0] + radius * cos, centre[1] + radius * sin])
                .collect(),
        };
        line.extend(line.first().copied());
        line
    }

    /// Whether a velocity whose normal part is zero along the outline can have a component along x
    /// (0) or y (1) only.
    pub fn holds(&self, c: usize) -> bool {
        match self {
            Outline::Polygon(corners) => edges(corners).any(|[a, b]| a[1 - c] != b[1 - c]),
            Outline::Circle { .. } => true,
        }
    }

    /// Signed distance of a point from the outline; positive outside.
    pub fn distance(&self, p: Point) -> f64 {
        self.nearest(p).distance
    }

    /// Unit normal, away from the inside, of the place of the outline nearest to a point.
    pub fn normal(&self, p: Point) -> Point {
        self.nearest(p).normal
    }

    fn nearest(&self, p: Point) -> Nearest {
        match self {
            Outline::Circle { centre, radius } => {
                let d = minus(p, *centre);
                let r = d[0].hypot(d[1]);
                let normal = if r > 0.0 { d.map(|c| c / r) } else { [0.0, 1.0] };
                Nearest { distance: r - radius, normal }
            }
            Outline::Polygon(corners) => {
                let mut inside = false;
                let mut best = (f64::INFINITY, [0.0; 2], [0.0; 2], false);
                for [a, b] in edges(corners) {
                    if (a[1] > p[1]) != (b[1] > p[1])
                        && p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1])
                    {
                        inside = !inside;
                    }
                    let (along, from) = (minus(b, a), minus(p, a));
                    let length2 = dot(along, along);
                    let t = dot(from, along) / length2;
                    let at_corner = !(0.0..=1.0).contains(&t);
                    let t = t.clamp(0.0, 1.0);
                    let away = [from[0] - t * along[0], from[1] - t * along[1]];
                    let square = dot(away, away);
                    if square < best.0 {
                        let length = length2.sqrt();
                        best = (square, away, [along[1] / length, -along[0] / length], at_corner);
                    }
                }
                let (square, away, of_edge, at_corner) = best;
                let r = square.sqrt();
                let sign = if inside { -1.0 } else { 1.0 };
                // The distance from an edge is a linear function: without a root it does not round.
                let distance = if at_corner { sign * r } else { sign * dot(away, of_edge).abs() };
                let normal =
                    if at_corner && r > 0.0 { away.map(|c| sign * c / r) } else { of_edge };
                Nearest { distance, normal }
            }
        }
    }

    /// Whether a point is inside.
    pub fn contains(&self, p: Point) -> bool {
        self.distance(p) < 0.0
    }

    /// Where a straight path from a point outside (or on the outline) first enters.
    fn entry(&self, p0: Point, p1: Point) -> Option<Entry> {
        let way = minus(p1, p0);
        match self {
            Outline::Circle { centre, radius } => {
                let d = minus(p0, *centre);
                let (a, b, c) = (dot(way, way), dot(d, way), dot(d, d) - radius * radius);
                let root = b * b - a * c;
                if a == 0.0 || b >= 0.0 || root <= 0.0 {
                    return None;
                }
                let at = ((-b - root.sqrt()) / a).max(0.0);
                (at < 1.0).then(|| {
                    let on = [d[0] + at * way[0], d[1] + at * way[1]];
                    let r = on[0].hypot(on[1]);
                    Entry { at, normal: on.map(|c| c / r) }
                })
            }
            Outline::Polygon(corners) => edges(corners)
                .filter_map(|[a, b]| {
                    let along = minus(b, a);
                    let length = along[0].hypot(along[1]);
                    let normal = [along[1] / length, -along[0] / length];
                    let [d0, d1] = [p0, p1].map(|p| dot(minus(p, a), normal));
                    if !(d1 < 0.0 && d0 > d1 && d0 >= -CLEARANCE * length) {
                        return None;
                    }
                    let at = (d0 / (d0 - d1)).clamp(0.0, 1.0);
                    let on = [p0[0] + at * way[0], p0[1] + at * way[1]];
                    let t = dot(minus(on, a), along) / (length * length);
                    (0.0..=1.0).contains(&t).then_some(Entry { at, normal })
                })
                .min_by(|a, b| a.at.total_cmp(&b.at)),
        }
    }

    /// The point outside nearest to `p`, which is inside.
    fn outside(&self, p: Point) -> Point {
        let Nearest { distance, normal } = self.nearest(p);
        let out = CLEARANCE * self.size() - distance;
        [p[0] + out * normal[0], p[1] + out * normal[1]]
    }
}

/// An outline in the way of a path, with its displacements at the start and at the end of the path.
#[derive(Clone, Copy, Debug)]
pub struct Obstacle<'a> {
    /// The outline without displacement.
    pub outline: &'a Outline,
    /// Displacements.
    pub displaced: [Point; 2],
}

impl<'a> Obstacle<'a> {
    /// An outline at rest.
    pub fn at_rest(outline: &'a Outline) -> Self {
        Obstacle { outline, displaced: [[0.0; 2]; 2] }
    }

    /// Displacement from the fraction `t` of the path to its end.
    fn rest(&self, t: f64) -> Point {
        let [start, end] = self.displaced;
        [0, 1].map(|c| (1.0 - t) * (end[c] - start[c]))
    }

    /// Where the rest of a path, from the fraction `t` on, first enters.
    fn entry(&self, t: f64, from: Point, to: Point) -> Option<Entry> {
        let (end, rest) = (self.displaced[1], self.rest(t));
        self.outline.entry(minus(from, minus(end, rest)), minus(to, end))
    }

    /// Whether a point is inside at the end of the path.
    pub fn contains(&self, p: Point) -> bool {
        self.outline.contains(minus(p, self.displaced[1]))
    }

    /// The point outside nearest to `p` at the end of the path.
    fn outside(&self, p: Point) -> Point {
        let end = self.displaced[1];
        let q = self.outline.outside(minus(p, end));
        [q[0] + end[0], q[1] + end[1]]
    }
}

/// Moves a point that is inside one of the outlines at the end of a path to the nearest place outside
/// of all; a point where outlines meet may stay inside one.
pub fn push_out<'a>(outlines: impl Iterator<Item = Obstacle<'a>> + Clone, mut p: Point) -> Point {
    for _ in 0..4 {
        let Some(o) = outlines.clone().find(|o| o.contains(p)) else { break };
        p = o.outside(p);
    }
    p
}

/// End of a straight path from `p0` towards `p1` that slides along the outlines in its way; `None`
/// if none is.
pub fn slide<'a>(
    outlines: impl Iterator<Item = Obstacle<'a>> + Clone,
    p0: Point,
    p1: Point,
) -> Option<Point> {
    let (mut from, mut to, mut stopped, mut passed) = (p0, p1, false, 0.0);
    for _ in 0..4 {
        let entries = outlines.clone().filter_map(|o| Some((o.entry(passed, from, to)?, o)));
        let Some((Entry { at, normal }, o)) = entries.min_by(|a, b| a.0.at.total_cmp(&b.0.at))
        else {
            break;
        };
        stopped = true;
        let rest = [0, 1].map(|c| (1.0 - at) * (to[c] - from[c]));
        let clear = CLEARANCE * o.outline.size();
        from = [0, 1].map(|c| from[c] + at * (to[c] - from[c]) + clear * normal[c]);
        passed += (1.0 - passed) * at;
        let into = dot(minus(rest, o.rest(passed)), normal);
        to = [0, 1].map(|c| from[c] + rest[c] - into * normal[c]);
    }
    if outlines.clone().any(|o| o.contains(to)) {
        stopped = true;
        to = push_out(outlines.clone(), to);
        if outlines.clone().any(|o| o.contains(to)) {
            to = p0;
        }
    }
    stopped.then_some(to)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Outline {
        Outline::polygon(vec![[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]])
    }

    #[test]
    fn distances_are_signed_and_normals_point_away() {
        let t = triangle();
        let root = 0.5f64.sqrt();
        assert!((t.distance([1.0, 1.0]) - root).abs() < 1e-15);
        assert!((t.distance([0.25, 0.25]) + 0.25).abs() < 1e-15);
        assert!((t.distance([-3.0, -4.0]) - 5.0).abs() < 1e-15);
        let n = t.normal([0.6, 0.6]);
        assert!((n[0] - root).abs() < 1e-15 && (n[1] - root).abs() < 1e-15);
        let inside = t.normal([0.1, 0.4]);
        assert!((inside[0] + 1.0).abs() < 1e-15);
        let c = Outline::Circle { centre: [1.0, 2.0], radius: 0.5 };
        assert!((c.distance([1.0, 3.0]) - 0.5).abs() < 1e-15 && c.contains([1.2, 2.2]));
        assert_eq!(t.area(), 0.5);
    }

    #[test]
    fn polygons_that_cross_themselves_are_found() {
        let bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(crossing_edges(&bow), Some([0, 2]));
        let spike = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [0.5, 1.0]];
        assert!(crossing_edges(&spike).is_some());
        let Outline::Polygon(t) = triangle() else { panic!("a polygon") };
        assert_eq!(crossing_edges(&t), None);
        let dart = [[0.0, 0.0], [1.0, 0.2], [0.0, 1.0], [0.3, 0.3]];
        assert_eq!(crossing_edges(&dart), None);
    }

    #[test]
    fn paths_slide_along_outlines_and_never_end_inside() {
        let (t, c) = (triangle(), Outline::Circle { centre: [2.0, 0.0], radius: 0.9 });
        let all = || [&t, &c].into_iter().map(Obstacle::at_rest);
        assert_eq!(slide(all(), [3.0, 3.0], [2.5, 2.5]), None);
        let end = slide(all(), [0.8, 0.8], [0.4, 0.4]).unwrap();
        assert!((end[0] - 0.5).abs() < 1e-8 && (end[1] - 0.5).abs() < 1e-8, "{end:?}");
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / (1u64 << 31) as f64
        };
        let mut at = [1.0, 1.5];
        for _ in 0..20_000 {
            let to = [at[0] + random() - 0.5, at[1] + random() - 0.5];
            let to = [to[0].clamp(-1.0, 4.0), to[1].clamp(-1.0, 2.0)];
            at = slide(all(), at, to).unwrap_or(to);
            assert!(all().all(|o| !o.outline.contains(at)), "{at:?}");
        }
    }

    #[test]
    fn thin_solids_stop_fast_paths() {
        let needle = Outline::polygon(vec![[0.0, 0.0], [1.0, 0.0], [0.5, 1e-6]]);
        let all = || std::iter::once(Obstacle::at_rest(&needle));
        let end = slide(all(), [0.3, 1.0], [0.4, -1.0]).unwrap();
        assert!(end[1] > 0.0, "{end:?}");
    }

    #[test]
    fn outlines_that_move_push_points_ahead() {
        let wall = Outline::polygon(vec![[-1.0, -9.0], [0.0, -9.0], [0.0, 9.0], [-1.0, 9.0]]);
        let all =
            || std::iter::once(Obstacle { outline: &wall, displaced: [[-0.1, 0.0], [0.3, 0.0]] });
        // A point at rest is overtaken; one that recedes as fast is not touched.
        let end = slide(all(), [0.1, 0.5], [0.1, 0.7]).unwrap();
        assert!((end[0] - 0.3).abs() < 1e-7 && (end[1] - 0.7).abs() < 1e-12, "{end:?}");
        assert_eq!(slide(all(), [0.0, 0.5], [0.41, 0.5]), None);
        // Behind a wall that recedes there is room.
        let all =
            || std::iter::once(Obstacle { outline: &wall, displaced: [[0.2, 0.0], [-0.2, 0.0]] });
        assert_eq!(slide(all(), [0.3, 0.5], [-0.1, 0.5]), None);
        let end = slide(all(), [0.3, 0.5], [-0.4, 0.5]).unwrap();
        assert!((end[0] + 0.2).abs() < 1e-7, "{end:?}");
    }
}
