//! Points in a new LAS or LAZ file: version 1.4, point format 6, 7 or 8, all that has no place there as extra bytes.

use std::path::Path;

use glam::DVec3;
use normend_core::Progress;
use normend_core::progress::Part;
use rayon::prelude::*;

use super::dimensions::{EXTRA_BYTES, push_description, short, standard_fields};
use super::head::{PACKED_BIT, new_record, standard_size};
use super::laz::{MOST_EXTRA, PACKING, Packer, Packing};
use super::rewrite::{ABOUT_NORMAL, NORMAL_FIELDS, SIDE_FIELDS};
use super::{COMMENT, is_packed_name, too_large};
use crate::columns::{ColumnKind, colors_among};
use crate::error::{Stop, WriteError};
use crate::new_file::{Field, Loss, NewFile, NewRow, plain_names};
use crate::output::Output;
use crate::rewrite::write_side;
use crate::table::{PART_ROWS, SIDE, for_each_part};
use crate::value::{Scalar, Scale, ValueType, push_scalar};

/// Parts of a source that are looked at to tell whether coordinates survive, before all of it is at writing.
const SAMPLE_PARTS: usize = 16;
/// More extra bytes are not described, because the record of the descriptions holds 65535 bytes.
const MOST_DESCRIBED: usize = 330;
/// Decimals beyond which coordinates are taken for binary numbers.
const MOST_DECIMALS: i32 = 12;
/// Decimals that programs expect where units are meters.
const USUAL_DECIMALS: i32 = 3;
/// Seconds of a week: GPS times beyond are counted from 1980, less a billion.
const WEEK_SECS: f64 = 604_800.0;
/// Bytes of the header of LAS 1.4.
const HEADER_SIZE: u16 = 375;

/// Drops what LAS cannot hold, and says how far coordinates are rounded, as far as a sample of them tells.
pub(crate) fn limit(file: &mut NewFile<'_>, path: &Path) -> Vec<Loss> {
    let mut losses =
        file.drop_fields(|field| (field.kind == ColumnKind::Words).then(|| "LAS holds numbers, not words".into()));
    let most = if is_packed_name(path) == Some(true) {
        MOST_EXTRA
    } else {
        usize::from(u16::MAX) - 100
    };
    let mut n_bytes = 0;
    let mut n_fields = 0;
    let mut is_too_many = Vec::new();
    for field in &file.fields {
        n_bytes += size(field);
        n_fields += 1;
        // Normal, confidence and its flag come first.
        is_too_many.push(n_bytes + 17 > most || n_fields + 5 > MOST_DESCRIBED);
    }
    let mut is_too_many = is_too_many.into_iter();
    let names: Vec<(String, bool)> = file
        .fields
        .iter()
        .map(|field| field.name.clone())
        .zip(&mut is_too_many)
        .collect();
    losses.extend(file.drop_fields(|field| {
        let is_dropped = names
            .iter()
            .any(|(name, is_dropped)| *is_dropped && *name == field.name);
        is_dropped
            .then(|| format!("a point holds up to {MOST_DESCRIBED} values and {most} bytes besides the usual ones"))
    }));
    let Ok(sample) = Survey::of(file, SAMPLE_PARTS, &normend_core::Silent) else {
        return losses;
    };
    let steps = sample.axes.map(|axis| axis.grid());
    let coarsest = steps
        .iter()
        .filter(|grid| !grid.is_exact)
        .map(|grid| grid.step)
        .fold(0.0, f64::max);
    if coarsest > 0.0 {
        losses.push(Loss {
            what: format!("what coordinates have beyond steps of {coarsest:e}"),
            why: "LAS holds them as numbers of steps, of 32 bits".into(),
        });
    }
    losses
}

/// Bytes of a field as extra bytes.
fn size(field: &Field) -> usize {
    match field.kind {
        ColumnKind::Number(scalar) => scalar.size(),
        ColumnKind::Decimal | ColumnKind::Words => 8,
    }
}

/// What a first look at all rows finds.
struct Survey {
    n_points: u64,
    axes: [Axis; 3],
    fields: Vec<Values>,
}

