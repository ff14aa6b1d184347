//! What a point of a LAS file holds: the values of its format, and those that the Extra Bytes record describes.

use crate::error::{Broken, Place};
use crate::records::{NORMAL_NAMES, RecordField};
use crate::table::{N_VALUES, NORMAL, SIDE, VALUE_NAMES};
use crate::value::{Scalar, Scale, ValueType};

/// The record that describes extra bytes: of this user, with this number.
pub(crate) const EXTRA_BYTES: (&str, u16) = ("LASF_Spec", 4);
/// Bytes of the description of one value.
pub(crate) const DESCRIPTION: usize = 192;
/// Degrees of a step of the scan angle in formats 6 to 10.
pub(crate) const ANGLE_STEP: f64 = 0.006;

/// Where parts of a description stand.
mod part {
    pub const TYPE: usize = 2;
    pub const OPTIONS: usize = 3;
    pub const NAME: usize = 4;
    pub const NO_DATA: usize = 40;
    pub const SCALE: usize = 112;
    pub const OFFSET: usize = 136;
    /// Longest name.
    pub const NAME_LENGTH: usize = 32;
}

/// What the options of a description say to be there.
mod option {
    pub const NO_DATA: u8 = 1;
    pub const RANGE: u8 = 2 | 4;
    pub const SCALE: u8 = 8;
    pub const OFFSET: u8 = 16;
}

/// The values of a point of a format, in the order of its bytes; x, y and z first, scaled as the header says.
pub(crate) fn standard_fields(format: u8, scales: [Scale; 3]) -> Vec<RecordField> {
    let mut fields: Vec<RecordField> = Vec::new();
    let mut push = |name: &str, offset: usize, value_type: ValueType| {
        fields.push(RecordField {
            name: name.to_owned(),
            offset,
            value_type,
        });
    };
    let number = ValueType::LittleEndian;
    let bits = |first: u8, n_bits: u8| ValueType::Bits { first, n_bits };
    for (axis, scale) in scales.into_iter().enumerate() {
        push(VALUE_NAMES[axis], 4 * axis, ValueType::Scaled(Scalar::Int, scale));
    }
    push("intensity", 12, number(Scalar::UShort));
    let is_extended = format >= 6;
    if is_extended {
        push("return_number", 14, bits(0, 4));
        push("number_of_returns", 14, bits(4, 4));
        push("synthetic", 15, bits(0, 1));
        push("key_point", 15, bits(1, 1));
        push("withheld", 15, bits(2, 1));
        push("overlap", 15, bits(3, 1));
        push("scanner_channel", 15, bits(4, 2));
        push("scan_direction_flag", 15, bits(6, 1));
        push("edge_of_flight_line", 15, bits(7, 1));
        push("classification", 16, number(Scalar::UChar));
        push("user_data", 17, number(Scalar::UChar));
        push(
            "scan_angle",
            18,
            ValueType::Scaled(Scalar::Short, Scale::new(ANGLE_STEP, 0.0)),
        );
        push("point_source_id", 20, number(Scalar::UShort));
    } else {
        push("return_number", 14, bits(0, 3));
        push("number_of_returns", 14, bits(3, 3));
        push("scan_direction_flag", 14, bits(6, 1));
        push("edge_of_flight_line", 14, bits(7, 1));
        push("classification", 15, bits(0, 5));
        push("synthetic", 15, bits(5, 1));
        push("key_point", 15, bits(6, 1));
        push("withheld", 15, bits(7, 1));
        push("scan_angle", 16, number(Scalar::Char));
        push("user_data", 17, number(Scalar::UChar));
        push("point_source_id", 18, number(Scalar::UShort));
    }
    let mut at = if is_extended { 22 } else { 20 };
    if !matches!(format, 0 | 2) {
        push("gps_time", at, number(Scalar::Double));
        at += 8;
    }
    if matches!(format, 2 | 3 | 5 | 7 | 8 | 10) {
        for (channel, name) in ["red", "green", "blue"].into_iter().enumerate() {
            push(name, at + 2 * channel, number(Scalar::UShort));
        }
        at += 6;
    }
    if matches!(format, 8 | 10) {
        push("nir", at, number(Scalar::UShort));
        at += 2;
    }
    if matches!(format, 4 | 5 | 9 | 10) {
        push("wavepacket_index", at, number(Scalar::UChar));
        push("wavepacket_offset", at + 1, number(Scalar::ULong));
        push("wavepacket_size", at + 9, number(Scalar::UInt));
        for (index, name) in ["return_point_wave_location", "x_t", "y_t", "z_t"]
            .into_iter()
            .enumerate()
        {
            push(name, at + 13 + 4 * index, number(Scalar::Float));
        }
    }
    fields
}

