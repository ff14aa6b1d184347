use std::sync::Arc;

use glam::{DVec3, Vec3};
use normend_core::document::ScannerChoice;
use normend_core::evidence::Station;
use normend_core::sources::{Origin, SourcePatch};
use normend_core::{Mark, PointSet, Preset, SideRule, Source};
use proptest::prelude::*;
use proptest::sample::select;

use super::*;

/// Any floats that are numbers, so that each bit counts; directions are checked by the document.
fn any_vec3() -> impl Strategy<Value = Vec3> {
    let component = any::<f32>().prop_filter("a number", |component| component.is_finite());
    [component.clone(), component.clone(), component].prop_map(Vec3::from)
}

fn any_source() -> impl Strategy<Value = (u32, Option<Source>)> {
    let patch = (any::<u32>(), any::<bool>()).prop_map(|(n_points, amid_mended)| SourcePatch { n_points, amid_mended });
    let rest = (any_vec3(), select(Origin::ALL.to_vec()), prop::option::of(patch));
    (any::<u32>(), prop::option::of(rest)).prop_map(|(point, rest)| {
        let source = |(normal, origin, patch)| Source {
            point,
            normal,
            origin,
            patch,
        };
        (point, rest.map(source))
    })
}

fn any_mark() -> impl Strategy<Value = (u32, Option<Mark>)> {
    let mark = (any_vec3(), any::<bool>()).prop_map(|(normal, pinned)| Mark { normal, pinned });
    (any::<u32>(), prop::option::of(mark))
}

fn any_points() -> impl Strategy<Value = PointSet> {
    prop_oneof![
        Just(PointSet::new()),
        prop::collection::vec(any::<u32>(), 0..20).prop_map(PointSet::from_iter),
        (0..200_000_u32, 1..50_000_u32).prop_map(|(first, n)| PointSet::from_iter(first..first + n)),
    ]
}

fn any_parameters() -> impl Strategy<Value = Parameters> {
    let whole = (select(Preset::ALL.to_vec()), select(SideRule::ALL.to_vec()));
    (whole, any::<usize>(), any::<usize>(), 0.0..1.0_f32).prop_map(|((preset, rule), k_normals, k_graph, eta)| {
        Parameters {
            k_normals,
            k_graph,
            eta,
            rule,
            ..preset.parameters()
        }
    })
}

fn any_scanner() -> impl Strategy<Value = ScannerChoice> {
    let station = (any::<u32>(), any::<u32>(), -1e7..1e7_f64, any_vec3()).prop_map(|(start, end, x, place)| Station {
        points: start..end,
        position: DVec3::new(x, f64::from(place.y), f64::from(place.z)),
    });
    (any::<bool>(), prop::collection::vec(station, 0..4)).prop_map(|(without_file, own)| ScannerChoice {
        without_file,
        own: own.into(),
    })
}

fn any_step() -> impl Strategy<Value = RecordedStep> {
    let change = (
        prop::collection::vec(any_source(), 0..4),
        prop::collection::vec(any_mark(), 0..9),
        [any_points(), any_points(), any_points()],
        prop::option::of(any_parameters()),
        prop::option::of(prop::collection::vec(any_vec3(), 0..4)),
        prop::option::of(any_scanner()),
    );
    let change = change.prop_map(
        |(sources, marks, [selected, hidden, accepted], parameters, viewpoints, scanner)| StateChange {
            sources,
            marks,
            selected,
            hidden,
            accepted,
            parameters,
            viewpoints: viewpoints.map(Arc::from),
            scanner,
        },
    );
    (select(EditKind::ALL.to_vec()), change, any::<u64>()).prop_map(|(kind, change, n_turned)| RecordedStep {
        kind,
        change,
        n_turned,
    })
}

fn any_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        4 => any_step().prop_map(Event::Step),
        2 => Just(Event::Undo),
        1 => Just(Event::Redo),
        1 => Just(Event::Exported),
    ]
}

