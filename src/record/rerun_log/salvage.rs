//! This module reads what is left of a damaged recording: it skips damaged messages and looks for
//! the next undamaged one.
//!
//! A message has a header with its kind and its length, and no checksum. A damaged payload is found
//! by decoding it; damaged values inside a payload that can be decoded are not found.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use rerun::external::re_log_encoding::{DecoderApp, MessageHeader, StreamFooter, StreamHeader};
use rerun::log::LogMsg;

use super::decode::{ARROW, END, LAST_KIND, ReadError, calmly, is_closed, is_sound};

/// What a recording has lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Damage {
    /// Number of damaged places inside the recording.
    pub places: usize,
    /// Number of bytes that cannot be read, without an incomplete last message.
    pub bytes: u64,
    /// Whether the end is missing, as in the recording of a killed run.
    pub open: bool,
}

const HEADER: usize = MessageHeader::ENCODED_SIZE_BYTES;
/// Kind of the messages that describe a recording; the decoder needs them before others.
const STORE: u64 = 1;
/// Largest accepted message that holds no data (bytes).
const LARGEST_OTHER: u64 = 1 << 20;

/// Calls `each` with every message that can be decoded, in order; it returns whether the message can
/// be used.
///
/// # Errors
/// The file cannot be read, or is not a recording.
pub(super) fn salvage(
    path: &Path,
    mut each: impl FnMut(LogMsg) -> bool,
) -> Result<Damage, ReadError> {
    let opened = |source| ReadError::Open { path: path.to_owned(), source };
    let mut file = File::open(path).map_err(opened)?;
    let mut damage = Damage { open: !is_closed(&mut file).map_err(opened)?, ..Damage::default() };
    let mut bytes = vec![];
    file.read_to_end(&mut bytes).map_err(opened)?;
    let Some((header, rest)) = bytes.split_at_checked(StreamHeader::ENCODED_SIZE_BYTES) else {
        let cause = "it is empty".to_owned();
        return Err(ReadError::Unreadable { path: path.to_owned(), cause });
    };
    // The start of every piece that is decoded: the header and the descriptions so far.
    let mut start = header.to_vec();
    let (mut at, mut lost) = (0, 0);
    let mut unpacked = vec![];
    while let Some(head) = Head::read(rest, at) {
        let taken = match head {
            Head::Message { kind: END, .. } => break,
            Head::Message { kind, length } => {
                let whole = &rest[at..at + HEADER + length];
                let sound = kind != ARROW || is_sound(&whole[HEADER..], &mut unpacked);
                let message = sound.then(|| decode(&start, whole)).flatten();
                message.is_some_and(&mut each).then_some((kind, whole))
            }
            Head::Invalid => None,
        };
        let Some((kind, whole)) = taken else {
            let next = next_message(rest, at + 1, &mut unpacked);
            lost += (next - at) as u64;
            at = next;
            continue;
        };
        if lost > 0 {
            damage.places += 1;
            damage.bytes += lost;
            lost = 0;
        }
        if kind == STORE {
            start.extend(whole);
        }
        at += whole.len();
    }
    // Without an end, an incomplete last message is what a killed run leaves.
    if lost > 0 && !damage.open {
        damage.places += 1;
        damage.bytes += lost;
    }
    Ok(damage)
}

/// Whether the index at the end of a closed recording is undamaged.
///
/// # Errors
/// The file cannot be read.
pub(super) fn has_sound_index(path: &Path) -> Result<bool, ReadError> {
    let opened = |source| ReadError::Open { path: path.to_owned(), source };
    Ok(index_is_sound(&std::fs::read(path).map_err(opened)?))
}

/// Whether the index of a closed recording has the checksum that its footer states.
fn index_is_sound(bytes: &[u8]) -> bool {
    // The footer: per index its position, length and checksum; two identifiers and a count.
    const TAIL: usize = 12;
    const ENTRY: usize = 20;
    let word = |at: usize| Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize);
    let check = || {
        let entries = bytes.len().checked_sub(TAIL)?;
        let count = u32::from_le_bytes(*bytes.last_chunk()?) as usize;
        let first = entries.checked_sub(count.checked_mul(ENTRY)?)?;
        for at in (first..entries).step_by(ENTRY) {
            let (from, length) = (word(at)?, word(at + 8)?);
            let index = bytes.get(from..from.checked_add(length)?)?;
            let checksum = u32::from_le_bytes(*bytes.get(at + 16..)?.first_chunk()?);
            if StreamFooter::compute_crc(index) != checksum {
                return None;
            }
        }
        Some(())
    };
    check().is_some()
}

/// Header of a message.
enum Head {
    /// A message of this kind with a payload of this length, which is there.
    Message {
        kind: u64,
        length: usize,
    },
    Invalid,
}

impl Head {
    /// Reads a header; `None` at the end of the bytes.
    fn read(bytes: &[u8], at: usize) -> Option<Head> {
        let words: &[u8; HEADER] = bytes.get(at..)?.first_chunk()?;
        let (words, _) = words.as_chunks();
        let [kind, length] = [0, 1].map(|k| u64::from_le_bytes(words[k]));
        let room = (bytes.len() - at - HEADER) as u64;
        let most = if kind == ARROW { room } else { room.min(LARGEST_OTHER) };
        // The end is followed by its index.
        let valid = kind <= LAST_KIND && (length <= most || kind == END && length <= room);
        Some(if valid { Head::Message { kind, length: length as usize } } else { Head::Invalid })
    }
}

/// The position of the next message with data that can be read, or the end.
fn next_message(bytes: &[u8], from: usize, unpacked: &mut Vec<u8>) -> usize {
    let kind = ARROW.to_le_bytes();
    let mut at = from;
    while let Some(rest) = bytes.get(at..) {
        let Some(k) = rest.windows(kind.len()).position(|w| w == kind) else { break };
        at += k;
        if let Some(Head::Message { length: length @ 1.., .. }) = Head::read(bytes, at)
            && is_sound(&bytes[at + HEADER..at + HEADER + length], unpacked)
        {
            return at;
        }
        at += 1;
    }
    bytes.len()
}

/// Decodes one message; `start` is what the decoder needs before it.
fn decode(start: &[u8], message: &[u8]) -> Option<LogMsg> {
    let piece = [start, message].concat();
    let decoded = calmly(|| {
        let decoder = DecoderApp::decode_eager(BufReader::new(piece.as_slice())).ok()?;
        decoder.map_while(Result::ok).last()
    });
    decoded.ok().flatten()
}
