//! The three folds of areas for cross-validation.

/// A split of areas into training areas and test areas.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Fold {
    /// The number of the fold, 1 to 3.
    pub number: u32,
    /// The areas to train on, ascending.
    pub train: Vec<u32>,
    /// The areas to test on, ascending.
    pub test: Vec<u32>,
}

/// The published folds of areas 1 to 6: number, training areas, test areas. Source: `s3d_io::formats`, "What
/// is written".
const PUBLISHED: [(u32, &[u32], &[u32]); 3] =
    [(1, &[1, 2, 3, 4, 6], &[5]), (2, &[1, 3, 5, 6], &[2, 4]), (3, &[2, 4, 5], &[1, 3, 6])];

/// Returns the published folds, cut down to the areas in `present_areas`.
///
/// A fold whose training or test side would be empty is left out; the others keep their numbers. Areas other
/// than 1 to 6 belong to no fold. The order of `present_areas` and repetitions in it do not matter.
///
/// ```
/// let folds = s3d_sample::folds(&[1, 5]);
/// assert_eq!(folds.iter().map(|f| f.number).collect::<Vec<_>>(), [1, 3]);
/// assert_eq!((&folds[0].train[..], &folds[0].test[..]), (&[1][..], &[5][..]));
/// ```
pub fn folds(present_areas: &[u32]) -> Vec<Fold> {
    PUBLISHED
        .iter()
        .map(|&(number, train, test)| Fold {
            number,
            train: common(train, present_areas),
            test: common(test, present_areas),
        })
        .filter(|fold| !fold.train.is_empty() && !fold.test.is_empty())
        .collect()
}

/// Returns the members of `areas` that are in `present_areas` too.
fn common(areas: &[u32], present_areas: &[u32]) -> Vec<u32> {
    areas
        .iter()
        .copied()
        .filter(|area| present_areas.contains(area))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn all_areas_give_the_published_folds() {
        let folds = folds(&[6, 5, 4, 3, 2, 1, 1]);
        let expected = [
            Fold { number: 1, train: vec![1, 2, 3, 4, 6], test: vec![5] },
            Fold { number: 2, train: vec![1, 3, 5, 6], test: vec![2, 4] },
            Fold { number: 3, train: vec![2, 4, 5], test: vec![1, 3, 6] },
        ];
        assert_eq!(folds, expected);
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
