//! A report as one HTML file: text, tables, drawings and pictures in it, nothing beside it; prints on paper as it stands.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::muscle_tables::Table;
use crate::draw::svg::escape;

/// How it looks: figures in columns, pictures never cut by the end of a page.
const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;color:#26262c;background:#fff;max-width:1100px;margin:2em auto;padding:0 1em}\
h1{font-size:1.7em;margin-bottom:.1em}h2{font-size:1.25em;margin-top:2em;border-bottom:1px solid #d5d5dc;padding-bottom:.2em}\
.sub,figcaption,.note{color:#5a5a64}figure{margin:1em 0;break-inside:avoid}figure svg,figure img{max-width:100%;height:auto}\
table{border-collapse:collapse;margin:1em 0;font-variant-numeric:tabular-nums;break-inside:avoid}\
th,td{padding:.25em .8em;text-align:right;border-bottom:1px solid #e3e3e8}th{font-weight:600;vertical-align:bottom}\
th:first-child,td:first-child{text-align:left}tr.best td{background:#eef3fb;font-weight:600}\
code,pre{font:13px/1.45 ui-monospace,monospace;background:#f4f4f7;border-radius:4px;padding:.1em .3em}pre{padding:.7em;white-space:pre-wrap;overflow-wrap:anywhere}\
.warn{border-left:4px solid #d9822b;padding:.1em .8em;margin:.5em 0;background:#fff7ec}\
@media print{body{margin:0;max-width:none}h2{break-after:avoid}}";

/// A document in the making.
#[derive(Clone, Debug)]
pub struct Document {
    title: String,
    body: String,
}

impl Document {
    /// An empty document with a title and a line below it.
    pub fn new(title: &str, subtitle: &str) -> Self {
        let body = format!("<h1>{}</h1>\n<p class=\"sub\">{}</p>\n", escape(title), escape(subtitle));
        Self { title: title.to_owned(), body }
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(text));
    }

    /// A paragraph.
    pub fn paragraph(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p>{}</p>", escape(text));
    }

    /// A sentence that must not be overlooked.
    pub fn warning(&mut self, text: &str) {
        let _ = writeln!(self.body, "<p class=\"warn\">{}</p>", escape(text));
    }

    /// A command or other text to be copied as it stands.
    pub fn verbatim(&mut self, text: &str) {
        let _ = writeln!(self.body, "<pre>{}</pre>", escape_lines(text));
    }

    /// A table, its best row marked.
    pub fn table(&mut self, table: &Table) {
        let head: Vec<&str> = table.head.iter().map(|h| h.0).collect();
        self.rows(&head, &table.rows, table.best);
    }

    /// A table without a best row.
    pub fn plain_table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        self.rows(head, rows, None);
    }

    fn rows(&mut self, head: &[&str], rows: &[Vec<String>], best: Option<usize>) {
        let cells = |tag: &str, cells: &mut dyn Iterator<Item = &str>| {
            cells.fold(String::new(), |mut out, c| {
                let _ = write!(out, "<{tag}>{}</{tag}>", escape(c));
                out
            })
        };
        let _ = write!(self.body, "<table><thead><tr>{}</tr></thead><tbody>", cells("th", &mut head.iter().copied()));
        for (k, row) in rows.iter().enumerate() {
            let class = if Some(k) == best { " class=\"best\"" } else { "" };
            let _ = write!(self.body, "<tr{class}>{}</tr>", cells("td", &mut row.iter().map(String::as_str)));
        }
        self.body.push_str("</tbody></table>\n");
    }

    /// A drawing with words under it.
    pub fn drawing(&mut self, svg: &str, caption: &str) {
        let _ = writeln!(self.body, "<figure>{svg}<figcaption>{}</figcaption></figure>", escape(caption));
    }

    /// A picture (PNG) with words under it.
    pub fn picture(&mut self, png: &[u8], caption: &str) {
        let _ = writeln!(
            self.body,
            "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>",
            escape(caption),
            STANDARD.encode(png)
        );
    }

    /// The file's text.
    pub fn finish(self) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\"><title>{}</title><style>{STYLE}</style></head>\n<body>\n{}</body></html>\n",
            escape(&self.title),
            self.body
        )
    }
}

/// As [`escape`], with the ends of lines kept.
fn escape_lines(text: &str) -> String {
    text.lines().map(escape).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_user_wrote_cannot_become_markup() {
        let mut d = Document::new("<script>", "a & b");
        d.paragraph("1 < 2");
        d.verbatim("frontalis fit 'a b'\n--out \"x\"");
        let rows = vec![vec!["<b>".into(), "0.5".into()], vec!["Koch".into(), "0.4".into()]];
        d.table(&Table { head: vec![("law", ""), ("R²", "")], rows, best: Some(1) });
        let html = d.finish();
        assert!(!html.contains("<script>") && !html.contains("<b>"));
        assert!(html.contains("<title>&lt;script&gt;</title>") && html.contains("<p>1 &lt; 2</p>"));
        assert!(html.contains("'a b'\n--out &quot;x&quot;</pre>"));
        assert!(html.contains("<tr class=\"best\"><td>Koch</td><td>0.4</td></tr>"));
    }

    #[test]
    fn a_picture_stands_in_the_file_itself() {
        let mut d = Document::new("t", "");
        // "Man" is TWFu in base64 (RFC 4648's alphabet; the classic example).
        d.picture(b"Man", "A map");
        assert!(d.finish().contains("src=\"data:image/png;base64,TWFu\""));
    }
}
