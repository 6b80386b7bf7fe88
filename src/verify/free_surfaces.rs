//! Verifies sloping free surfaces of a heavy fluid under a light, thin one, which cut cells at any
//! height and angle.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number};
use crate::cases::{CaseError, start};
use crate::scene::SceneSource;
use crate::sim::Run;

/// Values of `accuracy.quadrature` that are compared.
const RULES: [&str; 3] = ["sides", "laminate", "particles"];
/// The rule for free surfaces.
const RULE: &str = "sides";

/// A unit box whose part below a surface of the given slope through its middle is heavy.
struct Tilt {
    slope: f64,
    /// Viscosity of the heavy fluid over that of the light one.
    contrast: f64,
    /// Values of `tests/reference/tilted_surface.py`, in which the mesh follows the surface,
    /// extrapolated from 16, 32 and 64 squares per side.
    exact: Flow,
}

/// Measures of a flow, with the density, gravity, side and viscosity of the heavy fluid as units.
#[derive(Clone, Copy)]
struct Flow {
    /// Power of the weight.
    power: f64,
    /// Root mean square speed in the box.
    rms: f64,
    /// Largest speed at a node, which is that of the light fluid.
    fastest: f64,
}

const fn tilt(slope: f64, contrast: f64, power: f64, rms: f64, fastest: f64) -> Tilt {
    Tilt { slope, contrast, exact: Flow { power, rms, fastest } }
}

const TILTS: [Tilt; 16] = [
    tilt(0.1, 1e2, 3.8110e-5, 1.3481e-3, 2.2455e-3),
    tilt(0.1, 1e4, 3.9018e-5, 1.3813e-3, 2.3061e-3),
    tilt(0.1, 1e6, 3.9027e-5, 1.3816e-3, 2.3066e-3),
    tilt(0.1, 1e8, 3.9028e-5, 1.3816e-3, 2.3066e-3),
    tilt(0.4, 1e2, 6.1159e-4, 5.5924e-3, 1.0240e-2),
    tilt(0.4, 1e4, 6.3036e-4, 5.7673e-3, 1.0651e-2),
    tilt(0.4, 1e6, 6.3055e-4, 5.7692e-3, 1.0655e-2),
    tilt(0.4, 1e8, 6.3055e-4, 5.7692e-3, 1.0656e-2),
    tilt(1.0, 1e2, 3.1735e-3, 1.3864e-2, 2.3930e-2),
    tilt(1.0, 1e4, 3.3344e-3, 1.4563e-2, 2.5191e-2),
    tilt(1.0, 1e6, 3.3362e-3, 1.4571e-2, 2.5205e-2),
    tilt(1.0, 1e8, 3.3362e-3, 1.4571e-2, 2.5205e-2),
    tilt(3.0, 1e2, 3.8232e-3, 1.3835e-2, 2.5004e-2),
    tilt(3.0, 1e4, 3.9321e-3, 1.4239e-2, 2.5895e-2),
    tilt(3.0, 1e6, 3.9332e-3, 1.4243e-2, 2.5903e-2),
    tilt(3.0, 1e8, 3.9332e-3, 1.4243e-2, 2.5904e-2),
];

/// Verifies tilted surfaces and a slump.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Sloping free surfaces",
        about: "A heavy fluid under a light one a hundred to 1e8 times thinner, with no slip \
                on all walls. `sides` (default): where materials of different weight share a cell, \
                each has its own stiffness and weight on its side of a straight line. `laminate`: \
                the materials act in series in shear, so a cell that is mostly heavy is as weak as \
                the light fluid, and its weight drives the light fluid. `particles`: particles as \
                integration points (the source). The power, which is that of the heavy fluid, \
                converges at second order or better; the rms speed, which the light fluid \
                dominates, at first order."
            .into(),
        ..Section::default()
    };
    tilts(effort, &mut out)?;
    slump(effort, &mut out)?;
    current(effort, &mut out)?;
    Ok(out)
}

