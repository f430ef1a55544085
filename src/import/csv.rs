//! Marks as comma-separated text: the columns of `export --format csv` and of `suggest`, in any order.

use super::{Names, Wrong};
use crate::project::{MarkState, Which};

/// Reads the text. `id`, `x_px` and `y_px` must be there; `frame` (last), `state` (marked) and `confidence` need not.
pub(super) fn read(text: &str, names: &mut Names<'_>) -> Result<(), Wrong> {
    let mut records = Records { text, line: 1 };
    let (_, header) = records.next().ok_or_else(|| Wrong::whole("it is empty"))??;
    let column = |name: &str| header.iter().position(|h| h.trim().eq_ignore_ascii_case(name));
    let needed = |name: &'static str| {
        let kinds = "CSV with a header, TPS and COCO files are read";
        column(name).ok_or_else(|| Wrong::in_line(1, format!("there is no column `{name}`; {kinds}")))
    };
    let (id, x, y) = (needed("id")?, needed("x_px")?, needed("y_px")?);
    let (frame, state, confidence) = (column("frame"), column("state"), column("confidence"));
    for record in records {
        let (line, fields) = record?;
        if fields.iter().all(|f| f.trim().is_empty()) {
            continue;
        }
        if fields.len() != header.len() {
            return Err(Wrong::in_line(line, format!("{} fields, but the header has {}", fields.len(), header.len())));
        }
        let field = |at: usize| fields.get(at).map_or("", |f| f.trim());
        let wrong = |reason: String| Wrong::in_line(line, reason);
        let number = |at: usize| {
            let text = field(at);
            text.parse::<f64>().map_err(|_| wrong(format!("`{text}` is not a number")))
        };
        let which = match frame.map(field) {
            None | Some("last") => Which::Last,
            Some("first") => Which::First,
            Some(other) => return Err(wrong(format!("`{other}` is not a frame; it is `first` or `last`"))),
        };
        let state = match state.map(field) {
            None | Some("marked" | "") => MarkState::Marked,
            Some("uncertain") => MarkState::Uncertain,
            Some("occluded") => MarkState::Occluded,
            Some("locked") => MarkState::Locked,
            Some(other) => return Err(wrong(format!("`{other}` is not the state of a mark"))),
        };
        let sure = confidence.map(number).transpose()?;
        if sure.is_some_and(|s| !(0.0..=1.0).contains(&s)) {
            return Err(wrong("a confidence lies between 0 and 1".to_owned()));
        }
        let at = [number(x)?, number(y)?];
        names.add_sure(which, field(id), at, state, sure, &format!("line {line}")).map_err(wrong)?;
    }
    Ok(())
}

/// Records of RFC 4180, each with the number of its first line.
struct Records<'a> {
    text: &'a str,
    line: usize,
}

impl Iterator for Records<'_> {
    type Item = Result<(usize, Vec<String>), Wrong>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.text.is_empty() {
            return None;
        }
        let begun = self.line;
        let mut fields = vec![String::new()];
        let (mut quoted, mut used) = (false, self.text.len());
        let mut chars = self.text.char_indices().peekable();
        while let Some((at, c)) = chars.next() {
            let field = fields.last_mut()?;
            match c {
                '"' if quoted && chars.peek().is_some_and(|(_, n)| *n == '"') => {
                    chars.next();
                    field.push('"');
                }
                '"' if quoted => quoted = false,
                '"' if field.is_empty() => quoted = true,
                ',' if !quoted => fields.push(String::new()),
                '\n' => {
                    self.line += 1;
                    if !quoted {
                        used = at + 1;
                        break;
                    }
                    field.push(c);
                }
                '\r' if !quoted => {}
                _ => field.push(c),
            }
        }
        if quoted {
            self.text = "";
            return Some(Err(Wrong::in_line(begun, "a quote is opened and never closed")));
        }
        self.text = self.text.get(used..).unwrap_or_default();
        Some(Ok((begun, fields)))
    }
}
