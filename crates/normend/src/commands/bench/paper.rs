//! `normend bench paper`: the figures of Liu et al. as tables, on clouds with a known truth.

use std::fmt::Write as _;
use std::io::{self, Write as _};

use anyhow::Context;
use glam::{DVec3, Vec3};
use normend_core::metrics::compare;
use normend_core::shapes::octahedron;
use normend_core::{
    Estimator, Neighbors, Parameters, PointCloud, Preset, Progress, Propagation, SourceRule, Stage, normals, visibility,
};

use super::super::check::{check_same_points, normals_of};
use super::super::{Outcome, check_may_write, prepare};
use super::folder::{Case, Found, find, for_each_case, n_threads};
use super::quality::OPEN;
use crate::arguments::bench::PaperArguments;
use crate::console::{self, Bar, counted};

/// A method to compare: its name in the tables, and what it does.
struct Method {
    name: &'static str,
    parameters: fn() -> Parameters,
}

/// A normal estimator and one default source a component.
fn with_tree(estimator: Estimator) -> Parameters {
    Parameters {
        estimator,
        k_normals: estimator.usual_k(),
        ..Preset::Tree.parameters()
    }
}

/// All methods, in the order of columns; the first [`N_ESTIMATORS`] differ in their normals alone.
const METHODS: [Method; 7] = [
    Method {
        name: "PCA + MST",
        parameters: || with_tree(Estimator::Pca),
    },
    Method {
        name: "WPCA + MST",
        parameters: || with_tree(Estimator::Wpca),
    },
    Method {
        name: "RRHT + MST",
        parameters: || with_tree(Estimator::Rrht),
    },
    Method {
        name: "OBNE + MST",
        parameters: || with_tree(Estimator::Obne),
    },
    Method {
        name: "paper",
        parameters: || Preset::Paper.parameters(),
    },
    Method {
        name: "paper, mended votes",
        parameters: || Parameters {
            sources: SourceRule::HiddenPointsMended,
            ..Preset::Paper.parameters()
        },
    },
    Method {
        name: "auto",
        parameters: || Preset::Auto.parameters(),
    },
];

/// How many of [`METHODS`] are compared in the manner of Fig. 6.
const N_ESTIMATORS: usize = 4;

/// The thresholds of Fig. 5.
const ETAS: [f32; 3] = [0.1, 0.07, 0.05];

/// The ways of voting that are compared in the manner of Fig. 5.
const RULES: [SourceRule; 2] = [SourceRule::HiddenPoints, SourceRule::HiddenPointsMended];

/// Shares of the diagonal by which Fig. 12 displaces each point.
const DISPLACEMENTS: [f32; 4] = [0.0, 0.005, 0.01, 0.02];

/// Points of the octahedron: about as many as in the figure.
const OCTAHEDRON_POINTS: usize = 16_000;

/// Sources of one cloud, and how many of them vouch for the right side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Purity {
    sources: usize,
    right: usize,
}

/// What a method made of a cloud.
#[derive(Clone, Debug, PartialEq)]
struct Made {
    wrong_share: f64,
    seconds: Vec<(Stage, f64)>,
}

/// What is measured of one cloud.
#[derive(Clone, Debug, PartialEq)]
struct Measured {
    class: String,
    name: String,
    points: usize,
    /// By method.
    made: Vec<Made>,
    /// By rule and eta.
    purities: [[Purity; ETAS.len()]; RULES.len()],
}