/// Errors of the flow under tilted surfaces at the start.
fn tilts(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let title = "Relative errors at the start, `sides`: power of the weight, root mean square speed; \
                 and fastest light fluid over the exact";
    let header = ["slope", "contrast", "cells", "power", "rms speed", "fastest"];
    let mut table = Table::new(title, &header);
    // Largest errors of power and of speed by the number of cells.
    let mut largest = [[0.0_f64; 2]; 4];
    let cells = effort.take(&[8, 16, 32, 64]);
    for tilt in &TILTS {
        for (&cells, largest) in cells.iter().zip(&mut largest) {
            let found = flow(tilt, cells, RULE, -1.0)?;
            let error = |of: fn(&Flow) -> f64| of(&found) / of(&tilt.exact) - 1.0;
            let [power, rms] = [error(|f| f.power), error(|f| f.rms)];
            largest[0] = largest[0].max(power.abs());
            largest[1] = largest[1].max(rms.abs());
            table.rows.push(vec![
                number(tilt.slope),
                number(tilt.contrast),
                cells.to_string(),
                number(power),
                number(rms),
                format!("{:.2}", found.fastest / tilt.exact.fastest),
            ]);
        }
    }
    out.tables.push(table);
    compare_rules(cells, out)?;
    void(cells, out)?;
    out.check("tilted surfaces, 8 cells: error of the power", largest[0][0], Bound::AtMost(0.07));
    out.check("tilted surfaces, 16 cells: error of the power", largest[1][0], Bound::AtMost(0.025));
    out.check(
        "tilted surfaces, 16 cells: error of the rms speed",
        largest[1][1],
        Bound::AtMost(0.15),
    );
    if effort == Effort::Full {
        out.check(
            "tilted surfaces, 64 cells: error of the power",
            largest[3][0],
            Bound::AtMost(0.007),
        );
        out.check(
            "tilted surfaces, 64 cells: error of the rms speed",
            largest[3][1],
            Bound::AtMost(0.03),
        );
    }
    // The flow is linear in gravity, and so must be the treatment of cut cells.
    let reversed = TILTS.iter().step_by(3).map(|tilt| {
        let [down, up] = [flow(tilt, 8, RULE, -1.0)?, flow(tilt, 8, RULE, 1.0)?];
        Ok((up.power / down.power - 1.0).abs())
    });
    let reversed = reversed.collect::<Result<Vec<f64>, CaseError>>()?;
    let worst = reversed.into_iter().fold(0.0, f64::max);
    out.check(
        "tilted surfaces: change of the power if gravity is reversed",
        worst,
        Bound::AtMost(1e-9),
    );
    Ok(())
}

/// Compares the rules of cut cells on a surface of slope 0.4 at contrast 1e6.
fn compare_rules(cells: &[u32], out: &mut Section) -> Result<(), CaseError> {
    let mut header = vec!["cells"];
    header.extend(RULES);
    let title = "Relative error of the power of the weight at slope 0.4, contrast 1e6 (in brackets: \
                 fastest light fluid over the exact)";
    let mut table = Table::new(title, &header);
    let mut figure = Figure {
        name: "free_surfaces".into(),
        title: "Error of the power of a surface of slope 0.4, contrast 1e6".into(),
        x: "cells per side",
        y: "relative error",
        logarithmic: true,
        curves: RULES.map(|rule| (rule.into(), vec![])).to_vec(),
    };
    let Some(tilt) = TILTS.iter().find(|t| t.slope == 0.4 && t.contrast == 1e6) else {
        return Ok(());
    };
    for &cells in cells {
        let mut row = vec![cells.to_string()];
        for (rule, curve) in RULES.iter().zip(&mut figure.curves) {
            let found = flow(tilt, cells, rule, -1.0)?;
            let error = (found.power / tilt.exact.power - 1.0).abs();
            row.push(format!("{} ({:.1})", number(error), found.fastest / tilt.exact.fastest));
            curve.1.push((f64::from(cells), error));
        }
        table.rows.push(row);
    }
    out.tables.push(table);
    out.figures.push(figure);
    Ok(())
}

/// Errors of the power with a void instead of the light fluid, which is that of the largest contrast.
fn void(cells: &[u32], out: &mut Section) -> Result<(), CaseError> {
    let title = "Relative error of the power with `background = \"void\"` (in brackets: fastest node over \
                 the fastest light fluid)";
    let mut header = vec!["slope".to_string()];
    header.extend(cells.iter().map(|cells| format!("{cells} cells")));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let mut table = Table::new(title, &header);
    let mut largest = vec![0.0_f64; cells.len()];
    for tilt in TILTS.iter().filter(|tilt| tilt.contrast == 1e8) {
        let mut row = vec![number(tilt.slope)];
        for (&cells, largest) in cells.iter().zip(&mut largest) {
            let source = tilted(tilt, cells, RULE, -1.0)?.with_sets(&["background=void".into()])?;
            let text = source.text().replace("[[regions]]\nmaterial = \"light\"\n", "");
            let run = start(&SceneSource::new("tilt", text))?;
            let error = run.row().power_in / tilt.exact.power - 1.0;
            *largest = largest.max(error.abs());
            row.push(format!(
                "{} ({:.1})",
                number(error),
                run.row().max_speed / tilt.exact.fastest
            ));
        }
        table.rows.push(row);
    }
    out.tables.push(table);
    for (&cells, (largest, bound)) in
        cells.iter().zip(largest.into_iter().zip([0.06, 0.025, 0.012, 0.006]))
    {
        let what = format!("void, {cells} cells: error of the power");
        out.check(what, largest, Bound::AtMost(bound));
    }
    Ok(())
}

