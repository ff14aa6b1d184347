//! Where a moving scanner was, from a text of times and places: found for each point by the time that it was measured at.

use std::path::Path;

use glam::DVec3;
use normend_core::evidence::Track;
use normend_core::progress::Part;
use normend_core::{Progress, Silent};
use rayon::prelude::*;

use crate::error::{Broken, Place, quoted};
use crate::scan::read_file;
use crate::{ReadError, Scan};

/// Names of columns that hold when a point was measured, in lower case; the first that a scan has counts.
const TIME_NAMES: [&str; 9] = [
    "gps_time",
    "gpstime",
    "gps time",
    "scalar_gpstime",
    "scalar_gps_time",
    "timestamp",
    "scalar_timestamp",
    "time",
    "scalar_time",
];

/// Names of the columns of a trajectory, in lower case.
const COLUMN_NAMES: [&[&str]; 4] = [
    &[
        "time",
        "gps_time",
        "gpstime",
        "gps-time",
        "timestamp",
        "t",
        "time[s]",
        "sec",
        "seconds",
    ],
    &["x", "easting", "east", "e", "x[m]"],
    &["y", "northing", "north", "n", "y[m]"],
    &["z", "height", "altitude", "elevation", "h", "up", "z[m]"],
];

const WEEK_SECS: f64 = 604_800.0;

/// What LAS takes off GPS seconds, so that they keep their digits (LAS 1.4, adjusted standard GPS time).
const ADJUSTED_BY_SECS: f64 = 1e9;

/// Between two lines that are this many usual steps apart, and at least [`LEAST_GAP_SECS`], nobody knows where the scanner was.
const GAP_STEPS: f64 = 10.0;

/// Most trajectories have a line a second or more: within that a car moves by about what it is away from walls.
const LEAST_GAP_SECS: f64 = 1.0;

/// What was read, and what the user should know of it.
pub(crate) struct Tracked {
    pub track: Track,
    pub notes: Vec<String>,
}

/// Reads where the scanner of `scan` moved along: a line for each time, `time x y z` apart by tabs, spaces, commas or semicolons, or in
/// any order under a line of names. Places are in the scan's coordinates, times in seconds as the scan's.
///
/// # Errors
/// [`ReadError`]: the text is no trajectory, the points have no times, or none of them is within those of the trajectory.
pub(crate) fn read_track(path: &Path, scan: &Scan, progress: &dyn Progress) -> Result<Tracked, ReadError> {
    let bytes = read_file(path, &Silent)?;
    let name = path.display().to_string();
    let broken = |broken: Broken| ReadError::Broken {
        name: name.clone(),
        broken,
    };
    let trajectory = Trajectory::parse(&bytes).map_err(broken)?;
    let times = point_times(scan, &Part::new(progress, 0.0..0.8))?.ok_or_else(|| {
        broken(Broken::whole(format!(
            "the points of the scan have no times to find their places by: it needs a column called {}",
            TIME_NAMES[..2].join(" or ")
        )))
    })?;
    progress.report(0.8)?;
    trajectory.track(&times).map_err(broken)
}

/// When each point was measured, if the scan tells.
fn point_times(scan: &Scan, progress: &dyn Progress) -> Result<Option<Vec<f64>>, ReadError> {
    let columns = scan.scalar_columns();
    let is_named = |wanted: &str| columns.iter().find(|column| column.eq_ignore_ascii_case(wanted));
    match TIME_NAMES.into_iter().find_map(is_named) {
        Some(column) => scan.scalar(column, progress),
        None => Ok(None),
    }
}

/// Times that ascend, and the places at them.
#[derive(Clone, Debug, Default, PartialEq)]
struct Trajectory {
    times: Vec<f64>,
    places: Vec<DVec3>,
    /// Lines whose time is before that of the line above.
    n_unsorted: usize,
}

