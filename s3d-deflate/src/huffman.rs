//! Prefix codes: optimal lengths under a limit, and the canonical codes of RFC 1951, section 3.2.2.

/// Computes the lengths of an optimal prefix code for symbols that occur `counts` times, none above `limit`.
/// A symbol that does not occur gets 0, and a single symbol gets one bit.
///
/// If the optimal code is too deep, the longest codes are shortened and others lengthened until the code is
/// complete again. The result is nearly the best code under the limit.
///
/// # Panics
/// If there are more symbols than codes of `limit` bits.
pub(crate) fn code_lengths(counts: &[u32], limit: u8, lengths: &mut [u8]) {
    lengths.fill(0);

    // The count is in the high bits and the symbol in the low bits, to sort by count, then by symbol.
    let mut keys = [0u64; 288];
    let mut n = 0;
    for (symbol, &count) in counts.iter().enumerate() {
        if count > 0 {
            keys[n] = u64::from(count) << 16 | symbol as u64;
            n += 1;
        }
    }
    let keys = &mut keys[..n];
    assert!(n <= 1 << limit, "{n} symbols in codes of {limit} bits");
    if n <= 2 {
        keys.iter().for_each(|&key| lengths[(key & 0xffff) as usize] = 1);
        return;
    }
    keys.sort_unstable();

    let mut leaves_at = leaves_by_depth(keys, usize::from(limit));
    fit_to_limit(&mut leaves_at, usize::from(limit));

    let mut rarest_first = keys.iter();
    for d in (1..=usize::from(limit)).rev() {
        for &key in rarest_first.by_ref().take(leaves_at[d] as usize) {
            lengths[(key & 0xffff) as usize] = d as u8;
        }
    }
}

/// Returns the number of leaves at each depth of the optimal tree. Leaves deeper than `limit` count at
/// `limit`. `keys` are ascending.
fn leaves_by_depth(keys: &[u64], limit: usize) -> [u32; 16] {
    // There are two queues, of leaves and of joined nodes. Both are ascending, so the two smallest weights
    // are at their fronts.
    let n = keys.len();
    let mut weights = [0u64; 287];
    let mut parents = [0u16; 2 * 288];
    let mut leaf = 0;
    let mut node = 0;
    for joined in 0..n - 1 {
        let mut sum = 0;
        for _ in 0..2 {
            let from_leaf = node == joined || leaf < n && keys[leaf] >> 16 <= weights[node];
            let child = if from_leaf { leaf } else { n + node };
            sum += if from_leaf { keys[leaf] >> 16 } else { weights[node] };
            *(if from_leaf { &mut leaf } else { &mut node }) += 1;
            parents[child] = (n + joined) as u16;
        }
        weights[joined] = sum;
    }

    // From the back, the depth of a parent is known before the depths of its children.
    let mut depths = [0u8; 2 * 288];
    let mut leaves_at = [0u32; 16];
    for i in (0..2 * n - 2).rev() {
        depths[i] = (depths[usize::from(parents[i])] + 1).min(64);
        if i < n {
            leaves_at[usize::from(depths[i]).min(limit)] += 1;
        }
    }
    leaves_at
}

/// Moves leaves between depths until the code is complete.
fn fit_to_limit(leaves_at: &mut [u32; 16], limit: usize) {
    // Leaves that were moved up to the limit take too much room, in units of the longest code. Others get
    // longer codes and give it back.
    let mut taken: u32 = (1..=limit).map(|d| leaves_at[d] << (limit - d)).sum();
    while taken > 1 << limit {
        let d = (1..limit)
            .rev()
            .find(|&d| leaves_at[d] > 0)
            .expect("there is a code to lengthen");
        leaves_at[d] -= 1;
        leaves_at[d + 1] += 1;
        taken -= 1 << (limit - d - 1);
    }

    // The longest codes take the room that is left over.
    while taken < 1 << limit {
        let free = (1 << limit) - taken;
        let d = (2..=limit)
            .find(|&d| leaves_at[d] > 0 && 1 << (limit - d) <= free)
            .expect("a code to shorten");
        leaves_at[d] -= 1;
        leaves_at[d - 1] += 1;
        taken += 1 << (limit - d);
    }
}