fn any_recipe(n_events: usize) -> impl Strategy<Value = Recipe> {
    let scan = (
        ".*",
        prop::option::of(".*"),
        any::<u64>(),
        any::<[u8; 32]>(),
        // Steps name any points.
        (1_u64 << 32)..,
    );
    let scan = scan.prop_map(|(name, path, n_bytes, hash, n_points)| ScanIdentity {
        name,
        path,
        n_bytes,
        hash,
        n_points,
        columns: (n_points % 2 == 0).then(|| vec!["x".into(), "-".into(), "y".into(), "z".into()]),
        files: Vec::new(),
    });
    let scan = (scan, 0..3_usize).prop_map(|(scan, n_files)| ScanIdentity {
        files: vec![scan.clone(); n_files],
        ..scan
    });
    let events = prop::collection::vec(any_event(), 0..=n_events);
    (scan, any_parameters(), events).prop_map(|(scan, parameters, events)| Recipe {
        head: Head::new(scan, parameters),
        events,
    })
}

/// The bits of all floats, which equality does not tell: it knows no sign of zero.
fn bits(recipe: &Recipe) -> Vec<[u32; 3]> {
    let steps = recipe.events.iter().filter_map(|event| match event {
        Event::Step(step) => Some(&step.change),
        _ => None,
    });
    let normals = steps.flat_map(|change| {
        let sources = change
            .sources
            .iter()
            .filter_map(|(_, source)| Some(source.as_ref()?.normal));
        let marks = change.marks.iter().filter_map(|(_, mark)| Some(mark.as_ref()?.normal));
        let places = change.viewpoints.iter().flat_map(|places| places.iter().copied());
        sources.chain(marks).chain(places).collect::<Vec<_>>()
    });
    normals.map(|normal| normal.to_array().map(f32::to_bits)).collect()
}

/// Whatever was done to the bytes of `recipe`: what is read is a beginning of it.
fn check_beginning(bytes: &[u8], recipe: &Recipe) -> Result<Option<Reading>, TestCaseError> {
    let Ok(reading) = parse(bytes, "damaged") else {
        return Ok(None);
    };
    prop_assert_eq!(&reading.recipe.head, &recipe.head);
    let n_events = reading.recipe.events.len();
    prop_assert_eq!(Some(&*reading.recipe.events), recipe.events.get(..n_events));
    if n_events < recipe.events.len() && bytes.len() as u64 > reading.n_bytes {
        prop_assert_ne!(&reading.end, &End::Whole);
    }
    Ok(Some(reading))
}

