//! The tables `[[parts]]` of a `scene.toml`.

use crate::error::Result;
use crate::scene::cameras::similarity;
use crate::scene::folder::SceneFolder;
use s3d_geom::glam::DAffine3;
use serde::Deserialize;
use std::path::PathBuf;

/// A part of an area: a scene of its own, which was scanned apart from the others.
#[derive(Clone, Debug, PartialEq)]
pub struct PartSource {
    /// Its scene file, published area, mesh, raw scan, or folder of another data set.
    pub path: PathBuf,
    /// Where it lies.
    pub place: PartPlace,
}

/// Where a part of an area lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartPlace {
    /// The transform from the part's frame to the frame of the area: a rotation, a shift and a scale.
    Given(DAffine3),
    /// It is to be found: the part shows some of what the parts before it show.
    Aligned,
}

/// A table as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PartTable {
    path: PathBuf,
    transform: Option<[[f64; 4]; 4]>,
    #[serde(default)]
    align: bool,
}

/// Returns the parts that the tables describe.
///
/// # Errors
/// [`Error::Format`](crate::Error::Format) for the scene file if a path does not exist or a value is wrong.
pub(crate) fn part_sources(tables: Vec<PartTable>, folder: SceneFolder<'_>) -> Result<Vec<PartSource>> {
    let source = |(number, table): (usize, PartTable)| {
        let fault = |message: String| folder.fault(format!("[[parts]], number {number}: {message}"));
        let place = match (table.transform, table.align) {
            (Some(_), true) => return Err(fault("transform and align exclude each other".into())),
            (Some(rows), false) => PartPlace::Given(similarity(rows).map_err(fault)?),
            (None, false) => PartPlace::Given(DAffine3::IDENTITY),
            (None, true) if number == 1 => {
                let message = "align goes with later parts: the first one gives the frame";
                return Err(fault(message.into()));
            }
            (None, true) => PartPlace::Aligned,
        };
        Ok(PartSource { path: folder.any("parts.path", &table.path)?, place })
    };
    (1..).zip(tables).map(source).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse_scene;
    use s3d_geom::glam::DVec3;
    use std::fs;

    fn parts(text: &str) -> Result<Vec<PartSource>> {
        let dir = tempfile::tempdir().unwrap();
        ["a.glb", "b.toml", "c.csv"]
            .iter()
            .for_each(|name| fs::write(dir.path().join(name), "").unwrap());
        let text = format!("area = 5\n{text}");
        parse_scene(&text, &dir.path().join("scene.toml")).map(|scene| scene.parts)
    }

    #[test]
    fn parts_are_given_a_place_or_are_to_be_aligned() {
        let rows = "transform = [[0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]";
        let found = parts(&format!(
            "[[parts]]\npath = \"a.glb\"\n[[parts]]\npath = \"b.toml\"\nalign = true\n[[parts]]\npath = \
             \"a.glb\"\n{rows}\n[cameras]\npath = \"c.csv\"\n"
        ))
        .unwrap();
        assert!(found[0].path.ends_with("a.glb") && found[1].path.ends_with("b.toml"));
        assert_eq!(found[0].place, PartPlace::Given(DAffine3::IDENTITY));
        assert_eq!(found[1].place, PartPlace::Aligned);
        let PartPlace::Given(moved) = found[2].place else { panic!() };
        // Labels of the whole area.
        parts("taxonomy = \"nyu40\"\n[[parts]]\npath = \"a.glb\"\n[annotations]\npath = \"c.csv\"\n")
            .unwrap();
        assert_eq!(moved.transform_point3(DVec3::X), DVec3::new(4.0, 6.0, 6.0));
    }

    #[test]
    fn faulty_parts_are_told() {
        const TWO: &str = "[[parts]]\npath = \"a.glb\"\n[[parts]]\npath = \"b.toml\"\n";
        for (text, words) in [
            ("[[parts]]\npath = \"gone\"".to_owned(), "parts.path = \"gone\""),
            ("[[parts]]\npath = \"a.glb\"\nalign = true".to_owned(), "number 1: align goes with later parts"),
            (
                format!(
                    "{TWO}align = true\ntransform = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"
                ),
                "number 2: transform and align exclude each other",
            ),
            (
                format!("{TWO}transform = [[1, 0, 0, 0], [0, 2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"),
                "number 2: transform is no rotation",
            ),
            (format!("{TWO}up = \"y\""), "unknown field `up`"),
            (format!("{TWO}[mesh]\npath = \"a.glb\""), "leave out [mesh]"),
            (format!("{TWO}[annotations]\nmesh = true"), "leave out annotations.mesh"),
            (format!("taxonomy = \"nyu40\"\n{TWO}"), "leave out taxonomy"),
            (format!("rgb = \"texture\"\n{TWO}"), "leave out rgb"),
        ] {
            let message = parts(&text).unwrap_err().to_string();
            assert!(message.contains(words), "{text}: {message}");
        }
    }
}
