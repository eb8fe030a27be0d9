//! Reads Wavefront OBJ with its material libraries.
//!
//! tobj is the parser. [`NormalObj`] rewrites the text so that tobj reads it right,
//! [`crate::mesh::obj::diagnose`] finds the line of a fault, and [`ObjLooks`] reads the libraries and images.
//! This module makes a mesh of the parts.

use crate::error::{Error, Result};
use crate::fs::encoding::into_utf8;
use crate::fs::quote::count;
use crate::mesh::file::{LengthUnit, MeshFile, MeshOptions, UpAxis, checked_mesh};
use crate::mesh::obj::diagnose::{face_line, fault, vertex_error};
use crate::mesh::obj::lines::{end_lines_in_lf, logical_lines};
use crate::mesh::obj::looks::ObjLooks;
use crate::mesh::obj::normal::NormalObj;
use crate::mesh::obj::statement::exact_vertex;
use crate::mesh::obj::tiles::TiledFaces;
use crate::mesh::origin::{FileFrame, largest};
use s3d_geom::glam::{DVec3, Vec2, Vec3};
use s3d_geom::{DEFAULT_COLOR, MeshError, MeshParts, NO_INDEX, triangulate_face};
use std::borrow::Cow;
use std::path::Path;

/// Reads an OBJ file, the libraries that it names and their `map_Kd` images.
///
/// Vertices and faces keep the file's order, and vertices their number.
///
/// # Errors
/// Like [`crate::mesh::read_mesh_with`].
pub(crate) fn read_bytes(bytes: Vec<u8>, path: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let mut bytes = into_utf8(bytes);
    end_lines_in_lf(&mut bytes);
    refuse_other_files(path, &bytes)?;

    let obj = NormalObj::new(&bytes).ok_or_else(|| fault(path, &bytes, "it is damaged"))?;
    if obj.faces == 0 {
        return Err(Error::format(path, no_faces(&obj)));
    }
    if obj.counts.iter().any(|&n| n >= u64::from(NO_INDEX)) {
        return Err(Error::unsupported(
            path,
            "has more vertices than 32 bits count; cut the scan into parts",
        ));
    }

    // Decoding images takes as long as everything else, and needs only their names.
    let mut warnings = Vec::new();
    let mut remarks = Vec::new();
    let (geometry, looks) = rayon::join(
        || Columns::read(&obj).map_err(|e| fault(path, &bytes, &e.to_string())),
        || ObjLooks::load(path, &obj.names, &mut remarks),
    );
    let mut columns = geometry?;
    let mut looks = looks?;

    let unit_said = unit_in_comments(&bytes);
    warnings.extend(unit_said.filter(|_| options.units.is_none()).and_then(told));
    let frame = FileFrame::new(options.origin, options.units.or(unit_said).unwrap_or_default());
    let offset_m = columns.bring_near(&bytes, up, frame);

    let mut faces = Triangles::new(&obj, &columns)
        .map_err(|(vertex, position)| vertex_error(path, &bytes, vertex, position))?;
    let polygons_triangulated = faces.polygons;
    tell_refused(path, &bytes, &faces, &mut warnings)?;
    if let Some(first) = obj.short_faces.first() {
        let n = count(obj.short_faces.len(), "face");
        warnings.push(format!("{n} with fewer than three corners left out, the first on line {first}"));
    }
    if let Some((line, word, n)) = &obj.other_geometry {
        let n = count(*n, "statement");
        warnings.push(format!(
            "{n} of curves, surfaces or other files left out, the first `{word}` on line {line}: save them \
             as faces"
        ));
    }
    for (left_out, what) in obj.left_out.iter().zip(["vertices", "texture coordinates", "normals"]) {
        if *left_out {
            warnings.push(format!("faces name {what}, and the file has none: they are read without them"));
        }
    }
    let colors = vertex_colors(&columns.colors, &mut warnings);
    warnings.append(&mut remarks);
    let tiled =
        TiledFaces { uvs: &mut columns.uvs, face_uvs: &mut faces.uvs, face_materials: &mut faces.materials };
    looks.add_tiles(path, tiled, &mut warnings)?;

    let parts = MeshParts {
        positions: columns.positions.into_iter().map(|p| up.world_from_file(p)).collect(),
        faces: faces.triangles,
        colors,
        uvs: columns.uvs,
        face_uvs: faces.uvs,
        normals: columns
            .normals
            .into_iter()
            .map(|n| up.world_from_file(n / n.length()))
            .collect(),
        face_normals: faces.normals,
        materials: looks.materials,
        face_materials: faces.materials,
        face_tags: faces.polygon_of,
        textures: looks.textures,
    };
    let mesh = checked_mesh(parts, frame, &mut warnings).map_err(|e| match e {
        MeshError::NonFinite { vertex, position } => vertex_error(path, &bytes, vertex, position),
        source => Error::Mesh { path: path.to_owned(), source },
    })?;

    Ok(MeshFile {
        unit_said,
        texture_files: looks.files,
        warnings,
        companions: looks.companions,
        offset_m,
        polygons_triangulated,
        ..MeshFile::new(path, mesh)
    })
}

