//! Which of its two sides a connected component shows: one sign for all of its points, by a rule and by evidence.
//!
//! Signs within a component come from elsewhere; here only the whole is turned or not. A rule that has nothing to go by gives
//! way to the next: see [`SideRule::with_fallback`]. Sums are of whole numbers, so they do not depend on the order of points.

use glam::{I64Vec3, Vec3};
use rayon::prelude::*;

use crate::evidence::{self, Evidence, Known, UNIT};
use crate::progress::Part;
use crate::{Cancelled, PointCloud, Progress};

/// What the right side of a surface is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum SideRule {
    /// The side that the scanner stood on, where its place is known or found ([`evidence::find_station`]); else outward.
    #[default]
    Automatic,
    /// The side that is seen from outside: objects.
    Outward,
    /// The side that the scanner stood on.
    TowardScanner,
    /// The upper side: terrain.
    Up,
    /// The side that is seen from inside: rooms.
    IntoRoom,
    /// The side of the normals that came with the file.
    Given,
}

impl SideRule {
    /// All rules, in the order of menus.
    pub const ALL: [Self; 6] = [
        Self::Automatic,
        Self::Outward,
        Self::TowardScanner,
        Self::Up,
        Self::IntoRoom,
        Self::Given,
    ];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "auto",
            Self::Outward => "outward",
            Self::TowardScanner => "toward-scanner",
            Self::Up => "up",
            Self::IntoRoom => "into-room",
            Self::Given => "given",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Automatic => "Automatic",
            Self::Outward => "Outward",
            Self::TowardScanner => "Toward the scanner",
            Self::Up => "Up",
            Self::IntoRoom => "Into the room",
            Self::Given => "As given",
        }
    }

    /// The rules that are tried for a component in turn, this one or what it stands for first: where it has nothing to go by,
    /// what is seen from outside is the next best.
    pub fn with_fallback(self) -> &'static [Self] {
        match self {
            Self::Outward => &[Self::Outward],
            Self::Automatic | Self::TowardScanner => &[Self::TowardScanner, Self::Outward],
            Self::Up => &[Self::Up, Self::Outward],
            Self::IntoRoom => &[Self::IntoRoom],
            Self::Given => &[Self::Given, Self::Outward],
        }
    }
}

/// What the rules may go by. Each evidence is about `normals`; what is not known is `None`.
#[derive(Clone, Debug)]
pub struct Clues<'a> {
    /// The points.
    pub cloud: &'a PointCloud,
    /// `n` unit normals by point, of any sign.
    pub normals: &'a [Vec3],
    /// `n` splat radii by point, for areas.
    pub radii: &'a [f32],
    /// Views from outside, for [`SideRule::Outward`].
    pub outside: Option<Evidence>,
    /// Views from inside, for [`SideRule::IntoRoom`], which without them takes the opposite of the views from outside.
    pub inside: Option<Evidence>,
    /// For [`SideRule::TowardScanner`].
    pub scanner: Option<Evidence>,
    /// For [`SideRule::Given`].
    pub given: Option<Evidence>,
    /// The direction of [`SideRule::Up`], of any length.
    pub up: Vec3,
}

impl<'a> Clues<'a> {
    /// Nothing but the surface itself; up is +z.
    pub fn new(cloud: &'a PointCloud, normals: &'a [Vec3], radii: &'a [f32]) -> Self {
        Self {
            cloud,
            normals,
            radii,
            outside: None,
            inside: None,
            scanner: None,
            given: None,
            up: Vec3::Z,
        }
    }