/// The extra bytes that the descriptions of a file speak of.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExtraBytes {
    /// All descriptions one after the other.
    pub descriptions: Vec<u8>,
    /// Bytes of a point that they speak of.
    pub n_described: usize,
    /// Bytes among these that have no name and no type.
    pub n_unnamed: usize,
    /// The named values; the offsets are those within a point.
    pub fields: Vec<RecordField>,
    /// The description of each field.
    pub description_of: Vec<usize>,
}

/// Reads the descriptions of `n_extra` extra bytes, which follow the first `standard` bytes of a point.
pub(crate) fn extra_bytes(descriptions: Vec<u8>, standard: usize, n_extra: usize) -> Result<ExtraBytes, Broken> {
    let mut extra = ExtraBytes::default();
    for (index, description) in descriptions.chunks_exact(DESCRIPTION).enumerate() {
        let (n_bytes, kind) = match description[part::TYPE] {
            0 => (usize::from(description[part::OPTIONS]), None),
            kind @ 1..=30 => {
                let scalar = SCALARS[usize::from((kind - 1) % 10)];
                let n_values = 1 + usize::from((kind - 1) / 10);
                (n_values * scalar.size(), Some((scalar, n_values)))
            }
            kind => {
                return Err(Broken::whole(format!(
                    "extra byte {} has type {kind}, which there is not: export the file again",
                    index + 1
                )));
            }
        };
        let at = standard + extra.n_described;
        extra.n_described += n_bytes;
        if extra.n_described > n_extra {
            return Err(Broken::whole(format!(
                "the points have {n_extra} extra bytes, but more are described: export the file again"
            )));
        }
        let Some((scalar, n_values)) = kind else {
            extra.n_unnamed += n_bytes;
            continue;
        };
        let name = name_of(description);
        for value in 0..n_values {
            extra.fields.push(RecordField {
                name: name_of_value(&name, value, n_values),
                offset: at + value * scalar.size(),
                value_type: value_type(description, scalar, value),
            });
            extra.description_of.push(index);
        }
    }
    extra.n_unnamed += n_extra - extra.n_described;
    extra.descriptions = descriptions;
    Ok(extra)
}

/// The types of extra bytes, by their number less 1.
const SCALARS: [Scalar; 10] = [
    Scalar::UChar,
    Scalar::Char,
    Scalar::UShort,
    Scalar::Short,
    Scalar::UInt,
    Scalar::Int,
    Scalar::ULong,
    Scalar::Long,
    Scalar::Float,
    Scalar::Double,
];

fn name_of(description: &[u8]) -> String {
    let name = &description[part::NAME..][..part::NAME_LENGTH];
    let name = name.split(|&byte| byte == 0).next().unwrap_or(name);
    String::from_utf8_lossy(name).trim().to_owned()
}

/// The name of one of several values that are described together: a normal's are called by their axes.
fn name_of_value(name: &str, value: usize, n_values: usize) -> String {
    let is_normal = name.eq_ignore_ascii_case("normal") || name.eq_ignore_ascii_case("normals");
    match n_values {
        1 => name.to_owned(),
        3 if is_normal => NORMAL_NAMES[value][1].to_owned(),
        _ => format!("{name}_{value}"),
    }
}

fn value_type(description: &[u8], scalar: Scalar, value: usize) -> ValueType {
    let options = description[part::OPTIONS];
    let number = |start: usize| -> Option<f64> {
        let bytes = description[start + 8 * value..][..8].try_into().ok()?;
        Some(f64::from_le_bytes(bytes))
    };
    let wanted = |bit: u8, start: usize| if options & bit == 0 { None } else { number(start) };
    let scale = wanted(option::SCALE, part::SCALE).filter(|scale| scale.is_finite() && *scale != 0.0);
    let offset = wanted(option::OFFSET, part::OFFSET).filter(|offset| offset.is_finite());
    let no_data = (options & option::NO_DATA != 0).then(|| {
        // It is as wide as there are numbers of its kind.
        let bytes = &description[part::NO_DATA + 8 * value..][..8];
        let wide = match scalar {
            Scalar::UChar | Scalar::UShort | Scalar::UInt | Scalar::ULong => Scalar::ULong,
            Scalar::Char | Scalar::Short | Scalar::Int | Scalar::Long => Scalar::Long,
            Scalar::Float | Scalar::Double => Scalar::Double,
        };
        ValueType::LittleEndian(wide).read(bytes).unwrap_or(f64::NAN)
    });
    if scale.is_none() && offset.is_none() && no_data.is_none() {
        return ValueType::LittleEndian(scalar);
    }
    let mut scaling = Scale::new(scale.unwrap_or(1.0), offset.unwrap_or(0.0));
    scaling.no_data = no_data.unwrap_or(f64::NAN);
    ValueType::Scaled(scalar, scaling)
}

