//! Finds the label properties of a PLY mesh, and collects their numbers.

use crate::error::{Error, Result};
use crate::mesh::file::MeshOptions;
use crate::mesh::labels::{
    CLASS_NAMES, INSTANCE_NAMES, LabelColumn, LabelElement, MATTERPORT_NAMES, MeshLabels, NO_LABEL,
};
use crate::mesh::ply::batch::{PlyBatch, integer};
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::ply::header::{PlyElement, PlyHeader};
use std::path::Path;

/// A label column while it is read.
#[derive(Debug)]
struct Column {
    /// The index of its property.
    property: usize,
    /// Whether the caller named it. Then every number must be whole. A column that is found by a known name
    /// is dropped if it has other numbers.
    demanded: bool,
    /// Whether it holds a number that is not whole.
    broken: bool,
    column: LabelColumn,
}

/// The label columns of a file.
#[derive(Debug)]
pub(crate) struct PlyLabels {
    pub(crate) element: LabelElement,
    class: Option<Column>,
    instance: Option<Column>,
}

impl PlyLabels {
    /// Finds the columns that `options` names, or else columns with known names: first of the faces, then of
    /// the vertices.
    ///
    /// # Errors
    /// [`Error::Format`] if a named column is not there.
    pub(crate) fn find(path: &Path, header: &PlyHeader, options: &MeshOptions) -> Result<Option<Self>> {
        for (name, kind) in [("face", LabelElement::Face), ("vertex", LabelElement::Vertex)] {
            let Some((_, element)) = header.element(name) else { continue };
            let class = column(element, options.class_column.as_deref(), &CLASS_NAMES);
            let instance = column(element, options.instance_column.as_deref(), instance_names(element));
            let (Some(class), Some(instance)) = (class, instance) else { continue };
            if class.is_some() || instance.is_some() {
                return Ok(Some(Self { element: kind, class, instance }));
            }
        }

        let asked: Vec<&str> = [&options.class_column, &options.instance_column]
            .into_iter()
            .flatten()
            .map(String::as_str)
            .collect();
        if asked.is_empty() {
            return Ok(None);
        }

        let message = format!(
            "has no column of labels {:?} among the properties of its faces or of its vertices ({}; {})",
            asked.join("\", \""),
            single_properties(header, "face"),
            single_properties(header, "vertex")
        );
        Err(Error::format(path, message.replace("\\\"", "\"")))
    }

    /// Returns the indices of the label properties.
    pub(crate) fn properties(&self) -> impl Iterator<Item = usize> {
        [&self.class, &self.instance].into_iter().flatten().map(|c| c.property)
    }

    /// Adds the numbers of a batch.
    ///
    /// # Errors
    /// [`Error::Format`] for a number that is not whole in a column that the caller named.
    pub(crate) fn add(&mut self, reader: &PlyReader<'_>, batch: &PlyBatch) -> Result<()> {
        for column in [&mut self.class, &mut self.instance].into_iter().flatten() {
            for (row, &value) in batch.scalars(column.property).iter().enumerate() {
                // CloudCompare writes NaN for a missing label.
                let number = integer(value).or_else(|| value.is_nan().then_some(NO_LABEL));
                if number.is_none() && column.demanded {
                    let message =
                        format!("the label {} is {value}, which is no whole number", column.column.name);
                    return Err(reader.fail(batch, row, message));
                }
                column.broken |= number.is_none();
                column.column.values.push(number.unwrap_or(NO_LABEL));
            }
        }
        Ok(())
    }

    /// Returns the label columns, row by row as in the file. A column with numbers that are not whole is left
    /// out with a warning.
    pub(crate) fn finish(self, warnings: &mut Vec<String>) -> Option<MeshLabels> {
        let class = self.class.and_then(|column| column.finish(warnings));
        let instance = self.instance.and_then(|column| column.finish(warnings));
        (class.is_some() || instance.is_some()).then_some(MeshLabels::Numbers {
            element: self.element,
            class,
            instance,
        })
    }
}

impl Column {
    /// Returns the column, or warns that it does not hold labels.
    fn finish(self, warnings: &mut Vec<String>) -> Option<LabelColumn> {
        if self.broken {
            let name = &self.column.name;
            warnings
                .push(format!("the property {name} is not taken as labels: not all its numbers are whole"));
            return None;
        }
        Some(self.column)
    }
}

/// Returns the names of columns of objects, the surest first. Matterport3D's `segment_id` is one where its
/// three properties stand together.
fn instance_names(element: &PlyElement) -> &'static [&'static str] {
    let [_, object, _] = &MATTERPORT_NAMES;
    let is_matterport = MATTERPORT_NAMES
        .iter()
        .all(|name| element.find_scalar(&[name]).is_some());
    if is_matterport {
        std::slice::from_ref(object)
    } else {
        &INSTANCE_NAMES
    }
}

/// Names the properties of an element that are single numbers, for a message.
fn single_properties(header: &PlyHeader, name: &str) -> String {
    let names = header.element(name).map(|(_, e)| {
        let single = e.properties.iter().filter(|p| !p.is_list());
        single.map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ")
    });
    format!("{name}: {}", names.filter(|n| !n.is_empty()).unwrap_or_else(|| "none".into()))
}

/// Finds the column `asked`, or else the first of `known`. Returns `None` if `asked` is not there, and
/// `Some(None)` if none of `known` is.
fn column(element: &PlyElement, asked: Option<&str>, known: &[&str]) -> Option<Option<Column>> {
    let property = match asked {
        // The same case wins over another case.
        Some(name) => {
            let exact = element.properties.iter().position(|p| !p.is_list() && p.name == name);
            Some(exact.or_else(|| element.find_scalar(&[name]))?)
        }
        None => element.find_scalar(known),
    };

    Some(property.and_then(|property| {
        let name = element.properties.get(property)?.name.clone();
        let column = LabelColumn { name, values: Vec::new() };
        Some(Column { property, demanded: asked.is_some(), broken: false, column })
    }))
}
