//! Which properties of a PLY mesh are labels, and their numbers.

use crate::error::{Error, Result};
use crate::mesh::file::MeshOptions;
use crate::mesh::labels::{CLASS_NAMES, INSTANCE_NAMES, LabelColumn, LabelElement, MeshLabels, NO_LABEL};
use crate::mesh::ply::batch::{PlyBatch, integer};
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::ply::header::{PlyElement, PlyHeader};
use std::path::Path;

/// A column of labels while it is read.
#[derive(Debug)]
struct Column {
    /// Its place among the properties.
    property: usize,
    /// Whether the caller named it: then every number must be whole, else a column that has others is none.
    demanded: bool,
    /// Whether it holds a number that is not whole.
    broken: bool,
    column: LabelColumn,
}

/// The columns of labels of a file.
#[derive(Debug)]
pub(crate) struct PlyLabels {
    pub(crate) element: LabelElement,
    class: Option<Column>,
    instance: Option<Column>,
}

impl PlyLabels {
    /// Finds the columns that `options` names, or known names where it names none: of faces or else of
    /// vertices.
    ///
    /// # Errors
    /// [`Error::Format`] if what `options` names is not there.
    pub(crate) fn find(path: &Path, header: &PlyHeader, options: &MeshOptions) -> Result<Option<Self>> {
        for (name, kind) in [("face", LabelElement::Face), ("vertex", LabelElement::Vertex)] {
            let Some((_, element)) = header.element(name) else { continue };
            let class = column(element, options.class_column.as_deref(), &CLASS_NAMES);
            let instance = column(element, options.instance_column.as_deref(), &INSTANCE_NAMES);
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
        let properties = |name: &str| {
            let names = header.element(name).map(|(_, e)| {
                let single = e.properties.iter().filter(|p| !p.is_list());
                single.map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ")
            });
            format!("{name}: {}", names.filter(|n| !n.is_empty()).unwrap_or_else(|| "none".into()))
        };
        let message = format!(
            "has no column of labels {:?} among the properties of its faces or of its vertices ({}; {})",
            asked.join("\", \""),
            properties("face"),
            properties("vertex")
        );
        Err(Error::format(path, message.replace("\\\"", "\"")))
    }

    /// The places of the properties.
    pub(crate) fn properties(&self) -> impl Iterator<Item = usize> {
        [&self.class, &self.instance].into_iter().flatten().map(|c| c.property)
    }

    /// Takes the numbers of a batch.
    ///
    /// # Errors
    /// [`Error::Format`] for a number that is not whole in a column that was asked for.
    pub(crate) fn add(&mut self, reader: &PlyReader<'_>, batch: &PlyBatch) -> Result<()> {
        for column in [&mut self.class, &mut self.instance].into_iter().flatten() {
            for (row, &value) in batch.scalars(column.property).iter().enumerate() {
                // CloudCompare writes NaN where there is none.
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

    /// The columns, as they stand in the file, without those that are no labels after all.
    pub(crate) fn finish(self, warnings: &mut Vec<String>) -> Option<MeshLabels> {
        let mut whole = |column: Option<Column>| {
            let column = column?;
            if column.broken {
                let name = &column.column.name;
                warnings.push(format!(
                    "the property {name} is not taken as labels: not all its numbers are whole"
                ));
                return None;
            }
            Some(column.column)
        };
        let (class, instance) = (whole(self.class), whole(self.instance));
        (class.is_some() || instance.is_some()).then_some(MeshLabels::Numbers {
            element: self.element,
            class,
            instance,
        })
    }
}

/// The column `asked` or, without that, one of `known` if there is one; `None` if `asked` is not there.
fn column(element: &PlyElement, asked: Option<&str>, known: &[&str]) -> Option<Option<Column>> {
    let property = match asked {
        // As it is written goes before another case.
        Some(name) => {
            let exact = element.properties.iter().position(|p| !p.is_list() && p.name == name);
            Some(exact.or_else(|| element.find_scalar(&[name]))?)
        }
        None => element.find_scalar(known),
    };
    let column = |property: usize| {
        let name = element.properties.get(property)?.name.clone();
        let column = LabelColumn { name, values: Vec::new() };
        Some(Column { property, demanded: asked.is_some(), broken: false, column })
    };
    Some(property.and_then(column))
}