    /// Gathers what `rule` and those that it gives way to go by, unless it is there already. The views take most of the time:
    /// see [`evidence::outside_views`]. Rooms are looked at from the scanner's places, or from [`evidence::inside_places`]
    /// where these are not known.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn gather(&mut self, rule: SideRule, known: &Known<'_>, progress: &dyn Progress) -> Result<(), Cancelled> {
        let Self {
            cloud, normals, radii, ..
        } = *self;
        match rule {
            SideRule::Automatic | SideRule::TowardScanner if self.scanner.is_none() && known.has_scanner() => {
                self.scanner = Some(evidence::scanner(cloud, normals, known));
            }
            SideRule::Given if self.given.is_none() => {
                self.given = known.given.map(|given| evidence::given(normals, given, 1.0));
            }
            SideRule::IntoRoom if self.inside.is_none() => {
                let places = if known.has_scanner() {
                    known.places()
                } else {
                    evidence::inside_places(cloud)
                };
                let part = Part::new(progress, 0.0..0.5);
                self.inside = Some(evidence::inside_views(cloud, radii, normals, &places, &part)?);
            }
            _ => {}
        }
        if self.outside.is_none() {
            let part = Part::new(progress, 0.5..1.0);
            self.outside = Some(evidence::outside_views(
                cloud,
                radii,
                normals,
                evidence::N_VIEWS,
                &part,
            )?);
        }
        Ok(())
    }
}

/// The side of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Whether all of its points must turn.
    pub turned: bool,
    /// The rule that decided: the one asked for, or the one that it gave way to. `None` when there is no evidence: a component
    /// that views from outside see from both sides is turned up then, one that they do not see encloses its volume.
    pub rule: Option<SideRule>,
    /// How far what decided agrees with itself, in 0..=1: at 1 every vote says the same, at 0 half say the opposite. 0 without
    /// evidence.
    pub agreement: f32,
    /// Share of the component that has a vote on it, in 0..=1. Little of it with full agreement is a component that is seen
    /// through a gap. 0 without evidence.
    pub seen: f32,
}

/// Votes that agree by less than this are those of a sheet that is seen from both sides, or of a closed surface that points up
/// as much as down: they say nothing of its side.
const LEAST_AGREEMENT: f64 = 0.05;

/// Decides the side of the component of `points`, of which those that are `turned` so far (by point id) count with the opposite
/// of their stored normal.
///
/// The rules of [`SideRule::with_fallback`] are tried in turn. O(points), in parallel.
pub fn decide_side(points: &[u32], turned: impl Fn(u32) -> bool + Sync, rule: SideRule, clues: &Clues<'_>) -> Side {
    let votes = |evidence: &Option<Evidence>| {
        evidence.as_ref().map_or(Tally::default(), |evidence| {
            let votes = evidence.votes();
            Tally::over(points, &turned, |point| {
                let vote = votes[point];
                [vote.pull_in_units(), vote.weight.min(UNIT)]
            })
        })
    };
    for &rule in rule.with_fallback() {
        let tally = match rule {
            SideRule::Outward => votes(&clues.outside),
            // Stands for others, so it is none of those that are tried.
            SideRule::Automatic => Tally::default(),
            SideRule::TowardScanner => votes(&clues.scanner),
            SideRule::Given => votes(&clues.given),
            SideRule::Up => upward(points, &turned, clues),
            SideRule::IntoRoom => match votes(&clues.inside) {
                clear if clear.is_clear() => clear,
                _ => votes(&clues.outside).opposite(),
            },
        };
        if tally.is_clear() {
            return Side {
                turned: tally.signed < 0,
                rule: Some(rule),
                agreement: tally.agreement() as f32,
                seen: (tally.weight as f64 / (points.len() as f64 * f64::from(UNIT))) as f32,
            };
        }
    }
    let is_seen = votes(&clues.outside).weight > 0;
    let (up, volume) = (upward(points, &turned, clues), volume(points, &turned, clues));
    let guesses = if is_seen { [up, volume] } else { [volume, up] };
    let guess = guesses.into_iter().find(|guess| guess.signed != 0);
    Side {
        turned: guess.is_some_and(|guess| guess.signed < 0),
        rule: None,
        agreement: 0.0,
        seen: 0.0,
    }
}

/// A sum of votes.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// For the present side, minus those against it.
    signed: i64,
    /// Of all, in units of 1/[`UNIT`] a point.
    weight: i64,
}

impl Tally {
    /// The sum over `points` of `[for the stored normal, weight]`, by point id.
    fn over(points: &[u32], turned: &(impl Fn(u32) -> bool + Sync), vote: impl Fn(usize) -> [i32; 2] + Sync) -> Self {
        let add = |a: Self, b: Self| Self {
            signed: a.signed + b.signed,
            weight: a.weight + b.weight,
        };
        points
            .par_iter()
            .with_min_len(MIN_POINTS)
            .map(|&point| {
                let [signed, weight] = vote(point as usize).map(i64::from);
                Self {
                    signed: if turned(point) { -signed } else { signed },
                    weight,
                }
            })
            .reduce(Self::default, add)
    }

