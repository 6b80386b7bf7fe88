//! This module writes recordings for the Rerun viewer. No other module uses Rerun.
//!
//! One recording holds one run, under `runs/<name>`:
//!
//! | entity | what it shows |
//! |---|---|
//! | `world/particles`, `world/dye`, `world/directors` | the flow |
//! | `world/walls`, `world/gauges` | fixed lines |
//! | `world/fields/<field>/{image,bar,ticks,isolines}` | one field |
//! | `world/fields/<field>/values` | its values, on half as many samples per side |
//! | the path of each scalar, and `<path>/log10` | the plots |
//! | `scene`, `plan`, `log` | input, solved effects, warnings |
//!
//! Timelines are `sim_time`, `step` and `wall_time`. Positions are in metres with y up. The viewer
//! draws y down, so a static transform mirrors `world`, and views have its parent as their origin.

mod bar;
mod blueprint;
mod decode;
mod mend;
mod race;
mod read;
mod side_by_side;
mod sinks;
mod stage;
mod viewer;

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use rerun::archetypes;
use rerun::components::{Color, MagnificationFilter, Radius};
use rerun::{EntityPath, EntityPathPart, RecordingStream};

pub use mend::{Kept, RepairError, Resumed, repair};
pub use race::Race;
pub use read::{ReadError, Recorded, Sample};
pub use side_by_side::{Difference, RecordedRun, SideBySide};
pub use sinks::{Saved, Sink};
pub use stage::Lane;
pub use viewer::{ViewerFile, viewer_file};

use crate::frame::{
    Frame, GridField, Isoline, ParticleSnapshot, Picture, Quantity, Rect, RunInfo, Scalar,
};
use crate::record::color::{ColorScale, OKABE_ITO};
use crate::record::number::short;
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
const GAUGE: [u8; 3] = [213, 94, 0];
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

/// Entity paths of one run.
struct Paths {
    root: EntityPath,
}

impl Paths {
    fn new(name: &str) -> Self {
        Self::below(RUNS, name)
    }

    fn below(folder: &str, name: &str) -> Self {
        let parts = [folder, name].map(|part| EntityPathPart::new(part.to_owned()));
        Self { root: EntityPath::new(parts.to_vec()) }
    }

    /// The entity at a path below the run; parts are separated by slashes.
    fn at(&self, path: &str) -> EntityPath {
        let parts = path.split('/').filter(|part| !part.is_empty());
        let parts = parts.map(|part| EntityPathPart::new(part.to_owned()));
        self.root.join(&EntityPath::new(parts.collect()))
    }

    fn field(&self, name: &str) -> EntityPath {
        let part = EntityPathPart::new(name.to_owned());
        self.at("world/fields").join(&EntityPath::new(vec![part]))
    }

