//! Which side of each point is seen from places within the cloud: panoramas of rooms.

use glam::{DVec3, Mat3, Vec3};
use rayon::prelude::*;

use super::depth_buffer::Disc;
use super::scanner::SURE_COSINE;
use super::scene::{Look, MAX_LOOKS, PIXEL, Picture, Scene, Splat};
use super::{Evidence, Origin, UNIT, Vote};
use crate::progress::Part;
use crate::{Cancelled, PointCloud, Progress};

/// Looks all around from each of `places` (in the file's coordinates, the first 32 count) and asks for each point which of its
/// sides is seen.
///
/// `radii` and `normals` are those of [`super::outside_views`], and so are discs and costs; here the pictures are the six
/// sides of a cube around each place. A look weighs as one of a scanner: whole up to 60° between normal and line of sight. A place on a surface sees that surface badly and the rest well.
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn inside_views(
    cloud: &PointCloud,
    radii: &[f32],
    normals: &[Vec3],
    places: &[DVec3],
    progress: &dyn Progress,
) -> Result<Evidence, Cancelled> {
    let places = &places[..places.len().min(MAX_LOOKS)];
    if cloud.n_points() == 0 || places.is_empty() {
        return Ok(Evidence::new(
            Origin::InsideViews,
            vec![Vote::default(); cloud.n_points()],
        ));
    }
    let scene = Scene::new(cloud, normals, radii);
    let relative: Vec<DVec3> = places.iter().map(|&place| place - cloud.origin()).collect();
    let masks = scene.masks(places.len(), &Part::new(progress, 0.05..0.95), |index, look| {
        let offset = relative[index] - scene.frame.center;
        look_around(&scene, (scene.frame.frame_from_cloud * offset).as_vec3(), look);
    })?;
    drop(scene);
    let votes = (&masks, normals, cloud.positions())
        .into_par_iter()
        .map(|(&mask, &normal, &position)| {
            let mut vote = Vote::default();
            // What is seen from behind has no meaning in a panorama.
            let mut left = mask & (u64::MAX >> (64 - MAX_LOOKS));
            while left != 0 {
                let place = relative[left.trailing_zeros() as usize];
                left &= left - 1;
                let sight = (place - position.as_dvec3()).normalize_or_zero().as_vec3();
                let share = (normal.dot(sight) / SURE_COSINE as f32).clamp(-1.0, 1.0);
                vote.cast((share * UNIT as f32).round() as i32);
            }
            vote
        })
        .collect();
    Ok(Evidence::new(Origin::InsideViews, votes))
}

/// Takes the six sides of the cube around `place`, which is in the frame.
fn look_around(scene: &Scene, place: Vec3, look: &mut Look<'_>) {
    // Pixels as large as those of a parallel view at the median distance.
    let mut distances: Vec<f32> = scene
        .splats
        .iter()
        .map(|splat| splat.position.distance(place))
        .collect();
    let middle = distances.len() / 2;
    let distance = *distances.select_nth_unstable_by(middle, f32::total_cmp).1;
    drop(distances);
    let half = (distance / (PIXEL * scene.spacing))
        .clamp(1.0, 0.5 * scene.most_pixels().sqrt())
        .ceil();
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for forward in [axis, -axis] {
            let (right, up) = forward.any_orthonormal_pair();
            let view_from_frame = Mat3::from_cols(right, up, forward).transpose();
            look.take(Picture {
                least_cosine: LEAST_COSINE,
                width: 2 * half as usize,
                height: 2 * half as usize,
                project: |splat: &Splat| project(view_from_frame, place, half, splat),
            });
        }
    }
}

/// Cosine of the angle from which on a look is not taken, 78°. There are few places, so looks are taken that many views
/// from outside can do without.
const LEAST_COSINE: f32 = 0.2;

/// Distance of the nearest disc that is drawn, in radii: one that is nearer may reach behind the viewer.
const NEAREST: f32 = 1.5;

/// Tangent of half the angle of view beyond which discs cannot reach into the picture: the nearest reach from there to 1.
const WIDEST: f32 = 4.0;

/// The disc in a picture of `2 half` pixels that looks along z from `place`. The height is the reciprocal depth, which a
/// plane changes linearly across the picture.
fn project(view_from_frame: Mat3, place: Vec3, half: f32, splat: &Splat) -> Option<(Disc, f32)> {
    let center = view_from_frame * (splat.position - place);
    let radius = splat.radius();
    if center.z <= NEAREST * radius {
        return None;
    }
    let (u, v) = (center.x / center.z, center.y / center.z);
    if u.abs().max(v.abs()) > WIDEST {
        return None;
    }
    let normal = view_from_frame * splat.normal;
    // Normal times sight, which is (u, v, 1).
    let facing = normal.x * u + normal.y * v + normal.z;
    // A step (p, q) across the picture, times the depth, is one along the disc by (p + u t, q + v t, t), t = a p + b q.
    let (a, b) = (-normal.x / facing, -normal.y / facing);
    let along_p = Vec3::new(1.0 + u * a, v * a, a);
    let along_q = Vec3::new(u * b, 1.0 + v * b, b);
    let pixels = half / center.z;
    let disc = Disc {
        x: half * (u + 1.0),
        y: half * (v + 1.0),
        height: 1.0 / center.z,
        slope: [-a / (center.z * half), -b / (center.z * half)],
        radius: radius * pixels,
        ellipse: [along_p.length_squared(), along_p.dot(along_q), along_q.length_squared()],
        tolerance: splat.tolerance() / (center.z * center.z),
    };
    Some((disc, facing / Vec3::new(u, v, 1.0).length()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Silent, shapes};

    /// The pull on each outward normal of a ball around `center`, as seen from `places`.
    fn pulls(center: DVec3, places: &[DVec3]) -> Vec<f32> {
        let shape = shapes::sphere(20_000);
        let cloud = PointCloud::new(center, shape.positions).unwrap();
        // Six of 20 000 points on the unit sphere.
        let radii = vec![(4.0 * 6.0 / 20_000.0_f32).sqrt(); 20_000];
        let evidence = inside_views(&cloud, &radii, &shape.normals, places, &Silent).unwrap();
        assert_eq!(evidence.origins(), [Origin::InsideViews]);
        evidence.votes().iter().map(|vote| vote.pull()).collect()
    }

    #[test]
    fn all_of_a_ball_is_seen_from_its_middle() {
        let center = DVec3::new(512_000.0, 5.0, -7.0);
        assert!(pulls(center, &[center]).iter().all(|&pull| pull == -1.0));
        let off_center = center + DVec3::new(0.4, -0.2, 0.1);
        assert!(pulls(center, &[off_center]).iter().all(|&pull| pull < -0.5));
    }

    #[test]
    fn the_near_side_of_a_ball_is_seen_from_outside() {
        let pulls = pulls(DVec3::ZERO, &[DVec3::new(0.0, 0.0, 5.0)]);
        for (pull, position) in pulls.iter().zip(shapes::sphere(20_000).positions) {
            match position.z {
                ..0.2 => assert_eq!(*pull, 0.0, "{position}"),
                0.6.. => assert!(*pull > 0.5, "{position} {pull}"),
                _ => assert!(*pull >= 0.0, "{position} {pull}"),
            }
        }
    }

    #[test]
    fn no_place_sees_nothing() {
        assert!(pulls(DVec3::ZERO, &[]).iter().all(|&pull| pull == 0.0));
    }
}
