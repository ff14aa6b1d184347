//! The solids of the benchmark clouds: each about 2 wide, around the origin.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3, dvec2, dvec3};

use super::field::*;
use super::rays::Body;

const X: DVec3 = DVec3::X;
const Y: DVec3 = DVec3::Y;
const Z: DVec3 = DVec3::Z;

/// Corners from plain pairs.
fn corners<const N: usize>(pairs: [(f64, f64); N]) -> Vec<DVec2> {
    pairs.into_iter().map(DVec2::from).collect()
}

/// A tilt that no face, grid or view direction is parallel to.
fn tilted(body: Field) -> Field {
    turned(turned(body, X, 0.41), Z, 0.67)
}

// Sharp.

/// A gear with a bore, a keyway and lightening holes.
pub(super) fn gear_wheel(teeth: usize, holes: usize) -> Body {
    let wheel = gear(teeth, 0.85, 1.0, 0.55, 0.3);
    let hole = moved(cylinder(0.13, 1.0), 0.52 * X);
    let bore = union([
        cylinder(0.22, 1.0),
        moved(block(0.2, 0.1, 1.0), 0.2 * X),
        ring(hole, holes),
    ]);
    Body::closed(minus(wheel, bore), 1.1)
}

/// An angle bracket with slots, a rib and bolt holes.
pub(super) fn angle_bracket() -> Body {
    let plates = union([
        moved(block(1.6, 1.0, 0.16), dvec3(0.0, 0.0, -0.5)),
        moved(block(0.16, 1.0, 1.2), dvec3(-0.72, 0.0, 0.02)),
        prism_along_y(corners([(-0.65, -0.43), (0.3, -0.43), (-0.65, 0.45)]), 0.14),
    ]);
    let hole = |at: DVec3| moved(cylinder(0.11, 0.5), at);
    let slot = moved(block(0.4, 0.16, 0.5), dvec3(0.45, 0.0, -0.5));
    let across = moved(turned(cylinder(0.14, 0.5), Y, FRAC_PI_2), dvec3(-0.72, 0.28, 0.3));
    let holes = union([hole(dvec3(0.2, 0.3, -0.5)), hole(dvec3(0.2, -0.3, -0.5)), slot, across]);
    Body::closed(tilted(minus(plates, holes)), 1.3)
}

/// A polygon in xz, pulled along y.
fn prism_along_y(corners: Vec<DVec2>, width: f64) -> Field {
    // A turn by a right angle takes xy to xz; z of the prism becomes -y, and the prism is symmetric there.
    turned(prism(corners, width), X, FRAC_PI_2)
}

pub(super) fn polygon_prism(count: usize, height: f64) -> Body {
    // A star with the inner radius of the sides' middles is the polygon.
    let inner = 0.8 * (PI / count as f64).cos();
    Body::closed(tilted(prism(star(count, 0.8, inner), height)), 1.3)
}

pub(super) fn star_prism(count: usize, inner: f64, height: f64) -> Body {
    Body::closed(tilted(prism(star(count, 0.95, inner), height)), 1.2)
}

/// A wedge with a knife edge of this many degrees.
pub(super) fn wedge(degrees: f64) -> Body {
    let half = degrees.to_radians() / 2.0;
    let (sin, cos) = half.sin_cos();
    let upper = half_space(dvec3(-sin, 0.0, cos), sin);
    let lower = half_space(dvec3(-sin, 0.0, -cos), sin);
    let back = half_space(X, 0.8);
    // The edge lies at x = -1, where both planes meet.
    let sides = solid(|p| p.y.abs() - 0.7);
    Body::closed(tilted(both(both(upper, lower), both(back, sides))), 1.3)
}

/// A block with bores from three sides and a blind pocket.
pub(super) fn drilled_block() -> Body {
    let body = block(1.5, 1.1, 0.9);
    let bores = union([
        moved(cylinder(0.2, 2.0), dvec3(-0.4, 0.1, 0.0)),
        moved(turned(cylinder(0.13, 3.0), X, FRAC_PI_2), dvec3(0.25, 0.0, 0.1)),
        moved(turned(cylinder(0.1, 3.0), Y, FRAC_PI_2), dvec3(0.0, -0.35, -0.2)),
        moved(block(0.4, 0.5, 0.5), dvec3(0.45, 0.15, 0.4)),
        moved(cylinder(0.16, 0.5), dvec3(-0.45, -0.3, 0.4)),
    ]);
    Body::closed(tilted(minus(body, bores)), 1.1)
}

