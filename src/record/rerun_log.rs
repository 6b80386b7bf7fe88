//! This module writes recordings for the Rerun viewer. No other module uses Rerun.
//!
//! One recording holds one run, under `runs/<name>`:
//!
//! | entity | what it shows |
//! |---|---|
//! | `world/particles`, `world/dye`, `world/directors` | the flow |
//! | `world/walls`, `world/gauges` | fixed lines |
//! | `world/moving` | outlines of blocks that move |
//! | `world/stress/<gauge>` | force per area along a surface, as arrows; `values` holds its numbers |
//! | `world/fields/<field>/{image,bar,ticks,isolines}` | one field |
//! | `world/fields/<field>/values` | its values, on half as many samples per side |
//! | the path of each scalar, and `<path>/log10` | the plots |
//! | `round/{first,second,dye,rings,walls,outlines}` | a round flow in three dimensions, see `round.rs` |
//! | `scene`, `plan`, `log` | input, solved effects, warnings |
//!
//! Timelines are `sim_time`, `step` and `wall_time`. Positions are in metres with y up. The viewer
//! draws y down, so a static transform mirrors `world`, and views have its parent as their origin.

mod pictures;
mod round;
mod world;

mod blueprint;
mod colour_bar;
mod decode;
mod paths;
mod race;
mod read;
mod repair;
mod salvage;
mod side_by_side;
mod sinks;
mod stage;
mod surfaces;
mod viewer;

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rerun::archetypes;
use rerun::components::Color;
use rerun::{EntityPath, EntityPathPart, RecordingStream};

pub use decode::ReadError;
pub use race::Race;
pub use read::{Recorded, Sample};
pub use repair::{Repaired, repair};
pub use side_by_side::{Difference, RecordedRun, SideBySide};
pub use sinks::{Saved, Sink};
pub use stage::Lane;
pub use viewer::with_viewer;

use crate::frame::{Frame, Quantity, Rect, RunInfo};
use crate::record::colour::ColourScale;
use crate::record::replace::ReplaceError;
use crate::web::stream::Stream;
use paths::Paths;
use sinks::{Destinations, Live, Page, RrdFile};

/// Application identifier of all recordings.
const APPLICATION: &str = "grainscope";

/// Root path of the entities of runs.
const RUNS: &str = "runs";

const SIM_TIME: &str = "sim_time";
const STEP: &str = "step";
const WALL_TIME: &str = "wall_time";

/// Interval of the checks that everything has arrived.
const CHECK_EVERY: Duration = Duration::from_secs(2);

/// Time limit of a check. It allows for slow disks; a longer wait is an error.
const CHECK_PATIENCE: Duration = Duration::from_secs(60);

/// Age at which chunks are written if the recording goes to a file only. The default of 0.2 s would
/// make five chunks per curve and second, which viewers have to merge again.
const FILE_TICK: Duration = Duration::from_secs(1);

/// Draw order, from back to front.
mod depth {
    /// Draw order of field images.
    pub const FIELD: f32 = -20.0;
    /// Draw order of particles.
    pub const PARTICLES: f32 = 0.0;
    /// Draw order of director strokes and arrows.
    pub const GLYPHS: f32 = 10.0;
    /// Draw order of dye lines.
    pub const DYE: f32 = 20.0;
    /// Draw order of isolines.
    pub const ISOLINES: f32 = 25.0;
    /// Draw order of walls.
    pub const WALLS: f32 = 30.0;
    /// Draw order of gauges.
    pub const GAUGES: f32 = 40.0;
    /// Draw order of legends.
    pub const LEGEND: f32 = 50.0;
}

const WALL: [u8; 3] = [38, 38, 42];
const DYE: [u8; 3] = [20, 20, 30];
const GLYPH: [u8; 3] = [10, 10, 14];
const LINE: [u8; 3] = [20, 20, 24];
const ARROW: [u8; 3] = [250, 250, 250];
const INK: [u8; 3] = [30, 30, 34];

