//! This module creates the initial particles: their material, volume, directors and carried fields
//! follow from the regions of the plan.
//!
//! In a cell that regions divide, the particles of each material represent its part exactly: their
//! volumes add up to its area, and they are shifted (by less than their spacing) so that their
//! centroid is its centroid. An initial interface therefore has no noise from the particle
//! positions. A part that contains no particle gets one.

use super::sampling::{Filling, Sample, filling, samples};
use crate::plan::{InitialDirector, Mark, Plan};
use crate::scene::FieldFn;
use crate::space::count::Count;
use crate::space::measure::CellMeasure;
use crate::space::particles::Particles;
use crate::space::population::{Population, Surrounding};
use rand::Rng;
use rand_pcg::Pcg64;

/// Smaller fractions of a cell are given to its other materials.
const LEAST_SHARE: f64 = 1e-8;
/// Smallest distance of shifted particles from the sides of their cell, in half cells.
const INSET: f64 = 1e-3;
/// Largest number of shifts of the particles of a material around an axis, and distance of their centroid
/// from that of their part, in half cells, at which they end.
const SHIFTS: u32 = 40;
const CENTRED: f64 = 1e-15;

/// Error: a point of the domain lies in no region, and there is no background material.
#[derive(Debug, thiserror::Error)]
#[error("nothing fills the scene at x = {x:.6e}, y = {y:.6e}")]
pub struct Unfilled {
    /// Coordinate x, m.
    pub x: f64,
    /// Coordinate y, m.
    pub y: f64,
}

/// The initial particles of a plan, sorted by cell, and the indices of the regions that contain
/// none although no later region covers them.
///
/// # Errors
/// A particle lies in no region, and there is no background material.
pub fn particles(plan: &Plan) -> Result<(Particles, Vec<usize>), Unfilled> {
    let effects = &plan.effects;
    let mut out = Particles {
        director: effects.directors.then(Vec::new),
        viscosity: effects.carried_viscosity.then(Vec::new),
        density: effects.carried_density.then(Vec::new),
        mark: (!plan.marks.is_empty()).then(Vec::new),
        ..Particles::default()
    };
    let mesh = &plan.mesh;
    let places = places(plan);
    let start: f64 = plan.method.seeding.random(usize::MAX).random();
    let mut members = Vec::new();
    let mut empty = vec![true; plan.regions.len()];
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let places = &places.position[places.of_cell(cell)];
        let mut random = plan.method.seeding.random(cell);
        // Skip the random numbers of the positions.
        plan.method.seeding.positions(mesh, cell, &mut random);
        members.clear();
        for &position in places {
            let si = plan.si(position);
            let filling = filling(plan, si);
            let material = material(plan, filling).ok_or(Unfilled { x: si[0], y: si[1] })?;
            let r = mesh.to_reference(cell, position);
            members.push(Member { r, share: 1.0 / places.len() as f64, material, filling });
        }
        let measure = mesh.cell_measure(cell);
        make_rings(measure, &mut members);
        // Next to a solid, each particle is of the material at its place.
        if mesh.part(cell).is_none() {
            let samples = samples(plan, cell);
            divide(plan, cell, &samples, &mut members);
        }
        members.retain(|m| Some(m.material) != plan.void());
        let (i, j) = mesh.cell_ij(cell);
        let angles = spread_angles(members.len(), [i, j], start, &mut random);
        let first = out.len();
        for (member, angle) in members.iter().zip(angles) {
            let position = mesh.from_reference(cell, member.r);
            out.push(position, measure.of_share(member.share), member.material);
            let last = out.len() - 1;
            let si = plan.si(position);
            member.filling.iter().for_each(|&f| empty[f] = false);
            let region = member.filling.map(|f| &plan.regions[f]);
            if let (Some(column), Some(d)) =
                (&mut out.director, region.and_then(|r| r.director.as_ref()))
            {
                let angle = match d {
                    InitialDirector::Angle(f) => f.at(si[0], si[1]).to_radians(),
                    InitialDirector::Random => angle,
                };
                column[last] = [angle.cos(), angle.sin()];
            }
            if let Some(column) = &mut out.mark {
                column[last] = plan.marks.iter().any(|m| is_near(m, position));
            }
        }
        carry(plan, cell, &members, (&mut out, first));
    }
    out.sort(mesh);
    let covers =
        |k: usize| out.position.iter().any(|&p| plan.regions[k].shape.contains(plan.si(p)));
    let empty = (0..empty.len()).filter(|&k| empty[k] && !covers(k)).collect();
    Ok((out, empty))
}

