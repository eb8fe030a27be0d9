//! Which areas are tested together.

use s3d_dataset::{DataSet, Error, Result};

/// Which areas of a data set are tested, and which of them together.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Folds {
    /// All areas, together.
    #[default]
    All,
    /// These areas, together: 5 is what most results on S3DIS are of.
    Areas(Vec<u32>),
    /// Every area a fold of its own: six on S3DIS.
    EachArea,
    /// The three folds of the paper, as in the data set's `splits.json`: tested are 5, 2 and 4, 1 and 3 and
    /// 6. Those without an area in the data set are left out.
    Paper,
}

/// Areas that are tested together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fold {
    /// What it is called in tables: `areas 2, 4`.
    pub name: String,
    /// Numbers of areas, ascending, one at least.
    pub areas: Vec<u32>,
}

/// The areas that the paper's folds test. Source: Armeni et al. 2017, the folds of the cross-validation.
const PAPER: [&[u32]; 3] = [&[5], &[2, 4], &[1, 3, 6]];

impl Folds {
    /// The folds of a data set, none of them without an area.
    ///
    /// # Errors
    /// [`Error::Usage`] if the data set has not the areas that are asked for.
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
                if let Some(area) = areas.iter().find(|area| !present.contains(area)) {
                    return Err(Error::Usage(format!(
                        "the data set has no area {area}: it has {}",
                        listed(&present)
                    )));
                }
                vec![present.iter().copied().filter(|area| areas.contains(area)).collect()]
            }
            Self::EachArea => present.iter().map(|&area| vec![area]).collect(),
            Self::Paper => {
                let of = |fold: &[u32]| present.iter().copied().filter(|a| fold.contains(a)).collect();
                PAPER.into_iter().map(of).collect()
            }
        };
        let folds: Vec<Fold> = sets
            .into_iter()
            .filter(|areas| !areas.is_empty())
            .map(|areas| Fold::new(&areas))
            .collect();
        if folds.is_empty() {
            return Err(Error::Usage(format!(
                "no fold has one of the data set's areas, {}",
                listed(&present)
            )));
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

fn listed(areas: &[u32]) -> String {
    areas.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
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
    fn folds_hold_what_is_there() {
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
