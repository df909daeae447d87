//! Projection of surface points onto the extremal surface of the boundary points in space-time, restricted to one frame
//! (section 3.3 of the paper that `tracking` follows), and prediction of the surface in the next frame (section 4.2).

use super::extremal::{PlaneFit, hyperplane, plane};
use super::samples::SampleField;
use crate::math::DVec3;

/// Lower bound of the factor by which a step of a projection is scaled: step i, from 0 on, is scaled by βⁱ, with the
/// parameter β, until the factor falls to this.
const MIN_DAMPING: f64 = 0.2;

/// Maximum number of steps of the projection of one vertex onto the boundary.
const STEPS: usize = 30;

/// Smallest |n₃|², the squared length of the spatial part of a space-time hyperplane's unit normal, for a projection
/// onto it: below, the hyperplane is nearly parallel to the frame, and cuts it in no well-defined plane.
const MIN_SPATIAL_NORMAL_SQUARED: f64 = 0.05;

/// The boundary points around one frame in time, and the parameters of projections of the surface onto them.
#[derive(Clone, Debug)]
pub(super) struct SpaceTimeSamples {
    /// Boundary points of the frame and of those around it in time, for fits in space-time.
    pub field: SampleField,
    /// Boundary points of the frame alone, shifted from their faces, for fits in space.
    pub own: SampleField,
    /// Indices of the voxels of the frame that are bright up to a side of the processed box, which is a boundary there,
    /// sorted.
    pub box_side_voxels: Vec<u32>,
    /// Time scale c: the distance in space, in world units, that a difference of one frame counts as in plane fits.
    pub time_scale: f64,
    pub damping: f64,
    /// A projection has converged after a step shorter than this, in world units.
    pub tolerance: f64,
    /// Projections that move a point farther than this are rejected, in world units.
    pub max_displacement: f64,
}

/// The extremal surface that a point of the mesh is projected onto.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Onto {
    /// The extremal surface of all points in space-time, restricted to the frame. It is found from farther away, but
    /// lags behind accelerating motion.
    SpaceTime,
    /// The extremal surface of the frame's own points, in space; the final projection of a frame is onto it.
    Frame,
}

impl SpaceTimeSamples {
    fn fit(&self, at: DVec3, onto: Onto) -> Option<PlaneFit> {
        match onto {
            Onto::SpaceTime => hyperplane(&self.field.sums(at))
                .filter(|fit| fit.normal.length_squared() >= MIN_SPATIAL_NORMAL_SQUARED),
            Onto::Frame => plane(&self.own.sums(at)),
        }
    }

    /// Projects a point of the mesh onto the extremal surface that `onto` selects; returns its new position and the
    /// number of steps. If it has not converged after [`STEPS`], its last position is returned. `None` if there are too
    /// few boundary points around it, the space-time hyperplane fitted to them is nearly parallel to the frame, or it
    /// moves farther than `max_displacement`.
    pub fn project(&self, p: DVec3, onto: Onto) -> Option<(DVec3, usize)> {
        let mut x = p;
        let mut damping: f64 = 1.0;
        for step in 0..STEPS {
            let fit = self.fit(x, onto)?;
            let n = fit.normal;
            // Projects p onto the plane fitted around x, restricted to this frame.
            let above = n.dot(p - x) - fit.distance;
            let y = p - n * (above / n.length_squared());
            let next = x + (y - x) * damping;
            let change = next.distance(x);
            x = next;
            if x.distance(p) > self.max_displacement {
                return None;
            }
            if change < self.tolerance {
                return Some((x, step + 1));
            }
            damping = (damping * self.damping).max(MIN_DAMPING);
        }
        Some((x, STEPS))
    }

    /// Predicts the displacement of the surface from a point to the next frame by the slope of the extremal surface in
    /// space-time: −c·nₜ·n₃ / |n₃|², in world units. `None` if there are too few boundary points around it, or the
    /// hyperplane fitted to them is nearly parallel to the frame.
    pub fn prediction(&self, at: DVec3) -> Option<DVec3> {
        let fit = self.fit(at, Onto::SpaceTime)?;
        let square = fit.normal.length_squared();
        Some(fit.normal * (-self.time_scale * fit.along_time / square))
    }
}