pub(super) fn octahedron() -> Body {
    let body = solid(|p: DVec3| (p.abs().element_sum() - 1.0) / 3.0_f64.sqrt());
    Body::closed(tilted(body), 1.1)
}

/// Two cones foot to foot, of 20 and 50 degrees.
pub(super) fn double_cone() -> Body {
    let sharp = moved(cone(20_f64.to_radians()), Z);
    let blunt = moved(turned(cone(50_f64.to_radians()), X, PI), dvec3(0.0, 0.0, -0.45));
    Body::closed(tilted(both(sharp, blunt)), 1.2)
}

/// A turned shaft with steps, a groove, a chamfer and a keyway.
pub(super) fn stepped_shaft() -> Body {
    let profile = corners([
        (0.0, -1.1),
        (0.2, -1.1),
        (0.25, -1.05),
        (0.25, -0.6),
        (0.42, -0.6),
        (0.42, -0.1),
        (0.34, -0.1),
        (0.34, 0.0),
        (0.42, 0.0),
        (0.42, 0.3),
        (0.3, 0.42),
        (0.3, 0.8),
        (0.16, 0.8),
        (0.16, 1.1),
        (0.0, 1.1),
    ]);
    let keyway = moved(block(0.2, 0.1, 0.35), dvec3(0.28, 0.0, -0.82));
    Body::closed(tilted(minus(lathe(profile), keyway)), 1.2)
}

/// A block whose edges are chamfered, on a foot, with a countersunk hole.
pub(super) fn chamfered_part() -> Body {
    let slanted = solid(|p: DVec3| {
        let p = p.abs();
        let edges = (p.x + p.y).max(p.y + p.z).max(p.z + p.x) - 1.05;
        edges / 2.0_f64.sqrt()
    });
    let top = both(block(1.2, 1.2, 0.9), slanted);
    let foot = moved(block(1.7, 0.8, 0.14), dvec3(0.0, 0.0, -0.4));
    let sink = union([
        cylinder(0.15, 2.0),
        moved(turned(cone(0.7), X, PI), dvec3(0.0, 0.0, 0.1)),
    ]);
    Body::closed(tilted(minus(union([top, foot]), sink)), 1.2)
}

// Close sheets.

/// Fanned pages on a round spine.
pub(super) fn book(pages: usize, fan: f64, spine: f64, thickness: f64) -> Body {
    let blades = Blades {
        count: pages,
        fan,
        inner: 0.5 * spine,
        outer: 1.0,
        half_height: 0.4,
        thickness,
        twist: 0.0,
        sweep: 0.0,
    };
    Body::closed(union([blades.field(), cylinder(spine, 0.86)]), 1.15)
}

/// Swept blades between a hub and, where `shroud`, a ring around.
pub(super) fn impeller(blades: usize, thickness: f64, twist: f64, sweep: f64, shroud: bool) -> Body {
    let sheets = Blades {
        count: blades,
        fan: TAU,
        inner: 0.15,
        outer: 0.95,
        half_height: 0.3,
        thickness,
        twist,
        sweep,
    };
    let hub = lathe(corners([(0.0, -0.32), (0.34, -0.32), (0.22, 0.38), (0.0, 0.38)]));
    let mut parts = vec![sheets.field(), hub];
    if shroud {
        let outer = cylinder(1.0, 0.5);
        parts.push(minus(outer, cylinder(0.93, 2.0)));
    }
    Body::closed(tilted(union_of(parts)), 1.15)
}

/// A base plate with fins.
pub(super) fn heat_sink(half: usize, step: f64, thickness: f64) -> Body {
    let fin = block(thickness, 1.2, 0.9);
    let fins = rows(fin, step * X, [half as f64, 0.0, 0.0]);
    let width = step * 2.0 * half as f64 + thickness + 0.04;
    let base = moved(block(width, 1.24, 0.16), dvec3(0.0, 0.0, -0.45));
    Body::closed(tilted(union([fins, base])), 1.4)
}

