//! From cloud and parameters to the tree that signs travel along: everything slow, once, in a job.

mod expanded;
mod given;
mod method;
mod preset;
mod sides;
mod source_rule;
mod splat_radii;

use std::ops::RangeInclusive;
use std::slice;
use std::sync::Arc;
use std::time::Instant;

use fixedbitset::FixedBitSet;
use glam::Vec3;
use rayon::prelude::*;

use self::given::GivenNormals;
pub use self::method::Method;
pub use self::preset::Preset;
use self::sides::sides;
pub use self::source_rule::{ETA, SourceRule, VIEWS};
use crate::automatic;
use crate::copies::Copies;
use crate::evidence::{self, Evidence, FoundStation, Known, Origin, Station};
use crate::progress::Part;
use crate::side_rule::{Clues, Side};
use crate::visibility::SortedVotes;
use crate::{
    Cancelled, EdgeRule, Estimator, Neighbors, Orientation, Patches, PointCloud, Progress, Regions, RiemannianGraph,
    SideRule, Source, SpanningTree, normals, visibility,
};

/// Which normals and signs a document starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// Normals are estimated; each component gets a default source.
    #[default]
    Estimate,
    /// The normals that came with the file, with their signs; points without one get an estimated normal.
    Keep,
}

impl Start {
    /// All starts, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Estimate, Self::Keep];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Estimate => "estimate",
            Self::Keep => "keep",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Estimate => "Estimate",
            Self::Keep => "Keep given",
        }
    }
}

/// What a user can set about the propagation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// How signs are found.
    pub method: Method,
    /// How normals are fitted.
    pub estimator: Estimator,
    /// Neighbors that a normal is fitted to, at least 3.
    pub k_normals: usize,
    /// Neighbors of each point in the Riemannian graph, at least 1.
    pub k_graph: usize,
    /// How neighbors' normals are compared.
    pub edge_rule: EdgeRule,
    /// Estimated or given normals.
    pub start: Start,
    /// Who vouches for the first signs; without effect where signs start as given.
    pub sources: SourceRule,
    /// Viewpoints that vote for sources, within [`VIEWS`].
    pub views: usize,
    /// How far from the ends of the votes sources are taken (Liu et al. §3.4), within [`ETA`].
    pub eta: f32,
    /// Which side of each component is the right one.
    pub rule: SideRule,
}

impl Parameters {
    /// What [`Self::k_normals`] can be; a value outside counts as the nearest one inside.
    pub const K_NORMALS: RangeInclusive<usize> = 3..=200;

    /// What [`Self::k_graph`] can be; a value outside counts as the nearest one inside.
    pub const K_GRAPH: RangeInclusive<usize> = 1..=200;
}

impl Parameters {
    /// OBNE over 12 neighbors, graph of 6. With larger neighborhoods the graph links the two sides of thin walls, where the
    /// dot product goes wrong; with smaller ones noise does. Views and eta are the paper's.
    pub(crate) const TREE: Self = Self {
        method: Method::SpanningTree,
        estimator: Estimator::Obne,
        k_normals: 12,
        k_graph: 6,
        edge_rule: EdgeRule::Dot,
        start: Start::Estimate,
        sources: SourceRule::Highest,
        views: 8,
        eta: 0.07,
        rule: SideRule::Automatic,
    };
}

impl Default for Parameters {
    /// Those of the default [`Preset`].
    fn default() -> Self {
        Preset::default().parameters()
    }
}

/// The stages of [`Propagation::new`], in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// k-neighborhoods.
    Neighbors,
    /// Normals of any sign.
    Normals,
    /// Votes for sources, where the source rule asks for them.
    Sources,
    /// What is known of the points' sides, for the automatic method.
    Evidence,
    /// Signed agglomeration and its spanning tree.
    Agglomeration,
    /// Riemannian graph.
    Graph,
    /// Minimum spanning tree in preorder.
    Tree,
}

impl Stage {
    /// All stages, in order.
    pub const ALL: [Self; 7] = [
        Self::Neighbors,
        Self::Normals,
        Self::Sources,
        Self::Evidence,
        Self::Agglomeration,
        Self::Graph,
        Self::Tree,
    ];