fn refuse_other_files(path: &Path, bytes: &[u8]) -> Result<()> {
    if bytes.iter().take(4096).any(|b| *b == 0) {
        return Err(Error::format(path, "is binary; a Wavefront OBJ file is text"));
    }
    Ok(())
}

/// Warns of polygons that cannot be cut.
///
/// # Errors
/// [`Error::Format`] if no face is left.
fn tell_refused(path: &Path, bytes: &[u8], faces: &Triangles, warnings: &mut Vec<String>) -> Result<()> {
    let refused = faces
        .refused
        .as_ref()
        .map(|(face, why, n)| (face_line(bytes, *face).unwrap_or(0), why, *n));
    if faces.triangles.is_empty() {
        let reason = refused.map_or_else(String::new, |(line, why, _)| format!(", as on line {line}: {why}"));
        return Err(Error::format(path, format!("has no face that can be used{reason}")));
    }
    if let Some((line, why, n)) = refused {
        warnings.push(format!("{} left out: the first, on line {line}, {why}", count(n, "polygon")));
    }
    Ok(())
}

fn no_faces(obj: &NormalObj<'_>) -> String {
    let mut message = format!("has no face, only {}", count(obj.counts[0] as usize, "vertex"));
    if obj.points_and_lines > 0 {
        message += &format!(" and {}", count(obj.points_and_lines, "point and line element"));
    }
    if let Some(line) = obj.short_faces.first() {
        message += &format!("; faces need three corners, the first that has fewer is on line {line}");
    }
    message + "; a mesh is needed"
}

/// The columns that tobj reads from a file, in the file's axes.
struct Columns {
    positions: Vec<Vec3>,
    /// As written; not finite for a vertex without a colour. Empty if no vertex has one.
    colors: Vec<[f32; 3]>,
    /// The first texture coordinate of the file, then all that corners use, in the order of their first use.
    uvs: Vec<Vec2>,
    /// Likewise; of any length.
    normals: Vec<Vec3>,
    /// For each corner of each face its index into positions, texture coordinates and normals. Each of the
    /// last two is empty if the file has none.
    corners: [Vec<u32>; 3],
    /// The number of corners of each face. Empty if every face has three.
    arities: Vec<u32>,
}

