//! Recipes and journals, and the table of places that a scan was measured from.

use std::sync::{Arc, OnceLock};

use libfuzzer_sys::arbitrary::{Arbitrary, Unstructured};
use normend_core::evidence::Known;
use normend_core::{Document, PointCloud, Propagation, Silent, shapes};
use normend_io::recipe::{self, End, Event, Reading, Recipe};

use crate::limits::limited;
use crate::scans::{check_sentence, read_sentence};

/// Points of the cloud that recipes are applied to: enough for all stages, few enough for thousands of runs a minute.
const N_POINTS: usize = 60;

/// Reads `bytes` as a recipe, as they are and with the checksums that they should have; what can be read is written and read
/// again, shortened, and done to a small cloud.
pub fn check(bytes: &[u8]) {
    limited(bytes.len(), || check_bytes(bytes));
    let sealed = with_checksums(bytes);
    limited(sealed.len(), || check_bytes(&sealed));
}

fn check_bytes(bytes: &[u8]) {
    let reading = match recipe::parse(bytes, "a.normend") {
        Ok(reading) => reading,
        Err(error) => return check_sentence(&error, "a.normend"),
    };
    assert!(reading.n_bytes <= bytes.len() as u64);
    if reading.end == End::Whole {
        assert_eq!(reading.n_bytes, bytes.len() as u64);
    }
    let written = encoded(&reading.recipe);
    let again = whole(&written);
    // By their lines, because a number that is none is not equal to itself.
    assert_eq!(
        encoded(&again),
        written,
        "what is written of a recipe is not what is read"
    );
    assert_eq!(again.events.len(), reading.recipe.events.len());
    check_shortened(&reading.recipe);
    apply(&reading);
}

fn encoded(recipe: &Recipe) -> Vec<u8> {
    recipe.encode().expect("the encoder promises no errors").1
}

/// The recipe in bytes that were just written.
fn whole(written: &[u8]) -> Recipe {
    let reading =
        recipe::parse(written, "a.normend").unwrap_or_else(|error| panic!("it cannot be read again: {error}"));
    assert_eq!(reading.end, End::Whole);
    reading.recipe
}

/// Older steps as one step lead to the same state.
fn check_shortened(recipe: &Recipe) {
    let short = recipe.shortened(200).expect("the encoder promises no errors");
    assert_eq!(format!("{:?}", short.state()), format!("{:?}", recipe.state()));
    assert_eq!(short.is_exported(), recipe.is_exported());
}

/// Does what the recipe says, as `normend replay` and the editor do: refused, or a whole orientation.
fn apply(reading: &Reading) {
    let cloud = cloud();
    let mut document = Document::new(Arc::clone(cloud), None).with_parameters(reading.recipe.head.parameters);
    let (steps, n_done) = reading.recipe.history();
    let applied = (steps.iter().take(n_done)).try_for_each(|step| {
        document
            .apply_recorded(step.kind, step.change.clone(), step.n_turned)
            .map(drop)
    });
    if let Err(error) = applied {
        assert!(!error.to_string().is_empty());
        return;
    }
    let viewpoints = Arc::clone(&document.state().viewpoints);
    let known = Known {
        viewpoints: &viewpoints,
        ..Known::default()
    };
    let propagation = Propagation::new(cloud, known, document.parameters(), &Silent);
    document.install(propagation.expect("nobody cancels"));
    let normals = document.oriented_normals().expect("it is oriented");
    assert_eq!(normals.len(), N_POINTS);
    assert!(
        normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-3),
        "a normal is no unit vector"
    );
    while document.undo().is_some() {}
    while document.redo().is_some() {}
    assert_eq!(
        document.oriented_normals().as_ref(),
        Some(&normals),
        "undo and redo lead elsewhere"
    );
    let identity = reading.recipe.head.scan.clone();
    let saved = whole(&encoded(&Recipe::of_document(identity, &document)));
    assert_eq!(format!("{:?}", saved.state()), format!("{:?}", document.state()));
}

fn cloud() -> &'static Arc<PointCloud> {
    static CLOUD: OnceLock<Arc<PointCloud>> = OnceLock::new();
    CLOUD.get_or_init(|| {
        let positions = shapes::torus(N_POINTS).positions;
        Arc::new(PointCloud::new(glam::DVec3::ZERO, positions).expect("a torus is finite"))
    })
}