    fn agreement(&self) -> f64 {
        self.signed.unsigned_abs() as f64 / self.weight.max(1) as f64
    }

    fn is_clear(&self) -> bool {
        self.signed != 0 && self.agreement() >= LEAST_AGREEMENT
    }

    fn opposite(self) -> Self {
        Self {
            signed: -self.signed,
            ..self
        }
    }
}

/// Points that are worth a task of their own.
const MIN_POINTS: usize = 1 << 12;

/// How far normals point up rather than down.
fn upward(points: &[u32], turned: &(impl Fn(u32) -> bool + Sync), clues: &Clues<'_>) -> Tally {
    let up = clues.up.as_dvec3().normalize_or_zero().as_vec3();
    Tally::over(points, turned, |point| {
        let height = (clues.normals[point].dot(up) * UNIT as f32).round() as i32;
        [height, height.abs()]
    })
}

/// The volume that a component encloses, by the divergence theorem: the sum of area × normal · offset, as a share of that of
/// a ball with the same areas and offsets.
fn volume(points: &[u32], turned: &(impl Fn(u32) -> bool + Sync), clues: &Clues<'_>) -> Tally {
    let positions = clues.cloud.positions();
    let (min, max) = clues.cloud.bounding_box();
    let middle = 0.5 * (min + max);
    // Whole numbers, of which 2^20 go along the diagonal, keep the mean free of order.
    let steps = (1 << 20) as f32 / clues.cloud.diagonal().max(f32::MIN_POSITIVE);
    let sums = points
        .par_iter()
        .with_min_len(MIN_POINTS)
        .map(|&point| ((positions[point as usize] - middle) * steps).round().as_i64vec3())
        .reduce(I64Vec3::default, |a, b| a + b);
    let center = middle + (sums.as_dvec3() / points.len().max(1) as f64).as_vec3() / steps;
    let offset = |point: usize| positions[point] - center;
    let largest = |value: &(dyn Fn(usize) -> f32 + Sync)| {
        points
            .par_iter()
            .with_min_len(MIN_POINTS)
            .map(|&point| value(point as usize))
            .reduce(|| f32::MIN_POSITIVE, f32::max)
    };
    let radius = largest(&|point| clues.radii[point]);
    let reach = largest(&|point| offset(point).length());
    // In steps small enough that the smallest discs of the smallest offsets still count.
    let scale = f64::from(i32::MAX) / f64::from(radius * radius) / f64::from(reach);
    Tally::over(points, turned, |point| {
        let area = scale * f64::from(clues.radii[point]).powi(2);
        let out = f64::from(clues.normals[point].dot(offset(point)));
        [(area * out) as i32, (area * f64::from(offset(point).length())) as i32]
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::evidence::{Origin, Vote};

    /// Votes of whole looks: `(for, against)` the stored normal.
    fn evidence(looks: &[(i32, i32)]) -> Evidence {
        let vote = |&(with, against): &(i32, i32)| Vote {
            signed: (with - against) * UNIT,
            weight: (with + against) * UNIT,
        };
        Evidence::new(Origin::OutsideViews, looks.iter().map(vote).collect())
    }

    /// Six points around `center` as on an octahedron, with outward normals.
    fn octahedron(center: Vec3) -> (Vec<Vec3>, Vec<Vec3>) {
        let normals = vec![Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
        (normals.iter().map(|&normal| center + normal).collect(), normals)
    }

    /// The side of an octahedron of which the points `turned` count as turned.
    fn check(turned: &[u32], rule: SideRule, clues: impl Fn(&mut Clues<'_>), expect: (bool, Option<SideRule>)) -> Side {
        let (positions, normals) = octahedron(Vec3::new(7.0, -3.0, 2.0));
        let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
        let mut known = Clues::new(&cloud, &normals, &[0.5; 6]);
        clues(&mut known);
        let side = decide_side(&[0, 1, 2, 3, 4, 5], |point| turned.contains(&point), rule, &known);
        assert_eq!((side.turned, side.rule), expect, "{side:?}");
        side
    }

    const ALL: &[u32] = &[0, 1, 2, 3, 4, 5];

    #[test]
    fn outward_by_votes() {
        let votes = evidence(&[(3, 0), (0, 0), (2, 0), (0, 1), (0, 0), (4, 0)]);
        let side = check(
            &[],
            SideRule::Outward,
            |clues| clues.outside = Some(votes.clone()),
            (false, Some(SideRule::Outward)),
        );
        assert_eq!((side.agreement, side.seen), (0.5, 4.0 / 6.0));
        check(
            ALL,
            SideRule::Outward,
            |clues| clues.outside = Some(votes.clone()),
            (true, Some(SideRule::Outward)),
        );
    }

    #[test]
    fn a_body_that_nobody_sees_encloses_its_volume() {
        for rule in [
            SideRule::Outward,
            SideRule::IntoRoom,
            SideRule::TowardScanner,
            SideRule::Given,
        ] {
            check(&[], rule, |_| (), (false, None));
            check(ALL, rule, |_| (), (true, None));
            check(&[0], rule, |_| (), (false, None));
        }
    }

    #[test]
    fn a_sheet_seen_from_both_sides_turns_up() {
        let both = evidence(&[(1, 1); 6]);
        // Of these five, four point sideways or up.
        check(
            &[5],
            SideRule::Outward,
            |clues| clues.outside = Some(both.clone()),
            (false, None),
        );
        check(
            &[2],
            SideRule::Outward,
            |clues| clues.outside = Some(both.clone()),
            (true, None),
        );
    }

    #[test]
    fn scanner_and_given_give_way_to_outward() {
        let votes = evidence(&[(0, 2); 6]);
        for rule in [SideRule::TowardScanner, SideRule::Given] {
            check(
                &[],
                rule,
                |clues| clues.outside = Some(votes.clone()),
                (true, Some(SideRule::Outward)),
            );
        }
        let scanner = evidence(&[(0, 0), (1, 0), (0, 0), (0, 0), (0, 0), (0, 0)]);
        check(
            &[],
            SideRule::TowardScanner,
            |clues| (clues.outside, clues.scanner) = (Some(votes.clone()), Some(scanner.clone())),
            (false, Some(SideRule::TowardScanner)),
        );
        check(
            &[],
            SideRule::Given,
            |clues| (clues.outside, clues.given) = (Some(votes.clone()), Some(scanner.clone())),
            (false, Some(SideRule::Given)),
        );
    }

    #[test]
    fn up_is_for_what_is_not_closed() {
        let votes = evidence(&[(1, 0); 6]);
        check(
            &[],
            SideRule::Up,
            |clues| clues.outside = Some(votes.clone()),
            (false, Some(SideRule::Outward)),
        );
        check(
            &[2],
            SideRule::Up,
            |clues| clues.outside = Some(votes.clone()),
            (true, Some(SideRule::Up)),
        );
        check(
            &[2],
            SideRule::Up,
            |clues| clues.up = -3.0 * Vec3::Z,
            (false, Some(SideRule::Up)),
        );
    }

    #[test]
    fn into_the_room_is_what_inside_sees_or_outside_does_not() {
        let shell = evidence(&[(1, 0); 6]);
        check(
            &[],
            SideRule::IntoRoom,
            |clues| clues.outside = Some(shell.clone()),
            (true, Some(SideRule::IntoRoom)),
        );
        let inside = evidence(&[(1, 0), (0, 0), (0, 0), (0, 0), (0, 0), (0, 0)]);
        check(
            &[],
            SideRule::IntoRoom,
            |clues| (clues.outside, clues.inside) = (Some(shell.clone()), Some(inside.clone())),
            (false, Some(SideRule::IntoRoom)),
        );
    }

    #[test]
    fn names_are_distinct() {
        let mut names: Vec<&str> = SideRule::ALL
            .iter()
            .flat_map(|rule| [rule.name(), rule.label()])
            .collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 2 * SideRule::ALL.len());
    }
}
