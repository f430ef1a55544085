//! What an H.264 stream says of its pictures before the first one: the sequence parameter set (ITU-T H.264, 7.3.2.1.1 and E.1.1).

/// What is needed of a sequence parameter set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Parameters {
    /// Chroma: 0 none, 1 4:2:0, 2 4:2:2, 3 4:4:4.
    pub(super) chroma: u32,
    /// Bits of a luma sample.
    pub(super) bits: u32,
    /// Whether a picture is two fields.
    pub(super) interlaced: bool,
    /// Size after cropping, px.
    pub(super) size: [u32; 2],
    /// Width of a pixel over its height, if it says so.
    pub(super) pixel_aspect: Option<[u32; 2]>,
    /// Matrix of the colours, if it says so.
    pub(super) matrix: Option<u32>,
    /// Whether colours use the full range of 0 to 255, if it says so.
    pub(super) full_range: Option<bool>,
}

/// Pixel aspects by number (table E-1).
const ASPECTS: [[u32; 2]; 17] = [
    [0, 0],
    [1, 1],
    [12, 11],
    [10, 11],
    [16, 11],
    [40, 33],
    [24, 11],
    [20, 11],
    [32, 11],
    [80, 33],
    [18, 11],
    [15, 11],
    [64, 33],
    [160, 99],
    [4, 3],
    [3, 2],
    [2, 1],
];

/// Bits from the left, with the stuffing bytes (`00 00 03`) taken out.
struct Bits {
    bytes: Vec<u8>,
    at: usize,
}

impl Bits {
    fn of(unit: &[u8]) -> Self {
        let mut bytes = Vec::with_capacity(unit.len());
        let mut zeros = 0;
        for &b in unit {
            if zeros >= 2 && b == 3 {
                zeros = 0;
                continue;
            }
            zeros = if b == 0 { zeros + 1 } else { 0 };
            bytes.push(b);
        }
        Self { bytes, at: 0 }
    }

    fn bit(&mut self) -> Option<u32> {
        let byte = self.bytes.get(self.at / 8)?;
        let bit = byte >> (7 - self.at % 8) & 1;
        self.at += 1;
        Some(u32::from(bit))
    }

    fn bits(&mut self, count: u32) -> Option<u32> {
        (0..count).try_fold(0_u32, |value, _| Some(value << 1 | self.bit()?))
    }

    /// A number in Exp-Golomb code (9.1).
    fn golomb(&mut self) -> Option<u32> {
        let mut zeros = 0;
        while self.bit()? == 0 {
            zeros += 1;
            if zeros > 31 {
                return None;
            }
        }
        let rest = self.bits(zeros)?;
        (1_u32 << zeros).checked_add(rest)?.checked_sub(1)
    }

    fn signed(&mut self) -> Option<i64> {
        let k = i64::from(self.golomb()?);
        Some(if k % 2 == 0 { -(k / 2) } else { (k + 1) / 2 })
    }
}

impl Parameters {
    /// Reads a parameter set with its header byte; absent where it breaks off.
    pub(super) fn read(unit: &[u8]) -> Option<Self> {
        let mut b = Bits::of(unit.get(1..)?);
        let profile = b.bits(8)?;
        b.bits(16)?;
        b.golomb()?;
        let (mut chroma, mut bits, mut separate) = (1, 8, false);
        if [100, 110, 122, 244, 44, 83, 86, 118, 128, 138, 139, 134, 135].contains(&profile) {
            chroma = b.golomb()?;
            separate = chroma == 3 && b.bit()? == 1;
            bits = 8 + b.golomb()?;
            b.golomb()?;
            b.bit()?;
            if b.bit()? == 1 {
                for list in 0..if chroma == 3 { 12 } else { 8 } {
                    if b.bit()? == 1 {
                        skip_scaling_list(&mut b, if list < 6 { 16 } else { 64 })?;
                    }
                }
            }
        }
        b.golomb()?;
        match b.golomb()? {
            0 => _ = b.golomb()?,
            1 => {
                b.bit()?;
                b.signed()?;
                b.signed()?;
                for _ in 0..b.golomb()?.min(255) {
                    b.signed()?;
                }
            }
            _ => {}
        }
        b.golomb()?;
        b.bit()?;
        let width = b.golomb()?.checked_add(1)?.checked_mul(16)?;
        let units = b.golomb()?.checked_add(1)?;
        let frames_only = b.bit()?;
        let height = units.checked_mul(16 * (2 - frames_only))?;
        if frames_only == 0 {
            b.bit()?;
        }
        b.bit()?;
        let mut size = [width, height];
        if b.bit()? == 1 {
            let crop = [b.golomb()?, b.golomb()?, b.golomb()?, b.golomb()?];
            let (sub_x, sub_y) = match if separate { 0 } else { chroma } {
                1 => (2, 2),
                2 => (2, 1),
                _ => (1, 1),
            };
            let cut = |a: u32, b: u32, unit: u32| a.checked_add(b)?.checked_mul(unit);
            size[0] = width.checked_sub(cut(crop[0], crop[1], sub_x)?)?;
            size[1] = height.checked_sub(cut(crop[2], crop[3], sub_y * (2 - frames_only))?)?;
        }
        let interlaced = frames_only == 0;
        let mut found = Self { chroma, bits, interlaced, size, pixel_aspect: None, matrix: None, full_range: None };
        if b.bit() == Some(1) {
            // What is said of the show is a help; a set that breaks off there is good all the same.
            let _ = found.read_show(&mut b);
        }
        Some(found)
    }

    fn read_show(&mut self, b: &mut Bits) -> Option<()> {
        if b.bit()? == 1 {
            self.pixel_aspect = match b.bits(8)? {
                255 => Some([b.bits(16)?, b.bits(16)?]),
                n => ASPECTS.get(n as usize).copied(),
            };
        }
        if b.bit()? == 1 {
            b.bit()?;
        }
        if b.bit()? == 1 {
            b.bits(3)?;
            self.full_range = Some(b.bit()? == 1);
            if b.bit()? == 1 {
                b.bits(16)?;
                self.matrix = Some(b.bits(8)?);
            }
        }
        Some(())
    }
}

fn skip_scaling_list(b: &mut Bits, size: usize) -> Option<()> {
    let (mut last, mut next) = (8_i64, 8_i64);
    for _ in 0..size {
        if next != 0 {
            next = (last + b.signed()? + 256) % 256;
        }
        last = if next == 0 { last } else { next };
    }
    Some(())
}
