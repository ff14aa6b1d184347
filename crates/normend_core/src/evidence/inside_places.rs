//! Places within a cloud to look around from: the empty middles of rooms.

use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;

use super::frame::Frame;
use crate::PointCloud;

/// Cells along the longest side of the cloud. A room of 10 m has cells of 30 cm, about as narrow as passages get.
const CELLS: f32 = 32.0;

/// Most places: a floor of several rooms, each of which has some corners.
const MAX_PLACES: usize = 16;

/// Share of the points left out at each end of an axis, so that what is seen through a window does not set the size of cells.
const OUTLIERS: f32 = 0.01;

/// Of the 26 directions to its neighbors, those in which a cell within a room meets a wall. Nine of the others may look up, as
/// ceilings are often missing.
const LEAST_WALLS: usize = 16;

/// Cells between a place and the nearest points, at least: from nearer, a panorama sees little else.
const LEAST_CLEARANCE: u16 = 2;

/// Finds up to 16 places within `cloud`, in the file's coordinates: the emptiest first, each later one out of sight of those
/// before. None where nothing is enclosed.
///
/// A place is the middle of an empty cell that has points in most directions around. Cells are aligned with the cloud's
/// principal axes, 32 along the longest. O(n) time and 4 bytes a point besides the cells.
pub fn inside_places(cloud: &PointCloud) -> Vec<DVec3> {
    let Some(grid) = Grid::new(cloud) else {
        return Vec::new();
    };
    let clearance = grid.clearance();
    let mut candidates: Vec<usize> = (0..grid.occupied.len())
        .filter(|&cell| clearance[cell] >= LEAST_CLEARANCE && grid.n_walls(cell) >= LEAST_WALLS)
        .collect();
    // The sort keeps cells of equal clearance in order.
    candidates.sort_by_key(|&cell| std::cmp::Reverse(clearance[cell]));
    let mut places = Vec::new();
    while let Some(&place) = candidates.first()
        && places.len() < MAX_PLACES
    {
        places.push(grid.middle(place));
        candidates.retain(|&cell| cell != place && !grid.is_in_sight(place, cell));
    }
    places
}

/// Cells of a box around the cloud, in its frame: which hold points.
struct Grid {
    frame: Frame,
    origin: DVec3,
    /// Lowest corner, in the frame.
    min: Vec3,
    cell: f32,
    size: IVec3,
    occupied: Vec<bool>,
}

impl Grid {
    /// `None` for a cloud without extent.
    fn new(cloud: &PointCloud) -> Option<Self> {
        if cloud.diagonal() <= 0.0 {
            return None;
        }
        let frame = Frame::of(cloud);
        let in_frame = |position: Vec3| (frame.frame_from_cloud * (position.as_dvec3() - frame.center)).as_vec3();
        let end = (OUTLIERS * cloud.n_points() as f32) as usize;
        let (mut min, mut max) = (Vec3::ZERO, Vec3::ZERO);
        for axis in 0..3 {
            let mut values: Vec<f32> = cloud.positions().par_iter().map(|&p| in_frame(p)[axis]).collect();
            let last = values.len() - 1;
            min[axis] = *values.select_nth_unstable_by(end, f32::total_cmp).1;
            max[axis] = *values.select_nth_unstable_by(last - end, f32::total_cmp).1;
        }
        let cell = (max - min).max_element() / CELLS;
        if cell <= 0.0 {
            return None;
        }
        // A layer more than the box on every side is empty of all but outliers.
        let min = min - cell;
        let size = ((max - min) / cell).as_ivec3() + 2;
        let mut grid = Self {
            frame,
            origin: cloud.origin(),
            min,
            cell,
            size,
            occupied: vec![false; (size.x * size.y * size.z) as usize],
        };
        for &position in cloud.positions() {
            let cell = ((in_frame(position) - min) / cell).floor().as_ivec3();
            if let Some(index) = grid.index(cell) {
                grid.occupied[index] = true;
            }
        }
        Some(grid)
    }

    fn index(&self, cell: IVec3) -> Option<usize> {
        let inside = cell.cmpge(IVec3::ZERO).all() && cell.cmplt(self.size).all();
        inside.then(|| ((cell.z * self.size.y + cell.y) * self.size.x + cell.x) as usize)
    }

