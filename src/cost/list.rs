//! The cost table: it is printed, stored on disk and used to choose settings.

use super::reference::Kind;
use crate::scene::{Scene, scene_hash};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Version of the file format.
pub const SCHEMA: u32 = 2;

/// A cost table: accuracy and time of a scene for many settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct List {
    /// Version of the file format, [`SCHEMA`].
    pub schema: u32,
    /// Name of the scene.
    pub scene: String,
    /// Version of grainscope.
    pub version: String,
    /// True for a table of [`Effort::Quick`](super::Effort::Quick).
    pub quick: bool,
    /// Machine on which the times were measured.
    pub machine: Machine,
    /// Quantity whose error is measured, such as ``volume through `outflow` at the end``.
    pub quantity: String,
    /// Norm of the error.
    pub norm: String,
    /// Smallest scale of relative errors, SI units.
    pub floor: f64,
    /// End time of the measured runs, and of the scene, s.
    pub horizon: [f64; 2],
    /// `--set` assignments that shorten the scene to the measured runs.
    pub shortened: Vec<String>,
    /// Reference against which errors are measured.
    pub reference: ReferenceLine,
    /// Timing noise of equal runs.
    pub noise: Noise,
    /// Relative spread over placements and seeds; `None` if there was no time to measure it.
    pub sampling: Option<f64>,
    /// Uncertainties of the gauges.
    pub gauges: Vec<GaugeLine>,
    /// Error contributions of the knobs.
    pub knobs: Vec<KnobLine>,
    /// All candidates that were run, the scene's own settings first.
    pub entries: Vec<Entry>,
    /// Indices in `entries` of the Pareto front, fastest first.
    pub front: Vec<usize>,
    /// Runs that failed, with reasons.
    pub failed: Vec<String>,
    /// Runs that were left out to keep the time limit.
    pub skipped: Vec<String>,
    /// Time of a whole run of the scene, divided by that of a measured run.
    pub whole_run: f64,
    /// Growth of the error after the horizon, if runs were shortened: difference of two coarse runs
    /// at the scene's end over that at the horizon. `None` if there was no time for these runs.
    pub growth: Option<Growth>,
    /// Wall-clock time in which the table was made, s.
    pub made_in: f64,
}

/// The machine on which a table was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Host name.
    pub name: String,
    /// Model name of the processor.
    pub processor: String,
    /// Number of logical processors.
    pub processors: usize,
    /// The processor that runs were pinned to.
    pub pinned: Option<String>,
    /// True if the system reports CPU times; otherwise they are wall-clock times.
    pub cpu_clock: bool,
}

/// Growth of the error from the horizon to the end of the scene.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Growth {
    /// Difference of two coarse runs at the scene's end over that at the horizon.
    pub factor: f64,
    /// `accuracy.cells` of the two runs.
    pub cells: [u32; 2],
}

impl Growth {
    /// Factor on error bounds, which hold at the scene's end. Errors that shrink are not scaled.
    pub fn of_promises(&self) -> f64 {
        self.factor.max(1.0)
    }
}

/// The reference of a table.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReferenceLine {
    /// Origin of the reference.
    pub kind: Kind,
    /// Value in SI units, if it is a single number.
    pub value: Option<f64>,
    /// Relative uncertainty.
    pub uncertainty: f64,
    /// Observed convergence rate.
    pub rate: Option<f64>,
}

/// Timing noise: the slowest over the fastest of several equal runs, minus 1.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Noise {
    /// Noise of the CPU time.
    pub cpu: f64,
    /// Noise of the wall-clock time.
    pub wall: f64,
    /// Number of runs.
    pub repeats: usize,
}

/// Uncertainties of a gauge.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GaugeLine {
    /// Name of the gauge.
    pub name: String,
    /// True if its volume is the quantity whose error is measured.
    pub priced: bool,
    /// Relative uncertainty of the reference volume.
    pub uncertainty: f64,
    /// Relative spread over placements and seeds.
    pub sampling: f64,
}