#[cfg(test)]
mod tests {
    use super::super::region::Region;
    use super::super::samples::Falloff;
    use super::super::shifts::Shifts;
    use super::super::vote::{Face, Faces, TIME, X, Y, Z};
    use super::super::working_space::WorkingSpace;
    use super::*;
    use crate::math::DAffine3;
    use crate::pauses::{Pauses, finished};
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const SPACING: DVec3 = DVec3::new(1.0, 1.25, 1.5);
    const C: f64 = 2.0;

    fn region() -> Region {
        Region {
            dims: [20, 18, 16],
            inner: [[0; 3], [19, 17, 15]],
            spacing: SPACING,
            space: WorkingSpace::default(),
            to_space: DAffine3::IDENTITY,
            from_space: DAffine3::IDENTITY,
            frames: vec![Vec::new(); 5],
            quantum: 1.0,
            threshold: 1.0,
            has_background: false,
            is_blank: Vec::new(),
        }
    }

    /// Returns test faces near the moving plane n·x = distance + speed·t, with weights that fall off with the distance
    /// from it.
    fn plane_faces(region: &Region, normal: DVec3, distance: f64, speed: f64, frame: f64) -> Faces {
        let mut faces = Faces::default();
        let [nx, ny, nz] = region.dims;
        for direction in [X, Y, Z, TIME] {
            for voxel in 0..(nx * ny * nz) as u32 {
                let (at, later) = region.face(direction, voxel);
                let off = normal.dot(at) - distance - speed * (frame + f64::from(later));
                if off.abs() < 1.0 {
                    faces[direction].push(Face { voxel, weight: (1.0 - off.abs()) as f32 });
                }
            }
        }
        faces
    }

    const FALLOFF: Falloff = Falloff { radius: 4.0, time_scale: C };

    fn moving_plane(normal: DVec3, distance: f64, speed: f64) -> SpaceTimeSamples {
        let region = region();
        let faces = |offset: i64| plane_faces(&region, normal, distance, speed, offset as f64);
        let frames: Vec<_> = FALLOFF.offsets(9).map(|offset| (offset, faces(offset))).collect();
        let frames: Vec<_> = frames.iter().map(|(offset, faces)| (*offset, faces)).collect();
        let field = finished(SampleField::of(&region, FALLOFF, &frames, &Pauses::default()));
        let (own, unshifted) = (faces(0), Shifts::default());
        let own = finished(SampleField::single_frame(&region, FALLOFF, &own, &unshifted, &Pauses::default()));
        SpaceTimeSamples {
            field,
            own,
            box_side_voxels: Vec::new(),
            time_scale: C,
            damping: 0.9,
            tolerance: 1e-4,
            max_displacement: 4.0,
        }
    }

    #[test]
    fn sums_are_those_of_the_faces_within_the_radius() {
        let region = region();
        for (radius, spread) in [(4.0, 1e-5), (9.0, 1e-4)] {
            let falloff = Falloff { radius, time_scale: C };
            let normal = DVec3::new(0.6, 0.0, 0.8);
            let frames: Vec<Faces> =
                (-5..=5).map(|t| plane_faces(&region, normal, 12.0, 0.3, f64::from(t))).collect();
            let near: Vec<_> =
                falloff.offsets(5).map(|offset| (offset, &frames[(offset + 5) as usize])).collect();
            let field = finished(SampleField::of(&region, falloff, &near, &Pauses::default()));
            for at in [DVec3::new(9.3, 10.1, 8.7), DVec3::new(0.2, 21.0, 15.0)] {
                let sums = field.sums(at);
                let (mut weight, mut first, mut second) = (0.0, [0.0; 4], [0.0; 10]);
                for (t, faces) in (-5..=5).zip(&frames) {
                    for (direction, face) in (0..4).flat_map(|d| faces[d].iter().map(move |face| (d, face))) {
                        let (position, later) = region.face(direction, face.voxel);
                        let offset = position - at;
                        let time = (f64::from(t) + f64::from(later)) * C;
                        // Along x the cut-off is at the radius, whatever the other coordinates are.
                        let across = offset.y * offset.y + offset.z * offset.z;
                        let square = radius * radius;
                        if across >= square || offset.x.abs() > radius || time.abs() >= radius {
                            continue;
                        }
                        let r = across + offset.x * offset.x + time * time;
                        let w = f64::from(face.weight) * libm::exp(-4.0 * r / square);
                        let x = [offset.x, offset.y, offset.z, time];
                        weight += w;
                        (0..4).for_each(|i| first[i] += w * x[i]);
                        let pairs = (0..4).flat_map(|i| (i..4).map(move |j| (i, j)));
                        pairs.zip(&mut second).for_each(|((i, j), sum)| *sum += w * x[i] * x[j]);
                    }
                }
                assert!((sums.weight - weight).abs() < spread * weight, "{} {weight}", sums.weight);
                for (a, b) in sums.first.iter().zip(first).chain(sums.second.iter().zip(second)) {
                    assert!((a - b).abs() < spread * radius * radius * weight, "{a} {b}");
                }
            }
        }
    }

