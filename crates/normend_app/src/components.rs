//! The components of the open scan, the parts that hang together: how large each is, which rule says its side, and how sure that is.
//!
//! What goes over all points runs in a job and ends in one edit. Components are named by their index among the tree's roots.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use normend_core::document::ComponentSide;
use normend_core::evidence::{self, Evidence, Known, Station};
use normend_core::progress::Part;
use normend_core::side_rule::{Clues, Side, decide_side};
use normend_core::sources::Origin;
use normend_core::{Document, Edit, PointSet, Propagation, SideRule, SpanningTree, Start};

use crate::app::App;
use crate::command::Action;
use crate::job::{Job, JobError, JobStatus};
use crate::theme;

/// Points of a component that are looked at to bring it into view.
const FRAMED: usize = 4096;

/// What a user can let decide the side of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RuleChoice {
    /// A rule of the list.
    Rule(SideRule),
    /// Toward a place in the cloud's own space, as if it was scanned from there.
    TowardPlace(DVec3),
}

/// What a user asks for about components.
#[derive(Clone, Debug, PartialEq)]
pub enum ComponentAction {
    /// Let a rule decide the side of one, or of all.
    Decide(Option<usize>, SideRule),
    /// Let one, or all, face the place that the user looks from.
    TowardMe(Option<usize>),
    /// Turn one as it is.
    Flip(usize),
    /// Hide all others.
    Isolate(usize),
    /// Show all points again.
    ShowHidden,
    /// Select its points.
    Select(usize),
    /// Bring it into view.
    Show(usize),
    /// Mean this one with the buttons.
    Focus(usize),
    /// Stop the running work.
    Stop,
}

impl From<ComponentAction> for Action {
    fn from(action: ComponentAction) -> Self {
        Self::Components(action)
    }
}

/// Who says the side of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Standing {
    /// A rule that the user chose for it.
    Chosen(SideRule),
    /// The user's own sources.
    Sources,
    /// The rule of the propagation; its votes agree so far, in 0..=1.
    Rule(SideRule, f32),
    /// Votes of viewpoints.
    Votes,
    /// The signs that came with the file.
    AsGiven,
    /// Its highest point points up, for want of anything better.
    Highest,
    /// Nothing.
    Nothing,
}

/// The evidence that a rule went by, to be used again.
#[derive(Clone, Debug, Default)]
struct Gathered {
    outside: Option<Evidence>,
    inside: Option<Evidence>,
}

enum Outcome {
    /// An edit that is ready.
    Edit(Edit),
    /// Sides against the signs of a revision.
    Sides(Vec<(usize, Side)>, Gathered),
}

/// What the running job is for.
#[derive(Clone, Debug, PartialEq)]
enum Purpose {
    Points,
    Decide {
        which: Option<usize>,
        choice: RuleChoice,
        signs_revision: u64,
    },
}

/// The list, and the job that works on it.
#[derive(Default)]
pub struct Components {
    tree: Option<Arc<SpanningTree>>,
    /// Those that nothing tells the side of first, then by size.
    order: Vec<u32>,
    standings: BTreeMap<usize, Standing>,
    /// The revision that the standings are of.
    standings_of: Option<u64>,
    gathered: Option<Arc<Gathered>>,
    job: Option<(Job<Outcome>, Purpose)>,
    /// The one that the buttons mean.
    focus: Option<usize>,
}

