//! Every equation of the thesis that the code carries stands in `docs/equations.md`, and the other way round.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop at what it did not expect")]

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Equation numbers that follow `Thesis` in a text: `Thesis (4.7)`, also `Thesis (4.3)–(4.5)` and `Thesis (4.1), (4.2)`.
fn tags(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in text.match_indices("Thesis (") {
        let rest = &text[at + "Thesis ".len()..];
        let mut last: Option<(u32, u32)> = None;
        let mut range = false;
        let mut chars = rest;
        while let Some(inner) = chars.strip_prefix('(') {
            let Some((number, after)) = inner.split_once(')') else { break };
            let Some((chapter, n)) = number.split_once('.').and_then(|(c, n)| Some((c.parse().ok()?, n.parse().ok()?)))
            else {
                break;
            };
            let from = match last {
                Some((c, m)) if range && c == chapter => m + 1,
                _ => n,
            };
            found.extend((from..=n).map(|k| format!("{chapter}.{k}")));
            last = Some((chapter, n));
            let separators = ["–", ", ", " and ", "-"];
            let Some((separator, next)) = separators.iter().find_map(|s| after.strip_prefix(s).map(|next| (*s, next)))
            else {
                break;
            };
            range = separator == "–" || separator == "-";
            chars = next;
        }
    }
    found
}

fn walk(folder: &Path, text: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            walk(&path, text);
        } else if path.extension().is_some_and(|e| e == "rs") {
            text.push_str(&fs::read_to_string(&path).unwrap());
        }
    }
}

#[test]
fn code_and_list_of_equations_agree() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut code = String::new();
    walk(&root.join("src"), &mut code);
    let list = fs::read_to_string(root.join("docs/equations.md")).unwrap();
    // A row of the list begins with "| (4.7) |"; rows that say "not yet" name equations of stages still to come.
    let listed: BTreeSet<String> = list
        .lines()
        .filter(|l| l.starts_with("| ("))
        .flat_map(|l| tags(&format!("Thesis {}", l.trim_start_matches("| "))))
        .collect();
    let in_code = tags(&code);
    let missing: Vec<_> = in_code.difference(&listed).collect();
    let gone: Vec<_> = listed.difference(&in_code).collect();
    assert!(missing.is_empty(), "in the code but not in docs/equations.md: {missing:?}");
    assert!(gone.is_empty(), "in docs/equations.md but not in the code: {gone:?}");
}

#[test]
fn ranges_and_lists_are_read() {
    let t = tags("Thesis (4.3)–(4.5), also Thesis (4.1), (4.2) and Thesis (5.2).");
    assert_eq!(t.into_iter().collect::<Vec<_>>(), ["4.1", "4.2", "4.3", "4.4", "4.5", "5.2"]);
}
