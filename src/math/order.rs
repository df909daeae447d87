//! Sorting by numbers.
//!
//! The standard sort, instantiated for an element type, adds 5 to 30 kB to the WebAssembly module, several hundred in
//! all. Elements of all types are therefore sorted as integers: as ranks of 64 bits, as pairs of such a rank and an
//! index, or as indices.

/// Returns the rank of a number for sorting: an integer whose order is that of `f32::total_cmp`.
pub fn rank_f32(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

/// Returns the number with the given rank, see [`rank_f32`].
fn ranked_f32(rank: u32) -> f32 {
    f32::from_bits(if rank >> 31 == 1 { rank & !(1 << 31) } else { !rank })
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

/// Sorts numbers, such as indices, in ascending order and removes duplicates. Never inlined, so that the WebAssembly
/// module contains one instance of the sort.
#[inline(never)]
pub fn sort_distinct(numbers: &mut Vec<u32>) {
    numbers.sort_unstable();
    numbers.dedup();
}

/// Sorts ranks in ascending order. Never inlined, as [`sort_distinct`].
#[inline(never)]
pub fn sort_ranks(ranks: &mut [u64]) {
    ranks.sort_unstable();
}

/// Sorts pairs of a rank and an index in ascending order, by rank first. Never inlined, as [`sort_distinct`].
#[inline(never)]
pub fn sort_pairs(pairs: &mut [(u64, u32)]) {
    pairs.sort_unstable();
}

/// Moves the `count` least pairs of a rank and an index to the start, in any order, and the next one to position
/// `count`, which must exist. Never inlined, as [`sort_distinct`].
#[inline(never)]
pub fn select_least(pairs: &mut [(u64, u32)], count: usize) {
    pairs.select_nth_unstable(count);
}

/// Returns the median of numbers in the order of `f32::total_cmp`, the upper one of two; `None` without numbers.
pub fn median(numbers: impl Iterator<Item = f32>) -> Option<f32> {
    let mut pairs: Vec<(u64, u32)> = numbers.map(|x| (0, rank_f32(x))).collect();
    if pairs.is_empty() {
        return None;
    }
    let middle = pairs.len() / 2;
    select_least(&mut pairs, middle);
    Some(ranked_f32(pairs[middle].1))
}

/// Sorts items in ascending order of the integer that `rank` returns for each; items of equal rank keep their order. At
/// most 2³² items.
pub fn sort_by_rank<T: Copy>(items: &mut [T], rank: impl Fn(&T) -> u64) {
    let mut order: Vec<(u64, u32)> = items.iter().map(rank).zip(0..).collect();
    sort_pairs(&mut order);
    let before = items.to_vec();
    for (item, (_, i)) in items.iter_mut().zip(order) {
        *item = before[i as usize];
    }
}

/// Sorts pairs of three numbers and an index in ascending order of the first number, then the second, then the third;
/// pairs of equal numbers keep their order. At most 2³² pairs.
pub fn sort_triples(pairs: &mut [([u32; 3], u32)]) {
    let last_first: [fn([u32; 3]) -> u64; 2] = [|[_, _, z]| z.into(), |[x, y, _]| combined_rank(x, y)];
    for rank in last_first {
        sort_by_rank(pairs, |&(numbers, _)| rank(numbers));
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
    fn medians_are_those_of_the_sorted_numbers() {
        let all: Vec<f32> = NUMBERS.iter().map(|&x| x as f32).chain([f32::NAN, -f32::NAN]).collect();
        for (count, shift) in
            (0..=all.len()).flat_map(|count| (0..all.len()).map(move |shift| (count, shift)))
        {
            let some: Vec<f32> = all.iter().cycle().skip(shift).take(count).copied().collect();
            let mut sorted = some.clone();
            sorted.sort_by(f32::total_cmp);
            let expected = sorted.get(count / 2).map(|x| x.to_bits());
            assert_eq!(median(some.into_iter()).map(f32::to_bits), expected, "{count} from {shift}");
        }
    }

    #[test]
    fn numbers_are_sorted_and_distinct() {
        let mut numbers: Vec<u32> = (0..100).map(|i| i * 37 % 50).collect();
        sort_distinct(&mut numbers);
        assert_eq!(numbers, (0..50).collect::<Vec<_>>());
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

    #[test]
    fn triples_are_sorted_by_the_first_number_then_the_second_then_the_third() {
        let key = |i: u32| [i * 7 % 3, i * 5 % 4, i * 3 % 5];
        let mut items: Vec<([u32; 3], u32)> = (0..200).map(|i| (key(i), i)).collect();
        let mut expected = items.clone();
        expected.sort_unstable();
        sort_triples(&mut items);
        assert_eq!(items, expected);
    }
}
