//! The faces of a PLY mesh: polygons, and strips of triangles.

use crate::error::{Error, Result};
use crate::mesh::ply::batch::PlyBatch;
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::ply::header::PlyElement;
use crate::mesh::ply::labels::PlyLabels;
use crate::mesh::ply::vertices::Colors;
use s3d_geom::glam::{Vec2, Vec3, vec2};
use s3d_geom::{NO_INDEX, triangulate_face};
use std::path::Path;

/// The columns of the element `face`. A row is a polygon.
#[derive(Debug, Default)]
pub(crate) struct PlyFaces {
    /// The corners of all polygons, one after the other, as vertex indices.
    corners: Vec<u32>,
    /// The number of corners of each polygon.
    sizes: Vec<u32>,
    /// A texture coordinate for each corner; NaN for a polygon without any. Empty if no polygon has any.
    uvs: Vec<Vec2>,
    /// The texture of each polygon, or [`NO_INDEX`]. Empty if the file does not tell.
    textures: Vec<u32>,
    /// The colour of each polygon. Empty if the file has none.
    pub(crate) colors: Vec<[u8; 3]>,
    /// How many polygons have a list of texture coordinates that is neither empty nor two numbers a corner.
    pub(crate) odd_uvs: usize,
}

const CORNERS: [&str; 4] = ["vertex_indices", "vertex_index", "vertex_indexes", "vertices"];

impl PlyFaces {
    /// Reads the current element, and its labels if they belong to faces. `vertices` is the number of
    /// vertices.
    ///
    /// # Errors
    /// Like [`PlyReader::read_batch`]; [`Error::Format`] if the list of corners is missing or names a vertex
    /// that is not there.
    pub(crate) fn read(
        path: &Path,
        reader: &mut PlyReader<'_>,
        element: &PlyElement,
        vertices: u64,
        mut labels: Option<&mut PlyLabels>,
    ) -> Result<Self> {
        let corners = corner_list(path, element)?;
        let uv = element.find_list(&["texcoord", "texcoords"]);
        let texture = element.find_scalar(&["texnumber"]);
        let mut colors = Colors::find(element);
        let of_colors = colors.iter().flat_map(|colors| colors.places);
        let wanted = std::iter::once(corners).chain(uv).chain(texture).chain(of_colors);
        reader.want(wanted.chain(labels.iter().flat_map(|l| l.properties())));

        let mut out = Self::default();
        let rows = reader.plausible_rows(element);
        out.sizes.reserve_exact(rows);
        out.corners.reserve(rows.saturating_mul(3));
        let mut batch = PlyBatch::default();
        while reader.read_batch(&mut batch)? {
            for row in 0..batch.len() {
                let polygon = batch.list(corners, row);
                for &corner in polygon {
                    if !(corner >= 0.0 && corner < vertices as f64) {
                        let message = format!("vertex {corner} is not there; there are {vertices}");
                        return Err(reader.fail(&batch, row, message));
                    }
                    out.corners.push(corner as u32);
                }
                out.sizes.push(polygon.len() as u32);

                if let Some(uv) = uv {
                    let uvs = batch.list(uv, row);
                    let fits = uvs.len() == 2 * polygon.len();
                    out.odd_uvs += usize::from(!fits && !uvs.is_empty());
                    if fits {
                        out.uvs
                            .extend(uvs.as_chunks().0.iter().map(|&[u, v]| vec2(u as f32, v as f32)));
                    } else {
                        out.uvs.extend(polygon.iter().map(|_| Vec2::NAN));
                    }
                }
            }

            if out.corners.len() >= NO_INDEX as usize {
                return Err(Error::format(
                    path,
                    "has more corners than 32 bits count; cut the scan into parts",
                ));
            }

            if let Some(texture) = texture {
                out.textures
                    .extend(batch.scalars(texture).iter().map(|&n| texture_index(n)));
            }
            if let Some(colors) = &mut colors {
                colors.add(&batch);
            }
            if let Some(labels) = labels.as_deref_mut() {
                labels.add(reader, &batch)?;
            }
        }
        out.colors = colors.map_or_else(Vec::new, Colors::finish);
        if out.uvs.iter().all(|uv| uv.is_nan()) {
            out.uvs.clear();
        }
        Ok(out)
    }

    /// Returns the corners of all polygons, as vertex indices.
    pub(crate) fn corners(&self) -> &[u32] {
        &self.corners
    }

    /// Adds the triangles of the element `tristrips`. Each list holds vertices, of which each three
    /// neighbours are a triangle; −1 starts a new strip.
    ///
    /// # Errors
    /// Like [`PlyFaces::read`].
    pub(crate) fn read_strips(
        &mut self,
        path: &Path,
        reader: &mut PlyReader<'_>,
        element: &PlyElement,
        vertices: u64,
    ) -> Result<()> {
        let list = corner_list(path, element)?;
        reader.want([list]);
        let mut batch = PlyBatch::default();

        while reader.read_batch(&mut batch)? {
            for row in 0..batch.len() {
                let mut strip: Vec<u32> = Vec::new();
                for &corner in batch.list(list, row) {
                    if corner < 0.0 {
                        strip.clear();
                        continue;
                    }
                    if corner >= vertices as f64 {
                        let message = format!("vertex {corner} is not there; there are {vertices}");
                        return Err(reader.fail(&batch, row, message));
                    }

                    strip.push(corner as u32);
                    // Every other triangle is turned over. A triangle that repeats a vertex only leads to the
                    // next.
                    if let &[.., a, b, c] = strip.as_slice()
                        && a != b
                        && b != c
                        && c != a
                    {
                        self.corners
                            .extend(if strip.len() % 2 == 1 { [a, b, c] } else { [b, a, c] });
                        self.sizes.push(3);
                    }
                }
            }
        }
        Ok(())
    }