/// Separate plates one above the other, with gaps that grow from below to above.
pub(super) fn plate_stack(gaps: [f64; 5], thickness: f64) -> Body {
    let mut height = -0.2;
    let mut plates = vec![moved(block(1.4, 1.0, thickness), height * Z)];
    for gap in gaps {
        height += gap + thickness;
        plates.push(moved(block(1.4, 1.0, thickness), height * Z));
    }
    Body::closed(tilted(union_of(plates)), 1.2)
}

/// Tubes inside each other, each a body of its own.
pub(super) fn nested_tubes(radii: [f64; 4], wall: f64) -> Body {
    let tube = |radius: f64| minus(cylinder(radius, 1.3), cylinder(radius - wall, 3.0));
    Body::closed(tilted(union_of(radii.map(tube).into())), 1.2)
}

/// Hollow balls inside each other.
pub(super) fn nested_shells(radii: [f64; 3], wall: f64) -> Body {
    // Walls with a hole, or no view from outside could tell the inner ones.
    let hole = moved(turned(cylinder(0.3, 2.0), X, 0.3), dvec3(0.1, 0.2, 1.0));
    let shells = radii.map(|radius| shell(ball(radius), wall));
    Body::closed(minus(union_of(shells.into()), hole), 1.1)
}

pub(super) fn rolled_sheet(pitch: f64, turns: f64, thickness: f64) -> Body {
    Body::closed(tilted(spiral(0.25, pitch, turns, thickness, 1.0)), 1.2)
}

/// Plates through each other.
pub(super) fn crossing_plates(count: usize, thickness: f64) -> Body {
    let plate = |i: usize| {
        let turn = turned(block(1.7, 1.2, thickness), X, PI * i as f64 / count as f64 + 0.2);
        turned(turn, Z, 0.35 * i as f64)
    };
    Body::closed(union_of((0..count).map(plate).collect()), 1.2)
}

/// A thin mug with a handle.
pub(super) fn mug(wall: f64) -> Body {
    let (r, w) = (0.6, wall);
    let cup = lathe(corners([
        (0.0, -0.7),
        (r - 0.1, -0.7),
        (r, -0.6),
        (r + 0.05, 0.7),
        (r + 0.05 - w, 0.7),
        (r - w, -0.6),
        (r - 0.1 - 0.5 * w, -0.7 + w),
        (0.0, -0.7 + w),
    ]));
    let handle = moved(turned(torus(0.34, 0.06), X, FRAC_PI_2), dvec3(0.66, 0.0, 0.0));
    let inside = cylinder(r - 0.5 * w, 4.0);
    Body::closed(tilted(union([cup, minus(handle, inside)])), 1.25)
}

/// A stem with curved leaves: thin caps of balls.
pub(super) fn plant(leaves: usize, thickness: f64) -> Body {
    let mut parts = vec![limb(-1.0 * Z, 0.8 * Z, 0.06, 0.03)];
    for i in 0..leaves {
        let curved = moved(shell(ball(0.9), thickness), -0.9 * Z);
        let outline = solid(|p: DVec3| {
            let q = dvec2(p.x - 0.4, 2.2 * p.y);
            (q.length() - 0.42) / 2.2
        });
        let leaf = both(both(curved, outline), half_space(-Z, 0.5));
        let turn = turned(turned(leaf, Y, 0.3), Z, 2.4 * i as f64);
        parts.push(moved(turn, (1.5 * i as f64 / leaves as f64 - 0.75) * Z));
    }
    Body::closed(union_of(parts), 1.2)
}

/// Two gears in mesh that don't quite touch.
pub(super) fn gear_pair(teeth: usize) -> Body {
    let wheel = || minus(gear(teeth, 0.4, 0.5, 0.44, 0.24), cylinder(0.12, 1.0));
    let half_tooth = PI / teeth as f64;
    let left = moved(wheel(), -0.46 * X);
    // With an odd count a gap faces the tooth by itself.
    let turn = if teeth.is_multiple_of(2) { half_tooth } else { 0.0 };
    let right = moved(turned(wheel(), Z, turn), 0.46 * X);
    Body::closed(tilted(union([left, right])), 1.05)
}

// High genus.

