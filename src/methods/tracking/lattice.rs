//! Voxel masks of a box of voxels: distances from them, and their connected parts.

use crate::pauses::Pauses;

/// The number of voxels that count as one unit of work between pauses.
const VOXELS_PER_UNIT: usize = 256;

/// A box of voxels, with the lengths of their sides. Masks and values of its voxels are lists, x fastest, then y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    pub dims: [usize; 3],
    pub spacing: [f64; 3],
}

impl Lattice {
    /// Returns the number of voxels.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Returns the coordinates of a voxel by its index.
    pub fn at(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.dims;
        [index % nx, index / nx % ny, index / (nx * ny)]
    }

    /// Returns the index of a voxel by its coordinates.
    pub fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        let [nx, ny, _] = self.dims;
        (z * ny + y) * nx + x
    }

    /// Returns the shortest side of a voxel.
    pub fn shortest_side(&self) -> f64 {
        self.spacing.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Returns the steps in the index to the next voxel along x, y and z.
    fn strides(&self) -> [usize; 3] {
        [1, self.dims[0], self.dims[0] * self.dims[1]]
    }

    /// Calls `visit` with the voxels that share a face with one.
    pub fn for_each_neighbour(&self, index: usize, mut visit: impl FnMut(usize)) {
        let at = self.at(index);
        for (axis, stride) in self.strides().into_iter().enumerate() {
            if at[axis] > 0 {
                visit(index - stride);
            }
            if at[axis] + 1 < self.dims[axis] {
                visit(index + stride);
            }
        }
    }

    /// Returns the voxels within `reach` voxels of one along each axis, itself among them.
    pub fn around(&self, at: [usize; 3], reach: usize) -> Vec<usize> {
        let range = |axis: usize| at[axis].saturating_sub(reach)..(at[axis] + reach + 1).min(self.dims[axis]);
        let mut voxels = Vec::new();
        for z in range(2) {
            for y in range(1) {
                voxels.extend(range(0).map(|x| self.index([x, y, z])));
            }
        }
        voxels
    }

    /// Returns the first and the last coordinates of the voxels of a mask; `None` if it is empty.
    pub fn bounds(&self, mask: &[bool]) -> Option<[[usize; 3]; 2]> {
        let mut ends: Option<[[usize; 3]; 2]> = None;
        for (i, _) in mask.iter().enumerate().filter(|(_, is_in)| **is_in) {
            let at = self.at(i);
            let [low, high] = ends.unwrap_or([at; 2]);
            ends = Some([[0, 1, 2].map(|k| low[k].min(at[k])), [0, 1, 2].map(|k| high[k].max(at[k]))]);
        }
        ends
    }

    /// Returns the distance of each voxel's centre from the nearest centre of a voxel of `mask`, 0 within it; infinite if
    /// it is empty.
    ///
    /// Exact but for rounding: one pass along each axis takes the minimum over its lines of the squared distance so far plus
    /// the squared distance along the axis, as the lower envelope of parabolas (Felzenszwalb & Huttenlocher 2012).
    pub async fn distances(&self, mask: &[bool], pauses: &Pauses) -> Vec<f32> {
        let mut squares: Vec<f32> =
            mask.iter().map(|&is_in| if is_in { 0.0 } else { f32::INFINITY }).collect();
        for (axis, stride) in self.strides().into_iter().enumerate() {
            let count = self.dims[axis];
            let mut line = Line::new(self.spacing[axis]);
            for first in 0..self.len() {
                if self.at(first)[axis] > 0 {
                    continue;
                }
                line.minimise(&mut squares, first, stride, count);
                pauses.after(count.div_ceil(VOXELS_PER_UNIT)).await;
            }
        }
        squares.iter_mut().for_each(|square| *square = libm::sqrtf(*square));
        squares
    }

    /// Returns the parts of a mask, connected across faces: by voxel, the number of its part, from 1 on, 0 outside of the
    /// mask; and the number of parts.
    pub async fn parts(&self, mask: &[bool], pauses: &Pauses) -> (Vec<u32>, usize) {
        let mut parts = vec![0; mask.len()];
        let (mut count, mut stack) = (0, Vec::new());
        for first in 0..mask.len() {
            if first % VOXELS_PER_UNIT == 0 {
                pauses.after(1).await;
            }
            if !mask[first] || parts[first] > 0 {
                continue;
            }
            count += 1;
            parts[first] = count as u32;
            stack.push(first);
            let mut visited = 0;
            while let Some(i) = stack.pop() {
                self.for_each_neighbour(i, |j| {
                    if mask[j] && parts[j] == 0 {
                        parts[j] = count as u32;
                        stack.push(j);
                    }
                });
                visited += 1;
                if visited % VOXELS_PER_UNIT == 0 {
                    pauses.after(1).await;
                }
            }
        }
        (parts, count)
    }

    /// Replaces values by their sums over the voxels within `reach` voxels along each axis.
    pub async fn sum_boxes(&self, values: &mut [f32], reach: [usize; 3], pauses: &Pauses) {
        for (axis, stride) in self.strides().into_iter().enumerate() {
            let count = self.dims[axis];
            // Sums up to each voxel; in double precision, differences of them are exact enough.
            let mut sums = vec![0.0f64; count + 1];
            for first in 0..self.len() {
                if self.at(first)[axis] > 0 {
                    continue;
                }
                for k in 0..count {
                    sums[k + 1] = sums[k] + f64::from(values[first + k * stride]);
                }
                for k in 0..count {
                    let (low, high) = (k.saturating_sub(reach[axis]), (k + reach[axis] + 1).min(count));
                    values[first + k * stride] = (sums[high] - sums[low]) as f32;
                }
                pauses.after(count.div_ceil(VOXELS_PER_UNIT)).await;
            }
        }
    }

    /// Returns the means of values over the voxel itself and its neighbours along each axis along which voxels are not
    /// longer than `longest`; over those in the box at its border.
    pub async fn blurred(&self, values: &[u8], longest: f64, pauses: &Pauses) -> Vec<f32> {
        let mut out: Vec<f32> = values.iter().map(|&value| f32::from(value)).collect();
        for (axis, stride) in self.strides().into_iter().enumerate() {
            if self.spacing[axis] > longest {
                continue;
            }
            let from = out.clone();
            for (i, value) in out.iter_mut().enumerate() {
                let k = self.at(i)[axis];
                let (mut sum, mut count) = (from[i], 1.0);
                if k > 0 {
                    (sum, count) = (sum + from[i - stride], count + 1.0);
                }
                if k + 1 < self.dims[axis] {
                    (sum, count) = (sum + from[i + stride], count + 1.0);
                }
                *value = sum / count;
                if i % VOXELS_PER_UNIT == 0 {
                    pauses.after(1).await;
                }
            }
        }
        out
    }
}

