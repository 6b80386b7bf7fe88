//! This module advects dye lines: passive polylines that are refined as they stretch.

use super::frozen_flow::FrozenFlow;
use crate::plan::Tracers;
use crate::space::mesh::Mesh;

/// Largest number of points; beyond it the lines are not refined, and a warning is given.
const MAX_POINTS: usize = 200_000;

/// Dye lines. Their points are not wrapped around periodic sides, so a line stays connected.
#[derive(Clone, Debug)]
pub struct DyeLines {
    /// Points of each line, in the plan's units.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// Largest distance of consecutive points.
    spacing: f64,
    /// Buffer for a refined line.
    room: Vec<[f64; 2]>,
}

impl DyeLines {
    /// The dye lines of a plan at the start.
    pub fn new(plan: &Tracers) -> Self {
        DyeLines { lines: plan.lines.clone(), spacing: plan.spacing, room: Vec::new() }
    }

    /// Number of points of all lines.
    pub fn points(&self) -> usize {
        self.lines.iter().map(Vec::len).sum()
    }
    /// Whether the largest number of points is reached and refinement has stopped.
    pub fn is_full(&self) -> bool {
        self.points() >= MAX_POINTS
    }

    /// Advects all points through a step, then adds points where lines are stretched and removes
    /// points that are too close together.
    pub fn advance(&mut self, frozen_flow: &FrozenFlow) {
        let mesh = frozen_flow.mesh;
        for line in &mut self.lines {
            line.retain_mut(|p| {
                let inside = mesh.wrap(*p);
                let offset = [p[0] - inside[0], p[1] - inside[1]];
                let displacement =
                    frozen_flow.travel(&frozen_flow.home(mesh.locate(inside)), inside);
                *p = [displacement.to[0] + offset[0], displacement.to[1] + offset[1]];
                !displacement.left
            });
        }
        let mut more = MAX_POINTS.saturating_sub(self.points());
        for line in &mut self.lines {
            respace(line, &mut self.room, self.spacing, &mut more);
            // `clone_from` keeps the allocation of the line.
            line.clone_from(&self.room);
        }
    }

    /// The lines for display: wrapped into the domain and cut where they cross a periodic side.
    pub fn wrapped(&self, mesh: &Mesh) -> Vec<Vec<[f64; 2]>> {
        let mut out = Vec::new();
        for line in &self.lines {
            let mut part: Vec<[f64; 2]> = Vec::new();
            let mut shift = [f64::NAN; 2];
            for p in line {
                let q = mesh.wrap(*p);
                let s = [p[0] - q[0], p[1] - q[1]];
                let jumped = (s[0] - shift[0]).abs() > 1e-9 || (s[1] - shift[1]).abs() > 1e-9;
                if jumped && !part.is_empty() {
                    out.push(std::mem::take(&mut part));
                }
                shift = s;
                part.push(q);
            }
            if part.len() > 1 {
                out.push(part);
            }
        }
        out
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Copies a line to `out`. It inserts at most `more` points where the distance exceeds `spacing`
/// and omits points that are too close together.
fn respace(line: &[[f64; 2]], out: &mut Vec<[f64; 2]>, spacing: f64, more: &mut usize) {
    out.clear();
    for (k, &p) in line.iter().enumerate() {
        let inner = k > 0 && k + 1 < line.len();
        if inner && out.last().is_some_and(|&q| distance(q, line[k + 1]) < 0.4 * spacing) {
            continue;
        }
        if let Some(&q) = out.last()
            && distance(p, q) > spacing
            && *more > 0
        {
            let before = if out.len() > 1 { out[out.len() - 2] } else { q };
            let after = if k + 1 < line.len() { line[k + 1] } else { p };
            out.push(between(before, q, p, after));
            *more -= 1;
        }
        out.push(p);
    }
}

/// Point halfway between `b` and `c` on the cubic through four points, or on the chord if the cubic
/// is far from it, as at folds.
fn between(a: [f64; 2], b: [f64; 2], c: [f64; 2], d: [f64; 2]) -> [f64; 2] {
    let chord = [0.5 * (b[0] + c[0]), 0.5 * (b[1] + c[1])];
    let cubic: [f64; 2] = std::array::from_fn(|k| (9.0 * (b[k] + c[k]) - a[k] - d[k]) / 16.0);
    if distance(chord, cubic) < 0.25 * distance(b, c) { cubic } else { chord }
}
