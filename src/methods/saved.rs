//! The envelope of saved states: a mark, a checksum, and the state itself.

use super::MethodError;
use crate::mesh::Mesh;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The mark of one method's states; its last byte counts versions of the layout.
pub type Mark = [u8; 8];

/// More neighbours than any edit leaves a vertex.
pub const MOST_NEIGHBOURS: usize = 4096;

/// Checking a mesh takes the square of the neighbours of a vertex; only a forged state has one with very many.
pub fn can_be_checked(mesh: &Mesh) -> bool {
    mesh.rings().iter().all(|ring| ring.valence() <= MOST_NEIGHBOURS)
}

/// The bytes of a state.
pub fn sealed<T: Serialize>(mark: &Mark, state: &T) -> Vec<u8> {
    // Serialising plain data into memory has no way to fail.
    let body = postcard::to_allocvec(state).unwrap_or_default();
    [&mark[..], &Hash::of(&body).to_le_bytes(), &body].concat()
}

/// The state in bytes that [`sealed`] gave.
///
/// # Errors
/// [`MethodError::BadState`] for any others.
pub fn opened<T: DeserializeOwned>(mark: &Mark, bytes: &[u8]) -> Result<T, MethodError> {
    let bad = |field, problem: &str| Err(MethodError::BadState { field, problem: problem.into() });
    let Some((sum, body)) = bytes.strip_prefix(mark).and_then(|rest| rest.split_first_chunk::<8>()) else {
        return bad("header", "these bytes are no saved state of this version");
    };
    if u64::from_le_bytes(*sum) != Hash::of(body) {
        return bad("contents", "the bytes are cut off or damaged");
    }
    match postcard::take_from_bytes::<T>(body) {
        Ok((state, [])) => Ok(state),
        Ok(_) => bad("contents", "there are bytes after the end"),
        Err(_) => bad("contents", "the bytes are cut off or damaged"),
    }
}

/// FNV-1a, word by word: tells inputs apart.
#[derive(Clone, Copy, Debug)]
pub struct Hash(u64);

impl Hash {
    /// Of nothing yet.
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds a word.
    pub fn mix(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0x100_0000_01b3);
    }

    /// What came out.
    pub fn value(&self) -> u64 {
        self.0
    }

    fn of(bytes: &[u8]) -> u64 {
        let mut hash = Self::new();
        bytes.iter().for_each(|&byte| hash.mix(u64::from(byte)));
        hash.0
    }
}
