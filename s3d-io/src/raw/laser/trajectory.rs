//! The path of a mobile scanner: where it was at which time.

use crate::camera::programs::tum;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::quote::quote;
use crate::fs::read_file;
use s3d_geom::glam::{DAffine3, DVec3};
use std::path::Path;

/// Between two places that are farther apart in time, the scanner's place is unknown, seconds.
const GAP_S: f64 = 1.0;

/// The path of a mobile scanner.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// The times in seconds, ascending, each once.
    times_s: Vec<f64>,
    /// The places at these times, in the world (metres, +Z up).
    places_m: Vec<DVec3>,
}

impl Trajectory {
    /// Reads a trajectory: lines `t x y z qx qy qz qw`, as TUM's benchmark has them, or a table whose first
    /// line names the columns `t` (or `time`, `timestamp`, `gps_time`), `x`, `y` and `z`, among others.
    /// `world_from_file` leads from its frame to the world.
    ///
    /// ```
    /// use s3d_geom::glam::DAffine3;
    /// use s3d_io::raw::Trajectory;
    ///
    /// # let folder = tempfile::tempdir().unwrap();
    /// # let path = folder.path().join("path.csv");
    /// std::fs::write(&path, "t,x,y,z\n10,0,0,1.5\n10.5,1,0,1.5\n").unwrap();
    /// let trajectory = Trajectory::read(&path, &DAffine3::IDENTITY)?;
    /// assert_eq!(trajectory.place_at(10.25).unwrap().to_array(), [0.5, 0.0, 1.5]);
    /// assert_eq!(trajectory.place_at(12.0), None);
    /// # Ok::<(), s3d_io::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the line if it is no such list, or has no two times.
    pub fn read(path: &Path, world_from_file: &DAffine3) -> Result<Self> {
        let bytes = read_file(path)?;
        let text = text_of(&bytes, path)?;
        let mut lines = text.split(|&b| b == b'\n').map(<[u8]>::trim_ascii);
        let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#"));
        let places = match columns_of(first.unwrap_or_default()) {
            Some(columns) => read_table(path, &text, &columns)?,
            None => {
                let cameras = tum::read(path, &text)?;
                let place = |camera: &crate::camera::PosedCamera| {
                    (camera.name.parse().unwrap_or(f64::NAN), camera.pose.location)
                };
                cameras.iter().map(place).collect()
            }
        };
        Self::of_places(path, places, world_from_file)
    }

    fn of_places(path: &Path, mut places: Vec<(f64, DVec3)>, world_from_file: &DAffine3) -> Result<Self> {
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        places.dedup_by(|b, a| a.0 == b.0);
        if places.len() < 2 {
            let message = format!("has {} different times: a trajectory has at least two", places.len());
            return Err(Error::format(path, message));
        }
        let (times_s, places_m) = places
            .into_iter()
            .map(|(time, place)| (time, world_from_file.transform_point3(place)))
            .unzip();
        Ok(Self { times_s, places_m })
    }

    /// Returns the first and the last time, seconds.
    pub fn times_s(&self) -> [f64; 2] {
        [self.times_s.first(), self.times_s.last()].map(|time| time.copied().unwrap_or(f64::NAN))
    }

    /// Returns the place at a time, between the places before and after it. Returns `None` before the first
    /// and after the last time, and in a gap of more than a second.
    pub fn place_at(&self, time_s: f64) -> Option<DVec3> {
        let next = self.times_s.partition_point(|time| *time <= time_s);
        let before = next.checked_sub(1)?;
        let (start_s, from) = (*self.times_s.get(before)?, *self.places_m.get(before)?);
        if start_s == time_s {
            return Some(from);
        }
        let (end_s, to) = (*self.times_s.get(next)?, *self.places_m.get(next)?);
        let gap_s = end_s - start_s;
        // NaN is no time.
        (gap_s <= GAP_S && time_s > start_s).then(|| from.lerp(to, (time_s - start_s) / gap_s))
    }
}

