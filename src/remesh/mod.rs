//! Passes that keep a moving mesh well sampled and change its topology on contact (Lachaud & Montanvert, sections
//! 3.2, 3.3 and figure 9).
//!
//! [`Resolver::resolve`] is the whole of it: edges out of bounds are split, flipped or collapsed (`edges`), or a neck is
//! cut there (`necks`), vertices in contact are joined (`contact`), and again until all bounds hold; what is left after
//! eight rounds stays queued for the next call. Small parts without volume are removed (`specks`).
//!
//! [`decimate`] makes a mesh at rest coarser, [`remesh`] makes its triangles alike; neither changes its topology.

mod changes;
mod contact;
mod decimate;
mod edges;
mod embedding;
mod isotropic;
mod necks;
mod obstacles;
mod resolve;
mod restructure;
mod sampling;
mod specks;

pub use changes::Changes;
pub use decimate::decimate;
pub use embedding::Embedding;
pub use isotropic::remesh;
pub use resolve::{Contact, Resolver, TopologyGuide, Unguided, Waiting};
pub use restructure::{
    EdgeBounds, Edits, Trusting, collapse_short, flip_for_valence, restructure, split_long,
};
pub use sampling::Sampling;
