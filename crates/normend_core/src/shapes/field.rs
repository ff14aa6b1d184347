//! Solids as functions of space: negative inside, positive outside, zero on the surface.
//!
//! No value is larger than the distance to the surface. So it is a step that cannot pass through one, which is what lets rays
//! find thin sheets; see [`super::rays`]. Functions of slope 1 have this, `min`, `max`, turns and shifts keep it, and a
//! function that is steeper is divided by its bound.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};

/// A solid: see the module.
pub(super) type Field = Arc<dyn Fn(DVec3) -> f64 + Send + Sync>;

/// The outward unit normal at a point of the surface, by central differences.
///
/// The step is far above the rounding of `f64` and far below every feature, so the error is about 1e-9, less than that of an
/// `f32` component, save within a step of an edge.
pub(super) fn normal(field: &Field, point: DVec3) -> DVec3 {
    const STEP: f64 = 1e-6;
    let slope = |axis: DVec3| field(point + STEP * axis) - field(point - STEP * axis);
    DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize_or(DVec3::Z)
}

/// The solid with this function.
pub(super) fn solid(field: impl Fn(DVec3) -> f64 + Send + Sync + 'static) -> Field {
    Arc::new(field)
}

pub(super) fn union<const N: usize>(parts: [Field; N]) -> Field {
    union_of(parts.into())
}

pub(super) fn union_of(parts: Vec<Field>) -> Field {
    solid(move |p| parts.iter().map(|part| part(p)).fold(f64::INFINITY, f64::min))
}

pub(super) fn both(a: Field, b: Field) -> Field {
    solid(move |p| a(p).max(b(p)))
}

/// `body` without `hole`.
pub(super) fn minus(body: Field, hole: Field) -> Field {
    solid(move |p| body(p).max(-hole(p)))
}

/// Everything but `body`.
pub(super) fn outside(body: Field) -> Field {
    solid(move |p| -body(p))
}

/// A union whose seam is filled with a fillet of about `width` (polynomial smooth minimum, I. Quilez).
pub(super) fn blend(parts: Vec<Field>, width: f64) -> Field {
    solid(move |p| {
        let smooth_min = |a: f64, b: f64| {
            let overlap = (width - (a - b).abs()).max(0.0) / width;
            a.min(b) - 0.25 * overlap * overlap * width
        };
        parts.iter().map(|part| part(p)).fold(f64::INFINITY, smooth_min)
    })
}

/// The wall of `thickness` around the surface of `body`.
pub(super) fn shell(body: Field, thickness: f64) -> Field {
    solid(move |p| body(p).abs() - 0.5 * thickness)
}

pub(super) fn moved(body: Field, to: DVec3) -> Field {
    solid(move |p| body(p - to))
}

/// Turned by `angle` around `axis` (unit length) through the origin.
pub(super) fn turned(body: Field, axis: DVec3, angle: f64) -> Field {
    let back = DQuat::from_axis_angle(axis, -angle);
    solid(move |p| body(back * p))
}

/// `count` copies of `body`, which lies about +x, around z. Copies are cut where they meet, and `body` is its own mirror
/// image in y, so the function is continuous.
pub(super) fn ring(body: Field, count: usize) -> Field {
    let sector = TAU / count as f64;
    solid(move |p| {
        let angle = p.y.atan2(p.x);
        let (sin, cos) = (angle - sector * (angle / sector).round()).sin_cos();
        let radius = p.x.hypot(p.y);
        body(DVec3::new(radius * cos, radius * sin, p.z))
    })
}

/// `2 · half + 1` copies of `body` on each axis, `step` apart; an axis with a step of 0 has one. The body is its own mirror
/// image on the axes of the copies.
pub(super) fn rows(body: Field, step: DVec3, half: [f64; 3]) -> Field {
    let half = DVec3::from(half);
    let inverse = DVec3::from(step.to_array().map(|step| if step > 0.0 { 1.0 / step } else { 0.0 }));
    solid(move |p| body(p - step * (p * inverse).round().clamp(-half, half)))
}

pub(super) fn ball(radius: f64) -> Field {
    solid(move |p| p.length() - radius)
}

/// The points with `p · normal < offset`; `normal` has unit length.
pub(super) fn half_space(normal: DVec3, offset: f64) -> Field {
    solid(move |p| p.dot(normal) - offset)
}

/// A block around the origin.
pub(super) fn block(x: f64, y: f64, z: f64) -> Field {
    let half = 0.5 * DVec3::new(x, y, z);
    solid(move |p| {
        let beyond = p.abs() - half;
        beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0)
    })
}

/// A cylinder along z with its caps.
pub(super) fn cylinder(radius: f64, length: f64) -> Field {
    solid(move |p| {
        let beyond = DVec2::new(p.x.hypot(p.y) - radius, p.z.abs() - 0.5 * length);
        beyond.max(DVec2::ZERO).length() + beyond.max_element().min(0.0)
    })
}

