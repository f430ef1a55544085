//! Which key does what: the keys of the table of actions, with what the person has changed, kept in the user's configuration.

use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::{Id, Key, Modifiers};
use serde::{Deserialize, Serialize};

use super::action::{Action, Chord, HOLDS, TABLE};
use crate::project::whole_file::{self, Durability};

/// Name of the file in the folder of the program's state.
const NAME: &str = "keys.json";

/// Version of that file.
const VERSION: u32 = 1;

/// What acts while its key is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Hold {
    /// Each pane shows the other's picture.
    Blink,
    /// The left button pans.
    Pan,
}

/// What a key can be given to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Bound {
    /// Something that a key does when it is pressed.
    Press(Action),
    /// Something that a key does while it is held.
    Hold(Hold),
}

impl Bound {
    /// Everything that can have a key.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|s| Self::Press(s.action)).chain(HOLDS.iter().map(|h| Self::Hold(h.hold)))
    }

    /// Its words.
    pub fn label(self) -> &'static str {
        match self {
            Self::Press(action) => action.label(),
            Self::Hold(hold) => HOLDS.iter().find(|h| h.hold == hold).map_or("", |h| h.label),
        }
    }

    /// The keys it has until they are changed.
    pub fn default_keys(self) -> &'static [Chord] {
        match self {
            Self::Press(action) => action.spec().map_or(&[], |s| s.keys),
            Self::Hold(hold) => HOLDS.iter().find(|h| h.hold == hold).map_or(&[], |h| h.keys),
        }
    }

    /// Its name in the file: "Undo", "Nudge(Left, Small)".
    fn name(self) -> String {
        match self {
            Self::Press(action) => format!("{action:?}"),
            Self::Hold(hold) => format!("Hold{hold:?}"),
        }
    }
}

/// Every key. No key is given to two things.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KeyMap {
    changed: HashMap<Bound, Vec<Chord>>,
}

impl KeyMap {
    /// Its keys; the first is shown.
    pub fn keys(&self, of: Bound) -> &[Chord] {
        self.changed.get(&of).map_or(of.default_keys(), Vec::as_slice)
    }

    /// The key that is shown for an action, if it has one.
    pub fn text(&self, action: Action) -> Option<String> {
        self.keys(Bound::Press(action)).first().map(|k| k.text())
    }

    /// The same for what is held.
    pub fn held_text(&self, hold: Hold) -> Option<String> {
        self.keys(Bound::Hold(hold)).first().map(|k| k.text())
    }

    /// What an action does, in a sentence, with its key.
    pub fn tooltip(&self, action: Action) -> String {
        let key = self.text(action).map(|k| format!(" ({k})")).unwrap_or_default();
        format!("{}{key}", action.spec().map_or("", |s| s.tooltip))
    }

    /// What has this key.
    pub fn user(&self, chord: Chord) -> Option<Bound> {
        Bound::all().find(|of| self.keys(*of).contains(&chord))
    }

    /// Whether these are other keys than those of the table.
    pub fn is_changed(&self, of: Bound) -> bool {
        self.changed.contains_key(&of)
    }

    /// Whether any key is another than in the table.
    pub fn any_changed(&self) -> bool {
        !self.changed.is_empty()
    }

    /// Gives these keys to it, and takes them from whatever had them.
    pub fn set(&mut self, of: Bound, keys: Vec<Chord>) {
        for other in Bound::all().filter(|o| *o != of) {
            if self.keys(other).iter().any(|k| keys.contains(k)) {
                let left = self.keys(other).iter().filter(|k| !keys.contains(k)).copied().collect();
                self.keep(other, left);
            }
        }
        self.keep(of, keys);
    }

    fn keep(&mut self, of: Bound, keys: Vec<Chord>) {
        if keys == of.default_keys() {
            self.changed.remove(&of);
        } else {
            self.changed.insert(of, keys);
        }
    }

