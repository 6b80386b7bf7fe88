//! Compares the quadrature rules on material interfaces that lie inside cells.

use super::Effort;
use super::report::{Bound, Figure, Section, Table, number};
use crate::cases::{
    Case, CaseError, Drive, Inclined, Small, SolCx, inclined_pure_shear, inclined_shear, solcx,
    solvi, start,
};
use crate::scene::SceneSource;
use crate::sim::SimError;

/// The default rule without weight, with which the others are compared.
const DEFAULT: &str = "laminate";
/// Assignment that selects this rule.
const DEFAULT_SET: &str = "accuracy.quadrature=laminate";
/// Values of `accuracy.quadrature` that are compared.
const RULES: [&str; 3] = ["laminate", "mixture", "particles"];
/// The default rule with weight.
const DEFAULT_OF_WEIGHT: &str = "sides";
/// Values of `accuracy.quadrature` that are compared on falling drops, which have weight.
const RULES_OF_WEIGHT: [&str; 4] = ["laminate", "sides", "mixture", "particles"];
/// Cases left out of the figure, whose legend has room for seven: their curves look the same as at
/// a contrast of 1e3.
const LIKE_OTHERS: [&str; 2] = ["SolVi 1e6", "inclined layers 1e8, shear"];
/// Random seeds of the particle placement.
const SEEDS: [u32; 3] = [1, 2, 3];

/// A case, its resolutions, and the required accuracy.
struct Entry {
    label: &'static str,
    case: Case,
    /// Numbers of cells per side.
    cells: [u32; 3],
    /// Largest velocity error at the finest resolution.
    wanted: Option<f64>,
    /// True if the bounds are goals, which may be missed.
    goal: bool,
}

/// All cases.
fn entries() -> Result<Vec<Entry>, CaseError> {
    let even = [16, 32, 64];
    let layers = |contrast| Inclined { degrees: 30.0, contrast };
    let entry = |label, case, cells, wanted| Entry { label, case, cells, wanted, goal: false };
    let jump = solcx(SolCx { contrast: 1e6, jump: 0.5 }, Drive::BodyForce)?;
    Ok(vec![
        entry("SolCx, jump inside a cell, 1e6", jump, [17, 33, 65], Some(3.6e-3)),
        entry("SolVi 1e3", solvi(1e3)?, even, Some(2.8e-3)),
        entry("SolVi 1e6", solvi(1e6)?, even, Some(3.0e-3)),
        entry("SolVi 1e-1 (weak)", solvi(0.1)?, even, None),
        entry("SolVi 1e-2 (weak)", solvi(0.01)?, even, None),
        Entry { goal: true, ..entry("SolVi 1e-3 (weak)", solvi(1e-3)?, even, Some(9.9e-3)) },
        entry("inclined layers 1e3, shear", inclined_shear(layers(1e3)), even, Some(1.6e-3)),
        entry("inclined layers 1e8, shear", inclined_shear(layers(1e8)), even, None),
        entry("inclined layers 1e3, stretched", inclined_pure_shear(layers(1e3)), even, None),
    ])
}

/// Verifies the quadrature rules on interfaces inside cells.
pub fn section(effort: Effort) -> Result<Section, CaseError> {
    let mut out = Section {
        title: "Interfaces inside cells",
        about: "Relative velocity errors, mean over three seeds of jittered particles, 16 per \
                cell. `laminate` (default without weight): the interface is reconstructed from the particles; the \
                two materials act in series for shear along it and in parallel for stretching \
                along it; sheets and drops smaller than a cell have separate rules. `mixture`: \
                Gauss points with the local harmonic mixture of the cell's particles. `particles`: \
                particles as integration points (the source). Required at the finest mesh: errors \
                no larger than with the local harmonic mixture of an independent program (3.6e-3, \
                2.8e-3, 3.0e-3, 1.6e-3), and for the weak inclusion no larger than with its plain \
                particles (9.9e-3). Published velocity errors of Q1-P0 elements on SolVi: 8.5e-3 \
                at 32 cells, 3.9e-3 at 64, 2.2e-3 at 128."
            .into(),
        ..Section::default()
    };
    let mut header = vec!["case", "cells"];
    header.extend(RULES);
    let mut table = Table::new("", &header);
    let mut figure = Figure {
        name: "cut_cells".into(),
        title: "Velocity error with the interface inside cells".into(),
        x: "cells per side",
        y: "relative error",
        logarithmic: true,
        curves: vec![],
    };
    for e in entries()? {
        let mut curve = vec![];
        let mut last = [0.0; RULES.len()];
        for &n in effort.take(&e.cells) {
            let mut row = vec![e.label.to_string(), n.to_string()];
            for (rule, last) in RULES.iter().zip(&mut last) {
                *last = mean_error(&e.case, n, rule, effort)?;
                row.push(if last.is_finite() { number(*last) } else { "no convergence".into() });
                if *rule == DEFAULT {
                    curve.push((f64::from(n), *last));
                }
            }
            table.rows.push(row);
        }
        if !LIKE_OTHERS.contains(&e.label) {
            figure.curves.push((e.label.into(), curve));
        }
        let of = |name: &str| {
            RULES.iter().zip(last).find(|(r, _)| **r == name).map_or(f64::NAN, |v| v.1)
        };
        if let (Some(wanted), Effort::Full) = (e.wanted, effort) {
            let what = format!("{}: velocity error", e.label);
            if e.goal {
                out.aim(what, of(DEFAULT), Bound::AtMost(wanted));
            } else {
                out.check(what, of(DEFAULT), Bound::AtMost(wanted));
            }
        }
        let what = format!("{}: velocity error of plain particles relative to ours", e.label);
        let ratio = of("particles") / of(DEFAULT);
        if e.goal {
            out.aim(what, ratio, Bound::AtLeast(1.0));
        } else {
            out.check(what, ratio, Bound::AtLeast(1.0));
        }
    }
    out.tables.push(table);
    out.figures.push(figure);
    small_inclusions(effort, &mut out)?;
    drops(effort, &mut out)?;
    Ok(out)
}