    /// All points are shifted from their faces onto a plane, wherever between the faces it is.
    #[test]
    fn shifted_points_are_on_their_plane() {
        let region = region();
        for (normal, distance) in
            [(DVec3::X, 9.2), (DVec3::Z, 11.9), (DVec3::new(0.48, 0.6, 0.64), 17.3), (-DVec3::Y, -12.6)]
        {
            let mut faces = plane_faces(&region, normal, distance, 0.0, 0.0);
            let shifts = [X, Y, Z].map(|direction| {
                if normal[direction] == 0.0 {
                    faces[direction].clear();
                }
                let shift = |face: &Face| {
                    let off = distance - normal.dot(region.face(direction, face.voxel).0);
                    (off / normal[direction] / SPACING[direction]) as f32
                };
                faces[direction].iter().map(shift).collect()
            });
            let own =
                finished(SampleField::single_frame(&region, FALLOFF, &faces, &shifts, &Pauses::default()));
            let middle = DVec3::new(9.6, 11.2, 12.1);
            let at = middle + normal * (distance + 0.7 - normal.dot(middle));
            let fit = plane(&own.sums(at)).unwrap();
            let away = fit.distance * fit.normal.dot(normal);
            assert!((away + 0.7).abs() < 1e-4, "{normal}: {away}");
            assert!(fit.normal.cross(normal).length() < 1e-4, "{normal}: {}", fit.normal);
        }
    }

    #[test]
    fn a_plane_is_found_from_both_sides_and_its_motion_predicted() {
        let normal = DVec3::new(2.0, -1.0, 2.0) / 3.0;
        for speed in [0.0, 0.5, -0.8] {
            let samples = moving_plane(normal, 9.0, speed);
            for start in
                [DVec3::new(10.0, 10.0, 10.2), DVec3::new(9.0, 9.5, 8.3), DVec3::new(10.5, 11.0, 8.0)]
            {
                // The points of a moving plane in other frames lie on it in space-time.
                for onto in [Onto::SpaceTime, Onto::Frame] {
                    let (x, _) = samples.project(start, onto).unwrap();
                    assert!((normal.dot(x) - 9.0).abs() < 0.03, "{speed} {start} {}", normal.dot(x));
                    assert!((x - start).cross(normal).length() < 0.05, "{}", x - start);
                }
                let (x, _) = samples.project(start, Onto::SpaceTime).unwrap();
                let predicted = samples.prediction(x).unwrap();
                assert!((predicted - normal * speed).length() < 0.04, "{speed} {predicted}");
            }
        }
    }

    #[test]
    fn projection_fails_without_points_within_reach() {
        let samples = moving_plane(DVec3::X, 10.0, 0.0);
        assert!(samples.project(DVec3::new(1.0, 10.0, 10.0), Onto::SpaceTime).is_none());
        assert!(samples.project(DVec3::new(-500.0, 1e6, 3.0), Onto::Frame).is_none());
        assert!(samples.project(DVec3::splat(1e300), Onto::SpaceTime).is_none());
        let near = SpaceTimeSamples { max_displacement: 0.5, ..samples };
        assert!(near.project(DVec3::new(12.0, 10.0, 10.0), Onto::SpaceTime).is_none());
    }
}
