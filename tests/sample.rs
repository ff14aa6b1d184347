//! The bundled sample is what its generator makes: a part whose normals, as given, leave a patch to mend.

#![expect(clippy::unwrap_used, reason = "helpers of tests fail as tests do, by panicking")]

use std::path::Path;
use std::sync::Arc;

use normend_core::{Document, Edit, Neighbors, Parameters, Preset, Propagation, Silent, Start, metrics, shapes};
use normend_io::{FileFormat, Positions, Scan, read, write_points};

fn sample() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/sample.ply"))
}

/// The sample as the editor starts: with the normals of its file kept.
fn opened(scan: &Scan) -> Document {
    let parameters = Parameters {
        start: Start::Keep,
        ..Parameters::default()
    };
    let given = scan.given_normals.as_ref().unwrap();
    let propagation = Propagation::new(&scan.cloud, Some(given.as_slice()), parameters, &Silent).unwrap();
    let mut document = Document::new(Arc::clone(&scan.cloud), scan.given_normals.clone());
    document.install(propagation);
    document
}

#[test]
fn the_sample_is_what_the_generator_makes() {
    let part = shapes::sample_part();
    let scan = read(sample(), &Silent).unwrap();
    assert_eq!((scan.format(), scan.n_left_out), (FileFormat::Ply, 0));
    assert_eq!(scan.cloud.n_points(), part.positions.len());
    // Sines may differ in the last bit from one system to the next.
    let most = 1e-6 * scan.cloud.diagonal();
    let origin = scan.cloud.origin().as_vec3();
    for (read, made) in scan.cloud.positions().iter().zip(&part.positions) {
        assert!(
            (origin + *read).distance(*made) <= most,
            "run the example make_sample again"
        );
    }
    // The normals are those of the spanning tree on the points of the file.
    let given = scan.given_normals.as_ref().unwrap();
    let tree = Propagation::new(&scan.cloud, None, Preset::Tree.parameters(), &Silent).unwrap();
    let oriented = tree.initial_normals();
    let n_other = given
        .iter()
        .zip(&oriented)
        .filter(|(a, b)| a.distance(**b) > 1e-3)
        .count();
    assert!(
        n_other * 1000 <= given.len(),
        "{n_other}: run the example make_sample again"
    );

    let folder = tempfile::tempdir().unwrap();
    let again = folder.path().join("sample.ply");
    write_points(&again, Positions::Float(&part.positions), Some(&oriented), &Silent).unwrap();
    let (bundled, again) = (std::fs::read(sample()).unwrap(), std::fs::read(again).unwrap());
    assert_eq!(bundled.len(), again.len());
    // It is in the repository and in the program.
    assert!(bundled.len() < 1_500_000);
}

/// The connected wrong patches (over the 8 nearest), largest first.
fn wrong_patches(neighbors: &Neighbors, wrong: &dyn Fn(usize) -> bool, n_points: usize) -> Vec<Vec<usize>> {
    let mut is_seen = vec![false; n_points];
    let mut patches = Vec::new();
    for start in 0..n_points {
        if is_seen[start] || !wrong(start) {
            continue;
        }
        is_seen[start] = true;
        let mut patch = vec![start];
        let mut next = 0;
        while next < patch.len() {
            for &neighbor in neighbors.of(patch[next]) {
                let neighbor = neighbor as usize;
                if !is_seen[neighbor] && wrong(neighbor) {
                    is_seen[neighbor] = true;
                    patch.push(neighbor);
                }
            }
            next += 1;
        }
        patches.push(patch);
    }
    patches.sort_by_key(|patch| std::cmp::Reverse(patch.len()));
    patches
}

#[test]
fn the_given_normals_leave_one_patch_that_a_click_mends() {
    let truth = shapes::sample_part().normals;
    let scan = read(sample(), &Silent).unwrap();
    let cloud = Arc::clone(&scan.cloud);
    let n_points = cloud.n_points();
    let mut document = opened(&scan);
    assert_eq!(
        &document.oriented_normals().unwrap(),
        scan.given_normals.as_deref().unwrap()
    );

    let compare = |document: &Document| {
        let normals = document.oriented_normals().unwrap();
        metrics::compare(&cloud, &truth, &normals, &Silent).unwrap()
    };
    let before = compare(&document);
    let neighbors = Neighbors::find(&cloud, 8, &Silent).unwrap();
    let patches = wrong_patches(&neighbors, &|point| before.wrong.contains(point), n_points);
    let patch = &patches[0];
    assert!(patch.len() * 100 >= n_points, "{}", patch.len());
    // The rest is right, so that it is clear what to mend.
    assert!(before.n_wrong - patch.len() < n_points / 1000, "{}", before.n_wrong);

    // A click mends it wherever it lands, rims aside.
    let mends = |point: &usize| {
        let n_turned = document.preview_mend(*point as u32).unwrap().n_points() as f64 / patch.len() as f64;
        (0.98..1.02).contains(&n_turned)
    };
    let good_clicks: Vec<usize> = patch.iter().copied().filter(mends).collect();
    assert!(
        good_clicks.len() * 10 > patch.len() * 9,
        "{} of {}",
        good_clicks.len(),
        patch.len()
    );
    document.apply(Edit::Mend(good_clicks[0] as u32)).unwrap();
    let after = compare(&document);
    // What is left lies on the sharp rims.
    assert!(after.n_wrong < n_points / 200, "{}", after.n_wrong);

    // The automatic method needs no click.
    document.install(Propagation::new(&cloud, None, Preset::Auto.parameters(), &Silent).unwrap());
    document.undo().unwrap();
    assert!(document.sources().is_empty());
    let automatic = compare(&document);
    assert!(automatic.n_wrong < n_points / 1000, "{}", automatic.n_wrong);
}
