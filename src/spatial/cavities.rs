//! Components of a surface that are enclosed by others, such as the walls of cavities.

use super::TriangleTree;
use super::contains::winding_number;
use crate::math::{Bounds, BoxTree, Vec3};
use crate::mesh::{MeshError, TriangleMesh, measure};
use crate::pauses::{Pauses, finished};

/// Returns the indices of the connected components that no larger one encloses, as numbered by
/// [`TriangleMesh::components`]: those that are left when all cavities are filled. A solid inside a cavity is enclosed,
/// too.
///
/// # Errors
/// As [`TriangleMesh::check_closed`].
pub fn outer_components(mesh: &TriangleMesh) -> Result<Vec<u32>, MeshError> {
    finished(outer_components_in_slices(mesh, &Pauses::default()))
}

/// Does what [`outer_components`] does, and pauses meanwhile.
///
/// # Errors
/// As [`outer_components`].
pub async fn outer_components_in_slices(mesh: &TriangleMesh, pauses: &Pauses) -> Result<Vec<u32>, MeshError> {
    mesh.check_closed()?;
    pauses.now().await;
    let (mut components, mut sizes) = (Vec::new(), Vec::new());
    for surface in mesh.components() {
        sizes.push(Size {
            bounds: Bounds::from_points(&surface.positions),
            volume: measure(&surface).volume.abs(),
        });
        let tree = TriangleTree::in_slices(&surface, pauses).await?;
        components.push((surface, tree));
        pauses.after(1).await;
    }
    let bounds: Vec<Bounds> = sizes.iter().map(|size| size.bounds).collect();
    let boxes = BoxTree::new(&bounds);
    let mut outer = Vec::new();
    for (i, (size, (surface, _))) in sizes.iter().zip(&components).enumerate() {
        let p = surface.positions[0];
        let (mut is_enclosed, mut tests) = (false, 0);
        boxes.within(p, 0.0, |other| {
            tests += 1;
            let other = other as usize;
            is_enclosed = size.fits_into(&sizes[other]) && is_inside(p, &components[other]);
            is_enclosed
        });
        if !is_enclosed {
            outer.push(i as u32);
        }
        pauses.after(1 + tests / TESTS_PER_UNIT).await;
    }
    Ok(outer)
}

/// Number of components that are tested for whether they enclose another in a unit of work.
const TESTS_PER_UNIT: usize = 16;

/// Bounds and volume of a component, by which most are found not to enclose another.
struct Size {
    bounds: Bounds,
    volume: f64,
}

impl Size {
    fn fits_into(&self, other: &Self) -> bool {
        self.volume < other.volume && other.bounds.contains_box(&self.bounds)
    }
}

fn is_inside(p: Vec3, (surface, tree): &(TriangleMesh, TriangleTree)) -> bool {
    winding_number(surface, tree, p.as_dvec3()).0 != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::mesh::Mesh;
    use crate::mesh::shapes::{cuboid, joined, torus};
    use crate::spatial::contains;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    fn ball(radius: f32, x: f32) -> TriangleMesh {
        let ball = Mesh::icosphere(Vec3::X * x, radius, 0.5 * radius).unwrap().to_triangles();
        TriangleMesh { normals: None, ..ball }
    }

    fn inside_out(mut mesh: TriangleMesh) -> TriangleMesh {
        mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        mesh
    }

    #[test]
    fn cavities_and_what_is_in_them_are_enclosed() {
        let parts = [
            inside_out(ball(0.5, 1.0)),
            ball(2.0, 0.0),
            ball(0.2, 1.0),
            inside_out(ball(0.3, -1.0)),
            ball(0.5, 7.0),
            // Its hole holds the ball of radius 2, whose box is in its box, but not the ball.
            torus(4.0, 1.0, 40, 20),
        ];
        let mesh = joined(&parts);
        assert_eq!(outer_components(&mesh), Ok(vec![1, 4, 5]));
        let filled = measure(&mesh.with_components(&[1, 4, 5]).unwrap());
        let expected = measure(&joined(&[parts[1].clone(), parts[4].clone(), parts[5].clone()]));
        assert_eq!((filled.triangles, filled.components), (expected.triangles, 3));
        assert!((filled.volume - expected.volume).abs() < 1e-9);
        assert!(mesh.with_components(&[6]).is_err());
    }

    #[test]
    fn parts_that_cross_are_enclosed_if_a_larger_one_has_their_first_vertex_and_their_box() {
        let mut outer = 0;
        for seed in 0..20 {
            let mut random = Random::new(seed);
            let mut number = || random.unit() as f32;
            let parts: Vec<TriangleMesh> = (0..40)
                .map(|_| {
                    let at = Vec3::new(number(), number(), number());
                    let size = 0.05 + number() * number();
                    let mut part = cuboid(Vec3::new(size, size * (0.5 + number()), size));
                    part.positions.iter_mut().for_each(|p| *p += at);
                    part
                })
                .collect();
            let encloses = |other: &TriangleMesh, part: &TriangleMesh| {
                let [large, small] = [other, part].map(|mesh| Bounds::from_points(&mesh.positions));
                measure(part).volume < measure(other).volume
                    && large.contains_box(&small)
                    && contains(other, [part.positions[0].as_dvec3()]).unwrap()[0]
            };
            let is_outer = |&i: &u32| !parts.iter().any(|other| encloses(other, &parts[i as usize]));
            let expected: Vec<u32> = (0..40).filter(is_outer).collect();
            assert_eq!(outer_components(&joined(&parts)), Ok(expected.clone()), "seed {seed}");
            outer += expected.len();
        }
        assert!((100..700).contains(&outer), "{outer}");
    }

    #[test]
    fn open_meshes_are_rejected() {
        let mut mesh = ball(1.0, 0.0);
        mesh.triangles.pop();
        assert!(matches!(outer_components(&mesh), Err(MeshError::NotClosed { .. })));
    }
}
