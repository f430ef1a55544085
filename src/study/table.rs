//! The table of a study: one row a run, with what was run, how long it took, how far from the truth it ended, or why it failed.

use std::path::Path;

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::{Deserialize, Serialize};

/// One run of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The study: "stability".
    pub study: String,
    /// The question of the study that it belongs to; each has a chart of its own.
    pub part: String,
    /// The method.
    pub method: String,
    /// Its setting as `name=value` pairs with "; " between them ([`pairs`]); of a map the first is along and the second up.
    pub setting: String,
    /// Marking noise, px.
    pub noise_px: f64,
    /// Number of vertices.
    pub vertices: usize,
    /// Seed of everything random in it.
    pub seed: u64,
    /// Time it took, ms; none where time was not measured.
    pub time_ms: Option<f64>,
    /// ‖F − F_true‖ / ‖F_true‖; none where there is no truth or no answer.
    pub force_error: Option<f64>,
    /// Why it failed, in few words that are the same for the same cause; none where it ended well.
    pub cause: Option<String>,
    /// What else was measured, by name with unit: a column each.
    pub measures: BTreeMap<String, f64>,
}

/// The columns that every study has.
pub const COLUMNS: [&str; 11] =
    ["study", "part", "method", "setting", "noise_px", "vertices", "seed", "time_ms", "force_error", "status", "cause"];

/// No table has more rows.
const MOST_ROWS: usize = 1_000_000;
/// No table has more columns.
const MOST_COLUMNS: usize = 100;

impl Run {
    /// A run that ended well; times and errors are added to it.
    pub fn new(study: &str, part: &str, method: &str, setting: String) -> Self {
        Self { study: study.into(), part: part.into(), method: method.into(), setting, ..Self::default() }
    }

    /// Whether it ended well.
    pub fn is_ok(&self) -> bool {
        self.cause.is_none()
    }

    /// With the time it took, rounded to four digits: more is noise.
    #[must_use]
    pub fn timed(mut self, ms: f64) -> Self {
        self.time_ms = rounded(ms);
        self
    }

    /// With its error; an error that is no number is a failure.
    #[must_use]
    pub fn erring(mut self, error: f64) -> Self {
        if error.is_finite() {
            self.force_error = Some(error);
        } else if self.cause.is_none() {
            self.cause = Some("forces are no numbers".to_owned());
        }
        self
    }

    /// With a cause of failure, if there is one.
    #[must_use]
    pub fn failing(mut self, cause: Option<String>) -> Self {
        self.cause = self.cause.or(cause);
        self
    }

    /// With a further measure; one that is no number is left out. Names that end in `_ms` or `_mb` are times and memory, which differ from
    /// run to run.
    #[must_use]
    pub fn with(mut self, name: &str, value: f64) -> Self {
        if value.is_finite() {
            self.measures.insert(name.to_owned(), value);
        }
        self
    }

    /// Without what differs from run to run on the same seed.
    #[must_use]
    pub fn without_times(mut self) -> Self {
        self.time_ms = None;
        self.measures.retain(|name, _| !differs(name));
        self
    }
}

fn differs(name: &str) -> bool {
    (name.ends_with("_ms") && name != "limit_ms") || name.ends_with("_mb")
}

/// A time or memory to four digits; none where it is no number.
pub fn rounded(value: f64) -> Option<f64> {
    value.is_finite().then(|| format!("{value:.3e}").parse().unwrap_or(value))
}

/// A setting as text: `name=value; name=value`.
pub fn setting(pairs: &[(&str, f64)]) -> String {
    pairs.iter().map(|(name, value)| format!("{name}={value}")).collect::<Vec<_>>().join("; ")
}

/// The pairs of a setting; a piece without "=" has no name.
pub fn pairs(setting: &str) -> Vec<(&str, &str)> {
    let pieces = setting.split(';').map(str::trim).filter(|p| !p.is_empty());
    pieces.map(|p| p.split_once('=').map_or(("", p), |(name, value)| (name.trim(), value.trim()))).collect()
}

/// The name of a setting as words with its unit: `step_ms` is "step, ms".
pub fn words(name: &str) -> String {
    const UNITS: [(&str, &str); 9] = [
        ("ms", "ms"),
        ("mm", "mm"),
        ("px", "px"),
        ("percent", "%"),
        ("deg", "°"),
        ("N", "N"),
        ("s", "s"),
        ("kPa", "kPa"),
        ("mb", "MB"),
    ];
    let known = name.rsplit_once('_').and_then(|(rest, unit)| Some((rest, UNITS.iter().find(|u| u.0 == unit)?.1)));
    known.map_or_else(|| name.replace('_', " "), |(rest, unit)| format!("{}, {unit}", rest.replace('_', " ")))
}

