//! This module recognises the shape of a material that is rare around a cell: a sheet, a drop, or
//! neither.
//!
//! Both are features smaller than a cell. A quadratic level set does not represent them well, and
//! they do not need one: a sheet is given by its direction and its volume, a drop by its volume.
//! Positions are relative to the centre of the cell, in cell sizes; they are those of the particles
//! of the cell and its eight neighbours.
//!
//! **Sheet**: the particles lie along a straight strip that is narrower than about a cell, long
//! enough to be distinguished from a drop, without gaps, and with the other material on both sides.
//! At an edge the other material is on one side only; a corner is too wide.
//!
//! The width of the strip is chosen so that it contains as many particles as its material has.
//!
//! **Drop**: the particles are close together and away from the boundary of the nine cells.

use nalgebra::Matrix2;

/// Largest width of a sheet, in cells; sheets of 0.8 cells must be accepted with any noise.
const WIDEST: f64 = 1.1;
/// Smallest length of a sheet, in cells. A sheet that only touches the corner of the cell crosses
/// the nine cells over 2 cell sizes.
const SHORTEST: f64 = 1.4;
/// Smallest ratio of the standard deviations along and across a sheet.
const SLENDER: f64 = 2.2;
/// Largest gap along a sheet, in cells.
const GAP: f64 = 1.0;
/// Smallest number of particles of a sheet; fewer may be in line by chance.
const FEWEST: usize = 5;
/// Smallest number of particles of the other material on either side of a sheet.
const FLANK: usize = 2;
/// Largest distance, in cells, of the particles that determine the direction of a sheet.
const WINDOW: f64 = 1.6;
/// Upper limit of the extent of a drop along x and y, in cells.
const LARGEST: f64 = 1.3;
/// Smallest distance of a drop from the boundary of the nine cells, in cells.
const RIM: f64 = 0.15;

/// Position of a particle, and whether it is of the second material.
pub type Labelled = ([f64; 2], bool);

/// Mean and principal axes of the positions of the particles of one material.
struct Moments {
    count: usize,
    mean: [f64; 2],
    /// Unit vector along the larger axis.
    along: [f64; 2],
    /// Unit vector along the smaller axis.
    across: [f64; 2],
    /// Standard deviation along the smaller axis.
    deviation: f64,
    /// Standard deviation along the larger axis.
    deviation_along: f64,
}

impl Moments {
    fn new(points: impl Iterator<Item = [f64; 2]> + Clone) -> Option<Self> {
        let mut count = 0;
        let mut mean = [0.0; 2];
        for p in points.clone() {
            count += 1;
            (mean[0], mean[1]) = (mean[0] + p[0], mean[1] + p[1]);
        }
        if count == 0 {
            return None;
        }
        let mean = mean.map(|m| m / count as f64);
        let mut spread = Matrix2::zeros();
        for p in points {
            let d = nalgebra::Vector2::new(p[0] - mean[0], p[1] - mean[1]);
            spread += d * d.transpose();
        }
        spread /= count as f64;
        let angle = 0.5 * (2.0 * spread.m12).atan2(spread.m11 - spread.m22);
        let (s, c) = angle.sin_cos();
        let half = (0.5 * (spread.m11 - spread.m22)).hypot(spread.m12);
        let middle = 0.5 * spread.trace();
        Some(Moments {
            count,
            mean,
            along: [c, s],
            across: [-s, c],
            deviation: (middle - half).max(0.0).sqrt(),
            deviation_along: (middle + half).sqrt(),
        })
    }

    fn coordinates(&self, p: [f64; 2]) -> [f64; 2] {
        let d = [p[0] - self.mean[0], p[1] - self.mean[1]];
        [self.along, self.across].map(|a| a[0] * d[0] + a[1] * d[1])
    }
}

/// A straight strip, in cell sizes.
#[derive(Clone, Debug)]
pub struct Strip {
    /// Unit normal.
    pub normal: [f64; 2],
    /// Distance of its centre line from the centre of the cell, along the normal.
    pub offset: f64,
    /// Width.
    pub width: f64,
}

impl Strip {
    /// Share of the strip's material around a point of the cell; the edges of the strip are ramps
    /// of the given width.
    pub fn share(&self, at: [f64; 2], ramp: f64) -> f64 {
        let distance = self.normal[0] * at[0] + self.normal[1] * at[1] - self.offset;
        let half = 0.5 * self.width;
        let top = half.min(distance + 0.5 * ramp);
        let bottom = (-half).max(distance - 0.5 * ramp);
        ((top - bottom) / ramp).clamp(0.0, 1.0)
    }

    /// Area of the strip in the cell, as a fraction of the cell.
    pub fn area(&self, ramp: f64) -> f64 {
        const SIDE: usize = 16;
        let at = |k: usize| (k as f64 + 0.5) / SIDE as f64 - 0.5;
        let sum: f64 =
            (0..SIDE * SIDE).map(|k| self.share([at(k % SIDE), at(k / SIDE)], ramp)).sum();
        sum / (SIDE * SIDE) as f64
    }
}

