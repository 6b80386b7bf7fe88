//! Verifies inertia: vortex, plate, free fall, standing wave and lid-driven cavity.

use super::Effort;
use super::report::{Bound, Section, Table, number};
use crate::cases::inertia::{
    Resolution, cavity, decaying_vortex, energy_lost_by_vortex, falling_drop,
    motion_of_turning_wave, plate, speed_over_plate, standing_wave, turning_wave, wave_decay,
    wave_period,
};
use crate::cases::{CaseError, start};
use crate::scene::SceneSource;
use crate::sim::Run;

/// Verifies inertia.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Inertia",
        about: "*Decaying vortex* (Taylor and Green) at Re = 1/(nu k) = 1000 over one turn: error of \
                the kinetic energy lost, of which inviscid flow would lose nothing. *Plate*: fluid \
                over a plate that starts suddenly (Rayleigh). *Wave of shear and rotation* in a Cosserat fluid whose rotation has \
                inertia (`micro_inertia`), which decays between walls without friction. *Free fall* of a drop in air of density \
                1e-5: thin air (dynamic viscosity 1e-6) is stirred by the drop and slows it, and \
                stiffer air does not. *Standing wave* of a hundredth of its length between water and \
                air of density 1e-3: minima of the kinetic energy give the period; its maxima fall \
                faster than by viscosity, since cells cut by the surface dissipate. *Cavity* at \
                Re = 1000: extrema of the velocity on the centre lines (Botella and Peyret 1998)."
            .into(),
        ..Section::default()
    };
    vortex(effort, &mut out)?;
    moving_plate(effort, &mut out)?;
    turning(effort, &mut out)?;
    fall(effort, &mut out)?;
    wave(effort, &mut out)?;
    if effort == Effort::Full {
        lid(&mut out)?;
    }
    Ok(out)
}

/// Runs a scene to its end; `each` is called at the start and after each step.
fn finish(source: &SceneSource, mut each: impl FnMut(&dyn Run)) -> Result<Box<dyn Run>, CaseError> {
    let mut run = start(source)?;
    each(run.as_ref());
    while !run.is_finished() {
        run.step()?;
        each(run.as_ref());
    }
    Ok(run)
}

fn vortex(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let title = "Decaying vortex: relative error of the energy lost";
    let mut table = Table::new(title, &["cells", "largest step", "error", "energy error"]);
    for &cells in effort.take(&[16, 32]) {
        let mut errors = vec![];
        for max_step in [0.04, 0.02, 0.01] {
            let mut first = None;
            let source = decaying_vortex(Resolution { cells, max_step });
            let run = finish(&source, |run| {
                first.get_or_insert(run.row().kinetic_energy);
            })?;
            let row = run.row();
            let lost = 1.0 - row.kinetic_energy / first.unwrap_or(f64::NAN);
            let error = lost / energy_lost_by_vortex() - 1.0;
            errors.push(error.abs());
            table.rows.push(vec![
                cells.to_string(),
                number(max_step),
                number(error),
                number(row.energy_error),
            ]);
        }
        out.check(
            format!("vortex, {cells} cells: error of the energy lost"),
            errors[2],
            Bound::AtMost(0.01),
        );
        out.check(
            format!("vortex, {cells} cells: order in time"),
            (errors[0] / errors[1]).log2(),
            Bound::AtLeast(1.9),
        );
    }
    out.tables.push(table);
    Ok(())
}

fn moving_plate(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    const POINTS: u32 = 64;
    let title = "Sudden plate: rms error of the speed at t = 1, relative to the rms speed";
    let mut table = Table::new(title, &["cells", "largest step", "error"]);
    let mut errors = vec![];
    for &(cells, max_step) in
        effort.take(&[(16, 0.1), (16, 0.05), (32, 0.025), (32, 0.05), (64, 0.025), (64, 0.0125)])
    {
        let run = finish(&plate(Resolution { cells, max_step }), |_| {})?;
        let [mut sum, mut scale] = [0.0; 2];
        for k in 0..POINTS {
            let y = (f64::from(k) + 0.5) / f64::from(POINTS);
            let exact = speed_over_plate(y, run.row().time);
            sum += (run.velocity_at([0.0, y])[0] - exact).powi(2);
            scale += exact * exact;
        }
        let error = (sum / scale).sqrt();
        errors.push(error);
        table.rows.push(vec![cells.to_string(), number(max_step), number(error)]);
    }
    out.check("plate, 16 cells, step 0.1: error", errors[0], Bound::AtMost(0.01));
    out.check("plate, 32 cells, step 0.025: error", errors[2], Bound::AtMost(1e-3));
    out.tables.push(table);
    Ok(())
}

fn turning(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let title = "Wave of shear and rotation: relative errors at t = 2";
    let mut table = Table::new(title, &["cells", "largest step", "velocity", "rotation"]);
    let mut errors = vec![];
    for &(cells, max_step) in
        effort.take(&[(32, 0.1), (32, 0.05), (32, 0.025), (32, 0.0125), (64, 0.0125)])
    {
        let run = finish(&turning_wave(Resolution { cells, max_step }), |_| {})?;
        let exact = motion_of_turning_wave(run.row().time);
        let found = [run.velocity_at([0.0, 0.0])[0], run.velocity_at([0.0, 0.5])[2]];
        let [u, w] = [0, 1].map(|c| found[c] / exact[c] - 1.0);
        errors.push(u.abs().max(w.abs()));
        table.rows.push(vec![cells.to_string(), number(max_step), number(u), number(w)]);
    }
    out.check("wave of shear and rotation, step 0.05: error", errors[1], Bound::AtMost(1e-3));
    let order = (errors[1] / errors[2]).log2();
    out.check("wave of shear and rotation: order in time", order, Bound::AtLeast(1.9));
    out.tables.push(table);
    Ok(())
}

