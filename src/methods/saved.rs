//! The binary envelope of the saved states of all methods: magic bytes, a checksum, and the serialised state.

use super::MethodError;
use crate::mesh::Mesh;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The first bytes of a saved state: they identify the method, and the last one is the version of the layout.
pub type Magic = [u8; 8];

/// The largest valence of a vertex accepted in a saved state; no edit creates more neighbours.
pub const MAX_VALENCE: usize = 4096;

/// Returns whether every vertex has at most [`MAX_VALENCE`] neighbours, so that the mesh of a saved state may be passed
/// to [`Mesh::check`]. Its time is quadratic in the valence, so a forged state could otherwise stall it.
pub fn can_be_checked(mesh: &Mesh) -> bool {
    mesh.rings().iter().all(|ring| ring.valence() <= MAX_VALENCE)
}

/// Serialises a state of a method, preceded by `magic` and a checksum, so that [`decode`] can restore it.
pub fn encode<T: Serialize>(magic: &Magic, state: &T) -> Vec<u8> {
    // Serialising plain data into memory cannot fail.
    let body = postcard::to_allocvec(state).unwrap_or_default();
    [&magic[..], &Hash::of(&body).to_le_bytes(), &body].concat()
}

/// Deserialises a state from bytes made by [`encode`] with the same `magic`.
///
/// # Errors
/// [`MethodError::BadState`] if `magic` or the checksum differs, or the bytes are not exactly one state.
pub fn decode<T: DeserializeOwned>(magic: &Magic, bytes: &[u8]) -> Result<T, MethodError> {
    let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
    let Some((sum, body)) = bytes.strip_prefix(magic).and_then(|rest| rest.split_first_chunk::<8>()) else {
        return bad("header", "not a saved state of this version");
    };
    if u64::from_le_bytes(*sum) != Hash::of(body) {
        return bad("contents", "truncated or corrupt");
    }
    match postcard::take_from_bytes::<T>(body) {
        Ok((state, [])) => Ok(state),
        Ok(_) => bad("contents", "trailing bytes after the state"),
        Err(_) => bad("contents", "truncated or corrupt"),
    }
}

/// An FNV-1a hash over 64-bit words: the checksum of saved states, and the fingerprint of a method's input.
#[derive(Clone, Copy, Debug)]
pub struct Hash(u64);

impl Hash {
    /// Returns the hash of an empty sequence of words, to which [`Self::mix`] adds words.
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds a word to the sequence that is hashed.
    pub fn mix(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x100_0000_01b3);
    }

    /// Returns the hash of the words added so far.
    pub fn value(&self) -> u64 {
        self.0
    }

    fn of(bytes: &[u8]) -> u64 {
        let mut hash = Self::new();
        bytes.iter().for_each(|&byte| hash.mix(u64::from(byte)));
        hash.0
    }
}
