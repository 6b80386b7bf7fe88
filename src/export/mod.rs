//! The pictures of a recording as files for other programs: VTK's (ParaView), and plain tables.
//!
//! A file for each frame with the particles, one with the fields, numbered alike.

mod tables;
mod vtu;

use crate::compare::{CompareError, Member};
use crate::frame::{GridField, ParticleSnapshot};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Times that differ by less, relative to the last, are those of one frame.
const SAME_TIME: f64 = 1e-9;

/// Why nothing was exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error(transparent)]
    Run(#[from] CompareError),
    #[error("{}: has no recording to export from; run the scene again without --no-recording", .0.display())]
    NoRecording(PathBuf),
    #[error("{}: its recording holds no pictures", .0.display())]
    NoPictures(PathBuf),
    #[error("cannot write {}: {source}", path.display())]
    Write { path: PathBuf, source: std::io::Error },
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.vtu` files and a `.pvd` series of them.
    Vtu,
    /// Comma-separated tables.
    Csv,
}

/// One instant.
#[derive(Clone, Debug, Default)]
pub struct Instant {
    pub time_s: f64,
    pub particles: Option<ParticleSnapshot>,
    /// All on the grid of the first.
    pub fields: Vec<GridField>,
}

/// All pictures of a run, in order.
#[derive(Clone, Debug, Default)]
pub struct Film {
    pub instants: Vec<Instant>,
    /// Names by the numbers that particles carry.
    pub materials: Vec<String>,
}

/// Reads the pictures of a run: its folder, or a recording.
pub fn read(run: &Path) -> Result<Film, ExportError> {
    let member = Member::open(run)?;
    let (Some(recorded), Some(info)) = (&member.recorded, &member.info) else {
        return Err(ExportError::NoRecording(run.to_owned()));
    };
    let mut film = Film {
        materials: info.materials.iter().map(|m| m.name.clone()).collect(),
        ..Film::default()
    };
    for (time, particles) in recorded.particles() {
        film.at(time).particles = Some(particles);
    }
    let fields: BTreeMap<_, _> = recorded.fields(info.domain);
    for (time, field) in fields.into_values().flatten() {
        let fields = &mut film.at(time).fields;
        let alike = match fields.first() {
            Some(first) => field.on(first.rect(), first.nx, first.ny),
            None => field,
        };
        fields.push(alike);
    }
    if film.instants.is_empty() {
        return Err(ExportError::NoPictures(run.to_owned()));
    }
    Ok(film)
}

/// Writes everything into a folder; how many files.
pub fn write(film: &Film, format: Format, folder: &Path) -> Result<usize, ExportError> {
    std::fs::create_dir_all(folder)
        .map_err(|source| ExportError::Write { path: folder.to_owned(), source })?;
    match format {
        Format::Vtu => vtu::write(film, folder),
        Format::Csv => tables::write(film, folder),
    }
}

fn write_file(path: PathBuf, text: impl AsRef<[u8]>) -> Result<(), ExportError> {
    std::fs::write(&path, text).map_err(|source| ExportError::Write { path, source })
}

impl Film {
    /// The instant of a time, made if it is not there.
    fn at(&mut self, time_s: f64) -> &mut Instant {
        let before = time_s - SAME_TIME * time_s.abs();
        let k = self.instants.partition_point(|i| i.time_s < before);
        let same = |i: &Instant| i.time_s <= time_s + SAME_TIME * time_s.abs();
        if !self.instants.get(k).is_some_and(same) {
            self.instants.insert(k, Instant { time_s, ..Instant::default() });
        }
        &mut self.instants[k]
    }
}
