//! CANDIDE wireframes: a list of vertices and a list of triangles, each after its length; the animation and texture data behind
//! them are passed over.

use std::str::{FromStr, SplitWhitespace};

use nalgebra::Point3;

use super::{ImportError, Soup};

/// Reads a CANDIDE text. A line may end in a comment after `#`.
pub(super) fn parse(text: &str) -> Result<Soup, ImportError> {
    let mut rows = Rows { text, lines: text.lines().enumerate() };
    let mut soup = Soup::default();
    let vertices = rows.count("vertices")?;
    for row in 0..vertices {
        let (line, mut words) = rows.next("vertices", row, vertices)?;
        let mut point = [0.0; 3];
        for (axis, value) in ["x", "y", "z"].into_iter().zip(&mut point) {
            *value = number::<f64>(&mut words, line, axis)?;
            if !value.is_finite() {
                return Err(ImportError::Line { line, reason: format!("{axis} is not a finite number") });
            }
        }
        ended(words, line, "a vertex has three numbers")?;
        soup.positions.push(Point3::from(point));
    }
    let triangles = rows.count("triangles")?;
    for row in 0..triangles {
        let (line, mut words) = rows.next("triangles", row, triangles)?;
        let mut corners = [0; 3];
        for (name, corner) in ["first corner", "second corner", "third corner"].into_iter().zip(&mut corners) {
            let index = number::<i64>(&mut words, line, name)?;
            *corner = u32::try_from(index).ok().filter(|&i| (i as usize) < soup.positions.len()).ok_or_else(|| {
                let reason = format!(
                    "the {name} is vertex {index}, but the vertices are 0 to {}",
                    soup.positions.len().saturating_sub(1)
                );
                ImportError::Line { line, reason }
            })?;
        }
        ended(words, line, "a triangle has three corners")?;
        soup.triangles.push(corners);
    }
    Ok(soup)
}

struct Rows<'a> {
    text: &'a str,
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
}

impl<'a> Rows<'a> {
    /// The next line that is neither empty nor a comment, with its number.
    fn row(&mut self) -> Option<(usize, SplitWhitespace<'a>)> {
        self.lines.by_ref().find_map(|(i, line)| {
            let line = line.split('#').next().unwrap_or_default();
            (!line.trim().is_empty()).then(|| (i + 1, line.split_whitespace()))
        })
    }

    fn end(&self) -> usize {
        self.text.lines().count()
    }

    fn count(&mut self, what: &str) -> Result<u64, ImportError> {
        let line = self.end();
        let missing = || ImportError::Line { line, reason: format!("the file ends before the number of {what}") };
        let (line, mut words) = self.row().ok_or_else(missing)?;
        let count = number::<u64>(&mut words, line, &format!("number of {what}"))?;
        ended(words, line, &format!("the number of {what} stands alone in its line"))?;
        Ok(count)
    }

    fn next(&mut self, what: &str, row: u64, of: u64) -> Result<(usize, SplitWhitespace<'a>), ImportError> {
        let line = self.end();
        self.row()
            .ok_or_else(|| ImportError::Line { line, reason: format!("the file ends after {row} of {of} {what}") })
    }
}

fn number<T: FromStr>(words: &mut SplitWhitespace<'_>, line: usize, what: &str) -> Result<T, ImportError> {
    let failed = |reason| ImportError::Line { line, reason };
    let word = words.next().ok_or_else(|| failed(format!("the {what} is missing")))?;
    word.parse().map_err(|_| failed(format!("the {what} is `{word}`, not a number")))
}

fn ended(mut words: SplitWhitespace<'_>, line: usize, rule: &str) -> Result<(), ImportError> {
    match words.next() {
        None => Ok(()),
        Some(word) => Err(ImportError::Line { line, reason: format!("`{word}` is one too many: {rule}") }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "# VERTEX LIST:\n4\n0 0 0\n1 0 -0 # a comment\n1 1 0\n0 1 0\n\n# FACE LIST:\n2\n0 1 2\n0 2 3\n\n# ANIMATION UNITS LIST:\n1\n1\n0 0 0 1\n";

    #[test]
    fn vertices_and_triangles_are_read_and_the_rest_passed_over() {
        let soup = parse(SMALL).unwrap();
        assert_eq!(soup.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(soup.positions[2], Point3::new(1.0, 1.0, 0.0));
    }

    #[test]
    fn damage_is_named_with_its_line() {
        let refusal = |from: &str, to: &str| parse(&SMALL.replacen(from, to, 1)).unwrap_err().to_string();
        assert_eq!(refusal("\n4\n", "\n1000000000\n"), "line 9: the y is missing");
        assert_eq!(refusal("\n4\n", "\n-4\n"), "line 2: the number of vertices is `-4`, not a number");
        assert_eq!(refusal("4\n", ""), "line 2: `0` is one too many: the number of vertices stands alone in its line");
        assert_eq!(refusal("1 1 0", "1 nan 0"), "line 5: y is not a finite number");
        assert_eq!(refusal("1 1 0", "1 1"), "line 5: the z is missing");
        assert_eq!(refusal("0 2 3", "0 2 4"), "line 11: the third corner is vertex 4, but the vertices are 0 to 3");
        assert_eq!(refusal("0 2 3", "0 -2 3"), "line 11: the second corner is vertex -2, but the vertices are 0 to 3");
        assert_eq!(refusal("0 2 3", "0 2 3 3"), "line 11: `3` is one too many: a triangle has three corners");
        let cut = &SMALL[..SMALL.find("0 2 3").unwrap()];
        assert_eq!(parse(cut).unwrap_err().to_string(), "line 10: the file ends after 1 of 2 triangles");
        assert_eq!(parse("").unwrap_err().to_string(), "line 0: the file ends before the number of vertices");
        assert_eq!(
            parse("1000000000\n0 0 0\n").unwrap_err().to_string(),
            "line 2: the file ends after 1 of 1000000000 vertices"
        );
    }
}
