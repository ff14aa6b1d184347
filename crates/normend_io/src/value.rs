//! Single numbers as files hold them: text, or binary of some type and byte order.

/// The types of binary numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    Char,
    UChar,
    Short,
    UShort,
    Int,
    UInt,
    /// 64 bits, which PLY has not.
    Long,
    ULong,
    Float,
    Double,
}

impl Scalar {
    /// Size in bytes.
    pub fn size(self) -> usize {
        match self {
            Self::Char | Self::UChar => 1,
            Self::Short | Self::UShort => 2,
            Self::Int | Self::UInt | Self::Float => 4,
            Self::Long | Self::ULong | Self::Double => 8,
        }
    }

    pub fn is_float(self) -> bool {
        matches!(self, Self::Float | Self::Double)
    }
}

/// How a number is written down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ValueType {
    Text,
    /// Text with a comma in place of the point.
    TextComma,
    LittleEndian(Scalar),
    BigEndian(Scalar),
    /// `n_bits` bits of one byte, from bit `first` on: a whole number that is only read.
    Bits {
        first: u8,
        n_bits: u8,
    },
    /// A little-endian number of steps that stands for another number, which is only read.
    Scaled(Scalar, Scale),
    /// The byte from bit `shift` on of a number of 32 bits in text, as PCD has colors: a whole number that is only read.
    TextByte {
        shift: u8,
        /// Whether the number is said to be a `float`, whose bits are meant then.
        is_float: bool,
    },
}

/// What number of steps stands for what: `(steps + shift) * multiplier / divisor + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    shift: f64,
    multiplier: f64,
    divisor: f64,
    offset: f64,
    /// The number of steps that stands for no value; NaN when each stands for one.
    pub no_data: f64,
}

impl Scale {
    /// `steps * step + offset`. With a step of a decimal place and an offset of whole steps the result is the `f64` next to the
    /// decimal number: what has millimetres in the file has no more digits anywhere else.
    pub fn new(step: f64, offset: f64) -> Self {
        // Beyond 22, powers of ten are no `f64`.
        let divisor = (0..=22).map(|places| 10.0_f64.powi(places));
        let exact = divisor.filter(|divisor| step == 1.0 / divisor).find_map(|divisor| {
            let shift = (offset * divisor).round();
            // Both summands are whole numbers below 2^52, so that their sum is one.
            (shift.abs() < 4.5e15 && shift / divisor == offset).then_some((shift, divisor))
        });
        let (shift, multiplier, divisor, offset) = match exact {
            Some((shift, divisor)) => (shift, 1.0, divisor, 0.0),
            None => (0.0, step, 1.0, offset),
        };
        Self {
            shift,
            multiplier,
            divisor,
            offset,
            no_data: f64::NAN,
        }
    }

    /// The number that `steps` stand for.
    #[inline]
    pub fn value(self, steps: f64) -> f64 {
        if steps == self.no_data {
            return f64::NAN;
        }
        (steps + self.shift) * self.multiplier / self.divisor + self.offset
    }

    /// The steps nearest to a number, as a number that may have a fraction.
    #[inline]
    pub fn steps(self, value: f64) -> f64 {
        (value - self.offset) * self.divisor / self.multiplier - self.shift
    }
}

macro_rules! from_bytes {
    ($scalar:expr, $convert:ident, $bytes:expr) => {
        match $scalar {
            Scalar::Char => f64::from(i8::$convert($bytes.try_into().ok()?)),
            Scalar::UChar => f64::from(u8::$convert($bytes.try_into().ok()?)),
            Scalar::Short => f64::from(i16::$convert($bytes.try_into().ok()?)),
            Scalar::UShort => f64::from(u16::$convert($bytes.try_into().ok()?)),
            Scalar::Int => f64::from(i32::$convert($bytes.try_into().ok()?)),
            Scalar::UInt => f64::from(u32::$convert($bytes.try_into().ok()?)),
            Scalar::Long => i64::$convert($bytes.try_into().ok()?) as f64,
            Scalar::ULong => u64::$convert($bytes.try_into().ok()?) as f64,
            Scalar::Float => f64::from(f32::$convert($bytes.try_into().ok()?)),
            Scalar::Double => f64::$convert($bytes.try_into().ok()?),
        }
    };
}