/// Error contributions of a knob.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct KnobLine {
    /// Name of the knob.
    pub name: String,
    /// Levels, and the relative error that each is estimated to add.
    pub adds: Vec<(String, f64)>,
    /// Observed convergence rate; `None` for choices and if only one difference is known.
    pub rate: Option<f64>,
    /// Largest ratio of a difference to the fitted power law; near 1 the convergence is regular.
    pub misfit: Option<f64>,
}

/// A candidate that was run: settings, error and time.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Entry {
    /// Settings that differ from those of the scene, in words.
    pub label: String,
    /// `--set` assignments that give these settings.
    pub sets: Vec<String>,
    /// Measured relative error against the reference.
    pub error: f64,
    /// Relative error bound. Against an exact solution it is the measured error. Otherwise it is
    /// the larger of the measured error and the root of the sum of squares of the contributions of
    /// the knobs, plus the uncertainty of the reference: contributions may cancel by chance. It is
    /// multiplied by [`Growth::of_promises`].
    pub promised: f64,
    /// True if the measured error is far below the contributions of the knobs, because they cancel.
    pub lucky: bool,
    /// Smallest CPU time of the repeats, s.
    pub cpu: f64,
    /// Smallest wall-clock time of the repeats, s.
    pub wall: f64,
    /// Number of equal runs.
    pub repeats: usize,
    /// Number of steps.
    pub steps: u64,
    /// Number of unknowns of a solution.
    pub unknowns: usize,
    /// Number of particles at the end.
    pub particles: usize,
    /// Names of the phases, and their wall-clock times, s.
    pub phases: Vec<(String, f64)>,
    /// Relative error that each knob adds, largest first.
    pub split: Vec<(String, f64)>,
    /// Relative errors of the volumes through the gauges.
    pub gauge_errors: Vec<f64>,
    /// Additional CPU time needed to halve the error, s; only on the Pareto front.
    pub next_halving: Option<f64>,
}

impl Entry {
    /// Name of the knob that contributes most to the error.
    pub fn limiting(&self) -> &str {
        self.split.first().filter(|s| s.1 > 0.0).map_or("nothing", |s| &s.0)
    }
}

impl List {
    /// Entries of the Pareto front, fastest first.
    pub fn front(&self) -> impl Iterator<Item = &Entry> {
        self.front.iter().map(|&i| &self.entries[i])
    }

    /// Entries that are not on the Pareto front, slowest first.
    pub fn dominated(&self) -> Vec<&Entry> {
        let mut list: Vec<&Entry> = (0..self.entries.len())
            .filter(|i| !self.front.contains(i))
            .map(|i| &self.entries[i])
            .collect();
        list.sort_by(|a, b| b.cpu.total_cmp(&a.cpu));
        list
    }

    /// The fastest entry of the front that is at least as accurate and no slower.
    pub fn better(&self, than: &Entry) -> Option<&Entry> {
        self.front().find(|e| e.promised <= than.promised && e.cpu <= than.cpu)
    }

    /// Expected CPU time of a whole run with the settings of an entry, s.
    pub fn expected_seconds(&self, entry: &Entry) -> f64 {
        entry.cpu * self.whole_run
    }

    /// The fastest entry whose error bound is at most `wanted`; otherwise `Err` with the most
    /// accurate one.
    pub fn for_accuracy(&self, wanted: f64) -> Result<&Entry, Option<&Entry>> {
        let good = self.front().find(|e| e.promised <= wanted);
        good.ok_or_else(|| self.front().min_by(|a, b| a.promised.total_cmp(&b.promised)))
    }

    /// Mean CPU time of a step of an entry, start included, s.
    pub fn step_seconds(&self, entry: &Entry) -> f64 {
        entry.cpu / (entry.steps + 1) as f64
    }