/// Finds the sheet that a material forms; `None` if it forms none. `room` is working memory.
pub fn sheet(particles: &[Labelled], second: bool, room: &mut Vec<f64>) -> Option<Strip> {
    let of = |label| particles.iter().filter(move |p| p.1 == label).map(|p| p.0);
    // In a round window the ends of a strip do not tilt its axes.
    let m = Moments::new(of(second).filter(|p| p[0].hypot(p[1]) < WINDOW))?;
    // The width of a strip of constant density with this deviation.
    let width = 12f64.sqrt() * m.deviation;
    if m.count < FEWEST || width > WIDEST || m.deviation_along < SLENDER * m.deviation {
        return None;
    }
    let along = &mut *room;
    along.clear();
    along.extend(of(second).map(|p| m.coordinates(p)[0]));
    along.sort_unstable_by(f64::total_cmp);
    let (first, last) = (*along.first()?, *along.last()?);
    if last - first < SHORTEST || along.windows(2).any(|w| w[1] - w[0] > GAP) {
        return None;
    }
    // Count beside the strip, not beyond its ends, where a corner has the other material too.
    let beyond = 0.5 * width + 0.1;
    let flank = |side: f64| {
        let beside = |[s, d]: [f64; 2]| side * d > beyond && first < s && s < last;
        of(!second).filter(|&p| beside(m.coordinates(p))).count()
    };
    if flank(1.0) < FLANK || flank(-1.0) < FLANK {
        return None;
    }
    // The strip contains as many particles as its material has.
    let count = along.len();
    let distance = room;
    distance.clear();
    distance.extend(particles.iter().map(|p| m.coordinates(p.0)[1].abs()));
    let (_, &mut half, _) = distance.select_nth_unstable_by(count - 1, f64::total_cmp);
    let offset = m.across[0] * m.mean[0] + m.across[1] * m.mean[1];
    Some(Strip { normal: m.across, offset, width: 2.0 * half })
}

/// Whether a material forms a drop.
pub fn is_drop(particles: &[Labelled], second: bool) -> bool {
    let of = || particles.iter().filter(|p| p.1 == second).map(|p| p.0);
    let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for p in of() {
        for (range, x) in range.iter_mut().zip(p) {
            *range = [range[0].min(x), range[1].max(x)];
        }
    }
    range.iter().all(|&[low, high]| high - low < LARGEST && low > RIM - 1.5 && high < 1.5 - RIM)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Placement;
    use crate::space::mesh::{Axis, Mesh};
    use crate::space::seeding::Seeding;

    /// Jittered particles of nine cells around the origin.
    fn particles(seed: u64, second: impl Fn([f64; 2]) -> bool) -> Vec<Labelled> {
        let axis = || Axis::new(vec![0.0, 1.0, 2.0, 3.0], false);
        let mesh = Mesh::new(axis(), axis());
        let seeding = Seeding { side: 4, placement: Placement::Jittered, seed };
        (0..mesh.cells())
            .flat_map(|cell| seeding.positions(&mesh, cell, &mut seeding.random(cell)))
            .map(|p| [p[0] - 1.5, p[1] - 1.5])
            .map(|p| (p, second(p)))
            .collect()
    }

    fn distance(p: [f64; 2], angle: f64) -> f64 {
        angle.cos() * p[0] + angle.sin() * p[1]
    }

    #[test]
    fn sheets_are_found() {
        for seed in 0..60 {
            let angle = 0.37 * seed as f64;
            let offset = 0.4 * (1.7 * angle).sin();
            for width in [0.3, 0.5, 0.8] {
                let of_sheet = |p| (distance(p, angle) - offset).abs() < 0.5 * width;
                let around = particles(seed, of_sheet);
                let strip = sheet(&around, true, &mut Vec::new());
                assert!(strip.is_some(), "{seed} {width}");
                let strip = strip.unwrap();
                let sine = strip.normal[0] * angle.sin() - strip.normal[1] * angle.cos();
                assert!(sine.abs() < 0.15, "{seed} {width}: {strip:?}");
                assert!((strip.width - width).abs() < 0.2, "{seed} {width}: {strip:?}");
                assert!(sheet(&around, false, &mut Vec::new()).is_none());
                assert!(!is_drop(&around, true) && !is_drop(&around, false));
            }
        }
    }

    #[test]
    fn edges_and_corners_are_neither_sheet_nor_drop() {
        for seed in 0..200 {
            let angle = 0.37 * seed as f64;
            // The largest distance of edges that cross the central cell.
            let offset = 0.7 * (1.7 * angle).sin();
            let edge = particles(seed, |p| distance(p, angle) > offset);
            let corner = particles(seed, |p| {
                distance(p, angle) > offset && distance(p, angle + 1.6) > -offset
            });
            let disc = particles(seed, |p| {
                let away = 3.0 + offset;
                (p[0] - away * angle.cos()).hypot(p[1] - away * angle.sin()) < 3.0
            });
            for label in [false, true] {
                for around in [&edge, &disc] {
                    assert!(sheet(around, label, &mut vec![]).is_none(), "{seed}");
                    assert!(!is_drop(around, label), "{seed}");
                }
                assert!(sheet(&corner, label, &mut vec![]).is_none(), "{seed}");
            }
        }
    }

    #[test]
    fn drops_are_found() {
        for seed in 0..40 {
            let [x, y] = [0.5 * (seed as f64).sin(), 0.5 * (2.0 * seed as f64).sin()];
            let around = particles(seed, |p| (p[0] - x).hypot(p[1] - y) < 0.4);
            assert!(is_drop(&around, true) && !is_drop(&around, false));
            assert!(
                sheet(&around, true, &mut Vec::new()).is_none()
                    && sheet(&around, false, &mut Vec::new()).is_none()
            );
        }
    }
}
