//! This module packs the snapshot of a frame into the bytes that the scripts of the light view
//! read (`assets/light/frame.js`), and thins its particles.
//!
//! Numbers are little-endian. Coordinates are quantised to 16 bits over the domain, values of fields
//! to 4095 steps between their smallest and largest value. Particles are sorted along rows of 256 by
//! 256 boxes, and everything is stored as differences from the value before, high bytes and low
//! bytes apart, so that general compression works well:
//!
//! | part | content |
//! |---|---|
//! | head | `u32`: particles, dye lines, points of dye lines, strokes, fields |
//! | particles | bytes: box row, box column (differences), low byte of y, of x, material, radius, others in its column and direction across it ([`Column`]) |
//! | dye lines | `u32` number of points of each; differences of x and y in turn, zigzag, high, low |
//! | strokes | x and y of both ends in turn: differences, zigzag, high bytes, low bytes |
//! | field | `u16` index in the list of fields, width, height, 0; `f32` smallest and largest value, ends of the colour scale; differences from the left neighbour, zigzag, high bytes, low bytes |
//! | solids that move | `u32` number, then of each `u32` number of points; `f32` x and y in turn |

use super::columns::{Column, columns};
use crate::frame::thinning::evenly;
use crate::frame::{GridField, ParticleSnapshot, Rect, RunInfo, Snapshot, extent};

/// Number of steps of a quantised value of a field; the number after the last step is "no value".
const FIELD_STEPS: f32 = 4094.0;
/// Quantised "no value".
const NO_VALUE: u16 = 4095;
/// A radius is stored as `RADIUS_STEPS` times its binary logarithm relative to the height or width
/// of the domain, whichever is larger.
const RADIUS_STEPS: f32 = 8.0;

/// Number of particles up to which all of a frame are packed, unless more are asked for.
pub const MOST_PARTICLES: usize = 12_000;

/// A copy of particles with at most `most` of them, evenly chosen. Radii grow so that the area
/// stays the same.
fn thin(particles: &ParticleSnapshot, most: usize) -> ParticleSnapshot {
    let kept = evenly(&particles.positions, most);
    let growth = (particles.positions.len() as f32 / kept.len().max(1) as f32).sqrt();
    ParticleSnapshot {
        positions: kept.iter().map(|&k| particles.positions[k]).collect(),
        class: kept.iter().filter_map(|&k| particles.class.get(k).copied()).collect(),
        radii: kept.iter().filter_map(|&k| Some(growth * particles.radii.get(k)?)).collect(),
        scalar: None,
    }
}

/// Packs a snapshot with at most `most` of its particles. Fields that the run does not list are left
/// out.
pub fn pack(snapshot: &Snapshot, info: &RunInfo, most: usize) -> Vec<u8> {
    let thinned = thin(&snapshot.particles, most);
    let listed = |f: &GridField| info.fields.iter().position(|q| q.name == f.name);
    let fields: Vec<(usize, &GridField)> =
        snapshot.fields.iter().filter_map(|f| Some((listed(f)?, f))).collect();
    let lines = &snapshot.dye_lines;
    let points = lines.iter().map(Vec::len).sum::<usize>();
    let counts =
        [thinned.positions.len(), lines.len(), points, snapshot.glyphs.len(), fields.len()];
    let mut out = vec![];
    counts.iter().for_each(|&n| out.extend((n as u32).to_le_bytes()));
    let place = Place { domain: info.domain };
    particles(&thinned, place, info.particle_radius, &mut out);
    lines.iter().for_each(|line| out.extend((line.len() as u32).to_le_bytes()));
    differences(lines.iter().flatten().map(|p| place.at(*p)), &mut out);
    differences(snapshot.glyphs.iter().flatten().map(|p| place.at(*p)), &mut out);
    fields.into_iter().for_each(|(index, field)| pack_field(index, field, &mut out));
    out.extend((snapshot.moving.len() as u32).to_le_bytes());
    for line in &snapshot.moving {
        out.extend((line.len() as u32).to_le_bytes());
        line.as_flattened().iter().for_each(|v| out.extend(v.to_le_bytes()));
    }
    out
}

/// Quantises points of a domain.
#[derive(Clone, Copy)]
struct Place {
    domain: Rect,
}

impl Place {
    fn at(self, point: [f32; 2]) -> [u16; 2] {
        let size = self.domain.size();
        [0, 1].map(|c| {
            let share = (point[c] - self.domain.min[c]) / size[c];
            (share.clamp(0.0, 1.0) * f32::from(u16::MAX)).round() as u16
        })
    }

