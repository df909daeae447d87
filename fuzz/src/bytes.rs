//! Choices read off bytes, so that a small change of the bytes is a small change of the scene.

use vesicle::math::DVec3;

/// Numbers out of bytes; when they are used up, out of a generator that began with them.
pub struct Bytes<'a> {
    left: &'a [u8],
    state: u64,
}

impl<'a> Bytes<'a> {
    pub fn new(data: &'a [u8]) -> Self {
        let mix = |hash: u64, &byte: &u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        Self { left: data, state: data.iter().fold(0xcbf2_9ce4_8422_2325, mix) }
    }

    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.left.split_first() else { return self.beyond() };
        self.left = rest;
        first
    }

    /// SplitMix64.
    fn beyond(&mut self) -> u8 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 56) as u8
    }

    /// Whether any bytes are left that somebody chose.
    pub fn is_spent(&self) -> bool {
        self.left.is_empty()
    }

    /// Below `n`, which is 1 to 65,536.
    pub fn below(&mut self, n: usize) -> usize {
        let low = usize::from(self.byte());
        if n <= 256 { low % n } else { (low << 8 | usize::from(self.byte())) % n }
    }

    pub fn chance(&mut self, one_in: usize) -> bool {
        self.below(one_in) == one_in - 1
    }

    /// In 0..1.
    pub fn unit(&mut self) -> f64 {
        f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / 65_536.0
    }

    /// In `low`..`high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn one_of<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }

    /// In a cube around the origin.
    pub fn place(&mut self, half: f64) -> DVec3 {
        DVec3::new(self.within(-half, half), self.within(-half, half), self.within(-half, half))
    }

    /// Of unit length.
    pub fn direction(&mut self) -> DVec3 {
        self.place(1.0).try_normalize().unwrap_or(DVec3::X)
    }
}
