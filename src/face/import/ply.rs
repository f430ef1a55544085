//! Stanford PLY, as text or binary in either byte order: vertices and polygons in, every other element and property passed over.

use std::fmt::Write as _;

use nalgebra::Point3;

use super::{ImportError, Soup, polygon};

/// The number types of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Number {
    fn named(word: &str) -> Option<Self> {
        Some(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

#[derive(Clone, Debug)]
enum Kind {
    One(Number),
    List { count: Number, item: Number },
}

#[derive(Clone, Debug)]
struct Property {
    name: String,
    kind: Kind,
}

#[derive(Clone, Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Reads a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<Soup, ImportError> {
    let header = Header::parse(bytes)?;
    let mut data = match header.encoding {
        Encoding::Text => Data::Text(Text { bytes, at: header.end, line: header.lines, words: Vec::new(), next: 0 }),
        order => Data::Binary { bytes, at: header.end, big: order == Encoding::BigEndian },
    };
    let mut positions = Vec::new();
    let mut faces = Faces::default();
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => positions = vertices(element, &mut data)?,
            "face" => faces.read(element, &mut data)?,
            // An element without properties takes no room, however many are declared.
            _ if element.properties.is_empty() => {}
            _ => {
                for row in 0..element.count {
                    data.begin(element, row)?;
                    for property in &element.properties {
                        data.skip(property)?;
                    }
                    data.end()?;
                }
            }
        }
    }
    faces.cut(positions)
}

fn vertices(element: &Element, data: &mut Data<'_>) -> Result<Vec<Point3<f64>>, ImportError> {
    let mut positions = Vec::new();
    for row in 0..element.count {
        data.begin(element, row)?;
        let mut point = [0.0; 3];
        for property in &element.properties {
            let axis = ["x", "y", "z"].iter().position(|a| *a == property.name);
            match (axis, &property.kind) {
                (Some(axis), Kind::One(number)) => {
                    point[axis] = data.number(*number)?;
                    if !point[axis].is_finite() {
                        return Err(data.refusal(format!("{} of vertex {row} is not a finite number", property.name)));
                    }
                }
                _ => data.skip(property)?,
            }
        }
        data.end()?;
        positions.push(Point3::from(point));
    }
    Ok(positions)
}

/// Polygons before the vertices are known to be there.
#[derive(Default)]
struct Faces {
    corners: Vec<u32>,
    ends: Vec<usize>,
    /// The first corner that cannot be a vertex of fewer than so many, kept to name its place: vertices may stand behind faces.
    largest: Option<(u32, ImportError)>,
}

impl Faces {
    fn read(&mut self, element: &Element, data: &mut Data<'_>) -> Result<(), ImportError> {
        for row in 0..element.count {
            data.begin(element, row)?;
            for property in &element.properties {
                match &property.kind {
                    Kind::List { count, item }
                        if ["vertex_indices", "vertex_index"].contains(&property.name.as_str()) =>
                    {
                        self.polygon(row, data, *count, *item)?;
                    }
                    _ => data.skip(property)?,
                }
            }
            data.end()?;
        }
        Ok(())
    }

    fn polygon(&mut self, row: u64, data: &mut Data<'_>, count: Number, item: Number) -> Result<(), ImportError> {
        let corners = data.number(count)?;
        if !(corners >= 3.0 && corners <= polygon::MOST_CORNERS as f64 && corners.fract() == 0.0) {
            return Err(
                data.refusal(format!("face {row} has {corners} corners; 3 to {} are read", polygon::MOST_CORNERS))
            );
        }
        for _ in 0..corners as usize {
            let index = data.number(item)?;
            if !(index >= 0.0 && index < f64::from(u32::MAX) && index.fract() == 0.0) {
                return Err(data.refusal(format!("face {row} names vertex {index}")));
            }
            let index = index as u32;
            if self.largest.as_ref().is_none_or(|(largest, _)| index > *largest) {
                self.largest = Some((index, data.refusal(format!("face {row} names vertex {index}"))));
            }
            self.corners.push(index);
        }
        self.ends.push(self.corners.len());
        Ok(())
    }

