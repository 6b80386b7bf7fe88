//! The particles at the start: material, directors and carried fields from the plan's regions.

use crate::plan::{InitialDirector, Mark, Plan};
use crate::space::particles::Particles;
use rand::Rng;
use rand_pcg::Pcg64;

/// A point of the domain that no region and no background fills.
#[derive(Debug, thiserror::Error)]
#[error(
    "nothing fills the scene at x = {x:.6e}, y = {y:.6e}: a flow without inertia needs a material \
     everywhere; extend a region, or give a material `background = true`"
)]
pub struct Unfilled {
    pub x: f64,
    pub y: f64,
}

/// Fills every cell.
pub fn particles(plan: &Plan) -> Result<Particles, Unfilled> {
    let mesh = &plan.mesh;
    let effects = &plan.effects;
    let mut out = Particles {
        director: effects.directors.then(Vec::new),
        viscosity: effects.carried_viscosity.then(Vec::new),
        density: effects.carried_density.then(Vec::new),
        mark: (!plan.marks.is_empty()).then(Vec::new),
        ..Particles::default()
    };
    let background = plan.background();
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let mut random = plan.method.seeding.random(cell);
        let places = plan.method.seeding.positions(mesh, cell, &mut random);
        let volume = mesh.cell_area(cell) / places.len() as f64;
        let angles = stratified_angles(places.len(), &mut random);
        for (p, angle) in places.into_iter().zip(angles) {
            let si = plan.si(p);
            let region = plan.regions.iter().rev().find(|r| r.shape.contains(si));
            let material = region
                .map(|r| r.material)
                .or(background)
                .ok_or(Unfilled { x: si[0], y: si[1] })?;
            out.push(p, volume, material);
            let last = out.len() - 1;
            let fields = &plan.initial[material as usize];
            if let (Some(column), Some(f)) = (&mut out.viscosity, &fields.viscosity) {
                column[last] = f.at(si[0], si[1]) / plan.units.viscosity;
            }
            if let (Some(column), Some(f)) = (&mut out.density, &fields.density) {
                column[last] = f.at(si[0], si[1]) / plan.units.density;
            }
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
                column[last] = plan.marks.iter().any(|m| is_near(m, p));
            }
        }
    }
    out.sort(mesh);
    Ok(out)
}

/// Angles uniform in `[-pi/2, pi/2)`, one in each of `n` equal parts, in random order: the mean
/// over a cell has far less noise than independent ones would give.
fn stratified_angles(n: usize, random: &mut Pcg64) -> Vec<f64> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let mut angles: Vec<f64> =
        (0..n).map(|k| -FRAC_PI_2 + PI * (k as f64 + random.random::<f64>()) / n as f64).collect();
    for k in (1..n).rev() {
        angles.swap(k, random.random_range(0..=k));
    }
    angles
}

fn is_near(mark: &Mark, p: [f64; 2]) -> bool {
    let d = [mark.to[0] - mark.from[0], mark.to[1] - mark.from[1]];
    let length2 = d[0] * d[0] + d[1] * d[1];
    let r = [p[0] - mark.from[0], p[1] - mark.from[1]];
    let t = if length2 > 0.0 { ((r[0] * d[0] + r[1] * d[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (r[0] - t * d[0]).hypot(r[1] - t * d[1]) <= mark.half_width
}
