//! The price list: what is printed, kept on disk and bought from.

use super::reference::Kind;
use crate::scene::{Scene, scene_hash};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Version of the format.
pub const SCHEMA: u32 = 2;

/// Everything that was found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct List {
    pub schema: u32,
    pub scene: String,
    pub version: String,
    pub quick: bool,
    pub machine: Machine,
    /// What the errors are of: `volume through "outflow" at the end`.
    pub quantity: String,
    pub norm: String,
    /// SI
    pub floor: f64,
    /// End of the runs that were measured, and of the scene, s.
    pub horizon: [f64; 2],
    /// Sets that shorten the scene to what was measured.
    pub shortened: Vec<String>,
    pub reference: ReferenceLine,
    pub noise: Noise,
    /// Relative spread over placements and seeds; `None` if there was no time to see it.
    pub sampling: Option<f64>,
    pub gauges: Vec<GaugeLine>,
    pub knobs: Vec<KnobLine>,
    /// All that ran, the scene's own settings first.
    pub entries: Vec<Entry>,
    /// Indices of `entries`, cheapest first.
    pub front: Vec<usize>,
    /// What did not run through, and why.
    pub failed: Vec<String>,
    /// What was left out to keep the time.
    pub skipped: Vec<String>,
    /// Seconds of a whole run of the scene over those of what was measured.
    pub whole_run: f64,
    /// Where runs were shortened: difference of two coarse runs at the scene's end over that at the
    /// horizon, and their cells; `None` if there was no time for them.
    pub growth: Option<Growth>,
    /// Seconds that the list took to make.
    pub made_in: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    pub name: String,
    pub processor: String,
    pub processors: usize,
    /// The processor that runs were pinned to.
    pub pinned: Option<String>,
    /// Processor time is told by the system, not taken from the wall's clock.
    pub cpu_clock: bool,
}

/// How an error grows from the horizon to the end of the scene.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Growth {
    pub factor: f64,
    pub cells: [u32; 2],
}

impl Growth {
    /// Promises are for the end: errors that shrink later are promised as they were measured.
    pub fn of_promises(&self) -> f64 {
        self.factor.max(1.0)
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ReferenceLine {
    pub kind: Kind,
    /// If it is one number, SI.
    pub value: Option<f64>,
    /// Relative.
    pub uncertainty: f64,
    pub rate: Option<f64>,
}

/// Slowest over fastest of the same run, less 1.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Noise {
    pub cpu: f64,
    pub wall: f64,
    pub repeats: usize,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GaugeLine {
    pub name: String,
    /// Its volume is what the list is about.
    pub priced: bool,
    /// Relative, of the reference's volume.
    pub uncertainty: f64,
    /// Relative.
    pub sampling: f64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct KnobLine {
    pub name: String,
    /// Settings and the error each is estimated to add.
    pub adds: Vec<(String, f64)>,
    /// Observed rate; absent for choices and where one difference only was seen.
    pub rate: Option<f64>,
    /// Largest ratio of a difference to the fitted power; near 1 is regular.
    pub misfit: Option<f64>,
}

/// A candidate.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Entry {
    pub label: String,
    pub sets: Vec<String>,
    /// Measured against the reference, relative.
    pub error: f64,
    /// What is promised. Against an exact solution the measured error; else no less than the root
    /// of the sum of squares of what the knobs add, plus the reference's uncertainty: errors of
    /// different sign may cancel, and nobody can rely on that.
    pub promised: f64,
    /// The measured error is far below what the knobs add: they cancel.
    pub lucky: bool,
    /// Best of the repeats.
    pub cpu: f64,
    pub wall: f64,
    pub repeats: usize,
    pub steps: u64,
    pub unknowns: usize,
    pub particles: usize,
    pub phases: Vec<(String, f64)>,
    /// What each knob adds to the error, largest first.
    pub split: Vec<(String, f64)>,
    /// Relative errors of the gauges' volumes.
    pub gauge_errors: Vec<f64>,
    /// Seconds that the next halving of the error costs on top; front only.
    pub next_halving: Option<f64>,
}

impl Entry {
    pub fn limiting(&self) -> &str {
        self.split.first().filter(|s| s.1 > 0.0).map_or("nothing", |s| &s.0)
    }
}

impl List {
    pub fn front(&self) -> impl Iterator<Item = &Entry> {
        self.front.iter().map(|&i| &self.entries[i])
    }

    /// What is not on the front, dearest first.
    pub fn dominated(&self) -> Vec<&Entry> {
        let mut list: Vec<&Entry> = (0..self.entries.len())
            .filter(|i| !self.front.contains(i))
            .map(|i| &self.entries[i])
            .collect();
        list.sort_by(|a, b| b.cpu.total_cmp(&a.cpu));
        list
    }

    /// The cheapest entry that is as good and no dearer.
    pub fn better(&self, than: &Entry) -> Option<&Entry> {
        self.front().find(|e| e.promised <= than.promised && e.cpu <= than.cpu)
    }

    /// Seconds of a processor that a whole run of an entry is expected to take.
    pub fn expected_seconds(&self, entry: &Entry) -> f64 {
        entry.cpu * self.whole_run
    }

    /// The cheapest entry that keeps an accuracy; else the most accurate.
    pub fn for_accuracy(&self, wanted: f64) -> Result<&Entry, Option<&Entry>> {
        let good = self.front().find(|e| e.promised <= wanted);
        good.ok_or_else(|| self.front().min_by(|a, b| a.promised.total_cmp(&b.promised)))
    }

    /// Seconds of a step, start and all.
    pub fn step_seconds(&self, entry: &Entry) -> f64 {
        entry.cpu / (entry.steps + 1) as f64
    }

    /// The most accurate entry whose whole run is expected to end in time; else the fastest. `pace`:
    /// how many times longer than then a step takes now.
    pub fn for_budget(&self, seconds: f64, pace: f64) -> Result<&Entry, Option<&Entry>> {
        // Room for recording, plots and the machine's noise.
        let room = 1.1 * (1.0 + self.noise.wall.min(0.3)) * pace;
        let fits = |e: &&Entry| room * self.expected_seconds(e) <= seconds;
        let best = self.front().filter(fits).min_by(|a, b| a.promised.total_cmp(&b.promised));
        best.ok_or_else(|| self.front().min_by(|a, b| a.cpu.total_cmp(&b.cpu)))
    }

    /// Rows for a spreadsheet.
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
    /// This machine, with what the processors are called.
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
            cpu_clock: super::measure::thread_seconds().is_some(),
        }
    }
}