/// The flow at the start.
fn flow(tilt: &Tilt, cells: u32, rule: &str, gravity: f64) -> Result<Flow, CaseError> {
    let run = start(&tilted(tilt, cells, rule, gravity)?)?;
    let row = run.row();
    Ok(Flow { power: row.power_in, rms: row.rms_speed, fastest: row.max_speed })
}

fn tilted(tilt: &Tilt, cells: u32, rule: &str, gravity: f64) -> Result<SceneSource, CaseError> {
    let Tilt { slope, contrast, .. } = tilt;
    let text = format!(
        "schema = 1\nname = \"tilt\"\ngravity = [0, {gravity}]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         length_scale = 1\n[accuracy]\ncells = {cells}\nquadrature = \"{rule}\"\n[time]\nend = 1\n\
         [boundaries]\nleft.kind = \"no_slip\"\nright.kind = \"no_slip\"\n\
         bottom.kind = \"no_slip\"\ntop.kind = \"no_slip\"\n\
         [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n\
         [materials.light]\nshear_viscosity = \"1/{contrast}\"\n\
         [[regions]]\nmaterial = \"light\"\n[[regions]]\nmaterial = \"heavy\"\n\
         shape.where = \"y < 0.5 + {slope}*(x - 0.5)\"\n"
    );
    Ok(SceneSource::new("tilt", text))
}

/// Energy balance of a block of mud that slumps in air.
fn slump(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let header = [
        "contrast",
        "cells",
        "rule",
        "steps",
        "energy lost, J/m",
        "dissipated, J/m",
        "rms speed, m/s",
    ];
    let title = "A block of mud of 1 m (1000 kg/m3, 1000 Pa s) slumps in air: t = 5 s";
    let mut table = Table::new(title, &header);
    let mut worst: f64 = 0.0;
    // Energies lost in air of contrast 1e4, in air of contrast 1e6 and in a void.
    let mut lost_at = [vec![], vec![], vec![]];
    for &(contrast, cells, rule) in effort.take(&[
        (1e4, 8, "sides"),
        (1e6, 8, "sides"),
        (f64::INFINITY, 8, "sides"),
        (1e4, 16, "sides"),
        (1e6, 16, "sides"),
        (f64::INFINITY, 16, "sides"),
        (1e4, 32, "sides"),
        (1e6, 32, "sides"),
        (f64::INFINITY, 32, "sides"),
        (1e4, 16, "laminate"),
        (1e4, 16, "particles"),
    ]) {
        let mut run = start(&slumping(contrast, cells, rule))?;
        let first = run.row().potential_energy;
        while !run.is_finished() {
            run.step()?;
        }
        let row = run.row();
        let lost = first - row.potential_energy;
        if rule == RULE {
            worst = worst.max((lost - row.dissipated).abs() / lost);
            let of = usize::from(contrast > 1e4) + usize::from(contrast > 1e6);
            lost_at[of].push(lost);
        }
        table.rows.push(vec![
            if contrast.is_finite() { number(contrast) } else { "void".into() },
            cells.to_string(),
            rule.into(),
            row.step.to_string(),
            format!("{lost:.0}"),
            format!("{:.0}", row.dissipated),
            number(row.rms_speed),
        ]);
    }
    out.tables.push(table);
    let [layer, air, void] = lost_at;
    let most =
        |ratios: &mut dyn Iterator<Item = f64>| ratios.map(|r| (r - 1.0).abs()).fold(0.0, f64::max);
    let spread = most(&mut layer.iter().map(|lost| lost / layer[layer.len() - 1]));
    let apart = most(&mut air.iter().zip(&void).map(|(air, void)| air / void));
    out.check("slump: difference of the energy lost and dissipated", worst, Bound::AtMost(0.035));
    out.check("slump: energy lost, difference from the finest mesh", spread, Bound::AtMost(0.01));
    let what = "slump: energy lost at a contrast of 1e6, difference from that in a void";
    out.check(what, apart, Bound::AtMost(0.01));
    Ok(())
}