    fn cell(&self, index: usize) -> IVec3 {
        let (x, y) = (self.size.x as usize, self.size.y as usize);
        IVec3::new((index % x) as i32, (index / x % y) as i32, (index / x / y) as i32)
    }

    /// The middle of a cell in the file's coordinates.
    fn middle(&self, index: usize) -> DVec3 {
        let in_frame = (self.min + (self.cell(index).as_vec3() + 0.5) * self.cell).as_dvec3();
        self.origin + self.frame.center + self.frame.frame_from_cloud.transpose() * in_frame
    }

    /// Steps to the nearest cell with points, neighbors across corners included; `u16::MAX` when there is none.
    fn clearance(&self) -> Vec<u16> {
        let mut clearance = vec![u16::MAX; self.occupied.len()];
        let mut front: Vec<usize> = (0..self.occupied.len()).filter(|&cell| self.occupied[cell]).collect();
        let mut steps = 0;
        while !front.is_empty() {
            let mut next = Vec::new();
            for cell in front {
                if clearance[cell] == u16::MAX {
                    clearance[cell] = steps;
                    let around = directions().filter_map(|step| self.index(self.cell(cell) + step));
                    next.extend(around.filter(|&other| clearance[other] == u16::MAX));
                }
            }
            front = next;
            steps += 1;
        }
        clearance
    }

    /// In how many of the 26 directions a cell with points comes before the end of the box.
    fn n_walls(&self, index: usize) -> usize {
        let meets_wall = |step: &IVec3| {
            let mut cell = self.cell(index);
            loop {
                cell += *step;
                match self.index(cell) {
                    None => return false,
                    Some(index) if self.occupied[index] => return true,
                    Some(_) => {}
                }
            }
        };
        directions().filter(meets_wall).count()
    }

    /// Whether only empty cells are on the line between the middles of two.
    fn is_in_sight(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.cell(a), self.cell(b));
        let n_steps = (b - a).abs().max_element();
        (1..n_steps).all(|step| {
            let on_line = a.as_vec3() + (b - a).as_vec3() * (step as f32 / n_steps as f32);
            let cell = (on_line + 0.5).floor().as_ivec3();
            self.index(cell).is_none_or(|index| !self.occupied[index])
        })
    }
}

/// The steps to the 26 neighbors of a cell.
fn directions() -> impl Iterator<Item = IVec3> {
    (0..27)
        .map(|i| IVec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1))
        .filter(|&step| step != IVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn the_middle_of_a_ball() {
        let shape = shapes::sphere(20_000);
        let center = DVec3::new(512_000.0, -3.0, 70.0);
        let cloud = PointCloud::new(center, shape.positions).unwrap();
        let places = inside_places(&cloud);
        // All of it is in sight of the first place.
        assert_eq!(places.len(), 1);
        assert!(places[0].distance(center) < 0.2, "{}", places[0]);
    }

    #[test]
    fn each_room_has_a_place() {
        let rooms = [DVec3::ZERO, DVec3::new(3.0, 0.0, 0.0)];
        let points: Vec<DVec3> = (rooms.iter())
            .flat_map(|&room| {
                shapes::sphere(10_000)
                    .positions
                    .into_iter()
                    .map(move |p| p.as_dvec3() + room)
            })
            .collect();
        let places = inside_places(&PointCloud::from_f64(&points).unwrap());
        for room in rooms {
            assert!(
                places.iter().any(|place| place.distance(room) < 0.5),
                "{room}: {places:?}"
            );
        }
    }

    #[test]
    fn nothing_encloses_nothing() {
        let sheet = |i: usize| Vec3::new((i % 100) as f32, (i / 100) as f32, 0.0);
        let positions: Vec<Vec3> = (0..10_000).map(sheet).collect();
        for positions in [positions, vec![Vec3::ONE; 10], vec![Vec3::ZERO, Vec3::X], Vec::new()] {
            let cloud = PointCloud::new(DVec3::ZERO, positions).unwrap();
            assert_eq!(inside_places(&cloud), []);
        }
    }
}
