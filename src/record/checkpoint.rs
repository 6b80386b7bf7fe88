//! This module writes and reads checkpoints: files with the complete state of a run. A damaged file
//! is rejected.
//!
//! ```text
//! "grainscope state"   16 bytes
//! version of the format                    u32
//! SHA-256 of the scene, hexadecimal        64 bytes
//! number of columns                        u32
//! each: kind u8, length of the name u16, name, number of values u64, values
//! SHA-256 of everything above              32 bytes
//! ```
//! Numbers are little-endian; floats are stored bit for bit. A file is written under a temporary
//! name, flushed to the disk and then renamed, so an incomplete checkpoint never appears under its
//! final name. The last [`KEPT`] checkpoints are kept.

use super::replace::ReplaceError;
use crate::sim::state::{Column, State};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Version of the format. New columns do not need a new version.
pub const FORMAT: u32 = 1;

/// Number of checkpoints that are kept.
pub const KEPT: usize = 2;

/// Name of the checkpoint folder inside the folder of a run.
pub const FOLDER: &str = "checkpoints";

const MAGIC: &[u8; 16] = b"grainscope state";
const SCENE_HASH: usize = 64;
const CHECKSUM: usize = 32;
const PREFIX: &str = "step-";
const SUFFIX: &str = ".state";

/// Error of writing or reading a checkpoint.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// Path of the checkpoint.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// Path of the checkpoint.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content is not a valid checkpoint of the scene.
    #[error("{}: {source}", path.display())]
    Refused {
        /// Path of the checkpoint.
        path: PathBuf,
        /// Reason of the rejection.
        source: Refusal,
    },
}

/// Reason for which the content of a checkpoint is rejected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// The file is not a checkpoint.
    #[error("is not a checkpoint of grainscope")]
    Foreign,
    /// The checksum does not match the content.
    #[error("is damaged: its checksum does not match its content; it was truncated or changed")]
    Damaged,
    /// The format has another version.
    #[error("has format {0}, this program reads format {FORMAT}; use the version that wrote it")]
    Version(u32),
    /// The checkpoint belongs to another scene.
    #[error("belongs to another scene than scene.toml, which may have been edited since")]
    Scene,
}

/// Encodes a state as the bytes of a checkpoint.
pub fn encode(state: &State, scene_hash: &str) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend(MAGIC);
    out.extend(FORMAT.to_le_bytes());
    let mut hash = [b' '; SCENE_HASH];
    hash.iter_mut().zip(scene_hash.bytes()).for_each(|(to, from)| *to = from);
    out.extend(hash);
    out.extend((state.columns().count() as u32).to_le_bytes());
    for (name, column) in state.columns() {
        let (kind, count) = match column {
            Column::Floats(v) => (0u8, v.len()),
            Column::Counts(v) => (1, v.len()),
            Column::Bytes(v) => (2, v.len()),
        };
        out.push(kind);
        out.extend((name.len() as u16).to_le_bytes());
        out.extend(name.as_bytes());
        out.extend((count as u64).to_le_bytes());
        match column {
            Column::Floats(v) => v.iter().for_each(|v| out.extend(v.to_bits().to_le_bytes())),
            Column::Counts(v) => v.iter().for_each(|v| out.extend(v.to_le_bytes())),
            Column::Bytes(v) => out.extend(v),
        }
    }
    sealed(out)
}

/// Appends the checksum to the content.
pub fn sealed(mut content: Vec<u8>) -> Vec<u8> {
    let checksum = Sha256::digest(&content);
    content.extend(checksum);
    content
}

