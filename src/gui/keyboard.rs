//! Fast typing over the fields of a dialog: the Tab key stands alone in its pass.
//!
//! All keys of a pass go to the field that has the keyboard at the end of it. When a slow frame collects "a", Tab and "b", the one
//! field would get none of them and the other both. So what comes before and after Tab is handed out in passes of its own.

use egui::{Context, Event, Key, Plugin, RawInput};

/// Holds back events until the pass that they belong to.
#[derive(Default)]
pub struct OneTabAPass {
    waiting: Vec<Event>,
}

impl Plugin for OneTabAPass {
    fn debug_name(&self) -> &'static str {
        "one Tab a pass"
    }

    fn input_hook(&mut self, ctx: &Context, input: &mut RawInput) {
        let mut events = std::mem::take(&mut self.waiting);
        events.append(&mut input.events);
        let is_tab = |e: &Event| matches!(e, Event::Key { key: Key::Tab, pressed: true, .. });
        let share = match events.iter().position(is_tab) {
            Some(0) => 1,
            Some(before) => before,
            None => events.len(),
        };
        self.waiting = events.split_off(share);
        input.events = events;
        if !self.waiting.is_empty() {
            ctx.request_repaint();
        }
    }
}