/// A rod with round ends, from `a` (radius `ra`) to `b` (radius `rb`), as the hull of many balls.
pub(super) fn limb(a: DVec3, b: DVec3, ra: f64, rb: f64) -> Field {
    let along = b - a;
    // The radius changes along the rod, so the slope is a little above 1.
    let slope = 1.0_f64.hypot((rb - ra) / along.length());
    solid(move |p| {
        let share = ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        ((p - a - share * along).length() - (ra + (rb - ra) * share)) / slope
    })
}

/// A torus around z.
pub(super) fn torus(ring: f64, tube: f64) -> Field {
    solid(move |p| (p.x.hypot(p.y) - ring).hypot(p.z) - tube)
}

/// A cone around z with its point at the origin that opens toward -z, `angle` between axis and side; without end.
pub(super) fn cone(angle: f64) -> Field {
    let (sin, cos) = angle.sin_cos();
    solid(move |p| cos * p.x.hypot(p.y) + sin * p.z)
}

/// A polygon in xy, as wide along z as `height`.
pub(super) fn prism(corners: Vec<DVec2>, height: f64) -> Field {
    solid(move |p| polygon(&corners, p.truncate()).max(p.z.abs() - 0.5 * height))
}

/// A polygon of (radius, z), turned around z. Sides on the axis are inside, and have no surface.
pub(super) fn lathe(corners: Vec<DVec2>) -> Field {
    solid(move |p| polygon(&corners, DVec2::new(p.x.hypot(p.y), p.z)))
}

/// Signed distance to a polygon, corners in any order of turn (I. Quilez).
fn polygon(corners: &[DVec2], p: DVec2) -> f64 {
    let (mut nearest, mut inside) = (f64::INFINITY, false);
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (side, to_p) = (b - a, p - a);
        let foot = to_p - side * (to_p.dot(side) / side.length_squared()).clamp(0.0, 1.0);
        nearest = nearest.min(foot.length_squared());
        if (a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x {
            inside = !inside;
        }
    }
    let distance = nearest.sqrt();
    if inside { -distance } else { distance }
}

/// A star with `count` points between two radii, or with one radius a polygon of `2 count` corners.
pub(super) fn star(count: usize, outer: f64, inner: f64) -> Vec<DVec2> {
    let corner = |i: usize| {
        let radius = if i.is_multiple_of(2) { outer } else { inner };
        radius * DVec2::from_angle(PI * i as f64 / count as f64)
    };
    (0..2 * count).map(corner).collect()
}

/// A disc of `root` radius with `count` teeth of trapezoids, up to `tip`; `width` of a tooth at the root, in shares of the
/// distance between teeth; `face` along z.
pub(super) fn gear(count: usize, root: f64, tip: f64, width: f64, face: f64) -> Field {
    let half = PI * root * width / count as f64;
    // Flanks lean by 20 degrees, the usual angle of pressure.
    let flank = DVec2::new(20_f64.to_radians().sin(), 20_f64.to_radians().cos());
    let tooth = solid(move |p| {
        let side = (p.x - root) * flank.x + (p.y.abs() - half) * flank.y;
        side.max(p.x - tip).max(-p.x)
    });
    let disc = solid(move |p| p.x.hypot(p.y) - root);
    both(
        union([disc, ring(tooth, count)]),
        solid(move |p| p.z.abs() - 0.5 * face),
    )
}

/// `count` thin blades around z between two radii and heights `-z ..= z`, `thickness` thick, turning by `twist` per height and
/// `sweep` per radius (radians). A `fan` of less than a whole turn has its blades evenly from its begin to its end.
#[derive(Clone, Copy)]
pub(super) struct Blades {
    pub count: usize,
    pub fan: f64,
    pub inner: f64,
    pub outer: f64,
    pub half_height: f64,
    pub thickness: f64,
    pub twist: f64,
    pub sweep: f64,
}

