//! This module reads back the scene, the curves, the particles and the field values of a recorded
//! run.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use rerun::external::re_log_types::{StoreKind, TimelineName};
use rerun::log::{Chunk, LogMsg};
use rerun::{archetypes, components};

use super::decode::{ReadError, chunk_of, messages};
use super::{RUNS, SIM_TIME, WALL_TIME};
use crate::frame::{GridField, ParticleSnapshot, Rect};

/// One value of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Simulated time (s).
    pub time_s: f64,
    /// Computing time so far (s).
    pub wall_s: f64,
    /// Value, in the unit of the curve.
    pub value: f64,
}

/// A recording of one run that was read.
pub struct Recorded {
    /// Name of the run in the recording.
    pub run: String,
    /// Reason why the end is missing, if the file is cut.
    pub cut: Option<String>,
    /// All chunks of the recording.
    pub(super) chunks: Vec<Chunk>,
}

/// Name of the run of a chunk and the parts of its path below the run; `None` for other chunks.
pub(super) fn below_run(chunk: &Chunk) -> Option<(String, Vec<String>)> {
    let mut parts = chunk.entity_path().iter().map(|part| part.unescaped_str().to_owned());
    (parts.next()? == RUNS).then_some(())?;
    Some((parts.next()?, parts.collect()))
}

impl Recorded {
    /// Reads a file. Of a cut file, it reads everything before the cut.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let unreadable = |cause: String| ReadError::Unreadable { path: path.to_owned(), cause };
        let (messages, mut cut) = messages(path)?;
        let mut chunks = Vec::new();
        for message in messages {
            let chunk = match message {
                Ok(LogMsg::ArrowMsg(store, message)) if store.kind() == StoreKind::Recording => {
                    chunk_of(&message)
                }
                Ok(_) => continue,
                Err(e) => Err(e),
            };
            match chunk {
                Ok(chunk) => chunks.push(chunk),
                Err(cause) => {
                    cut = Some(cause);
                    break;
                }
            }
        }
        let runs: BTreeSet<String> = chunks.iter().filter_map(|c| Some(below_run(c)?.0)).collect();
        let mut names = runs.into_iter();
        match (names.next(), names.count()) {
            (Some(run), 0) => Ok(Self { run, cut, chunks }),
            (Some(_), more) => Err(ReadError::NotOneRun {
                path: path.to_owned(),
                found: format!("{} runs side by side", more + 1),
            }),
            (None, _) => match cut {
                Some(cause) => Err(unreadable(cause)),
                None if chunks.is_empty() => Err(unreadable("it is empty".to_owned())),
                None => Err(ReadError::NotOneRun {
                    path: path.to_owned(),
                    found: "no run of grainscope".to_owned(),
                }),
            },
        }
    }

    /// Chunks of the run, with their paths below the run.
    pub(super) fn of_run(&self) -> impl Iterator<Item = (&Chunk, Vec<String>)> {
        self.chunks.iter().filter_map(|chunk| Some((chunk, below_run(chunk)?.1)))
    }

    /// The resolved scene, as TOML; `None` if it is missing.
    pub fn scene_toml(&self) -> Option<String> {
        let component = archetypes::TextDocument::descriptor_text().component;
        self.of_run().filter(|(_, path)| *path == ["scene"]).find_map(|(chunk, _)| {
            let text = chunk.iter_slices::<String>(component).next()?.first()?.to_string();
            // The recording contains the scene inside a Markdown fence.
            let fence = text.chars().take_while(|&c| c == '`').collect::<String>();
            let inside = text.strip_prefix(fence.as_str())?.split_once('\n')?.1;
            Some(inside.trim_end().strip_suffix(fence.as_str())?.to_owned())
        })
    }

    /// All curves by the path of their scalar, without the logarithms. Samples are ordered by time.
    pub fn curves(&self) -> BTreeMap<String, Vec<Sample>> {
        let component = archetypes::Scalars::descriptor_scalars().component;
        let mut curves: BTreeMap<String, Vec<Sample>> = BTreeMap::new();
        for (chunk, path) in self.of_run().filter(|(chunk, _)| !chunk.is_static()) {
            if path.last().is_some_and(|part| part == "log10") {
                continue;
            }
            let times = seconds(chunk, SIM_TIME, component);
            let walls = seconds(chunk, WALL_TIME, component);
            let values = chunk.iter_slices::<f64>(component).filter_map(|v| v.first().copied());
            let samples: Vec<Sample> = times
                .into_iter()
                .zip(walls)
                .zip(values)
                .map(|((time_s, wall_s), value)| Sample { time_s, wall_s, value })
                .collect();
            if !samples.is_empty() {
                curves.entry(path.join("/")).or_default().extend(samples);
            }
        }
        for samples in curves.values_mut() {
            samples.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        }
        curves
    }

    /// The particles of each snapshot, with its time (s), in order.
    pub fn particles(&self) -> Vec<(f64, ParticleSnapshot)> {
        let positions = archetypes::Points2D::descriptor_positions().component;
        let radii = archetypes::Points2D::descriptor_radii().component;
        let classes = archetypes::Points2D::descriptor_class_ids().component;
        let mut pictures: Vec<(f64, Vec<[f32; 2]>)> = vec![];
        // These are recorded only when they change.
        let mut sizes: Changes<f32> = Changes::default();
        let mut materials: Changes<u16> = Changes::default();
        for (chunk, _) in self.of_run().filter(|(_, path)| *path == ["world", "particles"]) {
            let times = seconds(chunk, SIM_TIME, positions);
            let points = chunk.iter_slices::<[f32; 2]>(positions).map(<[_]>::to_vec);
            pictures.extend(times.into_iter().zip(points));
            sizes.add(seconds(chunk, SIM_TIME, radii), chunk.iter_slices::<f32>(radii));
            materials.add(seconds(chunk, SIM_TIME, classes), chunk.iter_slices::<u16>(classes));
        }
        pictures.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (sizes, materials) = (sizes.sorted(), materials.sorted());
        let snapshot = |(time, positions): (f64, Vec<[f32; 2]>)| {
            let mut class = materials.at(time).to_vec();
            class.resize(positions.len(), 0);
            let radii = sizes.at(time);
            let radii = if radii.len() == positions.len() { radii.to_vec() } else { vec![] };
            (time, ParticleSnapshot { positions, class, radii, scalar: None })
        };
        pictures.into_iter().map(snapshot).collect()
    }

    /// The dye lines of each snapshot, with its time (s), in order.
    pub fn dye_lines(&self) -> Vec<(f64, Vec<Vec<[f32; 2]>>)> {
        self.strips("dye")
    }

    /// The outlines of the solids that move in each snapshot, with its time (s), in order.
    pub fn moving(&self) -> Vec<(f64, Vec<Vec<[f32; 2]>>)> {
        self.strips("moving")
    }

    /// The director strokes of each snapshot, each given by its two end points, with its time (s),
    /// in order.
    pub fn glyphs(&self) -> Vec<(f64, Vec<[[f32; 2]; 2]>)> {
        let ends = |strip: Vec<[f32; 2]>| <[[f32; 2]; 2]>::try_from(strip).ok();
        let of = |(time, strips): (f64, Vec<_>)| (time, strips.into_iter().filter_map(ends));
        self.strips("directors").into_iter().map(of).map(|(t, s)| (t, s.collect())).collect()
    }

    /// Polylines of an entity of the flow.
    fn strips(&self, name: &str) -> Vec<(f64, Vec<Vec<[f32; 2]>>)> {
        let component = archetypes::LineStrips2D::descriptor_strips().component;
        let mut pictures = vec![];
        for (chunk, _) in self.of_run().filter(|(_, path)| *path == ["world", name]) {
            let times = seconds(chunk, SIM_TIME, component);
            let strips = chunk.iter_component::<components::LineStrip2D>(component).map(|batch| {
                let points = |s: &components::LineStrip2D| s.0.iter().map(|p| p.0).collect();
                batch.as_slice().iter().map(points).collect()
            });
            pictures.extend(times.into_iter().zip(strips));
        }
        pictures.sort_by(|a: &(f64, Vec<_>), b| a.0.total_cmp(&b.0));
        pictures
    }

    /// The snapshots of each field on `domain`, with their time (s), in order.
    pub fn fields(&self, domain: Rect) -> BTreeMap<String, Vec<(f64, GridField)>> {
        let component = archetypes::Tensor::descriptor_data().component;
        let mut fields: BTreeMap<String, Vec<(f64, GridField)>> = BTreeMap::new();
        for (chunk, path) in self.of_run() {
            let [world, folder, name, last] = path.as_slice() else { continue };
            if (world.as_str(), folder.as_str(), last.as_str()) != ("world", "fields", "values") {
                continue;
            }
            let times = seconds(chunk, SIM_TIME, component);
            for (time, batch) in
                times.into_iter().zip(chunk.iter_component::<components::TensorData>(component))
            {
                let field = batch.as_slice().first().and_then(|t| field(name, domain, &t.0));
                if let Some(field) = field {
                    fields.entry(name.clone()).or_default().push((time, field));
                }
            }
        }
        for pictures in fields.values_mut() {
            pictures.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        fields
    }
}