    /// The name in reports: `neighbors`, `normals`, `sources`, `evidence`, `agglomeration`, `graph`, `tree`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Neighbors => "neighbors",
            Self::Normals => "normals",
            Self::Sources => "sources",
            Self::Evidence => "evidence",
            Self::Agglomeration => "agglomeration",
            Self::Graph => "graph",
            Self::Tree => "tree",
        }
    }
}

/// All that is derived from a cloud and its parameters, and does not depend on sources.
#[derive(Clone, Debug)]
pub struct Propagation {
    /// The parameters it was made with.
    pub parameters: Parameters,
    /// `n` unit normals by point; signs are arbitrary (estimated) or as given ([`Start::Keep`]).
    pub normals: Arc<Vec<Vec3>>,
    /// `n` radii by point, in the cloud's unit, so that discs of neighbors overlap and surfaces look closed.
    pub splat_radii: Arc<Vec<f32>>,
    /// The tree that signs travel along.
    pub tree: Arc<SpanningTree>,
    /// The base regions, without a source: with [`Start::Estimate`] the components, each so that its default source points
    /// up; with [`Start::Keep`] cut wherever the given signs of an edge's ends disagree with the edge rule.
    pub base_regions: Regions,
    /// The point of each component's default source, in the order of the tree's roots: the one farthest along +z; where signs start
    /// as given, of those in the component's largest base region.
    pub default_sources: Vec<u32>,
    /// The sources that the source rule found, ascending by point; the base regions have them already. A source of the document at
    /// the same point holds instead of one of these.
    pub voted_sources: Arc<Vec<Source>>,
    /// The votes that the source rule went by, where it did.
    pub votes: Option<Arc<SortedVotes>>,
    /// The user's viewpoints that it was made with; empty for the usual ones.
    pub viewpoints: Arc<[Vec3]>,
    /// The patches that a click can turn; `None` where the tree comes from no agglomeration.
    pub patches: Option<Arc<Patches>>,
    /// The side of each component by [`Parameters::rule`], in the order of the tree's roots. Empty where the default sources
    /// decide, or signs start as given.
    pub sides: Vec<Side>,
    /// What is known of the side of each normal, for normals as they are stored; `None` where the method gathers none.
    pub evidence: Option<Arc<Evidence>>,
    /// The place that all points were scanned from, where [`SideRule::Automatic`] found one.
    pub found_station: Option<FoundStation>,
    /// The places of the scanner that it was made with.
    pub stations: Arc<[Station]>,
    /// Whether it was made with the way of a scanner that moved.
    pub has_track: bool,
    /// Wall seconds of each stage.
    pub seconds: Vec<(Stage, f64)>,
}

impl Propagation {
    /// `n` oriented unit normals by point, turned where `orientation` says so. O(n), in parallel.
    pub fn oriented_normals(&self, orientation: &Orientation) -> Vec<Vec3> {
        let normals = (0..self.tree.n_points() as u32).into_par_iter().map(|point| {
            let stored = self.normals[point as usize];
            let is_turned = orientation.is_turned(self.tree.position(point));
            if is_turned { -stored } else { stored }
        });
        normals.collect()
    }