/// A setting as words: "step 0.5 ms, stiffness 10".
pub fn in_words(setting: &str) -> String {
    let pair = |(name, value): (&str, &str)| match words(name).split_once(", ") {
        Some((word, unit)) => format!("{word} {value} {unit}"),
        None => format!("{} {value}", words(name)),
    };
    pairs(setting).into_iter().map(pair).map(|w| w.trim().to_owned()).collect::<Vec<_>>().join(", ")
}

/// The table as CSV: [`COLUMNS`], then one column for every further measure.
pub fn csv(runs: &[Run]) -> String {
    let mut names: Vec<&str> = runs.iter().flat_map(|r| r.measures.keys().map(String::as_str)).collect();
    names.sort_unstable();
    names.dedup();
    let mut text = COLUMNS.join(",");
    for name in &names {
        let _ = write!(text, ",{}", field(name));
    }
    text.push('\n');
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    for r in runs {
        let words = [&r.study, &r.part, &r.method, &r.setting].map(|w| field(w));
        let status = if r.is_ok() { "ok" } else { "failed" };
        let _ = write!(
            text,
            "{},{},{},{},{},{},{status},{}",
            words.join(","),
            r.noise_px,
            r.vertices,
            r.seed,
            number(r.time_ms),
            number(r.force_error),
            field(r.cause.as_deref().unwrap_or_default())
        );
        for name in &names {
            let _ = write!(text, ",{}", number(r.measures.get(*name).copied()));
        }
        text.push('\n');
    }
    text
}

fn field(word: &str) -> String {
    if word.contains([',', '"', '\n', '\r']) { format!("\"{}\"", word.replace('"', "\"\"")) } else { word.to_owned() }
}

/// Why a text is no table of a study.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {why}")]
pub struct TableError {
    /// The line, from 1.
    pub line: usize,
    /// What is wrong.
    pub why: String,
}

/// A table of a study is never so large, bytes.
const LARGEST: u64 = 256 << 20;

/// Reads a table from a file.
///
/// # Errors
/// What is wrong with the file, in a line without its name.
pub fn read_file(path: &Path) -> Result<Vec<Run>, String> {
    let size = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
    if size > LARGEST {
        return Err(format!("is {} MB large; no table of a study is", size >> 20));
    }
    let bytes = std::fs::read(path).map_err(|e| e.to_string())?;
    let text = String::from_utf8(bytes).map_err(|_| "is no text".to_owned())?;
    read_csv(&text).map_err(|e| e.to_string())
}

/// Reads a table that [`csv`] wrote, or that another program saved again: columns in any order, further numeric columns as measures.
///
/// # Errors
/// The line, the column and the reason.
pub fn read_csv(text: &str) -> Result<Vec<Run>, TableError> {
    let records = records(text)?;
    let mut records = records.into_iter();
    let refuse = |line: usize, why: String| TableError { line, why };
    let (_, head) = records.next().ok_or_else(|| refuse(1, "the table is empty".into()))?;
    if head.len() > MOST_COLUMNS {
        return Err(refuse(1, format!("it has {} columns; a study has at most {MOST_COLUMNS}", head.len())));
    }
    let places = COLUMNS.map(|name| head.iter().position(|h| h.trim() == name));
    // `part` came later than the others: without it all rows are one.
    if let Some(missing) = (0..COLUMNS.len()).find(|&k| places[k].is_none() && COLUMNS[k] != "part") {
        return Err(refuse(1, format!("the column {} is missing: this is no table of a study", COLUMNS[missing])));
    }
    let mut runs = Vec::new();
    for (line, record) in records {
        if runs.len() >= MOST_ROWS {
            return Err(refuse(line, format!("a study has at most {MOST_ROWS} rows")));
        }
        if record.len() != head.len() {
            return Err(refuse(line, format!("{} fields where the head has {}", record.len(), head.len())));
        }
        let word = |k: usize| places[k].map_or("", |at| record[at].trim());
        let bad = |k: usize| refuse(line, format!("{} is \"{}\", no number", COLUMNS[k], word(k)));
        let real = |k: usize| match word(k) {
            "" => Ok(None),
            text => text.parse::<f64>().ok().filter(|v| v.is_finite()).map(Some).ok_or_else(|| bad(k)),
        };
        let whole = |k: usize| word(k).parse::<u64>().map_err(|_| bad(k));
        let cause = match word(9) {
            "ok" => None,
            "failed" => Some(if word(10).is_empty() { "no cause given".to_owned() } else { word(10).to_owned() }),
            other => return Err(refuse(line, format!("status is \"{other}\"; it must be ok or failed"))),
        };
        let mut run = Run {
            study: word(0).to_owned(),
            part: word(1).to_owned(),
            method: word(2).to_owned(),
            setting: word(3).to_owned(),
            noise_px: real(4)?.unwrap_or(0.0),
            vertices: whole(5)? as usize,
            seed: whole(6)?,
            time_ms: real(7)?,
            force_error: real(8)?,
            cause,
            measures: BTreeMap::new(),
        };
        for (name, value) in head.iter().zip(&record).filter(|(name, _)| !COLUMNS.contains(&name.trim())) {
            if let Some(value) = value.trim().parse::<f64>().ok().filter(|v| v.is_finite()) {
                run.measures.insert(name.trim().to_owned(), value);
            }
        }
        runs.push(run);
    }
    Ok(runs)
}

