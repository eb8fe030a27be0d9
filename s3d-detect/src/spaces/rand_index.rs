//! A measure of the agreement of two partitions.

use std::collections::BTreeMap;

/// Returns the adjusted Rand index of two partitions of the same things (Hubert and Arabie, 1985): 1 if they
/// are the same, 0 on average by chance. It is 1 if both have a single part, and if each thing is a part in
/// both.
///
/// # Panics
/// If the two have different lengths.
pub fn adjusted_rand_index(a: &[u32], b: &[u32]) -> f64 {
    assert_eq!(a.len(), b.len(), "partitions of the same things");
    let mut pairs: BTreeMap<(u32, u32), u64> = BTreeMap::new();
    a.iter()
        .zip(b)
        .for_each(|(&a, &b)| *pairs.entry((a, b)).or_default() += 1);

    let mut of_a: BTreeMap<u32, u64> = BTreeMap::new();
    let mut of_b: BTreeMap<u32, u64> = BTreeMap::new();
    for (&(a, b), &n) in &pairs {
        *of_a.entry(a).or_default() += n;
        *of_b.entry(b).or_default() += n;
    }

    let both = pairs_together(pairs.values());
    let in_a = pairs_together(of_a.values());
    let in_b = pairs_together(of_b.values());
    let by_chance = in_a * in_b / choose_two(a.len() as u64).max(1.0);
    let most = 0.5 * (in_a + in_b);
    if most == by_chance {
        1.0
    } else {
        (both - by_chance) / (most - by_chance)
    }
}

/// Returns the number of pairs of things that are in one part, from the sizes of the parts.
fn pairs_together<'a>(parts: impl Iterator<Item = &'a u64>) -> f64 {
    parts.map(|&n| choose_two(n)).sum()
}

fn choose_two(n: u64) -> f64 {
    0.5 * n as f64 * (n as f64 - 1.0)
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
        // No pair is together in both: (0 − 4/6) / (2 − 4/6).
        assert!((adjusted_rand_index(&[0, 0, 1, 1], &[0, 1, 0, 1]) + 0.5).abs() < 1e-12);
        assert_eq!(adjusted_rand_index(&[], &[]), 1.0);
        assert_eq!(adjusted_rand_index(&[3, 3], &[1, 1]), 1.0);
    }
}