    fn cut(self, positions: Vec<Point3<f64>>) -> Result<Soup, ImportError> {
        if let Some((index, mut refusal)) = self.largest
            && index as usize >= positions.len()
        {
            if let ImportError::Line { reason, .. } | ImportError::Byte { reason, .. } = &mut refusal {
                let _ = write!(reason, ", but there are only {} vertices", positions.len());
            }
            return Err(refusal);
        }
        let mut soup = Soup { positions, ..Soup::default() };
        let mut start = 0;
        for end in self.ends {
            if !polygon::cut(&self.corners[start..end], &soup.positions, &mut soup.triangles) {
                soup.crossed_polygons += 1;
            }
            start = end;
        }
        Ok(soup)
    }
}

struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// Byte after the header.
    end: usize,
    /// Its number of lines.
    lines: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, ImportError> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let (mut at, mut line) = (0, 0);
        loop {
            let end_of_line = bytes[at..].iter().position(|b| *b == b'\n' || *b == b'\r');
            line += 1;
            let failed = |reason: &str| ImportError::Line { line, reason: reason.to_owned() };
            let Some(length) = end_of_line else { return Err(failed("the file ends before `end_header`")) };
            let text = String::from_utf8_lossy(&bytes[at..at + length]).into_owned();
            at += length + 1;
            if bytes[at - 1] == b'\r' && bytes.get(at) == Some(&b'\n') {
                at += 1;
            }
            let words: Vec<&str> = text.split_whitespace().collect();
            match words.as_slice() {
                ["ply"] if line == 1 => {}
                _ if line == 1 => return Err(failed("a PLY file begins with the line `ply`")),
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, "1.0"] => {
                    encoding = Some(match *name {
                        "ascii" => Encoding::Text,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        _ => return Err(failed(&format!("the format `{name}` is not known"))),
                    });
                }
                ["element", name, count] => {
                    let count =
                        count.parse().map_err(|_| failed(&format!("the count is `{count}`, not a whole number")))?;
                    elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                ["property", rest @ ..] => {
                    let number = |word: &str| {
                        Number::named(word).ok_or_else(|| failed(&format!("the type `{word}` is not known")))
                    };
                    let (name, kind) = match rest {
                        ["list", count, item, name] => {
                            (name, Kind::List { count: number(count)?, item: number(item)? })
                        }
                        [kind, name] => (name, Kind::One(number(kind)?)),
                        _ => {
                            return Err(failed("a property is `property TYPE NAME` or `property list TYPE TYPE NAME`"));
                        }
                    };
                    let element =
                        elements.last_mut().ok_or_else(|| failed("a property stands before the first element"))?;
                    element.properties.push(Property { name: (*name).to_owned(), kind });
                }
                ["end_header"] => {
                    let encoding = encoding.ok_or_else(|| failed("the header has no `format` line"))?;
                    let header = Self { encoding, elements, end: at, lines: line };
                    return header.complete().map_err(|reason| failed(&reason)).map(|()| header);
                }
                _ => {
                    return Err(failed(&format!(
                        "`{}` is not a line of a PLY header",
                        text.chars().take(40).collect::<String>()
                    )));
                }
            }
        }
    }

    /// Whether the elements that make a mesh are there, once, with what they need.
    fn complete(&self) -> Result<(), String> {
        for (name, needed) in [("vertex", vec!["x", "y", "z"]), ("face", Vec::new())] {
            let mut all = self.elements.iter().filter(|e| e.name == name);
            let element = all.next().ok_or_else(|| {
                let strips = self.elements.iter().any(|e| e.name == "tristrips");
                let hint = if strips { "; triangle strips are not read: save it with triangles" } else { "" };
                format!("the header declares no element `{name}`{hint}")
            })?;
            if all.next().is_some() {
                return Err(format!("the header declares the element `{name}` twice"));
            }
            let has = |p: &str| element.properties.iter().any(|q| q.name == p && matches!(q.kind, Kind::One(_)));
            if let Some(missing) = needed.iter().find(|p| !has(p)) {
                return Err(format!("the element `{name}` has no property `{missing}`"));
            }
        }
        let lists = |p: &Property| {
            matches!(p.kind, Kind::List { .. }) && ["vertex_indices", "vertex_index"].contains(&p.name.as_str())
        };
        let faces = self.elements.iter().find(|e| e.name == "face");
        if faces.is_some_and(|f| f.properties.iter().filter(|p| lists(p)).count() != 1) {
            return Err("the element `face` needs one list `vertex_indices`".to_owned());
        }
        Ok(())
    }
}

/// The data after the header, read number by number.
enum Data<'a> {
    Text(Text<'a>),
    Binary { bytes: &'a [u8], at: usize, big: bool },
}

struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    words: Vec<&'a [u8]>,
    next: usize,
}