/// Measures every cloud of the folders and writes the tables.
///
/// # Errors
/// A folder without clouds, an output that cannot be written, Ctrl-C. What is wrong with one cloud is said instead, and the outcome
/// is a failure.
pub fn run(arguments: &PaperArguments) -> anyhow::Result<Outcome> {
    if let Some(output) = &arguments.output {
        check_may_write(output, arguments.overwrite)?;
    }
    let found: Vec<Found> = arguments
        .folders
        .iter()
        .map(|folder| find(folder, &arguments.only))
        .collect::<Result<_, _>>()?;
    prepare(&arguments.common)?;
    let threads = n_threads(arguments.common.threads);
    let mut outcome = Outcome::Done;
    let mut text = HEAD.to_owned();
    for (folder, found) in arguments.folders.iter().zip(found) {
        let title = folder.canonicalize().unwrap_or_else(|_| folder.clone());
        let title = super::super::title_of(&title);
        let bar = Bar::new(&title, arguments.common.quiet);
        bar.stage("Orienting");
        let mut clouds = Vec::new();
        for result in for_each_case(&found.cases, threads, &bar, measure)? {
            match result {
                Ok(measured) => clouds.push(measured),
                Err(error) if console::is_stopped() => return Err(error),
                Err(error) => {
                    bar.say_error(&format!("error: {}", console::in_words(&error)));
                    outcome = Outcome::Failed;
                }
            }
        }
        if found.n_without_truth > 0 {
            bar.say(&format!(
                "{} without a truth left out",
                counted(found.n_without_truth, "cloud")
            ));
        }
        // Writing to a string does not fail.
        let _ = writeln!(text, "\n## Clouds of `{title}`");
        write_tables(&mut text, &clouds);
    }
    let bar = Bar::new("octahedron", arguments.common.quiet);
    write_noise(&mut text, &bar)?;
    drop(bar);
    match &arguments.output {
        Some(output) => {
            normend_io::write_bytes(output, text.as_bytes())?;
        }
        None => io::stdout()
            .lock()
            .write_all(text.as_bytes())
            .context("cannot write to standard output")?,
    }
    Ok(outcome)
}

const HEAD: &str = "\
# The paper's figures as tables

Written by `normend bench paper`. Figures are those of Liu et al., *Mendable Consistent Orientation of Point Clouds*. A normal is wrong
when it points away from the true one; nothing may be flipped, save a whole cloud of the class open. Estimators take 12 neighbors (RRHT
24), the graph 6. \"MST\" is one source, the highest point of each component; \"paper\" is OBNE with sources voted for by 8 corners of the
bounding box, eta 0.07, and MMST; \"mended votes\" has the viewpoints two diagonals out, directions to each point, and the surest 7 % of
what is seen as sources, where at least 90 % of what is said agrees.
";

/// Runs every method on one cloud.
fn measure(case: &Case, progress: &dyn Progress) -> anyhow::Result<Measured> {
    let truth = normend_io::read(&case.truth, progress)?;
    let right = normals_of(&truth, &case.truth)?;
    let scan = normend_io::read(&case.raw, progress)?;
    check_same_points(&truth, &case.truth, &scan, &case.raw)?;
    let is_open = case.class == OPEN;
    let made = METHODS
        .iter()
        .map(|method| run_method(method, &scan.cloud, &right, is_open, progress))
        .collect::<anyhow::Result<_>>()?;
    Ok(Measured {
        class: case.class.clone(),
        name: case.name.clone(),
        points: scan.cloud.n_points(),
        made,
        purities: purities(&scan.cloud, &right, is_open, progress)?,
    })
}

fn run_method(
    method: &Method,
    cloud: &PointCloud,
    right: &[Vec3],
    may_flip: bool,
    progress: &dyn Progress,
) -> anyhow::Result<Made> {
    let propagation = Propagation::new(cloud, None, (method.parameters)(), progress)?;
    let comparison = compare(cloud, right, &propagation.initial_normals(), progress)?;
    let n_wrong = if may_flip {
        comparison.n_wrong_global_flip
    } else {
        comparison.n_wrong
    };
    Ok(Made {
        wrong_share: n_wrong as f64 / comparison.n_judged.max(1) as f64,
        seconds: propagation.seconds,
    })
}

/// Votes on the normals of the preset "paper" and counts the sources that vouch for the right side; of an open surface for the
/// side that most vouch for.
fn purities(
    cloud: &PointCloud,
    right: &[Vec3],
    may_flip: bool,
    progress: &dyn Progress,
) -> anyhow::Result<[[Purity; ETAS.len()]; RULES.len()]> {
    let Parameters {
        estimator,
        k_normals,
        views,
        ..
    } = Preset::Paper.parameters();
    let neighbors = Neighbors::find(cloud, k_normals, progress)?;
    let stored = normals::estimate(cloud, &neighbors, k_normals, estimator, progress)?;
    let mut purities = [[Purity::default(); ETAS.len()]; RULES.len()];
    for (rule, by_eta) in RULES.into_iter().zip(&mut purities) {
        let viewpoints = visibility::viewpoints(cloud, rule, views);
        let votes = visibility::votes(cloud, &neighbors, k_normals, &stored, rule, &viewpoints, progress)?;
        let sorted = visibility::SortedVotes::new(&votes, rule);
        for (eta, purity) in ETAS.into_iter().zip(by_eta) {
            let sources = visibility::sources(&votes, &stored, &sorted, eta);
            let judged = sources
                .iter()
                .filter(|source| right[source.point as usize] != Vec3::ZERO);
            let is_right = |source: &&normend_core::Source| source.normal.dot(right[source.point as usize]) > 0.0;
            purity.sources = judged.clone().count();
            purity.right = judged.filter(is_right).count();
            if may_flip {
                purity.right = purity.right.max(purity.sources - purity.right);
            }
        }
    }
    Ok(purities)
}

