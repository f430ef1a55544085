//! The index of an MP4 film: where the bytes of every frame lie, when it is shown, and what the track says of its pictures.
//!
//! Written for this program rather than taken from a library, because every count of the file is checked against the file's own size
//! before anything is reserved for it.

use super::boxes::{be16, be32, be64, child, children, descend};

/// Most frames that a film may have: nine hours at 30 a second.
pub(super) const MAX_FRAMES: usize = 1_000_000;

/// Bytes of one frame in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sample {
    pub(super) offset: u64,
    pub(super) size: u32,
    /// When it is shown, in units of the track.
    pub(super) shown_at: i64,
    /// How long, in units of the track.
    pub(super) lasts: u32,
    /// Whether decoding can begin here.
    pub(super) key: bool,
}

/// The video track of a film.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Track {
    id: u32,
    /// Four letters of the codec: `avc1`.
    pub(super) codec: [u8; 4],
    /// The decoder's configuration (`avcC`), for H.264.
    pub(super) configuration: Vec<u8>,
    /// Coded size that the sample entry declares, px.
    pub(super) size: [u32; 2],
    /// Quarter turns to the right that make the picture upright.
    pub(super) quarter_turns: u8,
    /// Width of a pixel over its height, if the file says so.
    pub(super) pixel_aspect: Option<[u32; 2]>,
    /// Matrix of the colours and whether they use the full range, if the file says so.
    pub(super) colour: Option<(u16, bool)>,
    /// Units of time a second.
    pub(super) timescale: u32,
    /// What is shown begins here, in units of the track.
    pub(super) begins_at: i64,
    /// The frames in the order of decoding.
    pub(super) samples: Vec<Sample>,
}

/// Why a film has no index that can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoIndex {
    /// There is no track with pictures.
    NoVideo,
    /// There are more frames than [`MAX_FRAMES`].
    TooMany(u64),
    /// A table is missing or contradicts another: which.
    Damaged(&'static str),
}

/// Reads the content of a `moov` box: the first track with pictures.
pub(super) fn video_track(moov: &[u8], file_size: u64) -> Result<Track, NoIndex> {
    let is_video =
        |trak: &[u8]| descend(trak, &[b"mdia", b"hdlr"]).and_then(|h| h.get(8..12)).is_some_and(|kind| kind == b"vide");
    let tracks = children(moov).filter(|(kind, _)| kind == b"trak").map(|(_, content)| content);
    let trak = tracks.into_iter().find(|t| is_video(t)).ok_or(NoIndex::NoVideo)?;
    let mdia = child(trak, *b"mdia").ok_or(NoIndex::Damaged("mdia"))?;
    let tkhd = child(trak, *b"tkhd").ok_or(NoIndex::Damaged("tkhd"))?;
    let long = tkhd.first() == Some(&1);
    let timescale = child(mdia, *b"mdhd").and_then(|m| be32(m, if m.first() == Some(&1) { 20 } else { 12 }));
    let stbl = descend(mdia, &[b"minf", b"stbl"]).ok_or(NoIndex::Damaged("stbl"))?;
    let mut track = Track {
        id: be32(tkhd, if long { 20 } else { 12 }).ok_or(NoIndex::Damaged("tkhd"))?,
        codec: *b"    ",
        configuration: Vec::new(),
        size: [0; 2],
        quarter_turns: quarter_turns(tkhd.get(if long { 52 } else { 40 }..).unwrap_or_default()),
        pixel_aspect: None,
        colour: None,
        timescale: timescale.filter(|t| *t > 0).ok_or(NoIndex::Damaged("mdhd"))?,
        begins_at: descend(trak, &[b"edts", b"elst"]).and_then(begins_at).unwrap_or(0),
        samples: Vec::new(),
    };
    describe(&mut track, stbl).ok_or(NoIndex::Damaged("stsd"))?;
    track.samples = samples(stbl, file_size)?;
    Ok(track)
}

/// What the sample entry says: codec, size, aspect, colour.
fn describe(track: &mut Track, stbl: &[u8]) -> Option<()> {
    let stsd = child(stbl, *b"stsd")?;
    let (codec, entry) = children(stsd.get(8..)?).next()?;
    track.codec = codec;
    track.size = [u32::from(be16(entry, 24)?), u32::from(be16(entry, 26)?)];
    // 78 bytes of a visual sample entry come before the boxes inside it.
    for (kind, content) in children(entry.get(78..)?) {
        match &kind {
            b"avcC" => track.configuration = content.to_vec(),
            b"pasp" => track.pixel_aspect = Some([be32(content, 0)?, be32(content, 4)?]),
            b"colr" if content.starts_with(b"nclx") || content.starts_with(b"nclc") => {
                let full = content.first_chunk() == Some(b"nclx") && content.get(10).is_some_and(|b| b & 0x80 != 0);
                track.colour = Some((be16(content, 8)?, full));
            }
            _ => {}
        }
    }
    Some(())
}