/// The coordinates of an axis.
#[derive(Clone, Copy)]
struct Axis {
    min: f64,
    max: f64,
    /// Decimals with which each is the same number again; `None` when there are too many.
    decimals: Option<i32>,
}

/// The values of a field.
#[derive(Clone, Copy)]
struct Values {
    are_whole: bool,
    are_angles: bool,
    min: f64,
    max: f64,
    /// Points by value, for values from 0 to 15.
    tally: [u64; 16],
}

/// What whole numbers of steps stand for coordinates of an axis.
#[derive(Clone, Copy)]
struct Grid {
    step: f64,
    offset: f64,
    /// Whether all coordinates are such numbers.
    is_exact: bool,
}

impl Survey {
    /// Looks at up to so many parts, which are spread over the rows.
    fn of(file: &NewFile<'_>, most_parts: usize, progress: &dyn Progress) -> Result<Self, Stop> {
        let n_parts = file.n_rows.div_ceil(PART_ROWS);
        let every = n_parts.div_ceil(most_parts).max(1);
        let is_single = file.coordinates == Scalar::Float;
        let surveys: Vec<Result<Self, Stop>> = (0..n_parts)
            .into_par_iter()
            .step_by(every)
            .map(|index| {
                progress.report(index as f32 / n_parts as f32)?;
                let mut survey = Self::new(file.fields.len());
                file.for_rows(file.rows_of_part(index), |row| survey.add(row, is_single))?;
                Ok(survey)
            })
            .collect();
        let mut all = Self::new(file.fields.len());
        for survey in surveys {
            all.join(&survey?);
        }
        Ok(all)
    }

    fn new(n_fields: usize) -> Self {
        let axis = Axis {
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            decimals: Some(0),
        };
        let values = Values {
            are_whole: true,
            are_angles: true,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            tally: [0; 16],
        };
        Self {
            n_points: 0,
            axes: [axis; 3],
            fields: vec![values; n_fields],
        }
    }

    fn add(&mut self, row: &NewRow<'_>, is_single: bool) {
        if !row.position.is_finite() {
            return;
        }
        self.n_points += 1;
        for (axis, value) in self.axes.iter_mut().zip(row.position.to_array()) {
            axis.min = axis.min.min(value);
            axis.max = axis.max.max(value);
            axis.decimals = axis
                .decimals
                .and_then(|decimals| decimals_of(value, is_single, decimals));
        }
        for (values, cell) in self.fields.iter_mut().zip(row.cells) {
            values.add(cell.number());
        }
    }

    fn join(&mut self, other: &Self) {
        self.n_points += other.n_points;
        for (axis, other) in self.axes.iter_mut().zip(&other.axes) {
            axis.min = axis.min.min(other.min);
            axis.max = axis.max.max(other.max);
            axis.decimals = axis.decimals.zip(other.decimals).map(|(a, b)| a.max(b));
        }
        for (values, other) in self.fields.iter_mut().zip(&other.fields) {
            values.are_whole &= other.are_whole;
            values.are_angles &= other.are_angles;
            values.min = values.min.min(other.min);
            values.max = values.max.max(other.max);
            values
                .tally
                .iter_mut()
                .zip(other.tally)
                .for_each(|(count, other)| *count += other);
        }
    }
}

/// Decimals, from `least` on, with which a number is the same again; `None` when there are too many.
fn decimals_of(value: f64, is_single: bool, least: i32) -> Option<i32> {
    (least..=MOST_DECIMALS).find(|&decimals| {
        let unit = 10.0_f64.powi(decimals);
        let back = (value * unit).round() / unit;
        back == value || is_single && back as f32 == value as f32
    })
}

impl Values {
    fn add(&mut self, value: f64) {
        self.are_whole &= value.fract() == 0.0;
        self.are_angles &= is_angle(value);
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        if let Some(count) = self.tally.get_mut(value as usize) {
            *count += 1;
        }
    }