impl Trajectory {
    fn parse(bytes: &[u8]) -> Result<Self, Broken> {
        let mut columns = [0, 1, 2, 3];
        let mut is_first = true;
        let mut lines: Vec<(f64, DVec3)> = Vec::new();
        for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
            let broken = |reason: String| Broken::new(Place::Line(index + 1), reason);
            let is_comment = line.trim_ascii_start().starts_with(b"#")
                || line.starts_with(b"//")
                || line.trim_ascii_start().starts_with(b"%");
            let text = line.trim_ascii().trim_ascii_start();
            let text = text.strip_prefix(b"#").or(text.strip_prefix(b"%")).unwrap_or(text);
            let text = text.strip_prefix(b"//").unwrap_or(text);
            // With semicolons between values a comma is the decimal one.
            let has_semicolons = text.contains(&b';');
            let is_between =
                |byte: &u8| byte.is_ascii_whitespace() || *byte == b';' || (*byte == b',' && !has_semicolons);
            let values: Vec<&[u8]> = text.split(is_between).filter(|value| !value.is_empty()).collect();
            if values.is_empty() {
                continue;
            }
            let number = |value: &[u8]| {
                let value: Vec<u8> = value
                    .iter()
                    .map(|&byte| if byte == b',' { b'.' } else { byte })
                    .collect();
                fast_float2::parse::<f64, _>(&value)
                    .ok()
                    .filter(|number| number.is_finite())
            };
            if is_first || is_comment {
                let named = named_columns(&values);
                if let (Some(named), true) = (named, is_first) {
                    columns = named;
                    is_first = is_comment;
                    continue;
                }
                if is_comment {
                    continue;
                }
                is_first = false;
                if number(values[0]).is_none() {
                    return Err(broken(format!(
                        "the line begins with {}: a trajectory has lines of time, x, y and z, or begins with the names time, x, y, z",
                        quoted(values[0])
                    )));
                }
            }
            let mut row = [0.0; 4];
            for (value, (column, names)) in row.iter_mut().zip(columns.into_iter().zip(COLUMN_NAMES)) {
                let text = *values.get(column).ok_or_else(|| {
                    broken(format!(
                        "there are {} values where time, x, y and z should be: correct the line",
                        values.len()
                    ))
                })?;
                *value = number(text).ok_or_else(|| {
                    broken(format!(
                        "{} is {}, which is not a finite number: correct it",
                        names[0],
                        quoted(text)
                    ))
                })?;
            }
            let [time, x, y, z] = row;
            lines.push((time, DVec3::new(x, y, z)));
        }
        if lines.len() < 2 {
            return Err(Broken::whole(
                "there are less than two lines of time, x, y and z: a trajectory needs a place before and one after each point",
            ));
        }
        let n_unsorted = lines.windows(2).filter(|pair| pair[1].0 < pair[0].0).count();
        // Stable: of lines of one time the first counts.
        lines.sort_by(|a, b| a.0.total_cmp(&b.0));
        lines.dedup_by_key(|line| line.0);
        let (times, places) = lines.into_iter().unzip();
        Ok(Self {
            times,
            places,
            n_unsorted,
        })
    }

    fn range(&self) -> [f64; 2] {
        [
            self.times.first().copied().unwrap_or(f64::NAN),
            self.times.last().copied().unwrap_or(f64::NAN),
        ]
    }

    /// Seconds between two lines from which on the place between is not known.
    fn gap(&self) -> f64 {
        let mut steps: Vec<f64> = self.times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.is_empty() {
            return LEAST_GAP_SECS;
        }
        let middle = steps.len() / 2;
        let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        (GAP_STEPS * median).max(LEAST_GAP_SECS)
    }

    /// The way of the scanner for points that were measured at `times`.
    fn track(self, times: &[f64]) -> Result<Tracked, Broken> {
        let finite = || times.par_iter().copied().filter(|time| time.is_finite());
        let points = [
            finite().reduce(|| f64::INFINITY, f64::min),
            finite().reduce(|| f64::NEG_INFINITY, f64::max),
        ];
        let own = self.range();
        let Some(shift) = shift(points, own) else {
            return Err(Broken::whole(format!(
                "its times, {} to {} s, do not overlap those of the points, {} to {} s: is it the trajectory of another scan?",
                own[0], own[1], points[0], points[1]
            )));
        };
        let mut notes = Vec::new();
        if shift != 0.0 {
            notes.push(format!(
                "the times of the points and of the trajectory begin at different moments (GPS week, GPS seconds, or these less \
                 1,000,000,000): {shift} s are added to those of the points"
            ));
        }
        if self.n_unsorted > 0 {
            let lines = if self.n_unsorted == 1 { "line is" } else { "lines are" };
            notes.push(format!(
                "{} {lines} earlier than the one before: the lines are sorted by time",
                self.n_unsorted
            ));
        }
        let gap = self.gap();
        let n_gaps = self.times.windows(2).filter(|pair| pair[1] - pair[0] > gap).count();
        if n_gaps > 0 {
            let gaps = if n_gaps == 1 { "gap" } else { "gaps" };
            notes.push(format!(
                "{n_gaps} {gaps} of more than {gap} s: points within have no place of the scanner"
            ));
        }
        let corner_times = self.times;
        let track = Track::new(self.places, times.len(), |point| {
            along(&corner_times, times[point] + shift, gap)
        });
        let n_located = track.n_located();
        if n_located == 0 {
            return Err(Broken::whole(
                "no point was measured at a time that it tells the place of: is it the trajectory of another scan?",
            ));
        }
        if n_located < times.len() {
            let share = 100.0 * (times.len() - n_located) as f64 / times.len() as f64;
            notes.push(format!(
                "{share:.1} % of the points were measured at other times: they have no place of the scanner"
            ));
        }
        Ok(Tracked { track, notes })
    }
}

