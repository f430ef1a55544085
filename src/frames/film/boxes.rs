//! The boxes of an MP4 or QuickTime file: a length, four letters, and what is inside (ISO/IEC 14496-12).

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// Largest index of a film that is read into memory, bytes: a film of a million frames has 20 MB of it.
pub(super) const MAX_INDEX_BYTES: u64 = 64 << 20;

/// Deepest nesting of boxes that is followed; the tables of a track lie six deep.
const MAX_DEPTH: usize = 12;

/// A box of the top level of a file: its kind, and where its content lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TopBox {
    pub(super) kind: [u8; 4],
    /// Offset of the box itself.
    pub(super) start: u64,
    /// Offset of its content.
    pub(super) content: u64,
    /// Bytes of its content that the file has.
    pub(super) length: u64,
    /// Whether the file ends before the box does.
    pub(super) cut_short: bool,
}

/// Walks the boxes of the top level; what does not look like a box ends the walk.
pub(super) fn top_level(file: &mut File, size: u64, most: usize) -> io::Result<Vec<TopBox>> {
    let mut found = Vec::new();
    let mut at = 0;
    while at + 8 <= size && found.len() < most {
        file.seek(SeekFrom::Start(at))?;
        let mut head = [0; 16];
        file.read_exact(&mut head[..8])?;
        let kind = [head[4], head[5], head[6], head[7]];
        let mut header = 8;
        let mut length = u64::from(be32(&head, 0).unwrap_or(0));
        if length == 1 && at + 16 <= size {
            file.read_exact(&mut head[8..])?;
            length = be64(&head, 8).unwrap_or(0);
            header = 16;
        } else if length == 0 {
            length = size - at;
        }
        if length < header || !kind.iter().all(|b| b.is_ascii_graphic() || *b == b' ' || *b == 0xa9) {
            break;
        }
        let end = at.saturating_add(length);
        let cut_short = end > size;
        found.push(TopBox { kind, start: at, content: at + header, length: end.min(size) - at - header, cut_short });
        at = end;
    }
    Ok(found)
}

/// The content of the box, all of it in memory.
pub(super) fn read_content(file: &mut File, of: &TopBox) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(of.content))?;
    let mut bytes = Vec::new();
    file.by_ref().take(of.length.min(MAX_INDEX_BYTES)).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The boxes inside a content, in their order: kind and content. A box that reaches beyond its parent ends the list.
pub(super) fn children(content: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut rest = content;
    std::iter::from_fn(move || {
        let length = be32(rest, 0)? as usize;
        let kind = kind_at(rest, 4)?;
        let (header, length) = match length {
            0 => (8, rest.len()),
            1 => (16, usize::try_from(be64(rest, 8)?).ok()?),
            n => (8, n),
        };
        let inside = rest.get(header..length)?;
        rest = rest.get(length..).unwrap_or_default();
        Some((kind, inside))
    })
}

/// The first box of that kind.
pub(super) fn child(content: &[u8], kind: [u8; 4]) -> Option<&[u8]> {
    children(content).find(|(k, _)| *k == kind).map(|(_, c)| c)
}

/// The box at the end of a path of kinds.
pub(super) fn descend<'a>(content: &'a [u8], path: &[&[u8; 4]]) -> Option<&'a [u8]> {
    path.iter().take(MAX_DEPTH).try_fold(content, |inside, kind| child(inside, **kind))
}

/// A big-endian number of 32 bits at that place.
pub(super) fn be32(bytes: &[u8], at: usize) -> Option<u32> {
    let part = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_be_bytes(part.try_into().ok()?))
}

/// A big-endian number of 64 bits at that place.
pub(super) fn be64(bytes: &[u8], at: usize) -> Option<u64> {
    let part = bytes.get(at..at.checked_add(8)?)?;
    Some(u64::from_be_bytes(part.try_into().ok()?))
}

/// A big-endian number of 16 bits at that place.
pub(super) fn be16(bytes: &[u8], at: usize) -> Option<u16> {
    let part = bytes.get(at..at.checked_add(2)?)?;
    Some(u16::from_be_bytes(part.try_into().ok()?))
}

fn kind_at(bytes: &[u8], at: usize) -> Option<[u8; 4]> {
    bytes.get(at..at + 4)?.try_into().ok()
}