    /// Whether a standard value of a point holds all of them.
    fn fit(&self, value_type: ValueType) -> bool {
        let within = |most: f64| self.are_whole && 0.0 <= self.min && self.max <= most;
        match value_type {
            ValueType::LittleEndian(Scalar::UChar) => within(f64::from(u8::MAX)),
            ValueType::LittleEndian(Scalar::UShort) => within(f64::from(u16::MAX)),
            ValueType::Bits { n_bits, .. } => within(f64::from((1_u32 << n_bits) - 1)),
            ValueType::Scaled(..) => self.are_angles,
            _ => true,
        }
    }
}

/// Whether a number of degrees is a number of steps of the scan angle, which `f32` may have rounded.
fn is_angle(degrees: f64) -> bool {
    let steps = degrees / super::dimensions::ANGLE_STEP;
    (steps - steps.round()).abs() < 0.01 && steps.abs() <= f64::from(i16::MAX)
}

impl Axis {
    /// The steps that lose nothing or, where there are none, the finest ones.
    fn grid(&self) -> Grid {
        if self.min > self.max {
            return Grid {
                step: 1e-3,
                offset: 0.0,
                is_exact: true,
            };
        }
        let most_steps = f64::from(i32::MAX) - 1.0;
        let fits =
            |offset: f64, unit: f64| (self.max - offset).abs().max((self.min - offset).abs()) * unit <= most_steps;
        let center = self.min / 2.0 + self.max / 2.0;
        // Without an offset numbers of steps are the digits of the coordinates.
        for offset in [0.0, center.round()] {
            for decimals in self
                .decimals
                .into_iter()
                .flat_map(|least| [least.max(USUAL_DECIMALS), least])
            {
                let unit = 10.0_f64.powi(decimals);
                let scale = Scale::new(1.0 / unit, offset);
                // Where the ends survive, so does what is between them.
                let survives = |value: f64| scale.value(scale.steps(value).round()) == value;
                let is_decimal = (center * unit).abs() < 4.5e15 || survives(self.min) && survives(self.max);
                if fits(offset, unit) && is_decimal {
                    return Grid {
                        step: 1.0 / unit,
                        offset,
                        is_exact: true,
                    };
                }
            }
        }
        // 10^308 is the largest power of ten that is a number.
        let decimals = (-308..=300)
            .rev()
            .find(|&decimals| fits(center, 10.0_f64.powi(decimals)));
        Grid {
            step: 10.0_f64.powi(-decimals.unwrap_or(0)),
            offset: center,
            is_exact: false,
        }
    }
}

/// Where a field goes.
enum Place {
    /// A standard value, multiplied.
    Standard {
        offset: usize,
        value_type: ValueType,
        factor: f64,
    },
    /// Extra bytes at the end.
    Extra { offset: usize, scalar: Scalar },
}

/// How rows are written.
struct Plan {
    format: u8,
    stride: usize,
    scales: [Scale; 3],
    /// The field of each place.
    places: Vec<(usize, Place)>,
    descriptions: Vec<u8>,
    /// Where normals begin, after them confidence.
    normals_at: usize,
    /// Points by return.
    returns: [u64; 15],
    has_returns: bool,
}

/// Writes the file.
pub(crate) fn write(file: &mut NewFile<'_>, out: &mut Output<'_>, progress: &dyn Progress) -> Result<(), WriteError> {
    // The coordinates of a new file keep their own type: what narrowing finds of texts is for fields.
    let coordinates = file.coordinates;
    file.narrow(&Part::new(progress, 0.0..0.2))?;
    file.coordinates = coordinates;
    let survey = Survey::of(file, usize::MAX, &Part::new(progress, 0.2..0.4))?;
    let grids = survey.axes.map(|axis| axis.grid());
    let plan = Plan::new(file, &survey, &grids);
    let stride =
        u16::try_from(plan.stride).map_err(|_| too_large(&format!("a point would have {} bytes", plan.stride)))?;
    let packing = if is_packed_name(out.path) == Some(true) {
        let n_extra = stride - standard_size(plan.format).unwrap_or(0) as u16;
        Some(Packing::fresh(plan.format, n_extra).map_err(WriteError::Source)?)
    } else {
        None
    };
    let before = head(file, &survey, &grids, &plan, packing.as_ref())?;
    out.write(&before)?;
    let n_parts = file.n_rows.div_ceil(PART_ROWS);
    let progress = Part::new(progress, 0.4..1.0);
    let make = |index: usize, rows: &mut Vec<u8>| -> Result<(), WriteError> {
        Ok(file.for_rows(file.rows_of_part(index), |row| plan.push_row(row, rows))?)
    };
    match &packing {
        None => for_each_part(n_parts, &progress, make, |rows| out.write(rows)),
        Some(packing) => {
            let mut packer = Packer::new(packing, plan.stride, out)?;
            for_each_part(n_parts, &progress, make, |rows| packer.push(rows))?;
            packer.finish().map(|_| ())
        }
    }
}

