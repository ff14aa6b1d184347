//! Convex hulls in space: quickhull (Barber, Dobkin and Huhdanpaa, 1996) on exact predicates.
//!
//! Every decision is the exact sign of a determinant: a floating-point filter decides nearly all, Shewchuk's adaptive
//! arithmetic the rest. So lattices, planes and points in one place need no tolerances, and the hull is always closed.
//! parry3d-f64 and chull gave the same hulls but took 10 s and minutes at a million points, half of them vertices.
//!
//! Invariants: facets are triangles, counterclockwise from outside; no point is strictly outside any of them.

use glam::DVec3;
use robust::{Coord3D, orient3d};

/// No facet, no point.
const NONE: u32 = u32::MAX;

/// A triangle of a hull.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Point ids, counterclockwise from outside.
    pub vertices: [u32; 3],
    /// `neighbors[i]` is across the edge from `vertices[i]` to the next one.
    pub neighbors: [u32; 3],
    /// Outward, of twice the area's length.
    pub normal: DVec3,
    /// `normal · x` of its points.
    pub offset: f64,
    /// Within this of `offset` rounding may decide, so the exact predicate does.
    pub doubt: f64,
    /// First of the points outside that are the facet's to care for; they are a linked list.
    outside: u32,
    /// The farthest of them, and how far it is in lengths of `normal`.
    apex: u32,
    apex_height: f64,
    /// The last search for facets seen by a point that saw this one.
    seen_in: u32,
    is_alive: bool,
}

/// A hull that grows.
struct Hull<'a> {
    points: &'a [DVec3],
    facets: Vec<Facet>,
    free: Vec<u32>,
    /// The next point of the same list, by point.
    next: Vec<u32>,
    /// Largest coordinate, to know how much rounding can do.
    largest: f64,
    search: u32,
}

/// The facets of the convex hull of `points`, in one closed surface; `None` when all points are in one plane.
///
/// A point that is on the surface of the hull but no corner may or may not be a vertex; of points in one place one is.
/// O(n log n) time for points whose hull is as complex as they are; faster the nearer neighbors are in memory.
pub(super) fn convex_hull(points: &[DVec3]) -> Option<Vec<Facet>> {
    let corners = first_corners(points)?;
    let largest = points
        .iter()
        .fold(0.0, |largest: f64, point| largest.max(point.abs().max_element()));
    let mut hull = Hull {
        points,
        facets: Vec::new(),
        free: Vec::new(),
        next: vec![NONE; points.len()],
        largest,
        search: 0,
    };
    hull.start(corners);
    hull.grow();
    Some(hull.into_facets())
}

/// Four points that span space, the first three counterclockwise seen from outside, where the fourth is not.
fn first_corners(points: &[DVec3]) -> Option<[u32; 4]> {
    let farthest = |measure: &dyn Fn(DVec3) -> f64| -> Option<u32> {
        let best = points
            .iter()
            .map(|&point| measure(point))
            .enumerate()
            .reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        Some(best.0 as u32)
    };
    let at = |id: u32| points[id as usize];
    let a = farthest(&|point| -point.x)?;
    let b = farthest(&|point| point.distance_squared(at(a)))?;
    let along = at(b) - at(a);
    let c = farthest(&|point| (point - at(a)).cross(along).length_squared())?;
    let normal = (at(c) - at(a)).cross(along);
    let d = farthest(&|point| (point - at(a)).dot(normal).abs())?;
    match volume(at(a), at(b), at(c), at(d)) {
        volume if volume > 0.0 => Some([a, b, c, d]),
        volume if volume < 0.0 => Some([a, c, b, d]),
        // Rounding may have hidden a point next to the plane.
        _ => (0..points.len() as u32).find_map(|d| match volume(at(a), at(b), at(c), at(d)) {
            volume if volume > 0.0 => Some([a, b, c, d]),
            volume if volume < 0.0 => Some([a, c, b, d]),
            _ => None,
        }),
    }
}

