//! How long a click takes: `Edit::Mend` with its undo, and its preview, among standing sources.
//!
//! Criterion gives means; the tail is what a user feels, so the percentiles of many single clicks are printed too.
//! Picks are random, which is harder than a user's: most of them split a large right region somewhere in its middle.

use std::f32::consts::TAU;
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use fixedbitset::FixedBitSet;
use glam::{DVec3, Vec3};
use normend_core::sources::Origin;
use normend_core::{Document, Edit, Estimator, Parameters, PointCloud, Preset, Propagation, Regions, Silent, Source};

/// Random numbers: SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators").
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^ (bits >> 31)
    }

    /// In 0..1.
    fn fraction(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1_u64 << 24) as f32
    }

    fn below(&mut self, end: usize) -> u32 {
        (self.next() % end as u64) as u32
    }
}

/// A noisy torus scanned at random: `n_points` with noise of half their spacing, and the tree of their normals. Where
/// `n_points_per_cut` is given, so many points on average have one initial cut, as when given normals are kept.
fn scan(n_points: usize, n_points_per_cut: Option<usize>) -> Document {
    const MAJOR: f32 = 1.0;
    const MINOR: f32 = 0.4;
    let area = TAU * TAU * MAJOR * MINOR;
    let noise = 0.5 * (area / n_points as f32).sqrt();
    let mut random = Random(1);
    let positions = (0..n_points)
        .map(|_| {
            let (around, across) = (TAU * random.fraction(), TAU * random.fraction());
            let radius = MINOR + noise * (2.0 * random.fraction() - 1.0);
            let out = MAJOR + radius * across.cos();
            Vec3::new(out * around.cos(), out * around.sin(), radius * across.sin())
        })
        .collect();
    let Ok(cloud) = PointCloud::new(DVec3::ZERO, positions) else {
        unreachable!("a torus is finite and not small")
    };
    let parameters = Parameters {
        estimator: Estimator::Pca,
        ..Preset::Tree.parameters()
    };
    let Ok(mut propagation) = Propagation::new(&cloud, None, parameters, &Silent) else {
        unreachable!("silent progress never cancels")
    };
    if let Some(n_points_per_cut) = n_points_per_cut {
        let tree = Arc::clone(&propagation.tree);
        let mut cuts = FixedBitSet::with_capacity(n_points);
        for position in 0..n_points {
            let is_root = tree.parent(position as u32).is_none();
            cuts.set(position, !is_root && random.below(n_points_per_cut) == 0);
        }
        propagation.base_regions = Regions::new(tree, cuts, FixedBitSet::with_capacity(n_points));
    }
    let mut document = Document::new(Arc::new(cloud), None);
    document.install(propagation);
    document
}

fn apply(document: &mut Document, edit: Edit) {
    let Ok(change) = document.apply(edit) else {
        unreachable!("the points exist")
    };
    black_box(change);
}

fn preview(document: &Document, point: u32) {
    let Ok(change) = document.preview_mend(point) else {
        unreachable!("the point exists")
    };
    black_box(change);
}

/// How long `act` takes.
fn time(act: impl FnOnce()) -> Duration {
    let start = Instant::now();
    act();
    start.elapsed()
}

/// Prints single times by percentile.
fn print_percentiles(what: &str, mut times: Vec<Duration>) {
    times.sort_unstable();
    let percentile = |percent: usize| times[(times.len() - 1) * percent / 100];
    println!(
        "  {what:8} p50 {:>9.1?}  p99 {:>9.1?}  max {:>9.1?}",
        percentile(50),
        percentile(99),
        percentile(100)
    );
}

fn time_clicks(document: &mut Document, random: &mut Random) {
    const N_CLICKS: usize = 10_000;
    let n_points = document.cloud().n_points();
    let [mut previews, mut mends, mut undos] = [(); 3].map(|()| Vec::with_capacity(N_CLICKS));
    for _ in 0..N_CLICKS {
        let point = random.below(n_points);
        previews.push(time(|| preview(document, point)));
        mends.push(time(|| apply(document, Edit::Mend(point))));
        undos.push(time(|| drop(black_box(document.undo()))));
    }
    println!("  of {N_CLICKS} single clicks:");
    print_percentiles("preview", previews);
    print_percentiles("mend", mends);
    print_percentiles("undo", undos);
}

fn time_batch(document: &mut Document, random: &mut Random) {
    const N_SOURCES: usize = 10_000;
    let n_points = document.cloud().n_points();
    let source = |_| {
        let normal = if random.next() & 1 == 1 { Vec3::Z } else { -Vec3::Z };
        Source {
            point: random.below(n_points),
            normal,
            origin: Origin::Picked,
            patch: None,
        }
    };
    let sources = (0..N_SOURCES).map(source).collect();
    let add = time(|| apply(document, Edit::AddSources(sources)));
    let undo = time(|| drop(black_box(document.undo())));
    println!("  a batch of {N_SOURCES} sources: {add:.1?}, undone in {undo:.1?}");
}

fn click(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("click");
    for (n_points, n_points_per_cut) in [(1_000_000, None), (1_000_000, Some(10)), (5_000_000, None)] {
        let mut document = scan(n_points, n_points_per_cut);
        let n_cuts = document.propagation().map_or(0, |propagation| {
            propagation.base_regions.n_base_regions() - propagation.tree.roots().len()
        });
        let mut random = Random(2);
        for n_sources in [1, 1000] {
            while document.sources().len() < n_sources {
                apply(&mut document, Edit::Mend(random.below(n_points)));
            }
            let setting = format!("{n_points} points, {n_cuts} initial cuts, {n_sources} sources");
            println!("\n{setting}");
            time_clicks(&mut document, &mut random);
            time_batch(&mut document, &mut random);
            group.bench_function(format!("preview/{setting}"), |bencher| {
                bencher.iter(|| preview(&document, random.below(n_points)));
            });
            group.bench_function(format!("mend and undo/{setting}"), |bencher| {
                bencher.iter(|| {
                    apply(&mut document, Edit::Mend(random.below(n_points)));
                    black_box(document.undo())
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, click);
criterion_main!(benches);