/// The records of a CSV text (RFC 4180) with the line at which each begins; empty lines are left out.
fn records(text: &str) -> Result<Vec<(usize, Vec<String>)>, TableError> {
    let (mut all, mut record, mut word) = (Vec::new(), Vec::new(), String::new());
    let (mut quoted, mut line, mut begun) = (false, 1, 1);
    let mut letters = text.trim_start_matches('\u{feff}').chars().peekable();
    let mut end = |record: &mut Vec<String>, word: &mut String, begun: usize| {
        record.push(std::mem::take(word));
        let whole = std::mem::take(record);
        if whole.len() > 1 || !whole[0].trim().is_empty() {
            all.push((begun, whole));
        }
    };
    while let Some(c) = letters.next() {
        match c {
            '"' if quoted && letters.peek() == Some(&'"') => {
                letters.next();
                word.push('"');
            }
            '"' if quoted => quoted = false,
            '"' if word.is_empty() => quoted = true,
            ',' if !quoted => record.push(std::mem::take(&mut word)),
            '\r' if !quoted => {}
            '\n' => {
                line += 1;
                if quoted {
                    word.push('\n');
                } else {
                    end(&mut record, &mut word, begun);
                    begun = line;
                }
            }
            c => word.push(c),
        }
    }
    if quoted {
        return Err(TableError { line: begun, why: "a quoted field never ends".into() });
    }
    end(&mut record, &mut word, begun);
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs() -> Vec<Run> {
        let setting = setting(&[("step_ms", 0.5), ("stiffness", 10.0)]);
        let run = Run { noise_px: 0.25, vertices: 612, seed: 7, ..Run::new("stability", "a, b", "say \"x\"", setting) };
        let failed = Run { cause: Some("ran away".into()), ..run.clone() };
        vec![run.timed(1.234_567).erring(0.1).with("limit", 2.5), failed]
    }

    #[test]
    fn a_table_comes_back_as_it_was_written() {
        let text = csv(&runs());
        let head = "study,part,method,setting,noise_px,vertices,seed,time_ms,force_error,status,cause,limit\n";
        assert!(text.starts_with(head), "{text}");
        assert!(text.contains("\"a, b\",\"say \"\"x\"\"\",step_ms=0.5; stiffness=10,0.25,612,7,1.235,0.1,ok,,2.5\n"));
        assert_eq!(read_csv(&text), Ok(runs()));
        // As a spreadsheet saves it: other line ends, a byte order mark, an empty line.
        assert_eq!(read_csv(&format!("\u{feff}{}\r\n", text.replace('\n', "\r\n"))), Ok(runs()));
        assert_eq!(pairs(&runs()[0].setting), [("step_ms", "0.5"), ("stiffness", "10")]);
        assert_eq!(pairs("plain"), [("", "plain")]);
        assert_eq!(in_words(&runs()[0].setting), "step 0.5 ms, stiffness 10");
        assert_eq!((words("pressed_to_percent"), in_words("plain")), ("pressed to, %".into(), "plain".into()));
    }

    #[test]
    fn what_is_no_table_is_refused_with_line_and_reason() {
        let text = csv(&runs());
        let wrong = |from: &str, to: &str| read_csv(&text.replacen(from, to, 1)).unwrap_err().to_string();
        assert_eq!(read_csv("").unwrap_err().to_string(), "line 1: the table is empty");
        assert_eq!(wrong("seed", "sed"), "line 1: the column seed is missing: this is no table of a study");
        assert_eq!(wrong(",612,", ",six,"), "line 2: vertices is \"six\", no number");
        assert_eq!(wrong(",0.1,ok", ",NaN,ok"), "line 2: force_error is \"NaN\", no number");
        assert_eq!(wrong(",ok,", ",well,"), "line 2: status is \"well\"; it must be ok or failed");
        assert_eq!(wrong(",612,", ","), "line 2: 11 fields where the head has 12");
        assert_eq!(read_csv("study,part\n\"a,b").unwrap_err().to_string(), "line 2: a quoted field never ends");
    }

    #[test]
    fn nonsense_is_a_failure_and_times_can_be_left_out() {
        let run = Run::new("s", "p", "m", String::new()).erring(f64::NAN).timed(f64::INFINITY).with("x", f64::NAN);
        assert_eq!(run.cause.as_deref(), Some("forces are no numbers"));
        assert!(run.time_ms.is_none() && run.force_error.is_none() && run.measures.is_empty());
        let timed = run.timed(3.0).with("stream_ms", 1.0).with("peak_mb", 2.0).with("limit_ms", 3.0).without_times();
        assert!(timed.time_ms.is_none());
        assert_eq!(timed.measures.keys().collect::<Vec<_>>(), ["limit_ms"]);
    }
}