fn write_tables(text: &mut String, clouds: &[Measured]) {
    let mut classes: Vec<&str> = clouds.iter().map(|cloud| cloud.class.as_str()).collect();
    classes.sort_unstable();
    classes.dedup();
    let of_class = |class: &str| -> Vec<&Measured> { clouds.iter().filter(|cloud| cloud.class == class).collect() };
    let method_names = || METHODS.iter().map(|method| method.name);

    // Writing to a string does not fail, here and below.
    let _ = writeln!(
        text,
        "\n### Wrong share by class, mean and median (after Fig. 6 and 14)\n"
    );
    header(text, ["class", "clouds"].into_iter().chain(method_names()));
    for class in &classes {
        let of_class = of_class(class);
        let _ = write!(text, "| {class} | {} |", of_class.len());
        for shares in sorted_shares(&of_class) {
            let _ = write!(text, " {:.4}, {:.4} |", mean(&shares), median(&shares));
        }
        text.push('\n');
    }

    let sharp = of_class("sharp");
    if !sharp.is_empty() {
        let _ = writeln!(
            text,
            "\n### Wrong share of normal estimators, class sharp (after Fig. 6)\n"
        );
        header(
            text,
            ["cloud", "points"].into_iter().chain(method_names().take(N_ESTIMATORS)),
        );
        for cloud in sharp {
            let _ = write!(text, "| {} | {} |", cloud.name, cloud.points);
            for made in &cloud.made[..N_ESTIMATORS] {
                let _ = write!(text, " {:.4} |", made.wrong_share);
            }
            text.push('\n');
        }
    }

    let _ = writeln!(text, "\n### Wrong shares in ascending order (after Fig. 14)\n");
    header(text, ["class", "method", "wrong share of each cloud"].into_iter());
    for class in &classes {
        for (name, shares) in method_names().zip(sorted_shares(&of_class(class))) {
            let listed: Vec<String> = shares.iter().map(|share| format!("{share:.4}")).collect();
            let _ = writeln!(text, "| {class} | {name} | {} |", listed.join(" "));
        }
    }

    let _ = writeln!(text, "\n### Number and purity of sources against eta (after Fig. 5)\n");
    let columns = |rule: &str| ETAS.map(|eta| format!("{rule}, {eta}"));
    let columns: Vec<String> = ["paper", "mended"].into_iter().flat_map(columns).collect();
    header(
        text,
        ["class", "cloud"].into_iter().chain(columns.iter().map(String::as_str)),
    );
    let mut write_row = |class: &str, name: &str, clouds: &[&Measured]| {
        let _ = write!(text, "| {class} | {name} |");
        for rule in 0..RULES.len() {
            for eta in 0..ETAS.len() {
                let purities: Vec<Purity> = clouds.iter().map(|cloud| cloud.purities[rule][eta]).collect();
                let number = purities.iter().map(|purity| purity.sources).sum::<usize>() / clouds.len().max(1);
                let shares: Vec<f64> = purities.into_iter().filter_map(share_of).collect();
                if shares.is_empty() {
                    let _ = write!(text, " {number} |");
                } else {
                    let _ = write!(text, " {number}, {:.1} % |", 100.0 * mean(&shares));
                }
            }
        }
        text.push('\n');
    };
    for cloud in clouds {
        write_row(&cloud.class, &cloud.name, &[cloud]);
    }
    for class in &classes {
        write_row(class, "**mean**", &of_class(class));
    }
    write_row("all", "**mean**", &clouds.iter().collect::<Vec<_>>());

    let n_points: usize = clouds.iter().map(|cloud| cloud.points).sum();
    let _ = writeln!(
        text,
        "\n### Seconds of each stage for a million points, on one thread\n\nOver all {} clouds of {n_points} points together.\n",
        clouds.len()
    );
    header(text, ["method"].into_iter().chain(Stage::ALL.map(Stage::name)));
    for (index, name) in method_names().enumerate() {
        let _ = write!(text, "| {name} |");
        for stage in Stage::ALL {
            let stages = clouds.iter().flat_map(|cloud| &cloud.made[index].seconds);
            let seconds: f64 = stages
                .filter(|(of, _)| *of == stage)
                .fold(0.0, |sum, (_, seconds)| sum + seconds);
            let _ = write!(text, " {:.2} |", seconds * 1e6 / n_points.max(1) as f64);
        }
        text.push('\n');
    }
}