/// Decodes the bytes of a checkpoint of the scene with this hash.
pub fn decode(bytes: &[u8], scene_hash: &str) -> Result<State, Refusal> {
    if !bytes.starts_with(MAGIC) {
        return Err(Refusal::Foreign);
    }
    let (content, checksum) =
        bytes.split_at_checked(bytes.len().saturating_sub(CHECKSUM)).ok_or(Refusal::Damaged)?;
    if Sha256::digest(content).as_slice() != checksum {
        return Err(Refusal::Damaged);
    }
    let mut reader = Reader(content.get(MAGIC.len()..).ok_or(Refusal::Damaged)?);
    let version = u32::from_le_bytes(reader.array()?);
    if version != FORMAT {
        return Err(Refusal::Version(version));
    }
    if reader.take(SCENE_HASH)? != scene_hash.as_bytes() {
        return Err(Refusal::Scene);
    }
    let mut state = State::default();
    for _ in 0..u32::from_le_bytes(reader.array()?) {
        let [kind] = reader.array()?;
        let length = u16::from_le_bytes(reader.array()?);
        let name = reader.take(usize::from(length))?;
        let name = std::str::from_utf8(name).map_err(|_| Refusal::Damaged)?;
        let count = u64::from_le_bytes(reader.array()?);
        let count = usize::try_from(count).map_err(|_| Refusal::Damaged)?;
        let column = match kind {
            0 => Column::Floats(reader.words(count)?.map(f64::from_bits).collect()),
            1 => Column::Counts(reader.words(count)?.collect()),
            2 => Column::Bytes(reader.take(count)?.to_vec()),
            _ => return Err(Refusal::Damaged),
        };
        state.insert(name, column);
    }
    if reader.0.is_empty() { Ok(state) } else { Err(Refusal::Damaged) }
}

/// Reader of the remaining bytes.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Refusal> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(Refusal::Damaged)?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Refusal> {
        let (taken, rest) = self.0.split_first_chunk().ok_or(Refusal::Damaged)?;
        self.0 = rest;
        Ok(*taken)
    }

    fn words(&mut self, count: usize) -> Result<impl Iterator<Item = u64> + 'a, Refusal> {
        let bytes = self.take(count.checked_mul(8).ok_or(Refusal::Damaged)?)?;
        Ok(bytes.as_chunks().0.iter().map(|b| u64::from_le_bytes(*b)))
    }
}

/// Path of the checkpoint of a step.
fn path_of(folder: &Path, step: u64) -> PathBuf {
    folder.join(FOLDER).join(format!("{PREFIX}{step:010}{SUFFIX}"))
}

/// Steps and paths of the checkpoints in the folder of a run, newest first.
pub fn list(folder: &Path) -> Vec<(u64, PathBuf)> {
    let entries = std::fs::read_dir(folder.join(FOLDER)).into_iter().flatten().flatten();
    let mut all: Vec<(u64, PathBuf)> = entries
        .filter_map(|entry| {
            let name = entry.file_name();
            let step = name.to_str()?.strip_prefix(PREFIX)?.strip_suffix(SUFFIX)?;
            Some((step.parse().ok()?, entry.path()))
        })
        .collect();
    all.sort_by(|a, b| b.cmp(a));
    all
}

/// Checks that the checkpoint folder of a run holds nothing but checkpoints.
///
/// # Errors
/// It holds another file.
pub fn only_ours(folder: &Path) -> Result<(), ReplaceError> {
    for entry in std::fs::read_dir(folder.join(FOLDER)).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let ours = name.to_str().is_some_and(|n| {
            n.starts_with(PREFIX) && (n.ends_with(SUFFIX) || n.ends_with(".part"))
        });
        if !ours {
            return Err(ReplaceError::Foreign { path: entry.path(), what: "a checkpoint" });
        }
    }
    Ok(())
}

/// Writes the checkpoint of a step, and removes all but the last [`KEPT`] ones.
pub fn write(
    folder: &Path,
    step: u64,
    state: &State,
    scene_hash: &str,
) -> Result<PathBuf, CheckpointError> {
    let path = path_of(folder, step);
    let within = folder.join(FOLDER);
    replace(&within, &path, &encode(state, scene_hash))
        .map_err(|source| CheckpointError::Write { path: path.clone(), source })?;
    // Later checkpoints remain from a run that was resumed from an earlier step; they are obsolete.
    let (later, kept): (Vec<_>, Vec<_>) = list(folder).into_iter().partition(|c| c.0 > step);
    for (_, old) in later.iter().chain(kept.iter().skip(KEPT)) {
        // A file that cannot be removed does no harm.
        if is_checkpoint(old) {
            let _ = std::fs::remove_file(old);
        }
    }
    Ok(path)
}