impl Plan {
    fn new(file: &NewFile<'_>, survey: &Survey, grids: &[Grid; 3]) -> Self {
        let colors = colors_among(file.fields.iter().map(|field| field.name.as_str()));
        let standard_name =
            |index: usize| match colors.and_then(|colors| colors.iter().position(|&color| color == index)) {
                Some(channel) => Some(["red", "green", "blue"][channel]),
                None => standard_name(&file.fields[index].name),
            };
        let has = |name: &str| (0..file.fields.len()).any(|index| standard_name(index) == Some(name));
        let format = if has("nir") {
            8
        } else if colors.is_some() {
            7
        } else {
            6
        };
        let scales = grids.map(|grid| Scale::new(grid.step, grid.offset));
        let standard = standard_fields(format, scales);
        let mut plan = Self {
            format,
            stride: standard_size(format).unwrap_or(0),
            scales,
            places: Vec::new(),
            descriptions: Vec::new(),
            normals_at: 0,
            returns: [0; 15],
            has_returns: false,
        };
        plan.normals_at = plan.stride;
        if file.normals.is_some() {
            for name in NORMAL_FIELDS {
                plan.describe(name, Scalar::Float, ABOUT_NORMAL);
            }
        }
        if file.has_confidence() {
            for (name, scalar, about) in SIDE_FIELDS {
                plan.describe(name, scalar, about);
            }
        }
        let white = colors.map_or(1.0, |colors| white(&colors, file, survey));
        let names = extra_names(
            file,
            &standard.iter().map(|field| field.name.as_str()).collect::<Vec<&str>>(),
        );
        let mut taken: Vec<&str> = Vec::new();
        for (index, field) in file.fields.iter().enumerate() {
            let values = &survey.fields[index];
            let name = standard_name(index).filter(|name| !taken.contains(name));
            let target = name.and_then(|name| standard.iter().find(|field| field.name == name));
            let scalar = match field.kind {
                ColumnKind::Number(scalar) => scalar,
                ColumnKind::Decimal | ColumnKind::Words => Scalar::Double,
            };
            let factor = match name {
                Some("red" | "green" | "blue") => Some(f64::from(u16::MAX) / white),
                // A share of the strongest echo; what it was exactly is kept as well.
                Some("intensity") if !values.are_whole && 0.0 <= values.min && values.max <= 1.0 => {
                    Some(f64::from(u16::MAX))
                }
                _ => None,
            };
            let fits = target.is_some_and(|target| values.fit(target.value_type));
            if let Some(target) = target.filter(|_| fits || factor.is_some()) {
                taken.push(name.unwrap_or_default());
                if target.name == "return_number" {
                    plan.has_returns = true;
                    plan.returns.copy_from_slice(&values.tally[1..]);
                }
                let place = Place::Standard {
                    offset: target.offset,
                    value_type: target.value_type,
                    factor: factor.unwrap_or(1.0),
                };
                plan.places.push((index, place));
            }
            let is_color = matches!(name, Some("red" | "green" | "blue"));
            if !(fits || is_color) {
                let offset = plan.stride;
                plan.describe(&names[index], scalar, "");
                plan.places.push((index, Place::Extra { offset, scalar }));
            }
        }
        if !plan.has_returns {
            // Without more knowledge each point is the only echo of its pulse.
            plan.returns[0] = survey.n_points;
        }
        plan
    }

    fn describe(&mut self, name: &str, scalar: Scalar, about: &str) {
        push_description(name, scalar, about, &mut self.descriptions);
        self.stride += scalar.size();
    }

