//! Describes a data set: what it holds, and what looks wrong.

use super::{InfoOptions, SceneInfo, info};
use crate::context::Context;
use crate::error::Result;
use crate::record::data_set::DataSet;
use crate::summary::{Surface, Unlabelled, size};
use s3d_io::dataset::Layout;
use std::fmt;
use std::path::{Path, PathBuf};

/// The contents of a data set. Displayed, it is the text that `s3d info OUT` prints.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct DataSetInfo {
    /// Its folder.
    pub folder: PathBuf,
    /// The version of s3d that made it.
    pub version: String,
    /// The seed of the export.
    pub seed: u64,
    /// The number of files, without `manifest.json` and `files.csv`.
    pub files: u64,
    /// The size of these files in bytes.
    pub bytes: u64,
    /// The number of labels, including the null label; 0 without labels.
    pub labels: usize,
    /// The name of the taxonomy of its labels.
    pub taxonomy: String,
    /// The surface and pixels without votes and without a label in all areas; `None` without labels, and for
    /// earlier versions.
    pub unlabelled: Option<Unlabelled>,
    /// The number of panoramas.
    pub panoramas: u64,
    /// The number of views.
    pub views: u64,
    /// Its areas, described like scenes.
    pub areas: Vec<SceneInfo>,
}

/// Reads a complete data set: its manifest, and each of its areas as a scene.
///
/// # Errors
/// [`Error::File`](crate::Error::File) if it is not complete, or was changed;
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn data_set_info(folder: &Path, ctx: &Context) -> Result<DataSetInfo> {
    let layout = Layout::new(folder);
    let DataSet { manifest, taxonomy, .. } = DataSet::open_in(&layout)?;
    let of_areas = manifest.areas.iter();
    let unlabelled = of_areas
        .clone()
        .filter_map(|area| area.unlabelled)
        .reduce(|mut sum, area| {
            sum += area;
            sum
        });

    let area = |number: &u32| info(layout.area_dir(*number), &InfoOptions::default(), ctx);
    let list = manifest.files.as_ref();

    Ok(DataSetInfo {
        folder: folder.to_owned(),
        version: manifest.version.clone(),
        seed: manifest.seed,
        files: list.map_or(0, |list| list.count),
        bytes: list.map_or(0, |list| list.bytes),
        labels: manifest.labels,
        taxonomy: taxonomy.name().to_owned(),
        unlabelled,
        panoramas: of_areas.clone().map(|area| area.panoramas).sum(),
        views: of_areas.map(|area| area.views).sum(),
        areas: manifest.area_numbers.iter().map(area).collect::<Result<_>>()?,
    })
}

/// Whether a folder has a data set, complete or not.
pub fn is_data_set(folder: &Path) -> bool {
    folder.is_dir() && Layout::new(folder).manifest().is_file()
}

impl fmt::Display for DataSetInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { version, seed, files, panoramas, views, .. } = self;
        writeln!(f, "{}: a complete data set of s3d {version}, seed {seed}", self.folder.display())?;
        writeln!(
            f,
            "  {files} files, {}; {panoramas} panoramas and {views} views of {} areas",
            size(self.bytes),
            self.areas.len()
        )?;
        match self.labels {
            0 => writeln!(f, "  without labels")?,
            labels => writeln!(f, "  {labels} labels of the taxonomy {}", self.taxonomy)?,
        }
        if let Some(Unlabelled { without_label: Surface { faces, m2, pixels }, .. }) = self.unlabelled {
            let pixels = pixels.map_or(String::new(), |pixels| format!(", {pixels} pixels"));
            writeln!(f, "  without a label: {faces} faces, {m2:.1} m²{pixels}")?;
        }
        self.areas.iter().try_for_each(|area| write!(f, "\n{area}"))
    }
}
