//! Folds: areas that are tested together.

use crate::error::{Error, Result, listed};
use s3d_dataset::DataSet;

/// The choice of the areas to test, and of those to test together.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Folds {
    /// All areas, together.
    #[default]
    All,
    /// These areas, together. Most results on S3DIS are of area 5.
    Areas(Vec<u32>),
    /// Each area in a fold of its own: six on S3DIS.
    EachArea,
    /// The three folds of the paper, as in `splits.json` of the data set. They test area 5, areas 2 and 4,
    /// and areas 1, 3 and 6. A fold without an area in the data set is left out.
    Paper,
}

/// Areas that are tested together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fold {
    /// Its name in tables: `areas 2, 4`.
    pub name: String,
    /// The numbers of its areas, ascending, at least one.
    pub areas: Vec<u32>,
}

/// The areas that the folds of the paper test. Source: Armeni et al. 2017, the folds of the cross-validation.
const PAPER: [&[u32]; 3] = [&[5], &[2, 4], &[1, 3, 6]];

impl Folds {
    /// Returns the folds of a data set. Each has an area.
    ///
    /// # Errors
    /// [`Error::UnknownArea`] or [`Error::NoFold`] if the data set lacks the areas that were asked for.
    pub fn of(&self, data: &DataSet) -> Result<Vec<Fold>> {
        self.of_areas(data.areas())
    }

    fn of_areas(&self, present: &[u32]) -> Result<Vec<Fold>> {
        let mut present = present.to_vec();
        present.sort_unstable();
        present.dedup();

        let sets: Vec<Vec<u32>> = match self {
            Self::All => vec![present.clone()],
            Self::Areas(areas) => {
                if let Some(&area) = areas.iter().find(|area| !present.contains(area)) {
                    return Err(Error::UnknownArea { area, areas: present });
                }
                vec![present.iter().copied().filter(|area| areas.contains(area)).collect()]
            }
            Self::EachArea => present.iter().map(|&area| vec![area]).collect(),
            Self::Paper => PAPER
                .into_iter()
                .map(|fold| present.iter().copied().filter(|a| fold.contains(a)).collect())
                .collect(),
        };

        let folds: Vec<Fold> = sets
            .into_iter()
            .filter(|areas| !areas.is_empty())
            .map(|areas| Fold::new(&areas))
            .collect();
        if folds.is_empty() {
            return Err(Error::NoFold { folds: self.clone(), areas: present });
        }
        Ok(folds)
    }
}

impl Fold {
    fn new(areas: &[u32]) -> Self {
        let noun = if areas.len() == 1 { "area" } else { "areas" };
        Self { name: format!("{noun} {}", listed(areas)), areas: areas.to_vec() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn areas(folds: &Folds, present: &[u32]) -> Vec<Vec<u32>> {
        folds
            .of_areas(present)
            .unwrap()
            .into_iter()
            .map(|fold| fold.areas)
            .collect()
    }

    #[test]
    fn folds_hold_the_areas_that_exist() {
        let all = [6, 5, 4, 3, 2, 1];
        assert_eq!(areas(&Folds::All, &all), [[1, 2, 3, 4, 5, 6]]);
        assert_eq!(areas(&Folds::Areas(vec![5]), &all), [[5]]);
        assert_eq!(areas(&Folds::EachArea, &[2, 7]), [[2], [7]]);
        assert_eq!(areas(&Folds::Paper, &all), [vec![5], vec![2, 4], vec![1, 3, 6]]);
        assert_eq!(areas(&Folds::Paper, &[1, 4]), [[4], [1]]);
        assert_eq!(Folds::Paper.of_areas(&all).unwrap()[1].name, "areas 2, 4");

        let error = Folds::Areas(vec![5]).of_areas(&[1, 2]).unwrap_err().to_string();
        assert!(error.contains("no area 5") && error.contains("1, 2"), "{error}");
        assert!(Folds::Paper.of_areas(&[7]).is_err());
    }
}
