//! Export keeps every byte but those of the normals and of one comment, whatever the file holds.
//!
//! Random files are built piece by piece, so what has to come out is known without any reader. The `ply-rs` reader then
//! reads what came out.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic, as tests do")]

use glam::Vec3;
use normend_core::Silent;
use normend_io::{WriteOptions, read};
use ply_rs::parser::Parser;
use ply_rs::ply::{DefaultElement, Property};
use proptest::prelude::*;

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }

    fn unit(&mut self) -> Vec3 {
        let component = |random: &mut Self| random.below(2001) as f32 / 1000.0 - 1.0;
        Vec3::new(component(self), component(self), component(self)).normalize_or(Vec3::Y)
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

/// Types with their two names, integers first.
const TYPES: [(&str, &str); 8] = [
    ("char", "int8"),
    ("uchar", "uint8"),
    ("short", "int16"),
    ("ushort", "uint16"),
    ("int", "int32"),
    ("uint", "uint32"),
    ("float", "float32"),
    ("double", "float64"),
];
const INTEGERS: usize = 6;
const FLOAT: usize = 6;
const DOUBLE: usize = 7;

fn push_value(encoding: Encoding, kind: usize, value: f64, out: &mut Vec<u8>) {
    // Zero has no sign, also where a normal is turned.
    let value = value + 0.0;
    if encoding == Encoding::Ascii {
        // Three decimals or an f32: as short as that reads back, whatever the type.
        return out.extend_from_slice(format!("{}", value as f32).as_bytes());
    }
    let mut bytes = match kind {
        0 => (value as i8).to_le_bytes().to_vec(),
        1 => (value as u8).to_le_bytes().to_vec(),
        2 => (value as i16).to_le_bytes().to_vec(),
        3 => (value as u16).to_le_bytes().to_vec(),
        4 => (value as i32).to_le_bytes().to_vec(),
        5 => (value as u32).to_le_bytes().to_vec(),
        FLOAT => (value as f32).to_le_bytes().to_vec(),
        _ => value.to_le_bytes().to_vec(),
    };
    if encoding == Encoding::Big {
        bytes.reverse();
    }
    out.extend_from_slice(&bytes);
}

/// What a file is made of: bytes that stay, and others.
enum Piece {
    Bytes(Vec<u8>),
    /// The place of the comment that Normend adds.
    Comment,
    /// The place where normals are declared when there are none.
    NormalDeclarations,
    /// A component of the normal of a row, of a type.
    Component {
        row: usize,
        component: usize,
        kind: usize,
    },
    /// The place of a normal that the file does not have.
    NewNormal {
        row: usize,
    },
}

struct File {
    encoding: Encoding,
    line_end: &'static str,
    has_normals: bool,
    pieces: Vec<Piece>,
    former: Vec<Vec3>,
}

impl File {
    fn input(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for piece in &self.pieces {
            match piece {
                Piece::Bytes(bytes) => out.extend_from_slice(bytes),
                Piece::Component { row, component, kind } => {
                    push_value(self.encoding, *kind, f64::from(self.former[*row][*component]), &mut out);
                }
                Piece::Comment | Piece::NormalDeclarations | Piece::NewNormal { .. } => {}
            }
        }
        out
    }

    fn output(&self, normals: &[Vec3]) -> Vec<u8> {
        let mut out = Vec::new();
        for piece in &self.pieces {
            match piece {
                Piece::Bytes(bytes) => out.extend_from_slice(bytes),
                Piece::Comment => {
                    let version = env!("CARGO_PKG_VERSION");
                    let comment = format!("comment Normend {version}: normals oriented, rule: up{}", self.line_end);
                    out.extend_from_slice(comment.as_bytes());
                }
                Piece::NormalDeclarations => {
                    for name in ["nx", "ny", "nz"] {
                        out.extend_from_slice(format!("property float {name}{}", self.line_end).as_bytes());
                    }
                }
                Piece::Component { row, component, kind } => {
                    push_value(self.encoding, *kind, f64::from(normals[*row][*component]), &mut out);
                }
                Piece::NewNormal { row } => {
                    for component in normals[*row].to_array() {
                        if self.encoding == Encoding::Ascii {
                            out.push(b' ');
                        }
                        push_value(self.encoding, FLOAT, f64::from(component), &mut out);
                    }
                }
            }
        }
        out
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Role {
    Coordinate,
    Normal(usize),
    Other,
}

#[derive(Clone)]
struct Column {
    name: String,
    /// The type of a list's length.
    length: Option<usize>,
    kind: usize,
    role: Role,
}

fn random_columns(random: &mut Random, n_most: usize) -> Vec<Column> {
    (0..1 + random.below(n_most))
        .map(|index| Column {
            name: format!("p{index}"),
            length: (random.below(4) == 0).then(|| random.below(INTEGERS)),
            kind: random.below(TYPES.len()),
            role: Role::Other,
        })
        .collect()
}

fn vertex_columns(random: &mut Random, has_normals: bool) -> Vec<Column> {
    let mut columns = if random.below(3) > 0 {
        random_columns(random, 4)
    } else {
        Vec::new()
    };
    let mut add = |random: &mut Random, name: &str, kind: usize, role: Role| {
        let place = random.below(columns.len() + 1);
        let name = name.to_owned();
        columns.insert(
            place,
            Column {
                name,
                length: None,
                kind,
                role,
            },
        );
    };
    for name in ["x", "y", "z"] {
        let kind = random.pick(&[2, 4, FLOAT, FLOAT, DOUBLE]);
        add(random, name, kind, Role::Coordinate);
    }
    if has_normals {
        let names = random.pick(&[["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]]);
        for (component, name) in names.into_iter().enumerate() {
            let kind = random.pick(&[FLOAT, DOUBLE]);
            add(random, name, kind, Role::Normal(component));
        }
    }
    columns
}

fn random_file(seed: u64) -> File {
    let random = &mut Random(seed);
    let encoding = random.pick(&[Encoding::Ascii, Encoding::Little, Encoding::Big]);
    let line_end = random.pick(&["\n", "\r\n"]);
    let has_normals = random.below(2) == 0;
    let n_points = random.pick(&[1, 2, 7, 40, 40, 40, 40, 20_000]);
    let mut elements = vec![("vertex".to_owned(), vertex_columns(random, has_normals), n_points)];
    for index in 0..random.below(3) {
        let place = random.below(elements.len() + 1);
        let element = (format!("element{index}"), random_columns(random, 3), random.below(6));
        elements.insert(place, element);
    }

    let mut pieces = Vec::new();
    let mut bytes = Vec::new();
    let push_line = |bytes: &mut Vec<u8>, line: &str| {
        bytes.extend_from_slice(line.as_bytes());
        bytes.extend_from_slice(line_end.as_bytes());
    };
    let form = match encoding {
        Encoding::Ascii => "ascii",
        Encoding::Little => "binary_little_endian",
        Encoding::Big => "binary_big_endian",
    };
    push_line(&mut bytes, "ply");
    push_line(&mut bytes, &format!("format {form} 1.0"));
    pieces.extend([Piece::Bytes(std::mem::take(&mut bytes)), Piece::Comment]);
    push_line(&mut bytes, "comment by  a scanner ");
    for (name, columns, count) in &elements {
        push_line(&mut bytes, &format!("element {name} {count}"));
        let last = columns.iter().rposition(|column| column.role == Role::Coordinate);
        for (index, column) in columns.iter().enumerate() {
            let word = |random: &mut Random, kind: usize| random.pick(&[TYPES[kind].0, TYPES[kind].1]);
            let declared = match column.length {
                Some(length) => format!("list {} {}", word(random, length), word(random, column.kind)),
                None => word(random, column.kind).to_owned(),
            };
            push_line(&mut bytes, &format!("property {declared} {}", column.name));
            if Some(index) == last && !has_normals {
                pieces.extend([Piece::Bytes(std::mem::take(&mut bytes)), Piece::NormalDeclarations]);
            }
        }
        if random.below(3) == 0 {
            push_line(&mut bytes, "obj_info kept");
        }
    }
    push_line(&mut bytes, "end_header");

    let former: Vec<Vec3> = (0..n_points).map(|_| random.unit()).collect();
    for (name, columns, count) in &elements {
        let last = columns.iter().rposition(|column| column.role == Role::Coordinate);
        for row in 0..*count {
            for (index, column) in columns.iter().enumerate() {
                if encoding == Encoding::Ascii && index > 0 {
                    bytes.push(b' ');
                }
                if let Some(length) = column.length {
                    let n_items = random.below(4);
                    push_value(encoding, length, n_items as f64, &mut bytes);
                    for _ in 0..n_items {
                        if encoding == Encoding::Ascii {
                            bytes.push(b' ');
                        }
                        push_value(encoding, column.kind, random.below(100) as f64, &mut bytes);
                    }
                } else if let Role::Normal(component) = column.role {
                    pieces.push(Piece::Bytes(std::mem::take(&mut bytes)));
                    pieces.push(Piece::Component {
                        row,
                        component,
                        kind: column.kind,
                    });
                } else {
                    let value = if column.kind < INTEGERS {
                        random.below(120) as f64
                    } else {
                        random.below(1_000_000) as f64 / 1000.0 - 300.0
                    };
                    push_value(encoding, column.kind, value, &mut bytes);
                }
                if name == "vertex" && Some(index) == last && !has_normals {
                    pieces.extend([Piece::Bytes(std::mem::take(&mut bytes)), Piece::NewNormal { row }]);
                }
            }
            if encoding == Encoding::Ascii {
                push_line(&mut bytes, "");
            }
        }
    }
    if encoding != Encoding::Ascii && random.below(4) == 0 {
        bytes.extend_from_slice(b"left over");
    }
    pieces.push(Piece::Bytes(bytes));
    File {
        encoding,
        line_end,
        has_normals,
        pieces,
        former,
    }
}

fn number(property: &Property) -> f64 {
    match property {
        Property::Float(value) => f64::from(*value),
        Property::Double(value) => *value,
        other => panic!("a normal of type {other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn only_normals_and_one_comment_change(seed: u64) {
        let file = random_file(seed);
        let folder = tempfile::tempdir().unwrap();
        let (input, output) = (folder.path().join("in.ply"), folder.path().join("out.ply"));
        std::fs::write(&input, file.input()).unwrap();
        let scan = read(&input, &Silent).unwrap();
        prop_assert_eq!(scan.cloud.n_points(), file.former.len());
        prop_assert_eq!(scan.given_normals.is_some(), file.has_normals);
        if let Some(given) = &scan.given_normals {
            prop_assert_eq!(&given[..], &file.former[..]);
        }

        // Normals that stay, that are turned, and new ones.
        let mut random = Random(!seed);
        let normals: Vec<Vec3> = file
            .former
            .iter()
            .map(|former| match random.below(3) {
                0 => *former,
                1 => -*former,
                _ => random.unit(),
            })
            .collect();
        let options = WriteOptions { rule: "up".to_owned(), ..WriteOptions::default() };
        scan.write(&normals, &output, &options, &Silent).unwrap();
        let written = std::fs::read(&output).unwrap();
        let expect = file.output(&normals);
        let difference = written.iter().zip(&expect).position(|(a, b)| a != b);
        prop_assert_eq!((difference, written.len()), (None, expect.len()));

        // What was written is read again with these normals, and writing them again changes nothing.
        let again = read(&output, &Silent).unwrap();
        prop_assert_eq!(&again.given_normals.as_ref().unwrap()[..], &normals[..]);
        prop_assert_eq!(again.cloud.positions(), scan.cloud.positions());
        let options = WriteOptions { overwrite_input: true, ..options };
        again.write(&normals, &output, &options, &Silent).unwrap();
        prop_assert!(std::fs::read(&output).unwrap() == expect);

        // Another reader sees the same.
        let ply = Parser::<DefaultElement>::new().read_ply(&mut &expect[..]).unwrap();
        let vertices = &ply.payload["vertex"];
        prop_assert_eq!(vertices.len(), normals.len());
        for (vertex, normal) in vertices.iter().zip(&normals) {
            let component = |a: &str, b: &str| number(vertex.get(a).or(vertex.get(b)).unwrap()) as f32;
            let read = Vec3::new(
                component("nx", "normal_x"),
                component("ny", "normal_y"),
                component("nz", "normal_z"),
            );
            prop_assert_eq!(read, *normal);
        }
    }
}