/// Initial positions of the particles, sorted by cell; the number in each cell is within its
/// bounds.
fn places(plan: &Plan) -> Particles {
    let mesh = &plan.mesh;
    let mut out = Particles::default();
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let mut random = plan.method.seeding.random(cell);
        let positions = plan.method.seeding.positions(mesh, cell, &mut random);
        let volume = mesh.cell_volume(cell) / positions.len() as f64;
        positions.into_iter().for_each(|p| out.push(p, volume, 0));
    }
    out.sort(mesh);
    let around = Surrounding::Material(plan.background());
    Population::new(mesh, &plan.enclosure, plan.method.seeding, around).control(
        mesh,
        &mut out,
        &mut Count::default(),
    );
    out
}

/// A particle before its fields are set.
#[derive(Clone, Copy)]
struct Member {
    /// Reference coordinates.
    r: [f64; 2],
    /// Fraction of the volume of the cell.
    share: f64,
    material: u8,
    filling: Filling,
}

fn material(plan: &Plan, filling: Filling) -> Option<u8> {
    filling.map(|f| plan.regions[f].material).or(plan.background())
}

/// Sets volumes and positions so that the particles of each material represent its part of a cell.
fn divide(plan: &Plan, cell: usize, samples: &[Sample], members: &mut Vec<Member>) {
    let materials = plan.state.materials.len();
    let measure = plan.mesh.whole_measure(cell);
    // Volume fraction and first moments of each material.
    let mut parts = vec![[0.0; 3]; materials];
    for s in samples {
        if let Some(m) = material(plan, s.filling) {
            let (part, share) = (&mut parts[m as usize], measure.share(s.share, s.r[0]));
            part[0] += share;
            part[1] += share * s.r[0];
            part[2] += share * s.r[1];
        }
    }
    let total: f64 = parts.iter().map(|p| p[0]).filter(|&s| s > LEAST_SHARE).sum();
    // With one region, or with a particle in a part that the lines missed, all shares stay equal.
    let unseen = |m: &Member| parts[m.material as usize][0] <= LEAST_SHARE;
    if total == 0.0 || members.iter().any(unseen) {
        return;
    }
    for (m, part) in parts.iter().enumerate().filter(|(_, p)| p[0] > LEAST_SHARE) {
        let centroid = [part[1] / part[0], part[2] / part[0]];
        let of_m = |p: &&mut Member| p.material as usize == m;
        let mut own: Vec<&mut Member> = members.iter_mut().filter(of_m).collect();
        let share = part[0] / total;
        if own.is_empty() {
            members.extend(lone(plan, cell, samples, (m as u8, centroid, share)));
            continue;
        }
        // Surrounding an axis a shift changes the volumes of the rings, so it is repeated.
        let mut off = [f64::INFINITY; 2];
        for _ in 0..SHIFTS {
            if off.iter().all(|o| o.abs() < CENTRED) {
                break;
            }
            let sum: f64 = own.iter().map(|p| measure.thickness(p.r[0])).sum();
            own.iter_mut().for_each(|p| p.share = measure.share(share, p.r[0]) / sum);
            for c in 0..2 {
                let weighted = own.iter().map(|p| measure.share(p.r[c], p.r[0]));
                let mean = weighted.sum::<f64>() / sum;
                // Contract the particles if the shift alone would move some out of the cell.
                let edge = centroid[c].abs().max(1.0 - INSET);
                let room = |p: &&mut Member| {
                    let from_mean = p.r[c] - mean;
                    (from_mean.signum() * edge - centroid[c]) / from_mean
                };
                let scale = own.iter().map(room).filter(|s| s.is_finite()).fold(1.0, f64::min);
                off[c] = if measure.is_ring() { centroid[c] - mean } else { 0.0 };
                own.iter_mut().for_each(|p| p.r[c] = centroid[c] + scale * (p.r[c] - mean));
            }
        }
    }
}

