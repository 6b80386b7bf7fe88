//! This module saves and loads the data of a checkpoint other than the state of the simulation.

use super::options::Safety;
use crate::record::logger::Traffic;
use crate::record::summary::{Around, Tally};
use crate::sim::state::{State, StateError, load_phases, save_phases};
use crate::simd::Simd;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The data of a checkpoint other than the state of the simulation.
pub struct Past {
    /// Counts for the summary.
    pub tally: Tally,
    /// Wall time (s), frame counts, and time of the logger (s).
    pub before: (f64, Traffic, f64),
    /// Path of the recording.
    pub recording: Option<PathBuf>,
    /// Warnings so far.
    pub warnings: Vec<String>,
    /// Options of the run.
    pub safety: Safety,
    /// Version and instruction set of the program that wrote the checkpoint.
    pub made_by: [String; 2],
}

/// Version and instruction set of this program.
pub fn this_program() -> [String; 2] {
    [env!("CARGO_PKG_VERSION").into(), Simd::used().set().name().into()]
}

impl Past {
    /// Adds the data to a state. `folder`: folder of the run.
    pub fn save(&self, state: &mut State, folder: &Path) {
        save_phases("session.phases", &self.tally.phases, state);
        let (wall, traffic, busy) = self.before;
        let t = &self.tally;
        state.put_floats(
            "session.numbers",
            [
                wall,
                t.largest_power_error,
                t.largest_divergence,
                traffic.waited.as_secs_f64(),
                busy,
                t.around.set_up,
                t.around.guard,
                t.around.writing,
            ],
        );
        state.put_counts("session.frames", [traffic.frames, traffic.drops, traffic.waits]);
        self.safety.save(state);
        if let Some(recording) = &self.recording {
            // The folder of a run may be moved, so paths inside it are saved as relative paths.
            let inside = recording.strip_prefix(folder).map(Path::to_path_buf);
            let path = inside.or_else(|_| std::path::absolute(recording));
            let path = path.unwrap_or_else(|_| recording.clone());
            state.put_bytes("session.recording", path.to_string_lossy().bytes());
        }
        state.put_bytes("session.warnings", self.warnings.join("\n").bytes());
        let [version, simd] = &self.made_by;
        state.put_bytes("session.program", version.bytes());
        state.put_bytes("session.simd", simd.bytes());
    }

    /// A warning if another version of this program, or another instruction set, made the earlier
    /// part of the run.
    pub fn made_otherwise(&self) -> Option<String> {
        let [version, simd] = this_program();
        let [old_version, old_simd] = &self.made_by;
        (*old_version != version || *old_simd != simd).then(|| {
            format!(
                "the checkpoint was written by version {old_version} with the instruction set \
                 {old_simd}; this is version {version} with {simd}, so the run is not bitwise that \
                 of a single program"
            )
        })
    }

    /// Loads the data that [`Past::save`] wrote. `folder`: folder of the run.
    ///
    /// # Errors
    /// The state does not contain them.
    pub fn load(state: &State, folder: &Path) -> Result<Past, StateError> {
        let [wall, power, divergence, waited, busy, set_up, guard, writing] =
            state.numbers("session.numbers")?;
        let [frames, drops, waits] = state.tally("session.frames")?;
        let waited = Duration::try_from_secs_f64(waited).unwrap_or_default();
        let traffic = Traffic { frames, drops, waits, waited };
        let recording = match state.try_bytes("session.recording") {
            Some(_) => Some(folder.join(state.text("session.recording")?)),
            None => None,
        };
        Ok(Past {
            tally: Tally {
                phases: load_phases("session.phases", state)?,
                wall,
                largest_power_error: power,
                largest_divergence: divergence,
                traffic,
                logger_seconds: busy,
                around: Around { set_up, guard, writing },
                warnings: vec![],
            },
            before: (wall, traffic, busy),
            recording,
            warnings: state.text("session.warnings")?.lines().map(String::from).collect(),
            safety: Safety::load(state)?,
            made_by: ["session.program", "session.simd"]
                .map(|name| state.text(name).unwrap_or("unknown").to_owned()),
        })
    }
}