    /// Adds the triangles of strips that were read before the polygons.
    pub(crate) fn append_strips(&mut self, strips: Self) {
        self.corners.extend(strips.corners);
        self.sizes.extend(strips.sizes);
    }

    /// Cuts the polygons into triangles.
    pub(crate) fn triangles(&self, positions: &[Vec3]) -> PlyTriangles {
        let mut out = PlyTriangles::default();
        out.faces.reserve(self.sizes.len());
        let mut start = 0usize;
        let mut points = Vec::new();

        for (polygon, &size) in self.sizes.iter().enumerate() {
            let Some(corners) = self.corners.get(start..).and_then(|c| c.get(..size as usize)) else { break };
            let mut add = |triangle: [u32; 3]| {
                // A corner beyond 32 bits has no coordinates on the texture.
                out.faces
                    .push(triangle.map(|c| corners.get(c as usize).copied().unwrap_or(NO_INDEX)));
                out.corners.push(
                    triangle.map(|c| u32::try_from(start.saturating_add(c as usize)).unwrap_or(NO_INDEX)),
                );
                out.polygons.push(u32::try_from(polygon).unwrap_or(NO_INDEX));
            };

            match size {
                0..3 => {
                    out.short_first.get_or_insert(polygon);
                    out.short += 1;
                }
                3 => add([0, 1, 2]),
                _ => {
                    points.clear();
                    points.extend(
                        corners
                            .iter()
                            .map(|&c| positions.get(c as usize).copied().unwrap_or(Vec3::NAN)),
                    );
                    match triangulate_face(&points) {
                        Ok(cut) => {
                            cut.into_iter().for_each(add);
                            out.cut += 1;
                        }
                        Err(e) => out.refused.get_or_insert_with(|| (polygon, e.to_string(), 0)).2 += 1,
                    }
                }
            }

            start = start.saturating_add(size as usize);
        }
        out
    }

    /// Takes the texture coordinates of corners, and for each triangle the indices of its three. Returns
    /// `None` if there are none.
    pub(crate) fn take_uvs(&mut self, triangles: &PlyTriangles) -> Option<(Vec<Vec2>, Vec<[u32; 3]>)> {
        if self.uvs.is_empty() {
            return None;
        }
        let uvs = std::mem::take(&mut self.uvs);
        let here = |corner: u32| uvs.get(corner as usize).is_some_and(|uv| !uv.is_nan());
        let indices = triangles.corners.iter();
        let indices = indices
            .map(|&c| if c.iter().all(|&c| here(c)) { c } else { [NO_INDEX; 3] })
            .collect();
        Some((uvs, indices))
    }

    /// Returns the texture of each triangle: the first texture if the file does not tell.
    pub(crate) fn textures(&self, triangles: &PlyTriangles) -> Vec<u32> {
        triangles
            .polygons
            .iter()
            .map(|&polygon| self.textures.get(polygon as usize).copied().unwrap_or(0))
            .collect()
    }
}

/// The triangles of all polygons.
#[derive(Debug, Default)]
pub(crate) struct PlyTriangles {
    /// Their vertices.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Their corners, counted over all polygons.
    corners: Vec<[u32; 3]>,
    /// The polygon that each belongs to.
    pub(crate) polygons: Vec<u32>,
    /// How many polygons were cut.
    pub(crate) cut: usize,
    /// How many polygons have fewer than three corners, and the first of them.
    pub(crate) short: usize,
    pub(crate) short_first: Option<usize>,
    /// The polygons that cannot be cut: number of the first, its reason, and how many there are.
    pub(crate) refused: Option<(usize, String, usize)>,
}

/// Finds the list of corners: by its name, or else the only list of integers.
fn corner_list(path: &Path, element: &PlyElement) -> Result<usize> {
    let mut lists = element
        .properties
        .iter()
        .enumerate()
        .filter(|(_, p)| p.is_list() && p.kind.is_integer());
    let only = lists.next().filter(|_| lists.next().is_none()).map(|(place, _)| place);
    element.find_list(&CORNERS).or(only).ok_or_else(|| {
        let names: Vec<&str> = element.properties.iter().map(|p| p.name.as_str()).collect();
        let name = &element.name;
        let names = names.join(", ");
        Error::format(path, format!("the element \"{name}\" has no list vertex_indices, only: {names}"))
    })
}

fn texture_index(number: f64) -> u32 {
    if number >= 0.0 && number < f64::from(NO_INDEX) {
        number as u32
    } else {
        NO_INDEX
    }
}