/// Positive when `p` is below the plane of a, b, c, which are counterclockwise seen from above; the sign is exact.
fn volume(a: DVec3, b: DVec3, c: DVec3, p: DVec3) -> f64 {
    let coord = |point: DVec3| Coord3D {
        x: point.x,
        y: point.y,
        z: point.z,
    };
    orient3d(coord(a), coord(b), coord(c), coord(p))
}

impl Hull<'_> {
    fn at(&self, point: u32) -> DVec3 {
        self.points[point as usize]
    }

    /// The tetrahedron of the first corners, with every point outside it in a list.
    fn start(&mut self, [a, b, c, d]: [u32; 4]) {
        let tetrahedron = [[a, b, c], [a, d, b], [b, d, c], [c, d, a]];
        let facets = tetrahedron.map(|vertices| self.add_facet(vertices));
        let neighbors = [[1, 2, 3], [3, 2, 0], [1, 3, 0], [2, 1, 0]];
        for (facet, neighbors) in facets.into_iter().zip(neighbors) {
            self.facets[facet as usize].neighbors = neighbors.map(|index: usize| facets[index]);
        }
        for point in 0..self.points.len() as u32 {
            if ![a, b, c, d].contains(&point) {
                self.assign(point, &facets);
            }
        }
    }

    fn add_facet(&mut self, vertices: [u32; 3]) -> u32 {
        let [a, b, c] = vertices.map(|vertex| self.at(vertex));
        let (first, second) = (b - a, c - a);
        let normal = first.cross(second);
        // Each product and sum of `normal · x − offset` errs by half an ulp at most; sixteen leaves room to spare.
        let doubt = 16.0 * f64::EPSILON * first.length() * second.length() * 3.0 * self.largest;
        let facet = Facet {
            vertices,
            neighbors: [NONE; 3],
            normal,
            offset: normal.dot(a),
            doubt,
            outside: NONE,
            apex: NONE,
            apex_height: 0.0,
            seen_in: 0,
            is_alive: true,
        };
        if let Some(index) = self.free.pop() {
            self.facets[index as usize] = facet;
            index
        } else {
            self.facets.push(facet);
            self.facets.len() as u32 - 1
        }
    }

    /// How far `point` is above `facet` in lengths of its normal, when it is strictly above.
    #[inline]
    fn height_above(&self, facet: &Facet, point: u32) -> Option<f64> {
        let position = self.at(point);
        let height = facet.normal.dot(position) - facet.offset;
        if height.abs() > facet.doubt {
            return (height > 0.0).then_some(height);
        }
        let [a, b, c] = facet.vertices.map(|vertex| self.at(vertex));
        (volume(a, b, c, position) < 0.0).then_some(height.max(0.0))
    }

    /// Gives `point` to the first of `facets` that it is outside of, if any.
    fn assign(&mut self, point: u32, facets: &[u32]) {
        for &index in facets {
            if let Some(height) = self.height_above(&self.facets[index as usize], point) {
                let facet = &mut self.facets[index as usize];
                self.next[point as usize] = facet.outside;
                facet.outside = point;
                // In a list that has an apex of height 0 the smaller id stays, as in every tie.
                if facet.apex == NONE
                    || height > facet.apex_height
                    || (height == facet.apex_height && point < facet.apex)
                {
                    facet.apex = point;
                    facet.apex_height = height;
                }
                return;
            }
        }
    }

    /// Adds the farthest point outside some facet until no point is outside.
    fn grow(&mut self) {
        let mut waiting: Vec<u32> = (0..self.facets.len() as u32).collect();
        let mut seen = Vec::new();
        let mut horizon = Vec::new();
        let mut added = Vec::new();
        // The new facet whose outer edge starts at a vertex; only entries of the present horizon are read.
        let mut from_vertex = vec![NONE; self.points.len()];
        while let Some(index) = waiting.pop() {
            let facet = &self.facets[index as usize];
            // A facet's place may hold another facet by now: that one waits as well.
            if !facet.is_alive || facet.apex == NONE {
                continue;
            }
            let apex = facet.apex;
            self.look(index, apex, &mut seen, &mut horizon);
            added.clear();
            for &(outer, edge) in &horizon {
                let vertices = self.facets[outer as usize].vertices;
                // The outer facet has this edge the other way around.
                let (to, from) = (vertices[edge], vertices[(edge + 1) % 3]);
                let new = self.add_facet([from, to, apex]);
                self.facets[new as usize].neighbors[0] = outer;
                self.facets[outer as usize].neighbors[edge] = new;
                from_vertex[from as usize] = new;
                added.push(new);
            }
            for &new in &added {
                let to = self.facets[new as usize].vertices[1];
                let following = from_vertex[to as usize];
                self.facets[new as usize].neighbors[1] = following;
                self.facets[following as usize].neighbors[2] = new;
            }
            for &old in &seen {
                let mut point = self.facets[old as usize].outside;
                while point != NONE {
                    let next = self.next[point as usize];
                    if point != apex {
                        self.assign(point, &added);
                    }
                    point = next;
                }
            }
            self.free.extend(&seen);
            waiting.extend(&added);
        }
    }

    /// Finds all facets that see `apex`, starting at one of them, and the edges around them, as the facet outside and its
    /// edge. The facets seen die.
    ///
    /// With exact signs they are one disk, so its rim is one loop.
    fn look(&mut self, start: u32, apex: u32, seen: &mut Vec<u32>, horizon: &mut Vec<(u32, usize)>) {
        seen.clear();
        horizon.clear();
        self.search += 1;
        seen.push(start);
        self.facets[start as usize].seen_in = self.search;
        let mut next = 0;
        while next < seen.len() {
            let index = seen[next];
            next += 1;
            self.facets[index as usize].is_alive = false;
            for neighbor in self.facets[index as usize].neighbors {
                let facet = &self.facets[neighbor as usize];
                if facet.seen_in == self.search {
                    continue;
                }
                if self.height_above(facet, apex).is_some() {
                    self.facets[neighbor as usize].seen_in = self.search;
                    seen.push(neighbor);
                } else if let Some(edge) = facet.neighbors.iter().position(|&other| other == index) {
                    horizon.push((neighbor, edge));
                }
            }
        }
    }

    /// The facets alive, without gaps between them.
    fn into_facets(self) -> Vec<Facet> {
        let mut places = vec![NONE; self.facets.len()];
        let alive = |facet: &&Facet| facet.is_alive;
        let mut n_alive = 0;
        for (place, facet) in places.iter_mut().zip(&self.facets) {
            if facet.is_alive {
                *place = n_alive;
                n_alive += 1;
            }
        }
        let mut facets: Vec<Facet> = self.facets.iter().filter(alive).copied().collect();
        for facet in &mut facets {
            facet.neighbors = facet.neighbors.map(|neighbor| places[neighbor as usize]);
        }
        facets
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    /// Closed, counterclockwise, and exactly without a point outside; every strict corner is a vertex.
    fn check(points: &[DVec3]) {
        let Some(facets) = convex_hull(points) else {
            let mut places: Vec<DVec3> = Vec::new();
            for &point in points {
                if !places.contains(&point) {
                    places.push(point);
                }
            }
            for (i, &a) in places.iter().enumerate() {
                for (j, &b) in places[..i].iter().enumerate() {
                    for (k, &c) in places[..j].iter().enumerate() {
                        let is_flat = places[..k].iter().all(|&d| volume(a, b, c, d) == 0.0);
                        assert!(is_flat, "a hull was missed");
                    }
                }
            }
            return;
        };
        for (index, facet) in facets.iter().enumerate() {
            let [a, b, c] = facet.vertices.map(|vertex| points[vertex as usize]);
            for &point in points {
                assert!(volume(a, b, c, point) >= 0.0, "{point} is outside");
            }
            for edge in 0..3 {
                let neighbor = &facets[facet.neighbors[edge] as usize];
                let back = neighbor.neighbors.iter().position(|&other| other as usize == index);
                // Two facets can share two edges only around one that has no area, which exact signs exclude.
                let back = back.expect("neighbors are mutual");
                assert_eq!(facet.vertices[edge], neighbor.vertices[(back + 1) % 3]);
                assert_eq!(facet.vertices[(edge + 1) % 3], neighbor.vertices[back]);
            }
        }
        let vertices: BTreeSet<u32> = facets.iter().flat_map(|facet| facet.vertices).collect();
        // Euler's formula of a sphere.
        assert_eq!(facets.len() + 4, 2 * vertices.len());
        for (id, &point) in points.iter().enumerate() {
            let is_vertex = vertices.iter().any(|&vertex| points[vertex as usize] == point);
            let on_surface = facets.iter().any(|facet| {
                let [a, b, c] = facet.vertices.map(|vertex| points[vertex as usize]);
                volume(a, b, c, point) == 0.0
            });
            // A corner that is no vertex would be strictly outside; one that is none may still be on the surface.
            assert!(
                is_vertex || !on_surface || !is_corner(points, id),
                "corner {id} is missing"
            );
        }
    }

    /// Whether some direction of a fine set has this point alone as the farthest one.
    fn is_corner(points: &[DVec3], id: usize) -> bool {
        let shape = crate::shapes::sphere(500);
        shape.normals.iter().any(|direction| {
            let reach = direction.as_dvec3().dot(points[id]);
            let others = points.iter().filter(|&&other| other != points[id]);
            others
                .into_iter()
                .all(|other| direction.as_dvec3().dot(*other) < reach - 1e-9)
        })
    }

    fn scaled_lattice(side: i32) -> impl Strategy<Value = Vec<DVec3>> {
        let coordinate = 0..side;
        let point = (coordinate.clone(), coordinate.clone(), coordinate);
        let points = prop::collection::vec(point, 0..60);
        // A step that binary fractions cannot hold, far from 0: planes of the lattice are only nearly planes.
        (points, prop::sample::select(vec![1.0, 0.1, 1e-7])).prop_map(|(points, step)| {
            let place = |(x, y, z): (i32, i32, i32)| DVec3::new(x.into(), y.into(), z.into()) * step + 1000.0 * step;
            points.into_iter().map(place).collect()
        })
    }

    proptest! {
        #[test]
        fn random_points(points in prop::collection::vec((-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(DVec3::from), 0..60)) {
            check(&points);
        }

        #[test]
        fn lattices(points in scaled_lattice(4)) {
            check(&points);
        }

        #[test]
        fn flat_lattices(points in scaled_lattice(2), tilt in -2..2_i32) {
            let points: Vec<DVec3> = points.iter().map(|p| DVec3::new(p.x, p.y, p.x * f64::from(tilt))).collect();
            check(&points);
        }

        #[test]
        fn on_a_sphere(n_points in 4_usize..60, scale in 1e-12..1e12_f64) {
            let shape = crate::shapes::sphere(n_points);
            let points: Vec<DVec3> = shape.positions.iter().map(|p| p.as_dvec3() * scale).collect();
            check(&points);
            let facets = convex_hull(&points).unwrap();
            let vertices: BTreeSet<u32> = facets.iter().flat_map(|facet| facet.vertices).collect();
            prop_assert_eq!(vertices.len(), n_points);
        }
    }

    #[test]
    fn nothing_to_enclose() {
        check(&[]);
        check(&[DVec3::ONE; 9]);
        check(&(0..9).map(|i| DVec3::ONE * f64::from(i)).collect::<Vec<_>>());
        check(
            &(0..9)
                .map(|i| DVec3::new(f64::from(i), f64::from(i * i), 3.0))
                .collect::<Vec<_>>(),
        );
    }

    #[test]
    fn a_box_of_lattice_points_has_eight_corners() {
        let points: Vec<DVec3> = (0..1000)
            .map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 0.1)
            .collect();
        check(&points);
    }
}