/// Which columns hold time, x, y and z by the names in a line; `None` where one of them is missing.
fn named_columns(values: &[&[u8]]) -> Option<[usize; 4]> {
    let mut found = [0; 4];
    for (column, names) in found.iter_mut().zip(COLUMN_NAMES) {
        let is_name = |value: &[u8]| {
            let value = value.trim_ascii();
            let value = value
                .strip_prefix(b"\"")
                .and_then(|value| value.strip_suffix(b"\""))
                .unwrap_or(value);
            names.iter().any(|name| value.eq_ignore_ascii_case(name.as_bytes()))
        };
        *column = values.iter().position(|value| is_name(value))?;
    }
    Some(found)
}

/// How far along corners with ascending `times` a moment is; `None` before the first, after the last and in gaps. O(log n).
fn along(times: &[f64], time: f64, gap: f64) -> Option<f64> {
    let next = times.partition_point(|&other| other <= time);
    let before = next.checked_sub(1)?;
    let since = time - times[before];
    if since == 0.0 {
        return Some(before as f64);
    }
    let step = times.get(next)? - times[before];
    (step <= gap).then(|| before as f64 + (since / step).clamp(0.0, 1.0))
}

/// Seconds to add to the times of points so that their range overlaps that of a trajectory: none, or what lies between the ways of
/// counting GPS time. `None` where nothing makes them overlap.
fn shift(points: [f64; 2], own: [f64; 2]) -> Option<f64> {
    let overlap = |shift: f64| (points[1] + shift).min(own[1]) - (points[0] + shift).max(own[0]);
    // Of one moment the overlap is 0.
    if overlap(0.0) >= 0.0 {
        return Some(0.0);
    }
    let is_of_week = |range: [f64; 2]| range[0] >= 0.0 && range[1] <= 2.0 * WEEK_SECS;
    let is_adjusted = |range: [f64; 2]| range[1] < ADJUSTED_BY_SECS;
    let mut shifts = vec![ADJUSTED_BY_SECS, -ADJUSTED_BY_SECS];
    // Weeks since 1980 of the one that counts them, and one less for those that began in the week before.
    let week_shifts = |range: [f64; 2]| {
        let adjusted = if is_adjusted(range) { ADJUSTED_BY_SECS } else { 0.0 };
        let week = ((range[0] + adjusted) / WEEK_SECS).floor();
        [week, week - 1.0, week + 1.0].map(|week| week * WEEK_SECS - adjusted)
    };
    match (is_of_week(points), is_of_week(own)) {
        (true, false) => shifts.extend(week_shifts(own)),
        (false, true) => shifts.extend(week_shifts(points).map(|shift| -shift)),
        _ => {}
    }
    let best = shifts
        .into_iter()
        .reduce(|a, b| if overlap(b) > overlap(a) { b } else { a })?;
    (overlap(best) >= 0.0).then_some(best)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::read_bytes;

    fn parse(text: &str) -> Trajectory {
        Trajectory::parse(text.as_bytes()).unwrap()
    }

    #[test]
    fn texts_with_and_without_names() {
        let expect = Trajectory {
            times: vec![1.0, 2.5],
            places: vec![DVec3::new(10.0, 20.0, 30.0), DVec3::new(11.0, 21.0, -31.5)],
            n_unsorted: 0,
        };
        for text in [
            "1 10 20 30\n2.5 11 21 -31.5\n",
            "# a drive\n\n1\t10\t20\t30\r\n2.5\t11\t21\t-31.5 7 8",
            "time,x,y,z\n1,10,20,30\n2.5,11,21,-31.5\n",
            "roll;Northing;Easting;Height;GPSTime\n0;20,0;10;30;1\n0;21;11;-31,5;2,5\n",
            "# X Y Z Time\n10 20 30 1\n11 21 -31.5 2.5\n",
            "\"t\" \"x\" \"y\" \"z\"\n1 10 20 30\n1 9 9 9\n2.5 11 21 -31.5\n",
        ] {
            assert_eq!(parse(text), expect, "{text}");
        }
        let unsorted = parse("2.5 11 21 -31.5\n1 10 20 30\n");
        assert_eq!((unsorted.times, unsorted.n_unsorted), (expect.times, 1));
    }

    #[test]
    fn errors_name_the_line() {
        let check = |text: &str, expect: &str| {
            let error = Trajectory::parse(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(expect), "{error}");
        };
        check("", "less than two lines");
        check("1 2 3 4\n", "less than two lines");
        check("time lat lon h\n1 2 3 4\n", "line 1: the line begins with \"time\"");
        check("1 2 3 4\n2 3 4\n", "line 2: there are 3 values");
        check("1 2 3 4\n2 3 east 4\n", "line 2: y is \"east\"");
        check("1 2 3 4\nnan 3 3 4\n", "line 2: time is \"nan\"");
        check("\u{fffd}\u{0}", "line 1: the line begins with");
    }

    #[test]
    fn ways_of_counting_gps_time_are_told_apart() {
        let week = 2_300.0 * WEEK_SECS;
        let drive = |from: f64| [from + 100_000.0, from + 100_500.0];
        let adjusted = week - ADJUSTED_BY_SECS;
        for (points, own, expect) in [
            (drive(0.0), drive(0.0), Some(0.0)),
            (drive(adjusted), drive(week), Some(ADJUSTED_BY_SECS)),
            (drive(week), drive(adjusted), Some(-ADJUSTED_BY_SECS)),
            (drive(0.0), drive(week), Some(week)),
            (drive(0.0), drive(adjusted), Some(adjusted)),
            (drive(adjusted), drive(0.0), Some(-adjusted)),
            (drive(0.0), drive(1000.0), None),
            (drive(adjusted), drive(week + 1000.0), None),
            ([f64::INFINITY, f64::NEG_INFINITY], drive(0.0), None),
        ] {
            assert_eq!(shift(points, own), expect, "{points:?} {own:?}");
        }
    }

    #[test]
    fn points_between_lines_lie_between_places() {
        let trajectory = parse("10 0 0 0\n11 1 0 0\n12 2 0 0\n100 9 9 9\n100.5 9 9 10\n");
        let times = [9.0, 10.0, 10.25, 12.0, 50.0, 100.25, 101.0, f64::NAN];
        let Tracked { track, notes } = trajectory.track(&times).unwrap();
        let places: Vec<_> = (0..times.len())
            .map(|point| track.place(point).map(|place| place.to_array()))
            .collect();
        let expect = [
            None,
            Some([0.0; 3]),
            Some([0.25, 0.0, 0.0]),
            Some([2.0, 0.0, 0.0]),
            None,
            Some([9.0, 9.0, 9.5]),
            None,
            None,
        ];
        for (place, expect) in places.iter().zip(expect) {
            match (place, expect) {
                (Some(place), Some(expect)) => {
                    assert!(
                        DVec3::from(*place).distance(expect.into()) < 1e-5,
                        "{place:?} {expect:?}"
                    );
                }
                (place, expect) => assert_eq!(*place, expect),
            }
        }
        assert!(
            notes[0].contains("1 gap of more than 10 s") && notes[1].contains("50.0 % of the points"),
            "{notes:?}"
        );
    }

    #[test]
    fn times_of_a_scan_are_found_by_name() {
        let times = |text: &str, name: &str| {
            let scan = read_bytes(text.as_bytes().to_vec(), name, &Silent).unwrap();
            point_times(&scan, &Silent).unwrap()
        };
        assert_eq!(
            times("x,y,z,GPS_Time\n1,2,3,4\n4,5,6,7\n", "a.csv"),
            Some(vec![4.0, 7.0])
        );
        assert_eq!(times("x,y,z,time,gps_time\n1,2,3,4,5\n", "a.csv"), Some(vec![5.0]));
        assert_eq!(times("x,y,z,intensity\n1,2,3,4\n", "a.csv"), None);
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "[0-9 ,.;#a-z\n\t-]{0,200}") {
            drop(Trajectory::parse(text.as_bytes()));
        }

        #[test]
        fn every_point_of_a_drive_has_its_place(times in prop::collection::vec(0.0..100.0_f64, 1..50)) {
            // Straight ahead, a meter a second.
            let text: String = (0..=100).map(|i| format!("{i} {i} 0 0\n")).collect();
            let Tracked { track, .. } = parse(&text).track(&times).unwrap();
            for (point, time) in times.iter().enumerate() {
                prop_assert!((track.place(point).unwrap().x - time).abs() < 1e-5);
            }
        }
    }
}