/// Bars along the edges of cubes.
pub(super) fn frame(cells: usize, bar: f64) -> Body {
    let (half, step) = (cells as f64 / 2.0, 1.3 / cells as f64);
    // Bars cross at whole or half steps around the origin; their rows are moved to fit.
    let shift = if cells.is_multiple_of(2) { 0.0 } else { 0.5 * step };
    let bars = |length: DVec3, directions: DVec3| {
        let bar = block(length.x, length.y, length.z);
        moved(rows(bar, step * directions, [half.ceil(); 3]), shift * directions)
    };
    let long = 1.3 + bar;
    let all = union([
        bars(dvec3(long, bar, bar), dvec3(0.0, 1.0, 1.0)),
        bars(dvec3(bar, long, bar), dvec3(1.0, 0.0, 1.0)),
        bars(dvec3(bar, bar, long), dvec3(1.0, 1.0, 0.0)),
    ]);
    // An odd number of cells has an even number of bars: those beyond one end are cut off.
    let hull = block(long, long, long);
    Body::closed(tilted(both(all, hull)), 1.3)
}

/// Balls in a cubic lattice, joined by rods.
pub(super) fn ball_lattice() -> Body {
    let step = 0.5;
    let node = rows(ball(0.13), DVec3::splat(step), [1.0; 3]);
    let rods = |axis: DVec3, across: DVec3| {
        let rod = limb(-step * axis, step * axis, 0.055, 0.055);
        rows(rod, step * across, [1.0; 3])
    };
    let rods = union([rods(X, Y + Z), rods(Y, Z + X), rods(Z, X + Y)]);
    Body::closed(tilted(union([node, rods])), 1.2)
}

/// A plate with rows of round holes; odd numbers of them.
pub(super) fn perforated_plate(half: [f64; 2], step: f64, hole: f64, thickness: f64) -> Body {
    let holes = rows(cylinder(hole, 2.0), dvec3(step, step, 0.0), [half[0], half[1], 0.0]);
    let (x, y) = ((2.0 * half[0] + 1.2) * step, (2.0 * half[1] + 1.2) * step);
    Body::closed(tilted(minus(block(x, y, thickness), holes)), 1.3)
}

pub(super) fn perforated_shell(holes: usize, angle: f64, wall: f64) -> Body {
    let wall = shell(ball(0.9), wall);
    Body::closed(minus(wall, radial_holes(holes, angle)), 1.05)
}

pub(super) fn gyroid_slab() -> Body {
    Body::closed(tilted(both(gyroid(1.4, 0.16), block(1.6, 1.2, 0.8))), 1.2)
}

pub(super) fn schwarz_ball() -> Body {
    Body::closed(both(schwarz_p(1.2), ball(0.95)), 1.05)
}

pub(super) fn torus_knot(p: usize, q: usize, tube: f64) -> Body {
    Body::closed(tilted(knot(p, q, 0.66, 0.26, tube)), 1.15)
}

/// Rings, each through the next.
pub(super) fn chain(links: usize) -> Body {
    let link = |i: usize| {
        let ring = turned(torus(0.27, 0.06), X, FRAC_PI_2 * (i % 2) as f64 + 0.3);
        moved(ring, (i as f64 - 0.5 * (links - 1) as f64) * 0.36 * X)
    };
    Body::closed(union_of((0..links).map(link).collect()), 0.18 * links as f64 + 0.2)
}

/// Three rings, each through both others.
pub(super) fn linked_rings() -> Body {
    let ring = |i: usize| {
        let tilt = turned(torus(0.6, 0.08), X, 0.9);
        turned(moved(tilt, 0.28 * X), Z, TAU * i as f64 / 3.0)
    };
    Body::closed(union_of((0..3).map(ring).collect()), 1.1)
}

/// A tower of floors on columns.
pub(super) fn storeys() -> Body {
    let floors = rows(block(1.1, 1.1, 0.06), 0.4 * Z, [0.0, 0.0, 2.0]);
    let columns = rows(block(0.08, 0.08, 1.6), dvec3(0.32, 0.32, 0.0), [1.0, 1.0, 0.0]);
    Body::closed(tilted(union([floors, columns])), 1.25)
}

// Smooth.