impl Columns {
    fn read(obj: &NormalObj<'_>) -> std::result::Result<Self, tobj::LoadError> {
        let (models, _) = tobj::load_obj_buf(&mut obj.reader(), &tobj::LoadOptions::default(), |_| {
            Err(tobj::LoadError::OpenFileFailed)
        })?;
        let mesh = models.into_iter().next().ok_or(tobj::LoadError::GenericFailure)?.mesh;

        // The faces in front use each vertex once.
        let vertices = obj.counts[0] as usize;
        let corners = [mesh.indices, mesh.texcoord_indices, mesh.normal_indices];
        let columns = Self {
            positions: triples(&mesh.positions).map(Vec3::from_array).collect(),
            colors: triples(&mesh.vertex_color).collect(),
            uvs: mesh
                .texcoords
                .as_chunks()
                .0
                .iter()
                .map(|uv| Vec2::from_array(*uv))
                .collect(),
            normals: triples(&mesh.normals).map(Vec3::from_array).collect(),
            corners: corners.map(|column| without_first(column, vertices)),
            arities: without_first(mesh.face_arities, obj.vertex_faces()),
        };

        // tobj passes over colours that are no numbers, and reads some that are too large for a number.
        let expected = if obj.colored > 0 { vertices } else { 0 };
        if columns.colors.len() != expected {
            return Err(tobj::LoadError::ColorParseError);
        }
        let finite = columns
            .colors
            .iter()
            .filter(|color| color.iter().all(|c| c.is_finite()))
            .count();
        if finite as u64 != obj.colored {
            Err(tobj::LoadError::ColorParseError)
        } else {
            Ok(columns)
        }
    }

    /// Moves the vertices near the origin, if `frame` asks for it. Their positions are read again for this,
    /// in `f64`, which tobj does not give. Returns the offset that was subtracted, in metres in the world's
    /// axes.
    fn bring_near(&mut self, bytes: &[u8], up: UpAxis, frame: FileFrame) -> DVec3 {
        if !frame.needs_exact(largest(&self.positions)) {
            return DVec3::ZERO;
        }
        let corners = self.corners[0].iter().filter_map(|&v| self.positions.get(v as usize));
        let offset_m = frame.offset_m(corners.map(|p| up.exact_world_from_file(p.as_dvec3())));
        if offset_m == DVec3::ZERO {
            return offset_m;
        }

        let statements = logical_lines(bytes).filter(|line| line.keyword().0 == b"v");
        for (position, line) in self.positions.iter_mut().zip(statements) {
            let exact = exact_vertex(line.keyword().1).unwrap_or(position.as_dvec3());
            // The subtraction happens in the world's axes, where a difference of 0 has no sign.
            let near = up.exact_world_from_file(exact) - frame.in_units(offset_m);
            *position = up.exact_file_from_world(near).as_vec3();
        }
        offset_m
    }
}

fn without_first(mut column: Vec<u32>, n: usize) -> Vec<u32> {
    column.drain(..column.len().min(n));
    column
}

/// Returns the unit that a comment in the head of the file names, such as `# File units = inches`.
fn unit_in_comments(bytes: &[u8]) -> Option<LengthUnit> {
    let head = bytes
        .split(|b| *b == b'\n')
        .take_while(|line| line.starts_with(b"#") || line.trim_ascii().is_empty());
    head.filter_map(|line| {
        let text = String::from_utf8_lossy(line).to_ascii_lowercase();
        let word = text.split_once("file units")?.1.trim_start_matches([' ', '=', ':']);
        LengthUnit::of_word(word.trim())
    })
    .next()
}

/// Says that a comment names another unit than metres.
fn told(unit: LengthUnit) -> Option<String> {
    (unit != LengthUnit::Metre).then(|| {
        format!(
            "a comment says that its unit is {unit}: positions are converted to metres (set units for \
             another unit)"
        )
    })
}

fn triples(flat: &[f32]) -> impl Iterator<Item = [f32; 3]> {
    flat.as_chunks().0.iter().copied()
}

/// The faces of a file, with polygons cut into triangles.
#[derive(Default)]
struct Triangles {
    triangles: Vec<[u32; 3]>,
    uvs: Vec<[u32; 3]>,
    normals: Vec<[u32; 3]>,
    materials: Vec<u32>,
    /// The polygon that each comes from.
    polygon_of: Vec<u32>,
    /// How many polygons were cut.
    polygons: usize,
    /// The polygons that cannot be cut: number of the first, from 0, its reason, and how many there are.
    refused: Option<(usize, String, usize)>,
}

