use glam::{DVec3, Mat3, Quat};
use proptest::prelude::*;

use super::*;
use crate::evidence::UNIT;
use crate::shapes::{self, Shape};
use crate::{Parameters, Propagation, SideRule, Silent};

/// The oriented normals that the automatic method gives.
fn oriented(positions: &[Vec3]) -> Vec<Vec3> {
    let cloud = PointCloud::new(DVec3::ZERO, positions.to_vec()).unwrap();
    Propagation::new(&cloud, None, Parameters::default(), &Silent)
        .unwrap()
        .initial_normals()
}

fn n_wrong(shape: &Shape) -> usize {
    let normals = oriented(&shape.positions);
    normals
        .iter()
        .zip(&shape.normals)
        .filter(|(a, b)| a.dot(**b) < 0.0)
        .count()
}

#[test]
fn shapes_come_out_right() {
    check(shapes::sphere(3000), 0);
    check(shapes::torus(3000), 0);
    check(shapes::fandisk_like(6000), 0);
    // Thinner than the spacing of its points, about a fifth of which is .02.
    check(shapes::thin_plate(4000, 0.02), 20);
    check(shapes::sphere(3000).with_noise(0.01, 7), 3);

    fn check(shape: Shape, most_wrong: usize) {
        let n_wrong = n_wrong(&shape);
        assert!(
            n_wrong <= most_wrong,
            "{n_wrong} of {} are wrong",
            shape.positions.len()
        );
    }
}

#[test]
fn hidden_sheets_come_out_right() {
    // A ball in a shell in a shell: nothing of the ball is seen from outside.
    let mut shape = shapes::sphere(2000);
    for (radius, sign) in [(1.5, -1.0), (1.7, 1.0)] {
        let shell = shapes::sphere(4000);
        shape
            .positions
            .extend(shell.positions.iter().map(|position| radius * position));
        shape.normals.extend(shell.normals.iter().map(|normal| sign * normal));
    }
    assert_eq!(n_wrong(&shape), 0);
}

#[test]
fn given_normals_are_believed_where_they_are_trusted() {
    // All normals are given inward.
    for (shape, most_wrong) in [(shapes::sphere(3000), 0), (shapes::thin_plate(4000, 0.02), 20)] {
        let cloud = PointCloud::new(DVec3::ZERO, shape.positions.clone()).unwrap();
        let inward: Vec<Vec3> = shape.normals.iter().map(|normal| -normal).collect();
        for (rule, right) in [(SideRule::Given, &inward), (SideRule::Outward, &shape.normals)] {
            let parameters = Parameters {
                rule,
                ..Parameters::default()
            };
            let propagation = Propagation::new(&cloud, Some(&inward[..]), parameters, &Silent).unwrap();
            let normals = propagation.initial_normals();
            let n_wrong = normals.iter().zip(right).filter(|(a, b)| a.dot(**b) < 0.0).count();
            assert!(n_wrong <= most_wrong, "{n_wrong} are wrong by {rule:?}");
        }
    }
}

#[test]
fn few_points_and_many_in_one_place() {
    assert!(oriented(&[]).is_empty());
    for positions in [vec![Vec3::ONE], vec![Vec3::ONE; 40], vec![Vec3::ZERO, Vec3::X]] {
        let normals = oriented(&positions);
        assert!(normals.iter().all(|normal| normal.is_normalized()));
    }
    let line: Vec<Vec3> = (0..50).map(|i| Vec3::X * i as f32).collect();
    assert!(oriented(&line).iter().all(|normal| normal.is_normalized()));
}

#[test]
fn does_not_depend_on_threads() {
    let shape = shapes::fandisk_like(5000).with_noise(0.01, 3);
    let with_threads = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| oriented(&shape.positions))
    };
    assert_eq!(with_threads(1), with_threads(4));
}

#[test]
fn does_not_depend_on_order_rotation_and_scale() {
    let shape = shapes::fandisk_like(5000);
    let plain = oriented(&shape.positions);
    let n_points = plain.len();
    // A few points have neighbors at the same distance as others, or a normal at right angles to what decides.
    let most_different = n_points / 500;

    let shuffled: Vec<usize> = (0..n_points).map(|i| i * 1009 % n_points).collect();
    let positions: Vec<Vec3> = shuffled.iter().map(|&i| shape.positions[i]).collect();
    let again = oriented(&positions);
    let differ = shuffled
        .iter()
        .zip(&again)
        .filter(|(i, normal)| plain[**i].dot(**normal) < 0.0)
        .count();
    assert!(differ <= most_different, "{differ} by order");

    let doubled: Vec<Vec3> = shape.positions.iter().map(|position| 2.0 * position).collect();
    assert_eq!(oriented(&doubled), plain);

    let rotation = Mat3::from_quat(Quat::from_xyzw(0.1, 0.7, -0.3, 0.5).normalize());
    let turned: Vec<Vec3> = shape.positions.iter().map(|&position| rotation * position).collect();
    let differ = (oriented(&turned).iter().zip(&plain))
        .filter(|(a, b)| a.dot(rotation * **b) < 0.0)
        .count();
    assert!(differ <= most_different, "{differ} by rotation");
}