    /// Appends a row; a row that is no point is left out.
    fn push_row(&self, row: &NewRow<'_>, out: &mut Vec<u8>) {
        if !row.position.is_finite() {
            return;
        }
        let start = out.len();
        for (scale, value) in self.scales.iter().zip(row.position.to_array()) {
            push_scalar(scale.steps(value), Scalar::Int, out);
        }
        out.resize(start + self.normals_at, 0);
        if !self.has_returns {
            // Return 1 of 1.
            out[start + 14] = 0x11;
        }
        for component in row.normal.iter().flat_map(glam::Vec3::to_array) {
            ValueType::LittleEndian(Scalar::Float).write(component, out);
        }
        if let Some(confidence) = row.confidence {
            for (index, (_, scalar, _)) in SIDE_FIELDS.into_iter().enumerate() {
                write_side(SIDE.start + index, confidence, ValueType::LittleEndian(scalar), out);
            }
        }
        let mut value = Vec::with_capacity(8);
        for (field, place) in &self.places {
            let cell = &row.cells[*field];
            match place {
                Place::Extra { offset, scalar } => {
                    // They come in the order of their places.
                    debug_assert_eq!(out.len() - start, *offset);
                    cell.push_binary(*scalar, out);
                }
                Place::Standard {
                    offset,
                    value_type: ValueType::Bits { first, .. },
                    ..
                } => {
                    out[start + offset] |= (cell.number() as u8) << first;
                }
                Place::Standard {
                    offset,
                    value_type,
                    factor,
                } => {
                    value.clear();
                    match value_type {
                        ValueType::Scaled(steps, scale) => push_scalar(scale.steps(cell.number()), *steps, &mut value),
                        _ if *factor == 1.0 => {
                            cell.push_binary(value_type.scalar().unwrap_or(Scalar::Double), &mut value)
                        }
                        _ => push_scalar(
                            cell.number() * factor,
                            value_type.scalar().unwrap_or(Scalar::Double),
                            &mut value,
                        ),
                    }
                    out[start + offset..][..value.len()].copy_from_slice(&value);
                }
            }
        }
    }
}

/// What is white in the source: colors of bytes and shares of 1 fill 16 bits in LAS, others are such already.
fn white(colors: &[usize; 3], file: &NewFile<'_>, survey: &Survey) -> f64 {
    let largest = colors.iter().map(|&field| survey.fields[field].max).fold(0.0, f64::max);
    let are_whole = colors.iter().all(|&field| survey.fields[field].are_whole);
    let are_bytes = colors
        .iter()
        .all(|&field| file.fields[field].kind == ColumnKind::Number(Scalar::UChar));
    match largest {
        _ if are_bytes => 255.0,
        // Some programs go a little beyond 1.
        ..=1.001 if !are_whole => 1.0,
        ..=255.0 if !are_whole => 255.0,
        _ => f64::from(u16::MAX),
    }
}

/// The standard value of a point that a field of this name is; `None` for others.
fn standard_name(name: &str) -> Option<&'static str> {
    let plain: String = name
        .chars()
        .filter(char::is_ascii_alphanumeric)
        .collect::<String>()
        .to_ascii_lowercase();
    // CloudCompare calls columns so.
    let plain = plain.strip_prefix("scalar").unwrap_or(&plain);
    Some(match plain {
        "intensity" => "intensity",
        "returnnumber" => "return_number",
        "numberofreturns" | "numreturns" => "number_of_returns",
        "synthetic" => "synthetic",
        "keypoint" => "key_point",
        "withheld" => "withheld",
        "overlap" => "overlap",
        "scannerchannel" | "scanchannel" => "scanner_channel",
        "scandirectionflag" => "scan_direction_flag",
        "edgeofflightline" => "edge_of_flight_line",
        "classification" | "class" => "classification",
        "userdata" => "user_data",
        "scanangle" | "scananglerank" => "scan_angle",
        "pointsourceid" => "point_source_id",
        "gpstime" => "gps_time",
        "nir" | "nearinfrared" => "nir",
        _ => return None,
    })
}

