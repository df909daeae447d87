//! Passes that keep a moving mesh well sampled and change its topology on contact (Lachaud & Montanvert, sections
//! 3.2, 3.3 and figure 9).
//!
//! [`Resolver::resolve`] is the whole of it: edges out of bounds are split, flipped, collapsed or cut through
//! (`edges`), vertices in contact are joined (`contact`), and again until all bounds hold; what is left after
//! eight rounds stays queued for the next call. Small parts without volume are removed (`specks`).
//!
//! [`decimate`] makes a mesh at rest coarser, without a change of topology.

mod changes;
mod contact;
mod decimate;
mod edges;
mod obstacles;
mod resolve;
mod sampling;
mod specks;

pub use changes::Changes;
pub use decimate::decimate;
pub use resolve::{Resolver, Waiting};
pub use sampling::Sampling;