/// Mean velocity error of a rule over the seeds; infinite if a rule other than the default does not
/// converge.
fn mean_error(case: &Case, cells: u32, rule: &str, effort: Effort) -> Result<f64, CaseError> {
    let rule = format!("accuracy.quadrature={rule}");
    let seeds = effort.take(&SEEDS);
    let mut sum = 0.0;
    for seed in seeds {
        let seed = format!("accuracy.seed={seed}");
        match case.errors(cells, &[&rule, &seed, "accuracy.placement=jittered"]) {
            Ok(e) => sum += e.velocity,
            // A failure of a rule other than the default is a result.
            Err(CaseError::Sim(SimError::Solve { .. })) if rule != DEFAULT_SET => {
                return Ok(f64::INFINITY);
            }
            Err(e) => return Err(e),
        }
    }
    Ok(sum / seeds.len() as f64)
}

/// Dissipation of inclusions smaller than a cell.
fn small_inclusions(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    const CELLS: u32 = 16;
    let h = 1.0 / f64::from(CELLS);
    let mut header = vec!["inclusion"];
    header.extend(RULES);
    let mut table = Table::new(
        "Inclusions smaller than a cell, contrast 1000: computed excess of dissipation over the \
         exact one (16 cells per side; 1 is exact). Sheets are stretched along their length; drops \
         are compared with the dilute limit.",
        &header,
    );
    let mut list = vec![];
    for degrees in [0.0, 30.0] {
        for share in [0.25, 0.5, 0.8] {
            let name = format!("stiff sheet of {share} h at {degrees} degrees");
            list.push((name, Small::sheet(degrees, share * h, 1e3), true));
        }
    }
    list.push(("stiff drop, radius 0.35 h".into(), Small::drop(0.35 * h, 1e3), false));
    list.push(("weak drop, radius 0.35 h".into(), Small::drop(0.35 * h, 1e-3), false));
    for (name, small, sheet) in effort.take(&list) {
        let mut row = vec![name.clone()];
        for rule in RULES {
            let rule_set = format!("accuracy.quadrature={rule}");
            let strength = small.strength(CELLS, &[&rule_set])?;
            row.push(format!("{strength:.2}"));
            if rule == DEFAULT && *sheet {
                out.aim(format!("{name}: strength"), strength, Bound::AtLeast(0.8));
            } else if rule == DEFAULT {
                out.check(format!("{name}: strength"), strength, Bound::Within(1.0, 0.15));
            }
        }
        table.rows.push(row);
    }
    out.tables.push(table);
    Ok(())
}

/// Largest speed of a falling drop whose boundary lies inside cells.
fn fall(drop: &str, around: &str, cells: u32, rule: &str) -> Result<f64, CaseError> {
    let text = format!(
        "schema = 1\nname = \"drop\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = {cells}\nplacement = \"jittered\"\nquadrature = \"{rule}\"\n[time]\n\
         end = 1\n[materials.drop]\ndensity = 1\nshear_viscosity = 1\n{drop}\n[materials.rest]\n\
         shear_viscosity = {around}\n[[regions]]\nmaterial = \"rest\"\n[[regions]]\n\
         material = \"drop\"\ndirector.angle_degrees = 30\n\
         shape.circle = {{ centre = [0.37, 0.55], radius = 0.23 }}\n"
    );
    let source = SceneSource::new("drop", text);
    Ok(start(&source)?.row().max_speed)
}

/// Speeds of falling drops of Cosserat and layered fluid.
fn drops(effort: Effort, out: &mut Section) -> Result<(), CaseError> {
    let mut header = vec!["drop", "viscosity around"];
    header.extend(RULES_OF_WEIGHT);
    let mut table = Table::new(
        "Falling drops of Cosserat and layered fluid in a fluid of different viscosity: largest \
         speed at 16 cells over that at 64 cells with the same rule. `sides` is the default for \
         materials of different weight.",
        &header,
    );
    let cosserat = "coupling_viscosity = 1\ninternal_length = 0.25";
    let layered = "layer_viscosity = 0.1";
    for (name, drop) in effort.take(&[("Cosserat", cosserat), ("layered", layered)]) {
        for around in effort.take(&["1e-3", "0.1", "1", "1e3"]) {
            let mut row = vec![name.to_string(), around.to_string()];
            for rule in RULES_OF_WEIGHT {
                let ratio = fall(drop, around, 16, rule)? / fall(drop, around, 64, rule)?;
                row.push(format!("{ratio:.3}"));
                let what = || format!("{name} drop in {around}, {rule}: speed at 16 cells over 64");
                // The speed of a drop that is a thousand times softer than its surroundings
                // depends on its boundary; a laminate needs many more cells.
                if rule == DEFAULT && *around != "1e3" {
                    out.check(what(), ratio, Bound::Within(1.0, 0.03));
                } else if rule == DEFAULT_OF_WEIGHT {
                    out.aim(what(), ratio, Bound::Within(1.0, 0.03));
                }
            }
            table.rows.push(row);
        }
    }
    out.tables.push(table);
    Ok(())
}