/// How far a component of a normal may be off where it is a number of steps: those of a byte with a sign are this large.
const COARSEST_SHARE: f64 = 1.0 / 127.0;

/// The fields that are coordinates, normal, confidence and its flag, by slot. `extra` are the fields from `first_extra` on.
pub(crate) fn chosen(fields: &[RecordField], first_extra: usize) -> [Option<usize>; N_VALUES] {
    let mut chosen = [None; N_VALUES];
    for (axis, slot) in chosen[..NORMAL.start].iter_mut().enumerate() {
        *slot = Some(axis);
    }
    let find = |name: &str, fits: &dyn Fn(ValueType) -> bool| {
        let is_wanted = |field: &RecordField| field.name.eq_ignore_ascii_case(name) && fits(field.value_type);
        fields[first_extra..]
            .iter()
            .position(is_wanted)
            .map(|index| first_extra + index)
    };
    // Whole numbers hold no unit vector, unless they are steps of something smaller.
    let holds_shares = |value_type: ValueType| match value_type {
        ValueType::LittleEndian(scalar) => scalar.is_float(),
        // Of any size and from any number on: only where both ends and the middle come back.
        ValueType::Scaled(..) => [-1.0, 0.0, 0.6, 1.0].into_iter().all(|share: f32| {
            let mut bytes = Vec::new();
            value_type.write(share, &mut bytes);
            let is_near = |read: f64| (read - f64::from(share)).abs() <= COARSEST_SHARE;
            value_type.read(&bytes).is_some_and(is_near)
        }),
        _ => false,
    };
    for way in 0..NORMAL_NAMES[0].len() {
        let normal = NORMAL_NAMES.map(|names| find(names[way], &holds_shares));
        if normal.iter().all(Option::is_some) {
            chosen[NORMAL].copy_from_slice(&normal);
            break;
        }
    }
    chosen[SIDE.start] = find(VALUE_NAMES[SIDE.start], &holds_shares);
    chosen[SIDE.start + 1] = find(VALUE_NAMES[SIDE.start + 1], &|value_type| {
        matches!(value_type, ValueType::LittleEndian(_))
    });
    chosen
}

/// Says that a description's range is unknown: its values are others now.
pub(crate) fn forget_range(descriptions: &mut [u8], index: usize) {
    if let Some(options) = descriptions.get_mut(index * DESCRIPTION + part::OPTIONS) {
        *options &= !option::RANGE;
    }
}

/// Appends the description of a new value.
pub(crate) fn push_description(name: &str, scalar: Scalar, about: &str, descriptions: &mut Vec<u8>) {
    let mut description = [0; DESCRIPTION];
    let kind = SCALARS.iter().position(|&other| other == scalar).unwrap_or(0) + 1;
    description[part::TYPE] = kind as u8;
    let name = short(name, part::NAME_LENGTH);
    description[part::NAME..][..name.len()].copy_from_slice(name.as_bytes());
    let about = short(about, DESCRIPTION - 160);
    description[160..][..about.len()].copy_from_slice(about.as_bytes());
    descriptions.extend_from_slice(&description);
}

/// Appends descriptions of bytes that nothing is known of.
pub(crate) fn push_unnamed(mut n_bytes: usize, descriptions: &mut Vec<u8>) {
    while n_bytes > 0 {
        let n_together = n_bytes.min(usize::from(u8::MAX));
        let mut description = [0; DESCRIPTION];
        description[part::OPTIONS] = n_together as u8;
        descriptions.extend_from_slice(&description);
        n_bytes -= n_together;
    }
}

/// As much of a text as fits into so many bytes.
pub(crate) fn short(text: &str, n_bytes: usize) -> &str {
    let mut end = text.len().min(n_bytes);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    &text[..end]
}

/// A description that is not whole is no reason to guess.
pub(crate) fn check_descriptions(at: usize, n_bytes: usize) -> Result<(), Broken> {
    if n_bytes.is_multiple_of(DESCRIPTION) {
        return Ok(());
    }
    Err(Broken::new(
        Place::Byte(at),
        format!(
            "the description of extra bytes has {n_bytes} bytes, no multiple of {DESCRIPTION}: export the file again"
        ),
    ))
}