impl Blades {
    pub fn field(self) -> Field {
        let whole = self.fan >= TAU;
        let spaces = if whole { self.count } else { self.count - 1 };
        let step = self.fan / spaces as f64;
        let last = spaces as f64;
        // The slope of reach · sin(off) has (sin - reach · sweep · cos, cos, reach · twist · cos) along radius, angle and z.
        let (by_twist, by_sweep) = (self.outer * self.twist, self.outer * self.sweep);
        let slope = (1.0 + by_sweep + by_sweep * by_sweep + by_twist * by_twist).sqrt();
        solid(move |p| {
            let radius = p.x.hypot(p.y);
            let angle = p.y.atan2(p.x) - self.twist * p.z - self.sweep * radius;
            let turns = if whole {
                (angle / step).round()
            } else {
                // The seam of the angle is opposite to the middle of the fan.
                let middle = 0.5 * self.fan;
                let wrapped = angle - TAU * ((angle - middle) / TAU).round();
                (wrapped / step).round().clamp(0.0, last)
            };
            let off = angle - step * turns;
            let off = off - TAU * (off / TAU).round();
            // The distance to the half plane of the blade; beyond its end it need not grow with the radius.
            let reach = radius.min(self.outer);
            let to_plane = if off.abs() < FRAC_PI_2 {
                reach * off.abs().sin()
            } else {
                reach
            };
            let across = to_plane / slope - 0.5 * self.thickness;
            across
                .max(radius - self.outer)
                .max(self.inner - radius)
                .max(p.z.abs() - self.half_height)
        })
    }
}

/// A sheet rolled up along z: radius `start + pitch · turns`.
pub(super) fn spiral(start: f64, pitch: f64, turns: f64, thickness: f64, height: f64) -> Field {
    let (growth, inner) = (pitch / TAU, start - thickness);
    // The distance along the radius is longer than the shortest, most of all at the begin.
    let slope = 1.0_f64.hypot(growth / inner);
    let edges = [0.0, TAU * turns].map(|angle| (start + growth * angle) * DVec2::from_angle(angle));
    solid(move |p| {
        let (radius, angle) = (p.x.hypot(p.y), p.y.atan2(p.x).rem_euclid(TAU));
        let last_lap = (turns - angle / TAU).floor();
        let lap = ((radius - start - growth * angle) / pitch).round().clamp(0.0, last_lap);
        let along_radius = (radius - start - growth * (angle + TAU * lap)).abs();
        let to_edges = edges.map(|edge| edge.distance(p.truncate()));
        let distance = along_radius.min(to_edges[0]).min(to_edges[1]);
        let sheet = distance / slope - 0.5 * thickness;
        around_axis(sheet, radius, inner).max(p.z.abs() - 0.5 * height)
    })
}

/// A tube along a (p, q) torus knot around z: `p` turns around the axis, `q` around the ring.
pub(super) fn knot(p: usize, q: usize, ring: f64, coil: f64, tube: f64) -> Field {
    let (p_turns, q_turns) = (p as f64, q as f64);
    let inner = ring - coil - tube;
    let slope = 1.0_f64.hypot(coil * q_turns / (p_turns * inner));
    solid(move |point| {
        let (radius, angle) = (point.x.hypot(point.y), point.y.atan2(point.x));
        let here = DVec2::new(radius - ring, point.z);
        let distance = (0..p)
            .map(|strand| here.distance(coil * DVec2::from_angle((angle + TAU * strand as f64) * q_turns / p_turns)))
            .fold(f64::INFINITY, f64::min);
        around_axis((distance - tube) / slope, radius, inner)
    })
}

/// The value near the axis, where functions of the angle are steep: no more than the distance to the `inner` radius, within
/// which there is no surface.
fn around_axis(value: f64, radius: f64, inner: f64) -> f64 {
    if radius < inner {
        value.min(inner - radius)
    } else {
        value
    }
}

/// The wall of `thickness` about the gyroid (A. Schoen) with `cells` per length.
pub(super) fn gyroid(cells: f64, thickness: f64) -> Field {
    let pace = TAU * cells;
    solid(move |p| {
        let (p, half) = (pace * p, 0.5 * thickness * pace);
        let value = p.x.sin() * p.y.cos() + p.y.sin() * p.z.cos() + p.z.sin() * p.x.cos();
        // By Cauchy and Schwarz the squares of the three slopes sum to at most 3.
        (value.abs() - half) / (3.0_f64.sqrt() * pace)
    })
}

/// The side of Schwarz' P surface that is negative, with `cells` per length.
pub(super) fn schwarz_p(cells: f64) -> Field {
    let pace = TAU * cells;
    // Each of the three cosines has a slope of at most 1.
    solid(move |p| {
        let p = pace * p;
        (p.x.cos() + p.y.cos() + p.z.cos()) / (3.0_f64.sqrt() * pace)
    })
}

/// Round holes of `radius` through a shell, evenly in `count` directions; each is a cone from the origin.
pub(super) fn radial_holes(count: usize, angle: f64) -> Field {
    let directions: Vec<DVec3> = super::sphere(count).normals.iter().map(|d| d.as_dvec3()).collect();
    solid(move |p| {
        let unit = p.normalize_or(DVec3::Z);
        let nearest = directions.iter().map(|d| d.dot(unit)).fold(-1.0, f64::max);
        // A chord is shorter than the way over the sphere.
        p.length() * (nearest.min(1.0).acos().min(angle + 1.0) - angle).sin()
    })
}
