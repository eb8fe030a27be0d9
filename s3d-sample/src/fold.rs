//! The three folds of areas for cross-validation.

/// A split of areas into those to train on and those to test on.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Fold {
    /// Its number, 1 to 3.
    pub number: u32,
    /// The areas to train on, ascending.
    pub train: Vec<u32>,
    /// The areas to test on, ascending.
    pub test: Vec<u32>,
}

/// The published folds over areas 1 to 6: number, training areas, test areas. Source: formats.md, "What is
/// written".
const PUBLISHED: [(u32, &[u32], &[u32]); 3] =
    [(1, &[1, 2, 3, 4, 6], &[5]), (2, &[1, 3, 5, 6], &[2, 4]), (3, &[2, 4, 5], &[1, 3, 6])];

/// The published folds, cut down to the areas that are there.
///
/// Areas that are not in `present_areas` are dropped from both sides, and a fold that has a side left empty
/// is dropped with its number; areas that the published folds do not know belong to no fold. Order and
/// repetitions in `present_areas` do not matter.
///
/// ```
/// let folds = s3d_sample::folds(&[1, 5]);
/// assert_eq!(folds.iter().map(|f| f.number).collect::<Vec<_>>(), [1, 3]);
/// assert_eq!((&folds[0].train[..], &folds[0].test[..]), (&[1][..], &[5][..]));
/// ```
pub fn folds(present_areas: &[u32]) -> Vec<Fold> {
    let present = |areas: &[u32]| {
        areas
            .iter()
            .copied()
            .filter(|a| present_areas.contains(a))
            .collect::<Vec<_>>()
    };
    PUBLISHED
        .iter()
        .map(|&(number, train, test)| Fold { number, train: present(train), test: present(test) })
        .filter(|fold| !fold.train.is_empty() && !fold.test.is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn all_areas_give_the_published_folds() {
        let folds = folds(&[6, 5, 4, 3, 2, 1, 1]);
        let of = |i: usize| (folds[i].number, folds[i].train.clone(), folds[i].test.clone());
        assert_eq!(folds.len(), 3);
        assert_eq!(of(0), (1, vec![1, 2, 3, 4, 6], vec![5]));
        assert_eq!(of(1), (2, vec![1, 3, 5, 6], vec![2, 4]));
        assert_eq!(of(2), (3, vec![2, 4, 5], vec![1, 3, 6]));
    }

    #[test]
    fn too_few_areas_allow_no_fold() {
        for areas in [&[][..], &[1], &[1, 3, 6], &[1, 7, 0]] {
            let numbers: Vec<u32> = folds(areas).iter().map(|f| f.number).collect();
            assert!(numbers.is_empty(), "{areas:?}: {numbers:?}");
        }
        assert_eq!(folds(&[2, 1]).iter().map(|f| f.number).collect::<Vec<_>>(), [2, 3]);
    }

    proptest! {
        #[test]
        fn both_sides_share_out_the_present_areas(areas in prop::collection::vec(0u32..9, 0..12)) {
            for fold in folds(&areas) {
                let mut all = [fold.train.clone(), fold.test.clone()].concat();
                prop_assert!(fold.train.is_sorted() && fold.test.is_sorted());
                all.sort_unstable();
                let mut known: Vec<u32> = areas.iter().copied().filter(|a| (1..=6).contains(a)).collect();
                known.sort_unstable();
                known.dedup();
                prop_assert_eq!(all, known);
            }
        }
    }
}