/// A random graph with couplings of both signs: rows of `K_RANDOM` neighbors, and the sign that each point should have.
fn any_graph() -> impl Strategy<Value = (Vec<u32>, Vec<bool>)> {
    (2_usize..60).prop_flat_map(|n_points| {
        let neighbor = 0..n_points as u32;
        let rows = prop::collection::vec(neighbor, n_points * K_RANDOM);
        (rows, prop::collection::vec(any::<bool>(), n_points))
    })
}

const K_RANDOM: usize = 3;

/// Rows without a point's own id and without repeats.
fn cleaned(rows: &[u32]) -> Vec<u32> {
    let mut rows = rows.to_vec();
    for (point, row) in rows.chunks_mut(K_RANDOM).enumerate() {
        row.sort_unstable();
        for i in 0..row.len() {
            if row[i] == point as u32 || row[..i].contains(&row[i]) {
                row[i] = u32::MAX;
            }
        }
    }
    rows
}

/// Couplings from −30 to 30 that do not depend on the order of their ends, never 0.
fn random_coupling(a: u32, b: u32) -> i32 {
    let mixed = (a.min(b) * 7919 + a.max(b) * 104_729) % 61;
    if mixed == 30 { 1 } else { mixed as i32 - 30 }
}

fn no_pulls(n_points: usize) -> Vec<Pull> {
    vec![Pull::default(); n_points]
}

/// `−Σ J s s − Σ u s`.
fn energy(graph: &ClusterGraph, turned: &FixedBitSet) -> i64 {
    let sign = |cluster: usize| if turned.contains(cluster) { -1_i64 } else { 1 };
    (0..graph.n_clusters())
        .map(|a| {
            let couplings: i64 = graph
                .row(a)
                .map(|(b, j)| i64::from(j) * sign(a) * sign(b as usize))
                .sum();
            -couplings - 2 * graph.pulls()[a].strength() * sign(a)
        })
        .sum()
}

proptest! {
    #[test]
    fn signs_that_fit_every_coupling_are_found((rows, planted) in any_graph()) {
        let rows = cleaned(&rows);
        let coupling = |a: u32, b: u32| {
            let strength = random_coupling(a, b).abs();
            if planted[a as usize] == planted[b as usize] { strength } else { -strength }
        };
        let graph = ClusterGraph::of_points(&rows, K_RANDOM, no_pulls(planted.len()), coupling);
        let points = graph.clone();
        let turned = refined_signs(&agglomerate(graph, &Silent).unwrap(), &Silent).unwrap();
        for a in 0..planted.len() {
            for (b, _) in points.row(a) {
                let b = b as usize;
                prop_assert_eq!(planted[a] == planted[b], turned.contains(a) == turned.contains(b));
            }
        }
    }

    #[test]
    fn joined_couplings_are_sums((rows, planted) in any_graph(), n_parents in 1_u32..9) {
        let rows = cleaned(&rows);
        let pulls = (0..planted.len()).map(|i| Pull { signed: i as i64 - 9, visible: i as i64 + 9 }).collect();
        let graph = ClusterGraph::of_points(&rows, K_RANDOM, pulls, random_coupling);
        let parents: Vec<u32> = (0..planted.len() as u32).map(|i| i * 31 % n_parents).collect();
        let turned: FixedBitSet = planted.iter().enumerate().filter(|(_, turned)| **turned).map(|(i, _)| i).collect();
        let joined = graph.contract(&parents, n_parents as usize, &turned);
        let mut expect = vec![vec![0_i64; n_parents as usize]; n_parents as usize];
        let mut pulls = vec![Pull::default(); n_parents as usize];
        for a in 0..planted.len() {
            let pull = graph.pulls()[a];
            let joined = &mut pulls[parents[a] as usize];
            joined.signed += if planted[a] { -pull.signed } else { pull.signed };
            joined.visible += pull.visible;
            for (b, coupling) in graph.row(a) {
                let sign = if planted[a] == planted[b as usize] { 1 } else { -1 };
                expect[parents[a] as usize][parents[b as usize] as usize] += sign * i64::from(coupling);
            }
        }
        prop_assert_eq!(joined.pulls(), &pulls[..]);
        for (a, expect) in expect.iter().enumerate() {
            let mut found = vec![0_i64; n_parents as usize];
            joined.row(a).for_each(|(b, coupling)| found[b as usize] = i64::from(coupling));
            for (b, &expect) in expect.iter().enumerate().filter(|(b, _)| *b != a) {
                prop_assert_eq!(found[b], expect);
            }
        }
    }

    #[test]
    fn refinement_only_lowers_the_energy((rows, planted) in any_graph()) {
        let rows = cleaned(&rows);
        // Couplings alone: the pull of a cluster is not the sum of its points' pulls, so with them levels have energies of their own.
        let graph = ClusterGraph::of_points(&rows, K_RANDOM, no_pulls(planted.len()), random_coupling);
        let points = graph.clone();
        let agglomeration = agglomerate(graph, &Silent).unwrap();
        let mut joined: FixedBitSet = FixedBitSet::with_capacity(planted.len());
        let mut clusters: Vec<u32> = (0..planted.len() as u32).collect();
        for level in &agglomeration.levels {
            for (point, cluster) in clusters.iter_mut().enumerate() {
                if level.turned.contains(*cluster as usize) {
                    joined.toggle(point);
                }
                *cluster = level.parents[*cluster as usize];
            }
        }
        let refined = refined_signs(&agglomeration, &Silent).unwrap();
        prop_assert!(energy(&points, &refined) <= energy(&points, &joined));
    }
}

