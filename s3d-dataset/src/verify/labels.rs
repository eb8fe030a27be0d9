//! Reads and checks the label table.

use super::report::{Report, Topic};
use crate::export::modality::NO_CLASS;
use crate::record::manifest::Manifest;
use s3d_io::dataset::{Layout, read_labels};
use s3d_io::image::pretty_color;
use s3d_label::{Label, NULL_NAME, Taxonomy};
use std::collections::HashMap;

const ORDER: (Topic, &str) = (Topic::Labels, "the label table");

/// The names and indices in the file, in order or not.
pub(crate) struct Labels {
    /// All names, without the null labels that pad the end of the table.
    pub(crate) names: Vec<String>,
    indices: HashMap<String, u32>,
    /// The taxonomy of the names.
    pub(crate) taxonomy: Taxonomy,
    /// The colour of each index.
    pub(crate) pretty: Vec<[u8; 3]>,
    /// The class of each index, by its place in the taxonomy, or [`NO_CLASS`].
    pub(crate) classes: Vec<u8>,
}

impl Labels {
    /// The labels of a data set without any: only the null label.
    fn none() -> Self {
        Self {
            names: vec![NULL_NAME.to_owned()],
            indices: HashMap::new(),
            taxonomy: Taxonomy::s3dis(),
            pretty: vec![pretty_color(0)],
            classes: vec![NO_CLASS],
        }
    }

    /// Returns the label of an index. Returns `None` for the null label, and for a name that is none.
    pub(crate) fn label(&self, index: u32) -> Option<Label> {
        let name = self.names.get(index as usize)?;
        self.taxonomy.parse_name(name).ok()?
    }

    /// Reads and checks `semantic_labels.json`.
    pub(crate) fn read(layout: &Layout, manifest: &Manifest, report: &Report) -> Option<Self> {
        if !manifest.is_labelled() {
            return Some(Self::none());
        }
        let taxonomy = manifest.read_taxonomy(layout, |path| report.check_size(path));
        let taxonomy = report.ok(Topic::Labels, taxonomy)?;
        if let Some(built_in) = Taxonomy::built_in(taxonomy.name()) {
            report.check(taxonomy == built_in, ORDER, &layout.taxonomy_json(), || {
                format!("is not the taxonomy {} that s3d knows", taxonomy.name())
            });
        }
        let path = layout.labels_json();
        let mut names = report.read(Topic::Labels, &path, read_labels)?;

        let checks = report.of(ORDER, &path);
        if let Err(e) = taxonomy.table_from_names(&names) {
            checks.check(false, || format!("out of order, or no table: {e}"));
        }
        checks.check(names.len() == manifest.labels_padded_to(), || {
            format!("{} entries, and the manifest tells of {}", names.len(), manifest.labels_padded_to())
        });

        let count = names
            .iter()
            .rposition(|name| name != NULL_NAME)
            .map_or(1, |last| last + 1);
        names.truncate(count);
        checks.check(count == manifest.labels, || {
            format!("{count} labels, the null label included, and the manifest tells of {}", manifest.labels)
        });

        let indices = names
            .iter()
            .enumerate()
            .map(|(i, name)| (name.clone(), i as u32))
            .collect();
        let pretty = (0..names.len() as u32).map(pretty_color).collect();
        let classes = names
            .iter()
            .map(|name| match taxonomy.parse_name(name) {
                Ok(Some(label)) => label.class.index() as u8,
                _ => NO_CLASS,
            })
            .collect();

        Some(Self { names, indices, taxonomy, pretty, classes })
    }

    /// The index of a name.
    pub(crate) fn index_of(&self, name: &str) -> Option<u32> {
        self.indices.get(name).copied()
    }

    /// The name at an index.
    pub(crate) fn name_of(&self, index: u32) -> &str {
        self.names.get(index as usize).map_or("nothing", String::as_str)
    }

    /// The name of the class at a place of the taxonomy.
    pub(crate) fn class_name(&self, place: u8) -> String {
        let name = self
            .taxonomy
            .classes()
            .get(usize::from(place))
            .map_or("no class", |class| class.name());
        format!("{place} ({name})")
    }

    /// The name of the room of each label; `None` for the null label.
    pub(crate) fn rooms(&self) -> Vec<Option<String>> {
        let room_of =
            |name: &String| self.taxonomy.parse_name(name).ok()?.map(|label| label.room.to_string());
        self.names.iter().map(room_of).collect()
    }

    /// The number of labels, including the null label.
    pub(crate) fn len(&self) -> usize {
        self.names.len()
    }
}
