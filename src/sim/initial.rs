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
    let start: f64 = plan.method.seeding.random(usize::MAX).random();
    for cell in (0..mesh.cells()).filter(|&c| !mesh.solid[c]) {
        let mut random = plan.method.seeding.random(cell);
        let places = plan.method.seeding.positions(mesh, cell, &mut random);
        let volume = mesh.cell_area(cell) / places.len() as f64;
        let (i, j) = mesh.cell_ij(cell);
        let angles = spread_angles(places.len(), [i, j], start, &mut random);
        for (p, angle) in places.into_iter().zip(angles) {
            let si = plan.si(p);
            let region = plan.regions.iter().rev().find(|r| r.shape.contains(si));
            let material =
                region.map(|r| r.material).or(background).ok_or(Unfilled { x: si[0], y: si[1] })?;
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

/// Angles spread evenly over `[-pi/2, pi/2)` in random order: `n` equal steps with an offset from
/// a two-dimensional low-discrepancy sequence (Roberts 2018) over the cells, so that neighbouring
/// cells fill each other's gaps. Each angle is uniformly distributed; means over few cells have
/// far less noise than independent angles would give.
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

fn is_near(mark: &Mark, p: [f64; 2]) -> bool {
    let d = [mark.to[0] - mark.from[0], mark.to[1] - mark.from[1]];
    let length2 = d[0] * d[0] + d[1] * d[1];
    let r = [p[0] - mark.from[0], p[1] - mark.from[1]];
    let t =
        if length2 > 0.0 { ((r[0] * d[0] + r[1] * d[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (r[0] - t * d[0]).hypot(r[1] - t * d[1]) <= mark.half_width
}