proptest! {
    #[test]
    fn what_is_written_is_read_bit_for_bit(recipe in any_recipe(12)) {
        let bytes = recipe.encode().unwrap().1;
        let reading = parse(&bytes, "whole").unwrap();
        prop_assert_eq!(&reading.recipe, &recipe);
        prop_assert_eq!(bits(&reading.recipe), bits(&recipe));
        prop_assert_eq!((reading.end, reading.n_bytes), (End::Whole, bytes.len() as u64));
    }

    #[test]
    fn a_shortened_recipe_has_the_same_steps_and_state(recipe in any_recipe(20), most_bytes in 0..20_000_usize) {
        let all = recipe.shortened(usize::MAX).unwrap();
        prop_assert_eq!(all.history(), recipe.history());
        let few = recipe.shortened(most_bytes).unwrap();
        prop_assert_eq!(few.state(), recipe.state());
        prop_assert_eq!(few.is_exported(), recipe.is_exported());
        let ((steps, n_done), (few, n_few)) = (recipe.history(), few.history());
        // What was undone can still be done again, and so can the newest steps that have room.
        prop_assert_eq!(few.len() - n_few, steps.len() - n_done);
        let n_kept = few.len() - usize::from(few.len() < steps.len());
        prop_assert_eq!(&few[few.len() - n_kept..], &steps[steps.len() - n_kept..]);
    }

    #[test]
    fn a_file_that_is_continued_is_one_file(recipe in any_recipe(6), more in prop::collection::vec(any_event(), 0..4)) {
        let mut bytes = recipe.encode().unwrap().1;
        let mut reading = parse(&bytes, "first").unwrap();
        for event in &more {
            bytes.extend(reading.writer.event(event).unwrap());
        }
        let events = [recipe.events, more].concat();
        prop_assert_eq!(parse(&bytes, "both").unwrap().recipe.events, events);
    }

    #[test]
    fn a_file_that_is_cut_off_anywhere_gives_its_beginning(recipe in any_recipe(3)) {
        let bytes = recipe.encode().unwrap().1;
        let n_head = bytes.iter().position(|&byte| byte == b'\n').unwrap();
        // Sets of points make lines long; each of their bytes is like the others.
        for n_kept in (0..bytes.len()).filter(|n_kept| n_kept % (1 + bytes.len() / 2000) == 0) {
            let reading = check_beginning(&bytes[..n_kept], &recipe)?;
            prop_assert_eq!(reading.is_some(), n_kept >= n_head);
            if let Some(reading) = reading {
                prop_assert!(!matches!(reading.end, End::Damaged(_)), "{:?}", reading.end);
            }
        }
    }

    #[test]
    fn damage_gives_the_events_before_it(
        recipe in any_recipe(6),
        places in prop::collection::vec((any::<prop::sample::Index>(), 1..=255_u8), 1..4),
    ) {
        let mut bytes = recipe.encode().unwrap().1;
        for (place, flips) in places {
            let place = place.index(bytes.len());
            bytes[place] ^= flips;
        }
        check_beginning(&bytes, &recipe)?;
    }

    #[test]
    fn any_bytes_are_refused_in_words(bytes in prop::collection::vec(any::<u8>(), 0..200), head in any::<bool>()) {
        let bytes = if head { [&b"{\"format\":\"normend-recipe\""[..], &bytes].concat() } else { bytes };
        prop_assert!(parse(&bytes, "x").is_err());
    }

    #[test]
    fn the_state_is_that_of_the_steps_in_force(recipe in any_recipe(20)) {
        // As a document would do it.
        let mut state = State { parameters: recipe.head.parameters, ..State::default() };
        let (mut done, mut undone): (Vec<(StateChange, StateChange)>, Vec<_>) = Default::default();
        for event in &recipe.events {
            match event {
                Event::Step(step) => {
                    done.push((step.change.clone(), state.change(&step.change)));
                    undone.clear();
                }
                Event::Undo => if let Some(step) = done.pop() {
                    state.change(&step.1);
                    undone.push(step);
                },
                Event::Redo => if let Some(step) = undone.pop() {
                    state.change(&step.0);
                    done.push(step);
                },
                Event::Exported => {}
            }
        }
        prop_assert_eq!(recipe.state(), state);
        let (steps, n_done) = recipe.history();
        prop_assert_eq!((steps.len(), n_done), (done.len() + undone.len(), done.len()));
    }
}

fn a_head() -> Head {
    let scan = ScanIdentity {
        name: "church.ply".to_owned(),
        path: None,
        n_bytes: 123_456_789,
        hash: [7; 32],
        n_points: 4_000_000,
        columns: None,
        files: Vec::new(),
    };
    Head::new(scan, Parameters::default())
}

#[test]
fn a_click_is_small_and_a_hundred_thousand_points_are_some_megabytes() {
    let (mut lines, _) = LineWriter::begin(&a_head()).unwrap();
    let source = Source {
        point: 3_999_999,
        normal: Vec3::new(-0.577_350_3, -0.577_350_3, -0.577_350_3),
        origin: Origin::Picked,
        patch: Some(SourcePatch {
            n_points: 1_234_567,
            amid_mended: false,
        }),
    };
    let click = StateChange {
        sources: vec![(source.point, Some(source))],
        ..StateChange::default()
    };
    let click = lines.step(EditKind::TurnPatch, &click, 1_234_567).unwrap();
    assert!(click.len() <= 300, "{}", String::from_utf8_lossy(&click));
    let mark = Mark {
        normal: source.normal,
        pinned: false,
    };
    let flipped = StateChange {
        marks: (0..100_000).map(|n| (37 * n, Some(mark))).collect(),
        ..StateChange::default()
    };
    let flipped = lines.step(EditKind::FlipPoints, &flipped, 100_000).unwrap();
    assert!(flipped.len() < 2_000_000, "{}", flipped.len());
}