/// Whether a file starts as checkpoints do.
fn is_checkpoint(path: &Path) -> bool {
    let mut start = [0; MAGIC.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut start)).is_ok() && start == *MAGIC
}

fn replace(within: &Path, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    // The folder of the run is not created again: if it is gone, so is the rest of the run.
    match std::fs::create_dir(within) {
        Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => return Err(e),
        _ => {}
    }
    let part = path.with_extension("part");
    let written = File::create(&part).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    if let Err(e) = written.and_then(|()| std::fs::rename(&part, path)) {
        let _ = std::fs::remove_file(&part);
        return Err(e);
    }
    sync_folder(within)
}

/// Flushes the entries of a folder to the disk.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> std::io::Result<()> {
    File::open(folder)?.sync_all()
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> std::io::Result<()> {
    Ok(())
}

/// Reads a checkpoint of the scene with this hash.
pub fn read(path: &Path, scene_hash: &str) -> Result<State, CheckpointError> {
    let path = || path.to_path_buf();
    let bytes =
        std::fs::read(path()).map_err(|source| CheckpointError::Read { path: path(), source })?;
    decode(&bytes, scene_hash).map_err(|source| CheckpointError::Refused { path: path(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TempFolder;

    fn state() -> State {
        let mut s = State::default();
        s.put_floats("a", [1.0, -0.0, f64::NAN, 1e-310]);
        s.put_counts("b", [u64::MAX, 0]);
        s.put_bytes("c", *b"text");
        s.put_floats("none", []);
        s
    }

    const HASH: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

    #[test]
    fn a_checkpoint_is_read_back_bit_for_bit() {
        let bytes = encode(&state(), HASH);
        let back = decode(&bytes, HASH).expect("whole");
        assert_eq!(encode(&back, HASH), bytes);
        assert_eq!(back.text("c").expect("text"), "text");
        assert_eq!(back.floats("a").expect("floats")[1].to_bits(), (-0.0f64).to_bits());
    }

    #[test]
    fn any_cut_and_any_flipped_bit_is_refused() {
        let bytes = encode(&state(), HASH);
        for length in 0..bytes.len() {
            assert!(decode(&bytes[..length], HASH).is_err(), "cut to {length}");
        }
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&flipped, HASH).is_err(), "bit {bit}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        assert_eq!(decode(&longer, HASH), Err(Refusal::Damaged));
    }

    #[test]
    fn other_versions_and_scenes_are_rejected() {
        let mut bytes = encode(&state(), HASH);
        assert_eq!(decode(&bytes, &HASH.replace('0', "1")), Err(Refusal::Scene));
        bytes[MAGIC.len()] = 7;
        let content = bytes.len() - CHECKSUM;
        let checksum = Sha256::digest(&bytes[..content]);
        bytes[content..].copy_from_slice(&checksum);
        assert_eq!(decode(&bytes, HASH), Err(Refusal::Version(7)));
        assert_eq!(decode(b"RRF2 something else", HASH), Err(Refusal::Foreign));
    }

    #[test]
    fn only_the_last_two_checkpoints_are_kept() {
        let folder = TempFolder::new().expect("a folder");
        for step in [10, 20, 30] {
            write(folder.path(), step, &state(), HASH).expect("written");
        }
        let steps: Vec<u64> = list(folder.path()).iter().map(|c| c.0).collect();
        assert_eq!(steps, [30, 20]);
        write(folder.path(), 25, &state(), HASH).expect("written");
        let steps: Vec<u64> = list(folder.path()).iter().map(|c| c.0).collect();
        assert_eq!(steps, [25, 20], "later checkpoints are obsolete");
        let all = std::fs::read_dir(folder.path().join(FOLDER)).expect("a folder").count();
        assert_eq!(all, 2);
    }
}