/// Names of the fields as extra bytes: none is that of a standard value, none is longer than descriptions hold.
fn extra_names(file: &NewFile<'_>, standard: &[&str]) -> Vec<String> {
    let mut taken: Vec<String> = NORMAL_FIELDS.iter().map(|name| name.to_ascii_lowercase()).collect();
    taken.extend(SIDE_FIELDS.iter().map(|(name, ..)| (*name).to_owned()));
    taken.extend(standard.iter().map(|name| (*name).to_owned()));
    let taken: Vec<&str> = taken.iter().map(String::as_str).collect();
    let names = plain_names(&file.fields, &taken);
    let mut unique: Vec<String> = Vec::new();
    for name in names {
        // Room for a number behind it.
        let base = short(&name, 28);
        let mut candidate = short(&name, 31).to_owned();
        let mut number = 2;
        while unique.contains(&candidate) {
            candidate = format!("{base}_{number}");
            number += 1;
        }
        unique.push(candidate);
    }
    unique
}

/// What stands before the points.
fn head(
    file: &NewFile<'_>,
    survey: &Survey,
    grids: &[Grid; 3],
    plan: &Plan,
    packing: Option<&Packing>,
) -> Result<Vec<u8>, WriteError> {
    let mut records = Vec::new();
    if !plan.descriptions.is_empty() {
        records.push(new_record(EXTRA_BYTES.0, EXTRA_BYTES.1, "", &plan.descriptions));
    }
    if let Some(comment) = file.comment {
        let comment = short(comment, usize::from(u16::MAX)).as_bytes();
        records.push(new_record(COMMENT.0, COMMENT.1, "how normals were oriented", comment));
    }
    if let Some(packing) = packing {
        records.push(new_record(PACKING.0, PACKING.1, "", &packing.record));
    }
    let n_bytes: usize = records.iter().map(Vec::len).sum();
    // What is stored, not what came in.
    let bound = |end: fn(&Axis) -> f64| -> DVec3 {
        DVec3::from_array(std::array::from_fn(|axis| {
            let scale = plan.scales[axis];
            if survey.n_points == 0 {
                0.0
            } else {
                scale.value(scale.steps(end(&survey.axes[axis])).round())
            }
        }))
    };
    let (min, max) = (bound(|axis| axis.min), bound(|axis| axis.max));
    let is_adjusted = file
        .fields
        .iter()
        .zip(&survey.fields)
        .any(|(field, values)| standard_name(&field.name) == Some("gps_time") && values.max > WEEK_SECS);
    let mut generating_software = [0; 32];
    let program = concat!("Normend ", env!("CARGO_PKG_VERSION")).as_bytes();
    generating_software[..program.len()].copy_from_slice(program);
    let mut system_identifier = [0; 32];
    system_identifier[..5].copy_from_slice(b"OTHER");
    let header = las::raw::Header {
        // Coordinate systems would be in WKT, as these formats ask for.
        global_encoding: 16 | u16::from(is_adjusted),
        version: las::Version::new(1, 4),
        system_identifier,
        generating_software,
        header_size: HEADER_SIZE,
        offset_to_point_data: u32::from(HEADER_SIZE) + n_bytes as u32,
        number_of_variable_length_records: records.len() as u32,
        point_data_record_format: plan.format | if packing.is_some() { PACKED_BIT } else { 0 },
        point_data_record_length: plan.stride as u16,
        x_scale_factor: grids[0].step,
        y_scale_factor: grids[1].step,
        z_scale_factor: grids[2].step,
        x_offset: grids[0].offset,
        y_offset: grids[1].offset,
        z_offset: grids[2].offset,
        min_x: min.x,
        min_y: min.y,
        min_z: min.z,
        max_x: max.x,
        max_y: max.y,
        max_z: max.z,
        evlr: None,
        large_file: Some(las::raw::header::LargeFile {
            number_of_point_records: survey.n_points,
            number_of_points_by_return: plan.returns,
        }),
        ..las::raw::Header::default()
    };
    let mut bytes = Vec::new();
    let written = header.write_to(&mut bytes);
    written.map_err(|_| too_large("the header holds numbers that are larger than its fields"))?;
    records.iter().for_each(|record| bytes.extend_from_slice(record));
    Ok(bytes)
}
