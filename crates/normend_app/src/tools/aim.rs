//! What a click on a point means: which points, and what is done with them.

use egui::Modifiers;
use normend_core::patches::{Offer, Patch};
use normend_core::{Change, Document, Edit, EditError};

use super::Tool;

/// What is meant with a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Means {
    /// Turn the chosen patch, or the default one.
    Patch,
    /// Turn what the tree says.
    Tree,
    /// Turn all that hangs together.
    Whole,
    /// Select the chosen patch, or the default one.
    SelectPatch,
    /// Select all that hangs together.
    SelectComponent,
    /// Pin the chosen patch, or the default one.
    PinPatch,
}

impl Means {
    /// What a click of a tool means; `None` for tools that paint.
    pub fn of(tool: Tool, modifiers: Modifiers) -> Option<Self> {
        match tool {
            Tool::Mend if modifiers.command => Some(Self::Whole),
            Tool::Mend if modifiers.alt => Some(Self::Tree),
            Tool::Mend => Some(Self::Patch),
            Tool::Patch => Some(Self::SelectPatch),
            Tool::Component => Some(Self::SelectComponent),
            Tool::Brush | Tool::Lasso | Tool::Rectangle | Tool::Polygon => None,
        }
    }

    /// Whether points turn.
    pub fn turns(self) -> bool {
        match self {
            Self::Patch | Self::Tree | Self::Whole => true,
            Self::SelectPatch | Self::SelectComponent | Self::PinPatch => false,
        }
    }
}

/// What a click would do.
#[derive(Clone, Debug)]
pub struct Aim {
    /// What is meant.
    pub means: Means,
    /// What is done.
    pub deed: Deed,
    /// The patch that is meant, if it is one.
    pub patch: Option<Patch>,
    /// How many of the offered patches are not larger, and how many are offered.
    pub level: Option<(usize, usize)>,
}

/// What is done with the points that are meant.
#[derive(Clone, Debug, PartialEq)]
pub enum Deed {
    /// They turn, by this edit.
    Turn(Edit),
    /// They are selected.
    Select,
    /// They are pinned.
    Pin,
}

impl Aim {
    /// The points that are meant, as positions.
    pub fn change(&self, document: &Document, point: u32) -> Result<Change, EditError> {
        let propagation = document.propagation().ok_or(EditError::NotReady)?;
        let tree = &propagation.tree;
        match (&self.deed, self.patch, &propagation.patches) {
            (&Deed::Turn(Edit::TurnPatch { point, n_points }), ..) => document.preview_turn_patch(point, n_points),
            (&Deed::Turn(Edit::TurnWhole(point)), ..) => document.preview_turn_whole(point),
            (&Deed::Turn(Edit::Mend(point)), ..) => document.preview_mend(point),
            (Deed::Turn(edit), ..) => document.preview(edit),
            (Deed::Select | Deed::Pin, Some(patch), Some(patches)) => Ok(patches.positions(patch, tree)),
            (Deed::Select | Deed::Pin, ..) => {
                let position = tree.position(point);
                let alone = position..position + 1;
                Ok(match self.means {
                    Means::SelectComponent => {
                        Change::from_flips(&[tree.subtree(tree.roots()[tree.component(position)])])
                    }
                    // Without patches, what a click would turn is the next best.
                    _ => document
                        .preview_mend(point)
                        .unwrap_or_else(|_| Change::from_flips(&[alone])),
                })
            }
        }
    }

    /// How many pinned points of a patch stay while it turns.
    pub fn n_pinned(&self, document: &Document, point: u32) -> u64 {
        let (Deed::Turn(_), Some(patch)) = (&self.deed, self.patch) else {
            return 0;
        };
        if document.marks().n_pinned() == 0 {
            return 0;
        }
        document.n_pinned_in_patch(point, patch.n_points).unwrap_or(0)
    }