impl Components {
    /// Brings the list in line with the document: the order after an install in O(c log c), what the user said after an edit in
    /// O(sources).
    pub fn follow(&mut self, document: &Document) {
        let Some(propagation) = document.propagation() else {
            return;
        };
        let tree = &propagation.tree;
        if !self.tree.as_ref().is_some_and(|known| Arc::ptr_eq(known, tree)) {
            self.tree = Some(Arc::clone(tree));
            let mut order: Vec<u32> = (0..tree.roots().len() as u32).collect();
            let key = |&component: &u32| {
                let is_told = propagation
                    .sides
                    .get(component as usize)
                    .is_none_or(|side| side.rule.is_some());
                let n_points = tree.subtree(tree.roots()[component as usize]).len();
                (is_told, std::cmp::Reverse(n_points))
            };
            order.sort_by_key(key);
            self.order = order;
            (self.gathered, self.job, self.focus, self.standings_of) = (None, None, None, None);
        }
        let revision = Some(document.revision());
        if self.standings_of != revision {
            self.standings_of = revision;
            self.standings.clear();
            for source in document.sources().iter() {
                let component = tree.component(tree.position(source.point));
                let standing = match source.origin {
                    Origin::Rule(rule) => Standing::Chosen(rule),
                    _ => Standing::Sources,
                };
                let known = self.standings.entry(component).or_insert(standing);
                if let Standing::Chosen(_) = standing {
                    *known = standing;
                }
            }
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.order.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// The component in a row of the list, which has so many points.
    pub fn row(&self, row: usize) -> Option<(usize, usize)> {
        let component = *self.order.get(row)? as usize;
        Some((component, self.n_points(component)))
    }

    fn n_points(&self, component: usize) -> usize {
        let tree = self.tree.as_ref();
        tree.map_or(0, |tree| tree.subtree(tree.roots()[component]).len())
    }

    /// Who says the side of a component.
    pub fn standing(&self, propagation: &Propagation, component: usize) -> Standing {
        if let Some(&standing) = self.standings.get(&component) {
            return standing;
        }
        match propagation.sides.get(component) {
            Some(Side {
                rule: Some(rule),
                agreement,
                ..
            }) => Standing::Rule(*rule, *agreement),
            Some(_) if !propagation.voted_sources.is_empty() => Standing::Votes,
            Some(_) => Standing::Nothing,
            None if propagation.parameters.start == Start::Keep => Standing::AsGiven,
            None if !propagation.voted_sources.is_empty() => Standing::Votes,
            None => Standing::Highest,
        }
    }

    /// The one that the buttons mean: the user's choice, or the only one.
    pub fn focus(&self) -> Option<usize> {
        self.focus.or((self.order.len() == 1).then_some(0))
    }

    /// How far the job is; `None` when none runs.
    pub fn status(&self) -> Option<JobStatus> {
        self.job.as_ref().map(|(job, _)| job.status())
    }
}

/// The points of a component, by id. O(m log m).
fn points_of(tree: &SpanningTree, component: usize) -> PointSet {
    let Some(&root) = tree.roots().get(component) else {
        return PointSet::new();
    };
    let positions = tree.subtree(root);
    let mut points = tree.order()[positions.start as usize..positions.end as usize].to_vec();
    points.sort_unstable();
    points.into_iter().collect()
}

/// Decides the sides of components against the signs that are shown.
fn decide(
    ctx: &egui::Context,
    document: &Document,
    which: Option<usize>,
    choice: RuleChoice,
    up: Vec3,
    gathered: Option<Arc<Gathered>>,
) -> Option<Job<Outcome>> {
    let propagation = document.shared_propagation()?;
    let signs = document.orientation()?.clone();
    let cloud = Arc::clone(document.cloud());
    let given = document.given_normals().cloned();
    Some(Job::start(
        ctx,
        "sides",
        "Looking for the right side",
        move |progress| {
            let place = match choice {
                RuleChoice::TowardPlace(place) => Some(place),
                RuleChoice::Rule(SideRule::Automatic | SideRule::TowardScanner) => {
                    propagation.found_station.map(|found| found.position)
                }
                RuleChoice::Rule(_) => None,
            };
            let rule = match choice {
                RuleChoice::Rule(rule) => rule,
                RuleChoice::TowardPlace(_) => SideRule::TowardScanner,
            };
            let station = place.map(|position| Station {
                points: 0..cloud.n_points() as u32,
                position,
            });
            let known = Known {
                given: given.as_ref().map(|normals| normals.as_slice()),
                stations: if station.is_some() {
                    station.as_slice()
                } else {
                    &propagation.stations
                },
                ..Known::default()
            };
            let mut clues = Clues::new(&cloud, &propagation.normals, &propagation.splat_radii);
            clues.up = up;
            if let Some(gathered) = gathered {
                (clues.outside, clues.inside) = (gathered.outside.clone(), gathered.inside.clone());
            }
            if clues.outside.is_none() {
                // What the automatic method knows, unless a scanner or the file told it.
                let is_outside = |origin: &evidence::Origin| {
                    matches!(origin, evidence::Origin::Crossings | evidence::Origin::OutsideViews)
                };
                clues.outside = (propagation.evidence.as_deref())
                    .filter(|evidence| evidence.origins().iter().any(is_outside))
                    .cloned();
            }
            if let RuleChoice::TowardPlace(place) = choice {
                // Only what is seen from there counts; all points vote where the scanner's place is known to have seen them.
                let part = Part::new(progress, 0.0..0.5);
                let (normals, radii) = (&propagation.normals, &propagation.splat_radii);
                clues.scanner = Some(evidence::inside_views(&cloud, radii, normals, &[place], &part)?);
            }
            clues.gather(rule, &known, &Part::new(progress, 0.5..1.0))?;
            let tree = &propagation.tree;
            let components = which.map_or(0..tree.roots().len(), |component| component..component + 1);
            let is_turned = |point: u32| signs.is_turned(tree.position(point));
            let mut sides = Vec::new();
            for component in components {
                let Some(&root) = tree.roots().get(component) else {
                    continue;
                };
                let positions = tree.subtree(root);
                let points = &tree.order()[positions.start as usize..positions.end as usize];
                sides.push((component, decide_side(points, is_turned, rule, &clues)));
                progress.report(1.0)?;
            }
            let Clues { outside, inside, .. } = clues;
            Ok(Outcome::Sides(sides, Gathered { outside, inside }))
        },
    ))
}

impl App {
    /// Does what is asked for about components.
    pub(crate) fn act_on_components(&mut self, action: ComponentAction) {
        match action {
            ComponentAction::Decide(which, rule) => self.decide_sides(which, RuleChoice::Rule(rule)),
            ComponentAction::TowardMe(which) => {
                let eye = self.viewport.camera().eye().as_dvec3();
                self.decide_sides(which, RuleChoice::TowardPlace(eye));
            }
            ComponentAction::Flip(component) => {
                let document = self.document();
                match document.map(|document| document.turn_component_edit(component)) {
                    Some(Ok(Some(edit))) => self.apply_edit(edit),
                    Some(Err(error)) => self.messages.error(format!("The part was not turned: {error}.")),
                    Some(Ok(None)) | None => {}
                }
            }
            ComponentAction::Isolate(component) => self.edit_points_of(component, |points, n_points| {
                let mut others = PointSet::new();
                others.insert_range(0..n_points);
                Edit::Hide(others - points)
            }),
            ComponentAction::Select(component) => self.edit_points_of(component, |points, _| Edit::Select(points)),
            ComponentAction::ShowHidden => self.apply_edit(Edit::Hide(PointSet::new())),
            ComponentAction::Show(component) => {
                let Some(document) = self.document() else { return };
                let Some(propagation) = document.propagation() else {
                    return;
                };
                let tree = Arc::clone(&propagation.tree);
                let cloud = Arc::clone(document.cloud());
                let Some(&root) = tree.roots().get(component) else {
                    return;
                };
                let positions = tree.subtree(root);
                let step = positions.len().div_ceil(FRAMED).max(1);
                let place = |position: u32| cloud.positions()[tree.order()[position as usize] as usize];
                self.viewport.frame_points(positions.step_by(step).map(place));
            }
            ComponentAction::Focus(component) => {
                if let Some(session) = &mut self.session {
                    session.components.focus = Some(component);
                }
            }
            ComponentAction::Stop => {
                if let Some((job, _)) = self
                    .session
                    .as_ref()
                    .and_then(|session| session.components.job.as_ref())
                {
                    job.cancel();
                }
            }
        }
    }

    fn edit_points_of(&mut self, component: usize, edit: impl FnOnce(PointSet, u32) -> Edit + Send + 'static) {
        let Some(session) = &mut self.session else { return };
        let Some(tree) = session.components.tree.clone() else {
            return;
        };
        let n_points = tree.n_points() as u32;
        let job = Job::start(&self.ctx, "component", "Gathering points", move |_| {
            Ok(Outcome::Edit(edit(points_of(&tree, component), n_points)))
        });
        session.components.job = Some((job, Purpose::Points));
    }

    fn decide_sides(&mut self, which: Option<usize>, choice: RuleChoice) {
        let up = self.viewport.camera().up_axis.direction();
        let Some(session) = &mut self.session else { return };
        let gathered = session.components.gathered.clone();
        let Some(job) = decide(&self.ctx, &session.document, which, choice, up, gathered) else {
            return;
        };
        let signs_revision = session.document.signs_revision();
        let purpose = Purpose::Decide {
            which,
            choice,
            signs_revision,
        };
        session.components.job = Some((job, purpose));
    }

    /// Keeps the list up to date and takes what a job found.
    pub(crate) fn keep_components(&mut self) {
        let Some(session) = &mut self.session else { return };
        session.components.follow(&session.document);
        session.kinds.follow(&session.document, session.n_without_normal);
        let Some((job, purpose)) = session.components.job.take() else {
            return;
        };
        match (job.poll(), purpose) {
            (None, purpose) => session.components.job = Some((job, purpose)),
            (Some(Ok(Outcome::Edit(edit))), _) => self.apply_edit(edit),
            (
                Some(Ok(Outcome::Sides(sides, gathered))),
                Purpose::Decide {
                    which,
                    choice,
                    signs_revision,
                },
            ) => {
                session.components.gathered = Some(Arc::new(gathered));
                if session.document.signs_revision() == signs_revision {
                    self.show_sides(&sides, choice);
                } else {
                    // The sides are against signs that changed meanwhile.
                    self.decide_sides(which, choice);
                }
            }
            (Some(Ok(Outcome::Sides(..))), Purpose::Points) => {}
            (Some(Err(JobError::Cancelled)), _) => self.messages.note("Stopped: the parts stay as they are."),
            (Some(Err(JobError::Failed(reason))), _) => {
                self.messages.error(format!("{reason} The parts stay as they are."))
            }
        }
    }

    fn show_sides(&mut self, sides: &[(usize, Side)], choice: RuleChoice) {
        let asked = match choice {
            RuleChoice::Rule(SideRule::Automatic) => None,
            RuleChoice::Rule(rule) => Some(rule),
            RuleChoice::TowardPlace(_) => Some(SideRule::TowardScanner),
        };
        let decided: Vec<ComponentSide> = (sides.iter())
            .filter_map(|&(component, side)| {
                Some(ComponentSide {
                    component,
                    rule: side.rule?,
                    turned: side.turned,
                })
            })
            .collect();
        let parts = |n: usize| theme::counted(n as u64, "part", "parts");
        let n_untold = sides.len() - decided.len();
        let n_other = decided
            .iter()
            .filter(|side| asked.is_some_and(|asked| side.rule != asked))
            .count();
        let n_turned = decided.iter().filter(|side| side.turned).count();
        let Some(document) = self.document() else { return };
        match document.show_sides(&decided) {
            Ok(Some(edit)) => self.apply_edit(edit),
            Ok(None) => {}
            Err(error) => {
                self.messages.error(format!("The parts stay as they are: {error}."));
                return;
            }
        }
        if !decided.is_empty() {
            self.messages.info(format!(
                "Decided the side of {}, {} turned.",
                parts(decided.len()),
                theme::thousands(n_turned as u64)
            ));
        }
        if let Some(asked) = asked.filter(|_| n_other > 0) {
            let name = asked.label();
            self.messages.note(format!(
                "“{name}” says nothing about {}: what is seen from outside decided.",
                parts(n_other)
            ));
        }
        if n_untold > 0 {
            self.messages.note(format!(
                "Nothing tells the side of {}: they stay as they are.",
                parts(n_untold)
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use normend_core::{Parameters, PointCloud, Preset, Silent, shapes};

    use super::*;

    /// Two spheres, the second smaller and farther off, by the automatic method.
    fn document() -> Document {
        let mut positions = shapes::sphere(2000).positions;
        positions.extend(
            shapes::sphere(800)
                .positions
                .iter()
                .map(|&place| 0.5 * place + Vec3::X * 4.0),
        );
        let cloud = Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap());
        let propagation = Propagation::new(&cloud, None, Preset::Auto.parameters(), &Silent).unwrap();
        let mut document = Document::new(cloud, None).with_parameters(Parameters::default());
        document.install(propagation);
        document
    }

    #[test]
    fn rules_of_the_user_stand_before_those_of_the_propagation() {
        let mut document = document();
        let mut components = Components::default();
        components.follow(&document);
        assert_eq!(components.len(), 2);
        assert_eq!([0, 1].map(|row| components.row(row).unwrap().1), [2000, 800]);
        let (component, _) = components.row(1).unwrap();
        let standing = components.standing(document.propagation().unwrap(), component);
        assert!(
            matches!(standing, Standing::Rule(SideRule::Outward, agreement) if agreement > 0.9),
            "{standing:?}"
        );
        let side = ComponentSide {
            component,
            rule: SideRule::IntoRoom,
            turned: true,
        };
        document.apply(document.show_sides(&[side]).unwrap().unwrap()).unwrap();
        components.follow(&document);
        let propagation = document.propagation().unwrap();
        assert_eq!(
            components.standing(propagation, component),
            Standing::Chosen(SideRule::IntoRoom)
        );
        assert!(matches!(
            components.standing(propagation, 1 - component),
            Standing::Rule(..)
        ));
        let edit = document.turn_component_edit(component).unwrap().unwrap();
        document.apply(edit).unwrap();
        components.follow(&document);
        let propagation = document.propagation().unwrap();
        assert_eq!(components.standing(propagation, component), Standing::Sources);
    }

    #[test]
    fn sides_are_against_what_is_shown() {
        let mut document = document();
        let ctx = egui::Context::default();
        let ask = |document: &Document, choice: RuleChoice| {
            let job = decide(&ctx, document, None, choice, Vec3::Z, None).unwrap();
            loop {
                match job.poll() {
                    Some(Ok(Outcome::Sides(sides, _))) => break sides,
                    Some(_) => panic!("no sides"),
                    None => std::thread::yield_now(),
                }
            }
        };
        let turned = |sides: &[(usize, Side)]| sides.iter().map(|(_, side)| side.turned).collect::<Vec<_>>();
        let outward = RuleChoice::Rule(SideRule::Outward);
        assert_eq!(turned(&ask(&document, outward)), [false, false]);
        document
            .apply(document.turn_component_edit(1).unwrap().unwrap())
            .unwrap();
        assert_eq!(turned(&ask(&document, outward)), [false, true]);
        // From the middle of the large sphere it faces inward; from outside what is seen of it faces outward.
        let large = usize::from(points_of(&document.propagation().unwrap().tree, 0).len() != 2000);
        for (place, expect) in [(DVec3::ZERO, true), (DVec3::new(-5.0, 0.5, 0.2), false)] {
            let (_, side) = ask(&document, RuleChoice::TowardPlace(place))[large];
            assert_eq!(
                (side.turned, side.rule),
                (expect != (large == 1), Some(SideRule::TowardScanner)),
                "{place}"
            );
        }
    }
}
