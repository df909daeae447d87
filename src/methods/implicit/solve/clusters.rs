//! Binary cluster tree of the centres of the constraints, whose pairs of clusters are the blocks of the hierarchical
//! matrix.

use crate::math::order::{combined_rank, rank_f32};
use crate::math::{Bounds, Vec3};

/// Maximum number of centres in a leaf of the cluster tree. With 32, there are twice as many blocks; with 128, twice as
/// many matrix entries are stored in full.
const LEAF: usize = 64;

/// A binary tree over points: each cluster is a range of [`ClusterTree::order`], each child about half of it.
#[derive(Clone, Debug)]
pub struct ClusterTree {
    /// Indices of the points given to [`Self::new`], ordered such that each cluster is contiguous.
    pub order: Vec<u32>,
    /// All clusters of the tree; the first contains all points.
    pub clusters: Vec<Cluster>,
}

/// A cluster of points that are near each other.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// Start of the cluster's range in [`ClusterTree::order`].
    pub start: usize,
    /// End (exclusive) of the cluster's range in [`ClusterTree::order`].
    pub end: usize,
    /// Bounding box of the cluster's points.
    pub bounds: Bounds,
    /// Indices of the cluster's two children in [`ClusterTree::clusters`]; `None` for a leaf.
    pub halves: Option<[usize; 2]>,
}

impl Cluster {
    /// Returns the number of points in the cluster.
    pub fn len(&self) -> usize {
        self.end - self.start
    }

    /// Returns the diameter of the cluster: the diagonal of its bounding box, which bounds the distance of its points.
    pub fn diameter(&self) -> f32 {
        self.bounds.min.distance(self.bounds.max)
    }

    /// Returns the distance between the bounding boxes of two clusters, 0 if they overlap.
    pub fn distance(&self, other: &Self) -> f32 {
        let gap = (self.bounds.min - other.bounds.max).max(other.bounds.min - self.bounds.max);
        gap.max(Vec3::ZERO).length()
    }
}

impl ClusterTree {
    /// Builds the cluster tree of `points`, by halving clusters at the median along their widest axis.
    pub fn new(points: &[Vec3]) -> Self {
        let mut tree = Self { order: (0..points.len() as u32).collect(), clusters: Vec::new() };
        let mut order = std::mem::take(&mut tree.order);
        tree.split(points, &mut order, 0);
        tree.order = order;
        tree
    }

    fn split(&mut self, points: &[Vec3], order: &mut [u32], start: usize) -> usize {
        let bounds =
            order.iter().fold(Bounds::EMPTY, |b, &i| b.union(&Bounds::from_points(&[points[i as usize]])));
        let at = self.clusters.len();
        self.clusters.push(Cluster { start, end: start + order.len(), bounds, halves: None });
        if order.len() > LEAF {
            let (axis, middle) = (bounds.widest_axis(), order.len() / 2);
            let along = |i: u32| combined_rank(rank_f32(points[i as usize][axis]), i);
            let mut ranked: Vec<u64> = order.iter().map(|&i| along(i)).collect();
            ranked.select_nth_unstable(middle);
            order.iter_mut().zip(ranked).for_each(|(i, ranked)| *i = ranked as u32);
            let (low, high) = order.split_at_mut(middle);
            let halves = [self.split(points, low, start), self.split(points, high, start + middle)];
            self.clusters[at].halves = Some(halves);
        }
        at
    }
}
