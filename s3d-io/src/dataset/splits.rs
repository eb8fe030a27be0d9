//! `splits.json`: the areas to train on and the areas to test on. Source: [`crate::formats`], "What is
//! written".

use crate::error::Result;
use crate::fs::atomic::write_whole;
use crate::fs::json::{read_json, write_json};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A fold of the cross-validation. The fields have the names of the file's keys.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Split {
    /// The fold's number, from 1.
    pub fold: u32,
    /// The numbers of the areas to train on.
    pub train_areas: Vec<u32>,
    /// The numbers of the areas to test on.
    pub test_areas: Vec<u32>,
}

#[derive(Serialize, Deserialize)]
struct Splits {
    folds: Vec<Split>,
}

/// Writes the folds, `{"folds": [{"fold": 1, "train_areas": [1, …], "test_areas": [5]}, …]}`, and returns
/// the file's size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_splits(path: &Path, folds: &[Split]) -> Result<u64> {
    write_json(path, &Splits { folds: folds.to_vec() })
}

/// Reads the folds.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io); [`Error::Format`](crate::Error::Format) if the file holds something else.
pub fn read_splits(path: &Path) -> Result<Vec<Split>> {
    let Splits { folds } = read_json(path)?;
    Ok(folds)
}

/// Writes a list of images that depth loaders such as UniFuse's read. A line holds the colour image and the
/// depth image, with a space between them. Their paths are relative to the data set's folder, with `/`.
/// Returns the file's size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
pub fn write_image_list(path: &Path, pairs: &[(String, String)]) -> Result<u64> {
    write_whole(path, |w| {
        pairs
            .iter()
            .try_for_each(|(color, depth)| writeln!(w, "{color} {depth}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fs::atomic::write_bytes;

    fn pair(i: u32) -> (String, String) {
        (format!("area_1/pano/rgb/{i}.png"), format!("area_1/pano/depth/{i}.png"))
    }

    #[test]
    fn a_list_is_two_paths_a_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("fold_1_train.txt");
        write_image_list(&path, &[pair(1), pair(2)]).unwrap();
        assert_eq!(
            std::fs::read_to_string(&path).unwrap(),
            "area_1/pano/rgb/1.png area_1/pano/depth/1.png\narea_1/pano/rgb/2.png area_1/pano/depth/2.png\n"
        );
    }

    #[test]
    fn folds_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("splits.json");
        let folds = [
            Split { fold: 1, train_areas: vec![1, 2, 3, 4, 6], test_areas: vec![5] },
            Split { fold: 2, train_areas: vec![1, 3, 5, 6], test_areas: vec![2, 4] },
        ];
        write_splits(&path, &folds).unwrap();
        assert_eq!(read_splits(&path).unwrap(), folds);
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(json["folds"][1]["test_areas"], serde_json::json!([2, 4]));
        write_bytes(&path, b"{\"folds\": [{\"fold\": 1}]}").unwrap();
        assert!(
            read_splits(&path)
                .unwrap_err()
                .to_string()
                .contains("missing field `train_areas`")
        );
    }
}
