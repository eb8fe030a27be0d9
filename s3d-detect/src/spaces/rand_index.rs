//! How far two partitions agree.

use std::collections::BTreeMap;

/// The adjusted Rand index of two partitions of the same things (Hubert and Arabie, 1985): 1 if they are the
/// same, 0 on average by chance. 1 if both have one part, or each thing is its own in both.
///
/// # Panics
/// If the two are of different length.
pub fn adjusted_rand_index(a: &[u32], b: &[u32]) -> f64 {
    assert_eq!(a.len(), b.len(), "partitions of the same things");
    let mut pairs: BTreeMap<(u32, u32), u64> = BTreeMap::new();
    a.iter()
        .zip(b)
        .for_each(|(&a, &b)| *pairs.entry((a, b)).or_default() += 1);
    let (mut of_a, mut of_b): (BTreeMap<u32, u64>, BTreeMap<u32, u64>) = Default::default();
    for (&(a, b), &n) in &pairs {
        *of_a.entry(a).or_default() += n;
        *of_b.entry(b).or_default() += n;
    }
    let choose = |n: u64| 0.5 * n as f64 * (n as f64 - 1.0);
    let together = |parts: &BTreeMap<u32, u64>| parts.values().map(|&n| choose(n)).sum::<f64>();
    let both: f64 = pairs.values().map(|&n| choose(n)).sum();
    let (of_a, of_b) = (together(&of_a), together(&of_b));
    let by_chance = of_a * of_b / choose(a.len() as u64).max(1.0);
    let most = 0.5 * (of_a + of_b);
    if most == by_chance {
        1.0
    } else {
        (both - by_chance) / (most - by_chance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert_eq!(adjusted_rand_index(&[0, 0, 1, 1], &[5, 5, 2, 2]), 1.0);
        // 2 pairs together in a, 1 in b, 1 in both, of 6: (1 − 1/3) / (1.5 − 1/3).
        let partial = adjusted_rand_index(&[0, 0, 1, 1], &[0, 0, 1, 2]);
        assert!((partial - 4.0 / 7.0).abs() < 1e-12);
        // None of the pairs of either is one of the other: (0 − 4/6) / (2 − 4/6).
        assert!((adjusted_rand_index(&[0, 0, 1, 1], &[0, 1, 0, 1]) + 0.5).abs() < 1e-12);
        assert_eq!(adjusted_rand_index(&[], &[]), 1.0);
        assert_eq!(adjusted_rand_index(&[3, 3], &[1, 1]), 1.0);
    }
}