/// Lists of values that hold from a time (s) on.
struct Changes<T>(Vec<(f64, Vec<T>)>);

impl<T> Default for Changes<T> {
    fn default() -> Self {
        Self(vec![])
    }
}

impl<T: Copy> Changes<T> {
    fn add<'a>(&mut self, times: Vec<f64>, lists: impl Iterator<Item = &'a [T]>)
    where
        T: 'a,
    {
        self.0.extend(times.into_iter().zip(lists.map(<[_]>::to_vec)));
    }

    fn sorted(mut self) -> Self {
        self.0.sort_by(|a, b| a.0.total_cmp(&b.0));
        self
    }

    /// The list that holds at a time; empty before the first one.
    fn at(&self, time: f64) -> &[T] {
        let last = self.0.partition_point(|c| c.0 <= time).checked_sub(1);
        last.map_or(&[], |k| &self.0[k].1)
    }
}

/// Times of the rows that hold a component, on one timeline (s).
pub(super) fn seconds(
    chunk: &Chunk,
    timeline: &'static str,
    component: rerun::ComponentIdentifier,
) -> Vec<f64> {
    chunk
        .iter_component_indices(TimelineName::from(timeline), component)
        .map(|(time, _)| time.as_i64() as f64 * 1e-9)
        .collect()
}

fn field(name: &str, domain: Rect, tensor: &rerun::datatypes::TensorData) -> Option<GridField> {
    let rerun::datatypes::TensorBuffer::F32(values) = &tensor.buffer else { return None };
    let [ny, nx] = *tensor.shape.as_ref() else { return None };
    let (nx, ny) = (usize::try_from(nx).ok()?, usize::try_from(ny).ok()?);
    let size = domain.size();
    (nx * ny > 0 && values.len() == nx * ny).then(|| GridField {
        name: name.to_owned(),
        origin: domain.min,
        cell: [size[0] / nx as f32, size[1] / ny as f32],
        nx,
        ny,
        values: values.to_vec(),
        range: [0.0, 1.0],
    })
}
