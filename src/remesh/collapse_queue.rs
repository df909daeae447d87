//! The priority queue of decimation.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The waiting candidates are divided by this number for those that are sorted next. With 1, all are in one heap, and cache
/// misses take a third of the time of decimation.
const SHARE: usize = 16;

/// The smallest number of candidates that are sorted next.
const AT_LEAST: usize = 1024;

/// An item of a [`CollapseQueue`].
pub(super) trait Ranked: Ord + Copy {
    /// Returns a number by which items are ordered first.
    fn rank(&self) -> u64;
}

/// A priority queue that returns the least item first, and keeps only the lowest ranks in a heap: most candidates for a
/// collapse are outdated before it is their turn.
pub(super) struct CollapseQueue<T> {
    heap: BinaryHeap<Reverse<T>>,
    /// The highest rank in the heap; higher ones wait.
    limit: u64,
    waiting: Vec<T>,
}

impl<T: Ranked> CollapseQueue<T> {
    pub fn new() -> Self {
        Self { heap: BinaryHeap::new(), limit: 0, waiting: Vec::new() }
    }

    pub fn push(&mut self, item: T) {
        if item.rank() <= self.limit {
            self.heap.push(Reverse(item));
        } else {
            self.waiting.push(item);
        }
    }

    /// Removes and returns the least item. Items that are not `current`, and will never be again, may be dropped instead.
    pub fn pop(&mut self, current: impl Fn(&T) -> bool) -> Option<T> {
        if self.heap.is_empty() {
            self.refill(current);
        }
        self.heap.pop().map(|Reverse(item)| item)
    }

    /// Fills the empty heap with the lowest ranks that wait.
    fn refill(&mut self, current: impl Fn(&T) -> bool) {
        self.waiting.retain(current);
        let Some(last) = self.waiting.len().checked_sub(1) else { return };
        let next = AT_LEAST.max(self.waiting.len() / SHARE).min(last);
        let limit = self.waiting.select_nth_unstable_by_key(next, T::rank).1.rank();
        self.limit = limit;
        let lowest = self.waiting.extract_if(.., |item| item.rank() <= limit);
        self.heap = lowest.map(Reverse).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Random;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    impl Ranked for (u64, u32) {
        fn rank(&self) -> u64 {
            self.0
        }
    }

    /// Items are pushed while others are popped, also lower ones than the last; among them are many of the same rank.
    #[test]
    fn items_come_in_the_order_of_a_heap() {
        for spread in [1, 3, 10_000] {
            let mut random = Random::new(spread);
            let (mut queue, mut heap) = (CollapseQueue::new(), BinaryHeap::new());
            for round in 0..40_u32 {
                let pushed = if round < 20 { 1000 } else { 20 };
                for k in 0..pushed {
                    let item = (random.below(spread as u32).into(), round * 1000 + k);
                    queue.push(item);
                    heap.push(Reverse(item));
                }
                for _ in 0..random.below(1500) {
                    assert_eq!(queue.pop(|_| true), heap.pop().map(|Reverse(item)| item));
                }
            }
            while let Some(Reverse(item)) = heap.pop() {
                assert_eq!(queue.pop(|_| true), Some(item));
            }
            assert_eq!(queue.pop(|_| true), None);
        }
    }

    #[test]
    fn outdated_items_are_dropped_while_they_wait() {
        let mut queue = CollapseQueue::new();
        (0..10_000).for_each(|k| queue.push((u64::from(k) + 1, k)));
        let is_even = |item: &(u64, u32)| item.1.is_multiple_of(2);
        let popped = (0..).map_while(|_: u32| queue.pop(is_even)).collect::<Vec<_>>();
        assert_eq!(popped, (0..10_000).step_by(2).map(|k| (u64::from(k) + 1, k)).collect::<Vec<_>>());
    }
}