/// Computes the canonical codes of these lengths. The first bit is the lowest, as codes are written.
pub(crate) fn canonical_codes(lengths: &[u8], codes: &mut [u16]) {
    let mut next = [0u32; 16];
    for &length in lengths {
        next[usize::from(length)] += 1;
    }
    next[0] = 0;

    let mut first = 0;
    for n in &mut next {
        let count = *n;
        first <<= 1;
        *n = first;
        first += count;
    }

    for (code, &length) in codes.iter_mut().zip(lengths) {
        let n = &mut next[usize::from(length)];
        *code = if length == 0 {
            0
        } else {
            (*n as u16).reverse_bits() >> (16 - length)
        };
        *n += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the cost of the best code without a limit. It adds up the sums of joined pairs, and searches
    /// for the smallest two each time.
    fn best_cost(counts: &[u32]) -> u64 {
        let mut weights: Vec<u64> = counts.iter().filter(|n| **n > 0).map(|n| u64::from(*n)).collect();
        let mut cost = 0;
        while weights.len() > 1 {
            weights.sort_unstable_by(|a, b| b.cmp(a));
            let sum = weights.pop().unwrap() + weights.pop().unwrap();
            weights.push(sum);
            cost += sum;
        }
        cost
    }

    proptest! {
        #[test]
        fn codes_are_complete_and_the_best(
            counts in proptest::collection::vec(prop_oneof![Just(0u32), 1u32..4, 1u32..100_000], 3..286),
            limit in 12u8..16,
        ) {
            let mut lengths = vec![99; counts.len()];
            code_lengths(&counts, limit, &mut lengths);
            let used = counts.iter().filter(|n| **n > 0).count();
            for (n, l) in counts.iter().zip(&lengths) {
                prop_assert!((*l > 0) == (*n > 0) && *l <= limit);
            }
            if used > 1 {
                let taken: u32 = lengths.iter().filter(|l| **l > 0).map(|l| 1 << (limit - l)).sum();
                prop_assert_eq!(taken, 1 << limit);
                let cost: u64 = counts.iter().zip(&lengths).map(|(n, l)| u64::from(*n) * u64::from(*l)).sum();
                let best = best_cost(&counts);
                // The limit may make the code a little longer.
                prop_assert!(cost >= best && cost <= best + best / 16, "{} against {}", cost, best);
                prop_assert!(cost == best || lengths.contains(&limit));
            }
        }
    }

    #[test]
    fn steep_counts_stay_below_the_limit() {
        // Fibonacci numbers make the deepest trees.
        let mut counts = vec![1u32, 1];
        while counts.len() < 40 {
            counts.push(counts[counts.len() - 1] + counts[counts.len() - 2]);
        }
        for limit in [7, 15] {
            let mut lengths = vec![0; 40];
            code_lengths(&counts, limit, &mut lengths);
            assert_eq!(lengths.iter().map(|l| 1u32 << (limit - l)).sum::<u32>(), 1 << limit);
        }
    }

    fn reversed(code: u16, bits: u32) -> u16 {
        code.reverse_bits() >> (16 - bits)
    }

    #[test]
    fn codes_are_those_of_the_standards_example() {
        // RFC 1951, 3.2.2: A to H have the lengths 3 3 3 3 3 2 4 4.
        let mut codes = [0; 8];
        canonical_codes(&[3, 3, 3, 3, 3, 2, 4, 4], &mut codes);
        let expected = [(2, 3), (3, 3), (4, 3), (5, 3), (6, 3), (0, 2), (14, 4), (15, 4)];
        assert_eq!(codes, expected.map(|(code, bits)| reversed(code, bits)));
    }
}