/// A line of squared distances, and the parabolas of its lower envelope.
struct Line {
    step: f64,
    values: Vec<f64>,
    /// The indices of the voxels whose parabolas are in the envelope, each with the coordinate from which it is.
    envelope: Vec<(usize, f64)>,
}

impl Line {
    fn new(step: f64) -> Self {
        Self { step, values: Vec::new(), envelope: Vec::new() }
    }

    /// Replaces the values on a line of voxels by the minimum over the line of value plus squared distance.
    fn minimise(&mut self, squares: &mut [f32], first: usize, stride: usize, count: usize) {
        self.values.clear();
        self.values.extend((0..count).map(|k| f64::from(squares[first + k * stride])));
        self.envelope.clear();
        for k in 0..count {
            if self.values[k].is_finite() {
                self.add(k);
            }
        }
        let mut at = 0;
        for k in 0..count {
            while self.envelope.get(at + 1).is_some_and(|&(_, from)| from <= k as f64) {
                at += 1;
            }
            if let Some(&(centre, _)) = self.envelope.get(at) {
                let away = (k.abs_diff(centre)) as f64 * self.step;
                squares[first + k * stride] = (self.values[centre] + away * away) as f32;
            }
        }
    }

    /// Adds the parabola of a voxel beyond those in the envelope.
    fn add(&mut self, k: usize) {
        let square = self.step * self.step;
        let height = |k: usize| self.values[k] / square + (k * k) as f64;
        while let Some(&(last, from)) = self.envelope.last() {
            let crossing = (height(k) - height(last)) / (2.0 * (k - last) as f64);
            if crossing > from {
                self.envelope.push((k, crossing));
                return;
            }
            self.envelope.pop();
        }
        self.envelope.push((k, f64::NEG_INFINITY));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    use crate::pauses::finished;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const LATTICE: Lattice = Lattice { dims: [9, 7, 5], spacing: [1.0, 1.5, 4.0] };

    #[test]
    fn distances_are_those_from_the_nearest_voxel_of_the_mask() {
        let mut random = Random::new(3);
        for share in [1, 20, 80, 1000] {
            let mask: Vec<bool> = (0..LATTICE.len()).map(|_| random.below(1000) < share).collect();
            let found = finished(LATTICE.distances(&mask, &Pauses::default()));
            for (i, found) in found.into_iter().enumerate() {
                let apart = |j: usize| {
                    let [a, b] = [i, j].map(|k| LATTICE.at(k));
                    let along = |k: usize| a[k].abs_diff(b[k]) as f64 * LATTICE.spacing[k];
                    (0..3).map(|k| along(k) * along(k)).sum::<f64>().sqrt()
                };
                let nearest = (0..mask.len()).filter(|&j| mask[j]).map(apart).fold(f64::INFINITY, f64::min);
                let is_same = f64::from(found) == nearest || (f64::from(found) - nearest).abs() < 1e-5;
                assert!(is_same, "{share} {i}: {found} {nearest}");
            }
        }
    }

    #[test]
    fn parts_are_connected_across_faces_only() {
        let mut mask = vec![false; LATTICE.len()];
        for at in [[1, 1, 1], [2, 1, 1], [2, 2, 1], [3, 3, 1], [8, 6, 4], [8, 6, 3]] {
            mask[LATTICE.index(at)] = true;
        }
        let (parts, count) = finished(LATTICE.parts(&mask, &Pauses::default()));
        let part = |at| parts[LATTICE.index(at)];
        assert_eq!(count, 3);
        assert_eq!([part([1, 1, 1]), part([2, 2, 1]), part([0, 0, 0])], [1, 1, 0]);
        assert_eq!([part([3, 3, 1]), part([8, 6, 4]), part([8, 6, 3])], [2, 3, 3]);
        assert_eq!(LATTICE.bounds(&mask), Some([[1, 1, 1], [8, 6, 4]]));
    }
}
