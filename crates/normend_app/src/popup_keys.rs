//! Arrow keys in open menus and lists.
//!
//! egui looks for the next widget in the whole window, also under the list, and nowhere while nothing has the focus, as
//! after a click. Here Up and Down go through the entries of the list that is open, Home and End to its ends.

use egui::{Context, Id, Key, Modifiers, Order};

/// Moves the focus in the topmost open popup as the pressed keys say. Enter and Escape are egui's own.
pub(crate) fn move_focus(ctx: &Context) {
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
    let Some(layer) = ctx.memory(|memory| memory.areas().top_layer_id(Order::Foreground)) else {
        return Vec::new();
    };
    ctx.viewport(|viewport| {
        let widgets = viewport.prev_pass.widgets.get_layer(layer);
        let mut entries: Vec<_> = widgets
            .filter(|widget| widget.enabled && widget.sense.is_focusable() && widget.sense.senses_click())
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