/// A standing person of limbs with fillets.
pub(super) fn figure() -> Body {
    let both_sides = |x: f64| {
        [
            limb(dvec3(0.12 * x, 0.0, -0.1), dvec3(0.22 * x, 0.03, -0.95), 0.13, 0.07),
            limb(dvec3(0.22 * x, 0.0, -0.95), dvec3(0.25 * x, 0.2, -1.0), 0.07, 0.05),
            limb(dvec3(0.2 * x, 0.0, 0.5), dvec3(0.5 * x, 0.05, 0.15), 0.08, 0.065),
            limb(dvec3(0.5 * x, 0.05, 0.15), dvec3(0.52 * x, 0.32, 0.3), 0.065, 0.05),
        ]
    };
    let mut parts = vec![
        limb(dvec3(0.0, 0.0, -0.05), dvec3(0.0, 0.0, 0.5), 0.19, 0.2),
        moved(ball(0.16), dvec3(0.0, 0.03, 0.86)),
        limb(dvec3(0.0, 0.0, 0.5), dvec3(0.0, 0.02, 0.8), 0.09, 0.08),
    ];
    parts.extend(both_sides(-1.0));
    parts.extend(both_sides(1.0));
    Body::closed(blend(parts, 0.08), 1.25)
}

/// An animal on four legs, with ears and tail.
pub(super) fn animal() -> Body {
    let mut parts = vec![
        limb(dvec3(-0.5, 0.0, 0.1), dvec3(0.45, 0.0, 0.12), 0.27, 0.24),
        limb(dvec3(0.5, 0.0, 0.2), dvec3(0.75, 0.0, 0.65), 0.15, 0.12),
        limb(dvec3(0.75, 0.0, 0.65), dvec3(1.02, 0.0, 0.55), 0.14, 0.08),
        limb(dvec3(-0.7, 0.0, 0.2), dvec3(-1.02, 0.0, -0.15), 0.06, 0.035),
    ];
    for y in [-1.0, 1.0] {
        parts.push(limb(dvec3(0.45, 0.14 * y, 0.0), dvec3(0.5, 0.16 * y, -0.7), 0.11, 0.06));
        parts.push(limb(
            dvec3(-0.5, 0.15 * y, 0.0),
            dvec3(-0.55, 0.17 * y, -0.7),
            0.13,
            0.06,
        ));
        parts.push(limb(
            dvec3(0.7, 0.07 * y, 0.75),
            dvec3(0.64, 0.14 * y, 0.95),
            0.05,
            0.025,
        ));
    }
    Body::closed(blend(parts, 0.1), 1.25)
}

pub(super) fn ring_torus() -> Body {
    Body::closed(tilted(torus(0.75, 0.28)), 1.1)
}

// Open.

/// `body` without its points in `count` balls around it: round holes.
pub(super) fn with_holes(body: Body, count: usize, size: f64) -> Body {
    let field = body.field.clone();
    // Where a ray from outside first meets the body: on its surface, and in sight.
    let directions = super::sphere(count).normals;
    let holes = directions.iter().filter_map(|direction| {
        let direction = direction.as_dvec3();
        let mut place = None;
        super::rays::trace(&body, body.radius * direction, -direction, body.radius, |along| {
            place = Some((body.radius - along) * direction);
            false
        });
        place.map(|place| moved(ball(size), place))
    });
    Body::open(field, outside(union_of(holes.collect())), body.radius)
}

pub(super) fn half_sphere() -> Body {
    Body::open(ball(1.0), half_space(turned_z(0.5), 0.0), 1.1)
}

/// +z, leaning by `angle`.
fn turned_z(angle: f64) -> DVec3 {
    dvec3(angle.sin(), 0.0, angle.cos())
}

/// The inner side of a deep bowl alone: a single sheet.
pub(super) fn bowl() -> Body {
    let dent = solid(|p: DVec3| ((p / dvec3(1.0, 0.85, 0.7)).length() - 1.0) * 0.7);
    Body::open(outside(dent), half_space(Z, 0.15), 1.2)
}

/// A face-like relief on the front of an ellipsoid.
pub(super) fn mask() -> Body {
    let features = vec![
        solid(|p: DVec3| ((p / dvec3(0.75, 0.95, 0.6)).length() - 1.0) * 0.6),
        limb(dvec3(0.0, 0.25, 0.55), dvec3(0.0, -0.1, 0.68), 0.05, 0.1),
        limb(dvec3(-0.2, -0.4, 0.47), dvec3(0.2, -0.4, 0.47), 0.07, 0.07),
        limb(dvec3(-0.35, 0.35, 0.42), dvec3(-0.1, 0.35, 0.52), 0.08, 0.06),
        limb(dvec3(0.35, 0.35, 0.42), dvec3(0.1, 0.35, 0.52), 0.08, 0.06),
    ];
    let eye = |x: f64| moved(ball(0.1), dvec3(x, 0.2, 0.52));
    let holes = union([eye(-0.26), eye(0.26)]);
    let front = half_space(-Z, -0.05);
    Body::open(blend(features, 0.08), both(front, outside(holes)), 1.2)
}