    /// Runs neighbors → normals → graph → tree → initial cuts. `known` is what is known besides, such as the file's
    /// normals; without one that can be used [`Start::Keep`] is the same as [`Start::Estimate`].
    ///
    /// Of points in one place the first stands for all: the others take its normal and sign, and a place that several scanners
    /// measured counts for the one that measured its first point. Given normals that are kept are kept by point.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn new<'a>(
        cloud: &PointCloud,
        known: impl Into<Known<'a>>,
        parameters: Parameters,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let known = known.into();
        let Some(copies) = Copies::find(cloud) else {
            return Self::of_distinct(cloud, known, parameters, progress);
        };
        let (given, stations) = (
            known.given.map(|given| copies.given(given)),
            copies.stations(known.stations),
        );
        let track = known.track.map(|track| copies.track(track));
        let by_place = Known {
            given: given.as_deref(),
            stations: &stations,
            track: track.as_ref(),
            viewpoints: known.viewpoints,
        };
        let found = Self::of_distinct(&copies.distinct, by_place, parameters, progress)?;
        let kept = known.given.filter(|_| parameters.start == Start::Keep);
        Ok(Self {
            stations: known.stations.into(),
            ..found.with_copies(cloud, &copies, kept)
        })
    }

    /// [`Self::new`] for points each of which has a place of its own.
    fn of_distinct(
        cloud: &PointCloud,
        known: Known<'_>,
        parameters: Parameters,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let k_normals = clamp(parameters.k_normals, Parameters::K_NORMALS);
        let k_graph = clamp(parameters.k_graph, Parameters::K_GRAPH);
        let given = known
            .given
            .filter(|_| parameters.start == Start::Keep)
            .map(GivenNormals::new)
            .filter(|given| !given.missing.is_full());
        if parameters.method == Method::Agglomeration && given.is_none() {
            return Self::automatic(cloud, &known, parameters, progress);
        }
        let mut clock = Clock::start();

        progress.stage("Finding neighbors");
        let part = Part::new(progress, 0.0..0.35);
        let k = k_normals.max(k_graph).max(splat_radii::K);
        let neighbors = Neighbors::find(cloud, k, &part)?;
        let splat_radii = splat_radii::splat_radii(cloud, &neighbors);
        clock.finish(Stage::Neighbors);

        progress.stage("Estimating normals");
        let part = Part::new(progress, 0.35..0.6);
        let estimate = || normals::estimate(cloud, &neighbors, k_normals, parameters.estimator, &part);
        let normals = match &given {
            Some(given) if given.missing.is_clear() => given.normals.clone(),
            Some(given) => given.filled_with(&estimate()?),
            None => estimate()?,
        };
        clock.finish(Stage::Normals);

        let votes = given.is_none() && parameters.sources != SourceRule::Highest;
        let (voted_sources, votes) = if votes {
            progress.stage("Looking for sources");
            let part = Part::new(progress, 0.6..0.75);
            let rule = parameters.sources;
            let viewpoints = match known.viewpoints {
                [] => visibility::viewpoints(cloud, rule, parameters.views),
                own => own.iter().map(|place| place.as_dvec3()).collect(),
            };
            let votes = visibility::votes(cloud, &neighbors, k_normals, &normals, rule, &viewpoints, &part)?;
            let sorted = SortedVotes::new(&votes, rule);
            let sources = visibility::sources(&votes, &normals, &sorted, parameters.eta);
            clock.finish(Stage::Sources);
            (sources, Some(Arc::new(sorted)))
        } else {
            (Vec::new(), None)
        };

        progress.stage("Building the graph");
        let part = Part::new(progress, 0.75..0.8);
        let graph = RiemannianGraph::new(cloud, &neighbors, k_graph, &normals, parameters.edge_rule, &part)?;
        drop(neighbors);
        clock.finish(Stage::Graph);

        progress.stage("Growing the spanning tree");
        let tree = SpanningTree::new(&graph, &Part::new(progress, 0.8..0.9))?;
        drop(graph);
        let mut initially_turned = FixedBitSet::with_capacity(tree.n_points());
        let mut default_sources: Vec<u32> = tree.roots().iter().map(|&root| highest(cloud, &tree, root)).collect();
        for (&root, &source) in tree.roots().iter().zip(&default_sources) {
            let turned = points_down(normals[source as usize]) ^ tree.phi(tree.position(source));
            initially_turned.set(root as usize, turned);
        }
        let mut decided = Vec::new();
        let asks_sources = parameters.rule == SideRule::Automatic && !known.has_scanner();
        if given.is_none() && !asks_sources {
            progress.stage("Looking for the right side");
            let mut clues = Clues::new(cloud, &normals, &splat_radii);
            clues.gather(parameters.rule, &known, &Part::new(progress, 0.9..1.0))?;
            decided = sides(&tree, parameters.rule, &clues);
            for (&root, side) in tree.roots().iter().zip(&decided) {
                initially_turned.set(root as usize, side.turned);
            }
        }
        let mut initial_cuts = FixedBitSet::with_capacity(tree.n_points());
        if let Some(given) = &given {
            given.cut_disagreements(&tree, &mut initial_cuts, &mut initially_turned);
            default_sources = given::default_sources(cloud, &tree, &initial_cuts);
        }
        let tree = Arc::new(tree);
        let mut base_regions = Regions::new(Arc::clone(&tree), initial_cuts, initially_turned);
        base_regions.set(voted_sources.iter().map(|source| {
            let turned = source.turns(normals[source.point as usize]);
            (source.point, Some(turned))
        }));
        clock.finish(Stage::Tree);

        Ok(Self {
            parameters,
            normals: Arc::new(normals),
            splat_radii: Arc::new(splat_radii),
            tree,
            base_regions,
            default_sources,
            voted_sources: Arc::new(voted_sources),
            votes,
            viewpoints: known.viewpoints.into(),
            sides: decided,
            patches: None,
            evidence: None,
            found_station: None,
            stations: known.stations.into(),
            has_track: known.track.is_some(),
            seconds: clock.seconds,
        })
    }
}