    fn radius(self, radius: f32) -> u8 {
        let [w, h] = self.domain.size();
        (-RADIUS_STEPS * (radius / w.max(h)).log2()).round().clamp(0.0, 255.0) as u8
    }
}

/// A particle of a packed frame: place, material, radius, column.
type Packed = ([u16; 2], u8, u8, Column);

fn particles(particles: &ParticleSnapshot, place: Place, usual: f32, out: &mut Vec<u8>) {
    let radius = |k: usize| place.radius(particles.radii.get(k).copied().unwrap_or(usual));
    let class = |k: usize| particles.class.get(k).map_or(0, |&c| c.min(255) as u8);
    let mut list: Vec<Packed> = columns(particles, usual)
        .into_iter()
        .zip(&particles.positions)
        .enumerate()
        .map(|(k, (column, &p))| (place.at(p), class(k), radius(k), column))
        .collect();
    list.sort_unstable_by_key(|&([x, y], class, radius, column)| {
        (y >> 8, x >> 8, class, radius, y & 255, x & 255, column)
    });
    let mut column = |of: &dyn Fn(&Packed) -> u8| out.extend(list.iter().map(of));
    column(&|p| (p.0[1] >> 8) as u8);
    column(&|p| (p.0[0] >> 8) as u8);
    column(&|p| p.0[1] as u8);
    column(&|p| p.0[0] as u8);
    column(&|p| p.1);
    column(&|p| p.2);
    column(&|p| p.3.others);
    column(&|p| p.3.across);
    // Boxes are stored as differences.
    let start = out.len() - 8 * list.len();
    for part in out[start..start + 2 * list.len()].chunks_mut(list.len().max(1)) {
        let mut last = 0;
        part.iter_mut().for_each(|v| (last, *v) = (*v, v.wrapping_sub(last)));
    }
}

/// Maps small differences of either sign to small numbers.
fn zigzag(from: u16, to: u16) -> u16 {
    let difference = to.wrapping_sub(from) as i16;
    ((difference << 1) ^ (difference >> 15)) as u16
}

/// Appends numbers: high bytes, then low bytes.
fn planes(values: &[u16], out: &mut Vec<u8>) {
    out.extend(values.iter().map(|v| (v >> 8) as u8));
    out.extend(values.iter().map(|v| *v as u8));
}

/// Appends points as differences, x and y in turn.
fn differences(points: impl Iterator<Item = [u16; 2]>, out: &mut Vec<u8>) {
    let mut last = [0; 2];
    let mut values = vec![];
    for point in points {
        values.extend([zigzag(last[0], point[0]), zigzag(last[1], point[1])]);
        last = point;
    }
    planes(&values, out);
}

fn pack_field(index: usize, field: &GridField, out: &mut Vec<u8>) {
    let [low, high] = extent(&field.values).unwrap_or([0.0; 2]);
    let whole = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
    for n in [whole(index), whole(field.nx), whole(field.ny), 0] {
        out.extend(n.to_le_bytes());
    }
    for value in [low, high, field.range[0], field.range[1]] {
        out.extend(value.to_le_bytes());
    }
    let per_value = if high > low { FIELD_STEPS / (high - low) } else { 0.0 };
    let step = |v: f32| {
        if v.is_finite() { ((v - low) * per_value).round() as u16 } else { NO_VALUE }
    };
    let mut last = 0;
    let mut values = vec![];
    for &value in &field.values {
        let now = step(value);
        values.push(zigzag(last, now));
        last = now;
    }
    planes(&values, out);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_area() {
        let particles = ParticleSnapshot {
            positions: vec![[0.5, 0.5]; 1000],
            class: vec![0; 1000],
            radii: vec![0.1; 1000],
            scalar: None,
        };
        let thinned = thin(&particles, 300);
        assert_eq!(thinned.positions.len(), 300);
        let area = |p: &ParticleSnapshot| p.radii.iter().map(|r| r * r).sum::<f32>();
        assert!((area(&thinned) / area(&particles) - 1.0).abs() < 1e-4);
    }

    #[test]
    fn small_differences_are_small_numbers() {
        let numbers = [0, 1, -1, 2, -2].map(|d: i16| zigzag(100, (100 + d) as u16));
        assert_eq!(numbers, [0, 2, 1, 4, 3]);
        assert_eq!(zigzag(65535, 0), 2);
    }
}
