//! How a project is written and read as JSON: short lists on one line, keys never twice, and every fault with its place.

use std::collections::BTreeSet;
use std::io::{self, Write};

use serde::de::{self, DeserializeOwned, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::ser::{Formatter, PrettyFormatter, Serializer};

/// Why a text is not what was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct JsonFault {
    /// Line, from 1.
    pub(crate) line: usize,
    /// Column, from 1.
    pub(crate) column: usize,
    /// The field: `features.17.last.at_px[0]`; empty where the text is not JSON at all.
    pub(crate) place: String,
    /// What is wrong.
    pub(crate) reason: String,
}

impl JsonFault {
    fn new(error: &serde_json::Error, place: String) -> Self {
        let text = error.to_string();
        let tail = format!(" at line {} column {}", error.line(), error.column());
        let reason = text.strip_suffix(&tail).unwrap_or(&text).to_owned();
        let place = if place == "." { String::new() } else { place };
        Self { line: error.line(), column: error.column(), place, reason }
    }
}

/// Writes a value with two spaces of indent and every list on one line: `"at_px": [512.25, 300.5]`.
pub(crate) fn write(value: &impl Serialize) -> serde_json::Result<Vec<u8>> {
    let mut text = Vec::new();
    value.serialize(&mut Serializer::with_formatter(&mut text, ListsInline::default()))?;
    text.push(b'\n');
    Ok(text)
}

/// Reads a value, after making sure that no object holds a key twice (readers would disagree on which one counts).
pub(crate) fn read<T: DeserializeOwned>(text: &str) -> Result<T, JsonFault> {
    let _: KeysOnce = with_place(text)?;
    with_place(text)
}

/// Reads a value, naming the place of a fault.
pub(crate) fn with_place<T: DeserializeOwned>(text: &str) -> Result<T, JsonFault> {
    let mut reader = serde_json::Deserializer::from_str(text);
    let value = serde_path_to_error::deserialize(&mut reader).map_err(|e| {
        let place = e.path().to_string();
        JsonFault::new(e.inner(), place)
    })?;
    reader.end().map_err(|e| JsonFault::new(&e, String::new()))?;
    Ok(value)
}

/// The entries of an object but one.
pub(crate) struct Without<'k, A> {
    /// All entries.
    pub(crate) entries: A,
    /// The key to leave out.
    pub(crate) key: &'k str,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Without<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: de::DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Self::Error> {
        while let Some(key) = self.entries.next_key::<String>()? {
            if key != self.key {
                return seed.deserialize(key.into_deserializer()).map(Some);
            }
            self.entries.next_value::<de::IgnoredAny>()?;
        }
        Ok(None)
    }

    fn next_value_seed<V: de::DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Self::Error> {
        self.entries.next_value_seed(seed)
    }
}

/// Any JSON in which no object holds a key twice.
struct KeysOnce;

impl<'de> Deserialize<'de> for KeysOnce {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(KeysOnce)
    }
}

impl<'de> Visitor<'de> for KeysOnce {
    type Value = Self;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("any value")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self, A::Error> {
        let mut seen = BTreeSet::new();
        while let Some(key) = map.next_key::<String>()? {
            if seen.contains(&key) {
                return Err(de::Error::custom(format!("`{key}` stands twice")));
            }
            seen.insert(key);
            map.next_value::<KeysOnce>()?;
        }
        Ok(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self, A::Error> {
        while seq.next_element::<KeysOnce>()?.is_some() {}
        Ok(self)
    }

    fn visit_bool<E>(self, _: bool) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_i64<E>(self, _: i64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_u64<E>(self, _: u64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_f64<E>(self, _: f64) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_str<E>(self, _: &str) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_unit<E>(self) -> Result<Self, E> {
        Ok(self)
    }
}

/// Pretty, but for lists, which stay on one line.
#[derive(Default)]
struct ListsInline<'a> {
    pretty: PrettyFormatter<'a>,
}

impl Formatter for ListsInline<'_> {
    fn begin_array_value<W: ?Sized + Write>(&mut self, w: &mut W, first: bool) -> io::Result<()> {
        if first { Ok(()) } else { w.write_all(b", ") }
    }

    fn begin_object<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.pretty.begin_object(w)
    }

    fn end_object<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.pretty.end_object(w)
    }

    fn begin_object_key<W: ?Sized + Write>(&mut self, w: &mut W, first: bool) -> io::Result<()> {
        self.pretty.begin_object_key(w, first)
    }

    fn begin_object_value<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.pretty.begin_object_value(w)
    }

    fn end_object_value<W: ?Sized + Write>(&mut self, w: &mut W) -> io::Result<()> {
        self.pretty.end_object_value(w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn lists_stay_on_one_line() {
        let value = BTreeMap::from([("a", vec![vec![1.0, 2.5], vec![]]), ("b", vec![])]);
        let text = String::from_utf8(write(&value).unwrap()).unwrap();
        assert_eq!(text, "{\n  \"a\": [[1.0, 2.5], []],\n  \"b\": []\n}\n");
    }

    #[test]
    fn a_key_that_stands_twice_is_refused_with_its_place() {
        let fault = read::<serde_json::Value>("{\"a\": {\n \"b\": 1, \"b\": 2}}").unwrap_err();
        assert_eq!((fault.line, fault.reason.as_str()), (2, "`b` stands twice"));
    }

    #[test]
    fn a_wrong_type_names_the_field() {
        let fault = read::<BTreeMap<String, Vec<f64>>>("{\"a\": [1,\n \"x\"]}").unwrap_err();
        assert_eq!((fault.line, fault.place.as_str()), (2, "a[1]"));
        assert!(read::<Vec<f64>>("[1] 2").is_err());
    }
}
