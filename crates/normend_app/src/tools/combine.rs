//! How what a tool picks joins what is selected: by the keys that are held.

use egui::Modifiers;
use normend_core::PointSet;

/// How a new set of points joins the selection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Combine {
    /// In its place.
    #[default]
    Replace,
    /// Beside it.
    Add,
    /// Out of it.
    Remove,
    /// What is in both.
    Intersect,
}

impl Combine {
    /// All ways.
    pub const ALL: [Self; 4] = [Self::Replace, Self::Add, Self::Remove, Self::Intersect];

    /// Shift adds, Ctrl (Command on macOS) removes, both intersect.
    pub fn of(modifiers: Modifiers) -> Self {
        match (modifiers.shift, modifiers.command) {
            (false, false) => Self::Replace,
            (true, false) => Self::Add,
            (false, true) => Self::Remove,
            (true, true) => Self::Intersect,
        }
    }

    /// What stands beside the pointer; nothing for [`Self::Replace`].
    pub fn sign(self) -> &'static str {
        match self {
            Self::Replace => "",
            Self::Add => "+",
            Self::Remove => "−",
            Self::Intersect => "∩",
        }
    }

    /// The selection after `picked` joined `selected`.
    pub fn apply(self, selected: &PointSet, picked: PointSet) -> PointSet {
        match self {
            Self::Replace => picked,
            Self::Add => selected | picked,
            Self::Remove => selected - picked,
            Self::Intersect => selected & picked,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_say_how_sets_join() {
        let (selected, picked) = (PointSet::from([1, 2, 3]), PointSet::from([3, 4]));
        let expect: [(Modifiers, &[u32]); 4] = [
            (Modifiers::NONE, &[3, 4]),
            (Modifiers::SHIFT, &[1, 2, 3, 4]),
            (Modifiers::COMMAND, &[1, 2]),
            (Modifiers::SHIFT | Modifiers::COMMAND, &[3]),
        ];
        for (way, (modifiers, expect)) in Combine::ALL.into_iter().zip(expect) {
            assert_eq!(Combine::of(modifiers), way);
            let joined = way.apply(&selected, picked.clone());
            assert_eq!(joined.iter().collect::<Vec<_>>(), expect, "{way:?}");
        }
    }
}
