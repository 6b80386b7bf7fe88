//! Runs a single case of a sweep.

use super::super::Failure;
use crate::record::folder::RunFolder;
use crate::scene::SceneSource;
use crate::session::{Interrupted, Options, Recording, Session, watch_interrupts};
use crate::sweep::{Case, Store};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// Runs one case in this process.
pub(super) fn one(store: &Store, name: &str, stop_with_input: bool) -> Result<(), Failure> {
    let (list, source) = store.read()?;
    let case = list.case(name)?;
    let interrupted = watch_interrupts(super::super::code::INTERRUPTED);
    if stop_with_input {
        watch_input(&interrupted)?;
    }
    let Some(attempt) = store.begin(&case.id)? else {
        return Ok(());
    };
    let outcome = solve(case, &source, attempt.folder(), list.spec.recordings, &interrupted);
    match outcome {
        Ok(()) => Ok(attempt.finish()?),
        Err(Failure::Interrupted) => {
            attempt.abandon();
            Err(Failure::Interrupted)
        }
        Err(failure) => {
            let cause = failure.describe().unwrap_or_else(|| "it failed".into());
            attempt.fail(&cause)?;
            Err(failure)
        }
    }
}

/// Runs a case into a folder.
pub(super) fn solve(
    case: &Case,
    source: &SceneSource,
    folder: &Path,
    recorded: bool,
    interrupted: &Interrupted,
) -> Result<(), Failure> {
    let plan = Arc::new(case.plan(source)?);
    super::super::memory::afford(&plan)?;
    let recording = if recorded { Recording::Folder } else { Recording::None };
    let options = Options { quiet: true, recording, ..Options::default() };
    let claim = || Ok::<_, Failure>(RunFolder::claim(folder)?);
    Session::start(&options, &plan, interrupted.clone(), claim)?.go_silently(|_| ())?;
    Ok(())
}

/// Treats the end of the standard input as an interrupt, so that no case outlives its sweep.
pub(super) fn watch_input(interrupted: &Interrupted) -> Result<(), Failure> {
    let flag = interrupted.clone();
    let watch = move || {
        // No data arrive; the copy returns at the end of the input or on a read error.
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        flag.store(true, Ordering::SeqCst);
    };
    match std::thread::Builder::new().name("input".into()).spawn(watch) {
        Ok(_) => Ok(()),
        Err(e) => Err(Failure::Environment(format!("a thread cannot be started: {e}"))),
    }
}
