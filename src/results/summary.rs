//! This module reads the summary of a run.

use super::ResultsError;
use indexmap::IndexMap;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The parts of `summary.json` that are read.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct Summary {
    pub(super) schema: u32,
    pub(super) scene: String,
    pub(super) scene_hash: String,
    pub(super) state_hash: String,
    pub(super) ending: String,
    #[serde(default)]
    pub(super) error: Option<String>,
    pub(super) steps: u64,
    pub(super) time: f64,
    // JSON has null for numbers that are not finite.
    pub(super) max_speed: Option<f64>,
    pub(super) rms_speed: Option<f64>,
    pub(super) particles: u64,
    pub(super) gauges: IndexMap<String, Gauge>,
    #[serde(default)]
    pub(super) forces: IndexMap<String, Force>,
    pub(super) volume_drift: IndexMap<String, Option<f64>>,
    #[serde(default)]
    pub(super) mean_alignment: Option<f64>,
    #[serde(default)]
    pub(super) ill_posed_share: Option<f64>,
    #[serde(default)]
    pub(super) recording: Option<PathBuf>,
    /// The text of the file.
    #[serde(skip)]
    pub(super) text: String,
}

#[derive(Clone, Debug, Deserialize)]
pub(super) struct Force {
    pub(super) x: Option<f64>,
    pub(super) y: Option<f64>,
    pub(super) torque: Option<f64>,
}

#[derive(Clone, Debug, Deserialize)]
pub(super) struct Gauge {
    pub(super) volume: Option<f64>,
    pub(super) rate: Option<f64>,
}

impl Summary {
    pub(super) fn read(path: &Path) -> Result<Summary, ResultsError> {
        let broken = |cause: String| ResultsError::Broken { path: path.to_owned(), cause };
        let wrong = |e: serde_json::Error| {
            broken(format!(
                "is not the summary of a run: {e}; expected a summary.json of `grainscope run`"
            ))
        };
        let text = read(path)?;
        let mut summary: Summary = serde_json::from_str(&text).map_err(wrong)?;
        summary.text = text;
        if summary.schema != crate::record::summary::SCHEMA {
            return Err(broken(format!(
                "has schema {}; this program reads {}: create it again with `grainscope run`",
                summary.schema,
                crate::record::summary::SCHEMA
            )));
        }
        Ok(summary)
    }

    /// Values under the column names of the series.
    pub(super) fn values(&self) -> IndexMap<String, f64> {
        let mut values = IndexMap::new();
        let mut put = |key: &str, value: Option<f64>| {
            values.extend(value.map(|value| (key.to_string(), value)));
        };
        put("step", Some(self.steps as f64));
        put("particles", Some(self.particles as f64));
        for (name, gauge) in &self.gauges {
            let prefix = if self.gauges.len() > 1 { format!("{name}.") } else { String::new() };
            put(&format!("{prefix}outflow_volume"), gauge.volume);
            put(&format!("{prefix}outflow_rate"), gauge.rate);
        }
        for (name, force) in &self.forces {
            put(&format!("{name}.force_x"), force.x);
            put(&format!("{name}.force_y"), force.y);
            put(&format!("{name}.torque"), force.torque);
        }
        put("max_speed", self.max_speed);
        put("rms_speed", self.rms_speed);
        put("mean_alignment", self.mean_alignment);
        put("ill_posed_share", self.ill_posed_share);
        for (material, drift) in &self.volume_drift {
            put(&format!("{material}.volume_drift"), *drift);
        }
        values
    }
}

/// Reads a text file.
pub(super) fn read(path: &Path) -> Result<String, ResultsError> {
    std::fs::read_to_string(path).map_err(|e| ResultsError::Broken {
        path: path.to_owned(),
        cause: format!("cannot be read: {e}"),
    })
}
