//! This module locks a folder against other processes.

use super::FolderError;
use std::fs::{self, File, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

/// Name of the lock file, which exists while a process writes into the folder.
pub const LOCK: &str = ".grainscope.lock";

/// A lock of the operating system, which ends with the process.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    file: Option<File>,
}

impl Lock {
    /// Locks a folder.
    ///
    /// # Errors
    /// Another process has locked it, or it cannot be written.
    pub fn take(folder: &Path) -> Result<Lock, FolderError> {
        let path = folder.join(LOCK);
        let fault = |source| FolderError::Write { path: folder.to_path_buf(), source };
        loop {
            let file =
                File::options().read(true).write(true).create(true).truncate(false).open(&path);
            let mut file = file.map_err(fault)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let mut holder = String::new();
                    let _ = file.read_to_string(&mut holder);
                    if holder.trim().is_empty() {
                        holder = "another process".into();
                    }
                    return Err(FolderError::Busy {
                        path: folder.to_owned(),
                        holder: holder.trim().into(),
                    });
                }
                // A file system without locks: nothing protects the folder.
                Err(TryLockError::Error(e)) => {
                    eprintln!("warning: {} cannot be locked: {e}", path.display());
                }
            }
            if !is_at(&file, &path) {
                // Its last holder has just removed it.
                continue;
            }
            let command: Vec<String> = std::env::args().skip(1).take(3).collect();
            let holder =
                format!("process {} (grainscope {})\n", std::process::id(), command.join(" "));
            file.set_len(0)
                .and_then(|()| file.rewind())
                .and_then(|()| file.write_all(holder.as_bytes()))
                .map_err(fault)?;
            return Ok(Lock { path, file: Some(file) });
        }
    }

    /// Ends the lock.
    pub fn release(&mut self) {
        if self.file.is_some() {
            let _ = fs::remove_file(&self.path);
        }
        self.file = None;
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        self.release();
    }
}

/// Whether an open file is still the one at a path.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |m: fs::Metadata| (m.dev(), m.ino());
    let [open, there] = [file.metadata(), fs::metadata(path)].map(|m| m.ok().map(place));
    open.is_some() && open == there
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}