    /// The keys of the table again.
    pub fn reset(&mut self) {
        self.changed.clear();
    }

    /// The actions whose keys were pressed in this pass. `typing`: a text field has the keyboard, so only keys with Ctrl count.
    pub fn pressed(&self, ctx: &egui::Context, typing: bool) -> Vec<Action> {
        ctx.input(|i| {
            let mut found = Vec::new();
            for event in &i.events {
                let egui::Event::Key { key, pressed: true, modifiers, .. } = event else { continue };
                for spec in TABLE {
                    let keys = self.keys(Bound::Press(spec.action)).iter();
                    let hit = keys.clone().any(|c| c.key == *key && modifiers.matches_exact(c.modifiers));
                    if hit && (!typing || modifiers.command) {
                        found.push(spec.action);
                    }
                }
            }
            found
        })
    }

    /// Whether a key of it is held down.
    pub fn is_down(&self, input: &egui::InputState, of: Bound) -> bool {
        self.keys(of).iter().any(|c| input.key_down(c.key))
    }

    /// Reads what was changed, from that folder. What cannot be read stays as in the table, and one line says so.
    pub fn read(folder: &Path) -> (Self, Option<String>) {
        let path = folder.join(NAME);
        let Ok(bytes) = fs::read(&path) else { return (Self::default(), None) };
        let file: KeysFile = match serde_json::from_slice(&bytes) {
            Ok(file) => file,
            Err(e) => {
                return (Self::default(), Some(format!("{}: {e}; the keys are those of the program", path.display())));
            }
        };
        if file.frontalis_keys != VERSION {
            let why = format!("{}: is of another version of the program; its keys are not used", path.display());
            return (Self::default(), Some(why));
        }
        let (mut map, mut bad) = (Self::default(), None);
        for (name, texts) in &file.keys {
            let of = Bound::all().find(|b| b.name() == *name);
            let keys: Option<Vec<Chord>> = texts.iter().map(|t| Chord::parse(t)).collect();
            match (of, keys) {
                (Some(of), Some(keys)) => map.set(of, keys),
                (None, _) => bad = Some(format!("{}: there is no command {name}", path.display())),
                (_, None) => bad = Some(format!("{}: {name} has a key that does not exist", path.display())),
            }
        }
        (map, bad)
    }

    /// Writes what was changed into that folder.
    ///
    /// # Errors
    /// When the file cannot be written: one line.
    pub fn write(&self, folder: &Path) -> Result<(), String> {
        let path: PathBuf = folder.join(NAME);
        let texts = |keys: &Vec<Chord>| keys.iter().map(|k| k.text()).collect();
        let keys = self.changed.iter().map(|(of, keys)| (of.name(), texts(keys))).collect();
        let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = serde_json::to_string_pretty(&KeysFile { frontalis_keys: VERSION, keys }).map_err(|e| fail(&e))?;
        fs::create_dir_all(folder).map_err(|e| fail(&e))?;
        whole_file::write(&path, text.as_bytes(), Durability::Process).map_err(|e| fail(&e))
    }
}

/// The file: keys by the name of what has them, only where they differ from the table.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeysFile {
    frontalis_keys: u32,
    keys: BTreeMap<String, Vec<String>>,
}

/// Makes the keys known to every panel drawn in this context.
pub(super) fn install(ctx: &egui::Context, keys: &Arc<KeyMap>) {
    ctx.data_mut(|d| d.insert_temp(Id::unique("keys"), Arc::clone(keys)));
}

/// The keys in this context; those of the table where none were made known.
pub fn of(ctx: &egui::Context) -> Arc<KeyMap> {
    ctx.data(|d| d.get_temp(Id::unique("keys"))).unwrap_or_default()
}

/// Whether a key of this is held down.
pub fn is_held(ctx: &egui::Context, hold: Hold) -> bool {
    let keys = of(ctx);
    ctx.input(|i| keys.is_down(i, Bound::Hold(hold)))
}

