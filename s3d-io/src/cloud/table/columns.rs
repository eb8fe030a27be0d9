//! Finds the columns of a table of points by name. Every program has names of its own.

use crate::cloud::table::wanted::Wanted;
use crate::error::{Error, Result};
use std::path::Path;

/// Names of the three coordinate columns, and of arrays of three coordinates.
const POSITIONS: [[&str; 3]; 1] = [["x", "y", "z"]];
const POSITION_ARRAYS: [&str; 9] =
    ["xyz", "points", "point", "coord", "coords", "positions", "position", "pos", "vertices"];
/// Names of the three colour columns, and of arrays of three colours.
const COLORS: [[&str; 3]; 4] = [
    ["red", "green", "blue"],
    ["r", "g", "b"],
    ["rf", "gf", "bf"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
];
const COLOR_ARRAYS: [&str; 6] = ["rgb", "colors", "color", "colours", "colour", "rgbs"];
/// Names of class columns, the surest first. `scalar_…` is CloudCompare's.
pub(crate) const CLASSES: [&str; 21] = [
    "class",
    "semantic_class",
    "class_id",
    "semantic",
    "semantic_label",
    "semantic_labels",
    "semantic_gt",
    "sem_label",
    "segment",
    "segment20",
    "segment200",
    "label",
    "labels",
    "category",
    "category_id",
    "classification",
    "classificationid",
    "scalar_class",
    "scalar_label",
    "scalar_classification",
    "object_class",
];
/// Names of columns of instance numbers.
pub(crate) const INSTANCES: [&str; 21] = [
    "instance",
    "instance_id",
    "instance_label",
    "instance_labels",
    "instance_gt",
    "instances",
    "ins_label",
    "ins_labels",
    "ins",
    "inst",
    "inst_id",
    "inst_label",
    "inst_labels",
    "instanceid",
    "object_id",
    "objectid",
    "object",
    "scalar_instance",
    "scalar_instance_id",
    "scalar_instance_label",
    "track_id",
];

/// Names of columns of intensity. `scalar_…` is CloudCompare's.
const INTENSITIES: [&str; 6] =
    ["intensity", "scalar_intensity", "intensities", "reflectance", "reflectivity", "i"];
/// Names of columns of the time of a point.
const TIMES: [&str; 9] = [
    "gps_time",
    "gpstime",
    "time",
    "timestamp",
    "time_s",
    "t",
    "scalar_gpstime",
    "scalar_gps_time",
    "scalar_time",
];

/// The columns of a table, as indices: where each thing is in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Columns {
    pub(crate) position: [usize; 3],
    pub(crate) color: Option<[usize; 3]>,
    /// `None` if no annotations are wanted.
    pub(crate) class: Option<usize>,
    pub(crate) instance: Option<usize>,
    pub(crate) room: Option<usize>,
    /// These are `None` if annotations are wanted.
    pub(crate) intensity: Option<usize>,
    pub(crate) time: Option<usize>,
}

impl Columns {
    /// Chooses the columns. A name from the options is case-sensitive; the usual names are found in capitals
    /// or not. An element of an array is a column `name[i]`.
    ///
    /// # Errors
    /// [`Error::Format`], with the names of all columns, if a needed or named column is missing.
    pub(crate) fn choose(path: &Path, names: &[String], wanted: Wanted<'_>) -> Result<Self> {
        let position = find_three(names, &POSITIONS, &POSITION_ARRAYS).ok_or_else(|| {
            Error::format(path, format!("has no columns of coordinates, such as x y z; {}", listed(names)))
        })?;
        let color = find_three(names, &COLORS, &COLOR_ARRAYS);
        let options = match wanted {
            Wanted::Annotations(options) => options,
            Wanted::Measurements(_) => {
                let [class, instance, room] = [None; 3];
                let intensity = find_usual(names, &INTENSITIES);
                let time = find_usual(names, &TIMES);
                return Ok(Self { position, color, class, instance, room, intensity, time });
            }
        };

        let class = match &options.class_column {
            Some(name) => find_named(path, names, "class", name)?,
            None => find_usual(names, &CLASSES).ok_or_else(|| {
                Error::format(
                    path,
                    format!(
                        "has no column of classes; {}. If one of them is it, name it, as in class = \
                         \"label\" in [annotations]; a cloud without labels cannot label a mesh",
                        listed(names)
                    ),
                )
            })?,
        };
        let instance = match &options.instance_column {
            Some(name) => Some(find_named(path, names, "instance", name)?),
            None => find_usual(names, &INSTANCES).filter(|i| *i != class),
        };
        let room = options
            .room_column
            .as_ref()
            .map(|name| find_named(path, names, "rooms", name))
            .transpose()?;

        let class = Some(class);
        Ok(Self { position, color, class, instance, room, intensity: None, time: None })
    }