impl Triangles {
    /// Cuts all polygons. The error is a polygon's vertex that is not finite, with its position.
    #[expect(
        clippy::indexing_slicing,
        reason = "tobj checked indices and counted corners; cuts index their polygon; a face is of the first \
                  kind or a later one"
    )]
    fn new(obj: &NormalObj<'_>, columns: &Columns) -> std::result::Result<Self, (u32, Vec3)> {
        let mut out = Self::default();
        let [vertices, uvs, normals] = &columns.corners;
        let mut start = 0;
        let mut kind = 0;

        for face in 0..obj.faces {
            if obj.kinds.get(kind + 1).is_some_and(|(first, _)| *first == face) {
                kind += 1;
            }
            let of_face = obj.kinds[kind].1;
            let n = columns.arities.get(face).map_or(3, |n| *n as usize);
            let corners = start..start + n;
            start += n;
            let polygon = &vertices[corners.clone()];

            let cut = if n == 3 {
                Cow::Borrowed(&[[0, 1, 2]][..])
            } else {
                let points: Vec<Vec3> = polygon.iter().map(|&v| columns.positions[v as usize]).collect();
                if let Some(bad) = points.iter().position(|p| !p.is_finite()) {
                    return Err((polygon[bad], points[bad]));
                }
                match triangulate_face(&points) {
                    Ok(cut) => {
                        out.polygons += 1;
                        Cow::Owned(cut)
                    }
                    Err(e) => {
                        out.refused.get_or_insert_with(|| (face, e.to_string(), 0)).2 += 1;
                        continue;
                    }
                }
            };

            let uvs = of_face.has_uv.then(|| &uvs[corners.clone()]);
            let normals = of_face.has_normal.then(|| &normals[corners]);
            for triangle in cut.iter() {
                let pick = |column: &[u32]| triangle.map(|c| column[c as usize]);
                out.triangles.push(pick(polygon));
                out.uvs.push(uvs.map_or([NO_INDEX; 3], pick));
                out.normals.push(normals.map_or([NO_INDEX; 3], pick));
                out.materials.push(of_face.material);
                out.polygon_of.push(face as u32);
            }
        }

        for column in [&mut out.uvs, &mut out.normals] {
            if column.iter().all(|c| *c == [NO_INDEX; 3]) {
                column.clear();
            }
        }
        if obj.names.materials.is_empty() {
            out.materials.clear();
        }
        Ok(out)
    }
}

/// Returns the colours of all vertices if any has one. Files write colours from 0 to 1, and some from 0 to
/// 255. The largest number tells the scale, with room for colours that are a little too bright.
fn vertex_colors(written: &[[f32; 3]], warnings: &mut Vec<String>) -> Vec<[u8; 3]> {
    // The largest is a number, unless no colour is.
    let largest = written.iter().flatten().fold(0.0f32, |a, &b| a.max(b));

    let scale = if largest > 2.0 { 1.0 } else { 255.0 };
    let mut without = 0;
    let colors = written.iter().map(|color| {
        if color.iter().all(|c| c.is_finite()) {
            return color.map(|c| (c * scale).round().clamp(0.0, 255.0) as u8);
        }
        without += 1;
        DEFAULT_COLOR
    });
    let colors = colors.collect();
    if without > 0 {
        warnings.push(format!("{without} of {} vertices have no colour and are made gray", written.len()));
    }
    colors
}

#[cfg(test)]
pub(crate) fn read(path: &Path, up: UpAxis) -> Result<MeshFile> {
    read_bytes(crate::fs::open::read_file(path)?, path, up, &MeshOptions::default())
}

#[cfg(test)]
mod tests;