impl Propagation {
    /// The automatic method: neighbors → normals → evidence → agglomeration → sides.
    fn automatic(
        cloud: &PointCloud,
        known: &Known<'_>,
        parameters: Parameters,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let mut clock = Clock::start();
        progress.stage("Finding neighbors");
        let neighbors = Neighbors::find(cloud, automatic::K, &Part::new(progress, 0.0..0.25))?;
        let splat_radii = splat_radii::splat_radii(cloud, &neighbors);
        clock.finish(Stage::Neighbors);

        progress.stage("Estimating normals");
        let part = Part::new(progress, 0.25..0.4);
        let unoriented = automatic::estimate_normals(cloud, &neighbors, &splat_radii, &part)?;
        clock.finish(Stage::Normals);

        progress.stage("Looking at the sides");
        let found_station = if parameters.rule == SideRule::Automatic && !known.has_scanner() {
            evidence::find_station(cloud, &neighbors, &unoriented.normals, &Part::new(progress, 0.4..0.45))?
        } else {
            None
        };
        let (viewpoints, stations, has_track) = (known.viewpoints, known.stations, known.track.is_some());
        let station = found_station.map(|found| Station {
            points: 0..cloud.n_points() as u32,
            position: found.position,
        });
        let known = &Known {
            stations: station.as_ref().map_or(known.stations, slice::from_ref),
            track: known.track,
            // The file's normals are asked only where the user trusts them.
            given: known.given.filter(|_| parameters.rule == SideRule::Given),
            viewpoints,
        };
        let part = Part::new(progress, 0.45..0.65);
        let evidence = automatic::gather_evidence(cloud, &neighbors, &splat_radii, &unoriented.normals, known, &part)?;
        clock.finish(Stage::Evidence);

        progress.stage("Joining what belongs together");
        let part = Part::new(progress, 0.65..0.95);
        let found = automatic::orient(cloud, neighbors, &splat_radii, unoriented, evidence, &part)?;
        clock.finish(Stage::Agglomeration);

        progress.stage("Looking for the right side");
        let mut clues = Clues::new(cloud, &found.normals, &splat_radii);
        // What the scanner saw, or the file says, is not what is seen from outside.
        let is_outside = |origin: &Origin| matches!(origin, Origin::Crossings | Origin::OutsideViews);
        if found.evidence.origins().iter().any(is_outside) {
            clues.outside = Some(found.evidence.clone());
        }
        clues.gather(parameters.rule, known, &Part::new(progress, 0.95..0.97))?;
        let mut decided = sides(&found.tree, parameters.rule, &clues);
        let is_open = decided.iter().any(|side| side.rule.is_none());
        if is_open && found.evidence.origins() == [Origin::Crossings] {
            // What lines say nothing of may be seen all the same.
            let mut clues = Clues::new(cloud, &found.normals, &splat_radii);
            clues.gather(parameters.rule, known, &Part::new(progress, 0.97..1.0))?;
            for (side, again) in decided.iter_mut().zip(sides(&found.tree, parameters.rule, &clues)) {
                if side.rule.is_none() {
                    *side = again;
                }
            }
        }
        drop(clues);
        let mut initially_turned = FixedBitSet::with_capacity(cloud.n_points());
        for (&root, side) in found.tree.roots().iter().zip(&decided) {
            initially_turned.set(root as usize, side.turned);
        }
        let default_sources = found
            .tree
            .roots()
            .iter()
            .map(|&root| highest(cloud, &found.tree, root))
            .collect();
        let tree = Arc::new(found.tree);
        let no_cuts = FixedBitSet::with_capacity(cloud.n_points());
        let base_regions = Regions::new(Arc::clone(&tree), no_cuts, initially_turned);
        clock.finish(Stage::Tree);

        Ok(Self {
            parameters,
            normals: Arc::new(found.normals),
            splat_radii: Arc::new(splat_radii),
            tree,
            base_regions,
            default_sources,
            voted_sources: Arc::default(),
            votes: None,
            viewpoints: viewpoints.into(),
            patches: Some(Arc::new(found.patches)),
            sides: decided,
            evidence: Some(Arc::new(found.evidence)),
            found_station,
            stations: stations.into(),
            has_track,
            seconds: clock.seconds,
        })
    }