/// Where lists are kept: `$XDG_CACHE_HOME/grainscope/cost` or `~/.cache/grainscope/cost`.
pub fn folder() -> Option<PathBuf> {
    let given = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let base = given("XDG_CACHE_HOME").filter(|p| p.is_absolute());
    let base = base.or_else(|| given("HOME").map(|home| home.join(".cache")))?;
    Some(base.join("grainscope").join("cost"))
}

/// Name of the file of a list: another scene, program or machine gives another.
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

/// The list of a scene that was kept here, if there is one.
pub fn kept(scene: &Scene, quick: bool) -> Option<List> {
    load(&folder()?.join(file_name(&scene.name, &scene_hash(scene), quick)))
}

/// A list that was kept. A file that cannot be read is as good as none: it is made again.
pub fn load(path: &Path) -> Option<List> {
    let list: List = serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()?;
    let whole = list.front.iter().all(|&i| i < list.entries.len());
    (list.schema == SCHEMA && whole).then_some(list)
}

/// Keeps a list.
pub fn store(path: &Path, list: &List) -> std::io::Result<()> {
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent)?;
    }
    let text = serde_json::to_string_pretty(list)?;
    // Under another name first: a reader never sees half a list.
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
    fn buys_the_cheapest_that_does() {
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
        assert_eq!(label(list.for_budget(20.0, 3.0)).as_deref(), Some("base"), "a slower day");
        assert_eq!(
            list.for_budget(0.1, 1.0).expect_err("too little").map(|e| e.label.as_str()),
            Some("coarse")
        );
        assert_eq!(list.dominated()[0].label, "bad");
        assert_eq!(list.better(list.dominated()[0]).map(|e| e.label.as_str()), Some("base"));
    }

    #[test]
    fn is_read_back_as_it_was_written() {
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
    fn other_scenes_have_other_files() {
        assert_ne!(file_name("s", "1", false), file_name("s", "2", false));
        assert_ne!(file_name("s", "1", false), file_name("s", "1", true));
        assert_eq!(file_name("s", "1", true), file_name("s", "1", true));
    }
}
