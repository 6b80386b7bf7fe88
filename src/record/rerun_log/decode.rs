//! This module decodes recording files, including damaged and hostile ones.
//!
//! Rerun's decoder does not check its input: it panics on some damaged files, and allocates as much
//! memory as a file claims to need, which aborts the program. So every length is checked against
//! the bytes present before decoding, and other panics of the decoder are caught without output.

use std::cell::Cell;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Once;

use rerun::external::arrow;
use rerun::external::re_log_encoding::external::lz4_flex;
use rerun::external::re_log_encoding::{
    DecoderApp, MessageHeader, RRD_FOURCC, StreamFooter, StreamHeader,
};
use rerun::external::re_log_types::ArrowMsg;
use rerun::log::{Chunk, LogMsg};

/// Error of reading a recording.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file cannot be opened.
    #[error("{}: cannot be read: {source}", path.display())]
    Open {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is not a recording, or it was cut before its first data.
    #[error("{}: is not a readable recording: {cause}; expected an .rrd file of a run", path.display())]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Cause, as reported by the decoder.
        cause: String,
    },
    /// The recording does not contain exactly one run.
    #[error(
        "{}: holds {found}; a comparison takes recordings of one run each", path.display()
    )]
    NotOneRun {
        /// Path of the file.
        path: PathBuf,
        /// Content of the file.
        found: String,
    },
}

/// The valid messages of a recording, and the reason why its end is missing, if it is.
pub(super) fn messages(
    path: &Path,
) -> Result<(impl Iterator<Item = Result<LogMsg, String>>, Option<String>), ReadError> {
    let opened = |source| ReadError::Open { path: path.to_owned(), source };
    let mut file = File::open(path).map_err(opened)?;
    let closed = is_closed(&mut file).map_err(opened)?;
    let sound = sound_length(&mut BufReader::new(&file)).map_err(opened)?;
    file.rewind().map_err(opened)?;
    let whole = file.metadata().map_err(opened)?.len();
    let cut = match (closed, sound < whole) {
        (false, _) => Some("its end is missing".to_owned()),
        (true, true) => Some(format!("it is damaged after {sound} bytes")),
        (true, false) => None,
    };
    let unreadable = |e: &dyn std::fmt::Display| ReadError::Unreadable {
        path: path.to_owned(),
        cause: e.to_string(),
    };
    let mut decoder = calmly(|| DecoderApp::decode_eager(BufReader::new(file.take(sound))))
        .map_err(|e| unreadable(&e))?
        .map_err(|e| unreadable(&e))?;
    let messages = std::iter::from_fn(move || match calmly(|| decoder.next()) {
        Ok(next) => next.map(|message| message.map_err(|e| e.to_string())),
        Err(cause) => Some(Err(cause)),
    });
    Ok((messages, cut))
}

/// Decodes the chunk of a message.
pub(super) fn chunk_of(message: &ArrowMsg) -> Result<Chunk, String> {
    calmly(|| Chunk::from_arrow_msg(message).map_err(|e| e.to_string())).flatten()
}

thread_local! {
    /// Whether this thread is decoding. A panic then means a damaged file and is reported as such.
    static DECODES: Cell<bool> = const { Cell::new(false) };
}

/// Runs `decode` and turns a panic into an error, without printing the panic message.
pub(super) fn calmly<T>(decode: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !DECODES.get() {
                usual(panic);
            }
        }));
    });
    let before = DECODES.replace(true);
    let decoded = catch_unwind(AssertUnwindSafe(decode));
    DECODES.set(before);
    decoded.map_err(|_| "its content is damaged".to_owned())
}

/// Kind of the message that ends a recording.
pub(super) const END: u64 = 0;
/// Kind of a message with data in Arrow format.
pub(super) const ARROW: u64 = 2;
/// Largest known kind of message.
pub(super) const LAST_KIND: u64 = 3;
/// Tolerance of the length checks (bytes).
const SLACK: u64 = 1 << 16;

/// Length of the leading part of a recording in which all lengths are valid (bytes).
fn sound_length(file: &mut (impl Read + Seek)) -> std::io::Result<u64> {
    let whole = file.seek(SeekFrom::End(0))?;
    let mut at = StreamHeader::ENCODED_SIZE_BYTES as u64;
    file.seek(SeekFrom::Start(at))?;
    let (mut message, mut unpacked) = (Vec::new(), Vec::new());
    loop {
        const HEADER: u64 = MessageHeader::ENCODED_SIZE_BYTES as u64;
        if whole.saturating_sub(at) < HEADER {
            // There is no end message, so the last message may be cut.
            return Ok(whole);
        }
        let mut words = [[0; 8]; 2];
        file.read_exact(words.as_flattened_mut())?;
        let [kind, length] = words.map(u64::from_le_bytes);
        if kind > LAST_KIND || length > whole - at - HEADER {
            return Ok(at);
        }
        if kind == END {
            // Only an index follows.
            return Ok(whole.min(at + HEADER + length + SLACK));
        }
        message.resize(length as usize, 0);
        file.read_exact(&mut message)?;
        if kind == ARROW && !is_sound(&message, &mut unpacked) {
            return Ok(at);
        }
        at += HEADER + length;
    }
}

