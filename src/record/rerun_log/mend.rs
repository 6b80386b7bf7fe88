//! Recordings taken up again: what a run left, cut or whole, up to a step.
//!
//! A file whose writer was killed lacks its end, and may end in the middle of a message. What
//! precedes that is good: [`repair`] copies it into a file that is closed in order, and
//! [`RerunLog::resume`] copies it, up to the step of a checkpoint, into the recording that goes on.
//! Either is written beside its place and renamed, so that no recording is ever lost on the way.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use rerun::EntityPath;
use rerun::external::re_log_types::{StoreKind, TimelineName};
use rerun::log::LogMsg;
use rerun::sink::LogSink;

use super::decode::{chunk_of, messages};
use super::read::{ReadError, below_run};
use super::sinks::{Destinations, RrdFile, Saved, Sink};
use super::{RecordError, RerunLog, STEP};
use crate::frame::RunInfo;

/// What was kept of a recording.
#[derive(Debug, Default)]
pub struct Kept {
    /// Messages of it.
    pub messages: usize,
    /// The last step.
    pub last_step: Option<u64>,
    /// Why the end was missing.
    pub cut: Option<String>,
    /// The scene is there, and so is all else that does not change.
    has_scene: bool,
    /// Entities of isolines, to be wiped if they are drawn no more.
    isolines: HashSet<EntityPath>,
}

/// A recording that goes on.
pub struct Resumed {
    pub log: RerunLog,
    /// The last step of its past; `None` if that is lost, or was never recorded.
    pub last_step: Option<u64>,
    /// What there is to be told about its past.
    pub notice: Option<String>,
}

/// Hands on the messages of a recording up to a step, or all of them.
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
    /// A message without what came after a step; `None` if nothing is left.
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
        // Rows come in the order of their steps.
        let limit = until.map_or(i64::MAX, |step| i64::try_from(step).unwrap_or(i64::MAX));
        let good = steps.times_raw().iter().take_while(|&&step| step <= limit).count();
        let last = steps.times_raw().get(good.saturating_sub(1)).filter(|_| good > 0);
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

/// The place beside a recording where its successor is written.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

/// Why a recording was not repaired.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// Closes a recording whose end is missing, in order; one that is whole stays as it is.
pub fn repair(path: &Path) -> Result<(Kept, Option<Saved>), RepairError> {
    let kept = keep(path, None, |_| {})?;
    if kept.cut.is_none() {
        return Ok((kept, None));
    }
    let part = beside(path);
    let mut file = RrdFile::create(&part)?;
    let copied = keep(path, None, |message| file.send(message))?;
    let saved = file.finish().and_then(|_| file.settle(Some(path)));
    if saved.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    saved?;
    let saved = file.finished()?;
    Ok((copied, Some(saved)))
}

impl RerunLog {
    /// Goes on with the recording in the first file of `sinks` after a step: what it holds of later
    /// steps is dropped, and all other destinations are sent what it holds of earlier ones.
    pub fn resume(info: &RunInfo, sinks: &[Sink], step: u64) -> Result<Resumed, RecordError> {
        let path = sinks.iter().find_map(|sink| match sink {
            Sink::Save(path) => Some(path.clone()),
            _ => None,
        });
        // Only a file can be taken up again, not a pipe or a device.
        let path = path.filter(|p| p.metadata().map_or(true, |m| m.is_file()));
        let Some(path) = path else {
            let log = Self::open(info, sinks)?;
            let notice = Some(format!("what is watched begins at step {step}"));
            return Ok(Resumed { log, last_step: None, notice });
        };
        let part = beside(&path);
        let aside = |sink: &Sink| match sink {
            Sink::Save(_) => Sink::Save(part.clone()),
            other => other.clone(),
        };
        let mut to = Destinations::open(&sinks.iter().map(aside).collect::<Vec<_>>())?;
        let rec = to.begin(&info.recording_id)?;
        let past = keep(&path, Some(step), |message| {
            // The stream has introduced itself already.
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
                    format!("{}: lacks the steps {} to {}", path.display(), last + 1, step - 1)
                })
            }
            // There is nothing to go on with.
            Ok(_) | Err(ReadError::Unreadable { .. } | ReadError::Open { .. }) => {
                super::blueprint::send(&log.rec, info, &log.paths)?;
                log.rec.send_recording_name(info.name.as_str())?;
                log.constant(info)?;
                Some(format!("{}: is gone; a new one begins after step {step}", path.display()))
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

    /// Brings everything recorded so far to the disk.
    pub fn settle(&mut self) -> Result<(), RecordError> {
        self.check()?;
        self.files.iter_mut().try_for_each(|file| file.settle(None))
    }
}
