//! Passes that keep a moving mesh well sampled and change its topology on contact.