/// Turns to the right by the matrix of a track header; anything but quarter turns is left as it lies.
fn quarter_turns(matrix: &[u8]) -> u8 {
    let sign = |at: usize| be32(matrix, at).map_or(0, |v| i64::from(v.cast_signed()).signum());
    match [sign(0), sign(4), sign(12), sign(16)] {
        [0, 1, -1, 0] => 1,
        [-1, 0, 0, -1] => 2,
        [0, -1, 1, 0] => 3,
        _ => 0,
    }
}

/// Where the first edit that shows anything begins, in units of the track.
fn begins_at(elst: &[u8]) -> Option<i64> {
    let long = elst.first() == Some(&1);
    let count = be32(elst, 4)? as usize;
    let width = if long { 20 } else { 12 };
    (0..count.min(elst.len() / width)).find_map(|i| {
        let at = 8 + i * width;
        let time = if long { be64(elst, at + 8)?.cast_signed() } else { i64::from(be32(elst, at + 4)?.cast_signed()) };
        (time >= 0).then_some(time)
    })
}

/// Runs of a table (`count`, `value`), one value a sample; the last run goes on when the table is too short.
struct Runs<'a> {
    table: &'a [u8],
    at: usize,
    left: u32,
    value: u32,
}

impl<'a> Runs<'a> {
    fn new(table: &'a [u8]) -> Self {
        Self { table: table.get(8..).unwrap_or_default(), at: 0, left: 0, value: 0 }
    }

    fn next(&mut self) -> u32 {
        while self.left == 0 {
            let (Some(count), Some(value)) = (be32(self.table, self.at), be32(self.table, self.at + 4)) else {
                return self.value;
            };
            (self.left, self.value) = (count, value);
            self.at += 8;
        }
        self.left -= 1;
        self.value
    }
}

/// The samples of the tables of a track.
fn samples(stbl: &[u8], file_size: u64) -> Result<Vec<Sample>, NoIndex> {
    let table = |kind: [u8; 4], name: &'static str| child(stbl, kind).ok_or(NoIndex::Damaged(name));
    let stsz = table(*b"stsz", "stsz")?;
    let (same, count) = be32(stsz, 4).zip(be32(stsz, 8)).ok_or(NoIndex::Damaged("stsz"))?;
    let declared = u64::from(count);
    // Sizes that are listed must be there, and frames of one size cannot be more than fit into the file.
    if same == 0 && declared > (stsz.len() as u64 - 12) / 4 {
        return Err(NoIndex::Damaged("stsz"));
    }
    if declared > MAX_FRAMES as u64 || (same > 0 && declared > file_size / u64::from(same) + 1) {
        return Err(NoIndex::TooMany(declared));
    }
    if count == 0 {
        return Ok(Vec::new());
    }
    let mut durations = Runs::new(table(*b"stts", "stts")?);
    let mut offsets = child(stbl, *b"ctts").map(Runs::new);
    let keys = child(stbl, *b"stss");
    let (stco, co64) = (child(stbl, *b"stco"), child(stbl, *b"co64"));
    let stsc = table(*b"stsc", "stsc")?;
    let chunk_offset = |chunk: u32| match (stco, co64) {
        (Some(t), _) => be32(t, 8 + 4 * chunk as usize).map(u64::from),
        (None, Some(t)) => be64(t, 8 + 8 * chunk as usize),
        (None, None) => None,
    };
    let run = |i: usize| be32(stsc, 8 + 12 * i).zip(be32(stsc, 12 + 12 * i));
    let (mut chunk, mut in_chunk, mut run_at, mut offset) = (0_u32, 0_u32, 0_usize, 0_u64);
    let (_, mut per_chunk) = run(0).ok_or(NoIndex::Damaged("stsc"))?;
    let (mut key_at, mut decoded_at) = (0, 0_i64);
    let mut found = Vec::with_capacity(count as usize);
    for i in 0..count {
        if i == 0 || in_chunk == per_chunk {
            if i > 0 {
                chunk += 1;
                in_chunk = 0;
            }
            // Chunks are counted from 1 in that table.
            if let Some((first, per)) = run(run_at + 1)
                && chunk + 1 >= first
            {
                run_at += 1;
                per_chunk = per;
            }
            offset = chunk_offset(chunk).ok_or(NoIndex::Damaged("stco"))?;
        }
        if per_chunk == 0 {
            return Err(NoIndex::Damaged("stsc"));
        }
        let size = if same > 0 { same } else { be32(stsz, 12 + 4 * i as usize).unwrap_or(0) };
        let key = keys.is_none_or(|t| {
            let here = be32(t, 8 + 4 * key_at) == Some(i + 1);
            key_at += usize::from(here);
            here
        });
        let lasts = durations.next();
        let shift = offsets.as_mut().map_or(0, |o| i64::from(o.next().cast_signed()));
        found.push(Sample { offset, size, shown_at: decoded_at.saturating_add(shift), lasts, key });
        decoded_at = decoded_at.saturating_add(i64::from(lasts));
        offset = offset.saturating_add(u64::from(size));
        in_chunk += 1;
    }
    Ok(found)
}