    /// The most accurate entry whose whole run is expected to take at most `seconds`; otherwise
    /// `Err` with the fastest one. `pace` is the ratio of the present time of a step to the
    /// measured one.
    pub fn for_budget(&self, seconds: f64, pace: f64) -> Result<&Entry, Option<&Entry>> {
        // Margin for recording, plots and timing noise.
        let room = 1.1 * (1.0 + self.noise.wall.min(0.3)) * pace;
        let fits = |e: &&Entry| room * self.expected_seconds(e) <= seconds;
        let best = self.front().filter(fits).min_by(|a, b| a.promised.total_cmp(&b.promised));
        best.ok_or_else(|| self.front().min_by(|a, b| a.cpu.total_cmp(&b.cpu)))
    }

    /// The table as CSV.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "front,settings,error,promised,cpu_seconds,wall_seconds,repeats,steps,unknowns,\
             particles,limited_by,next_halving_seconds",
        );
        let phases = self.entries.first().map(|e| e.phases.clone()).unwrap_or_default();
        phases.iter().for_each(|(name, _)| out += &format!(",{name}_seconds"));
        out.push('\n');
        for (i, e) in self.entries.iter().enumerate() {
            out += &format!(
                "{},\"{}\",{:e},{:e},{:.6},{:.6},{},{},{},{},{},{}",
                u8::from(self.front.contains(&i)),
                e.label,
                e.error,
                e.promised,
                e.cpu,
                e.wall,
                e.repeats,
                e.steps,
                e.unknowns,
                e.particles,
                e.limiting(),
                e.next_halving.map_or(String::new(), |s| format!("{s:.6}"))
            );
            e.phases.iter().for_each(|(_, s)| out += &format!(",{s:.6}"));
            out.push('\n');
        }
        out
    }
}

impl Machine {
    /// This machine.
    pub fn here() -> Machine {
        let line = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let info = line("/proc/cpuinfo");
        let model = info.lines().find(|l| l.starts_with("model name"));
        let model = model.and_then(|l| l.split_once(':')).map_or("unknown", |m| m.1.trim());
        Machine {
            name: line("/proc/sys/kernel/hostname").trim().to_string(),
            processor: model.to_string(),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            pinned: None,
            cpu_clock: crate::session::thread_seconds().is_some(),
        }
    }
}

/// Folder of stored tables: `$XDG_CACHE_HOME/grainscope/cost` or `~/.cache/grainscope/cost`.
pub fn folder() -> Option<PathBuf> {
    let given = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let base = given("XDG_CACHE_HOME").filter(|p| p.is_absolute());
    let base = base.or_else(|| given("HOME").map(|home| home.join(".cache")))?;
    Some(base.join("grainscope").join("cost"))
}

/// File name of a table; it differs for each scene, program and machine.
pub fn file_name(scene_name: &str, scene_hash: &str, quick: bool) -> String {
    let program = std::env::current_exe().ok().and_then(|p| std::fs::metadata(p).ok());
    let built = program.map(|m| (m.len(), m.modified().ok()));
    let machine = Machine::here();
    let key = format!(
        "{SCHEMA} {} {scene_hash} {built:?} {} {} {}",
        env!("CARGO_PKG_VERSION"),
        machine.name,
        machine.processor,
        machine.processors
    );
    let hash: String = Sha256::digest(key).iter().take(8).map(|b| format!("{b:02x}")).collect();
    format!("{scene_name}-{hash}{}.json", if quick { "-quick" } else { "" })
}

/// The stored table of a scene on this machine, if there is one.
pub fn kept(scene: &Scene, quick: bool) -> Option<List> {
    load(&folder()?.join(file_name(&scene.name, &scene_hash(scene), quick)))
}

/// Reads a stored table. `None` if the file is missing, invalid or of another format version.
pub fn load(path: &Path) -> Option<List> {
    let list: List = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    let whole = list.front.iter().all(|&i| i < list.entries.len());
    (list.schema == SCHEMA && whole).then_some(list)
}