    /// The voted source at `point`. O(log n).
    pub fn voted_source(&self, point: u32) -> Option<Source> {
        let index = self.voted_sources.binary_search_by_key(&point, |source| source.point);
        index.ok().map(|index| self.voted_sources[index])
    }

    /// The rule that decides the sides where no source does, in words for files: "as given", "farthest along +z up".
    pub fn rule(&self) -> &'static str {
        if self.default_sources.is_empty() {
            "as given"
        } else if !self.voted_sources.is_empty() {
            "visible points outward"
        } else if self.sides.is_empty() {
            "farthest along +z up"
        } else {
            let by_scanner = |side: &Side| side.rule == Some(SideRule::TowardScanner);
            let rule = match self.parameters.rule {
                SideRule::Automatic if self.sides.iter().any(by_scanner) => SideRule::TowardScanner,
                SideRule::Automatic => SideRule::Outward,
                rule => rule,
            };
            rule.label()
        }
    }

    /// `n` oriented normals by point as they are before any source: those that a document without sources shows. O(n).
    pub fn initial_normals(&self) -> Vec<Vec3> {
        let orientation = self.base_regions.orientation();
        let mut normals = vec![Vec3::ZERO; self.tree.n_points()];
        for (position, &point) in (0_u32..).zip(self.tree.order()) {
            let normal = self.normals[point as usize];
            normals[point as usize] = if orientation.is_turned(position) {
                -normal
            } else {
                normal
            };
        }
        normals
    }
}

/// The default source of the component of `root`: its point farthest along +z, of several the one with the smallest id.
fn highest(cloud: &PointCloud, tree: &SpanningTree, root: u32) -> u32 {
    let height = |point: u32| cloud.positions()[point as usize].z;
    let component = tree.subtree(root);
    let points = &tree.order()[component.start as usize..component.end as usize];
    let higher = |a: u32, b: u32| {
        let b_is_higher = height(b) > height(a) || (height(b) == height(a) && b < a);
        if b_is_higher { b } else { a }
    };
    points.iter().copied().reduce(higher).unwrap_or_default()
}

/// Whether a default source's normal must turn to point up. A level one turns toward +y, then +x: its estimated sign is
/// arbitrary and must not show.
fn points_down(normal: Vec3) -> bool {
    (normal.z, normal.y, normal.x) < (0.0, 0.0, 0.0)
}

fn clamp(k: usize, range: RangeInclusive<usize>) -> usize {
    k.clamp(*range.start(), *range.end())
}

/// Measures one stage after the other.
struct Clock {
    begin: Instant,
    seconds: Vec<(Stage, f64)>,
}

impl Clock {
    fn start() -> Self {
        Self {
            begin: Instant::now(),
            seconds: Vec::new(),
        }
    }

    fn finish(&mut self, stage: Stage) {
        self.seconds.push((stage, self.begin.elapsed().as_secs_f64()));
        self.begin = Instant::now();
    }
}

#[cfg(test)]
mod tests;