impl ValueType {
    /// The type of a binary number.
    pub fn scalar(self) -> Option<Scalar> {
        match self {
            Self::Text | Self::TextComma => None,
            Self::LittleEndian(scalar) | Self::BigEndian(scalar) => Some(scalar),
            Self::Bits { .. } | Self::TextByte { .. } => Some(Scalar::UChar),
            Self::Scaled(..) => Some(Scalar::Double),
        }
    }

    /// Size in bytes; 0 for text, which has none.
    pub fn size(self) -> usize {
        match self {
            Self::Scaled(steps, _) => steps.size(),
            Self::TextByte { .. } => 0,
            _ => self.scalar().map_or(0, Scalar::size),
        }
    }

    /// Reads the whole number that `bytes` are, where `f64` would round it: 64 bits, which nothing but binary files has.
    pub fn read_long(self, bytes: &[u8]) -> Option<i128> {
        let bytes: [u8; 8] = bytes.try_into().ok()?;
        Some(match self {
            Self::LittleEndian(Scalar::Long) => i64::from_le_bytes(bytes).into(),
            Self::BigEndian(Scalar::Long) => i64::from_be_bytes(bytes).into(),
            Self::LittleEndian(Scalar::ULong) => u64::from_le_bytes(bytes).into(),
            Self::BigEndian(Scalar::ULong) => u64::from_be_bytes(bytes).into(),
            _ => return None,
        })
    }

    /// Reads the number that `bytes` are, all of them; `None` when they are not one.
    #[inline]
    pub fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::Text => return parse(bytes),
            Self::TextComma => return parse_with_comma(bytes),
            Self::LittleEndian(scalar) => from_bytes!(scalar, from_le_bytes, bytes),
            Self::BigEndian(scalar) => from_bytes!(scalar, from_be_bytes, bytes),
            Self::Bits { first, n_bits } => {
                let [byte] = bytes.try_into().ok()?;
                let byte: u8 = byte;
                f64::from((byte >> first) & (0xff >> (8 - n_bits)))
            }
            Self::Scaled(steps, scale) => scale.value(from_bytes!(steps, from_le_bytes, bytes)),
            Self::TextByte { shift, is_float } => f64::from((bits_of_text(bytes, is_float)? >> shift) as u8),
        })
    }

    /// Appends `value`: the shortest text that reads back as the same `f32`, a `double`, or a `float`, also in place of
    /// an integer, which holds no component of a unit vector. Zero is written without a sign.
    pub fn write(self, value: f32, out: &mut Vec<u8>) {
        let value = value + 0.0;
        match self {
            Self::Text => push_number(f64::from(value), true, out),
            Self::TextComma => {
                let start = out.len();
                push_number(f64::from(value), true, out);
                replace_byte(&mut out[start..], b'.', b',');
            }
            Self::LittleEndian(Scalar::Double) => out.extend_from_slice(&f64::from(value).to_le_bytes()),
            Self::BigEndian(Scalar::Double) => out.extend_from_slice(&f64::from(value).to_be_bytes()),
            Self::LittleEndian(_) => out.extend_from_slice(&value.to_le_bytes()),
            Self::BigEndian(_) => out.extend_from_slice(&value.to_be_bytes()),
            Self::Bits { .. } => out.push(value as u8),
            Self::TextByte { .. } => push_number(f64::from(value), true, out),
            Self::Scaled(steps, scale) => push_scalar(scale.steps(f64::from(value)), steps, out),
        }
    }

    /// Appends 1 or 0 as a number of this type.
    pub fn write_flag(self, is_set: bool, out: &mut Vec<u8>) {
        match self {
            Self::LittleEndian(scalar) | Self::BigEndian(scalar) if !scalar.is_float() => {
                let first = out.len();
                out.resize(first + scalar.size(), 0);
                let lowest = match self {
                    Self::BigEndian(_) => out.len() - 1,
                    _ => first,
                };
                out[lowest] = u8::from(is_set);
            }
            _ => self.write(f32::from(u8::from(is_set)), out),
        }
    }

    /// Appends `bytes`, a number of this type (text, `float` or `double`), with the opposite sign and nothing else
    /// changed; zero stays.
    pub fn write_negated(self, bytes: &[u8], out: &mut Vec<u8>) {
        let start = out.len();
        match self {
            _ if self.read(bytes) == Some(0.0) => out.extend_from_slice(bytes),
            Self::Text | Self::TextComma => match bytes {
                [b'-', digits @ ..] => out.extend_from_slice(digits),
                [b'+', digits @ ..] | digits => {
                    out.push(b'-');
                    out.extend_from_slice(digits);
                }
            },
            Self::LittleEndian(_) => {
                out.extend_from_slice(bytes);
                if let Some(byte) = out[start..].last_mut() {
                    *byte ^= 0x80;
                }
            }
            Self::BigEndian(_) => {
                out.extend_from_slice(bytes);
                if let Some(byte) = out[start..].first_mut() {
                    *byte ^= 0x80;
                }
            }
            Self::Bits { .. } | Self::Scaled(..) | Self::TextByte { .. } => {
                self.write(-self.read(bytes).unwrap_or(0.0) as f32, out);
            }
        }
    }
}

