//! Choices derived from fuzzer input, so that a small change of the bytes is a small change of the scene.

use super::random::Random;
use vesicle::math::DVec3;

/// A source of numbers for random scenes: reads the fuzzer's input and, once that is used up, a generator seeded with
/// the whole input.
pub struct Choices<'a> {
    left: &'a [u8],
    random: Random,
}

impl<'a> Choices<'a> {
    /// Creates a source that reads `data`.
    pub fn new(data: &'a [u8]) -> Self {
        let mix = |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        Self { left: data, random: Random(data.iter().fold(0xcbf2_9ce4_8422_2325, mix)) }
    }

    /// Returns the next byte of the input, or of the generator once the input is used up.
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.left.split_first() else { return (self.random.next() >> 56) as u8 };
        self.left = rest;
        first
    }

    /// Returns whether all bytes of the input have been used.
    pub fn is_spent(&self) -> bool {
        self.left.is_empty()
    }

    /// Returns an integer in 0..`n`; `n` is 1 to 65,536.
    pub fn below(&mut self, n: usize) -> usize {
        let low = usize::from(self.byte());
        if n <= 256 { low % n } else { (low << 8 | usize::from(self.byte())) % n }
    }

    /// Returns true once in `one_in` times on average.
    pub fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == one_in - 1
    }

    /// Returns a number in 0..1.
    pub fn unit(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / 65_536.0
    }

    /// Returns a number in `low`..`high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns one of the values.
    pub fn one_of<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }

    /// Returns a point in the cube of half edge `half` around the origin.
    pub fn point(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.within(-half, half), self.within(-half, half), self.within(-half, half))
    }

    /// Returns a unit vector.
    pub fn direction(&mut self) -> DVec3 {
        self.point(1.0).try_normalize().unwrap_or(DVec3::X)
    }
}
