//! How long each stage of a propagation takes on 100 000 points.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::DVec3;
use normend_core::shapes::{self, Shape};
use normend_core::{
    Cancelled, EdgeRule, Estimator, Neighbors, PointCloud, Preset, Propagation, RiemannianGraph, Silent, SpanningTree,
    metrics, normals,
};

const N_POINTS: usize = 100_000;

fn cloud(shape: &Shape) -> PointCloud {
    let Ok(cloud) = PointCloud::new(DVec3::ZERO, shape.positions.clone()) else {
        unreachable!("generated points are finite and of moderate extent")
    };
    cloud
}

fn finished<T>(result: Result<T, Cancelled>) -> T {
    let Ok(value) = result else {
        unreachable!("silent progress never cancels")
    };
    value
}

fn stages(criterion: &mut Criterion) {
    let shape = shapes::mechanical_part(N_POINTS).with_noise(0.0006, 1);
    let cloud = cloud(&shape);
    let parameters = Preset::Tree.parameters();
    let (k, k_graph) = (parameters.k_normals, parameters.k_graph);
    let neighbors = finished(Neighbors::find(&cloud, k, &Silent));
    let normals = finished(normals::estimate(&cloud, &neighbors, k, Estimator::Obne, &Silent));
    let graph = finished(RiemannianGraph::new(
        &cloud,
        &neighbors,
        k_graph,
        &normals,
        EdgeRule::Dot,
        &Silent,
    ));

    let mut group = criterion.benchmark_group("orient_100k");
    group.sample_size(10);
    group.bench_function("neighbors", |bencher| {
        bencher.iter(|| Neighbors::find(black_box(&cloud), k, &Silent))
    });
    for estimator in Estimator::ALL {
        group.bench_function(estimator.name(), |bencher| {
            bencher.iter(|| normals::estimate(black_box(&cloud), &neighbors, k, estimator, &Silent));
        });
    }
    for rule in EdgeRule::ALL {
        group.bench_function(format!("graph_{}", rule.name()), |bencher| {
            bencher.iter(|| RiemannianGraph::new(black_box(&cloud), &neighbors, k_graph, &normals, rule, &Silent));
        });
    }
    group.bench_function("tree", |bencher| {
        bencher.iter(|| SpanningTree::new(black_box(&graph), &Silent))
    });
    for preset in [Preset::Tree, Preset::Auto] {
        group.bench_function(format!("propagation_{}", preset.name()), |bencher| {
            bencher.iter(|| Propagation::new(black_box(&cloud), None, preset.parameters(), &Silent));
        });
    }
    group.bench_function("compare", |bencher| {
        bencher.iter(|| metrics::compare(black_box(&cloud), &shape.normals, &normals, &Silent));
    });
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
