//! Lists of one number for each vertex or face of a mesh: a text of one number a line, as ScanNet's benchmark
//! takes it, or an NPY array of one dimension. The numbers are classes.

use crate::cloud::NpyArray;
use crate::cloud::label_files::head_of;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::mesh::file::MeshFile;
use crate::mesh::labels::{LabelColumn, LabelElement, MeshLabels, NO_LABEL};
use std::io::Read;
use std::path::Path;

/// Returns whether a file is a list of numbers: the first two lines of a text have a number each, or an NPY
/// array has one dimension and no names.
pub fn is_number_list(path: &Path) -> bool {
    let head = head_of(path);
    if head.starts_with(b"\x93NUMPY") {
        return NpyArray::open(path).is_ok_and(|array| array.shape().len() == 1);
    }
    let text = String::from_utf8_lossy(&head);
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let is_number = |line: &str| line.parse::<f64>().is_ok();
    lines.next().is_some_and(is_number) && lines.next().is_some_and(is_number)
}

/// Reads the classes of the vertices or faces of a mesh. The length of the list says which of the two it is
/// about. Faces are those of the mesh's file. A negative number is no label.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the place for what is no whole number, and for a list of another
/// length.
pub(crate) fn read(path: &Path, mesh: &MeshFile) -> Result<MeshLabels> {
    let values = read_number_list(path)?;
    let values: Vec<i64> = values.into_iter().map(|n| if n < 0 { NO_LABEL } else { n }).collect();

    let vertices = mesh.mesh.positions().len();
    let faces = faces_of_file(mesh);
    let count = values.len();
    // Faces of several files are numbered in each.
    let fits_faces = mesh.sources.len() == 1 && faces.contains(&count);
    let element = match (count == vertices, fits_faces) {
        (true, false) => LabelElement::Vertex,
        (false, true) => LabelElement::Face,
        (both, _) => {
            let why = if both {
                "so that it may be about either"
            } else {
                "and it is about neither"
            };
            return Err(Error::format(
                path,
                format!(
                    "has {count} numbers, the mesh's file has {vertices} vertices and {} faces, {why}: \
                     labels of faces may be properties of the mesh itself, in a PLY file",
                    faces.end()
                ),
            ));
        }
    };

    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let values = match element {
        LabelElement::Vertex => values,
        LabelElement::Face => mesh
            .source_faces
            .iter()
            .map(|&face| values.get(face as usize).copied().unwrap_or(NO_LABEL))
            .collect(),
    };
    Ok(MeshLabels::Numbers { element, class: Some(LabelColumn { name, values }), instance: None })
}

/// Returns the numbers of faces that the file of a mesh may have: its last faces may have been left out.
pub(super) fn faces_of_file(mesh: &MeshFile) -> std::ops::RangeInclusive<usize> {
    let seen = mesh.source_faces.iter().max().map_or(0, |&face| face as usize + 1);
    seen..=seen + mesh.mesh.report().zero_area_faces + mesh.repeated_faces
}

/// Reads whole numbers of a list: a text of one a line, or an NPY array. A NaN is
/// [`NO_LABEL`](crate::mesh::NO_LABEL).
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the place for what is no whole number.
pub fn read_number_list(path: &Path) -> Result<Vec<i64>> {
    if head_of(path).starts_with(b"\x93NUMPY") {
        return read_whole_numbers(&mut NpyArray::open(path)?);
    }
    let bytes = read_file(path)?;
    let text = text_of(&bytes, path)?;
    let mut numbers = Vec::new();
    for (line, written) in (1..).zip(text.split(|b| *b == b'\n')) {
        let written = written.trim_ascii();
        if written.is_empty() {
            continue;
        }
        let number = std::str::from_utf8(written).ok().and_then(|word| word.parse().ok());
        numbers.push(number.and_then(whole_number).ok_or_else(|| {
            let shown = crate::fs::quote::quote(written);
            Error::line(path, line, format!("{shown} is no class: a line has one whole number"))
        })?);
    }
    Ok(numbers)
}

/// Reads the rest of the numbers of an array, which are whole, whatever their type. A NaN is
/// [`NO_LABEL`](crate::mesh::NO_LABEL).
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the place of a number that is not whole, and if the file ends before
/// the array.
pub fn read_whole_numbers<R: Read>(array: &mut NpyArray<R>) -> Result<Vec<i64>> {
    let mut whole = Vec::new();
    if !array.is_float() {
        while array.read_integers(&mut whole)? > 0 {}
        return Ok(whole);
    }

    let mut floats = Vec::new();
    while array.read_floats(&mut floats)? > 0 {}
    for (place, &value) in floats.iter().enumerate() {
        whole.push(whole_number(value).ok_or_else(|| {
            let message = format!("number {place}, counted from 0, is {value}, which is not whole");
            Error::format(array.name(), message)
        })?);
    }
    Ok(whole)
}

/// Returns a number that is whole. NaN is no label.
fn whole_number(value: f64) -> Option<i64> {
    if value.is_nan() {
        return Some(NO_LABEL);
    }
    (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
}