/// Reads a number in text with a decimal comma or without one.
fn parse_with_comma(token: &[u8]) -> Option<f64> {
    /// More digits than any `f64` needs.
    const LONGEST: usize = 64;
    if !token.contains(&b',') {
        return parse(token).filter(|_| !token.contains(&b'.'));
    }
    let mut with_point = [0_u8; LONGEST];
    let with_point = with_point.get_mut(..token.len())?;
    with_point.copy_from_slice(token);
    replace_byte(with_point, b',', b'.');
    parse(with_point).filter(|_| !token.contains(&b'.'))
}

/// Puts one byte in the place of another.
pub(crate) fn replace_byte(bytes: &mut [u8], from: u8, to: u8) {
    for byte in bytes.iter_mut().filter(|byte| **byte == from) {
        *byte = to;
    }
}

/// The 32 bits that a number in text stands for. A `float` means its own bits; but colors without opacity are floats next to
/// nothing then, so a program that writes a whole number means that.
fn bits_of_text(token: &[u8], is_float: bool) -> Option<u32> {
    let value = parse(token)?;
    let is_whole = value.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&value);
    Some(if is_float && !is_whole {
        (value as f32).to_bits()
    } else {
        // A negative one is the same bits, signed.
        value as i64 as u32
    })
}

/// Appends the number of a type that is nearest to `value`, little-endian; 0 for what is no number in a type of whole ones.
pub(crate) fn push_scalar(value: f64, scalar: Scalar, out: &mut Vec<u8>) {
    // Casts of floats give the nearest number that there is.
    match scalar {
        Scalar::Char => out.extend((value.round() as i8).to_le_bytes()),
        Scalar::UChar => out.extend((value.round() as u8).to_le_bytes()),
        Scalar::Short => out.extend((value.round() as i16).to_le_bytes()),
        Scalar::UShort => out.extend((value.round() as u16).to_le_bytes()),
        Scalar::Int => out.extend((value.round() as i32).to_le_bytes()),
        Scalar::UInt => out.extend((value.round() as u32).to_le_bytes()),
        Scalar::Long => out.extend((value.round() as i64).to_le_bytes()),
        Scalar::ULong => out.extend((value.round() as u64).to_le_bytes()),
        Scalar::Float => out.extend((value as f32).to_le_bytes()),
        Scalar::Double => out.extend(value.to_le_bytes()),
    }
}

/// Appends the shortest text that reads back as the same number: as `f32` when it `is_single`, else as `f64`.
pub(crate) fn push_number(value: f64, is_single: bool, out: &mut Vec<u8>) {
    use std::io::Write;
    let magnitude = value.abs();
    // `Display` writes no exponents, so very small and very large numbers would get hundreds of digits.
    let plain = value == 0.0 || (1e-5..1e16).contains(&magnitude) || !value.is_finite();
    // Writing to a vector cannot fail.
    let _ = match (is_single, plain) {
        _ if value.is_nan() => out.write_all(b"nan"),
        (true, true) => write!(out, "{}", value as f32),
        (true, false) => write!(out, "{:e}", value as f32),
        (false, true) => write!(out, "{value}"),
        (false, false) => write!(out, "{value:e}"),
    };
}