    fn curve(&self, path: &str, log10: bool) -> EntityPath {
        if log10 { self.at(&format!("{path}/log10")) } else { self.at(path) }
    }
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
    notices: Vec<String>,
    checked: Instant,
    /// Class numbers as last recorded; they are recorded again only when they change.
    classes: Vec<u16>,
    /// Whether the particles were last coloured by a scalar.
    colored: bool,
    /// Colour scales as last recorded, by the entity of the field.
    scales: HashMap<EntityPath, ColorScale>,
    /// Entities of the isolines drawn last; they are cleared when they are no longer drawn.
    isolines: HashSet<EntityPath>,
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
            notices: Vec::new(),
            checked: Instant::now(),
            classes: Vec::new(),
            colored: false,
            scales: HashMap::new(),
            isolines: HashSet::new(),
            pictures: 0,
        }
    }

    /// Address to open in a browser, or in a viewer if only the data is streamed.
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

        if let Some(picture) = &frame.picture {
            self.picture(picture)?;
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

    /// Records walls, gauges, legends, and the transform that makes y point up.
    fn world(&mut self, info: &RunInfo) -> Result<(), RecordError> {
        let world = self.paths.at("world");
        self.rec
            .log_static(world.clone(), &archetypes::Transform3D::from_scale([1.0, -1.0, 1.0]))?;
        let classes = info.materials.iter().enumerate().map(|(i, material)| {
            let id = u16::try_from(i).unwrap_or(u16::MAX);
            (id, material.name.as_str(), rgb8(material.rgb))
        });
        self.rec.log_static(
            world,
            &archetypes::AnnotationContext::new(classes.map(rerun::ClassDescription::from)),
        )?;
        self.rec.log_static(
            self.paths.at("world/particles"),
            &archetypes::Points2D::update_fields()
                .with_radii([Radius::new_scene_units(info.particle_radius)])
                .with_show_labels(false)
                .with_draw_order(depth::PARTICLES),
        )?;
        let walls = info.walls.iter();
        self.rec.log_static(
            self.paths.at("world/walls"),
            &archetypes::LineStrips2D::new(walls.clone().map(|wall| wall.points.as_slice()))
                .with_labels(walls.map(|wall| wall.name.as_str()))
                .with_show_labels(false)
                .with_colors([rgb(WALL)])
                .with_radii([Radius::new_ui_points(2.5)])
                .with_draw_order(depth::WALLS),
        )?;
        if !info.gauges.is_empty() {
            let gauges = info.gauges.iter();
            self.rec.log_static(
                self.paths.at("world/gauges"),
                &archetypes::LineStrips2D::new(gauges.clone().map(|gauge| gauge.points.as_slice()))
                    .with_colors([rgb(GAUGE)])
                    .with_radii([Radius::new_ui_points(1.5)])
                    .with_draw_order(depth::GAUGES),
            )?;
            let named = gauges.map(|gauge| (middle(&gauge.points), gauge.name.as_str()));
            self.names("world/gauges/names", named)?;
        }
        // A single material needs no legend; with a particle quantity, a colour bar is in its
        // place.
        let materials: Vec<_> = info.materials.iter().filter(|material| material.drawn).collect();
        if info.particle_quantity.is_none() && materials.len() > 1 {
            let row = bar::row(info.domain, materials.len());
            let materials = materials.into_iter();
            self.rec.log_static(
                self.paths.at("world/materials"),
                &archetypes::Points2D::new(row.clone())
                    .with_colors(materials.clone().map(|material| rgb(material.rgb)))
                    .with_radii([Radius::new_ui_points(7.0)])
                    .with_draw_order(depth::LEGEND),
            )?;
            let named = row.zip(materials.map(|material| material.name.as_str()));
            self.names("world/materials/names", named)?;
        }
        Ok(())
    }

    /// Writes names below points. They are separate entities because a label takes the colour of
    /// the labelled point, which may be hard to read.
    fn names<'a>(
        &self,
        path: &str,
        named: impl Iterator<Item = ([f32; 2], &'a str)>,
    ) -> Result<(), RecordError> {
        let (points, names): (Vec<_>, Vec<_>) = named.unzip();
        self.rec.log_static(
            self.paths.at(path),
            &archetypes::Points2D::new(points)
                .with_labels(names)
                .with_show_labels(true)
                .with_colors([rgb(INK)])
                .with_radii([Radius::new_ui_points(0.0)])
                .with_draw_order(depth::LEGEND),
        )?;
        Ok(())
    }

    fn texts(&self, info: &RunInfo) -> Result<(), RecordError> {
        // The fence must be longer than any fence inside the text.
        let mut fence = "```".to_owned();
        while info.scene_toml.contains(&fence) {
            fence.push('`');
        }
        let scene = format!("{fence}toml\n{}\n{fence}\n", info.scene_toml.trim_end());
        for (path, text) in [("scene", scene), ("plan", info.plan_markdown.clone())] {
            self.rec
                .log_static(self.paths.at(path), &archetypes::TextDocument::from_markdown(text))?;
        }
        Ok(())
    }

    /// Records the names and colours of the curves.
    fn curves(&self, info: &RunInfo) -> Result<(), RecordError> {
        for plot in &info.plots {
            for (series, color) in plot.series.iter().zip(OKABE_ITO.iter().cycle()) {
                let name =
                    if plot.log10 { format!("log10 {}", series.name) } else { series.name.clone() };
                self.rec.log_static(
                    self.paths.curve(&series.path, plot.log10),
                    &archetypes::SeriesLines::new()
                        .with_names([name])
                        .with_colors([rgb(on_dark(*color))])
                        .with_widths([1.75]),
                )?;
            }
        }
        Ok(())
    }

    /// Gives all curves of a run one colour, and `name` if given: the plot contains several runs.
    fn one_color(
        &self,
        info: &RunInfo,
        name: Option<&str>,
        color: [u8; 3],
    ) -> Result<(), RecordError> {
        let mut style = archetypes::SeriesLines::update_fields()
            .with_colors([rgb(on_dark(color))])
            .with_widths([1.75]);
        if let Some(name) = name {
            style = style.with_names([name]);
        }
        for plot in &info.plots {
            for series in &plot.series {
                self.rec.log_static(self.paths.curve(&series.path, plot.log10), &style)?;
            }
        }
        Ok(())
    }

    fn scalar(&self, scalar: &Scalar) -> Result<(), RecordError> {
        self.rec.log(self.paths.at(&scalar.path), &archetypes::Scalars::single(scalar.value))?;
        if self.logarithms.contains(&scalar.path) {
            let exponent = scalar.value.abs().log10();
            if exponent.is_finite() {
                self.rec.log(
                    self.paths.curve(&scalar.path, true),
                    &archetypes::Scalars::single(exponent),
                )?;
            }
        }
        Ok(())
    }

    fn picture(&mut self, picture: &Picture) -> Result<(), RecordError> {
        self.particles(&picture.particles)?;
        self.rec.log(
            self.paths.at("world/dye"),
            &archetypes::LineStrips2D::new(picture.dye_lines.iter().map(Vec::as_slice))
                .with_colors([rgb(DYE)])
                .with_radii([Radius::new_ui_points(1.0)])
                .with_draw_order(depth::DYE),
        )?;
        self.rec.log(
            self.paths.at("world/directors"),
            &archetypes::LineStrips2D::new(picture.glyphs.iter().map(<[_; 2]>::as_slice))
                .with_colors([rgb(GLYPH)])
                .with_radii([Radius::new_ui_points(1.2)])
                .with_draw_order(depth::GLYPHS),
        )?;
        for field in &picture.fields {
            self.field(field)?;
            self.values(field)?;
        }
        if let Some(arrows) = &picture.arrows {
            expect_length("arrows", arrows.vectors.len(), arrows.origins.len())?;
            self.rec.log(
                self.paths.field(&arrows.field).join(&"arrows".into()),
                &archetypes::Arrows2D::from_vectors(arrows.vectors.iter().copied())
                    .with_origins(arrows.origins.iter().copied())
                    .with_colors([rgb(ARROW)])
                    .with_radii([Radius::new_ui_points(0.8)])
                    .with_draw_order(depth::GLYPHS),
            )?;
        }
        self.lines(&picture.isolines)
    }

    fn particles(&mut self, particles: &ParticleSnapshot) -> Result<(), RecordError> {
        let path = self.paths.at("world/particles");
        let count = particles.positions.len();
        expect_length("particle classes", particles.class.len(), count)?;
        let mut points = archetypes::Points2D::update_fields()
            .with_positions(particles.positions.iter().copied());
        if self.classes != particles.class {
            self.classes.clone_from(&particles.class);
            points = points.with_class_ids(particles.class.iter().copied());
        }
        if let Some(scalar) = &particles.scalar {
            expect_length("particle values", scalar.values.len(), count)?;
            let signed = self.particle_quantity.as_ref().is_some_and(|q| q.signed);
            let scale = ColorScale::new(scalar.range, signed);
            points = points.with_colors(scalar.values.iter().map(|&value| {
                let [r, g, b, a] = scale.color(value);
                Color::from_unmultiplied_rgba(r, g, b, a)
            }));
            self.scale_bar(&self.paths.at("world/scale"), scale)?;
            self.colored = true;
        } else if self.colored {
            points = points.with_colors(std::iter::empty::<Color>());
            self.colored = false;
        }
        self.rec.log(path, &points)?;
        Ok(())
    }

    fn field(&mut self, field: &GridField) -> Result<(), RecordError> {
        expect_length(&format!("field {}", field.name), field.values.len(), field.nx * field.ny)?;
        let signed = self.quantities.get(&field.name).is_some_and(|quantity| quantity.signed);
        let scale = ColorScale::new(field.range, signed);
        let path = self.paths.field(&field.name);
        let [x, y] = field.origin;
        let [dx, dy] = field.cell;
        self.rec.log(
            path.join(&"image".into()),
            &[
                &archetypes::Transform3D::from_translation_scale([x, y, 0.0], [dx, dy, 1.0])
                    as &dyn rerun::AsComponents,
                &archetypes::Image::from_rgba32(
                    scale.image(&field.values),
                    [length(field.nx), length(field.ny)],
                )
                .with_magnification_filter(MagnificationFilter::Linear)
                .with_draw_order(depth::FIELD),
            ],
        )?;
        self.scale_bar(&path, scale)
    }

    /// Records the values of a field, which its colours do not give exactly. No view shows them.
    fn values(&self, field: &GridField) -> Result<(), RecordError> {
        let coarse = field.on(field.rect(), field.nx.div_ceil(2), field.ny.div_ceil(2));
        let shape = vec![coarse.ny as u64, coarse.nx as u64];
        let buffer = rerun::datatypes::TensorBuffer::F32(coarse.values.into());
        let tensor = rerun::datatypes::TensorData::new(shape, buffer).with_dim_names(["y", "x"]);
        self.rec.log(
            self.paths.field(&field.name).join(&"values".into()),
            &archetypes::Tensor::new(tensor),
        )?;
        Ok(())
    }

    /// Draws a colour bar with numbers; it is drawn again when its ends change.
    fn scale_bar(&mut self, path: &EntityPath, scale: ColorScale) -> Result<(), RecordError> {
        let last = self.scales.insert(path.clone(), scale);
        if last == Some(scale) {
            return Ok(());
        }
        let place = bar::place(self.domain);
        let [width, height] = place.size();
        let [low, high] = scale.ends();
        if last.is_none() {
            const STEPS: u32 = 128;
            let ramp = (0..STEPS).map(|i| i as f32 / (STEPS - 1) as f32);
            let ramp: Vec<f32> = ramp.collect();
            let colors = if scale.is_signed() {
                ColorScale::new([-1.0, 1.0], true)
                    .image(&ramp.iter().map(|x| 2.0 * x - 1.0).collect::<Vec<_>>())
            } else {
                ColorScale::new([0.0, 1.0], false).image(&ramp)
            };
            self.rec.log_static(
                path.join(&"bar".into()),
                &[
                    &archetypes::Transform3D::from_translation_scale(
                        [place.min[0], place.min[1], 0.0],
                        [width / STEPS as f32, height, 1.0],
                    ) as &dyn rerun::AsComponents,
                    &archetypes::Image::from_rgba32(colors, [STEPS, 1])
                        .with_draw_order(depth::LEGEND),
                ],
            )?;
        }
        let middle = 0.5 * (low + high);
        let at = |share: f32| [place.min[0] + share * width, place.min[1]];
        self.rec.log(
            path.join(&"ticks".into()),
            &archetypes::Points2D::new([at(0.0), at(0.5), at(1.0)])
                .with_labels([low, middle, high].map(|value| short(f64::from(value))))
                .with_show_labels(true)
                .with_colors([rgb(INK)])
                .with_radii([Radius::new_ui_points(2.0)])
                .with_draw_order(depth::LEGEND),
        )?;
        Ok(())
    }

    fn lines(&mut self, isolines: &[Isoline]) -> Result<(), RecordError> {
        let mut groups: HashMap<EntityPath, Vec<&Isoline>> = HashMap::new();
        for line in isolines {
            let path = if self.quantities.contains_key(&line.field) {
                self.paths.field(&line.field).join(&"isolines".into())
            } else {
                let part = EntityPathPart::new(line.field.clone());
                self.paths.at("world/isolines").join(&EntityPath::new(vec![part]))
            };
            groups.entry(path).or_default().push(line);
        }
        for gone in self.isolines.iter().filter(|path| !groups.contains_key(path)) {
            self.rec.log(gone.clone(), &archetypes::Clear::flat())?;
        }
        for (path, lines) in &groups {
            let strips = lines.iter().flat_map(|line| {
                // One label per level, on its longest strip.
                let longest = (line.strips.iter().enumerate())
                    .max_by_key(|(_, strip)| strip.len())
                    .map(|(i, _)| i);
                line.strips.iter().enumerate().map(move |(i, strip)| {
                    let label = if Some(i) == longest {
                        short(f64::from(line.level))
                    } else {
                        String::new()
                    };
                    (strip.as_slice(), label)
                })
            });
            let (strips, labels): (Vec<_>, Vec<_>) = strips.unzip();
            self.rec.log(
                path.clone(),
                &archetypes::LineStrips2D::new(strips)
                    .with_labels(labels)
                    .with_show_labels(true)
                    .with_colors([rgb(LINE)])
                    .with_radii([Radius::new_ui_points(0.8)])
                    .with_draw_order(depth::ISOLINES),
            )?;
        }
        self.isolines = groups.into_keys().collect();
        Ok(())
    }
}

fn rgb([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgb(r, g, b)
}

fn rgb8([r, g, b]: [u8; 3]) -> rerun::Rgba32 {
    rerun::Rgba32::from_rgb(r, g, b)
}

/// The colour of a curve, lightened where its contrast in the dark theme of the viewer is too low.
fn on_dark(color: [u8; 3]) -> [u8; 3] {
    match color {
        [0, 0, 0] => [220, 220, 220],
        [0, 114, 178] => [64, 160, 224],
        other => other,
    }
}

/// The midpoint between the ends of a polyline.
fn middle(points: &[[f32; 2]]) -> [f32; 2] {
    match (points.first(), points.last()) {
        (Some(a), Some(b)) => [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])],
        _ => [0.0, 0.0],
    }
}

fn length(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

fn expect_length(what: &str, found: usize, expected: usize) -> Result<(), RecordError> {
    if found == expected {
        Ok(())
    } else {
        Err(RecordError::Length { what: what.to_owned(), found, expected })
    }
}