/// Error of writing a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be written.
    #[error("the recording {} cannot be written: {cause}", path.display())]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Cause, as reported by the operating system or the encoder.
        cause: String,
    },
    /// A file of another kind is in the way.
    #[error(transparent)]
    Replace(#[from] ReplaceError),
    /// The disk or a viewer did not respond when the run was interrupted.
    #[error("the recording is incomplete: the disk or the viewer does not respond")]
    Stuck,
    /// A viewer cannot be reached, and there is no other destination.
    #[error("the viewer at {name} does not answer: {cause}")]
    Viewer {
        /// Name or address of the viewer.
        name: String,
        /// Cause, as reported by the connection.
        cause: String,
    },
    /// A port to serve on cannot be used.
    #[error("port {port} of this machine cannot be used: {source}; 0 takes any free port")]
    Port {
        /// The requested port.
        port: u16,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// Rerun rejects its input.
    #[error("the recording could not be made: {0}")]
    Stream(#[from] rerun::RecordingStreamError),
    /// A picture has arrays of different lengths.
    #[error("{what}: {found} values; {expected} were expected")]
    Length {
        /// Name of the array.
        what: String,
        /// Number of values.
        found: usize,
        /// Required number of values.
        expected: usize,
    },
}

/// An open recording.
pub struct RerunLog {
    rec: RecordingStream,
    paths: Paths,
    domain: Rect,
    quantities: HashMap<String, Quantity>,
    particle_quantity: Option<Quantity>,
    /// Paths of the scalars that are also recorded as decimal logarithms.
    logarithms: HashSet<String>,
    files: Vec<RrdFile>,
    viewers: Vec<Live>,
    page: Option<Page>,
    stream: Option<Arc<Stream>>,
    notices: Vec<String>,
    checked: Instant,
    /// Class numbers as last recorded; they are recorded again only when they change.
    classes: Vec<u16>,
    /// Radii as last recorded, likewise.
    radii: Vec<f32>,
    /// Radius of particles without a radius of their own (m).
    particle_radius: f32,
    /// Whether the particles were last coloured by a scalar.
    colored: bool,
    /// Colour scales as last recorded, by the entity of the field.
    scales: HashMap<EntityPath, ColourScale>,
    /// Entities of the isolines drawn last; they are cleared when they are no longer drawn.
    isolines: HashSet<EntityPath>,
    /// Whether the flow is round, so that there is a view in three dimensions.
    round: bool,
    /// Number of dyed lines that were swept last.
    round_lines: usize,
    /// Places of the rings of rotation that were drawn last (m).
    round_rings: Vec<[f32; 2]>,
    pictures: u64,
}

/// Result of a finished recording.
pub struct Finished {
    /// Files that are complete.
    pub saved: Vec<Saved>,
    /// Number of recorded pictures.
    pub pictures: u64,
    /// Messages about viewers whose connection was lost.
    pub notices: Vec<String>,
    /// The page, if there is one. It is served until this value is dropped.
    pub served: Option<Served>,
}

/// A page that still shows a finished recording.
pub struct Served {
    _rec: RecordingStream,
    page: Page,
}

impl Served {
    /// Address of the page, to be opened in a browser.
    pub fn url(&self) -> &str {
        &self.page.url
    }
}

impl RerunLog {
    /// Starts a recording: opens its destinations and records the layout and everything constant.
    pub fn open(info: &RunInfo, sinks: &[Sink]) -> Result<Self, RecordError> {
        let mut to = Destinations::open(sinks)?;
        let rec = to.begin(&info.recording_id)?;
        blueprint::send(&rec, info, &Paths::new(&info.name))?;
        rec.send_recording_name(info.name.as_str())?;
        Self::of(rec, info).towards(to, info)
    }

    /// Attaches the destinations and records everything constant.
    fn towards(mut self, to: Destinations, info: &RunInfo) -> Result<Self, RecordError> {
        let log = &mut self;
        log.files = to.files;
        log.viewers = to.viewers;
        log.page = to.page;
        log.stream = to.stream;
        log.constant(info)?;
        // A viewer that is absent from the start is an error of the command line. `check` would
        // drop it.
        let wanted = log.viewers.clone();
        log.check()?;
        wanted.iter().try_for_each(Live::check)?;
        Ok(self)
    }

    fn constant(&mut self, info: &RunInfo) -> Result<(), RecordError> {
        self.world(info)?;
        if info.round {
            self.round_world(info)?;
        }
        self.texts(info)?;
        self.curves(info)
    }

    /// A recording on an existing stream, without destinations of its own.
    fn of(rec: RecordingStream, info: &RunInfo) -> Self {
        Self {
            rec,
            paths: Paths::new(&info.name),
            domain: info.domain,
            quantities: (info.fields.iter())
                .map(|field| (field.name.clone(), field.clone()))
                .collect(),
            particle_quantity: info.particle_quantity.clone(),
            logarithms: (info.plots.iter())
                .filter(|plot| plot.log10)
                .flat_map(|plot| plot.series.iter().map(|series| series.path.clone()))
                .collect(),
            files: Vec::new(),
            viewers: Vec::new(),
            page: None,
            stream: None,
            notices: Vec::new(),
            checked: Instant::now(),
            classes: Vec::new(),
            radii: Vec::new(),
            particle_radius: info.particle_radius,
            colored: false,
            scales: HashMap::new(),
            isolines: HashSet::new(),
            round: info.round,
            round_lines: 0,
            round_rings: Vec::new(),
            pictures: 0,
        }
    }

    /// The stream of the recording; `None` if it is neither streamed nor served.
    pub fn stream(&self) -> Option<Arc<Stream>> {
        self.stream.clone()
    }

    /// Address of the page, to be opened in a browser.
    pub fn url(&self) -> Option<&str> {
        self.page.as_ref().map(|page| page.url.as_str())
    }

    /// Returns new messages about lost viewers. Each message is returned once.
    pub fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    /// Records the frame of one step.
    pub fn frame(&mut self, frame: &Frame) -> Result<(), RecordError> {
        let step = i64::try_from(frame.step).unwrap_or(i64::MAX);
        self.rec.set_duration_secs(SIM_TIME, frame.time_s);
        self.rec.set_time_sequence(STEP, step);
        self.rec.set_duration_secs(WALL_TIME, frame.wall_s);

        if let Some(snapshot) = &frame.snapshot {
            self.snapshot(snapshot)?;
            self.pictures += 1;
        }
        for scalar in &frame.scalars {
            self.scalar(scalar)?;
        }
        for warning in &frame.warnings {
            self.rec.log(
                self.paths.at("log"),
                &archetypes::TextLog::new(warning.as_str())
                    .with_level(rerun::components::TextLogLevel::WARN),
            )?;
        }
        if self.checked.elapsed() > CHECK_EVERY {
            self.check()?;
        }
        Ok(())
    }

    /// Ends the recording and checks that all of it has arrived.
    pub fn finish(mut self) -> Result<Finished, RecordError> {
        self.check()?;
        let saved = self.files.iter().map(RrdFile::finish);
        let saved = saved.collect::<Result<Vec<_>, _>>()?;
        Ok(Finished {
            saved,
            pictures: self.pictures,
            notices: self.notices,
            served: self.page.map(|page| Served { _rec: self.rec, page }),
        })
    }

    /// Waits until everything recorded so far has arrived.
    fn check(&mut self) -> Result<(), RecordError> {
        // The result is that of the worst destination. The checks below find out which one it was,
        // and whether it matters.
        let flushed = self.rec.flush_with_timeout(CHECK_PATIENCE);
        self.checked = Instant::now();
        for file in &self.files {
            file.check()?;
        }
        if let (Err(error), Some(file)) = (&flushed, self.files.first())
            && matches!(error, rerun::sink::SinkFlushError::Timeout)
            && self.viewers.is_empty()
        {
            return Err(file.late());
        }
        let mut lost = None;
        self.viewers.retain(|viewer| match viewer.check() {
            Ok(()) => true,
            Err(error) => {
                self.notices.push(error.to_string());
                lost = Some(error);
                false
            }
        });
        match lost {
            Some(error) if self.files.is_empty() && self.viewers.is_empty() => Err(error),
            _ => Ok(()),
        }
    }
}

fn rgb([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgb(r, g, b)
}

fn rgb8([r, g, b]: [u8; 3]) -> rerun::Rgba32 {
    rerun::Rgba32::from_rgb(r, g, b)
}