/// The lines of `bytes` with the checksum that each should have, which no mutation finds by itself.
fn with_checksums(bytes: &[u8]) -> Vec<u8> {
    const FIELD: &[u8] = b",\"crc\":\"";
    let mut sealed = Vec::with_capacity(2 * bytes.len());
    let mut checksum = 0;
    for line in bytes.split(|&byte| byte == b'\n').filter(|line| !line.is_empty()) {
        let body = line.windows(FIELD.len()).position(|window| window == FIELD);
        let body = body.map_or(line.strip_suffix(b"}").unwrap_or(line), |at| &line[..at]);
        let mut hasher = crc32fast::Hasher::new_with_initial(checksum);
        hasher.update(body);
        checksum = hasher.finalize();
        sealed.extend_from_slice(body);
        sealed.extend_from_slice(FIELD);
        sealed.extend_from_slice(format!("{checksum:08x}\"}}\n").as_bytes());
    }
    sealed
}

/// Makes a journal of the lines in the input, changes a byte and cuts it off as the first bytes of the input say, and reads it:
/// what is read are the events before the damage, and it can be gone on with.
pub fn check_journal(bytes: &[u8]) {
    let mut input = Unstructured::new(bytes);
    let Ok((place, byte, end)) = <(u16, u8, u16)>::arbitrary(&mut input) else {
        return;
    };
    let lines = with_checksums(input.take_rest());
    limited(lines.len(), || {
        let Ok(reading) = recipe::parse(&lines, "a.journal") else {
            return;
        };
        let journal = encoded(&reading.recipe);
        let events = &reading.recipe.events;
        let ends = line_ends(&journal);

        let mut damaged = journal.clone();
        let place = usize::from(place) % journal.len();
        let is_changed = damaged[place] != byte;
        damaged[place] = byte;
        let end = usize::from(end) % (journal.len() + 1);
        damaged.truncate(end);
        // Lines before both the change and the end are as they were; the last may lack its line feed.
        let first_bad = if is_changed { place.min(end) } else { end };
        let n_sure = ends.iter().filter(|&&at| at <= first_bad).count();
        match recipe::parse(&damaged, "a.journal") {
            Err(error) => {
                check_sentence(&error, "a.journal");
                assert_eq!(n_sure, 0, "a whole first line is refused: {error}");
            }
            Ok(reading) => {
                let n_events = reading.recipe.events.len();
                assert!(
                    n_events + 1 >= n_sure,
                    "{n_events} events where {n_sure} lines are sure"
                );
                let read = format!("{:?}", reading.recipe.events);
                assert_eq!(
                    read,
                    format!("{:?}", &events[..n_events]),
                    "other events than were written"
                );
                go_on(reading, &damaged);
            }
        }
    });
}

/// The byte after each line feed.
fn line_ends(bytes: &[u8]) -> Vec<usize> {
    (1..=bytes.len()).filter(|&end| bytes[end - 1] == b'\n').collect()
}

/// Writes one more event after what was read, as the editor does that goes on with a journal.
fn go_on(mut reading: Reading, bytes: &[u8]) {
    let mut longer = bytes[..reading.n_bytes as usize].to_vec();
    if longer.last() != Some(&b'\n') {
        longer.push(b'\n');
    }
    longer.extend(
        reading
            .writer
            .event(&Event::Exported)
            .expect("the encoder promises no errors"),
    );
    let again = whole(&longer);
    assert_eq!(again.events.len(), reading.recipe.events.len() + 1);
    assert!(again.is_exported());
}

/// Reads `bytes` as the table of places that a scan of ten rows was measured from.
pub fn check_sensors(bytes: &[u8]) {
    static SCAN: OnceLock<normend_io::Scan> = OnceLock::new();
    let scan = SCAN.get_or_init(|| {
        let rows = b"0 0 0\n1 0 0\nnan 0 0\n0 1 0\n1 1 0\n0 0 1\n1 0 1\nnan nan nan\n0 1 1\n1 1 1\n";
        read_sentence(rows, "ten.xyz").expect("ten rows can be read")
    });
    limited(bytes.len(), || {
        match normend_io::stations_of_bytes(bytes, "a.sensors.tsv", scan) {
            Err(error) => check_sentence(&error, "a.sensors.tsv"),
            Ok(stations) => {
                assert!(!stations.is_empty());
                for station in &stations {
                    assert!(station.position.is_finite());
                    assert!(station.points.start <= station.points.end);
                    assert!(station.points.end as usize <= scan.cloud.n_points());
                }
                orient_from(&stations);
            }
        }
    });
}

/// Orients a small cloud toward the places.
fn orient_from(stations: &[normend_core::evidence::Station]) {
    let cloud = cloud();
    let known = Known {
        stations,
        ..Known::default()
    };
    let parameters = normend_core::Parameters {
        rule: normend_core::SideRule::TowardScanner,
        ..normend_core::Parameters::default()
    };
    let propagation = Propagation::new(cloud, known, parameters, &Silent).expect("nobody cancels");
    assert!(propagation.normals.iter().all(|normal| normal.is_finite()));
}
