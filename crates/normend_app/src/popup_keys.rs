//! Arrow keys in open menus and lists.
//!
//! egui looks for the next widget in the whole window, also under the list, and nowhere while nothing has the focus, as
//! after a click; and a list stays open when Enter has chosen from it. Here Up and Down go through the entries of the list
//! that is open, Home and End to its ends, and Enter and the space bar close it, so that the focus is where it was. Down
//! also opens the list that has the focus, as elsewhere on the desktop.

use egui::accesskit::Role;
use egui::output::OutputEvent;
use egui::{Context, Id, Key, LayerId, Modifiers, Order, Popup};

/// The list and the pass in which a key chose from it, for the pass after it: only then it is known whether the choice
/// opened a list of its own.
#[derive(Clone, Copy, Default)]
struct Chosen(Option<(LayerId, u64)>);

/// What had the focus before the list.
#[derive(Clone, Copy, Default)]
struct Opener(Option<Id>);

/// The list whose button got the focus last.
#[derive(Clone, Copy, Default)]
struct FocusedList(Option<Id>);

/// Remembers at the end of a pass which list has the focus: egui says what a widget is only as it gets it.
pub(crate) fn note_focus(ctx: &Context) {
    let gained = ctx.output(|output| {
        let mut events = output.events.iter().rev();
        events.find_map(|event| match event {
            OutputEvent::FocusGained(info) => Some(info.role),
            _ => None,
        })
    });
    if gained == Some(Role::ComboBox) {
        let focused = ctx.memory(|memory| memory.focused());
        ctx.data_mut(|data| data.insert_temp(Id::NULL, FocusedList(focused)));
    }
}

/// Opens the list that has the focus when Down is pressed, with or without Alt; says whether it did.
pub(crate) fn open_focused(ctx: &Context) -> bool {
    let FocusedList(list) = ctx.data(|data| data.get_temp(Id::NULL)).unwrap_or_default();
    let Some(list) = list.filter(|&list| ctx.memory(|memory| memory.has_focus(list))) else {
        return false;
    };
    let is_pressed = ctx.input_mut(|input| {
        input.consume_key(Modifiers::NONE, Key::ArrowDown) || input.consume_key(Modifiers::ALT, Key::ArrowDown)
    });
    if is_pressed {
        // As egui names it, `ComboBox::widget_to_popup_id`.
        Popup::open_id(ctx, list.with("popup"));
        ctx.memory_mut(|memory| memory.move_focus(egui::FocusDirection::None));
    }
    is_pressed
}

/// Does in the topmost open popup what the pressed keys say. Choosing and Escape are egui's own.
pub(crate) fn take(ctx: &Context) {
    let (top, pass) = (top(ctx), ctx.cumulative_pass_nr());
    let Chosen(chosen) = ctx.data_mut(|data| data.remove_temp(Id::NULL)).unwrap_or_default();
    if chosen.is_some_and(|(layer, chosen_pass)| Some(layer) == top && chosen_pass + 1 == pass) {
        Popup::close_all(ctx);
        let Opener(opener) = ctx.data_mut(|data| data.remove_temp(Id::NULL)).unwrap_or_default();
        if let Some(id) = opener {
            ctx.memory_mut(|memory| memory.request_focus(id));
        }
        return;
    }
    move_focus(ctx);
    let is_choosing = ctx.input(|input| input.key_pressed(Key::Enter) || input.key_pressed(Key::Space));
    let focused = ctx.memory(|memory| memory.focused());
    if let (true, Some(layer), Some(focused)) = (is_choosing, top, focused)
        && entries(ctx).contains(&focused)
    {
        ctx.data_mut(|data| data.insert_temp(Id::NULL, Chosen(Some((layer, pass)))));
        ctx.request_repaint();
    }
}

fn top(ctx: &Context) -> Option<LayerId> {
    ctx.memory(|memory| memory.areas().top_layer_id(Order::Foreground))
}

fn move_focus(ctx: &Context) {
    let step = ctx.input_mut(|input| {
        let mut pressed = |key| input.consume_key(Modifiers::NONE, key);
        // Each key is taken, so that egui's own search does not see it.
        let keys = [
            (pressed(Key::ArrowDown), Step::Next),
            (pressed(Key::ArrowUp), Step::Previous),
            (pressed(Key::Home), Step::First),
            (pressed(Key::End), Step::Last),
        ];
        keys.into_iter().find(|(pressed, _)| *pressed).map(|(_, step)| step)
    });
    let Some(step) = step else { return };
    let entries = entries(ctx);
    let focused = ctx.memory(|memory| memory.focused());
    let at = entries.iter().position(|&id| Some(id) == focused);
    if at.is_none() {
        ctx.data_mut(|data| data.insert_temp(Id::NULL, Opener(focused)));
    }
    if let Some(next) = step.from(at, entries.len()) {
        ctx.memory_mut(|memory| {
            memory.move_focus(egui::FocusDirection::None);
            memory.request_focus(entries[next]);
        });
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Next,
    Previous,
    First,
    Last,
}

impl Step {
    /// Where it leads in a list of so many entries; past the end it begins again.
    fn from(self, at: Option<usize>, n_entries: usize) -> Option<usize> {
        let last = n_entries.checked_sub(1)?;
        Some(match (self, at) {
            (Self::First, _) | (Self::Next, None) => 0,
            (Self::Last, _) | (Self::Previous, None | Some(0)) => last,
            (Self::Next, Some(at)) => (at + 1) % n_entries,
            (Self::Previous, Some(at)) => at - 1,
        })
    }
}

/// What can be chosen in the topmost popup, from top to bottom.
fn entries(ctx: &Context) -> Vec<Id> {
    let Some(layer) = top(ctx) else { return Vec::new() };
    ctx.viewport(|viewport| {
        let widgets = viewport.prev_pass.widgets.get_layer(layer);
        let mut entries: Vec<_> = widgets
            .filter(|widget| widget.enabled && widget.sense.is_focusable() && widget.sense.senses_click())
            // The bar of a list that scrolls is no entry; it alone is higher than wide.
            .filter(|widget| widget.rect.width() > widget.rect.height())
            .collect();
        entries.sort_by(|a, b| a.rect.top().total_cmp(&b.rect.top()));
        entries.into_iter().map(|widget| widget.id).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::Step;

    #[test]
    fn steps_go_round() {
        let check = |step: Step, at, n_entries, expect| assert_eq!(step.from(at, n_entries), expect, "{step:?} {at:?}");
        check(Step::Next, None, 3, Some(0));
        check(Step::Next, Some(2), 3, Some(0));
        check(Step::Previous, None, 3, Some(2));
        check(Step::Previous, Some(0), 3, Some(2));
        check(Step::Previous, Some(2), 3, Some(1));
        check(Step::First, Some(2), 3, Some(0));
        check(Step::Last, None, 3, Some(2));
        check(Step::Next, None, 0, None);
    }
}