/// Gives the members of a cell of one material, which have equal sections, the volumes of their rings.
fn make_rings(measure: CellMeasure, members: &mut [Member]) {
    let outwards: f64 = members.iter().map(|m| m.share * measure.tilt() * m.r[0]).sum();
    for member in members {
        member.share = measure.share(member.share, member.r[0]) / (1.0 + outwards);
    }
}

/// The only particle of a material's part, at the centroid of the part if it lies in the part,
/// otherwise at the sample nearest to the centroid.
fn lone(
    plan: &Plan,
    cell: usize,
    samples: &[Sample],
    (m, centroid, share): (u8, [f64; 2], f64),
) -> Option<Member> {
    let distance = |s: &Sample| (s.r[0] - centroid[0]).hypot(s.r[1] - centroid[1]);
    let nearest = samples
        .iter()
        .filter(|s| material(plan, s.filling) == Some(m))
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let there = filling(plan, plan.si(plan.mesh.from_reference(cell, centroid)));
    let r = if there == nearest.filling { centroid } else { nearest.r };
    Some(Member { r, share, material: m, filling: nearest.filling })
}

/// Sets the viscosities and densities that the particles of a cell carry.
fn carry(plan: &Plan, cell: usize, members: &[Member], (out, first): (&mut Particles, usize)) {
    for (m, fields) in plan.initial.iter().enumerate() {
        let of_m = || (0..members.len()).filter(|&k| members[k].material as usize == m);
        let value = |f: &FieldFn, r: [f64; 2], unit: f64| {
            let si = plan.si(plan.mesh.from_reference(cell, r));
            f.at(si[0], si[1]) / unit
        };
        if let (Some(column), Some(f)) = (&mut out.viscosity, &fields.viscosity) {
            for k in of_m() {
                column[first + k] = value(f, members[k].r, plan.units.viscosity);
            }
        }
        if let (Some(column), Some(f)) = (&mut out.density, &fields.density) {
            for k in of_m() {
                column[first + k] = value(f, members[k].r, plan.units.density);
            }
        }
    }
}

/// Angles spread evenly over `[-pi/2, pi/2)` in random order: `n` equal steps with an offset from
/// a two-dimensional low-discrepancy sequence (Roberts 2018) over the cells, so that the
/// angles of neighbouring cells interleave. Each angle is uniformly distributed. Means over few
/// cells have far less noise than those of independent angles.
fn spread_angles(n: usize, [i, j]: [usize; 2], start: f64, random: &mut Pcg64) -> Vec<f64> {
    use std::f64::consts::{FRAC_PI_2, PI};
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let offset = (start + i as f64 / PLASTIC + j as f64 / (PLASTIC * PLASTIC)).fract();
    let mut angles: Vec<f64> =
        (0..n).map(|k| -FRAC_PI_2 + PI * (k as f64 + offset) / n as f64).collect();
    for k in (1..n).rev() {
        angles.swap(k, random.random_range(0..=k));
    }
    angles
}

/// Whether a point lies within the half width of a mark.
fn is_near(mark: &Mark, p: [f64; 2]) -> bool {
    let d = [mark.to[0] - mark.from[0], mark.to[1] - mark.from[1]];
    let length2 = d[0] * d[0] + d[1] * d[1];
    let r = [p[0] - mark.from[0], p[1] - mark.from[1]];
    let t =
        if length2 > 0.0 { ((r[0] * d[0] + r[1] * d[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (r[0] - t * d[0]).hypot(r[1] - t * d[1]) <= mark.half_width
}