/// Reads a number in text, also the ways in which C libraries write what is not finite (`-nan(ind)`, `1.#QNAN`).
pub(crate) fn parse(token: &[u8]) -> Option<f64> {
    if let Ok(value) = fast_float2::parse(token) {
        return Some(value);
    }
    let unsigned = token.strip_prefix(b"-").or(token.strip_prefix(b"+")).unwrap_or(token);
    let is_nan = unsigned
        .get(..4)
        .is_some_and(|start| start.eq_ignore_ascii_case(b"nan("))
        && unsigned.ends_with(b")");
    let is_microsoft = unsigned.starts_with(b"1.#");
    (is_nan || is_microsoft).then_some(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_read_as_c_libraries_write_it() {
        let check = |token: &str, expect: Option<f64>| {
            let value = parse(token.as_bytes());
            let same = match (value, expect) {
                (Some(value), Some(expect)) => value == expect || (value.is_nan() && expect.is_nan()),
                (value, expect) => value == expect,
            };
            assert!(same, "{token}: {value:?}, expected {expect:?}");
        };
        check("1", Some(1.0));
        check("+1.5", Some(1.5));
        check("-0.25e2", Some(-25.0));
        check(".5", Some(0.5));
        check("5.", Some(5.0));
        check("1E-3", Some(0.001));
        check("nan", Some(f64::NAN));
        check("-NaN", Some(f64::NAN));
        check("-nan(ind)", Some(f64::NAN));
        check("1.#QNAN", Some(f64::NAN));
        check("-1.#IND00", Some(f64::NAN));
        check("inf", Some(f64::INFINITY));
        check("-Infinity", Some(f64::NEG_INFINITY));
        check("", None);
        check("-", None);
        check("1.5x", None);
        check("1,5", None);
        check("nano", None);
        check("0x10", None);
    }

    #[test]
    fn numbers_in_text_are_shortest() {
        let check = |value: f64, is_single: bool, expect: &str| {
            let mut out = Vec::new();
            push_number(value, is_single, &mut out);
            assert_eq!(String::from_utf8(out).unwrap(), expect);
        };
        check(0.0, true, "0");
        check(-1.0, true, "-1");
        check(f64::from(0.1_f32), true, "0.1");
        check(f64::from(0.1_f32), false, "0.10000000149011612");
        check(1.5e-30, false, "1.5e-30");
        check(f64::from(3e-20_f32), true, "3e-20");
        check(4_500_123.001, false, "4500123.001");
        check(f64::NAN, true, "nan");
        check(f64::NEG_INFINITY, false, "-inf");
    }

    #[test]
    fn the_opposite_sign_changes_nothing_else() {
        let check = |token: &str, expect: &str| {
            let mut out = Vec::new();
            ValueType::Text.write_negated(token.as_bytes(), &mut out);
            assert_eq!(String::from_utf8(out).unwrap(), expect);
        };
        check("0.50", "-0.50");
        check("-0.50", "0.50");
        check("+0.50", "-0.50");
        check("0.0", "0.0");
        for value in [0.5_f64, -3.25] {
            for (value_type, bytes, expect) in [
                (
                    ValueType::LittleEndian(Scalar::Double),
                    value.to_le_bytes().to_vec(),
                    (-value).to_le_bytes().to_vec(),
                ),
                (
                    ValueType::BigEndian(Scalar::Double),
                    value.to_be_bytes().to_vec(),
                    (-value).to_be_bytes().to_vec(),
                ),
                (
                    ValueType::LittleEndian(Scalar::Float),
                    (value as f32).to_le_bytes().to_vec(),
                    (-value as f32).to_le_bytes().to_vec(),
                ),
            ] {
                let mut out = vec![7];
                value_type.write_negated(&bytes, &mut out);
                assert_eq!(out[1..], expect);
            }
        }
    }
}
