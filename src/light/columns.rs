//! This module finds particles that stretched flow has drawn into columns, with gaps between the columns
//! that are no structure of the flow.
//!
//! With the section `A` of a particle and `n` others within `sqrt(A)`, all along one line, particles of the
//! column have the distance `2 sqrt(A)/(n + 1)`, so that each of them stands for a strip of the half-width
//!
//! ```text
//! w = (n + 1) sqrt(A)/4
//! ```
//! across the column.

use crate::frame::ParticleSnapshot;
use std::f32::consts::PI;

/// Smallest and largest number of others along a line that make a column.
const OTHERS: [usize; 2] = [3, 15];
/// Largest second moment of the others across a column, relative to that along it.
const FLAT: f32 = 0.1;
/// Steps of an angle in half a turn; few, so that frames compress well.
const ANGLE_STEPS: f32 = 32.0;

/// A column at a particle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Column {
    /// Number of other particles of the column within `sqrt(A)`; 0 if there is no column.
    pub others: u8,
    /// Direction across the column: angle to the x axis in 32nds of half a turn.
    pub across: u8,
}

/// The columns at particles, by particle. `usual`: radius of particles without one.
pub fn columns(particles: &ParticleSnapshot, usual: f32) -> Vec<Column> {
    let points = &particles.positions;
    let mut by_x: Vec<usize> = (0..points.len()).collect();
    by_x.sort_unstable_by(|&a, &b| points[a][0].total_cmp(&points[b][0]));
    let column = |k: usize| {
        let [x, y] = points[k];
        let reach = PI.sqrt() * particles.radii.get(k).copied().unwrap_or(usual);
        let first = by_x.partition_point(|&other| points[other][0] < x - reach);
        let (mut others, [mut xx, mut xy, mut yy]) = (0, [0.0; 3]);
        for &other in by_x[first..].iter().take_while(|&&other| points[other][0] < x + reach) {
            let [dx, dy] = [points[other][0] - x, points[other][1] - y];
            let same = particles.class.get(other) == particles.class.get(k);
            if other != k && same && dx * dx + dy * dy < reach * reach {
                others += 1;
                (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
            }
        }
        let (mean, half) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(xy));
        if others < OTHERS[0] || mean - half > FLAT * (mean + half) {
            return Column::default();
        }
        let along = 0.5 * xy.atan2(0.5 * (xx - yy));
        let across = (along / PI + 0.5).rem_euclid(1.0);
        let step = (across * ANGLE_STEPS).round() as u32 % ANGLE_STEPS as u32;
        Column { others: others.min(OTHERS[1]) as u8, across: step as u8 }
    };
    (0..points.len()).map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Particles with the distances `dx`, `dy`, turned by an angle.
    fn lattice(dx: f32, dy: f32, angle: f32) -> ParticleSnapshot {
        let (s, c) = angle.sin_cos();
        let places = (0..400).map(|k| [dx * (k % 20) as f32, dy * (k / 20) as f32]);
        ParticleSnapshot {
            positions: places.map(|[x, y]| [c * x - s * y, s * x + c * y]).collect(),
            class: vec![0; 400],
            radii: vec![(dx * dy / PI).sqrt(); 400],
            scalar: None,
        }
    }

    #[test]
    fn slightly_stretched_squares_are_no_columns() {
        for stretch in [1.0, 1.3, 1.7] {
            let found = columns(&lattice(stretch, 1.0 / stretch, 0.3), 0.0);
            assert!(found.iter().all(|c| c.others == 0), "{stretch}");
        }
    }

    #[test]
    fn the_strip_of_a_column_reaches_the_next_one() {
        for (angle, stretch) in [(0.0f32, 3.0f32), (0.7, 3.0), (2.0, 4.0), (1.5, 2.3)] {
            let found = columns(&lattice(stretch, 1.0 / stretch, angle), 0.0);
            // A particle amid the others: of the unit section, half the distance of columns is w.
            let Column { others, across } = found[210];
            let w = 0.25 * f32::from(others + 1);
            assert!((w / (0.5 * stretch) - 1.0).abs() < 0.3, "{angle} {stretch} {w}");
            let turn = PI / ANGLE_STEPS * f32::from(across) - angle;
            assert!(turn.sin().abs() < 0.07, "{angle} {stretch} {turn}");
        }
    }
}