fn fall(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let title = "Free fall: distance of the centre of mass over t^2/2 at t = 1, less one";
    let mut table = Table::new(title, &["cells", "viscosity of the air", "error"]);
    let mut error = |cells: u32, air_viscosity: f64| -> Result<f64, CaseError> {
        let source = falling_drop(Resolution { cells, max_step: 0.05 }, air_viscosity);
        let mut first = None;
        let run = finish(&source, |run| {
            first.get_or_insert(height(run));
        })?;
        let error = (first.unwrap_or(f64::NAN) - height(run.as_ref())) / 0.5 - 1.0;
        table.rows.push(vec![cells.to_string(), number(air_viscosity), number(error)]);
        Ok(error.abs())
    };
    let coarse = error(8, 1e-3)?;
    let fine = error(16, 1e-3)?;
    if effort == Effort::Full {
        error(32, 1e-3)?;
        error(16, 1e-4)?;
        error(32, 1e-4)?;
    }
    out.tables.push(table);
    out.check("free fall, 8 cells: error", coarse, Bound::AtMost(0.01));
    out.check("free fall, 16 cells: error", fine, Bound::AtMost(1e-3));
    Ok(())
}

/// Height of the centre of mass of the first material.
fn height(run: &dyn Run) -> f64 {
    let (p, plan) = (run.particles(), run.plan());
    let of_drop = (0..p.len()).filter(|&k| p.material[k] == 0);
    let (volume, moment) = of_drop.fold((0.0, 0.0), |(volume, moment), k| {
        (volume + p.volume[k], moment + p.volume[k] * plan.si(p.position[k])[1])
    });
    moment / volume
}

fn wave(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let header = ["cells per half wave", "period over theory", "decay in half a period", "theory"];
    let mut table = Table::new("Standing wave", &header);
    for &(cells, bound) in effort.take(&[(16, 0.02), (32, 0.01)]) {
        let mut curve = vec![];
        finish(&standing_wave(Resolution { cells, max_step: 0.02 }), |run| {
            curve.push((run.row().time, run.row().kinetic_energy));
        })?;
        let period = wave_period();
        let within = |from: f64, to: f64| {
            let inside = move |p: &&(f64, f64)| p.0 > from * period && p.0 < to * period;
            curve.iter().filter(inside)
        };
        let largest = |from, to| within(from, to).map(|p| p.1).fold(0.0, f64::max);
        // At the end of the period the water is at rest for the second time.
        let rest = within(0.85, 1.05).min_by(|a, b| a.1.total_cmp(&b.1));
        let ratio = rest.map_or(f64::NAN, |p| p.0) / period;
        let decay = largest(0.5, 1.0) / largest(0.0, 0.5);
        table.rows.push(vec![
            cells.to_string(),
            format!("{ratio:.4}"),
            number(decay),
            number(wave_decay()),
        ]);
        out.check(
            format!("standing wave, {cells} cells: period over theory"),
            ratio,
            Bound::Within(1.0, bound),
        );
        out.aim(
            format!("standing wave, {cells} cells: decay over theory"),
            decay / wave_decay(),
            Bound::AtLeast(0.98),
        );
    }
    out.tables.push(table);
    Ok(())
}

/// Extrema of the velocity on the centre lines of the cavity (O. Botella, R. Peyret, Comput. Fluids 27
/// (1998) 421).
fn lid(out: &mut Section) -> Result<(), CaseError> {
    const POINTS: u32 = 1000;
    const CELLS: [(u32, f64); 2] = [(32, 0.02), (64, 0.005)];
    const EXACT: [f64; 3] = [-0.3885698, 0.3769447, -0.5270771];
    let mut table =
        Table::new("Cavity at Re = 1000, t = 60", &["cells", "u_min", "v_max", "v_min"]);
    for (cells, bound) in CELLS {
        let run = finish(&cavity(cells), |_| {})?;
        let extrema = |at: &dyn Fn(f64) -> f64| {
            let values = (1..POINTS).map(|k| at(f64::from(k) / f64::from(POINTS)));
            values.fold([0.0_f64; 2], |[low, high], v| [low.min(v), high.max(v)])
        };
        let u = extrema(&|y| run.velocity_at([0.5, y])[0]);
        let v = extrema(&|x| run.velocity_at([x, 0.5])[1]);
        let found = [u[0], v[1], v[0]];
        table.rows.push([vec![cells.to_string()], found.map(number).to_vec()].concat());
        let errors = found.iter().zip(EXACT).map(|(f, e)| (f / e - 1.0).abs());
        out.aim(
            format!("cavity, {cells} cells: largest error of the extrema"),
            errors.fold(0.0, f64::max),
            Bound::AtMost(bound),
        );
    }
    table.rows.push([vec!["exact".into()], EXACT.map(number).to_vec()].concat());
    out.tables.push(table);
    Ok(())
}