/// Defaults of a track for its fragments: duration, size, flags of a sample.
fn defaults(moov: &[u8], id: u32) -> [u32; 3] {
    let Some(mvex) = child(moov, *b"mvex") else { return [0; 3] };
    let trex = children(mvex).find(|(kind, c)| kind == b"trex" && be32(c, 4) == Some(id));
    trex.map_or([0; 3], |(_, c)| [12, 16, 20].map(|at| be32(c, at).unwrap_or(0)))
}

impl Track {
    /// Adds the samples of a fragment: the content of a `moof` box that begins at `start` of the file.
    pub(super) fn add_fragment(&mut self, moov: &[u8], moof: &[u8], start: u64) -> Result<(), NoIndex> {
        const DAMAGED: NoIndex = NoIndex::Damaged("moof");
        for (_, traf) in children(moof).filter(|(kind, _)| kind == b"traf") {
            let tfhd = child(traf, *b"tfhd").ok_or(DAMAGED)?;
            if be32(tfhd, 4) != Some(self.id) {
                continue;
            }
            let flags = be32(tfhd, 0).ok_or(DAMAGED)?;
            let mut at = 8;
            let mut field = |mask: u32, width: usize| {
                (flags & mask != 0).then(|| {
                    at += width;
                    at - width
                })
            };
            let base = field(0x1, 8).and_then(|at| be64(tfhd, at)).unwrap_or(start);
            field(0x2, 4);
            let mut by_default = defaults(moov, self.id);
            for (i, mask) in [0x8, 0x10, 0x20].into_iter().enumerate() {
                if let Some(value) = field(mask, 4).and_then(|at| be32(tfhd, at)) {
                    by_default[i] = value;
                }
            }
            let after = self.samples.last().map_or(0, |s| s.shown_at.saturating_add(i64::from(s.lasts)));
            let tfdt = child(traf, *b"tfdt");
            let begun = tfdt.and_then(|t| {
                if t.first() == Some(&1) { be64(t, 4).map(u64::cast_signed) } else { be32(t, 4).map(i64::from) }
            });
            let (mut decoded_at, mut offset) = (begun.unwrap_or(after), base);
            for (_, trun) in children(traf).filter(|(kind, _)| kind == b"trun") {
                self.add_run(trun, base, &mut offset, &mut decoded_at, by_default).ok_or(DAMAGED)?;
                if self.samples.len() > MAX_FRAMES {
                    return Err(NoIndex::TooMany(self.samples.len() as u64));
                }
            }
        }
        Ok(())
    }

    fn add_run(
        &mut self,
        trun: &[u8],
        base: u64,
        offset: &mut u64,
        decoded_at: &mut i64,
        [duration, size, flags_by_default]: [u32; 3],
    ) -> Option<()> {
        let flags = be32(trun, 0)?;
        let count = be32(trun, 4)?;
        let mut at = 8;
        let mut next = |there: bool| {
            if !there {
                return Some(None);
            }
            at += 4;
            be32(trun, at - 4).map(Some)
        };
        if let Some(relative) = next(flags & 0x1 != 0)? {
            *offset = base.checked_add_signed(i64::from(relative.cast_signed()))?;
        }
        let first_flags = next(flags & 0x4 != 0)?;
        for i in 0..count {
            // A run whose samples have no fields of their own is as long as it says; the check after it ends it.
            if self.samples.len() > MAX_FRAMES {
                return Some(());
            }
            let lasts = next(flags & 0x100 != 0)?.unwrap_or(duration);
            let size = next(flags & 0x200 != 0)?.unwrap_or(size);
            let own = next(flags & 0x400 != 0)?.or(first_flags.filter(|_| i == 0)).unwrap_or(flags_by_default);
            let shift = next(flags & 0x800 != 0)?.unwrap_or(0);
            let shown_at = decoded_at.saturating_add(i64::from(shift.cast_signed()));
            // Bit 16: the sample is not one to begin with.
            self.samples.push(Sample { offset: *offset, size, shown_at, lasts, key: own & 0x1_0000 == 0 });
            *decoded_at = decoded_at.saturating_add(i64::from(lasts));
            *offset = offset.saturating_add(u64::from(size));
        }
        Some(())
    }
}
