//! Sorting by numbers.
//!
//! The standard sort, instantiated for an element type, adds 5 to 30 kB to the WebAssembly module, several hundred in
//! all. Elements of all types are therefore sorted as pairs of an integer rank and an index, by a single instance of
//! the sort.

/// Returns the rank of a number for sorting: an integer whose order is that of `f32::total_cmp`.
pub fn rank_f32(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Returns the rank of a number for sorting: an integer whose order is that of `f64::total_cmp`.
pub fn rank_f64(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// Combines two ranks into one for sorting: ordered by the first, and by the second if the first ones are equal.
pub fn combined_rank(first: u32, second: u32) -> u64 {
    u64::from(first) << 32 | u64::from(second)
}

/// Sorts items in ascending order of the integer that `rank` returns for each; items of equal rank keep their order. At
/// most 2³² items.
pub fn sort_by_rank<T: Copy>(items: &mut [T], rank: impl Fn(&T) -> u64) {
    let mut order: Vec<(u64, u32)> = items.iter().map(rank).zip(0..).collect();
    order.sort_unstable();
    let before = items.to_vec();
    for (item, (_, i)) in items.iter_mut().zip(order) {
        *item = before[i as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_arch = "wasm32")]
    use wasm_bindgen_test::wasm_bindgen_test as test;

    const NUMBERS: [f64; 11] =
        [f64::NEG_INFINITY, -1e30, -2.0, -1.0, -1e-40, -0.0, 0.0, 1e-40, 1.0, 3.0, f64::INFINITY];

    #[test]
    fn ranks_are_in_the_order_of_their_numbers() {
        let all = [&NUMBERS[..], &[f64::NAN, -f64::NAN]].concat();
        for (&a, &b) in all.iter().flat_map(|a| all.iter().map(move |b| (a, b))) {
            assert_eq!(rank_f64(a).cmp(&rank_f64(b)), a.total_cmp(&b), "{a} {b}");
            assert_eq!(
                rank_f32(a as f32).cmp(&rank_f32(b as f32)),
                (a as f32).total_cmp(&(b as f32)),
                "{a} {b}"
            );
        }
        assert!(
            combined_rank(1, u32::MAX) < combined_rank(2, 0) && combined_rank(2, 0) < combined_rank(2, 1)
        );
    }

    #[test]
    fn equal_ranks_stay_in_their_order() {
        let mut items: Vec<(u32, u32)> = (0..100).map(|i| (i * 37 % 11, i)).collect();
        let mut expected = items.clone();
        expected.sort_by_key(|&(rank, _)| rank);
        sort_by_rank(&mut items, |&(rank, _)| u64::from(rank));
        assert_eq!(items, expected);
        sort_by_rank(&mut items[..0], |_| 0);
    }
}
