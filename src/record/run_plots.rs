//! This module draws the plots that every run writes.

use super::plots::{Axis, Curve, PlotError, PlotSpec, line_plot, panels_plot};
use crate::plan::Plan;
use crate::sim::row::Row;
use std::path::Path;

/// Writes the plots of a run into its folder: outflow, alignment and balance errors.
pub fn plots_of_run(folder: &Path, plan: &Plan, rows: &[Row]) -> Result<(), PlotError> {
    let time = || Axis::new("time", "s");
    let curve = |name: &str, value: &dyn Fn(&Row) -> f64| Curve {
        name: name.into(),
        points: rows.iter().map(|r| (r.time, value(r))).collect(),
        marks: false,
    };
    let title = &plan.scene.name;
    let unit = |in_plane| plan.scene.domain.geometry.unit(in_plane);
    let gauges = &plan.gauges;
    if !gauges.is_empty() {
        let of = |value: &dyn Fn(&Row, usize) -> f64| -> Vec<Curve> {
            (0..gauges.len()).map(|k| curve(&gauges[k].name, &|r| value(r, k))).collect()
        };
        panels_plot(
            &folder.join("outflow"),
            &[
                PlotSpec {
                    title: format!("{title}: outflow volume"),
                    x: time(),
                    y: Axis::new("outflow volume", unit("m²")),
                    curves: of(&|r, k| r.gauges[k].volume),
                },
                PlotSpec {
                    title: "outflow rate".into(),
                    x: time(),
                    y: Axis::new("outflow rate", unit("m²/s")),
                    curves: of(&|r, k| r.gauges[k].rate),
                },
            ],
        )?;
    }
    if !plan.forces.is_empty() {
        let of = |value: &dyn Fn(&Row, usize) -> f64| -> Vec<Curve> {
            let names = plan.forces.iter().enumerate();
            names.map(|(k, g)| curve(&g.name, &|r| value(r, k))).collect()
        };
        panels_plot(
            &folder.join("forces"),
            &[
                PlotSpec {
                    title: format!("{title}: force along x"),
                    x: time(),
                    y: Axis::new("force along x", unit("N/m")),
                    curves: of(&|r, k| r.forces[k].x),
                },
                PlotSpec {
                    title: "force along y".into(),
                    x: time(),
                    y: Axis::new("force along y", unit("N/m")),
                    curves: of(&|r, k| r.forces[k].y),
                },
            ],
        )?;
    }
    if plan.effects.directors {
        line_plot(
            &folder.join("alignment"),
            &PlotSpec {
                title: format!("{title}: alignment of the directors"),
                x: time(),
                y: Axis::new("mean |n_x|", ""),
                curves: vec![curve("mean |n_x|", &|r| r.mean_alignment.unwrap_or(f64::NAN))],
            },
        )?;
    }
    line_plot(
        &folder.join("diagnostics"),
        &PlotSpec {
            title: format!("{title}: balance errors"),
            x: time(),
            y: Axis::new("relative error", "").log(),
            curves: vec![
                curve("power", &|r| r.power_error),
                curve("divergence", &|r| r.divergence_error),
                curve("volume", &|r| r.volume_error),
            ],
        },
    )?;
    Ok(())
}
