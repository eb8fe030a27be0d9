//! Finds the files of predictions by the names that trainers give them.

use super::truth::Room;
use crate::error::Result;
use crate::folder::entries;
use crate::task::Task;
use s3d_dataset::s3d_io;
use s3d_io::Error as FileError;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The ending of lists of masks, in ScanNet's form. The masks lie in folders beside the list.
pub(super) const LIST: &str = "txt";

/// The most names that a sentence lists.
const LISTED: usize = 5;

/// Returns the file of each room, in their order, and sentences on other files.
pub(super) fn find(task: &Task<'_>, rooms: &[Room], endings: &[&str]) -> Result<(Vec<PathBuf>, Vec<String>)> {
    let mut known: BTreeSet<(u32, String)> = BTreeSet::new();
    for area in task.data.areas() {
        known.extend(
            task.data
                .tree_rooms(*area)?
                .into_iter()
                .map(|room| (room.area, room.name)),
        );
    }

    let mut found: BTreeMap<(u32, String), PathBuf> = BTreeMap::new();
    let mut others = Vec::new();
    for path in files(task.predictions)? {
        let room = room_of(&path, endings).filter(|room| known.contains(room));
        let Some(room) = room else {
            if !(path.is_dir() && endings.contains(&LIST)) {
                others.push(below(task.predictions, &path));
            }
            continue;
        };
        if let Some(first) = found.insert(room, path.clone()) {
            let message = format!(
                "is a second prediction of the room, beside {}: leave one of them",
                below(task.predictions, &first)
            );
            return Err(FileError::format(&path, message).into());
        }
    }

    let paths: Vec<Option<PathBuf>> = rooms.iter().map(|room| found.remove(&key_of(room))).collect();
    let missing: Vec<&Room> = rooms
        .iter()
        .zip(&paths)
        .filter(|(_, p)| p.is_none())
        .map(|(r, _)| r)
        .collect();
    if let Some(first) = missing.first() {
        let tree = &first.tree;
        let names: Vec<String> = missing.iter().map(|room| room.name()).collect();
        let mut message = format!(
            "has no prediction of {} of {} rooms: {}; a prediction is called Area_{area}-{name}.{ending}, \
             Area_{area}_{name}.{ending} or Area_{area}/{name}.{ending}, or the same with _pred",
            missing.len(),
            rooms.len(),
            listed(&names),
            area = tree.area,
            name = tree.name,
            ending = endings.join(" or ."),
        );
        if !others.is_empty() {
            message += &format!("; of no room of the data set are {}", listed(&others));
        }
        return Err(FileError::format(task.predictions, message).into());
    }

    let mut notes = Vec::new();
    if !found.is_empty() {
        notes.push(format!("Predictions of {} rooms that are not tested were left out.", found.len()));
    }
    if !others.is_empty() {
        let names = listed(&others);
        notes.push(format!("Beside the predictions lie {} others, left out: {names}.", others.len()));
    }
    Ok((paths.into_iter().flatten().collect(), notes))
}

fn key_of(room: &Room) -> (u32, String) {
    (room.tree.area, room.tree.name.clone())
}

/// Returns the entries of the folder and of folders of areas, by name, without hidden ones.
fn files(dir: &Path) -> Result<Vec<PathBuf>> {
    if dir.is_file() {
        let message = "is a file: predictions are a folder with a file a room";
        return Err(FileError::format(dir, message).into());
    }
    let mut found = Vec::new();
    for path in entries(dir)? {
        if path.is_dir() && area_of_folder(&path).is_some() {
            found.extend(entries(&path)?);
        } else {
            found.push(path);
        }
    }
    Ok(found)
}

fn area_of_folder(path: &Path) -> Option<u32> {
    path.file_name()?.to_str()?.strip_prefix("Area_")?.parse().ok()
}

/// Returns the area and the room that a file is named after.
fn room_of(path: &Path, endings: &[&str]) -> Option<(u32, String)> {
    let ending = path.extension()?.to_str()?;
    if !endings.iter().any(|e| ending.eq_ignore_ascii_case(e)) || path.is_dir() {
        return None;
    }
    let stem = path.file_stem()?.to_str()?;
    let stem = stem.strip_suffix("_pred").unwrap_or(stem);
    let named = stem.strip_prefix("Area_").and_then(|rest| {
        let (area, room) = rest.split_once(['-', '_'])?;
        Some((area.parse().ok()?, room.to_owned()))
    });
    named.or_else(|| Some((area_of_folder(path.parent()?)?, stem.to_owned())))
}

fn below(dir: &Path, path: &Path) -> String {
    path.strip_prefix(dir).unwrap_or(path).display().to_string()
}

/// Lists the first names, and the number of the others.
fn listed(names: &[String]) -> String {
    let first = names.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(LISTED) {
        0 => first,
        more => format!("{first} and {more} more"),
    }
}

/// Returns the error for a file of predictions.
pub(super) fn wrong(path: &Path, message: impl Into<String>) -> s3d_dataset::Error {
    FileError::format(path, message).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room_named(path: &str) -> Option<(u32, String)> {
        room_of(Path::new(path), &["npy", "npz"])
    }

    #[test]
    fn rooms_are_found_by_the_names_of_trainers() {
        for path in [
            "result/Area_5-office_1_pred.npy",
            "Area_5_office_1.npz",
            "Area_5/office_1.npy",
            "x/Area_5/office_1_pred.NPY",
            "Area_5/Area_5-office_1.npy",
        ] {
            assert_eq!(room_named(path), Some((5, "office_1".to_owned())), "{path}");
        }
        for path in ["office_1.npy", "Area_5/office_1.txt", "Area_5.pth", "Area_x-office_1.npy"] {
            assert_eq!(room_named(path), None, "{path}");
        }
        assert_eq!(listed(&(0..7).map(|i| i.to_string()).collect::<Vec<_>>()), "0, 1, 2, 3, 4 and 2 more");
    }
}