/// The block in air of a contrast; beside a void if the contrast is infinite.
fn slumping(contrast: f64, cells: u32, rule: &str) -> SceneSource {
    let (around, air) = if contrast.is_finite() {
        let air = format!("[materials.air]\nshear_viscosity = \"1000/{contrast}\"\n");
        ("", air + "[[regions]]\nmaterial = \"air\"\n")
    } else {
        ("background = \"void\"\n", String::new())
    };
    let text = format!(
        "schema = 1\nname = \"slump\"\n{around}gravity = [0, -10]\n[domain]\nx = [0, 4]\n\
         y = [0, 1.5]\nlength_scale = 1\n[accuracy]\ncells = {cells}\nquadrature = \"{rule}\"\n\
         [time]\nend = 5\n[boundaries]\nleft.kind = \"no_slip\"\n\
         right.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n\
         [materials.mud]\ndensity = 1000\nshear_viscosity = 1000\n{air}\
         [[regions]]\nmaterial = \"mud\"\nshape.rectangle = {{ x = [0, 1], y = [0, 1] }}\n"
    );
    SceneSource::new("slump", text)
}

/// Range of the fronts of a gravity current that are compared, m.
const FRONTS: [f64; 2] = [3.3, 6.0];

/// A viscous gravity current of 1 m2 over a rough floor, beside a free-slip wall, against its similarity
/// solution: H. E. Huppert, "The propagation of two-dimensional and axisymmetric viscous gravity currents over
/// a rigid horizontal surface", J. Fluid Mech. 121 (1982) 43.
fn current(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let title = "Front of a gravity current, 3.3 to 6 m from the wall, over 1.411 (g V^3/(3 nu))^(1/5) \
                 (t + t0)^(1/5)";
    let header = ["cells per m", "background", "t0, s", "least", "most", "steps"];
    let mut table = Table::new(title, &header);
    for &(cells, background) in effort.take(&[(8, "void"), (16, "void"), (8, "air"), (16, "air")]) {
        let mut run = start(&spreading(cells, background))?;
        let mut path = vec![];
        loop {
            let front = front(run.as_ref());
            if front > FRONTS[0] && front <= FRONTS[1] {
                path.push((run.row().time, front));
            }
            if run.is_finished() || front > FRONTS[1] {
                break;
            }
            run.step()?;
        }
        // g = 10 m/s2, V = 1 m2, nu = 1 m2/s.
        let scale = 1.411_f64.powi(5) * 10.0 / 3.0;
        // The range of the ratios to the solution that started `lag` earlier.
        let ratios = |lag: f64| {
            let all = path.iter().map(|(t, x)| x / (scale * (t + lag)).powf(0.2));
            all.fold((f64::INFINITY, 0.0_f64), |(least, most), r| (least.min(r), most.max(r)))
        };
        let off = |(least, most): (f64, f64)| (most - 1.0).max(1.0 - least);
        let lags = (-100..1000).map(|k| 0.1 * f64::from(k));
        let lag = lags.min_by(|a, b| off(ratios(*a)).total_cmp(&off(ratios(*b)))).unwrap_or(0.0);
        let (least, most) = ratios(lag);
        table.rows.push(vec![
            cells.to_string(),
            background.into(),
            format!("{lag:.1}"),
            format!("{least:.4}"),
            format!("{most:.4}"),
            run.row().step.to_string(),
        ]);
        let what = format!("gravity current, {cells} cells per m, {background}: front");
        let bound = Bound::AtMost(if cells < 16 { 0.04 } else { 0.03 });
        // A film of air stays under the front and raises it.
        if background == "void" {
            out.check(what, off((least, most)), bound);
        } else {
            out.aim(what, off((least, most)), bound);
        }
    }
    out.tables.push(table);
    Ok(())
}

/// Distance of the farthest particle of the first material, m.
fn front(run: &dyn Run) -> f64 {
    let (p, plan) = (run.particles(), run.plan());
    let of_mud = (0..p.len()).filter(|&k| p.material[k] == 0);
    of_mud.map(|k| plan.si(p.position[k])[0]).fold(0.0, f64::max)
}

fn spreading(cells: u32, background: &str) -> SceneSource {
    let around = match background {
        "void" => "background = \"void\"\n",
        _ => "",
    };
    let text = format!(
        "schema = 1\nname = \"current\"\n{around}gravity = [0, -10]\n[domain]\nx = [0, 12]\n\
         y = [0, 1]\nlength_scale = 1\n[accuracy]\ncells = {cells}\n[time]\nend = 1000\n[boundaries]\n\
         right.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n\
         [materials.mud]\ndensity = 1000\nshear_viscosity = 1000\n\
         [materials.air]\nshear_viscosity = 1e-3\nbackground = true\n\
         [[regions]]\nmaterial = \"mud\"\nshape.rectangle = {{ x = [0, 2], y = [0, 0.5] }}\n"
    );
    SceneSource::new("current", text)
}