#[test]
fn damage_in_the_middle_names_its_line() {
    let (mut lines, head) = LineWriter::begin(&a_head()).unwrap();
    let events: Vec<Vec<u8>> = [Event::Undo, Event::Redo, Event::Exported]
        .iter()
        .map(|event| lines.event(event).unwrap())
        .collect();
    let read = |lines: &[&[u8]]| parse(&lines.concat(), "a.normend").unwrap();
    // A line that is missing, two that changed places.
    for wrong in [[&head[..], &events[0], &events[2]], [&head, &events[1], &events[0]]] {
        let n_right = usize::from(wrong[1] == events[0]);
        let reading = read(&wrong);
        assert_eq!(reading.recipe.events.len(), n_right);
        let End::Damaged(broken) = reading.end else {
            panic!("not noticed");
        };
        assert!(
            broken
                .to_string()
                .starts_with(&format!("line {}: the line is damaged", n_right + 2))
        );
    }
    // The last line has no end, but all of its content.
    let without_end = &events[0][..events[0].len() - 1];
    assert_eq!(read(&[&head, without_end]).recipe.events, [Event::Undo]);
}

#[test]
fn a_newer_format_and_unknown_names_are_refused_in_words() {
    let (_, head) = LineWriter::begin(&a_head()).unwrap();
    let head = String::from_utf8(head).unwrap();
    let newer = parse(head.replace("\"version\":1", "\"version\":2").as_bytes(), "b.normend").unwrap_err();
    assert!(
        newer
            .to_string()
            .contains("b.normend: a newer Normend wrote this recipe"),
        "{newer}"
    );
    let other = parse(b"{\"format\":\"geojson\"}\n", "c.json").unwrap_err();
    assert!(
        other.to_string().contains("c.json: this is no recipe of Normend"),
        "{other}"
    );
    let empty = parse(b"", "d.normend").unwrap_err();
    assert!(empty.to_string().contains("this is no recipe"), "{empty}");

    // Written by a program that knows more, with checksums that are right.
    let with_checksum = |body: &str, before: u32| {
        let mut hasher = crc32fast::Hasher::new_with_initial(before);
        hasher.update(body.as_bytes());
        let checksum = hasher.finalize();
        (format!("{body},\"crc\":\"{checksum:08x}\"}}\n"), checksum)
    };
    let body = head.rsplit_once(",\"crc\"").unwrap().0;
    let (with_more, checksum) = with_checksum(&body.replace("\"points\":", "\"color\":\"red\",\"points\":"), 0);
    let reading = parse(with_more.as_bytes(), "e").unwrap();
    assert_eq!(reading.recipe.head, a_head());
    for (body, words) in [
        ("{\"do\":\"paint\"", "the event \"paint\" is not known"),
        ("{\"do\":\"step\",\"kind\":\"paint\"", "the step \"paint\" is not known"),
        (
            "{\"do\":\"step\",\"kind\":\"mend\",\"sources\":[{\"point\":1,\"normal\":[0,0,1],\"origin\":\"moon\"}]",
            "the origin \"moon\" is not known",
        ),
        (
            "{\"do\":\"step\",\"kind\":\"parameters\",\"parameters\":{\"estimator\":\"magic\"}",
            "the estimator \"magic\" is not known",
        ),
    ] {
        let text = with_more.clone() + &with_checksum(body, checksum).0;
        let reading = parse(text.as_bytes(), "f").unwrap();
        let End::Damaged(broken) = reading.end else {
            panic!("{body} was understood");
        };
        assert!(broken.to_string().contains(words), "{broken}");
    }
    let (unknown, _) = with_checksum(&body.replace("\"agglomeration\"", "\"magic\""), 0);
    let unknown = parse(unknown.as_bytes(), "g").unwrap_err().to_string();
    assert!(
        unknown.contains("g, line 1: the method \"magic\" is not known to this Normend"),
        "{unknown}"
    );
}

#[test]
fn what_an_older_program_did_not_write_has_its_default() {
    let named: NamedParameters = serde_json::from_str("{\"k_graph\":9,\"eta\":0.25}").unwrap();
    let expect = Parameters {
        k_graph: 9,
        eta: 0.25,
        ..Parameters::default()
    };
    assert_eq!(Parameters::try_from(named), Ok(expect));
}