/// Hills over a square.
pub(super) fn hills() -> Body {
    let land = solid(|p: DVec3| {
        let height = 0.16 * (4.1 * p.x + 0.7).sin() * (3.3 * p.y).cos() + 0.08 * (9.0 * p.x - 5.0 * p.y).sin();
        // Slopes: 0.16 × 4.1 + 0.08 × 9 along x, 0.16 × 3.3 + 0.08 × 5 along y.
        (p.z - height) / 1.96
    });
    Body::open(land, solid(|p: DVec3| p.x.abs().max(p.y.abs()) - 0.85), 1.3)
}

/// A pipe without caps.
pub(super) fn open_pipe() -> Body {
    let pipe = solid(|p: DVec3| p.x.hypot(p.y) - 0.4);
    Body::open(tilted(pipe), tilted(solid(|p: DVec3| p.z.abs() - 0.9)), 1.1)
}

/// A strip of a saddle.
pub(super) fn saddle() -> Body {
    let land = solid(|p: DVec3| (p.z - 0.5 * (p.x * p.x - p.y * p.y)) / 1.7);
    Body::open(land, solid(|p: DVec3| p.x.hypot(p.y) - 0.95), 1.2)
}

/// A drilled block without its bottom.
pub(super) fn bottomless() -> Body {
    let body = block(1.4, 1.0, 0.9);
    let bore = moved(cylinder(0.25, 3.0), 0.3 * X);
    Body::open(minus(body, bore), half_space(-Z, 0.449), 1.1)
}

// Rooms: the solid is all but the air, so that truth faces the air.

/// A room with a table, chairs, a cupboard and a lamp.
pub(super) fn office() -> Body {
    let table = union([
        moved(block(0.8, 0.45, 0.03), dvec3(0.25, 0.1, -0.16)),
        moved(
            rows(block(0.04, 0.04, 0.26), dvec3(0.36, 0.19, 0.0), [1.0, 1.0, 0.0]),
            dvec3(0.25, 0.1, -0.29),
        ),
    ]);
    let chair = |at: DVec3, turn: f64| {
        let parts = union([
            block(0.2, 0.2, 0.02),
            moved(block(0.02, 0.2, 0.25), dvec3(-0.09, 0.0, 0.12)),
            moved(
                rows(block(0.02, 0.02, 0.18), dvec3(0.085, 0.085, 0.0), [1.0, 1.0, 0.0]),
                dvec3(0.0, 0.0, -0.09),
            ),
        ]);
        moved(turned(parts, Z, turn), at + dvec3(0.0, 0.0, -0.23))
    };
    let cupboard = moved(block(0.25, 0.6, 0.6), dvec3(-0.86, 0.35, -0.11));
    let lamp = moved(ball(0.09), dvec3(0.3, 0.1, 0.22));
    room(
        dvec3(2.0, 1.4, 0.84),
        vec![
            table,
            chair(dvec3(0.15, -0.32, 0.0), 1.7),
            chair(dvec3(0.5, 0.48, 0.0), -1.2),
            cupboard,
            lamp,
        ],
    )
}

/// A hall with columns and a flight of steps.
pub(super) fn hall() -> Body {
    let columns = rows(cylinder(0.08, 1.2), dvec3(0.6, 0.7, 0.0), [1.0, 0.0, 0.0]);
    let step = |i: usize| {
        let height = 0.1 * (i + 1) as f64;
        moved(
            block(0.15, 0.6, height),
            dvec3(0.62 + 0.15 * i as f64, 0.4, 0.5 * height - 0.5),
        )
    };
    let mut parts: Vec<Field> = (0..4).map(step).collect();
    parts.push(moved(columns, -0.25 * Y));
    parts.push(moved(block(0.5, 0.35, 0.3), dvec3(-0.7, 0.45, -0.35)));
    room(dvec3(2.3, 1.5, 1.0), parts)
}

fn room(size: DVec3, mut parts: Vec<Field>) -> Body {
    parts.push(outside(block(size.x, size.y, size.z)));
    Body::closed(union_of(parts), 0.5 * size.length() + 0.1)
}
