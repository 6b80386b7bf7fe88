//! Verifies friction, yield stresses and power laws on steady flows in layers, channels and chutes.

use super::Effort;
use super::report::{Bound, Section, Table, number, rate};
use crate::cases::{CaseError, Channel, Unidirectional, bagnold, channel, chute};

/// Discharge of the chute at `p0 = 1.7` with an internal length of 0.1: the minimum of the convex
/// functional on a line, by an independent program, extrapolated from 100 to 800 elements.
const COSSERAT_DISCHARGE: f64 = 0.8991;
/// Pressure at the walls of the chute, Pa.
const CHUTE_PRESSURE: f64 = 1.7;

/// Verifies flow curves.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Friction and yield stress",
        about: "Steady flows that vary in one direction, solved by Newton's method to 1e-7. Grains: \
                mu_s = 0.38, mu_2 = 0.64, I_0 = 0.279, d = 0.04, rho_s = 1/0.6, with density, gravity \
                and thickness of the layer (half-width of the chute) as units. *Bagnold*: a layer on \
                a rough incline; the speed at the surface varies as the power 3/2 of the depth, \
                which limits its order to 3/2, and the order of the discharge rises to 2 with the \
                mesh only slowly. *Chute*: grains between rough walls under the pressure \
                1.7, with a plug; with an internal length of 0.1 (coupling ratio 1, no rotation at \
                the walls) the reference is the minimum of the convex functional on a line by \
                an independent program. *Bingham* and *power law*: `K = 1` between walls at distance \
                1 under a force per volume f. A plug has the largest viscosity, so its error falls \
                with the inverse of that, until that of the mesh remains. Cells are counted per unit \
                of length."
            .into(),
        ..Section::default()
    };
    inclines(effort, &mut out)?;
    chutes(effort, &mut out)?;
    bingham(effort, &mut out)?;
    power_laws(effort, &mut out)?;
    Ok(out)
}

/// Adds rows of the errors of a flow at several resolutions; the errors of the discharge.
fn refine(
    name: &str,
    flow: &Unidirectional,
    cells: &[u32],
    table: &mut Table,
) -> Result<Vec<(u32, f64)>, CaseError> {
    let mut errors = vec![];
    for &cells in cells {
        let e = flow.errors(cells)?;
        table.rows.push(vec![
            name.into(),
            cells.to_string(),
            number(e.speed),
            number(e.discharge),
            errors.last().map_or(String::new(), |&last| {
                format!("{:.2}", rate(last, (cells, e.discharge.abs())))
            }),
        ]);
        errors.push((cells, e.discharge.abs()));
    }
    Ok(errors)
}

/// A table of relative errors.
fn errors_of(title: &str) -> Table {
    Table::new(title, &["flow", "cells", "speed", "discharge", "order of discharge"])
}

fn inclines(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut table = errors_of("Grains on an incline: relative errors");
    for degrees in [24.0, 28.0] {
        let name = format!("{degrees} degrees");
        let flow = bagnold(degrees);
        let errors = refine(&name, &flow, effort.take(&[8, 16, 32, 64]), &mut table)?;
        let [.., coarse, fine] = errors[..] else { continue };
        out.check(
            format!("Bagnold, {name}: order of the discharge"),
            rate(coarse, fine),
            // It rises to 2 with the mesh: 1.64, 1.79, 1.87 at 24 degrees.
            Bound::AtLeast(if effort == Effort::Quick { 1.6 } else { 1.85 }),
        );
        let worst = flow.errors(32)?.discharge.abs();
        out.check(
            format!("Bagnold, {name}: error of the discharge at 32 cells"),
            worst,
            Bound::AtMost(1e-5),
        );
    }
    out.tables.push(table);
    Ok(())
}

fn chutes(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut table = errors_of("Grains in a vertical chute: relative errors");
    let cells = effort.take(&[16, 32, 64]);
    let classical = chute(CHUTE_PRESSURE, 0.0);
    let at_32 = refine("classical", &classical, cells, &mut table)?[1].1;
    out.check("chute: error of the discharge at 32 cells", at_32, Bound::AtMost(5e-3));
    let cosserat = chute(CHUTE_PRESSURE, 0.1);
    for &cells in cells {
        let discharge = cosserat.measure(cells)?.discharge;
        let error = discharge / COSSERAT_DISCHARGE - 1.0;
        table.rows.push(vec![
            "internal length 0.1".into(),
            cells.to_string(),
            String::new(),
            number(error),
            String::new(),
        ]);
        if cells == 32 {
            out.check(
                "chute, internal length 0.1: error of the discharge at 32 cells",
                error.abs(),
                Bound::AtMost(5e-3),
            );
        }
    }
    out.tables.push(table);
    Ok(())
}

fn bingham(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let fluid = |force, largest| channel(Channel { yield_stress: 1.0, index: 1.0, force, largest });
    let header = ["f", "largest viscosity", "cells", "speed", "discharge"];
    let mut table = Table::new("Bingham fluid between walls: relative errors", &header);
    let mut add = |force: f64, largest: f64, cells: u32| -> Result<f64, CaseError> {
        let e = fluid(force, largest).errors(cells)?;
        let row = [number(force), number(largest), cells.to_string()];
        table.rows.push([&row[..], &[number(e.speed), number(e.discharge)]].concat());
        Ok(e.discharge.abs())
    };
    let caps = [100, 200, 400];
    let mut errors = vec![];
    for cap in caps {
        errors.push((cap, add(4.0, f64::from(cap), 32)?));
    }
    let accurate = add(4.0, 1e5, 32)?.max(add(20.0, 1e5, 32)?);
    if effort == Effort::Full {
        add(4.0, 1e5, 64)?;
        add(20.0, 1e5, 64)?;
    }
    out.check(
        "Bingham: order of the error in the inverse largest viscosity",
        rate(errors[1], errors[2]),
        Bound::Within(1.0, 0.05),
    );
    out.check("Bingham: error of the discharge at 32 cells", accurate, Bound::AtMost(1e-3));
    // The exact flow is the creep of a fluid with the largest viscosity.
    let creep = fluid(1.9, 1e4).errors(32)?.discharge.abs();
    out.check(
        "Bingham below the yield stress: discharge relative to the creep, less one",
        creep,
        Bound::AtMost(1e-3),
    );
    out.tables.push(table);
    Ok(())
}

fn power_laws(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut table = errors_of("Power laws between walls, f = 10: relative errors");
    for index in [0.5, 1.5] {
        let flow = channel(Channel { yield_stress: 0.0, index, force: 10.0, largest: 1e4 });
        let name = format!("n = {index}");
        let errors = refine(&name, &flow, effort.take(&[16, 32, 64]), &mut table)?;
        out.check(
            format!("power law, {name}: error of the discharge at 32 cells"),
            errors[1].1,
            Bound::AtMost(1e-4),
        );
    }
    out.tables.push(table);
    Ok(())
}