#[test]
fn evidence_decides_where_couplings_do_not() {
    // Two strong pairs that a weak coupling holds together the wrong way, and evidence for both.
    let rows = [1, 0, 1, 2];
    let coupling = |a: u32, b: u32| if a.min(b) == 1 { -10 } else { 1000 };
    let pull = |signed| Pull {
        signed,
        visible: i64::from(UNIT),
    };
    let sure = i64::from(UNIT);
    for (pulls, expect) in [
        ([0, 0, 0, 0], [false, false, true, true]),
        ([sure, sure, sure, sure], [false; 4]),
        ([-sure, 0, 0, -sure], [true; 4]),
        // One-sided evidence has nothing to be in series with.
        ([sure, sure, 0, 0], [false, false, true, true]),
    ] {
        let graph = ClusterGraph::of_points(&rows, 1, pulls.map(pull).to_vec(), coupling);
        let turned = refined_signs(&agglomerate(graph, &Silent).unwrap(), &Silent).unwrap();
        let turned: Vec<bool> = (0..4).map(|point| turned.contains(point)).collect();
        assert_eq!(turned, expect, "{pulls:?}");
    }
}

#[test]
fn couplings_follow_what_was_counted() {
    // A step between two level sheets: reflection takes the edge for a mirror, the evidence knows better.
    let positions = [Vec3::ZERO, Vec3::new(0.5, 0.0, 1.0)];
    let normals = [Vec3::Z; 2];
    let copies = 500;
    let positions: Vec<Vec3> = (0..copies)
        .flat_map(|i| {
            positions
                .iter()
                .map(move |position| *position + 10.0 * i as f32 * Vec3::Y)
        })
        .collect();
    let normals = normals.repeat(copies);
    let radii = vec![1.0; positions.len()];
    let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
    let surface = Surface {
        cloud: &cloud,
        normals: &normals,
        radii: &radii,
    };
    let rows: Vec<u32> = (0..2 * copies as u32).map(|point| point ^ 1).collect();
    let unknown = Evidence::none(2 * copies);
    assert!(EdgeModel::learn(surface, &rows, 1, &unknown).coupling(surface, 0, 1) < 0);
    let known = evidence::given(&normals, &normals, 1.0);
    let learned = EdgeModel::learn(surface, &rows, 1, &known);
    assert!(learned.coupling(surface, 0, 1) > 0);
    assert_eq!(learned.coupling(surface, 0, 1), learned.coupling(surface, 1, 0));
}

#[test]
fn patches_are_connected_parts_of_the_tree() {
    let shape = shapes::fandisk_like(3000);
    let cloud = PointCloud::new(DVec3::ZERO, shape.positions).unwrap();
    let propagation = Propagation::new(&cloud, None, Parameters::default(), &Silent).unwrap();
    let (tree, patches) = (&propagation.tree, propagation.patches.as_ref().unwrap());
    assert!((0..tree.n_points() as u32).all(|position| !tree.phi(position)));
    for point in (0..3000).step_by(97) {
        for patch in patches.around(point) {
            // A connected part of a tree has one top: all other points have their parent inside.
            let inside: Vec<u32> = (0..3000)
                .filter(|&other| patch.leaves().contains(&patches.leaf(other)))
                .collect();
            let tops = inside.iter().filter(|&&other| {
                let parent = tree.parent(tree.position(other));
                parent.is_none_or(|parent| !inside.contains(&tree.order()[parent as usize]))
            });
            assert_eq!(tops.count(), 1);
        }
    }
}
