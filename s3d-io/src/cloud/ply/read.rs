//! Annotated points in PLY files: the element `vertex`, with properties for class and instance.

use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::columns::Columns;
use crate::cloud::table::measured::{Measured, Told};
use crate::cloud::table::records::{Color, color};
use crate::cloud::table::rows::{Reading, Row, Value};
use crate::cloud::table::wanted::Wanted;
use crate::error::{Error, Result};
use crate::fs::source::Source;
use crate::mesh::ply::batch::PlyBatch;
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::ply::header::{PlyElement, PlyType};
use s3d_geom::glam::dvec3;
use std::cell::Cell;
use std::path::Path;

/// A `.ply` file.
pub(crate) struct PlyCloud<'a> {
    source: Source,
    wanted: Wanted<'a>,
    has_faces: Cell<bool>,
}

impl<'a> PlyCloud<'a> {
    pub(crate) fn new(source: Source, wanted: Wanted<'a>) -> Self {
        Self { source, wanted, has_faces: Cell::new(false) }
    }
}

/// Opens a PLY file at its vertices. Returns the element too, and whether the file is a mesh.
pub(crate) fn open_vertices(source: &Source) -> Result<(PlyReader<'static>, PlyElement, bool)> {
    let (file, size) = source.open()?;
    let mut reader = PlyReader::new(file, size, source.name())?;
    let has_faces = reader.header().element("face").is_some_and(|(_, face)| face.count > 0);
    loop {
        match reader.next_element()? {
            Some(element) if element.name.eq_ignore_ascii_case("vertex") => {
                return Ok((reader, element, has_faces));
            }
            Some(_) => {}
            None => return Err(Error::format(source.name(), "has no element \"vertex\": no points")),
        }
    }
}

/// The colour of a row, black if there are no channels.
#[expect(
    clippy::indexing_slicing,
    reason = "the channels were found in the element, and are wanted of the batch"
)]
pub(crate) fn color_of(
    element: &PlyElement,
    batch: &PlyBatch,
    channels: Option<[usize; 3]>,
    row: usize,
    range: ColorRange,
) -> Color {
    let Some(channels) = channels else { return Color::Rgb([0; 3]) };
    let is_float = !element.properties[channels[0]].kind.is_integer();
    color(channels.map(|c| batch.scalars(c)[row]), is_float, range)
}

impl Cloud for PlyCloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn are_vertices(&self) -> bool {
        self.has_faces.get()
    }

    #[expect(clippy::indexing_slicing, reason = "a batch has as many rows of each column that is wanted")]
    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let (mut reader, element, has_faces) = open_vertices(&self.source)?;
        self.has_faces.set(has_faces);
        // A list is no column. It gets the empty name, which no column has.
        let names: Vec<String> = element
            .properties
            .iter()
            .map(|p| if p.is_list() { String::new() } else { p.name.clone() })
            .collect();
        let columns = Columns::choose(path, &names, self.wanted)?;
        reader.want(columns.all());
        reading.told = Told {
            points: Some(element.count),
            has_colors: columns.color.is_some(),
            are_bytes: columns
                .color
                .is_some_and(|[r, ..]| element.properties[r].kind == PlyType::U8),
            has_intensity: columns.intensity.is_some(),
            has_times: columns.time.is_some(),
            has_grid: false,
        };

        let mut batch = PlyBatch::default();
        while reader.read_batch(&mut batch)? {
            let [x, y, z] = columns.position.map(|p| batch.scalars(p));
            for row in 0..batch.len() {
                let rgb = match color_of(&element, &batch, columns.color, row, colors) {
                    Color::Rgb(rgb) => rgb,
                    Color::Wider => return Ok(false),
                    Color::Beyond(channel) => {
                        let p = columns.color.map_or(0, |channels| channels[channel]);
                        let v = batch.scalars(p)[row];
                        let why = format!("{v} is no colour ({})", element.properties[p].name);
                        reading.fault(reader.fail(&batch, row, why))?;
                        continue;
                    }
                };

                let value = |p: Option<usize>| p.map_or(Value::None, |p| Value::Float(batch.scalars(p)[row]));
                let point = Row {
                    position: dvec3(x[row], y[row], z[row]),
                    color: rgb,
                    class: value(columns.class),
                    instance: value(columns.instance),
                    room: value(columns.room),
                    measured: Measured {
                        intensity: columns.intensity.map_or(f32::NAN, |p| batch.scalars(p)[row] as f32),
                        time_s: columns.time.map_or(f64::NAN, |p| batch.scalars(p)[row]),
                        cell: None,
                    },
                };
                match batch.lines.get(row) {
                    Some(line) => reading.push_line(*line, &point)?,
                    None => reading.push(batch.first_row() + row as u64 + 1, &point)?,
                }
            }
        }
        Ok(true)
    }
}
