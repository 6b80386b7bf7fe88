//! This module repairs incomplete recordings and continues recordings of earlier runs.
//!
//! A file whose writer was killed has no end and may stop in the middle of a message. The data
//! before that is valid: [`repair`] copies it into a file that is closed properly, and
//! [`RerunLog::resume`] copies it, up to the step of a checkpoint, into the continued recording.
//! Both write under a temporary name and then rename, so that no recording is lost.

use std::collections::{BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use rerun::EntityPath;
use rerun::external::re_log_types::{StoreKind, TimelineName};
use rerun::log::LogMsg;
use rerun::sink::LogSink;

use super::decode::ReadError;
use super::decode::{chunk_of, messages};
use super::read::below_run;
use super::salvage::{Damage, has_sound_index, salvage};
use super::sinks::{Destinations, RrdFile, Saved, Sink};
use super::{RecordError, RerunLog, STEP};
use crate::frame::RunInfo;
use crate::record::replace::{Kind, beside, may_replace};

/// The valid part of a recording.
#[derive(Debug, Default)]
pub struct Kept {
    /// Number of messages.
    pub messages: usize,
    /// The last step; `None` if there is none.
    pub last_step: Option<u64>,
    /// Steps of which a picture is kept.
    pub pictures: BTreeSet<u64>,
    /// Steps of which a value of a curve is kept.
    pub rows: BTreeSet<u64>,
    /// Reason why the end is missing; `None` if the recording is complete.
    pub cut: Option<String>,
    /// Whether the scene, and so all constant data, is present.
    has_scene: bool,
    /// Entities of isolines, which are cleared when they are no longer drawn.
    isolines: HashSet<EntityPath>,
}

/// A recording that is continued.
pub struct Resumed {
    /// The recording, open for further frames.
    pub log: RerunLog,
    /// The last earlier step; `None` if the earlier part is lost or was never recorded.
    pub last_step: Option<u64>,
    /// Message for the user about the earlier part.
    pub notice: Option<String>,
}

/// Passes the messages of a recording to `each`, up to step `until` or all of them.
fn keep(path: &Path, until: Option<u64>, mut each: impl FnMut(LogMsg)) -> Result<Kept, ReadError> {
    let (messages, cut) = messages(path)?;
    let mut kept = Kept { cut, ..Kept::default() };
    for message in messages {
        match message.and_then(|m| kept.take(m, until)) {
            Ok(Some(message)) => {
                kept.messages += 1;
                each(message);
            }
            Ok(None) => {}
            Err(cause) => {
                kept.cut = Some(cause);
                break;
            }
        }
    }
    if kept.messages == 0 {
        let cause = kept.cut.unwrap_or_else(|| "it is empty".to_owned());
        return Err(ReadError::Unreadable { path: path.to_owned(), cause });
    }
    Ok(kept)
}

impl Kept {
    /// The part of a message up to step `until`; `None` if nothing is left.
    fn take(&mut self, message: LogMsg, until: Option<u64>) -> Result<Option<LogMsg>, String> {
        let (store, arrow) = match message {
            LogMsg::ArrowMsg(store, arrow) if store.kind() == StoreKind::Recording => {
                (store, arrow)
            }
            other => return Ok(Some(other)),
        };
        let chunk = chunk_of(&arrow)?;
        let path = below_run(&chunk).map(|(_, path)| path).unwrap_or_default();
        self.has_scene |= path == ["scene"];
        if path.iter().any(|part| part == "isolines") {
            self.isolines.insert(chunk.entity_path().clone());
        }
        let Some(steps) = chunk.timelines().get(&TimelineName::from(STEP)) else {
            return Ok(Some(LogMsg::ArrowMsg(store, arrow)));
        };
        // Rows are in the order of their steps.
        let limit = until.map_or(i64::MAX, |step| i64::try_from(step).unwrap_or(i64::MAX));
        let good = steps.times_raw().iter().take_while(|&&step| step <= limit).count();
        let last = steps.times_raw().get(good.saturating_sub(1)).filter(|_| good > 0);
        let kept = steps.times_raw().iter().take(good).filter_map(|&s| u64::try_from(s).ok());
        match path.as_slice() {
            [world, particles] if world == "world" && particles == "particles" => {
                self.pictures.extend(kept);
            }
            [world, ..] if world == "world" => {}
            _ => self.rows.extend(kept),
        }
        self.last_step = self.last_step.max(last.and_then(|&step| u64::try_from(step).ok()));
        if good == chunk.num_rows() {
            return Ok(Some(LogMsg::ArrowMsg(store, arrow)));
        }
        if good == 0 {
            return Ok(None);
        }
        let part = chunk.row_sliced_deep(0, good);
        let arrow = part.to_arrow_msg().map_err(|e| e.to_string())?;
        Ok(Some(LogMsg::ArrowMsg(store, arrow)))
    }
}

/// Error of repairing a recording.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    /// The recording cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The repaired recording cannot be written.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// What a repair has done.
#[derive(Debug)]
pub struct Repaired {
    /// The part that is kept.
    pub kept: Kept,
    /// What was lost.
    pub damage: Damage,
    /// The repaired file; `None` if the recording was complete.
    pub saved: Option<Saved>,
    /// Place of the original, if something of it was lost.
    pub original: Option<PathBuf>,
}

/// Closes a recording whose end is missing, and removes damaged parts; the original of a damaged
/// recording is kept beside it. A complete recording is not changed.
pub fn repair(path: &Path) -> Result<Repaired, RepairError> {
    match keep(path, None, |_| {}) {
        Ok(kept) if kept.cut.is_none() && has_sound_index(path)? => {
            let damage = Damage::default();
            return Ok(Repaired { kept, damage, saved: None, original: None });
        }
        Err(e @ ReadError::Open { .. }) => return Err(e.into()),
        // Damaged files are read in another way.
        Ok(_) | Err(_) => {}
    }
    let part = beside(path, ".part");
    let mended = mend(path, &part);
    if mended.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    mended
}

/// Writes what can be read of a recording to `part`, and puts that in its place.
fn mend(path: &Path, part: &Path) -> Result<Repaired, RepairError> {
    let mut file = RrdFile::create(part)?;
    let mut kept = Kept::default();
    let damage = salvage(path, |message| {
        // A message whose data cannot be read is damaged.
        let Ok(message) = kept.take(message, None) else { return false };
        if let Some(message) = message {
            kept.messages += 1;
            file.send(message);
        }
        true
    })?;
    if kept.messages == 0 {
        let cause = "it holds nothing that can be read".to_owned();
        return Err(ReadError::Unreadable { path: path.to_owned(), cause }.into());
    }
    file.finish()?;
    file.settle(None)?;
    let original = (damage.places > 0).then(|| set_aside(path)).transpose()?;
    file.settle(Some(path))?;
    Ok(Repaired { kept, damage, saved: Some(file.finished()?), original })
}

/// Renames a damaged recording; returns its new path.
fn set_aside(path: &Path) -> Result<PathBuf, RecordError> {
    let names = (1..).map(|k| beside(path, &format!(".damaged-{k}")));
    let Some(place) = names.take(1000).find(|place| !place.exists()) else {
        let cause = "a thousand damaged originals are kept beside it".to_owned();
        return Err(RecordError::Write { path: path.to_owned(), cause });
    };
    std::fs::rename(path, &place)
        .map_err(|e| RecordError::Write { path: path.to_owned(), cause: e.to_string() })?;
    Ok(place)
}

impl RerunLog {
    /// Continues the recording in the first file of `sinks` after a step. Its data of later steps
    /// is removed. The data of earlier steps is also sent to all other destinations.
    pub fn resume(info: &RunInfo, sinks: &[Sink], step: u64) -> Result<Resumed, RecordError> {
        let path = sinks.iter().find_map(|sink| match sink {
            Sink::Save(path) => Some(path.clone()),
            _ => None,
        });
        // Only a regular file can be continued, not a pipe or a device.
        let path = path.filter(|p| p.metadata().map_or(true, |m| m.is_file()));
        let Some(path) = path else {
            let log = Self::open(info, sinks)?;
            let notice = Some(format!("the viewer shows the run from step {step} on"));
            return Ok(Resumed { log, last_step: None, notice });
        };
        // The path is part of the checkpoint, which may come from elsewhere.
        may_replace(&path, Kind::Recording)?;
        let part = beside(&path, ".part");
        let aside = |sink: &Sink| match sink {
            Sink::Save(_) => Sink::Save(part.clone()),
            other => other.clone(),
        };
        let mut to = Destinations::open(&sinks.iter().map(aside).collect::<Vec<_>>())?;
        let rec = to.begin(&info.recording_id)?;
        let past = keep(&path, Some(step), |message| {
            // The stream has already sent its own store information.
            if !matches!(&message, LogMsg::SetStoreInfo(s)
                if s.info.store_id.kind() == StoreKind::Recording)
            {
                rec.record_msg(message);
            }
        });
        let mut log = Self::of(rec, info);
        let mut last_step = None;
        let notice = match past {
            Ok(past) if past.has_scene => {
                log.isolines = past.isolines;
                last_step = past.last_step;
                let last = past.last_step.unwrap_or(0);
                (last + 1 < step).then(|| {
                    format!(
                        "{}: the steps {} to {} are missing",
                        path.display(),
                        last + 1,
                        step - 1
                    )
                })
            }
            // There is no recording to continue.
            Ok(_) | Err(ReadError::Unreadable { .. } | ReadError::Open { .. }) => {
                super::blueprint::send(&log.rec, info, &log.paths)?;
                log.rec.send_recording_name(info.name.as_str())?;
                log.constant(info)?;
                Some(format!(
                    "{}: cannot be continued; a new recording begins after step {step}",
                    path.display()
                ))
            }
            Err(e @ ReadError::NotOneRun { .. }) => Some(e.to_string()),
        };
        (log.files, log.viewers, log.page) = (to.files, to.viewers, to.page);
        log.check()?;
        for file in &mut log.files {
            file.settle(Some(&path))?;
        }
        Ok(Resumed { log, last_step, notice })
    }

    /// Flushes everything recorded so far to the disk.
    pub fn settle(&mut self) -> Result<(), RecordError> {
        self.check()?;
        self.files.iter_mut().try_for_each(|file| file.settle(None))
    }
}