/// The key just pressed, as a chord to give to something.
pub fn just_pressed(ctx: &egui::Context) -> Option<Chord> {
    ctx.input(|i| {
        i.events.iter().find_map(|e| match e {
            egui::Event::Key { key, pressed: true, repeat: false, modifiers, .. } => {
                let Modifiers { alt, shift, command, .. } = *modifiers;
                let modifiers = Modifiers { alt, shift, command, ..Modifiers::NONE };
                Some(Chord { modifiers, key: *key })
            }
            _ => None,
        })
    })
}

impl Chord {
    /// Reads "Ctrl+Shift+Z".
    pub fn parse(text: &str) -> Option<Self> {
        let (mut modifiers, mut rest) = (Modifiers::NONE, text.trim());
        loop {
            let found = [("Ctrl+", Modifiers::COMMAND), ("Alt+", Modifiers::ALT), ("Shift+", Modifiers::SHIFT)]
                .into_iter()
                .find_map(|(word, m)| rest.strip_prefix(word).map(|r| (r, m)));
            match found {
                Some((r, m)) => (rest, modifiers) = (r, modifiers.plus(m)),
                None => return Key::from_name(rest).map(|key| Self { modifiers, key }),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chord(text: &str) -> Chord {
        Chord::parse(text).unwrap()
    }

    #[test]
    fn every_key_of_the_table_is_read_as_it_is_written() {
        for of in Bound::all() {
            for key in of.default_keys() {
                assert_eq!(Chord::parse(&key.text()), Some(*key), "{}", key.text());
            }
        }
        assert_eq!(chord("Ctrl++").key, Key::Plus);
        assert!(Chord::parse("Ctrl+").is_none() && Chord::parse("Hyper+X").is_none());
        let names: std::collections::BTreeSet<String> = Bound::all().map(Bound::name).collect();
        assert_eq!(names.len(), Bound::all().count(), "each has a name of its own");
    }

    #[test]
    fn a_key_given_to_one_is_taken_from_the_other_and_all_of_it_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let (undo, accept) = (Bound::Press(Action::Undo), Bound::Press(Action::Accept));
        let mut keys = KeyMap::default();
        keys.set(accept, vec![chord("Ctrl+Z"), chord("Enter")]);
        assert_eq!(keys.user(chord("Ctrl+Z")), Some(accept));
        assert!(keys.keys(undo).is_empty() && keys.is_changed(undo));
        assert_eq!(keys.user(chord("A")), None);
        keys.set(Bound::Hold(Hold::Blink), vec![chord("A")]);
        keys.write(folder.path()).unwrap();
        assert_eq!(KeyMap::read(folder.path()), (keys.clone(), None));
        keys.set(accept, accept.default_keys().to_vec());
        assert!(!keys.is_changed(accept) && keys.keys(Bound::Hold(Hold::Blink)).is_empty());
        keys.reset();
        assert_eq!(keys, KeyMap::default());
    }

    #[test]
    fn what_cannot_be_read_is_told_and_never_gives_a_key_to_two() {
        let folder = tempfile::tempdir().unwrap();
        let read = |text: &str| {
            fs::write(folder.path().join(NAME), text).unwrap();
            KeyMap::read(folder.path())
        };
        assert!(read("{").1.unwrap().contains("keys.json"));
        assert!(read(r#"{"frontalis_keys": 9, "keys": {}}"#).1.unwrap().contains("another version"));
        let (keys, why) =
            read(r#"{"frontalis_keys": 1, "keys": {"Undo": ["Ctrl+P"], "Fly": ["F"], "Redo": ["Ctrl+P"]}}"#);
        assert!(why.unwrap().contains("Fly"));
        let p = chord("Ctrl+P");
        assert_eq!(Bound::all().filter(|of| keys.keys(*of).contains(&p)).count(), 1);
        assert_eq!(KeyMap::read(&folder.path().join("nowhere")), (KeyMap::default(), None));
    }
}