/// Returns the places of t, x, y and z among the words of a first line that names columns.
fn columns_of(line: &[u8]) -> Option<[usize; 4]> {
    let names: Vec<String> = words(line).map(|word| word.to_ascii_lowercase()).collect();
    let find = |usual: &[&str]| names.iter().position(|name| usual.contains(&name.as_str()));
    Some([
        find(&["t", "time", "timestamp", "gps_time", "gpstime"])?,
        find(&["x"])?,
        find(&["y"])?,
        find(&["z"])?,
    ])
}

/// Returns the words of a line, without quotation marks.
fn words(line: &[u8]) -> impl Iterator<Item = String> {
    let text = String::from_utf8_lossy(line).into_owned();
    let has_commas = text.contains([',', ';']);
    let is_between = move |c: char| {
        if has_commas {
            matches!(c, ',' | ';')
        } else {
            c.is_whitespace()
        }
    };
    let words: Vec<String> = text
        .split(is_between)
        .map(|word| word.trim().trim_matches('"').to_owned())
        .filter(|word| has_commas || !word.is_empty())
        .collect();
    words.into_iter()
}

/// Reads a table whose first line names the columns.
fn read_table(path: &Path, text: &[u8], columns: &[usize; 4]) -> Result<Vec<(f64, DVec3)>> {
    let lines = (1u64..).zip(text.split(|&b| b == b'\n').map(<[u8]>::trim_ascii));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with(b"#"));
    lines.next();

    let mut places = Vec::new();
    for (number, line) in lines {
        let words: Vec<String> = words(line).collect();
        let value = |column: &usize| words.get(*column)?.parse().ok().filter(|v: &f64| v.is_finite());
        let values: Option<Vec<f64>> = columns.iter().map(value).collect();
        let Some(&[t, x, y, z]) = values.as_deref() else {
            let message = format!("{}: a line of the trajectory has a time and a place", quote(line));
            return Err(Error::line(path, number, message));
        };
        places.push((t, DVec3::new(x, y, z)));
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;

    fn read(text: &str) -> Result<Trajectory> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("path.txt");
        std::fs::write(&path, text).unwrap();
        Trajectory::read(&path, &DAffine3::from_translation(dvec3(0.0, 0.0, 10.0)))
    }

    #[test]
    fn both_forms_give_the_same_path() {
        let tum = read("# t x y z\n5 1 2 3 0 0 0 1\n4 0 2 3 0 0 0 1\n9 1 2 3 0 0 0 1\n").unwrap();
        let table = read("\"gps_time\";x;y;z;roll\n5;1;2;3;9\n4;0;2;3;9\n4;7;7;7;9\n9;1;2;3;9\n").unwrap();
        assert_eq!(tum, table);
        assert_eq!(tum.times_s(), [4.0, 9.0]);
        assert_eq!(tum.place_at(4.5), Some(dvec3(0.5, 2.0, 13.0)));
        assert_eq!(
            [tum.place_at(4.0), tum.place_at(9.0)],
            [dvec3(0.0, 2.0, 13.0), dvec3(1.0, 2.0, 13.0)].map(Some)
        );
        // Before, in a gap of four seconds, after, and no time.
        assert!(
            [3.9, 6.0, 9.1, f64::NAN]
                .iter()
                .all(|time| tum.place_at(*time).is_none())
        );
    }

    #[test]
    fn faults_have_their_line() {
        for (text, words) in [
            ("t,x,y,z\n1,2,3,4\n2,3\n", "line 3: `2,3`: a line of the trajectory"),
            ("t,x,y,z\n1,2,3,nan\n", "line 2: "),
            ("1 2 3 4 0 0 0 1\n", "has 1 different times"),
            ("1 2 3\n", "timestamp tx ty tz"),
            ("", "has 0 different times"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }
}