impl Text<'_> {
    /// Fetches the next line that is not empty.
    fn fetch(&mut self) -> bool {
        while self.at < self.bytes.len() {
            let rest = &self.bytes[self.at..];
            let length = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
            self.at += length + 1;
            self.line += 1;
            self.words.clear();
            self.words.extend(rest[..length].split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()));
            self.next = 0;
            if !self.words.is_empty() {
                return true;
            }
        }
        false
    }
}

impl Data<'_> {
    fn refusal(&self, reason: String) -> ImportError {
        match self {
            Self::Text(text) => ImportError::Line { line: text.line, reason },
            Self::Binary { at, .. } => ImportError::Byte { byte: *at, reason },
        }
    }

    /// Goes to the next row.
    fn begin(&mut self, element: &Element, row: u64) -> Result<(), ImportError> {
        let there = match self {
            Self::Text(text) => text.fetch(),
            Self::Binary { bytes, at, .. } => *at < bytes.len(),
        };
        if there {
            return Ok(());
        }
        Err(self.refusal(format!("the file ends after {row} of {} rows of `{}`", element.count, element.name)))
    }

    /// Makes sure that nothing is left in a row of text.
    fn end(&mut self) -> Result<(), ImportError> {
        match self {
            Self::Text(text) if text.next < text.words.len() => {
                let reason = format!("the line has {} numbers, but {} are declared", text.words.len(), text.next);
                Err(self.refusal(reason))
            }
            _ => Ok(()),
        }
    }

    fn number(&mut self, kind: Number) -> Result<f64, ImportError> {
        match self {
            Self::Text(text) => {
                let Some(word) = text.words.get(text.next) else {
                    let reason = format!("the line has only {} numbers", text.words.len());
                    return Err(self.refusal(reason));
                };
                text.next += 1;
                let word = String::from_utf8_lossy(word).into_owned();
                word.parse().map_err(|_| self.refusal(format!("`{word}` is not a number")))
            }
            Self::Binary { bytes, at, big } => {
                let rest = bytes.get(*at..).unwrap_or_default();
                macro_rules! take {
                    ($type:ty) => {
                        rest.first_chunk().map(|b| {
                            *at += size_of::<$type>();
                            if *big { <$type>::from_be_bytes(*b) } else { <$type>::from_le_bytes(*b) }.into()
                        })
                    };
                }
                let value: Option<f64> = match kind {
                    Number::I8 => take!(i8),
                    Number::U8 => take!(u8),
                    Number::I16 => take!(i16),
                    Number::U16 => take!(u16),
                    Number::I32 => take!(i32),
                    Number::U32 => take!(u32),
                    Number::F32 => take!(f32),
                    Number::F64 => take!(f64),
                };
                value.ok_or_else(|| self.refusal("the file ends within a row".to_owned()))
            }
        }
    }

    fn skip(&mut self, property: &Property) -> Result<(), ImportError> {
        match property.kind {
            Kind::One(number) => {
                self.number(number)?;
            }
            Kind::List { count, item } => {
                let n = self.number(count)?;
                if !(n >= 0.0 && n.fract() == 0.0) {
                    return Err(self.refusal(format!("the list `{}` has {n} items", property.name)));
                }
                let mut left = n;
                while left > 0.0 {
                    self.number(item)?;
                    left -= 1.0;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "ply\nformat ascii 1.0\ncomment a sheet\nelement vertex 4\nproperty float x\nproperty uchar red\nproperty double y\nproperty float z\nelement cloud 0\nelement edge 1\nproperty list uchar float weights\nproperty int a\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uint8 int8 flags\nend_header\n0 255 0 0\n1 0 0 0\n\n1 9 1 0\n0 9 1 0.5\n3 0.5 1e3 -1 7\n3 0 1 2 0\n3 0 2 3 2 -1 1\n";

    /// The same sheet in binary, with indices of 16 bits.
    fn binary(big: bool) -> Vec<u8> {
        let order = if big { "big" } else { "little" };
        let mut bytes = format!("ply\r\nformat binary_{order}_endian 1.0\r\nelement vertex 4\r\nproperty double x\r\nproperty float32 y\r\nproperty float z\r\nproperty list short ushort extra\r\nelement face 1\r\nproperty list uint uint16 vertex_index\r\nend_header\r\n").into_bytes();
        let put = |bytes: &mut Vec<u8>, mut part: Vec<u8>| {
            if big {
                part.reverse();
            }
            bytes.extend(part);
        };
        for (x, y, z) in [(0.0_f64, 0.0_f32, 0.0_f32), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.5)] {
            put(&mut bytes, x.to_le_bytes().to_vec());
            put(&mut bytes, y.to_le_bytes().to_vec());
            put(&mut bytes, z.to_le_bytes().to_vec());
            put(&mut bytes, 1_i16.to_le_bytes().to_vec());
            put(&mut bytes, 7_u16.to_le_bytes().to_vec());
        }
        put(&mut bytes, 4_u32.to_le_bytes().to_vec());
        for i in 0..4_u16 {
            put(&mut bytes, i.to_le_bytes().to_vec());
        }
        bytes
    }

    #[test]
    fn text_and_both_byte_orders_give_the_same_sheet() {
        for bytes in [TEXT.as_bytes().to_vec(), binary(false), binary(true)] {
            let soup = parse(&bytes).unwrap();
            assert_eq!(soup.triangles, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!(soup.positions, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]].map(Point3::from));
        }
    }

    #[test]
    fn damage_is_named_with_its_line() {
        for (from, to, said) in [
            ("ply\n", "pony\n", "line 1: a PLY file begins with the line `ply`"),
            ("ascii", "utf8", "line 2: the format `utf8` is not known"),
            ("format ascii 1.0\n", "", "line 15: the header has no `format` line"),
            ("float x", "half x", "line 5: the type `half` is not known"),
            ("float x", "float u", "line 16: the element `vertex` has no property `x`"),
            ("vertex 4", "vertex -4", "line 4: the count is `-4`, not a whole number"),
            ("vertex 4", "vertex", "line 4: `element vertex` is not a line of a PLY header"),
            ("end_header", "end", "line 16: `end` is not a line"),
            ("element face", "element faces", "line 16: the header declares no element `face`"),
            ("element cloud", "element vertex", "line 16: the header declares the element `vertex` twice"),
            ("vertex_indices", "corners", "line 16: the element `face` needs one list `vertex_indices`"),
            ("vertex 4", "vertex 1000000000", "line 22: the line has 5 numbers, but 4 are declared"),
            ("face 2", "face 1000000000", "line 24: the file ends after 2 of 1000000000 rows of `face`"),
            ("1 9 1 0", "1 9 nan 0", "line 20: y of vertex 2 is not a finite number"),
            ("1 9 1 0", "1 9 1", "line 20: the line has only 3 numbers"),
            ("1 9 1 0", "1 9 x 0", "line 20: `x` is not a number"),
            ("3 0 1 2 0", "3 0 1 -2 0", "line 23: face 0 names vertex -2"),
            ("3 0 1 2 0", "3 0 1 4 0", "line 23: face 0 names vertex 4, but there are only 4 vertices"),
            ("3 0 1 2 0", "3 0 1 1.5 0", "line 23: face 0 names vertex 1.5"),
            ("3 0 1 2 0", "2 0 1 0", "line 23: face 0 has 2 corners"),
            ("3 0.5 1e3 -1 7", "-3 7", "line 22: the list `weights` has -3 items"),
        ] {
            assert!(TEXT.contains(from), "{from}");
            let error = parse(TEXT.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with(said), "{from} -> {to}: {error}");
        }
        // A missing comment line moves nothing: what counts is that no cut of the file is taken for a whole one.
        for end in 0..TEXT.len() - 2 {
            assert!(parse(&TEXT.as_bytes()[..end]).is_err(), "cut at {end}");
        }
    }

    #[test]
    fn cut_binary_is_named_with_its_byte() {
        let whole = binary(true);
        for end in 0..whole.len() {
            let error = parse(&whole[..end]).unwrap_err().to_string();
            assert!(error.starts_with("byte ") || error.starts_with("line "), "{error}");
        }
        assert!(parse(&whole[..whole.len() - 1]).unwrap_err().to_string().contains("the file ends within a row"));
    }

    #[test]
    fn declared_numbers_take_no_memory_and_no_time() {
        let head = "ply\nformat binary_little_endian 1.0\nelement void 18446744073709551615\nelement vertex 1000000000\nproperty float x\nproperty float y\nproperty float z\nelement face 1000000000\nproperty list uint int vertex_indices\nend_header\n";
        let error = parse(format!("{head}abcdabcdabcd").as_bytes()).unwrap_err().to_string();
        assert!(error.contains("after 1 of 1000000000 rows of `vertex`"), "{error}");
    }
}