    /// Returns all columns that are read.
    pub(crate) fn all(&self) -> impl Iterator<Item = usize> {
        let others = [self.class, self.instance, self.room, self.intensity, self.time];
        let colors = self.color.into_iter().flatten();
        self.position
            .into_iter()
            .chain(colors)
            .chain(others.into_iter().flatten())
    }
}

/// All columns, for messages.
fn listed(names: &[String]) -> String {
    format!("its columns are {}", names.join(" "))
}

/// The column that the user named for `key`.
fn find_named(path: &Path, names: &[String], key: &str, name: &str) -> Result<usize> {
    names.iter().position(|n| n == name).ok_or_else(|| {
        let message = format!("has no column {name:?} ({key} in [annotations]); {}", listed(names));
        Error::format(path, message)
    })
}

/// The column with the first of these names that there is.
fn find_usual(names: &[String], usual: &[&str]) -> Option<usize> {
    usual.iter().find_map(|name| find(names, name))
}

/// The three columns with the names of a set, or else the three elements of an array.
fn find_three(names: &[String], sets: &[[&str; 3]], arrays: &[&str]) -> Option<[usize; 3]> {
    let set = sets
        .iter()
        .find_map(|[a, b, c]| Some([find(names, a)?, find(names, b)?, find(names, c)?]));
    set.or_else(|| {
        arrays.iter().find_map(|array| {
            let element = |i: usize| find(names, &format!("{array}[{i}]"));
            Some([element(0)?, element(1)?, element(2)?])
        })
    })
}

/// The column with this name, in capitals or not. An exact match comes first.
fn find(names: &[String], name: &str) -> Option<usize> {
    let exact = names.iter().position(|n| n == name);
    exact.or_else(|| names.iter().position(|n| n.eq_ignore_ascii_case(name)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::annotations::AnnotationOptions;

    fn choose(names: &str, options: &AnnotationOptions) -> Result<Columns> {
        let names: Vec<String> = names.split(' ').map(str::to_owned).collect();
        Columns::choose(Path::new("a.ply"), &names, options.into())
    }

    fn found(names: &str) -> Columns {
        choose(names, &AnnotationOptions::default()).unwrap()
    }

    #[test]
    fn usual_names_are_found() {
        let full = found("Z Y X label red green blue instance_id");
        assert_eq!((full.position, full.color), ([2, 1, 0], Some([4, 5, 6])));
        assert_eq!((full.class, full.instance, full.room), (Some(3), Some(7), None));
        let arrays = found("coord[0] coord[1] coord[2] color[0] color[1] color[2] segment");
        assert_eq!((arrays.position, arrays.color), ([0, 1, 2], Some([3, 4, 5])));
        assert_eq!((arrays.class, arrays.instance), (Some(6), None));
        assert_eq!(found("x y z sem inst label").instance, Some(4));
        assert_eq!(found("x y z class label").class, Some(3));
        assert_eq!(found("x y z Label label").class, Some(4));
    }

    #[test]
    fn measurements_need_no_class() {
        let names = ["x", "y", "z", "Scalar_Intensity", "GpsTime", "label"].map(str::to_owned);
        let found = Columns::choose(Path::new("a.ply"), &names, Wanted::Measurements(&[])).unwrap();
        assert_eq!((found.class, found.intensity, found.time), (None, Some(3), Some(4)));
        assert_eq!(found.all().collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn named_columns_win_and_must_be_there() {
        let options = AnnotationOptions {
            class_column: Some("kind".into()),
            instance_column: Some("part".into()),
            room_column: Some("place".into()),
            ..AnnotationOptions::default()
        };
        let found = choose("x y z label instance kind part place", &options).unwrap();
        assert_eq!((found.class, found.instance, found.room), (Some(5), Some(6), Some(7)));
        for (names, words) in [
            (
                "x y z label instance part place",
                "no column \"kind\" (class in [annotations]); its columns are x y",
            ),
            ("x y z kind place", "no column \"part\" (instance"),
            ("x y z kind part", "no column \"place\" (rooms"),
            ("x y kind", "no columns of coordinates, such as x y z; its columns are x y kind"),
        ] {
            let message = choose(names, &options).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
        let message = choose("x y z nx", &AnnotationOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains("no column of classes; its columns are x y z nx."), "{message}");
    }
}
