//! `series.csv`: one row a step, SI units.

use crate::plan::Plan;
use crate::sim::row::Row;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// The table in the making; each row is flushed, so a killed run leaves whole rows.
pub struct SeriesWriter {
    out: BufWriter<File>,
    /// There is a column of the mean alignment.
    alignment: bool,
}

/// Names of the columns of a plan's series.
pub fn columns(plan: &Plan) -> Vec<String> {
    let mut list: Vec<String> = [
        "step",
        "time",
        "dt",
        "dt_limiter",
        "wall",
        "power_in",
        "dissipation",
        "power_error",
        "divergence_error",
        "volume_error",
        "iterations",
        "particles",
    ]
    .map(String::from)
    .to_vec();
    for g in &plan.gauges {
        let prefix = if plan.gauges.len() > 1 { format!("{}.", g.name) } else { String::new() };
        list.push(format!("{prefix}outflow_volume"));
        list.push(format!("{prefix}outflow_rate"));
    }
    list.extend(
        [
            "max_speed",
            "rms_speed",
            "stabilisation",
            "potential_energy",
            "work",
            "dissipated",
            "director_error",
            "active_rotation",
            "splits",
            "merges",
            "held",
        ]
        .map(String::from),
    );
    if plan.effects.directors {
        list.push("mean_alignment".into());
    }
    list.extend(plan.state.materials.iter().map(|m| format!("{}.volume_drift", m.name)));
    list
}

impl SeriesWriter {
    pub fn create(path: &Path, plan: &Plan) -> std::io::Result<Self> {
        let mut out = BufWriter::new(File::create(path)?);
        writeln!(out, "{}", columns(plan).join(","))?;
        out.flush()?;
        Ok(SeriesWriter { out, alignment: plan.effects.directors })
    }

    pub fn write(&mut self, row: &Row) -> std::io::Result<()> {
        let mut line = format!(
            "{},{},{},{},{:.6},{},{},{:e},{:e},{:e},{},{}",
            row.step,
            row.time,
            row.dt,
            row.dt_limiter.name(),
            row.wall,
            row.power_in,
            row.dissipation,
            row.power_error,
            row.divergence_error,
            row.volume_error,
            row.iterations,
            row.particles
        );
        for g in &row.gauges {
            line += &format!(",{},{}", g.volume, g.rate);
        }
        line += &format!(
            ",{},{},{:e},{},{},{},{:e},{},{},{},{}",
            row.max_speed,
            row.rms_speed,
            row.stabilisation,
            row.potential_energy,
            row.work,
            row.dissipated,
            row.director_error,
            row.active_rotation,
            row.splits,
            row.merges,
            row.held
        );
        if self.alignment {
            line += &format!(",{}", row.alignment.unwrap_or(f64::NAN));
        }
        for d in &row.drift {
            line += &format!(",{d:e}");
        }
        line.push('\n');
        self.out.write_all(line.as_bytes())?;
        self.out.flush()
    }
}