/// Fig. 12: the octahedron with noise.
fn write_noise(text: &mut String, bar: &Bar) -> anyhow::Result<()> {
    let _ = writeln!(
        text,
        "\n## Noise on an octahedron of {OCTAHEDRON_POINTS} generated points (after Fig. 12)\n\n\
         Every point is displaced by the same share of the diagonal in a random direction.\n"
    );
    header(
        text,
        ["displaced by"]
            .into_iter()
            .chain(METHODS.iter().map(|method| method.name)),
    );
    for share in DISPLACEMENTS {
        let shape = octahedron(OCTAHEDRON_POINTS).displaced(share, 1);
        let cloud = PointCloud::new(DVec3::ZERO, shape.positions)?;
        let _ = write!(text, "| {:.1} % |", 100.0 * share);
        for method in &METHODS {
            let made = run_method(method, &cloud, &shape.normals, false, bar)?;
            let _ = write!(text, " {:.4} |", made.wrong_share);
        }
        text.push('\n');
    }
    Ok(())
}

/// The head of a Markdown table.
fn header<'a>(text: &mut String, columns: impl Iterator<Item = &'a str>) {
    let mut rule = String::from("|");
    text.push('|');
    for column in columns {
        let _ = write!(text, " {column} |");
        rule.push_str(" --- |");
    }
    let _ = writeln!(text, "\n{rule}");
}

/// The wrong shares of several clouds in ascending order, by method.
fn sorted_shares(clouds: &[&Measured]) -> Vec<Vec<f64>> {
    (0..METHODS.len())
        .map(|method| {
            let mut shares: Vec<f64> = clouds.iter().map(|cloud| cloud.made[method].wrong_share).collect();
            shares.sort_by(f64::total_cmp);
            shares
        })
        .collect()
}

/// The share of the sources that vouch for the right side; `None` of no sources.
fn share_of(purity: Purity) -> Option<f64> {
    (purity.sources > 0).then(|| purity.right as f64 / purity.sources as f64)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Of values in ascending order; of an even number the mean of the two in the middle.
fn median(values: &[f64]) -> f64 {
    mean(&values[(values.len() - 1) / 2..=values.len() / 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(name: &str, wrong_share: f64, sources: usize) -> Measured {
        let made = Made {
            wrong_share,
            seconds: vec![(Stage::Tree, 0.5)],
        };
        let purity = Purity {
            sources,
            right: sources / 2,
        };
        Measured {
            class: "sharp".to_owned(),
            name: name.to_owned(),
            points: 1000,
            made: vec![made; METHODS.len()],
            purities: [[purity; ETAS.len()]; RULES.len()],
        }
    }

    #[test]
    fn every_cloud_and_method_is_in_the_tables() {
        let mut text = String::new();
        write_tables(
            &mut text,
            &[measured("a", 0.3, 10), measured("b", 0.1, 0), measured("c", 0.5, 20)],
        );
        assert!(text.contains("| sharp | PCA + MST | 0.1000 0.3000 0.5000 |"), "{text}");
        assert!(text.contains("| sharp | 3 | 0.3000, 0.3000 |"), "{text}");
        // A cloud without sources counts in their number, not in their purity.
        assert!(text.contains("| all | **mean** | 10, 50.0 % |"), "{text}");
        assert!(text.contains("| sharp | b | 0 |"), "{text}");
        for method in &METHODS {
            assert!(text.contains(method.name));
        }
        // 1.5 seconds of 3000 points.
        assert!(text.contains(" 500.00 |"), "{text}");
    }

    #[test]
    fn estimators_come_first() {
        for (index, method) in METHODS.iter().enumerate() {
            let parameters = (method.parameters)();
            let one_source =
                parameters.sources == SourceRule::Highest && parameters.method == normend_core::Method::SpanningTree;
            assert_eq!(index < N_ESTIMATORS, one_source);
        }
    }

    #[test]
    fn an_octahedron_without_noise_is_right() {
        let shape = octahedron(2000);
        let cloud = PointCloud::new(DVec3::ZERO, shape.positions).unwrap();
        let made = run_method(&METHODS[5], &cloud, &shape.normals, false, &normend_core::Silent).unwrap();
        assert_eq!(made.wrong_share, 0.0);
    }
}