/// Whether the lengths of the data of a message are valid, both compressed and uncompressed.
pub(super) fn is_sound(message: &[u8], unpacked: &mut Vec<u8>) -> bool {
    /// Largest compression ratio of LZ4.
    const LARGEST_RATIO: u64 = 255;
    /// Largest accepted message (bytes). The picture of 512 x 512 cells has 4e7.
    const LARGEST: u64 = 1 << 28;
    const LZ4: u64 = 2;
    let Some(Packed { compression, size, payload }) = Packed::read(message) else { return false };
    if compression != LZ4 {
        return arrow_is_sound(payload);
    }
    let most = LARGEST_RATIO.saturating_mul(payload.len() as u64).saturating_add(SLACK);
    if size > most.min(LARGEST) {
        return false;
    }
    unpacked.resize(size as usize, 0);
    // As in the decoder: bytes that are not filled stay zero.
    unpacked.fill(0);
    lz4_flex::block::decompress_into(payload, unpacked).is_ok() && arrow_is_sound(unpacked)
}

/// Whether the parts of an Arrow stream, each with a header and a body, have the lengths they
/// claim.
fn arrow_is_sound(mut rest: &[u8]) -> bool {
    const CONTINUED: u32 = u32::MAX;
    let word = |bytes: &mut &[u8]| {
        let (word, after) = bytes.split_first_chunk()?;
        *bytes = after;
        Some(u32::from_le_bytes(*word))
    };
    loop {
        let length = match word(&mut rest) {
            Some(CONTINUED) => word(&mut rest),
            length => length,
        };
        // End of the stream, or end of the bytes.
        let Some(length @ 1..) = length else { return true };
        let Some((description, after)) = rest.split_at_checked(length as usize) else {
            return false;
        };
        let Ok(part) = arrow::ipc::root_as_message(description) else { return false };
        let body = usize::try_from(part.bodyLength()).ok();
        match body.and_then(|n| after.get(n..)) {
            Some(after) => rest = after,
            None => return false,
        }
    }
}

/// Payload of a message (`ArrowMsg` of Rerun's protocol, in Protocol Buffers).
#[derive(Default)]
struct Packed<'a> {
    compression: u64,
    /// Uncompressed size (bytes).
    size: u64,
    payload: &'a [u8],
}

impl<'a> Packed<'a> {
    /// Parses a message; `None` if it is not a valid `ArrowMsg`.
    fn read(message: &'a [u8]) -> Option<Self> {
        const COMPRESSION: u64 = 2;
        const SIZE: u64 = 3;
        const PAYLOAD: u64 = 5;
        let mut packed = Self::default();
        let mut rest = message;
        while !rest.is_empty() {
            let key = varint(&mut rest)?;
            let length = match key & 7 {
                0 => {
                    let value = varint(&mut rest)?;
                    match key >> 3 {
                        COMPRESSION => packed.compression = value,
                        SIZE => packed.size = value,
                        _ => {}
                    }
                    continue;
                }
                1 => 8,
                2 => varint(&mut rest)?,
                5 => 4,
                _ => return None,
            };
            let (bytes, after) = rest.split_at_checked(usize::try_from(length).ok()?)?;
            if key == PAYLOAD << 3 | 2 {
                packed.payload = bytes;
            }
            rest = after;
        }
        Some(packed)
    }
}

/// Reads a variable-length integer: seven bits per byte, lowest first.
fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

/// Whether a file has the footer that is written when a recording is closed. The decoder also
/// accepts an end without a footer.
pub(super) fn is_closed(file: &mut File) -> std::io::Result<bool> {
    // The footer ends with two identifiers and the number of its entries.
    const TAIL: i64 = 12;
    let mut names = [0; 8];
    if file.metadata()?.len() > TAIL.unsigned_abs() {
        file.seek(SeekFrom::End(-TAIL))?;
        file.read_exact(&mut names)?;
    }
    file.rewind()?;
    Ok(names == [RRD_FOURCC, StreamFooter::RRD_IDENTIFIER].concat().as_slice())
}