/// Stores a table in a file.
pub fn store(path: &Path, list: &List) -> std::io::Result<()> {
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent)?;
    }
    let text = serde_json::to_string_pretty(list)?;
    // Written under another name first, so that no reader finds an incomplete file.
    let part = path.with_extension(format!("{}.part", std::process::id()));
    std::fs::write(&part, text + "\n")?;
    std::fs::rename(&part, path)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn entry(label: &str, error: f64, cpu: f64) -> Entry {
        Entry {
            label: label.into(),
            sets: vec![],
            error,
            promised: error,
            lucky: false,
            cpu,
            wall: cpu,
            repeats: 1,
            steps: 1,
            unknowns: 1,
            particles: 1,
            phases: vec![("solve".into(), cpu)],
            split: vec![("cells".into(), error)],
            gauge_errors: vec![],
            next_halving: None,
        }
    }

    pub fn list() -> List {
        List {
            schema: SCHEMA,
            scene: "s".into(),
            version: "0".into(),
            quick: true,
            machine: Machine::here(),
            quantity: "rms speed at the end".into(),
            norm: "relative difference".into(),
            floor: 0.0,
            horizon: [1.0, 2.0],
            shortened: vec![],
            reference: ReferenceLine {
                kind: Kind::Extrapolated,
                value: Some(1.0),
                uncertainty: 1e-4,
                rate: Some(2.0),
            },
            noise: Noise { cpu: 0.0, wall: 0.0, repeats: 3 },
            sampling: Some(1e-3),
            gauges: vec![],
            knobs: vec![],
            entries: vec![
                entry("base", 0.01, 1.0),
                entry("fine", 0.001, 8.0),
                entry("bad", 0.02, 2.0),
                entry("coarse", 0.05, 0.2),
            ],
            front: vec![3, 0, 1],
            failed: vec![],
            skipped: vec![],
            whole_run: 2.0,
            growth: Some(Growth { factor: 1.5, cells: [2, 3] }),
            made_in: 1.0,
        }
    }

    #[test]
    fn the_fastest_settings_that_suffice_are_chosen() {
        let list = list();
        let label = |e: Result<&Entry, Option<&Entry>>| e.map(|e| e.label.clone()).ok();
        assert_eq!(label(list.for_accuracy(0.03)).as_deref(), Some("base"));
        assert_eq!(label(list.for_accuracy(0.01)).as_deref(), Some("base"));
        assert_eq!(
            list.for_accuracy(1e-5).expect_err("out of reach").map(|e| e.label.as_str()),
            Some("fine")
        );
        assert_eq!(label(list.for_budget(20.0, 1.0)).as_deref(), Some("fine"));
        assert_eq!(label(list.for_budget(3.0, 1.0)).as_deref(), Some("base"));
        assert_eq!(label(list.for_budget(20.0, 3.0)).as_deref(), Some("base"), "slower steps");
        assert_eq!(
            list.for_budget(0.1, 1.0).expect_err("too little").map(|e| e.label.as_str()),
            Some("coarse")
        );
        assert_eq!(list.dominated()[0].label, "bad");
        assert_eq!(list.better(list.dominated()[0]).map(|e| e.label.as_str()), Some("base"));
    }

    #[test]
    fn a_stored_table_is_read_back_unchanged() {
        let folder = crate::testing::TempFolder::new().expect("temporary folder");
        let path = folder.path().join("a/b.json");
        store(&path, &list()).expect("written");
        let again = load(&path).expect("read");
        assert_eq!(again.csv(), list().csv());
        assert_eq!(again.csv().lines().count(), 5);
        std::fs::write(&path, "{").expect("written");
        assert!(load(&path).is_none());
    }

    #[test]
    fn each_scene_has_its_own_file() {
        assert_ne!(file_name("s", "1", false), file_name("s", "2", false));
        assert_ne!(file_name("s", "1", false), file_name("s", "1", true));
        assert_eq!(file_name("s", "1", true), file_name("s", "1", true));
    }
}
