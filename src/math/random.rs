//! Random numbers that are the same on every platform: PCG-XSH-RR (O'Neill, 2014).

/// A seeded generator of random numbers, which are the same on every platform.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Creates a generator whose sequence of numbers is determined by `seed`.
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x853C_49E6_748F_EA9B);
        random.next_u32();
        random
    }

    /// Returns the next 32 random bits of the sequence.
    pub fn next_u32(&mut self) -> u32 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (((state >> 18) ^ state) >> 27) as u32;
        mixed.rotate_right((state >> 59) as u32)
    }

    /// Returns a random integer in `0..limit`.
    pub fn below(&mut self, limit: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(limit)) >> 32) as u32
    }

    /// Returns a random permutation of 0 to `count` − 1.
    pub fn permutation(&mut self, count: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count as u32).collect();
        for i in (1..count).rev() {
            order.swap(i, self.below(i as u32 + 1) as usize);
        }
        order
    }
}

#[cfg(test)]
impl Random {
    /// Returns a random number in `0.0..1.0`.
    pub fn unit(&mut self) -> f64 {
        f64::from(self.next_u32()) / 4_294_967_296.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    #[test]
    fn an_order_has_every_number_once_and_a_seed_gives_one_order() {
        let order = Random::new(3).permutation(1000);
        assert_eq!(order, Random::new(3).permutation(1000));
        assert_ne!(order, Random::new(4).permutation(1000));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..1000).collect::<Vec<_>>());
        assert!(order.iter().zip(0..).filter(|(a, b)| *a == b).count() < 10);
    }

    #[test]
    fn numbers_are_spread_evenly() {
        let (mut random, mut counts) = (Random::new(1), [0; 10]);
        (0..10_000).for_each(|_| counts[random.below(10) as usize] += 1);
        assert!(counts.iter().all(|c| (850..1150).contains(c)), "{counts:?}");
    }
}
