//! Words as people read them.

/// The text with a capital letter: "Largest force".
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|c| c.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// A message as a sentence: with a capital letter, and a full stop at its end.
pub fn sentence(text: &str) -> String {
    format!("{}.", capital(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_begins_with_a_capital_and_ends_with_a_stop() {
        assert_eq!(sentence("ärger: none"), "Ärger: none.");
        assert_eq!(capital(""), "");
    }
}
