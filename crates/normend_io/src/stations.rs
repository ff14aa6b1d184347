//! Places of the scanner from a table: which rows of a scan were measured from where.

use std::path::Path;

use glam::DVec3;
use normend_core::Silent;
use normend_core::evidence::Station;

use crate::error::{Broken, Place, quoted};
use crate::scan::read_file;
use crate::{ReadError, Scan};

/// Names of the columns, which the table may begin with.
const COLUMNS: [&str; 5] = ["first", "count", "x", "y", "z"];

/// Reads the places that the scanner measured `scan` from: a line for each, `first count x y z` apart by tabs, spaces or commas.
///
/// `first` and `count` are rows of the scan's file (of several files, one after another), counted from 0, rows without finite coordinates among them; x y z is the
/// place in the file's coordinates. A first line with the names of the columns, empty lines and what follows a `#` are
/// skipped.
///
/// # Errors
/// [`ReadError`]; its message names the file, the line, the reason and what to do.
pub fn read_stations(path: &Path, scan: &Scan) -> Result<Vec<Station>, ReadError> {
    let bytes = read_file(path, &Silent)?;
    stations_of_bytes(&bytes, &path.display().to_string(), scan)
}

/// Reads the places from memory; `name` stands for the file in messages.
///
/// # Errors
/// As [`read_stations`].
pub fn stations_of_bytes(bytes: &[u8], name: &str, scan: &Scan) -> Result<Vec<Station>, ReadError> {
    let n_rows = scan.cloud.n_points() + scan.n_left_out;
    let rows = scan.rows();
    parse(bytes, n_rows, rows.as_ref().map(|rows| rows.as_slice())).map_err(|broken| ReadError::Broken {
        name: name.to_owned(),
        broken,
    })
}

/// The stations in a table for a file of `n_rows`; `rows` are those of the points, ascending, when not all are points.
fn parse(bytes: &[u8], n_rows: usize, rows: Option<&[u32]>) -> Result<Vec<Station>, Broken> {
    // The point that a row is or, when it is none, the next that follows.
    let point = |row: usize| rows.map_or(row, |rows| rows.partition_point(|&other| (other as usize) < row)) as u32;
    let mut stations = Vec::new();
    let mut is_first = true;
    for (index, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let broken = |reason: String| Broken::new(Place::Line(index + 1), reason);
        let text = line.split(|&byte| byte == b'#').next().unwrap_or_default();
        let values: Vec<&[u8]> = text
            .split(|byte| byte.is_ascii_whitespace() || *byte == b',')
            .filter(|value| !value.is_empty())
            .collect();
        if values.is_empty() {
            continue;
        }
        let is_name = |(value, name): (&&[u8], &str)| value.eq_ignore_ascii_case(name.as_bytes());
        let is_header = is_first && values.len() == COLUMNS.len() && values.iter().zip(COLUMNS).all(is_name);
        is_first = false;
        if is_header {
            continue;
        }
        let [first, count, x, y, z] = values[..] else {
            return Err(broken(format!(
                "there are {} values where first, count, x, y and z should be: correct the line",
                values.len()
            )));
        };
        let count_of = |value: &[u8], name: &str| {
            let parsed = std::str::from_utf8(value)
                .ok()
                .and_then(|text| text.parse::<usize>().ok());
            parsed.ok_or_else(|| {
                broken(format!(
                    "{name} is {}, which is not a number of points: correct it",
                    quoted(value)
                ))
            })
        };
        let coordinate = |value: &[u8], name: &str| {
            let parsed = fast_float2::parse::<f64, _>(value)
                .ok()
                .filter(|number| number.is_finite());
            parsed.ok_or_else(|| {
                broken(format!(
                    "{name} is {}, which is not a finite number: correct it",
                    quoted(value)
                ))
            })
        };
        let (first, count) = (count_of(first, "first")?, count_of(count, "count")?);
        let end = first.saturating_add(count);
        if end > n_rows {
            return Err(broken(format!(
                "{count} points from point {first} on reach beyond the scan, which has {n_rows}: is this the table of another \
                 scan?"
            )));
        }
        stations.push(Station {
            points: point(first)..point(end),
            position: DVec3::new(coordinate(x, "x")?, coordinate(y, "y")?, coordinate(z, "z")?),
        });
    }
    if stations.is_empty() {
        return Err(Broken::whole(
            "there is no line with first, count, x, y and z: write one for each place",
        ));
    }
    Ok(stations)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expect: &[(std::ops::Range<u32>, [f64; 3])]) {
        let stations = parse(text.as_bytes(), 10, None).unwrap();
        let found: Vec<_> = stations
            .into_iter()
            .map(|station| (station.points, station.position.to_array()))
            .collect();
        assert_eq!(found, expect, "{text:?}");
    }

    fn check_error(text: &str, expect: &str) {
        let error = parse(text.as_bytes(), 10, None).unwrap_err().to_string();
        assert!(error.contains(expect), "{error}");
    }

    #[test]
    fn tables_with_and_without_names() {
        let expect = [(0..4, [1.0, -2.5, 3e2]), (4..10, [0.0, 0.0, 0.0])];
        check("first\tcount\tx\ty\tz\n0\t4\t1\t-2.5\t3e2\n4\t6\t0\t0\t0\n", &expect);
        check("# two places\r\n\r\n0 4 1 -2.5 3e2 # left\r\n4,6,0,0,0", &expect);
    }

    #[test]
    fn errors_name_the_line() {
        check_error("", "there is no line");
        check_error("first count x y z\n", "there is no line");
        check_error("0 4 1 2\n", "line 1: there are 4 values");
        check_error("0 4 1 2 3\n4 6 1 2 3 4\n", "line 2: there are 6 values");
        check_error(
            "# x\n0 -4 1 2 3",
            "line 2: count is \"-4\", which is not a number of points",
        );
        check_error("first count x y z\nfirst count x y z", "line 2: first is \"first\"");
        check_error("0 4 1 nan 3", "line 1: y is \"nan\", which is not a finite number");
        check_error("0 4 1e999 0 3", "line 1: x is \"1e999\"");
        check_error(
            "0 10 1 2 3\n7 4 1 2 3",
            "line 2: 4 points from point 7 on reach beyond the scan, which has 10",
        );
        check_error("1 18446744073709551615 1 2 3", "reach beyond the scan");
        check_error("\u{fffd} 1 1 2 3", "line 1: first is");
    }

    #[test]
    fn rows_that_are_no_points_are_passed_over() {
        let rows = [1, 2, 5, 9];
        let stations = parse(b"0 3 0 0 0\n3 2 0 0 0\n5 5 0 0 0", 10, Some(&rows)).unwrap();
        let points: Vec<_> = stations.into_iter().map(|station| station.points).collect();
        assert_eq!(points, [0..2, 2..2, 2..4]);
    }
}
