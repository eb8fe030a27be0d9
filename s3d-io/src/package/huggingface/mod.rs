//! A data set for Hugging Face's `datasets`: Parquet files with the images inside, a card that names them,
//! and Croissant's description.
//!
//! Sources: `huggingface/datasets` (`src/datasets/features`, `packaged_modules/parquet`), the Hub's page
//! "Repository structure", and MLCommons' "Croissant Format Specification" 1.0.

mod card;
mod croissant;
mod features;
mod table;

pub use card::write_huggingface_card;
pub use croissant::write_croissant;
pub use table::{ImageRecord, ImageTable};

use crate::dataset::domain::Domain;
use s3d_label::Class;

/// What is in the folder of a data set for Hugging Face, as its card and its Croissant file tell it.
#[derive(Clone, Debug)]
pub struct HuggingfaceSet<'a> {
    /// The name of the data set.
    pub name: String,
    /// The classes of its labels, in the order of their indices.
    pub classes: &'a [Class],
    /// The modalities with a column, in the order of [`Domain::ALL`].
    pub domains: Vec<Domain>,
    /// Whether there is a column of the names of photographs.
    pub with_photographs: bool,
    /// The depth units in a metre.
    pub depth_units_per_m: f64,
    /// Its configurations: the first is the default.
    pub configs: Vec<HuggingfaceConfig>,
    /// The names of further files in the folder: what numbers in images mean.
    pub tables: Vec<&'static str>,
}

/// A configuration: images of one kind.
#[derive(Clone, Debug)]
pub struct HuggingfaceConfig {
    /// Its name, which is the folder below `data`, too: `views` or `panoramas`.
    pub name: &'static str,
    /// Its splits: the name of each, `area_N`, and the number of its images.
    pub splits: Vec<(String, usize)>,
}

impl HuggingfaceSet<'_> {
    /// Returns the pattern of the files of a configuration, below the folder.
    fn files_of(config: &str, split: &str) -> String {
        format!("data/{config}/{split}-*.parquet")
    }

    /// Returns whether files of this modality have a column that `datasets` decodes.
    pub fn can_hold(domain: Domain) -> bool {
        features::kind_of(domain).is_some()
    }
}
