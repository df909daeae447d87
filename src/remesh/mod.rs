//! Algorithms that keep a moving mesh well sampled and change its topology on contact (Lachaud & Montanvert, sections
//! 3.2, 3.3 and figure 9), and remeshing of static meshes.
//!
//! [`Resolver::resolve`] repeats these steps until all bounds hold: edges out of bounds are split, flipped or collapsed
//! (`edges`), necks that block a collapse are cut (`necks`), vertices in contact are joined (`contact`). After eight
//! rounds the rest stays pending for the next call. Small components without volume are removed (`small_components`).
//! [`Embedding`] keeps the mesh free of self-intersections.
//!
//! [`decimate()`] reduces a static mesh, [`remesh`] remeshes it isotropically, with even edge lengths and well-shaped
//! triangles; [`smooth`] removes noise. None of them changes topology. [`cut_by_plane`] removes one side of a plane.

mod changes;
mod clustering;
mod collapse_queue;
mod contact;
mod decimate;
mod deviation;
mod edges;
mod embedding;
mod isotropic;
mod necks;
mod obstacles;
mod plane_cut;
mod resolve;
mod restructure;
mod sampling;
mod small_components;
mod smooth;
mod unit_scale;
mod volume_balance;

pub use changes::Changes;
pub use clustering::clustered;
pub use decimate::{decimate, decimate_in_slices, decimate_within, decimate_within_in_slices};
pub use embedding::{Embedding, PairsOfParts};
pub use isotropic::{remesh, remesh_in_slices};
pub use plane_cut::{Plane, cut_by_plane, cut_by_plane_in_slices};
pub use resolve::{ContactPolicy, Pending, Resolver, TopologyGuide, Unguided};
pub use restructure::{
    EdgeBounds, EditPolicy, RestructurePass, Unchecked, collapse_short, flip_for_valence, passes_in_slices,
    restructure, restructure_in_passes, restructure_in_slices, split_long,
};
pub use sampling::Sampling;
pub use smooth::{Smoothing, smooth, smooth_in_slices};