    /// How many points that are vouched for keep the next larger patch from being offered; 0 where one is offered.
    pub fn n_hindering(&self, document: &Document, point: u32) -> usize {
        let patches = document
            .propagation()
            .and_then(|propagation| propagation.patches.as_ref());
        let (Deed::Turn(_), Some(patch), Some(patches)) = (&self.deed, self.patch, patches) else {
            return 0;
        };
        if self.level.is_some_and(|(level, n_levels)| level < n_levels) {
            return 0;
        }
        let mut larger = patches.around(point).filter(|larger| larger.n_points > patch.n_points);
        larger
            .find_map(|larger| match document.preview_turn_patch(point, larger.n_points) {
                Err(EditError::Vouched { n_vouched }) => Some(n_vouched),
                _ => None,
            })
            .unwrap_or(0)
    }
}

/// Which patch around a point is meant: the default one, or what the user chose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reach {
    /// The patch that the user chose instead of the default, at a revision of the document.
    chosen: Option<(Patch, u64)>,
    /// Steps to larger (or, negative, smaller) patches that were asked for and not taken yet.
    steps: i32,
}

impl Reach {
    /// Chooses a larger patch, that many steps; a smaller one when negative. It waits for a place.
    pub fn step(&mut self, steps: i32) {
        self.steps = self.steps.saturating_add(steps);
    }

    /// Drops steps that were not taken.
    pub fn rest(&mut self) {
        self.steps = 0;
    }

    /// Takes the steps that were asked for, from where the pointer is, and forgets a choice that was made for another place
    /// or another state of the signs.
    pub fn settle(&mut self, document: &Document, point: Option<u32>, means: Option<Means>) {
        let revision = document.signs_revision();
        let holds = |&(patch, chosen_at): &(Patch, u64)| {
            chosen_at == revision && point.is_none_or(|point| is_in(document, patch, point))
        };
        self.chosen = self.chosen.filter(holds);
        let stepped = means.filter(|means| !means.turns()).unwrap_or(Means::Patch);
        if let Some(point) = point
            && self.steps != 0
            && let Some(patch) = self.aim(document, point, stepped).patch
        {
            self.chosen = Some((patch, revision));
            self.steps = 0;
        }
    }

    /// What a click on a point does.
    pub fn aim(&self, document: &Document, point: u32, means: Means) -> Aim {
        let patches = document
            .propagation()
            .and_then(|propagation| propagation.patches.as_ref());
        let offer = match means {
            Means::Patch => document.offer(point).ok().flatten(),
            // What is vouched for hinders no selection.
            Means::SelectPatch | Means::PinPatch => patches.and_then(|patches| patches.offer(point, |_| true)),
            Means::Tree | Means::Whole | Means::SelectComponent => None,
        };
        let deed = |patch: Option<Patch>| match (means, patch) {
            (Means::SelectPatch | Means::SelectComponent, _) => Deed::Select,
            (Means::PinPatch, _) => Deed::Pin,
            (Means::Whole, _) => Deed::Turn(Edit::TurnWhole(point)),
            (Means::Patch | Means::Tree, None) => Deed::Turn(Edit::Mend(point)),
            (Means::Patch | Means::Tree, Some(Patch { n_points, .. })) => {
                Deed::Turn(Edit::TurnPatch { point, n_points })
            }
        };
        let Some(Offer { patches, default }) = offer else {
            return Aim {
                means,
                deed: deed(None),
                patch: None,
                level: None,
            };
        };
        let chosen = self.chosen.map(|(patch, _)| patch);
        let mut patch = chosen
            .filter(|&patch| is_in(document, patch, point))
            .unwrap_or(patches[default]);
        for _ in 0..self.steps.unsigned_abs().min(patches.len() as u32) {
            let next = if self.steps > 0 {
                patches.iter().find(|next| next.n_points > patch.n_points)
            } else {
                patches.iter().rfind(|next| next.n_points < patch.n_points)
            };
            patch = next.copied().unwrap_or(patch);
        }
        let not_larger = patches
            .iter()
            .filter(|offered| offered.n_points <= patch.n_points)
            .count();
        Aim {
            means,
            deed: deed(Some(patch)),
            patch: Some(patch),
            level: Some((not_larger.max(1), patches.len())),
        }
    }
}

