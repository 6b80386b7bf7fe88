//! Makes the figure of the discharge of a round silo beside that of a plane one, against the internal length.

use super::Args;
use crate::cases::start;
use crate::commands::Failure;
use crate::record::plots::{Axis, Curve, PlotSpec, line_plot};
use crate::scene::presets;
use std::path::Path;

/// Internal lengths over the width or the diameter of the hole.
const ALPHAS: [f64; 9] =
    [0.0, 1.0 / 12.0, 1.0 / 6.0, 1.0 / 3.0, 2.0 / 3.0, 1.0, 5.0 / 3.0, 10.0 / 3.0, 10.0];
/// The presets, and their names in the figure.
const SILOS: [(&str, &str); 2] =
    [("silo", "slit in a plane silo"), ("round_silo", "hole in a round silo")];

/// Makes the figure in the folder `out`. Returns the text to print.
pub(super) fn make(args: &Args, out: &Path) -> Result<String, Failure> {
    let cells = if args.quick { 4 } else { 16 };
    let (mut said, mut curves) = (String::new(), vec![]);
    for (preset, name) in SILOS {
        let source = presets::find(preset)?;
        let mut points: Vec<(f64, f64)> = vec![];
        let mut free = 1.0;
        for alpha in ALPHAS {
            let sets = [format!("accuracy.cells={cells}"), format!("alpha={alpha:?}")];
            let run = start(&source.with_sets(&sets)?)?;
            let rate = run.row().gauges[0].rate;
            if alpha == 0.0 {
                free = rate;
            }
            said += &format!(
                "{preset}, R/a = {alpha:.4}: {:.4} of the rate without internal length\n",
                rate / free
            );
            points.push((alpha, rate / free));
        }
        curves.push(Curve { name: name.into(), points, marks: true });
    }
    std::fs::create_dir_all(out).map_err(|e| {
        Failure::Environment(format!("cannot make the folder {}: {e}", out.display()))
    })?;
    let stem = out.join("round_silo_rates");
    line_plot(
        &stem,
        &PlotSpec {
            title: "First discharge rate of silos".into(),
            x: Axis::new("internal length over the width or diameter of the hole", ""),
            y: Axis::new("rate over that without internal length", ""),
            curves,
        },
    )?;
    Ok(said + &super::files(&stem))
}
