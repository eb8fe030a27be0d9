//! The vertices of a PLY mesh.

use crate::error::{Error, Result};
use crate::mesh::file::UpAxis;
use crate::mesh::origin::FileFrame;
use crate::mesh::ply::batch::PlyBatch;
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::ply::header::{PlyElement, PlyType};
use crate::mesh::ply::labels::PlyLabels;
use s3d_geom::glam::{DVec3, Vec2, Vec3, vec2};
use std::path::Path;

/// The columns of the element `vertex`, in the world's axes. A column that the file lacks is empty.
#[derive(Debug, Default)]
pub(crate) struct PlyVertices {
    pub(crate) positions: Vec<Vec3>,
    /// The positions in `f64`, if the mesh is to be moved nearer to the origin. Otherwise empty.
    exact: Vec<DVec3>,
    /// Of length 1; NaN for a normal without length.
    pub(crate) normals: Vec<Vec3>,
    pub(crate) colors: Vec<[u8; 3]>,
    pub(crate) uvs: Vec<Vec2>,
}

/// The names of two or three columns that belong together, in the order of search.
const POSITIONS: [[&str; 3]; 1] = [["x", "y", "z"]];
const NORMALS: [[&str; 3]; 2] = [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"]];
const COLORS: [[&str; 3]; 3] =
    [["red", "green", "blue"], ["diffuse_red", "diffuse_green", "diffuse_blue"], ["r", "g", "b"]];
const UVS: [[&str; 2]; 4] = [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

/// Returns the indices of the first names that are all there.
fn places<const N: usize>(element: &PlyElement, names: &[[&str; N]]) -> Option<[usize; N]> {
    names.iter().find_map(|names| {
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            *place = element.find_scalar(&[name])?;
        }
        Some(places)
    })
}

impl PlyVertices {
    /// Reads the current element, and its labels if they belong to vertices.
    ///
    /// # Errors
    /// Like [`PlyReader::read_batch`]; [`Error::Format`] without coordinates.
    pub(crate) fn read(
        path: &Path,
        reader: &mut PlyReader<'_>,
        element: &PlyElement,
        (up, frame): (UpAxis, FileFrame),
        mut labels: Option<&mut PlyLabels>,
    ) -> Result<Self> {
        let Some(xyz) = places(element, &POSITIONS) else {
            return Err(Error::format(path, "its vertices have no x, y and z"));
        };
        let normal = places(element, &NORMALS);
        let color = places(element, &COLORS);
        let uv = places(element, &UVS);
        let wanted = xyz
            .into_iter()
            .chain(normal.into_iter().flatten())
            .chain(color.into_iter().flatten())
            .chain(uv.into_iter().flatten());
        reader.want(wanted.chain(labels.iter().flat_map(|l| l.properties())));

        let mut out = Self::default();
        out.positions.reserve_exact(reader.plausible_rows(element));
        let mut colors = color.map(|places| Colors::new(element, places));
        let mut batch = PlyBatch::default();

        while reader.read_batch(&mut batch)? {
            // The first batch tells how far the mesh is, as the vertices of faces are not known yet.
            let is_far =
                || frame.needs_exact(vectors(&batch, xyz).fold(0.0, |m, v| m.max(v.abs().max_element())));
            if !out.exact.is_empty() || out.positions.is_empty() && is_far() {
                out.exact
                    .extend(vectors(&batch, xyz).map(|v| up.exact_world_from_file(v)));
            }

            out.positions
                .extend(vectors(&batch, xyz).map(|v| up.world_from_file(v.as_vec3())));
            if let Some(places) = normal {
                out.normals.extend(
                    vectors(&batch, places)
                        .map(|n| n.as_vec3())
                        .map(|n| up.world_from_file(n / n.length())),
                );
            }

            if let Some([u, v]) = uv {
                let pairs = batch.scalars(u).iter().zip(batch.scalars(v));
                out.uvs.extend(pairs.map(|(&u, &v)| vec2(u as f32, v as f32)));
            }
            if let Some(colors) = &mut colors {
                colors.add(&batch);
            }
            if let Some(labels) = labels.as_deref_mut() {
                labels.add(reader, &batch)?;
            }
        }

        out.colors = colors.map_or_else(Vec::new, Colors::finish);
        Ok(out)
    }

    /// Moves the vertices near the origin, if they were read for it. `corners` are the vertices of the faces.
    /// Returns the offset that was subtracted, in metres in the world's axes.
    pub(crate) fn bring_near(&mut self, frame: FileFrame, corners: &[u32]) -> DVec3 {
        let exact = std::mem::take(&mut self.exact);
        if exact.is_empty() {
            return DVec3::ZERO;
        }
        let offset_m = frame.offset_m(corners.iter().filter_map(|&v| exact.get(v as usize).copied()));
        if offset_m != DVec3::ZERO {
            self.positions = exact
                .into_iter()
                .map(|p| (p - frame.in_units(offset_m)).as_vec3())
                .collect();
        }
        offset_m
    }
}

fn vectors(batch: &PlyBatch, [x, y, z]: [usize; 3]) -> impl Iterator<Item = DVec3> {
    let [x, y, z] = [x, y, z].map(|property| batch.scalars(property));
    x.iter().zip(y).zip(z).map(|((&x, &y), &z)| DVec3::new(x, y, z))
}

/// Colours while they are read. Bytes stay bytes; other numbers wait until the largest is known.
pub(crate) struct Colors {
    pub(crate) places: [usize; 3],
    kind: PlyType,
    bytes: Vec<[u8; 3]>,
    numbers: Vec<[f32; 3]>,
}

impl Colors {
    /// Finds the columns of colours. Returns `None` if there are none.
    pub(crate) fn find(element: &PlyElement) -> Option<Self> {
        places(element, &COLORS).map(|places| Self::new(element, places))
    }

    fn new(element: &PlyElement, places: [usize; 3]) -> Self {
        let [r, g, b] = places.map(|p| element.properties.get(p).map(|p| p.kind));
        // Columns of different types are read as numbers.
        let kind = r.filter(|_| r == g && g == b).unwrap_or(PlyType::F32);
        Self { places, kind, bytes: Vec::new(), numbers: Vec::new() }
    }

    pub(crate) fn add(&mut self, batch: &PlyBatch) {
        let [r, g, b] = self.places.map(|p| batch.scalars(p));
        let rows = r.iter().zip(g).zip(b).map(|((&r, &g), &b)| [r, g, b]);
        match self.kind {
            PlyType::U8 => self.bytes.extend(rows.map(|c| c.map(|v| v as u8))),
            _ => self.numbers.extend(rows.map(|c| c.map(|v| v as f32))),
        }
    }

    /// Returns the colours as bytes. Numbers of floating point run from 0 to 1, and in some files from 0 to
    /// 255. The largest number tells the scale, with room for colours that are a little too bright. Whole
    /// numbers run to 65,535 if any is larger than 255.
    pub(crate) fn finish(self) -> Vec<[u8; 3]> {
        if self.kind == PlyType::U8 {
            return self.bytes;
        }
        let largest = self.numbers.iter().flatten().fold(0.0f32, |a, &b| a.max(b));
        let scale = if self.kind.is_integer() {
            if largest > 255.0 { 255.0 / 65_535.0 } else { 1.0 }
        } else if largest <= 2.0 {
            255.0
        } else {
            1.0
        };
        self.numbers
            .into_iter()
            .map(|c| c.map(|v| (v * scale).round().clamp(0.0, 255.0) as u8))
            .collect()
    }
}