/// Whether a patch of the propagation in force holds a point.
fn is_in(document: &Document, patch: Patch, point: u32) -> bool {
    let patches = document
        .propagation()
        .and_then(|propagation| propagation.patches.as_ref());
    patches.is_some_and(|patches| patch.leaves().contains(&patches.leaf(point)))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DVec3, Vec3};
    use normend_core::patches::{Level, Patches};
    use normend_core::{Parameters, PointCloud, Propagation, Regions, RiemannianGraph, Silent, SpanningTree};

    use super::*;

    /// Sixteen points in a row, all normals up, in patches of 1, 2, 4, 8 and all; those of four have the weakest boundary.
    fn row() -> Document {
        let edges: Vec<_> = (0..15).map(|a| (a, a + 1, 0.1, false)).collect();
        let tree = SpanningTree::new(&RiemannianGraph::from_edges(16, &edges), &Silent).unwrap();
        let tree = Arc::new(tree);
        let halves = |n: u32| -> Vec<u32> { (0..n).map(|cluster| cluster / 2).collect() };
        let parents = [halves(16), halves(8), halves(4), halves(2)];
        let strengths = [vec![0.9; 16], vec![0.5; 8], vec![0.1; 4], vec![0.3; 2]];
        let levels: Vec<_> = parents
            .iter()
            .zip(&strengths)
            .map(|(parents, strengths)| Level { parents, strengths })
            .collect();
        let positions = (0..16).map(|point| Vec3::X * point as f32).collect();
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        let mut document = Document::new(Arc::new(cloud), None);
        document.install(Propagation {
            parameters: Parameters::default(),
            normals: Arc::new(vec![Vec3::Z; 16]),
            splat_radii: Arc::new(vec![1.0; 16]),
            base_regions: Regions::new(Arc::clone(&tree), Default::default(), Default::default()),
            default_sources: vec![0],
            voted_sources: Arc::default(),
            sides: Vec::new(),
            patches: Some(Arc::new(Patches::new(&tree, &levels))),
            tree,
            evidence: None,
            found_station: None,
            stations: Arc::default(),
            has_track: false,
            seconds: Vec::new(),
            viewpoints: Arc::default(),
            votes: None,
        });
        document
    }

    fn n_aimed(reach: &Reach, document: &Document, point: u32) -> Option<u32> {
        let patch = reach.aim(document, point, Means::Patch).patch;
        patch.map(|patch| patch.n_points)
    }

    fn settle(reach: &mut Reach, document: &Document, point: u32) {
        reach.settle(document, Some(point), Some(Means::Patch));
    }

    fn turns(reach: &Reach, document: &Document, point: u32) -> Edit {
        match reach.aim(document, point, Means::Patch).deed {
            Deed::Turn(edit) => edit,
            deed => panic!("{deed:?}"),
        }
    }

    #[test]
    fn tools_and_modifiers_say_what_is_meant() {
        let (reach, document) = (Reach::default(), row());
        let deed = |tool, modifiers| reach.aim(&document, 5, Means::of(tool, modifiers).unwrap()).deed;
        let patch = Edit::TurnPatch { point: 5, n_points: 4 };
        assert_eq!(deed(Tool::Mend, Modifiers::NONE), Deed::Turn(patch));
        assert_eq!(deed(Tool::Mend, Modifiers::ALT), Deed::Turn(Edit::Mend(5)));
        assert_eq!(deed(Tool::Mend, Modifiers::COMMAND), Deed::Turn(Edit::TurnWhole(5)));
        assert_eq!(deed(Tool::Patch, Modifiers::COMMAND), Deed::Select);
        assert_eq!(Means::of(Tool::Lasso, Modifiers::NONE), None);
        let tree = reach.aim(&document, 5, Means::Tree);
        assert_eq!(tree.change(&document, 5).ok(), document.preview_mend(5).ok());
        for means in [Means::Patch, Means::SelectPatch, Means::PinPatch] {
            let aim = reach.aim(&document, 5, means);
            assert_eq!(aim.change(&document, 5).unwrap().n_points(), 4, "{means:?}");
            assert_eq!(aim.level, Some((3, 5)));
        }
        let component = reach.aim(&document, 5, Means::SelectComponent);
        assert_eq!(component.change(&document, 5).unwrap().n_points(), 16);
    }

    #[test]
    fn steps_choose_patches_within_what_is_offered() {
        let (mut reach, document) = (Reach::default(), row());
        for (step, expect) in [(1, 8), (1, 16), (1, 16), (-1, 8), (-2, 2), (-5, 1), (3, 8)] {
            reach.step(step);
            settle(&mut reach, &document, 5);
            assert_eq!(n_aimed(&reach, &document, 5), Some(expect), "{step}");
        }
    }

    #[test]
    fn a_choice_holds_on_its_patch_and_until_signs_change() {
        let (mut reach, mut document) = (Reach::default(), row());
        reach.step(1);
        reach.settle(&document, None, Some(Means::Patch));
        assert_eq!(n_aimed(&reach, &document, 5), Some(8), "a step waits for a place");
        settle(&mut reach, &document, 5);
        settle(&mut reach, &document, 0);
        assert_eq!(n_aimed(&reach, &document, 0), Some(8));
        document.apply(Edit::Select([3].into())).unwrap();
        settle(&mut reach, &document, 0);
        assert_eq!(n_aimed(&reach, &document, 0), Some(8), "selecting changes no sign");
        settle(&mut reach, &document, 9);
        assert_eq!(n_aimed(&reach, &document, 9), Some(4));
        settle(&mut reach, &document, 0);
        assert_eq!(n_aimed(&reach, &document, 0), Some(4), "what was left is forgotten");

        reach.step(-1);
        settle(&mut reach, &document, 0);
        assert_eq!(n_aimed(&reach, &document, 0), Some(2));
        document.apply(turns(&reach, &document, 0)).unwrap();
        settle(&mut reach, &document, 1);
        assert_eq!(n_aimed(&reach, &document, 1), Some(1), "point 0 is vouched for");
        assert_eq!(turns(&reach, &document, 0), Edit::Mend(0));
        let beside = reach.aim(&document, 2, Means::Patch);
        assert_eq!(beside.patch.map(|patch| patch.n_points), Some(4));
        let n_turned = beside.change(&document, 2).unwrap().n_points();
        assert_eq!(n_turned, 2, "the patch that point 0 vouches for stays");
    }

    #[test]
    fn what_stays_and_what_hinders_is_counted() {
        let (mut reach, mut document) = (Reach::default(), row());
        document.apply(Edit::Pin([6, 7, 12].into())).unwrap();
        let aim = reach.aim(&document, 5, Means::Patch);
        assert_eq!((aim.n_pinned(&document, 5), aim.n_hindering(&document, 5)), (2, 0));
        assert!(
            reach.aim(&document, 6, Means::Patch).change(&document, 6).is_err(),
            "pinned"
        );
        document.apply(Edit::Mend(10)).unwrap();
        reach.step(9);
        settle(&mut reach, &document, 5);
        let aim = reach.aim(&document, 5, Means::Patch);
        assert_eq!(
            aim.patch.map(|patch| patch.n_points),
            Some(4),
            "point 0 is vouched for with point 10"
        );
        assert!(aim.n_hindering(&document, 5) > 0);
        // Selecting is not hindered.
        reach.step(9);
        reach.settle(&document, Some(5), Some(Means::SelectPatch));
        let aim = reach.aim(&document, 5, Means::SelectPatch);
        assert_eq!(
            (aim.patch.map(|patch| patch.n_points), aim.n_pinned(&document, 5)),
            (Some(16), 0)
        );
    }
}
